// The list of jobs: filtered, sorted, paged, live, and changed many at a time.

import { Problem, Watched, send } from './client.js';
import { confirmed, el, fill, notice, refused, repeat, rested, text } from './dom.js';
import { count, errorOf, isBiased, part, percent, samples, seconds, since, when } from './format.js';

const STATES = ['', 'running', 'queued', 'paused', 'done', 'failed', 'cancelled'];
const PACE = 2000;
/** Milliseconds between two pictures of a job that is not over. */
const REST = 4000;
/** How often a picture that is not there is asked for. */
const TRIES = 5;
/** What is chosen stays while the page is open. */
const view = { state: '', text: '', limit: 50, cursors: [], sort: null, down: false };

/** What is shown of each job, and what the farm sorts all of them by. */
const COLUMNS = [
  { key: 'name', title: 'Job' },
  { key: 'state', title: 'State' },
  { key: 'progress', title: 'Progress' },
  { key: 'error', title: 'Error' },
  { key: 'eta', title: 'Time' },
  { key: 'workers', title: 'Workers' },
  { key: 'priority', title: 'Priority' },
  { key: 'created', title: 'Came' },
];

/** A state as a word with a mark of its own, so that colour is not needed to tell it. */
export function badge(state) {
  return el('span', { class: `badge ${state}` }, state);
}

/** A picture of a job, fetched when it is seen and again when there is more of it. */
class Thumbnail {
  static #watch = new IntersectionObserver((seen) => {
    for (const { target, isIntersecting } of seen) {
      target.thumbnail.seen = isIntersecting;
      target.thumbnail.load();
    }
  }, { rootMargin: '100px' });

  static #running = 0;
  static #waiting = [];

  constructor(signal) {
    this.node = el('span', { class: 'thumb', 'aria-hidden': 'true' });
    this.node.thumbnail = this;
    this.watched = new Watched();
    this.signal = signal;
    this.failed = 0;
    Thumbnail.#watch.observe(this.node);
  }

  update(job) {
    this.job = job;
    const key = `${job.batches_done}.${job.state}`;
    if (key !== this.key) this.failed = 0;
    this.key = key;
    this.load();
  }

  load() {
    if (!this.seen || this.loaded === this.key || this.failed >= TRIES || this.signal.aborted || !(this.job?.samples_done > 0)) return;
    const rest = this.job.state === 'done' ? 0 : (this.at ?? 0) + REST - Date.now();
    if (rest > 0) return this.#later(rest);
    this.loaded = this.key;
    this.at = Date.now();
    Thumbnail.#waiting.push(this);
    Thumbnail.#next();
  }

  #later(rest) {
    this.timer ??= setTimeout(() => {
      this.timer = null;
      this.load();
    }, rest);
  }

  static #next() {
    if (Thumbnail.#running >= 2) return;
    const one = Thumbnail.#waiting.shift();
    if (!one) return;
    Thumbnail.#running += 1;
    one.#fetch().finally(() => {
      Thumbnail.#running -= 1;
      Thumbnail.#next();
    });
  }

  async #fetch() {
    try {
      if (this.signal.aborted) return;
      const response = await this.watched.get(`/v1/jobs/${this.job.id}/image.png?width=96`, { signal: this.signal });
      if (!response) return;
      const bitmap = await createImageBitmap(await response.blob());
      const canvas = el('canvas', { width: bitmap.width, height: bitmap.height });
      canvas.getContext('2d').drawImage(bitmap, 0, 0);
      fill(this.node, canvas);
      this.failed = 0;
    } catch (error) {
      if (!(error instanceof Problem) && error.name !== 'AbortError') throw error;
      // What was not there yet is asked for again, but not for ever.
      this.loaded = null;
      this.failed += 1;
      this.#later(REST);
    }
  }
}

class Row {
  constructor(job, signal, chosen) {
    this.thumbnail = new Thumbnail(signal);
    this.box = el('input', { type: 'checkbox', 'data-needs': 'submit', 'aria-label': `Choose ${job.name}`, onchange: chosen });
    this.name = el('a', { href: `#/job/${job.id}` });
    this.under = el('span', { class: 'under' });
    this.state = el('td', { class: 'c-state' });
    this.bar = el('progress', { max: 1, 'aria-label': `Progress of ${job.name}` });
    this.done = el('span', { class: 'under' });
    this.error = el('span');
    this.target = el('span', { class: 'under' });
    this.time = el('span');
    this.ran = el('span', { class: 'under' });
    this.workers = el('td', { class: 'c-workers number', 'data-title': 'workers' });
    this.priority = el('td', { class: 'c-priority number', 'data-title': 'priority' });
    this.came = el('td', { class: 'c-created number' });
    this.node = el('tr', {},
      el('td', { class: 'c-box' }, this.box),
      el('td', { class: 'c-name' }, el('div', { class: 'named' }, this.thumbnail.node, el('div', {}, this.name, this.under))),
      this.state,
      el('td', { class: 'c-progress' }, this.bar, this.done),
      el('td', { class: 'c-error number' }, this.error, this.target),
      el('td', { class: 'c-eta number' }, this.time, this.ran),
      this.workers, this.priority, this.came);
  }

