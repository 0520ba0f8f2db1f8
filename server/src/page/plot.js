// Relative error against time, both logarithmic: what was measured, its interval, the target and where it leads.

import { el, svg } from './dom.js';
import { percent, seconds } from './format.js';

const LEFT = 62;
const RIGHT = 16;
const TOP = 14;
const BOTTOM = 40;
const AHEAD_MAX = 1000;

/** A logarithmic scale from values to places, with its marks. */
function scale(low, high, from, to) {
  const [a, b] = [Math.log10(low), Math.log10(high)];
  const place = (x) => from + ((Math.log10(x) - a) / (b - a)) * (to - from);
  const marks = [];
  const few = b - a < 2.2 ? [1, 2, 5] : [1];
  for (let decade = Math.floor(a); decade <= Math.ceil(b); decade += 1) {
    for (let n = 1; n < 10; n += 1) {
      const value = n * 10 ** decade;
      if (value >= low * 0.999 && value <= high * 1.001) marks.push({ value, named: few.includes(n) });
    }
  }
  return { place, marks };
}

/** Bounds around values, widened to a factor of 2 at least. */
function bounds(values) {
  let low = Math.min(...values);
  let high = Math.max(...values);
  if (high / low < 2.5) [low, high] = [low / 1.6, high * 1.6];
  return [low / 1.15, high * 1.15];
}

/** The plot of a curve in a space of `width` pixels; `axis` is `wall_seconds` or `worker_seconds`. */
export function plot(curve, axis, width) {
  const height = Math.min(340, Math.max(220, width * 0.5));
  const rows = curve.rows.filter((row) => row.relative_error > 0 && row[axis] > 0);
  if (rows.length === 0) {
    return el('p', { class: 'empty' }, 'The first checkpoint is still to come. A single replicate has none.');
  }
  const last = rows.at(-1);
  const ahead = axis === 'wall_seconds' && !curve.certified ? curve.target_expected_at_seconds : null;
  // An end too far away to be drawn beside what is measured is told in words only.
  const expected = ahead && ahead < last[axis] * AHEAD_MAX ? ahead : null;
  const target = curve.error_target;
  const xs = rows.map((row) => row[axis]);
  if (expected) xs.push(expected);
  const ys = rows.flatMap((row) => [row.relative_error, row.relative_error_upper].filter((e) => e > 0));
  if (target) ys.push(target);
  const x = scale(...bounds(xs), LEFT, width - RIGHT);
  const y = scale(...bounds(ys), height - BOTTOM, TOP);
  const at = (row) => `${x.place(row[axis]).toFixed(1)},${y.place(row.relative_error).toFixed(1)}`;

  const drawing = svg('svg', { viewBox: `0 0 ${width} ${height}`, width, height, class: 'plot', role: 'img', 'aria-label': spoken(curve, rows, axis) });
  for (const { value, named } of x.marks) {
    const here = x.place(value);
    drawing.append(svg('line', { x1: here, x2: here, y1: TOP, y2: height - BOTTOM, class: named ? 'grid' : 'grid faint' }));
    if (named) drawing.append(svg('text', { x: here, y: height - BOTTOM + 15, 'text-anchor': 'middle' }, mark(value)));
  }
  for (const { value, named } of y.marks) {
    const here = y.place(value);
    drawing.append(svg('line', { x1: LEFT, x2: width - RIGHT, y1: here, y2: here, class: named ? 'grid' : 'grid faint' }));
    if (named) drawing.append(svg('text', { x: LEFT - 7, y: here + 4, 'text-anchor': 'end' }, `${Number((value * 100).toPrecision(2))}\u00a0%`));
  }
  drawing.append(svg('rect', { x: LEFT, y: TOP, width: width - LEFT - RIGHT, height: height - TOP - BOTTOM, class: 'frame' }));
  // Over all lines, so that none goes through them.
  const labels = [];
  if (target) {
    const here = y.place(target);
    drawing.append(svg('line', { x1: LEFT, x2: width - RIGHT, y1: here, y2: here, class: 'target' }));
    labels.push(svg('text', { x: LEFT + 6, y: here - 6, class: 'target' }, `target ${percent(target)}`));
  }
  if (expected && target && last.relative_error_upper > 0) {
    const end = x.place(expected);
    drawing.append(svg('line', { x1: x.place(last[axis]), y1: y.place(last.relative_error_upper), x2: end, y2: y.place(target), class: 'ahead' }));
    drawing.append(svg('line', { x1: end, x2: end, y1: TOP, y2: height - BOTTOM, class: 'ahead' }));
    labels.push(svg('text', { x: end - 6, y: TOP + 14, 'text-anchor': 'end', class: 'ahead' }, `expected at ${seconds(expected)}`));
  }
  for (const row of rows) {
    if (!(row.relative_error_upper > 0)) continue;
    const [here, high] = [x.place(row[axis]), y.place(row.relative_error_upper)];
    drawing.append(svg('path', { d: `M${here} ${y.place(row.relative_error)}V${high}M${here - 3.5} ${high}h7`, class: 'whisker' }));
  }
  drawing.append(svg('polyline', { points: rows.map(at).join(' '), class: 'line' }));
  for (const row of rows) {
    const [cx, cy] = at(row).split(',');
    drawing.append(svg('circle', { cx, cy, r: 3.2, class: 'dot' },
      svg('title', {}, `${row.samples} samples, ${seconds(row[axis])}: ${percent(row.relative_error)}${row.relative_error_upper ? `, at most ${percent(row.relative_error_upper)}` : ''}`)));
  }
  drawing.append(...labels,
    svg('text', { x: (LEFT + width - RIGHT) / 2, y: height - 6, 'text-anchor': 'middle', class: 'title' }, axis === 'wall_seconds' ? 'run time' : 'time of all workers'));
  return drawing;
}

