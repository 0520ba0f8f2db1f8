// A job: its picture, how good it is and will be, who works at it, what was left out, and what can be done with it.

import { events, get, save, send, token } from './client.js';
import { asked, confirmed, el, fill, notice, pause, refused, renew, repeat, text } from './dom.js';
import { count, digits, errorOf, isBiased, part, percent, samples, seconds, short, when } from './format.js';
import { badge } from './jobs.js';
import { plot, table } from './plot.js';
import { Viewer } from './viewer.js';
import { allWorkers, workerHeads, workerRow } from './workers.js';

const OVER = ['done', 'failed', 'cancelled'];
/** Lines of the log. */
const LINES = 100;

class JobView {
  constructor(root, job, signal) {
    this.job = job;
    this.signal = signal;
    this.axis = 'wall_seconds';
    this.log = [];
    this.viewer = new Viewer(job, signal);
    this.title = el('h1');
    this.state = el('span');
    this.actions = el('div', { class: 'row wrap actions', role: 'group', 'aria-label': 'Change this job', 'data-needs': 'submit' });
    this.reason = el('p', { class: 'reason', role: 'status' });
    this.bar = el('progress', { max: 1, 'aria-label': 'Samples drawn' });
    this.facts = el('dl', { class: 'facts' });
    this.numbers = el('dl', { class: 'numbers' });
    this.plot = el('div', { class: 'plot-space' });
    this.curveTable = el('div', { class: 'scroll', tabindex: 0, role: 'region', 'aria-label': 'Error at each checkpoint' });
    this.fit = el('p', { class: 'hint' });
    this.why = el('div');
    this.workers = el('tbody');
    this.nobody = el('p', { class: 'empty' }, 'Nobody works at it now.');
    this.journal = el('ol', { class: 'log', tabindex: 0, 'aria-label': 'Log' });
    const axis = (key, title) => el('button', { type: 'button', 'aria-pressed': String(this.axis === key), onclick: (event) => {
      this.axis = key;
      for (const other of event.target.parentNode.children) other.setAttribute('aria-pressed', String(other === event.target));
      this.draw();
    } }, title);
    root.append(
      el('nav', { class: 'crumbs', 'aria-label': 'Where you are' }, el('a', { href: '#/jobs' }, 'Jobs'), ' / ', el('span', { class: 'mono' }, job.id)),
      el('div', { class: 'head' }, el('div', { class: 'row' }, this.title, this.state), this.actions, refused('submit', 'change jobs')),
      this.reason, this.numbers, this.bar,
      el('div', { class: 'split' },
        el('div', { class: 'column' }, this.viewer.node,
          el('section', { class: 'panel', 'aria-label': 'Error against time' },
            el('div', { class: 'panel-head' }, el('h2', {}, 'Error against time'),
              el('div', { class: 'switch', role: 'group', 'aria-label': 'Time' }, axis('wall_seconds', 'run time'), axis('worker_seconds', 'worker time'))),
            this.plot, this.fit, el('details', {}, el('summary', {}, 'As a table'), this.curveTable))),
        el('div', { class: 'column narrow' },
          el('section', { class: 'panel' }, el('h2', {}, 'What is rendered'), this.facts),
          el('section', { class: 'panel' }, el('h2', {}, 'Why, and what was left out'), this.why),
          el('section', { class: 'panel' }, el('h2', {}, 'Take it along'), this.#downloads()),
          el('section', { class: 'panel' }, el('h2', {}, 'Log'), this.journal))),
      el('section', { class: 'panel flush', 'aria-label': 'Batches and workers' },
        el('div', { class: 'panel-head' }, el('h2', {}, 'Batches and workers'), this.batches = el('p', { class: 'hint' })),
        el('div', { class: 'scroll', tabindex: 0, role: 'region', 'aria-label': 'Workers at this job' }, el('table', {}, el('caption', { class: 'sr' }, 'Workers at this job'), workerHeads(false), this.workers)), this.nobody));
    new ResizeObserver(() => this.draw()).observe(this.plot);
    this.update(job, true);
  }

  /** What was before somebody looked: of checkpoints, at which run time. */
  #begin() {
    const { job, curve } = this;
    this.begun = true;
    const lines = [{ time: job.created_at, line: 'The job came.' }];
    if (job.started_at) lines.push({ time: job.started_at, line: 'The first batch was handed out.' });
    for (const row of curve.rows) lines.push({ at: seconds(row.wall_seconds), line: checkpointLine(row) });
    if (job.ended_at) lines.push({ time: job.ended_at, line: `It was ${stateOf(job)}.` });
    this.log = [...this.log, ...lines.reverse()];
    this.#showLog();
  }

