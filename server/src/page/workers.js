// Who renders: how fast, on what, what failed, who was put aside and why; and how many more there could be.

import { get, send } from './client.js';
import { confirmed, el, fill, notice, refused, renew, repeat, text } from './dom.js';
import { count, seconds, short, since, when } from './format.js';

const PACE = 2000;

/** A worker as a row of a table. */
export function workerRow(worker, actions) {
  const name = worker.job ? el('a', { href: `#/job/${worker.job}` }, worker.job) : '–';
  return el('tr', {},
    el('th', { scope: 'row' }, worker.name, el('span', { class: 'under' }, `${worker.instruction_set} · ${worker.build}`)),
    el('td', {}, el('span', { class: `badge ${worker.state}` }, worker.state), worker.reason ? el('span', { class: 'under wide' }, worker.reason) : null),
    el('td', { class: 'number' }, `${short(worker.rays_per_second)}`, el('span', { class: 'under' }, 'rays/s')),
    el('td', { class: 'number' }, count(worker.threads)),
    el('td', { class: 'number' }, count(worker.batches_done), el('span', { class: 'under' }, `${count(worker.leases)} in hand`)),
    el('td', { class: worker.failures > 0 ? 'number bad' : 'number' }, count(worker.failures)),
    actions ? el('td', {}, name) : null,
    actions ? el('td', {}, worker.tags.length > 0 ? worker.tags.map((tag) => el('span', { class: 'tag' }, tag)) : '–') : null,
    el('td', { class: 'number', title: when(worker.seen_at) }, `${seconds(Math.max(0, since(worker.seen_at)))} ago`),
    actions ? el('td', {}, actions(worker)) : null);
}

/** The head of such a table. */
export function workerHeads(more) {
  const names = ['Worker', 'State', 'Speed', 'Threads', 'Batches', 'Failures', ...(more ? ['Job', 'Tags'] : []), 'Heard'];
  const cells = names.map((name, i) => el('th', { scope: 'col', class: (i >= 2 && i <= 5) || name === 'Heard' ? 'number' : null }, name));
  return el('thead', {}, el('tr', {}, cells, more ? el('td', {}) : null));
}

/** All workers of a farm, page by page. */
export async function allWorkers(signal) {
  const items = [];
  let cursor = null;
  do {
    const page = await get(`/v1/workers?limit=500${cursor ? `&cursor=${cursor}` : ''}`, { signal });
    items.push(...page.items);
    cursor = page.next;
  } while (cursor && items.length < 5000);
  return items;
}

/** Shows the workers until `signal` ends. */
export async function show(root, { signal }) {
  document.title = 'Workers · ovtigre';
  const body = el('tbody');
  const facts = { active: el('dd'), desired: el('dd'), waiting: el('dd'), speed: el('dd') };
  const gone = el('input', { type: 'checkbox', onchange: () => load() });
  const empty = el('div', { class: 'empty', hidden: true },
    el('p', {}, 'Nobody works here.'),
    el('p', {}, el('code', {}, `ovtigre work --server ${location.origin}`)));
  root.append(
    el('div', { class: 'head' }, el('h1', {}, 'Workers'), refused('admin', 'drain workers'), el('label', { class: 'check' }, gone, 'also those that left')),
    el('dl', { class: 'numbers' },
      el('div', {}, el('dt', {}, 'Working'), facts.active),
      el('div', {}, el('dt', {}, 'Could work now'), facts.desired),
      el('div', {}, el('dt', {}, 'Batches waiting'), facts.waiting),
      el('div', {}, el('dt', {}, 'Rays a second'), facts.speed)),
    el('div', { class: 'panel flush scroll', tabindex: 0, role: 'region', 'aria-label': 'Workers' },
      el('table', {}, el('caption', { class: 'sr' }, 'Workers, the newest first'), workerHeads(true), body), empty));

  const drain = (worker) => {
    if (!['active', 'aside', 'lost'].includes(worker.state)) return null;
    const title = worker.state === 'lost' ? 'Let go' : 'Drain';
    return el('button', { type: 'button', class: 'small', 'aria-label': `${title} ${worker.name}`, 'data-worker': worker.id, 'data-needs': 'admin', onclick: async () => {
      if (!await confirmed(`${title} ${worker.name}? It gets no more batches.`, title)) return;
      try {
        await send(`/v1/workers/${worker.id}`, { method: 'DELETE' });
        notice(`${worker.name} gets no more batches.`);
      } catch (error) {
        notice(error.message, 'error');
      }
      load();
    } }, title);
  };

  async function load() {
    try {
      const [workers, scaling] = await Promise.all([allWorkers(signal), get('/v1/scaling', { signal })]);
      const shown = workers.filter((worker) => gone.checked || worker.state !== 'gone');
      renew(body, shown.map((worker) => workerRow(worker, drain)));
      empty.hidden = shown.length > 0;
      text(facts.active, count(scaling.active_workers));
      text(facts.desired, count(scaling.desired_workers));
      text(facts.waiting, count(scaling.batches_waiting));
      text(facts.speed, short(workers.filter((w) => w.state === 'active' && w.leases > 0).reduce((sum, w) => sum + w.rays_per_second, 0)));
    } catch (error) {
      if (error.name === 'AbortError') return;
      empty.hidden = false;
      fill(empty, el('p', {}, error.message));
    }
  }

  await repeat(PACE, signal, load);
}
