// A new job: a scene is dropped, looked into and previewed; what is wished is checked while it is written.

import { Problem, get, maySubmit, send, upload } from './client.js';
import { el, fill, notice, pause, refused, rested, text } from './dom.js';
import { chosen, dropped, packed } from './files.js';
import { bytes, count, samples } from './format.js';
import { hashOf } from './blake3.js';

const PRESETS = [
  ['full', 'L(D|S)*E', 'The whole rendering equation'],
  ['whitted', 'L[D|S]S_M*E', 'Direct light, mirrors and glass'],
  ['phong', 'L(D|S)E', 'Direct light only'],
  ['cook', 'L[D]S*E', 'Direct light and gloss'],
  ['radiosity', 'LD*E', 'Diffuse light only'],
];
const METHODS = [
  ['auto', 'chosen by the farm'], ['path', 'paths from the eye'], ['bidirectional', 'from both ends, joined'],
  ['caustics', 'from the eye, caustics from the lights'], ['light', 'paths from the lights'], ['photon', 'photon map'], ['radiosity', 'finite elements'],
];
const PREVIEW = { width: 320, samples: 16 };

/** The scene that was uploaded last and its name; kept while the page is open. */
const kept = { report: null, name: null, preview: null };

/** Uploads what is missing; its report. */
async function bring({ name, blob }, tell, signal) {
  tell(`Hashing ${name} (${bytes(blob.size)})`, 0);
  const hash = await hashOf(blob, (done) => tell(`Hashing ${name} (${bytes(blob.size)})`, done));
  try {
    const report = await get(`/v1/scenes/${hash}`, { signal });
    tell(`${name} was here already: nothing was sent.`, 1);
    return report;
  } catch (error) {
    if (error.status !== 404) throw error;
  }
  const report = await upload(`/v1/scenes/${hash}`, blob, (done) => tell(done < 1 ? `Sending ${name} (${bytes(blob.size)})` : `Looking into ${name}`, done), signal);
  tell(`${name} was sent.`, 1);
  return report;
}

class Form {
  constructor(root, signal) {
    this.signal = signal;
    this.layers = [];
    this.preset = 'full';
    this.fields = {};
    this.faults = {};
    this.#build(root);
  }

