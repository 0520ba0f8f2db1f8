// The picture so far: layers, errors, exposure, zoom, what is at a pixel, and a wipe against something else.

import { Problem, Watched, get } from './client.js';
import { falsely, legend, lightAt } from './colours.js';
import { asked, el, fill, notice, rested, text } from './dom.js';
import { digits, plusMinus, samples, seconds } from './format.js';

const MOMENTS_MAX = 16;
const WIDTH_MAX = 2048;
const ZOOM_MAX = 32;
const LUMINANCE = [0.2126, 0.7152, 0.0722];

/** One side of the wipe: a canvas and what is on it. */
class Side {
  constructor(name) {
    this.canvas = el('canvas', { class: `side ${name}`, width: 1, height: 1 });
    this.watched = new Watched();
  }

  async draw(blob, asColours) {
    const bitmap = await createImageBitmap(blob);
    this.canvas.width = bitmap.width;
    this.canvas.height = bitmap.height;
    this.canvas.getContext('2d', { willReadFrequently: asColours }).drawImage(bitmap, 0, 0);
    bitmap.close();
    if (asColours) falsely(this.canvas);
  }
}

/** Shows a job's picture. */
export class Viewer {
  #job;
  #a = new Side('a');
  #b = new Side('b');
  #layer = 'picture';
  #exposure = 0;
  #errorExposure = null;
  #against = 'none';
  #wipe = 50;
  #zoom = 1;
  #x = 0;
  #y = 0;
  #at = null;
  #moments = [];
  #reference = null;
  #file = null;
  #signal;