  update(job) {
    this.job = job;
    this.thumbnail.update(job);
    text(this.name, job.name);
    text(this.under, `${job.settings.size.width}×${job.settings.size.height} · ${job.method}`);
    if (this.shown !== job.state) fill(this.state, badge(job.state));
    this.shown = job.state;
    this.bar.value = part(job);
    text(this.done, job.state === 'done' ? `${samples(job.samples_done)} samples` : `${samples(job.samples_done)} of ${samples(job.samples_asked)} samples`);
    const error = errorOf(job);
    text(this.error, error ? `${error.now}` : '–');
    const upper = isBiased(job) ? null : error?.upper;
    this.error.title = upper ? `at most ${upper} with 95 % confidence` : '';
    const target = job.error_target;
    text(this.target, target ? `${job.certified ? 'certified' : 'target'} ≤\u00a0${percent(target)}` : upper ? `≤\u00a0${upper}` : '');
    const running = job.state === 'running';
    text(this.time, running && job.eta_seconds !== undefined ? `${seconds(job.eta_seconds)} left` : job.started_at ? seconds(job.wall_seconds) : '–');
    text(this.ran, running && job.eta_seconds !== undefined ? `after ${seconds(job.wall_seconds)}` : '');
    text(this.workers, job.workers || '–');
    text(this.priority, job.priority);
    text(this.came, since(job.created_at) < 86400 ? new Date(job.created_at).toLocaleTimeString([], { hour: '2-digit', minute: '2-digit' }) : when(job.created_at));
  }
}