  #build(root) {
    this.told = el('p', { class: 'told', role: 'status' });
    this.bar = el('progress', { max: 1, value: 0, hidden: true, 'aria-label': 'Upload' });
    const pick = (attributes) => el('input', { type: 'file', class: 'sr', ...attributes, onchange: (event) => {
      const files = chosen(event.target);
      // So that the same file can be chosen again.
      event.target.value = '';
      this.take(files);
    } });
    this.file = pick({ id: 'choose-file', accept: '.glb,.zip,.gltf', multiple: true });
    this.folder = pick({ id: 'choose-folder', webkitdirectory: true });
    this.drop = el('section', { class: 'drop', 'aria-label': 'Scene', 'data-needs': 'submit' },
      el('p', {}, el('strong', {}, 'Drop a scene here: '), 'a .glb, a .zip, or a folder with a .gltf'),
      el('div', { class: 'row' }, this.file, el('label', { class: 'button', for: 'choose-file' }, 'Choose a file'), this.folder, el('label', { class: 'button', for: 'choose-folder' }, 'Choose a folder')),
      this.bar, this.told);
    this.#dropAnywhere();
    this.report = el('section', { class: 'panel', hidden: true, 'aria-label': 'What is in the scene' });
    this.form = el('form', { class: 'wishes', hidden: true, novalidate: true, 'data-needs': 'submit', onsubmit: (event) => { event.preventDefault(); this.submit(); }, oninput: () => this.check() });
    this.verdict = el('section', { class: 'panel verdict', hidden: true, 'data-needs': 'submit', 'aria-label': 'What this would be' });
    root.append(el('div', { class: 'head' }, el('h1', {}, 'New job')), refused('submit', 'render scenes'), this.drop,
      el('div', { class: 'split' }, el('div', { class: 'column' }, this.form), el('div', { class: 'column narrow' }, this.report, this.verdict)));
  }

  /** What is dropped beside the place for it is taken, too: a browser would leave the page for it. */
  #dropAnywhere() {
    const over = (is) => this.drop.classList.toggle('over', is);
    const listen = (kind, act) => addEventListener(kind, act, { signal: this.signal });
    listen('dragover', (event) => { event.preventDefault(); over(true); });
    listen('dragleave', (event) => { if (!event.relatedTarget) over(false); });
    listen('drop', (event) => {
      event.preventDefault();
      over(false);
      this.take(dropped(event.dataTransfer));
    });
  }

  /** Takes files that were dropped or chosen, or a promise of them. */
  async take(files) {
    if (!maySubmit()) {
      notice('This token may not send scenes: that takes one of role submit.', 'error');
      return;
    }
    const tell = (line, part) => {
      text(this.told, line);
      this.bar.hidden = part >= 1;
      this.bar.value = part;
    };
    this.told.classList.remove('bad');
    try {
      const scene = await packed(await files);
      const report = await bring(scene, tell, this.signal);
      if (report.kind !== 'scene') throw new Error(`${scene.name} is an image: give it as the environment, further down`);
      this.see(report, scene.name);
    } catch (error) {
      if (error.name === 'AbortError') return;
      tell([error.message, ...(error.errors ?? []).map((fault) => fault.pointer).filter(Boolean)].join(' at '), 1);
      this.told.classList.add('bad');
    }
  }

  /** Shows what is in a scene and asks for wishes. */
  see(report, name, request = {}) {
    if (kept.report?.id !== report.id) kept.preview = null;
    kept.report = report;
    kept.name = name;
    this.scene = report;
    history.replaceState(null, '', `#/new?scene=${report.id}`);
    this.#showReport(name);
    this.#showForm(name, request);
    this.check();
    this.#preview().catch(() => {});
  }

  #showReport(name) {
    const { scene } = this;
    const row = (title, value) => [el('dt', {}, title), el('dd', {}, value)];
    const { lights } = scene;
    const lamps = [[lights.emissive_triangles, 'emissive triangles'], [lights.point, 'point'], [lights.spot, 'spot'], [lights.directional, 'directional']]
      .filter(([n]) => n > 0).map(([n, kind]) => `${count(n)} ${kind}`).join(', ');
    const list = (title, lines, kind) => (lines.length > 0 ? [el('h3', {}, title), el('ul', { class: kind }, lines.map((line) => el('li', {}, line)))] : null);
    const tags = (title, words) => (words.length > 0 ? [el('h3', {}, title), el('p', {}, words.map((word) => el('span', { class: 'tag' }, word)))] : null);
    const cameras = scene.cameras.map((title, i) => title || `camera ${i}`);
    this.picture = el('div', { class: 'preview', role: 'img', 'aria-label': 'Quick preview' }, el('p', {}, 'A quick preview appears here.'));
    fill(this.report, el('h2', {}, name ?? 'The scene'), this.picture,
      el('dl', { class: 'facts' },
        row('Triangles', `${count(scene.triangles)}${scene.triangles_stored !== scene.triangles ? ` (${count(scene.triangles_stored)} in memory)` : ''}`),
        row('Meshes', `${count(scene.meshes)}, placed ${count(scene.instances)} times`),
        row('Materials', `${count(scene.materials)}, ${count(scene.textures)} textures`),
        row('Lights', lamps || 'none'),
        row('Cameras', cameras.length > 0 ? cameras.join(', ') : 'none: the scene is framed'),
        scene.letters.length > 0 ? row('Surfaces scatter', scene.letters.join(', ')) : null,
        row('Size', bytes(scene.bytes)),
        row('Hash', el('span', { class: 'mono', title: scene.id }, `${scene.id.slice(0, 16)}…`))),
      tags('Needs', scene.needs), tags('Does without', scene.leaves_out),
      list('Warnings', scene.warnings.map((w) => (w.pointer ? `${w.detail} (${w.pointer})` : w.detail)), 'warn'));
    this.report.hidden = false;
  }

  /** A field with its label, its unit and the place of its fault. */
  #field(key, title, control, hint) {
    const id = `f-${key}`;
    const fault = el('span', { class: 'fault', id: `${id}-fault`, role: 'alert' });
    this.fields[key] = set(control, id);
    this.faults[key] = fault;
    return el('div', { class: 'field' }, el('label', { for: id }, title), control, hint ? el('span', { class: 'hint' }, hint) : null, fault);
  }

  #showForm(name, r) {
    const number = (value, more = {}) => el('input', { type: 'number', inputmode: 'decimal', step: 'any', value: value ?? null, ...more });
    const line = (value, more = {}) => el('input', { type: 'text', value: value ?? null, spellcheck: 'false', autocomplete: 'off', ...more });
    const select = (options, value) => el('select', {}, options.map(([key, title]) => el('option', { value: key, selected: String(key) === String(value) }, title)));
    const { cameras, variants } = this.scene;
    const [width, height] = String(r.size ?? '').split('x');
    this.preset = r.preset ?? (r.paths ? null : 'full');
    this.layers = (r.layers ?? []).map((layer) => layer.split(/=(.*)/s).slice(0, 2));
    const group = (title, ...inner) => el('fieldset', { class: 'panel' }, el('legend', {}, title), inner);
    const wide = (title, ...inner) => el('details', { class: 'panel', open: false }, el('summary', {}, title), inner);
    this.presets = PRESETS.map(([key, expression, title]) => el('button', { type: 'button', class: 'preset', 'aria-pressed': String(this.preset === key), 'data-preset': key, title, onclick: () => this.#choose(key) }, el('strong', {}, key), el('code', {}, expression)));
    this.caret = el('pre', { class: 'caret', hidden: true, 'aria-hidden': 'true' });
    this.rows = el('div', { class: 'layers' });
    fill(this.form,
      group('Picture', el('div', { class: 'grid' },
        this.#field('name', 'Name', line(r.name ?? name?.replace(/\.(glb|gltf|zip)$/i, ''))),
        this.#field('camera', 'Camera', select(cameras.length > 0 ? cameras.map((title, i) => [i, title || `camera ${i}`]) : [['', 'frames the scene']], cameras.includes(r.camera) ? cameras.indexOf(r.camera) : r.camera)),
        variants.length > 0 ? this.#field('variant', 'Materials', select([['', 'as they are'], ...variants.map((v) => [v, v])], r.variant)) : null,
        this.#field('size', 'Width', number(width || null, { min: 1, step: 1, placeholder: '1280' }), 'pixels'),
        this.#field('height', 'Height', number(height || null, { min: 1, step: 1, placeholder: 'by the camera' }), 'pixels'),
        this.#field('region', 'Region', line(r.region, { placeholder: 'all of it' }), 'x,y,width,height'))),
      group('Paths', el('div', { class: 'presets', role: 'group', 'aria-label': 'Presets' }, this.presets),
        this.#field('paths', 'Expression, from the light L to the eye E', line(r.paths ?? PRESETS.find(([key]) => key === this.preset)?.[1], { class: 'mono', oninput: () => this.#choose(null) }), 'D diffuse, S glossy or mirror-like, S_M mirrors only; (a|b)  x*  x+  x?  x{n,m}  [x]'),
        this.caret,
        el('div', { class: 'grid roomy' },
          this.#field('method', 'Method', select(METHODS.map(([key, title]) => [key, `${key}: ${title}`]), r.method ?? 'auto')),
          this.#field('bounces', 'Bounces at most', number(r.bounces, { min: 0, step: 1, placeholder: 'no limit' })),
          this.#field('shadows', 'Shadows', select([['', 'on'], ['off', 'off: direct light is never blocked']], r.shadows ?? ''))),
        el('h3', {}, 'Layers'), this.rows,
        el('button', { type: 'button', class: 'small', onclick: () => { this.layers.push(['', '']); this.#showLayers(); this.rows.querySelector('.layer:last-child input')?.focus(); } }, 'Add a layer'),
        el('span', { class: 'fault', role: 'alert', id: 'f-layers-fault' })),
      group('Stop at whichever comes first', el('div', { class: 'grid' },
        this.#field('samples', 'Samples a pixel', number(r.samples, { min: 1, step: 1, placeholder: '256' })),
        this.#field('error', 'Relative error', number(r.error ? Number((r.error * 100).toPrecision(8)) : null, { min: 0, placeholder: 'none' }), 'percent, certified'),
        this.#field('seconds', 'Run time', number(r.seconds, { min: 0, placeholder: 'none' }), 'seconds'),
        this.#field('sampling', 'Samples go', select([['', 'everywhere alike'], ['adaptive', 'where the error is']], r.sampling ?? ''), 'the second: by path'))),
      wide('Lens and shutter', el('div', { class: 'grid' },
        this.#field('lens_radius', 'Radius of the lens', number(r.lens_radius, { min: 0, placeholder: 'pinhole' }), 'metres'),
        this.#field('focus_distance', 'In focus at', number(r.focus_distance, { min: 0 }), 'metres'),
        this.#field('shutter', 'Shutter opens', number(r.shutter?.[0], { placeholder: '0' }), 'seconds of the animation'),
        this.#field('closes', 'and closes', number(r.shutter?.[1], { placeholder: '0' }), 'seconds'))),
      wide('Light from infinitely far', el('div', { class: 'grid' },
        this.#field('environment', 'Radiance, or the hash of an image', line(Array.isArray(r.environment) ? r.environment.join(',') : r.environment, { placeholder: "the scene's own" }), 'R,G,B'),
        this.#field('environment_rotation', 'Turned by', number(r.environment_rotation), 'degrees')),
        el('label', { class: 'button', for: 'choose-sky' }, 'Upload an EXR or HDR'),
        el('input', { type: 'file', id: 'choose-sky', class: 'sr', accept: '.exr,.hdr', onchange: (event) => this.#sky(event.target) })),
      wide('Sampling and queue', el('div', { class: 'grid' },
        this.#field('replicates', 'Replicates', number(r.replicates, { min: 1, step: 1, placeholder: '4' }), '1: no error bars'),
        this.#field('seed', 'Seed', number(r.seed, { min: 0, step: 1, placeholder: '0' })),
        this.#field('strategies', 'Techniques', line(r.strategies, { placeholder: 'all' }), 's,t;s,t of bidirectional'),
        this.#field('weights', 'Weights', select([['', 'balance'], ['power', 'power'], ['uniform', 'uniform'], ['single', 'single']], r.weights ?? '')),
        this.#field('priority', 'Priority', number(r.priority, { step: 1, placeholder: '0' }), 'higher goes first'),
        this.#field('weight', 'Share', number(r.weight, { min: 1, step: 1, placeholder: '1' }), 'among jobs of its priority'),
        this.#field('max_workers', 'Workers at most', number(r.max_workers, { min: 1, step: 1, placeholder: 'all' })),
        this.#field('tags', 'Only workers with the tags', line((r.tags ?? []).join(', '))))),
      el('div', { class: 'send' }, this.button = el('button', { class: 'primary', type: 'submit' }, 'Render'), this.problem = el('p', { class: 'fault', role: 'alert' })));
    this.#showLayers();
    this.form.hidden = false;
  }

  #choose(preset) {
    this.preset = preset;
    for (const button of this.presets) button.setAttribute('aria-pressed', String(button.dataset.preset === preset));
    const shown = PRESETS.find(([key]) => key === preset);
    if (shown) this.fields.paths.value = shown[1];
    this.check();
  }

  #showLayers() {
    fill(this.rows, this.layers.map((layer, i) => {
      const [name, expression] = layer;
      return el('div', { class: 'layer' },
        el('input', { type: 'text', value: name, placeholder: 'name', 'aria-label': `Name of layer ${i + 1}`, spellcheck: 'false', oninput: (event) => { layer[0] = event.target.value; } }),
        el('span', { 'aria-hidden': 'true' }, '='),
        el('input', { type: 'text', class: 'mono', value: expression, placeholder: 'LDE', 'aria-label': `Expression of layer ${i + 1}`, 'aria-describedby': `layer-${i}-fault`, spellcheck: 'false', oninput: (event) => { layer[1] = event.target.value; } }),
        el('button', { type: 'button', class: 'small', 'aria-label': `Remove layer ${i + 1}`, onclick: () => { this.layers.splice(i, 1); this.#showLayers(); this.check(); } }, '×'),
        el('span', { class: 'fault', id: `layer-${i}-fault`, role: 'alert' }));
    }));
  }

  async #sky(input) {
    const files = chosen(input);
    // So that the same file can be chosen again.
    input.value = '';
    try {
      const scene = await packed(files);
      const report = await bring(scene, (line) => text(this.told, line), this.signal);
      if (report.kind !== 'environment') throw new Error(`${scene.name} is no image to light a scene with`);
      this.fields.environment.value = report.id;
      this.check();
    } catch (error) {
      if (error.name === 'AbortError') return;
      text(this.faults.environment, error.message);
      notice(error.message, 'error');
    }
  }

  /** The wishes as the farm takes them; what is left empty is left out. */
  request() {
    const { fields } = this;
    const request = { scene: this.scene.id };
    const of = (key) => fields[key]?.value.trim() ?? '';
    for (const key of ['name', 'camera', 'variant', 'region', 'strategies', 'weights', 'shadows', 'sampling']) if (of(key)) request[key] = of(key);
    for (const key of ['samples', 'seconds', 'bounces', 'lens_radius', 'focus_distance', 'environment_rotation', 'seed', 'replicates', 'priority', 'weight', 'max_workers']) {
      if (of(key)) request[key] = Number(of(key));
    }
    if (request.camera !== undefined) request.camera = Number(request.camera);
    if (of('error')) request.error = Number(of('error')) / 100;
    if (of('size') || of('height')) request.size = this.#size(of('size'), of('height'));
    if (of('shutter') || of('closes')) request.shutter = [Number(of('shutter')), Number(of('closes') || of('shutter'))];
    if (of('environment')) request.environment = of('environment');
    if (of('tags')) request.tags = of('tags').split(',').map((tag) => tag.trim()).filter(Boolean);
    if (of('method') !== 'auto') request.method = of('method');
    const layers = this.layers.filter(([name, expression]) => name || expression);
    if (layers.length > 0) request.layers = layers.map(([name, expression]) => `${name}=${expression}`);
    if (this.preset && this.preset !== 'full') request.preset = this.preset;
    else if (!this.preset) request.paths = of('paths');
    return request;
  }

  /** One side alone is completed by the camera's aspect ratio. */
  #size(width, height) {
    const camera = Number(this.fields.camera.value || 0);
    const aspect = this.scene.camera_aspect_ratios?.[camera] ?? this.scene.aspect_ratio ?? 16 / 9;
    const w = Number(width) || Math.max(1, Math.round(Number(height) * aspect));
    const h = Number(height) || Math.max(1, Math.round(Number(width) / aspect));
    return `${w}x${h}`;
  }

  check() {
    this.key = null;
    this.#soon();
  }

  #soon = rested(() => this.#checkNow(), 250);

  async #checkNow() {
    if (!this.scene || this.signal.aborted) return;
    this.checking?.abort();
    const checking = new AbortController();
    this.checking = checking;
    const signal = AbortSignal.any([this.signal, checking.signal]);
    let plan = null;
    let problem = null;
    if (this.#unread()) {
      this.verdict.hidden = true;
      return;
    }
    try {
      plan = await (await send('/v1/jobs?dry_run=true', { method: 'POST', json: this.request(), signal })).json();
    } catch (error) {
      if (!(error instanceof Problem)) return;
      problem = error;
    }
    if (signal.aborted) return;
    this.#fault(problem);
    this.button.disabled = problem !== null && problem.status === 422;
    this.verdict.hidden = !plan;
    if (plan) this.#plan(plan);
  }

  /** Whether a field holds what is no number, which would count as nothing; it is said there. */
  #unread() {
    const bad = Object.entries(this.fields).filter(([, field]) => field?.validity?.badInput);
    if (bad.length === 0) return false;
    this.#fault(null);
    for (const [key, field] of bad) {
      text(this.faults[key], 'this is no number');
      set(field, null, true);
    }
    this.button.disabled = true;
    return true;
  }

  #plan(plan) {
    const row = (title, value) => [el('dt', {}, title), el('dd', {}, value)];
    const { size } = plan.settings;
    fill(this.verdict, el('h2', {}, 'What this would be'), el('dl', { class: 'facts' },
      row('Size', `${count(size.width)} × ${count(size.height)}`), row('Samples', `${samples(plan.samples_asked)} a pixel, ${plan.settings.replicates} replicates`),
      row('Batches', count(plan.batches_asked)), row('Method', `${plan.method}: ${plan.method_reason}`), row('Paths', el('code', {}, plan.paths))),
      plan.warnings.length > 0 ? el('ul', { class: 'warn' }, plan.warnings.map((warning) => el('li', {}, warning))) : null);
  }

  /** Puts each fault where its field is, and marks the character of an expression. */
  #fault(problem) {
    for (const [key, place] of Object.entries(this.faults)) {
      text(place, '');
      set(this.fields[key], null);
    }
    this.rows.querySelectorAll('.fault').forEach((place) => text(place, ''));
    text(document.getElementById('f-layers-fault'), '');
    this.caret.hidden = true;
    text(this.problem, '');
    if (!problem) return;
    if (problem.errors.length === 0) text(this.problem, problem.message);
    for (const { pointer, detail } of problem.errors) {
      const [, key, i] = pointer.split('/');
      const field = key === 'preset' ? 'paths' : key;
      const place = key === 'layers' ? document.getElementById(i === undefined ? 'f-layers-fault' : `layer-${i}-fault`) : this.faults[field];
      text(place ?? this.problem, detail);
      if (this.fields[field]) set(this.fields[field], null, true);
      const folded = this.fields[field]?.closest('details');
      if (folded) folded.open = true;
      const at = detail.match(/^character (\d+): /);
      if (at && field === 'paths') this.#mark(this.fields.paths.value, Number(at[1]) - 1);
    }
  }

  #mark(expression, at) {
    const letters = [...expression];
    fill(this.caret, letters.slice(0, at).join(''), el('mark', {}, letters[at] ?? ' '), letters.slice(at + 1).join(''));
    this.caret.hidden = false;
  }

  async submit() {
    if (this.#unread()) return;
    this.button.disabled = true;
    this.key ??= crypto.randomUUID?.() ?? String(Math.random());
    try {
      const response = await send('/v1/jobs', { method: 'POST', json: this.request(), headers: { 'idempotency-key': this.key } });
      const job = await response.json();
      location.hash = `#/job/${job.id}`;
    } catch (error) {
      // Where no answer came the job may have been taken: the same key asks for the same job.
      if (error.status !== 0) this.key = null;
      this.#fault(error);
      notice(error.message, 'error');
      this.button.disabled = false;
    }
  }

  /** A small picture of few samples, whose job is removed when it is shown. */
  async #preview() {
    const { picture, scene, signal } = this;
    const show = (canvas) => fill(picture, canvas);
    if (kept.preview) return show(kept.preview);
    const say = (line) => fill(picture, el('p', {}, line));
    const { active_workers: workers } = await get('/v1/scaling', { signal });
    if (workers === 0) return say('No worker is here to draw a preview.');
    say('A quick preview is drawn …');
    const aspect = scene.aspect_ratio ?? 16 / 9;
    const size = `${PREVIEW.width}x${Math.max(1, Math.round(PREVIEW.width / aspect))}`;
    let job;
    try {
      job = await (await send('/v1/jobs', { method: 'POST', json: { scene: scene.id, name: 'preview', size, samples: PREVIEW.samples, priority: 100 } })).json();
      const response = await this.#picture(job.id);
      const bitmap = await createImageBitmap(await response.blob());
      const canvas = el('canvas', { width: bitmap.width, height: bitmap.height });
      canvas.getContext('2d').drawImage(bitmap, 0, 0);
      if (kept.report?.id === scene.id) kept.preview = canvas;
      return show(canvas);
    } catch (error) {
      return say(error.name === 'AbortError' ? '' : `There is no preview: ${error.message}`);
    } finally {
      if (job) await this.#remove(job.id);
    }
  }

  async #picture(id) {
    for (let tries = 0; tries < 120 && !this.signal.aborted; tries += 1) {
      const job = await get(`/v1/jobs/${id}`, { signal: this.signal });
      if (job.state === 'done') return send(`/v1/jobs/${id}/image.png`, { signal: this.signal });
      if (job.state === 'failed' || job.state === 'cancelled') throw new Error(job.reason ?? job.state);
      await pause(500, this.signal);
    }
    throw new Error('no worker has drawn it within a minute');
  }

  /** Also after the view was left. A job is removed once it is over and settled. */
  async #remove(id) {
    await send(`/v1/jobs/${id}`, { method: 'DELETE' }).catch(() => {});
    for (let tries = 0; tries < 20; tries += 1) {
      const gone = await send(`/v1/jobs/${id}?purge=true`, { method: 'DELETE' }).catch((error) => (error.status === 404 ? error : null));
      if (gone) return;
      await pause(500);
    }
  }
}

/** Gives a control its id and says whether what is in it is wrong. */
function set(control, id, wrong = false) {
  if (!control) return control;
  if (id) {
    control.id = id;
    control.setAttribute('aria-describedby', `${id}-fault`);
  }
  if (wrong) control.setAttribute('aria-invalid', 'true');
  else control.removeAttribute('aria-invalid');
  return control;
}

/** Shows the form until `signal` ends. */
export async function show(root, { query, signal }) {
  document.title = 'New job · ovtigre';
  const form = new Form(root, signal);
  const [from, scene] = [query.get('from'), query.get('scene')];
  if (from) {
    const job = await get(`/v1/jobs/${encodeURIComponent(from)}`, { signal });
    form.see(await get(`/v1/scenes/${job.scene}`, { signal }), job.name, job.request);
  } else if (scene) {
    const known = kept.report?.id === scene ? kept.report : await get(`/v1/scenes/${encodeURIComponent(scene)}`, { signal });
    form.see(known, kept.report?.id === scene ? kept.name : null);
  }
}