  constructor(job, signal) {
    this.#job = job;
    this.#signal = signal;
    this.#build();
    this.#options();
    new ResizeObserver(() => this.#place()).observe(this.stage);
  }

  #build() {
    this.layers = el('select', { onchange: () => { this.#layer = this.layers.value; this.#errorExposure = null; this.refresh(true); } });
    this.against = el('select', { class: 'against', onchange: () => this.#choose() });
    this.exposure = el('input', { type: 'range', min: -10, max: 16, step: 0.25, value: 0, 'aria-label': 'Exposure in stops', oninput: () => this.#expose(Number(this.exposure.value)) });
    this.stops = el('output', { class: 'stops' }, '0 EV');
    this.wipe = el('input', { type: 'range', min: 0, max: 100, value: 50, class: 'wipe', hidden: true, 'aria-label': 'Where the two pictures meet, in percent', oninput: () => { this.#wipe = Number(this.wipe.value); this.#place(); } });
    this.file = el('input', { type: 'file', accept: 'image/*', hidden: true, 'aria-label': 'Reference picture', onchange: () => this.#refer() });
    this.message = el('p', { class: 'message' }, 'No picture yet: it appears when each pixel has its first samples.');
    this.mark = el('div', { class: 'mark', hidden: true });
    this.line = el('div', { class: 'line', hidden: true });
    this.space = el('div', { class: 'space' }, this.#a.canvas, this.#b.canvas, this.mark);
    this.stage = el('div', { class: 'stage', tabindex: 0, role: 'img', 'data-keys': true, 'aria-label': 'The picture so far', 'aria-describedby': 'stage-keys',
      onkeydown: (event) => this.#key(event), onwheel: (event) => this.#wheel(event), onpointerdown: (event) => this.#drag(event), onpointermove: (event) => this.#point(event) },
      this.space, this.line, this.message);
    this.stage.addEventListener('dblclick', (event) => this.#zoomAt(this.#zoom > 1 ? 1 : 4, event));
    this.level = el('output', { class: 'level' }, 'fit');
    this.legend = el('div', { class: 'legend', hidden: true });
    this.readOut = el('dl', { class: 'read-out', 'aria-live': 'polite' });
    this.version = el('span', { class: 'version' });
    const button = (title, label, act) => el('button', { type: 'button', class: 'small', 'aria-label': label, title: label, onclick: act }, title);
    this.node = el('section', { class: 'panel viewer', 'aria-label': 'Picture' },
      el('div', { class: 'controls' },
        el('label', {}, el('span', {}, 'Show'), this.layers),
        el('label', { class: 'grow' }, el('span', {}, 'Exposure'), this.exposure, this.stops),
        el('div', { class: 'row tight' }, el('label', {}, el('span', {}, 'Against'), this.against),
          button('Job …', 'Job … to compare with', () => this.#askForJob()), button('File …', 'File … of this machine to compare with', () => this.file.click()), this.file),
        el('div', { class: 'row tight', role: 'group', 'aria-label': 'Zoom' },
          button('−', 'Zoom out', () => this.#zoomAt(this.#zoom / 2)), this.level, button('+', 'Zoom in', () => this.#zoomAt(this.#zoom * 2)), button('Fit', 'Fit the picture', () => this.#zoomAt(1)))),
      this.stage, this.wipe, this.legend, this.readOut,
      el('p', { class: 'hint', id: 'stage-keys' }, 'Arrows move the mark (with Shift by ten), +\u00a0−\u00a00 zoom, [\u00a0] exposure, drag to move, double click for pixels. ', this.version));
    legend(this.legend.appendChild(el('canvas', { width: 256, height: 8, 'aria-hidden': 'true' })));
    this.scaleText = this.legend.appendChild(el('span'));
  }

  /** Names of what can be shown and compared. */
  #options() {
    const { layers, settings } = this.#job;
    const planes = [['picture', 'Picture'], ...layers.map((layer) => [layer.name, `Layer ${layer.name}`])];
    const errors = settings.replicates > 1 ? [['error', 'Error'], ...layers.map((layer) => [`${layer.name}.error`, `Error of ${layer.name}`])] : [];
    const option = (value, selected) => ([key, title]) => el('option', { value: value + key, selected: value + key === selected }, title);
    fill(this.layers, planes.map(option('', this.#layer)), errors.length > 0 ? el('optgroup', { label: 'How far it may be off' }, errors.map(option('', this.#layer))) : null);
    const kept = this.#against;
    fill(this.against, el('option', { value: 'none' }, 'nothing'),
      el('optgroup', { label: 'This picture' }, [...planes, ...errors].map(option('layer:', kept))),
      this.#moments.length > 0 ? el('optgroup', { label: 'How it was' }, this.#moments.map((moment, i) => el('option', { value: `moment:${moment.key}`, selected: kept === `moment:${moment.key}` }, `${samples(moment.samples)} samples, ${seconds(moment.at)}`))) : null,
      this.#reference || this.#file ? el('optgroup', { label: 'A reference' },
        this.#reference ? el('option', { value: 'job:', selected: kept === 'job:' }, `job ${this.#reference}`) : null,
        this.#file ? el('option', { value: 'file:', selected: kept === 'file:' }, this.#file.name) : null) : null);
    if (kept !== 'none' && ![...this.against.options].some((o) => o.selected && o.value !== 'none')) this.#against = 'none';
  }

  /** The job has changed. */
  update(job) {
    const before = this.#job;
    this.#job = job;
    if (job.batches_done !== before.batches_done || job.state !== before.state) this.refresh();
  }

  #isError(layer) {
    return layer === 'error' || layer.endsWith('.error');
  }

  /** Stops for the errors: as many more as their mean is below the picture's. */
  #stopsFor(layer) {
    if (!this.#isError(layer)) return this.#exposure;
    const error = this.#job.error?.relative_error;
    const more = error > 0 ? Math.min(12, Math.max(0, Math.round(Math.log2(0.5 / error)))) : 4;
    return this.#exposure + more;
  }

  #address(layer, job = this.#job.id) {
    const width = Math.min(this.#job.region.width, this.#zoom > 2 ? 65536 : WIDTH_MAX);
    return `/v1/jobs/${job}/image.png?${new URLSearchParams({ layer, exposure: this.#stopsFor(layer), width })}`;
  }

  #busy = false;
  #again = false;

  /** Fetches what is shown, one time after the other. */
  async refresh(all = false) {
    if (all) {
      this.#a.watched.forget();
      this.#b.watched.forget();
    }
    if (this.#busy) {
      this.#again = true;
      return;
    }
    this.#busy = true;
    do {
      this.#again = false;
      try {
        await this.#fetchShown();
      } catch (error) {
        if (!(error instanceof Problem)) {
          this.#busy = false;
          if (error.name === 'AbortError') return;
          throw error;
        }
        text(this.message, error.message);
        this.message.hidden = this.#a.canvas.width > 1;
      }
    } while (this.#again && !this.#signal.aborted);
    this.#busy = false;
    this.#place();
  }

  async #fetchShown() {
    await this.#fetch(this.#a, this.#layer);
    if (this.#against.startsWith('layer:')) await this.#fetch(this.#b, this.#against.slice(6));
    if (this.#against === 'job:') await this.#fetch(this.#b, 'picture', this.#reference);
  }

  async #fetch(side, layer, job) {
    const against = this.#against;
    const response = await side.watched.get(this.#address(layer, job), { signal: this.#signal });
    if (!response) return;
    const blob = await response.blob();
    // Something else may be compared with by now.
    if (side === this.#b && against !== this.#against) return;
    const preview = response.headers.get('ovtigre-preview');
    await side.draw(blob, this.#isError(layer));
    this.message.hidden = true;
    this.stage.classList.add('filled');
    if (side === this.#a && preview) {
      this.stage.setAttribute('aria-label', `A preview of ${preview} pixels`);
      text(this.version, `Shown: a preview of ${preview} pixels, made while the method was chosen.`);
    } else if (side === this.#a) {
      this.stage.setAttribute('aria-label', `${layer === 'picture' ? 'The picture' : layer} after ${samples(this.#job.samples_done)} samples a pixel`);
      text(this.version, `Shown: ${samples(this.#job.samples_done)} samples a pixel.`);
      if (layer === 'picture') this.#latest = { blob, samples: this.#job.samples_done, at: this.#job.wall_seconds };
      if (this.#at) this.#ask();
    }
    this.#scale();
    this.#place();
  }

  #latest = null;

  /** Keeps the picture as it is now, to be compared with later. */
  keep() {
    const one = this.#latest;
    if (!one || this.#moments.at(-1)?.samples === one.samples) return;
    this.#moments.push({ ...one, key: one.samples });
    if (this.#moments.length > MOMENTS_MAX) this.#moments.splice(1, 1);
    this.#options();
  }

  #scale() {
    const shown = [this.#layer, this.#against.replace(/^layer:/, '')].find((layer) => this.#isError(layer));
    this.legend.hidden = !shown;
    if (!shown) return;
    const exposure = this.#stopsFor(shown);
    text(this.scaleText, `standard error 0 to ${digits(lightAt(1, exposure), 2)} and more; in the middle ${digits(lightAt(0.5, exposure), 2)}`);
  }

  #expose(stops) {
    this.#exposure = stops;
    this.exposure.value = stops;
    text(this.stops, `${stops > 0 ? '+' : ''}${stops} EV`);
    this.#soon();
  }

  #soon = rested(() => this.refresh(true), 120);

  #choose() {
    this.#against = this.against.value;
    return this.#compare();
  }

  async #askForJob() {
    const id = (await asked('Id of the job to compare with', 'Compare', { value: this.#reference ?? '', required: true }))?.trim();
    if (!id) return;
    try {
      await get(`/v1/jobs/${encodeURIComponent(id)}`, { signal: this.#signal });
    } catch (error) {
      notice(error.message, 'error');
      return;
    }
    this.#reference = id;
    this.#against = 'job:';
    this.#options();
    await this.#compare();
  }

  /** A picture of this machine was chosen. */
  async #refer() {
    const [file] = this.file.files;
    // So that the same file can be chosen again.
    this.file.value = '';
    if (!file) return;
    try {
      (await createImageBitmap(file)).close();
    } catch {
      notice(`${file.name} is no picture that a browser reads: a PNG, JPEG or WebP is needed.`, 'error');
      return;
    }
    this.#file = file;
    this.#against = 'file:';
    this.#options();
    await this.#compare();
  }

  /** Shows what is compared with now. */
  async #compare() {
    const [kind, name] = [this.#against.split(':')[0], this.#against.slice(this.#against.indexOf(':') + 1)];
    this.#b.watched.forget();
    if (kind === 'file') await this.#b.draw(this.#file, false);
    if (kind === 'moment') await this.#b.draw(this.#moments.find((moment) => String(moment.key) === name).blob, false);
    this.wipe.hidden = kind === 'none';
    this.#place();
    await this.refresh();
    this.#scale();
  }

  /** Places the canvases: the region fits the stage at zoom 1. */
  #place() {
    const { width, height } = this.#job.region;
    const box = this.stage.getBoundingClientRect();
    if (box.width === 0) return;
    // Set by its sides, as an aspect ratio beside a greatest height would change the width.
    const most = Math.max(220, window.innerHeight * 0.68);
    this.stage.style.height = `${Math.round(Math.min(most, (box.width * height) / width))}px`;
    const stage = this.stage.getBoundingClientRect();
    const fit = Math.min(stage.width / width, stage.height / height);
    const scale = fit * this.#zoom;
    const clamp = (at, size, room) => (size <= room ? (room - size) / 2 : Math.min(0, Math.max(room - size, at)));
    this.#x = clamp(this.#x, width * scale, stage.width);
    this.#y = clamp(this.#y, height * scale, stage.height);
    this.scale = scale;
    for (const side of [this.#a, this.#b]) {
      const { style } = side.canvas;
      style.width = `${width * scale}px`;
      style.height = `${height * scale}px`;
      style.transform = `translate(${this.#x}px, ${this.#y}px)`;
      style.imageRendering = scale >= 2 ? 'pixelated' : 'auto';
    }
    const wiping = this.#against !== 'none';
    const edge = (stage.width * this.#wipe) / 100;
    this.#b.canvas.hidden = !wiping;
    this.#b.canvas.style.clipPath = `inset(0 0 0 ${Math.max(0, edge - this.#x)}px)`;
    this.line.hidden = !wiping;
    this.line.style.left = `${edge}px`;
    this.mark.hidden = !this.#at;
    if (this.#at) {
      this.mark.style.transform = `translate(${this.#x + (this.#at.x - this.#job.region.x) * scale}px, ${this.#y + (this.#at.y - this.#job.region.y) * scale}px)`;
      this.mark.style.width = `${Math.max(3, scale)}px`;
      this.mark.style.height = `${Math.max(3, scale)}px`;
    }
    const of = scale * devicePixelRatio;
    text(this.level, this.#zoom === 1 ? 'fit' : `${of >= 1 ? digits(of, 2) : digits(of, 2)}×`);
    this.stage.classList.toggle('zoomed', this.#zoom > 1);
  }

  #zoomAt(zoom, event) {
    const before = this.scale ?? 1;
    const box = this.stage.getBoundingClientRect();
    const [cx, cy] = event ? [event.clientX - box.left, event.clientY - box.top] : [box.width / 2, box.height / 2];
    const refetch = (this.#zoom > 2) !== (zoom > 2) && this.#job.region.width > WIDTH_MAX;
    const ratio = Math.min(ZOOM_MAX, Math.max(1, zoom)) / this.#zoom;
    this.#zoom *= ratio;
    this.#x = cx - (cx - this.#x) * ratio;
    this.#y = cy - (cy - this.#y) * ratio;
    if (before) this.#place();
    if (refetch) this.refresh(true);
  }

  #wheel(event) {
    if (!event.ctrlKey && this.#zoom === 1) return;
    event.preventDefault();
    this.#zoomAt(this.#zoom * 2 ** (-event.deltaY / 240), event);
  }

  #drag(event) {
    if (this.#zoom === 1 || event.button !== 0) return;
    const [x, y, fromX, fromY] = [event.clientX, event.clientY, this.#x, this.#y];
    const move = (moved) => {
      this.#x = fromX + moved.clientX - x;
      this.#y = fromY + moved.clientY - y;
      this.#place();
    };
    this.stage.setPointerCapture(event.pointerId);
    this.stage.addEventListener('pointermove', move);
    this.stage.addEventListener('pointerup', () => this.stage.removeEventListener('pointermove', move), { once: true });
  }

  #point(event) {
    if (!this.scale || !this.stage.classList.contains('filled')) return;
    const box = this.stage.getBoundingClientRect();
    const { region } = this.#job;
    const x = Math.floor((event.clientX - box.left - this.#x) / this.scale);
    const y = Math.floor((event.clientY - box.top - this.#y) / this.scale);
    if (x < 0 || y < 0 || x >= region.width || y >= region.height) return;
    this.#see(x + region.x, y + region.y);
  }

  #see(x, y) {
    if (this.#at?.x === x && this.#at?.y === y) return;
    this.#at = { x, y };
    this.#place();
    this.#ask();
  }

  #asking = false;

  /** What is at the mark; one question at a time, the last one answered. */
  async #ask() {
    if (this.#asking) return;
    this.#asking = true;
    try {
      let asked;
      do {
        asked = this.#at;
        const pixel = await get(`/v1/jobs/${this.#job.id}/pixel?x=${asked.x}&y=${asked.y}`, { signal: this.#signal });
        this.#tell(pixel);
      } while (this.#at && this.#at !== asked);
    } catch (error) {
      if (error.name !== 'AbortError' && !(error instanceof Problem)) throw error;
    } finally {
      this.#asking = false;
    }
  }

  #tell({ x, y, planes }) {
    const row = (title, ...values) => [el('dt', {}, title), values.map((value) => el('dd', {}, value))];
    const line = ({ name, value, error }) => {
      const luminance = LUMINANCE.reduce((sum, weight, c) => sum + weight * value[c], 0);
      return row(name, ...value.map((v, c) => plusMinus(v, error?.[c])), digits(luminance, 4));
    };
    const layer = this.#layer.replace(/\.?error$/, '') || 'picture';
    const shown = planes.filter((plane) => plane.name === layer || plane.name === 'picture');
    fill(this.readOut, row(`pixel ${x}, ${y}`, 'R', 'G', 'B', 'luminance'), shown.map(line));
  }

  #key(event) {
    const step = event.shiftKey ? 10 : 1;
    const { region } = this.#job;
    const at = this.#at ?? { x: region.x + (region.width >> 1), y: region.y + (region.height >> 1) };
    const move = { ArrowLeft: [-step, 0], ArrowRight: [step, 0], ArrowUp: [0, -step], ArrowDown: [0, step] }[event.key];
    if (move) {
      const within = (value, from, size) => Math.min(from + size - 1, Math.max(from, value));
      this.#see(within(at.x + move[0], region.x, region.width), within(at.y + move[1], region.y, region.height));
    } else if (event.key === '+' || event.key === '=') this.#zoomAt(this.#zoom * 2);
    else if (event.key === '-') this.#zoomAt(this.#zoom / 2);
    else if (event.key === '0') this.#zoomAt(1);
    else if (event.key === '[') this.#expose(this.#exposure - 0.5);
    else if (event.key === ']') this.#expose(this.#exposure + 0.5);
    else return;
    event.preventDefault();
  }
}
