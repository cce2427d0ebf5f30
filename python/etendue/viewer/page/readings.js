// What is read in a view: regions and cross sections, from the pixels that the core's map would have.


import { plus } from "./view.js";

const SLICE = 12; // ms of work between two looks at what the user does
const FLUX_POINTS = 256;
const FLUX_SHIFTS = 16;
const SECTION_POINTS = 240;
export const REGION_SAMPLES = 4;

/** Whether a point lies within a polygon (even-odd rule). */
export function within(corners, [x, y]) {
  let inside = false;
  for (let i = 0, j = corners.length - 1; i < corners.length; j = i++) {
    const [ax, ay] = corners[i];
    const [bx, by] = corners[j];
    if (ay > y !== by > y && x < ((bx - ax) * (y - ay)) / (by - ay) + ax) inside = !inside;
  }
  return inside;
}

export function areaOf(corners) {
  let twice = 0;
  corners.forEach(([x, y], i) => {
    const [nx, ny] = corners[(i + 1) % corners.length];
    twice += x * ny - nx * y;
  });
  return Math.abs(twice) / 2;
}

/** The pixels of a view whose middles lie within a polygon given in mm on the screen. */
export function pixelsWithin(view, corners) {
  const found = [];
  const step = view.width / view.columns;
  const at = ([x, y]) => [(x + view.width / 2) / step, (view.height / 2 - y) / step];
  const across = corners.map((c) => at(c)[0]);
  const down = corners.map((c) => at(c)[1]);
  const bounds = (list, most) => [Math.max(0, Math.floor(Math.min(...list))), Math.min(most, Math.ceil(Math.max(...list)))];
  const [left, right] = bounds(across, view.columns);
  const [top, bottom] = bounds(down, view.rows);
  for (let row = top; row < bottom; row++) {
    for (let column = left; column < right; column++) {
      if (within(corners, view.place(column + 0.5, row + 0.5))) found.push([column, row]);
    }
  }
  return found;
}

export function quantile(sorted, share) {
  const at = share * (sorted.length - 1);
  const lower = Math.floor(at);
  return lower + 1 < sorted.length ? sorted[lower] + (at - lower) * (sorted[lower + 1] - sorted[lower]) : sorted[lower];
}

/** Works through a list in slices, so that the page stays alive; `current()` false ends it: resolves to null. */
export async function inSlices(list, work, current) {
  const results = [];
  let end = performance.now() + SLICE;
  for (const one of list) {
    results.push(work(one));
    if (performance.now() > end) {
      await new Promise((resolve) => setTimeout(resolve));
      if (!current()) return null;
      end = performance.now() + SLICE;
    }
  }
  return results;
}

/** The figures of a region, or null if it was given up. Values in the unit of the subject, lengths in mm. */
export async function measureRegion(subject, view, corners, current) {
  const pixels = pixelsWithin(view, corners);
  const read = ([column, row]) => ({ ...subject.pixel(view, column, row, REGION_SAMPLES), column, row });
  const all = await inSlices(pixels, read, current);
  if (all === null) return null;
  const seen = all.filter((pixel) => !pixel.beyond);
  const dead = seen.filter((pixel) => !Number.isFinite(pixel.value)).length;
  if (seen.length === dead) return { pixels: seen.length, dead };
  // A dead pixel, and a cell of illuminance that no ray reached, count as 0 ± 0, as in `etendue.region_statistics`: where rays
  // are few, the pixels that one of them reached are too bright on average.
  const counted = seen.map((p) => (p.value ? p : { ...p, value: 0, error: p.error || 0 }));
  const sorted = Float64Array.from(counted, (pixel) => pixel.value).sort();
  const mean = sorted.reduce((sum, x) => sum + x, 0) / sorted.length;
  // Neighbours err together; so far as all of them do, the mean errs by the mean of their errors.
  const error = counted.reduce((sum, pixel) => sum + pixel.error, 0) / counted.length;
  const intensity = counted.reduce((sum, p) => sum + p.value * view.cosine(p.column + 0.5, p.row + 0.5), 0);
  const [least, most] = [sorted[0], sorted[sorted.length - 1]];
  return {
    pixels: counted.length,
    dead,
    area: areaOf(corners),
    mean,
    error,
    minimum: least,
    maximum: most,
    percentiles: [0.05, 0.5, 0.95].map((share) => quantile(sorted, share)),
    uniformity: mean > 0 ? least / mean : NaN,
    diversity: most > 0 ? least / most : NaN,
    intensity: intensity * view.pixelArea * 1e-6,
    flux: subject.parts ? fluxThrough(subject, view, corners) : null,
  };
}

