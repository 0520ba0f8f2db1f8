// Numbers as people read them: few digits, always a unit.

const whole = new Intl.NumberFormat('en-GB', { maximumFractionDigits: 0 });
const clock = new Intl.DateTimeFormat(undefined, { month: 'short', day: 'numeric', hour: '2-digit', minute: '2-digit' });

/** A number with so many significant digits, without an exponent where that is readable. */
export function digits(x, significant = 3) {
  if (!Number.isFinite(x)) return '–';
  if (x === 0) return '0';
  const size = Math.abs(x);
  if (size >= 1e7 || size < 1e-5) return x.toExponential(significant - 1);
  const after = Math.max(0, significant - 1 - Math.floor(Math.log10(size)));
  return x.toFixed(Math.min(after, 12));
}

/** A whole number with its thousands apart. */
export const count = (n) => (Number.isFinite(n) ? whole.format(n) : '–');

/** A large number with a prefix. */
export function short(n) {
  if (!Number.isFinite(n)) return '–';
  for (const [size, name] of [[1e12, 'T'], [1e9, 'G'], [1e6, 'M'], [1e3, 'k']]) {
    if (n >= size) return `${digits(n / size)}\u00a0${name}`;
  }
  return digits(n);
}

/** Samples a pixel: whole where they are. */
export const samples = (n) => (Number.isInteger(n) ? count(n) : digits(n));

/** A duration in seconds. */
export function seconds(s) {
  if (!Number.isFinite(s)) return '–';
  if (s < 0.0995) return `${digits(s * 1000, 2)}\u00a0ms`;
  if (s < 60) return `${s < 9.95 ? s.toFixed(1) : s.toFixed(0)}\u00a0s`;
  const n = Math.round(s);
  const two = (x) => String(x).padStart(2, '0');
  if (n < 3600) return `${Math.floor(n / 60)}\u00a0min\u00a0${two(n % 60)}\u00a0s`;
  if (n > 315360000) return 'more than ten years';
  if (n < 86400) return `${Math.floor(n / 3600)}\u00a0h\u00a0${two(Math.floor(n / 60) % 60)}\u00a0min`;
  return `${Math.floor(n / 86400)}\u00a0d\u00a0${Math.floor(n / 3600) % 24}\u00a0h`;
}

/** A relative error. */
export function percent(e) {
  if (!Number.isFinite(e)) return '–';
  return e >= 10 ? `${whole.format(e * 100)}\u00a0%` : `${digits(e * 100)}\u00a0%`;
}

/** A value with its standard error, to the second digit of that. */
export function plusMinus(value, error) {
  if (!Number.isFinite(value)) return '–';
  if (!Number.isFinite(error)) return digits(value, 4);
  if (error === 0) return `${digits(value, 4)}\u00a0±\u00a00`;
  const after = Math.min(8, Math.max(0, 1 - Math.floor(Math.log10(error))));
  if (after === 8 || error >= 1e6) return `${value.toExponential(3)}\u00a0±\u00a0${error.toExponential(1)}`;
  return `${value.toFixed(after)}\u00a0±\u00a0${error.toFixed(after)}`;
}

/** A size of a file. */
export function bytes(n) {
  if (!Number.isFinite(n)) return '–';
  return n < 1000 ? `${n}\u00a0B` : `${short(n)}B`;
}

/** A point of time. */
export const when = (time) => (time ? clock.format(new Date(time)) : '–');

/** How long ago, in seconds. */
export const since = (time) => (Date.now() - Date.parse(time)) / 1000;

/** The relative error of a job as a text, with the end of its interval. */
export function errorOf(job) {
  const row = job.error;
  if (!row || row.relative_error === null) return null;
  const upper = row.relative_error_upper;
  return { now: percent(row.relative_error), upper: upper === null ? null : percent(upper) };
}

/** Whether a method is off by more than its samples' spread shows. */
export const isBiased = (job) => job.method === 'photon' || job.method === 'radiosity';

/** Part of the job that is done, 0 to 1: all of it where a smaller error or the time ended it before all samples. */
export const part = (job) => (job.state === 'done' ? 1 : job.samples_asked > 0 ? Math.min(1, job.samples_done / job.samples_asked) : 0);
