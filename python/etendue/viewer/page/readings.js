// What is read in a view: regions and cross sections, from the pixels that the core's map would have.


import { plus } from "./view.js";

const SLICE = 12; // ms of work between two looks at what the user does
const FLUX_POINTS = 256;
const FLUX_PARTS = 16;
const SECTION_POINTS = 240;
export const REGION_SAMPLES = 4;
const ON_THE_EDGE = 1e-9; // share of a pixel by which a middle may lie outside a region and still belong to it: rounding

/** Whether a point lies within a polygon (even-odd rule) or no farther from its edge than `slack`. */
export function within(corners, [x, y], slack = 0) {
  let inside = false;
  for (let i = 0, j = corners.length - 1; i < corners.length; j = i++) {
    const [ax, ay] = corners[i];
    const [dx, dy] = [corners[j][0] - ax, corners[j][1] - ay];
    const length = Math.hypot(dx, dy);
    if (length === 0) continue;
    const along = Math.min(Math.max(((x - ax) * dx + (y - ay) * dy) / length, 0), length) / length;
    if (Math.hypot(x - ax - along * dx, y - ay - along * dy) <= slack) return true;
    if (ay > y !== ay + dy > y && x < (dx * (y - ay)) / dy + ax) inside = !inside;
  }
  return inside;
}

/** The pixels of a grid whose middles lie within a polygon given in mm on the screen: those of `etendue.PolygonRegion`. */
export function pixelsWithin(grid, corners) {
  const found = [];
  const slack = ON_THE_EDGE * Math.min(...grid.steps);
  const { first, last } = boundsOf(grid, corners);
  for (let row = Math.max(0, first[1]); row < Math.min(grid.rows, last[1]); row++) {
    for (let column = Math.max(0, first[0]); column < Math.min(grid.columns, last[0]); column++) {
      if (within(corners, grid.place(column + 0.5, row + 0.5), slack)) found.push([column, row]);
    }
  }
  return found;
}

/** Columns and rows, counted on beyond the grid, between which a polygon lies: the first ones, and those after the last. */
function boundsOf(grid, corners) {
  const [left, top] = grid.place(0, 0);
  const places = corners.map(([x, y]) => [(x - left) / grid.steps[0], (top - y) / grid.steps[1]]);
  const ends = (most, rounded) => [0, 1].map((axis) => rounded(most(...places.map((place) => place[axis]))));
  return { first: ends(Math.min, Math.floor), last: ends(Math.max, Math.ceil) };
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

/**
 * The figures of a region, or null if it was given up. Values in the unit of the subject, lengths in mm. All of them are of the
 * pixels whose middles lie in the region, and of no others: what reaches beyond the picture counts in none.
 */
export async function measureRegion(subject, view, corners, current) {
  const grid = subject.grid(view, REGION_SAMPLES);
  const pixels = pixelsWithin(grid, corners);
  const all = await inSlices(pixels, ([column, row]) => grid.read(column, row), current);
  if (all === null) return null;
  const dead = all.filter((pixel) => !Number.isFinite(pixel.value)).length;
  if (all.length === dead) return { pixels: all.length, dead };
  // A dead pixel, and a cell of illuminance that no ray reached, count as 0 ± 0, as in `etendue.region_statistics`: where rays
  // are few, the pixels that one of them reached are too bright on average.
  const values = Float64Array.from(all, (pixel) => pixel.value || 0);
  const errors = all.map((pixel) => (pixel.value ? pixel.error : pixel.error || 0));
  const sum = (list) => list.reduce((total, x) => total + x, 0);
  const mean = sum(values) / values.length;
  // Neighbours err together; so far as all of them do, the mean errs by the mean of their errors.
  const error = sum(errors) / errors.length;
  const intensity = sum(values.map((x, i) => x * grid.cosine(pixels[i][0] + 0.5, pixels[i][1] + 0.5)));
  const pixelArea = grid.steps[0] * grid.steps[1];
  const sorted = values.slice().sort();
  const [least, most] = [sorted[0], sorted[sorted.length - 1]];
  const { first, last } = boundsOf(grid, corners);
  return {
    pixels: pixels.length,
    dead,
    cut: first[0] < 0 || first[1] < 0 || last[0] > grid.columns || last[1] > grid.rows,
    area: pixels.length * pixelArea,
    mean,
    error,
    minimum: least,
    maximum: most,
    percentiles: [0.05, 0.5, 0.95].map((share) => quantile(sorted, share)),
    uniformity: mean > 0 ? least / mean : NaN,
    diversity: most > 0 ? least / most : NaN,
    intensity: intensity * pixelArea * 1e-6,
    flux: subject.parts ? fluxThrough(subject, view, pixels) : null,
  };
}

/**
 * Flux through pixels of the screen towards the observer's side, all directions together: π · area · mean luminance over
 * places in the pixels and directions with density cosine/π. The error is that of counting those of the rays that the field
 * rests on, √(flux · flux of a ray) as in `LightField.intensity`, which the field mostly undercuts as it smooths; and that of
 * the sum, of which parts of the lattice tell.
 */
export function fluxThrough(field, view, pixels) {
  const area = pixels.length * view.pixelArea;
  const golden = [0.8566748838545029, 0.733891856627126, 0.6287067210378087, 0.5385972572236101];
  const means = [];
  let index = 0;
  for (let part = 0; part < FLUX_PARTS; part++) {
    let sum = 0;
    for (let i = 0; i < FLUX_POINTS; i++) {
      index += 1;
      const [a, b, c, d] = golden.map((g) => (index * g) % 1);
      const [column, row] = pixels[Math.floor(a * pixels.length)];
      const place = view.place(column + ((a * pixels.length) % 1), row + b);
      const radius = Math.sqrt(c);
      const [x, y] = [radius * Math.cos(2 * Math.PI * d), radius * Math.sin(2 * Math.PI * d)];
      const up = Math.sqrt(Math.max(1 - c, 0));
      const direction = plus(plus(view.toward.map((t) => t * up), view.right, x), view.up, y);
      const point = plus(plus(view.target, view.right, place[0]), view.up, place[1]);
      sum += field.luminance(point, direction).value;
    }
    means.push((sum / FLUX_POINTS) * Math.PI * area * 1e-6);
  }
  const value = means.reduce((a, b) => a + b, 0) / FLUX_PARTS;
  const spread = means.reduce((a, b) => a + (b - value) ** 2, 0) / (FLUX_PARTS - 1);
  return { value, error: Math.hypot(Math.sqrt(value * field.rayFlux), Math.sqrt(spread / FLUX_PARTS)) };
}

/** Intensity of a field towards the observer, who stands far away, and its standard error; null if it was given up. */
export async function measureIntensity(field, view, current) {
  const pieces = await inSlices(field.intensityPieces(view.toward), (work) => work(), current);
  return pieces && field.intensity(pieces);
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

