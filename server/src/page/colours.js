// Errors as colours: dark blue where there is little, over green to pale yellow where there is much.

// Chosen so that lightness rises evenly; read in between.
const STOPS = [[22, 18, 62], [44, 62, 128], [28, 116, 138], [64, 164, 106], [166, 204, 82], [253, 240, 160]];

/** The colour of `t`, 0 to 1, as three bytes. */
export function colour(t) {
  const at = Math.min(1, Math.max(0, t)) * (STOPS.length - 1);
  const i = Math.min(STOPS.length - 2, Math.floor(at));
  return STOPS[i].map((from, c) => Math.round(from + (STOPS[i + 1][c] - from) * (at - i)));
}

const TABLE = Array.from({ length: 256 }, (_, i) => colour(i / 255));

/** Replaces the colours of a canvas by those of their brightness, as it was developed. */
export function falsely(canvas) {
  const context = canvas.getContext('2d');
  const image = context.getImageData(0, 0, canvas.width, canvas.height);
  const { data } = image;
  for (let i = 0; i < data.length; i += 4) {
    const [r, g, b] = TABLE[Math.round(0.2126 * data[i] + 0.7152 * data[i + 1] + 0.0722 * data[i + 2])];
    data[i] = r;
    data[i + 1] = g;
    data[i + 2] = b;
  }
  context.putImageData(image, 0, 0);
}

/** The light that is shown at part `t` of the scale, developed with `exposure` stops (inverse of sRGB's curve). */
export function lightAt(t, exposure) {
  const linear = t <= 0.04045 ? t / 12.92 : ((t + 0.055) / 1.055) ** 2.4;
  return linear / 2 ** exposure;
}

/** A scale of colours with its values. */
export function legend(canvas) {
  const context = canvas.getContext('2d');
  for (let x = 0; x < canvas.width; x += 1) {
    const [r, g, b] = colour(x / (canvas.width - 1));
    context.fillStyle = `rgb(${r} ${g} ${b})`;
    context.fillRect(x, 0, 1, canvas.height);
  }
}