  #tell(line) {
    this.log.unshift({ time: new Date().toISOString(), line });
    this.log.length = Math.min(this.log.length, LINES);
    this.#showLog();
  }

  #showLog() {
    fill(this.journal, this.log.slice(0, LINES).map(({ time, at, line }) => el('li', {},
      time ? el('time', { datetime: time, title: when(time) }, new Date(time).toLocaleTimeString()) : el('span', { class: 'at' }, `after ${at}`), ' ', line)));
  }

  #downloads() {
    const { id, name } = this.job;
    const file = name.replace(/[^\w.-]+/g, '_').replace(/\.(glb|zip|gltf)$/i, '') || id;
    const link = (title, path, ending) => el('a', { class: 'button', href: path, download: `${file}.${ending}`, onclick: async (event) => {
      // A link cannot carry a token.
      if (!token()) return;
      event.preventDefault();
      try {
        save(await (await send(path)).blob(), `${file}.${ending}`);
      } catch (error) {
        notice(error.message, 'error');
      }
    } }, title);
    const report = el('button', { type: 'button', onclick: async () => {
      try {
        const [curve, job] = await Promise.all([get(`/v1/jobs/${id}/error.json`), get(`/v1/jobs/${id}`)]);
        save(new Blob([`${JSON.stringify({ ...curve, job }, null, 2)}\n`], { type: 'application/json' }), `${file}.json`);
      } catch (error) {
        notice(error.message, 'error');
      }
    } }, 'Report');
    const at = `/v1/jobs/${id}`;
    return el('div', { class: 'row wrap' }, link('EXR', `${at}/image.exr`, 'exr'), link('PNG', `${at}/image.png`, 'png'), link('Curve as CSV', `${at}/error.csv`, 'csv'), report);
  }

  /** The job has changed. */
  update(job, first = false) {
    const before = this.job;
    this.job = job;
    document.title = `${job.name} · ovtigre`;
    text(this.title, job.name);
    if (first || before.state !== job.state) {
      fill(this.state, badge(job.state));
      if (!first) this.loadCurve().catch(() => {});
      if (!first) this.#tell(`It is ${stateOf(job)}.`);
    }
    if (!first && before.error_target !== job.error_target) this.loadCurve().catch(() => {});
    if (!first && before.workers !== job.workers) this.#tell(`${count(job.workers)} ${job.workers === 1 ? 'worker works' : 'workers work'} at it.`);
    text(this.reason, job.reason === job.state ? '' : job.reason ?? '');
    this.reason.className = `reason ${job.state}`;
    this.bar.value = part(job);
    this.#fillNumbers();
    if (first || before.version !== job.version) this.#fillFacts();
    this.#fillWhy(first);
    if (first || before.state !== job.state || before.version !== job.version) this.#fillActions();
    text(this.batches, `${count(job.batches_done)} of ${count(job.batches_asked)} batches · ${count(job.settings.replicates)} replicates · ${count(job.workers)} at work`);
    this.viewer.update(job);
  }

  #fillNumbers() {
    const { job } = this;
    const error = errorOf(job);
    const one = (title, value, under, kind) => el('div', { class: kind ?? null }, el('dt', {}, title), el('dd', {}, value, under ? el('span', { class: 'under' }, under) : null));
    const target = job.error_target ? `${job.certified ? 'certified' : 'target'} ≤\u00a0${percent(job.error_target)}` : null;
    const upper = job.error?.doubt ? 'not certified' : isBiased(job) ? 'spread alone' : error?.upper ? `at most ${error.upper}` : null;
    const rays = job.worker_seconds > 0 ? `${short(job.rays / job.worker_seconds)} rays/s a worker` : null;
    fill(this.numbers,
      one('Error', error?.now ?? '–', [upper, target].filter(Boolean).join(' · '), job.certified ? 'good' : null),
      one('Samples a pixel', samples(job.samples_done), `of ${samples(job.samples_asked)}`),
      job.state === 'running' ? one('Left', seconds(job.eta_seconds ?? NaN), `after ${seconds(job.wall_seconds)}`) : one('Run time', job.started_at ? seconds(job.wall_seconds) : '–', null),
      one('Time of workers', seconds(job.worker_seconds), rays),
      one('Rays', short(job.rays), job.invalid_samples > 0 ? `${count(job.invalid_samples)} samples invalid` : 'no sample invalid', job.invalid_samples > 0 ? 'bad' : null),
      one('Workers', count(job.workers), `priority ${job.priority}`));
  }

  #fillFacts() {
    const { job } = this;
    const { settings, region } = job;
    const rows = [
      ['Scene', el('a', { href: `#/new?scene=${job.scene}`, class: 'mono', title: job.scene }, `${job.scene.slice(0, 12)}…`)],
      ['Size', `${settings.size.width} × ${settings.size.height}`],
      region.width !== settings.size.width || region.height !== settings.size.height ? ['Region', `${region.x}, ${region.y}, ${region.width} × ${region.height}`] : null,
      ['Camera', job.request.camera ?? 'the first'],
      ['Paths', el('code', {}, job.paths)],
      ['Method', job.method],
      ...job.layers.map((layer) => [`Layer ${layer.name}`, [el('code', {}, layer.shows), layer.error?.relative_error != null ? el('span', { class: 'under' }, `error ${percent(layer.error.relative_error)}`) : null,
        layer.error?.estimated_bias != null ? el('span', { class: 'under' }, `bias about ${percent(layer.error.estimated_bias)}`) : null]]),
      job.request.bounces != null ? ['Bounces', job.request.bounces] : null,
      job.request.lens_radius ? ['Lens', `radius ${job.request.lens_radius} m, in focus at ${job.request.focus_distance} m`] : null,
      job.request.environment ? ['Environment', [Array.isArray(job.request.environment) ? job.request.environment.join(', ') : el('span', { class: 'mono', title: job.request.environment }, `${job.request.environment.slice(0, 12)}…`),
        job.request.environment_rotation ? el('span', { class: 'under' }, `turned by ${digits(job.request.environment_rotation)}°`) : null]] : null,
      job.request.shutter ? ['Shutter', `${job.request.shutter.join(' to ')} s`] : null,
      settings.sampling === 'adaptive' ? ['Samples go', ['where the error is', job.allocations ? null : el('span', { class: 'under' }, 'everywhere alike until that is known')]] : null,
      ['Seed', settings.seed],
      ['Stops at', [`${samples(job.samples_asked)} samples`, job.error_target ? `error ${percent(job.error_target)}` : null, job.request.seconds ? seconds(job.request.seconds) : null].filter(Boolean).join(', or ')],
      ['Processor class', job.class ?? '–'],
      ['Came', when(job.created_at)],
      ['Ended', when(job.ended_at)],
    ];
    fill(this.facts, rows.filter(Boolean).map(([title, value]) => [el('dt', {}, title), el('dd', {}, value)]));
  }

  #fillWhy(first) {
    const { job } = this;
    const key = JSON.stringify([job.error?.doubt, job.method_reason, job.unreachable, job.warnings, job.radiosity?.certified, job.radiosity?.iterations?.length, job.needs]);
    if (!first && key === this.whyKey) return;
    this.whyKey = key;
    const lists = [];
    if (job.error?.doubt) lists.push(el('h3', {}, 'Why the error is not certified'), el('p', {}, doubted(job.error.doubt)));
    if (job.unreachable.length > 0) lists.push(el('h3', {}, 'Paths that no technique of this method makes'), el('ul', {}, job.unreachable.map((one) => el('li', {}, said(one)))));
    if (job.warnings.length > 0) lists.push(el('h3', {}, 'Of the scene'), el('ul', {}, job.warnings.map((warning) => el('li', {}, warning))));
    if (job.radiosity) lists.push(el('h3', {}, 'The solution'), el('pre', { tabindex: 0, role: 'region', 'aria-label': 'How radiosity was solved' }, JSON.stringify(job.radiosity, null, 1)));
    const { needed, left_out: without } = job.needs;
    if (needed.length > 0) lists.push(el('h3', {}, 'Needs'), el('p', {}, needed.map((word) => el('span', { class: 'tag' }, word))));
    if (without.length > 0) lists.push(el('details', { class: 'without' }, el('summary', {}, `Left out: ${count(without.length)} things that it does not need`),
      el('dl', { class: 'facts' }, without.map(({ what, why }) => [el('dt', {}, what), el('dd', {}, why)]))));
    fill(this.why, el('p', {}, el('strong', {}, job.method), `: ${job.method_reason}.`),
      job.unreachable.length > 0 ? null : el('p', { class: 'hint' }, 'It makes all the paths that are asked for.'), lists);
  }

  #fillActions() {
    const { job } = this;
    const over = OVER.includes(job.state);
    const button = (title, act, kind) => el('button', { type: 'button', class: kind ?? null, onclick: act }, title);
    const paused = job.state === 'paused';
    renew(this.actions,
      over ? null : paused ? button('Resume', () => this.patch({ state: 'running' }), 'primary') : button('Pause', () => this.patch({ state: 'paused' })),
      job.state !== 'failed' && job.state !== 'cancelled' && !job.certified ? button('More samples', () => this.#more()) : null,
      job.state !== 'failed' && job.state !== 'cancelled' && job.settings.replicates > 2 ? button('Tighter error', () => this.#tighter()) : null,
      over ? null : button('Priority', () => this.#priority()),
      el('a', { class: 'button', href: `#/new?from=${job.id}` }, 'Again'),
      over ? button('Remove', () => this.#remove(), 'danger') : button('Cancel', () => this.#cancel(), 'danger'));
  }

  async patch(json) {
    try {
      const response = await send(`/v1/jobs/${this.job.id}`, { method: 'PATCH', json, headers: { 'if-match': `"${this.job.version}"` } });
      this.update(await response.json());
      this.wake();
      notice('Changed.');
    } catch (error) {
      notice(error.errors?.[0]?.detail ?? error.message, 'error');
      if (error.status === 412) this.update(await get(`/v1/jobs/${this.job.id}`));
    }
  }

  async #more() {
    const value = await asked('Samples a pixel at most', 'Draw more', { type: 'number', min: this.job.samples_asked + 1, value: this.job.samples_asked * 4, required: true });
    if (value) await this.patch({ samples: Number(value) });
  }

  async #tighter() {
    const now = this.job.error_target ?? this.job.error?.relative_error ?? 0.02;
    const value = await asked('Stop when the relative error is certified at or under, in percent', 'Set target', { type: 'number', step: 'any', min: 0.0001, max: 100, value: Number(((now * 100) / 2).toPrecision(2)), required: true });
    if (value) await this.patch({ error: Number(value) / 100 });
  }

  async #priority() {
    const value = await asked('Priority: higher goes first', 'Set', { type: 'number', step: 1, value: this.job.priority, required: true });
    if (value !== null) await this.patch({ priority: Number(value) });
  }

  async #cancel() {
    if (!await confirmed('Cancel this job? What is rendered of it stays.', 'Cancel the job')) return;
    try {
      this.update(await (await send(`/v1/jobs/${this.job.id}`, { method: 'DELETE' })).json());
    } catch (error) {
      notice(error.message, 'error');
    }
  }

  async #remove() {
    if (!await confirmed('Remove this job with its picture and its curve? This cannot be undone.', 'Remove it')) return;
    try {
      await send(`/v1/jobs/${this.job.id}?purge=true`, { method: 'DELETE' });
      location.hash = '#/jobs';
    } catch (error) {
      notice(error.message, 'error');
    }
  }

  /** Fetches the curve and draws it. */
  async loadCurve() {
    this.curve = await get(`/v1/jobs/${this.job.id}/error.json`, { signal: this.signal });
    if (!this.begun) this.#begin();
    this.draw();
  }

  draw() {
    if (!this.curve) return;
    const { curve } = this;
    fill(this.plot, plot(curve, this.axis, Math.max(280, this.plot.clientWidth)));
    fill(this.curveTable, table(curve));
    const facts = [
      curve.slope === null ? null : `slope ${curve.slope.toFixed(2).replace('-', '−')} (−0.50 is plain Monte Carlo)`,
      curve.efficiency === null ? null : `efficiency ${digits(curve.efficiency)} 1/s`,
      curve.target_expected_at_seconds !== null && !curve.certified ? `target expected at ${seconds(curve.target_expected_at_seconds)} of run time` : null,
      curve.certified ? 'target reached and certified' : null,
    ];
    text(this.fit, facts.filter(Boolean).join(' · '));
  }

  checkpoint(row) {
    this.#tell(checkpointLine(row));
    this.viewer.keep();
    this.loadCurve().catch(() => {});
  }

  async loadWorkers() {
    const all = await allWorkers(this.signal).catch(() => []);
    const here = all.filter((worker) => worker.job === this.job.id && worker.leases > 0);
    renew(this.workers, here.map((worker) => workerRow(worker, null)));
    this.nobody.hidden = here.length > 0;
    this.workers.parentNode.parentNode.hidden = here.length === 0;
  }
}