const RAISED = '⁰¹²³⁴⁵⁶⁷⁸⁹';

/** A duration on an axis: in one unit, as its steps are powers. */
function mark(s) {
  if (s >= 0.001 && s < 10000) return `${Number(s.toPrecision(1))}\u00a0s`;
  const power = Math.floor(Math.log10(s) + 1e-9);
  const raised = [...String(power)].map((c) => (c === '-' ? '⁻' : RAISED[Number(c)])).join('');
  const factor = Math.round(s / 10 ** power);
  return `${factor === 1 ? '' : `${factor}·`}10${raised}\u00a0s`;
}

function spoken(curve, rows, axis) {
  const [first, last] = [rows[0], rows.at(-1)];
  const fell = `Relative error fell from ${percent(first.relative_error)} at ${seconds(first[axis])} to ${percent(last.relative_error)} at ${seconds(last[axis])}`;
  const slope = curve.slope === null ? '' : `, slope ${curve.slope.toFixed(2)}`;
  const target = curve.error_target ? `. Target ${percent(curve.error_target)}${curve.certified ? ', certified' : ''}` : '';
  return `${fell}${slope}${target}. The table has all numbers.`;
}

/** The same as a table. */
export function table(curve) {
  const heads = ['Samples', 'Run time', 'Time of workers', 'Rays', 'RMS error', 'Relative error', 'At most'];
  const cell = (value) => el('td', { class: 'number' }, value);
  return el('table', { class: 'plain' }, el('caption', { class: 'sr' }, 'Error at each checkpoint'),
    el('thead', {}, el('tr', {}, heads.map((head) => el('th', { scope: 'col', class: 'number' }, head)))),
    el('tbody', {}, curve.rows.map((row) => el('tr', {},
      cell(row.samples.toLocaleString('en-GB')), cell(seconds(row.wall_seconds)), cell(seconds(row.worker_seconds)), cell(row.rays.toLocaleString('en-GB')),
      cell(row.rms_error === null ? '–' : row.rms_error.toPrecision(3)), cell(percent(row.relative_error ?? NaN)), cell(percent(row.relative_error_upper ?? NaN))))));
}