/**
 * Flux through the region of the screen towards the observer's side, all directions together: π · area · mean luminance over
 * places in the region and directions with density cosine/π. Lattices shifted at fixed places tell its error.
 */
export function fluxThrough(field, view, corners) {
  const area = areaOf(corners);
  const [xs, ys] = [0, 1].map((axis) => corners.map((c) => c[axis]));
  const box = [Math.min(...xs), Math.max(...xs), Math.min(...ys), Math.max(...ys)];
  const boxArea = (box[1] - box[0]) * (box[3] - box[2]);
  const golden = [0.8566748838545029, 0.733891856627126, 0.6287067210378087, 0.5385972572236101];
  const means = [];
  let index = 0;
  for (let shift = 0; shift < FLUX_SHIFTS; shift++) {
    let sum = 0;
    for (let i = 0; i < FLUX_POINTS; i++) {
      index += 1;
      const [a, b, c, d] = golden.map((g) => (index * g) % 1);
      const place = [box[0] + a * (box[1] - box[0]), box[2] + b * (box[3] - box[2])];
      if (!within(corners, place)) continue;
      const radius = Math.sqrt(c);
      const [x, y] = [radius * Math.cos(2 * Math.PI * d), radius * Math.sin(2 * Math.PI * d)];
      const up = Math.sqrt(Math.max(1 - c, 0));
      const direction = plus(plus(view.toward.map((t) => t * up), view.right, x), view.up, y);
      const point = plus(plus(view.target, view.right, place[0]), view.up, place[1]);
      sum += field.luminance(point, direction).value;
    }
    means.push((sum / FLUX_POINTS) * Math.PI * boxArea * 1e-6);
  }
  const value = means.reduce((a, b) => a + b, 0) / FLUX_SHIFTS;
  const spread = means.reduce((a, b) => a + (b - value) ** 2, 0) / (FLUX_SHIFTS - 1);
  return area > 0 ? { value, error: Math.sqrt(spread / FLUX_SHIFTS) } : null;
}

/** Values along a line on the screen from one place to another [mm]: points of equal steps, each of its own pixel's size. */
export async function measureSection(subject, view, [from, to], current) {
  const length = Math.hypot(to[0] - from[0], to[1] - from[1]);
  const step = view.width / view.columns;
  const points = Array.from({ length: SECTION_POINTS }, (_, i) => (i + 0.5) / SECTION_POINTS);
  const read = (t) => {
    const [x, y] = [0, 1].map((axis) => from[axis] + t * (to[axis] - from[axis]));
    const column = (x + view.width / 2) / step - 0.5;
    const row = (view.height / 2 - y) / step - 0.5;
    return { at: t * length, ...subject.pixel(view, column, row, REGION_SAMPLES) };
  };
  return inSlices(points, read, current);
}

/** Values of even places of the view, rising: what a scale is chosen from. */
export function overview(subject, view, errors = false, across = 64) {
  const down = Math.max(2, Math.round((across * view.rows) / view.columns));
  const values = [];
  for (let i = 0; i < across; i++) {
    for (let j = 0; j < down; j++) {
      const column = ((i + 0.5) / across) * view.columns - 0.5;
      const row = ((j + 0.5) / down) * view.rows - 0.5;
      const { value, error } = subject.pixel(view, column, row, 1);
      if (Number.isFinite(value)) values.push(errors ? (value > 0 ? error / value : 0) : value);
    }
  }
  return Float64Array.from(values).sort();
}