/** A job's state with its reason, where that says more. */
function stateOf({ state, reason }) {
  return reason && reason !== state ? `${state}: ${reason}` : state;
}

function checkpointLine(row) {
  return `Checkpoint at ${count(row.samples)} samples${row.relative_error === null ? '' : `: error ${percent(row.relative_error)}`}.`;
}

/** Why an error may not be believed, and where in the picture. */
function doubted({ cause, effective_pixels: pixels, lone_share: lone, pixels: worst }) {
  const why = {
    few_pixels: `the error is as good as in ${digits(pixels, 2)} pixels`,
    lone_samples: `${percent(lone)} of the error is of light that one replicate found alone`,
  }[cause] ?? String(cause).replaceAll('_', ' ');
  const where = worst?.length > 0 ? `; most of it at ${worst.slice(0, 3).map(({ x, y }) => `${x},${y}`).join(' · ')}` : '';
  return `${why[0].toUpperCase()}${why.slice(1)}${where}.`;
}

/** What is not made, in a line. */
function said({ light, paths, why, reached_by: methods }) {
  const others = methods.length > 0 ? ` ${methods.join(', ')} would make ${paths.length === 1 ? 'it' : 'them'}.` : '';
  return [el('code', {}, paths.join('  ')), ` (${String(light).replaceAll('_', ' ')}): ${why}.${others}`];
}

/** Shows a job until `signal` ends. */
export async function show(root, { name, signal }) {
  const job = await get(`/v1/jobs/${encodeURIComponent(name)}`, { signal });
  const view = new JobView(root, job, signal);
  let wake = () => {};
  view.wake = () => wake();
  view.viewer.refresh();
  view.loadCurve().catch(() => {});
  repeat(3000, signal, () => view.loadWorkers());
  let known = job.error?.samples ?? 0;
  while (!signal.aborted) {
    for await (const { data } of events(`/v1/jobs/${job.id}/events`, signal)) {
      if (data.event === 'status') view.update(data);
      else if (data.samples > known) {
        known = data.samples;
        view.checkpoint(data);
      }
    }
    // A job that is over is silent until it goes on.
    await Promise.race([pause(600000, signal), new Promise((resolve) => { wake = resolve; })]);
  }
}
