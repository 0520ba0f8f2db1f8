// Calls to the farm: JSON, problems, tags, events, uploads. The token is kept for the session of this tab only.

const KEY = 'ovtigre.token';

/** The token, where the user has signed in. */
export const token = () => sessionStorage.getItem(KEY);

/** Whether the token may do what takes one of role `submit`, as far as the farm has said. */
export const maySubmit = () => !['read', 'work'].includes(document.documentElement.dataset.role);

/** Keeps or forgets the token. */
export function keepToken(value) {
  if (value) sessionStorage.setItem(KEY, value);
  else sessionStorage.removeItem(KEY);
  dispatchEvent(new Event('ovtigre-token'));
}

/** What went wrong: a problem document (RFC 9457), or no answer at all. */
export class Problem extends Error {
  constructor(document) {
    super(document.detail || document.title);
    this.status = document.status;
    this.kind = document.type ?? '';
    this.errors = document.errors ?? [];
  }
}

function heads(further = {}) {
  const bearer = token();
  return bearer ? { ...further, authorization: `Bearer ${bearer}` } : further;
}

async function problem(response) {
  const document = await response.json().catch(() => ({}));
  if (response.status === 401) dispatchEvent(new Event('ovtigre-sign-in'));
  return new Problem({ title: `the farm answered ${response.status}`, status: response.status, ...document });
}

/** Sends a call; the response, unless it is a problem. 304 is none. */
export async function send(path, { method = 'GET', json, headers = {}, signal } = {}) {
  const body = json === undefined ? undefined : JSON.stringify(json);
  const all = heads(body === undefined ? headers : { 'content-type': 'application/json', ...headers });
  let response;
  try {
    response = await fetch(path, { method, body, headers: all, signal, cache: 'no-store' });
  } catch (error) {
    if (error.name === 'AbortError') throw error;
    throw new Problem({ title: 'the farm cannot be reached', status: 0 });
  }
  if (!response.ok && response.status !== 304) throw await problem(response);
  return response;
}

/** Fetches JSON. */
export const get = async (path, options) => (await send(path, options)).json();

/** A document that is asked for again and again: `null` where it is as before. */
export class Watched {
  #tag = null;

  async get(path, options = {}) {
    const headers = this.#tag?.path === path ? { 'if-none-match': this.#tag.tag } : {};
    const response = await send(path, { ...options, headers });
    if (response.status === 304) return null;
    this.#tag = { path, tag: response.headers.get('etag') };
    return response;
  }

  /** Forgets what was seen: the next answer is a whole one. */
  forget() {
    this.#tag = null;
  }
}

/** Events of a stream (server-sent events), over all its interruptions; ends where the farm says so. */
export async function* events(path, signal) {
  let last = null;
  let wait = 500;
  while (!signal.aborted) {
    try {
      const headers = last ? { 'last-event-id': last } : {};
      const response = await send(path, { headers, signal });
      if (response.status === 204) return;
      for await (const event of read(response.body)) {
        wait = 500;
        last = event.id ?? last;
        yield event;
      }
    } catch (error) {
      if (error.name === 'AbortError' || [401, 403, 404].includes(error.status)) return;
    }
    await new Promise((resolve) => setTimeout(resolve, wait));
    wait = Math.min(wait * 2, 15000);
  }
}

async function* read(body) {
  const reader = body.pipeThrough(new TextDecoderStream()).getReader();
  let rest = '';
  for (;;) {
    const { value, done } = await reader.read();
    if (done) return;
    const blocks = (rest + value).split(/\r?\n\r?\n/);
    rest = blocks.pop();
    for (const block of blocks) {
      const fields = block.split(/\r?\n/).map((line) => line.match(/^(\w+): ?(.*)$/)).filter(Boolean);
      const field = (name) => fields.filter(([, key]) => key === name).map(([, , text]) => text);
      const data = field('data').join('\n');
      if (data) yield { id: field('id').at(-1), data: JSON.parse(data) };
    }
  }
}

/** One PUT of bytes whose progress is told; the status and what was answered. */
function putBytes(path, blob, headers, progress, signal) {
  return new Promise((resolve, reject) => {
    const request = new XMLHttpRequest();
    request.open('PUT', path);
    for (const [name, value] of Object.entries(heads({ 'content-type': 'application/octet-stream', ...headers }))) {
      request.setRequestHeader(name, value);
    }
    request.responseType = 'json';
    request.upload.onprogress = (event) => progress(event.loaded);
    request.onload = () => {
      if (request.status < 300) resolve({ status: request.status, answer: request.response });
      else reject(new Problem({ title: `the farm answered ${request.status}`, status: request.status, ...request.response }));
    };
    request.onerror = () => reject(new Problem({ title: 'the upload was cut off', status: 0 }));
    request.onabort = () => reject(new DOMException('the upload was given up', 'AbortError'));
    signal?.addEventListener('abort', () => request.abort(), { once: true });
    request.send(blob);
  });
}

// Larger files go in parts of this size, so that one that is cut off goes on where it was.
const PART = 8 << 20;
const TRIES = 6;

/** Uploads bytes under their hash; `progress` is told the part that is there. */
export async function upload(path, blob, progress, signal, size = PART) {
  if (blob.size <= size) return (await putBytes(path, blob, {}, (sent) => progress(sent / blob.size), signal)).answer;
  let at = null;
  for (let failures = 0; ;) {
    try {
      const end = at === null ? 0 : Math.min(at + size, blob.size);
      const range = at === null ? `bytes */${blob.size}` : `bytes ${at}-${end - 1}/${blob.size}`;
      const { status, answer } = await putBytes(path, blob.slice(at ?? 0, end), { 'content-range': range }, (sent) => progress(((at ?? 0) + sent) / blob.size), signal);
      if (status !== 202) return answer;
      at = answer.received;
      failures = 0;
      // All is there, and somebody else's part was the last.
      if (at >= blob.size) return await get(path, { signal });
    } catch (error) {
      failures += 1;
      if (error.status !== 0 || failures >= TRIES) throw error;
      await new Promise((resolve) => setTimeout(resolve, 500 * 2 ** failures));
      at = null;
    }
  }
}

/** Saves a blob as a file of the user's. */
export function save(blob, name) {
  const address = URL.createObjectURL(blob);
  const link = document.createElement('a');
  link.href = address;
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(address), 60000);
}