/** Shows the list until `signal` ends. */
export async function show(root, { signal }) {
  document.title = 'Jobs · ovtigre';
  const rows = new Map();
  const watched = new Watched();
  let next = null;
  let items = [];

  const body = el('tbody');
  const bulk = el('div', { class: 'bulk', hidden: true, role: 'group', 'aria-label': 'Change the chosen jobs' });
  const picked = () => [...rows.values()].filter((row) => row.box.checked);
  const all = el('input', { type: 'checkbox', 'data-needs': 'submit', 'aria-label': 'Choose all shown', onchange: () => {
    for (const row of rows.values()) row.box.checked = all.checked;
    choose();
  } });
  const heads = COLUMNS.map((column) => {
    const button = el('button', { type: 'button', class: 'sort', onclick: () => {
      view.down = view.sort === column.key ? !view.down : false;
      view.sort = view.sort === column.key && !view.down ? null : column.key;
      view.cursors = [];
      arrange();
      turn();
    } }, column.title);
    return el('th', { scope: 'col', class: `c-${column.key}` }, button);
  });
  const empty = el('div', { class: 'empty', hidden: true });
  const where = el('p', { class: 'where', role: 'status' });
  const older = el('button', { type: 'button', onclick: () => { view.cursors.push(next); turn(); } }, 'Older');
  const newer = el('button', { type: 'button', onclick: () => { view.cursors.pop(); turn(); } }, 'Newer');

  const search = el('input', { type: 'search', placeholder: 'Name or id', 'aria-label': 'Find jobs by name or id', value: view.text,
    oninput: rested(() => { view.text = search.value.trim(); view.cursors = []; turn(); }, 200) });
  const filters = STATES.map((state) => el('button', { type: 'button', 'aria-pressed': String(view.state === state), onclick: () => {
    view.state = state;
    view.cursors = [];
    filters.forEach((button, i) => button.setAttribute('aria-pressed', String(STATES[i] === state)));
    turn();
  } }, state || 'all'));
  const limit = el('select', { 'aria-label': 'Jobs on a page', onchange: () => { view.limit = Number(limit.value); view.cursors = []; turn(); } },
    [25, 50, 100, 250].map((n) => el('option', { value: n, selected: n === view.limit }, `${n} a page`)));

  root.append(
    el('div', { class: 'head' }, el('h1', {}, 'Jobs'), el('a', { class: 'button primary', href: '#/new', 'data-needs': 'submit' }, 'New job')),
    el('div', { class: 'tools' }, el('div', { class: 'switch', role: 'group', 'aria-label': 'Jobs in the state' }, filters), search, limit),
    bulk,
    el('div', { class: 'panel flush' },
      el('table', { class: 'jobs-table' }, el('caption', { class: 'sr' }, 'Jobs, the newest first'), el('thead', {}, el('tr', {}, el('td', { class: 'c-box' }, all), heads)), body),
      empty),
    el('div', { class: 'pages' }, where, el('div', { class: 'row' }, newer, older)));

  const change = async (title, apply) => {
    const chosen = picked();
    const results = await Promise.allSettled(chosen.map((row) => apply(row.job)));
    const failed = results.filter((result) => result.status === 'rejected');
    if (failed.length > 0) notice(`${title}: ${count(failed.length)} of ${count(chosen.length)} were not changed. ${failed[0].reason.message}`, 'error');
    else notice(`${title}: ${count(chosen.length)} ${chosen.length === 1 ? 'job' : 'jobs'}.`);
    for (const row of chosen) row.box.checked = false;
    choose();
    watched.forget();
    await load();
  };
  const patch = (json) => (job) => send(`/v1/jobs/${job.id}`, { method: 'PATCH', json, headers: { 'if-match': `"${job.version}"` } });
  const chosenCount = el('strong');
  bulk.append(chosenCount,
    el('button', { type: 'button', onclick: () => change('Paused', patch({ state: 'paused' })) }, 'Pause'),
    el('button', { type: 'button', onclick: () => change('Resumed', patch({ state: 'running' })) }, 'Resume'),
    el('button', { type: 'button', class: 'danger', onclick: async () => {
      const n = picked().length;
      if (await confirmed(`Cancel ${count(n)} ${n === 1 ? 'job' : 'jobs'}? What is rendered of them stays.`, 'Cancel them')) {
        await change('Cancelled', (job) => send(`/v1/jobs/${job.id}`, { method: 'DELETE' }));
      }
    } }, 'Cancel'));

  function choose() {
    const n = picked().length;
    bulk.hidden = n === 0;
    text(chosenCount, `${count(n)} chosen`);
    all.checked = n > 0 && n === rows.size;
    all.indeterminate = n > 0 && n < rows.size;
  }

  function arrange() {
    COLUMNS.forEach((column, i) => heads[i].setAttribute('aria-sort', view.sort !== column.key ? 'none' : view.down ? 'descending' : 'ascending'));
    items.forEach((job, i) => {
      const { node } = rows.get(job.id);
      if (body.children[i] !== node) body.insertBefore(node, body.children[i] ?? null);
    });
  }

  function draw(page) {
    ({ items, next } = page);
    const here = new Set(items.map((job) => job.id));
    for (const [id, row] of rows) {
      if (!here.has(id)) {
        row.node.remove();
        rows.delete(id);
      }
    }
    for (const job of items) {
      if (!rows.has(job.id)) rows.set(job.id, new Row(job, signal, choose));
      rows.get(job.id).update(job);
    }
    arrange();
    choose();
    const filtered = view.state || view.text;
    empty.hidden = items.length > 0;
    if (items.length === 0) {
      fill(empty, el('p', {}, filtered ? 'No job is like that.' : 'There is no job yet.'),
        filtered ? null : [el('p', { 'data-needs': 'submit' }, el('a', { class: 'button primary', href: '#/new' }, 'Render a scene')), refused('submit', 'render scenes')]);
    }
    const from = view.cursors.length * view.limit;
    text(where, items.length > 0 ? `${count(from + 1)}–${count(from + items.length)}${view.sort ? '' : ', the newest first'}` : '');
    older.disabled = !next;
    newer.disabled = view.cursors.length === 0;
    if (!performance.getEntriesByName('ovtigre-ready').length) performance.mark('ovtigre-ready');
  }

  let turning = 0;
  async function load() {
    const query = new URLSearchParams({ limit: view.limit });
    if (view.state) query.set('state', view.state);
    if (view.text) query.set('text', view.text);
    if (view.sort) query.set('sort', `${view.down ? '-' : ''}${view.sort}`);
    if (view.cursors.length) query.set('cursor', view.cursors.at(-1));
    const mine = turning;
    try {
      const response = await watched.get(`/v1/jobs?${query}`, { signal });
      if (response && mine === turning) draw(await response.json());
      root.classList.remove('stale');
    } catch (error) {
      if (error.name === 'AbortError') return;
      root.classList.add('stale');
      if (rows.size === 0) {
        empty.hidden = false;
        fill(empty, el('p', {}, error.message));
      }
    }
  }

  function turn() {
    turning += 1;
    // Where a page ends is known when it is there.
    older.disabled = true;
    newer.disabled = true;
    watched.forget();
    load();
  }

  repeat(PACE, signal, load);
}
