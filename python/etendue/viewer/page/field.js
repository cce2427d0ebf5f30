// A light field read in double precision, as the core reads it: theory.md, eq. 38; the core's `light_field.rs` and `look.rs`.

import { areaOf, cross, departing, turned } from "./chart.js";
import { constantTable, readTable } from "./tables.js";

// Of the core's `look.rs`: how many times as many points there are where they differ much, by which share of the error or of
// the value their average may be off before there are, how many there are at most, and of how many each half is a lattice.
const FINER = 16;
const LEFT = [0.25, 0.005];
const MOST_POINTS = 2048;
const HALVES = 64;
// Points along either side of a part over which intensity is summed: as many as its cells, within these.
const INTENSITY_POINTS = [64, 128];
// Of fewer, as those of regions, the neighbours are not looked at: the pixels of a region make up for each other's edges.
const OWN_POINTS = 16;

/** The two cells between whose centres `x` lies, and the weight of the second. */
function tent(x, n, wraps) {
  const t = x * n + 0.5;
  const upper = Math.trunc(t);
  const weight = t - upper;
  if (wraps) return [upper === 0 ? n - 1 : upper - 1, upper >= n ? 0 : upper, 1 - weight, weight];
  return [Math.min(Math.max(upper - 1, 0), n - 1), Math.min(upper, n - 1), 1 - weight, weight];
}

function bilinear(table, x, y, wraps) {
  const [rows, columns] = table.shape;
  if (rows * columns === 1) return table.values[table.codes[0]];
  const u = tent(x, rows, wraps);
  const v = tent(y, columns, false);
  let sum = 0;
  for (const i of [0, 1]) {
    for (const j of [0, 1]) sum += u[2 + i] * v[2 + j] * table.values[table.codes[u[i] * columns + v[j]]];
  }
  return sum;
}

/** What is left of errors averaged over an area of so many cells. */
function left(shares, area) {
  if (!(area > 1) || shares.length === 1) return shares[0];
  const doublings = 0.5 * Math.log2(area);
  const last = shares.length - 1;
  if (doublings >= last) return shares[last];
  const lower = Math.floor(doublings);
  return shares[lower] + (doublings - lower) * (shares[lower + 1] - shares[lower]);
}

/** Of a sum over a part of its value and the three kinds of its errors, spread over a share of its area. */
function varianceOf(part, sums, area) {
  const [n1, n2] = part.ratio.shape;
  const fine = part.spaceError.shape[0];
  const cells = sums[1] * left(part.cellsLeft, area * n1 * n2);
  return cells ** 2 + (sums[2] * left(part.withinLeft, area * fine * fine)) ** 2 + sums[3] ** 2;
}

/** How far the average over the points of a lattice may be off: by their variance, and by how every other of them differs. */
function latticeError(values) {
  const n = values.length;
  const halves = [0, 0];
  let squares = 0;
  values.forEach((x, i) => {
    halves[i % 2] += x;
    squares += x * x;
  });
  const mean = (halves[0] + halves[1]) / n;
  const byVariance = (0.4 * Math.sqrt(Math.max(squares / n - mean * mean, 0))) / n ** 0.75;
  return n < HALVES ? byVariance : Math.max(byVariance, Math.abs(halves[0] - halves[1]) / n);
}

function gcd(a, b) {
  return b === 0 ? a : gcd(b, a % b);
}

/** The core's points of a pixel: a lattice of rank 1. */
export function lattice(n) {
  const ideal = n * 0.6180339887498949;
  let generator = 1;
  for (let g = 1; g <= n; g++) {
    if (gcd(g, n) === 1 && Math.abs(g - ideal) < Math.abs(generator - ideal)) generator = g;
  }
  return Array.from({ length: n }, (_, i) => [(i + 0.5) / n, (((i * generator) % n) + 0.5) / n]);
}

/** One part: value and the three kinds of its errors at (s1, s2, a, b). */
function readPart(part, [s1, s2, a, b]) {
  const [n1, n2, n3, n4] = part.ratio.shape;
  const wraps = part.chart.shape === "tube";
  const x = tent(s1, n1, wraps);
  const y = tent(s2, n2, false);
  const u = tent(a, n3, false);
  const v = tent(b, n4, false);
  let mean = 0;
  let deviation = 0;
  for (const i of [0, 1]) {
    for (const j of [0, 1]) {
      const layer = (x[i] * n2 + y[j]) * n3;
      const near = x[2 + i] * y[2 + j];
      for (const k of [0, 1]) {
        for (const l of [0, 1]) {
          const cell = (layer + u[k]) * n4 + v[l];
          const weight = near * u[2 + k] * v[2 + l];
          const ratio = part.ratio.values[part.ratio.codes[cell]];
          mean += weight * ratio;
          // Kept relative, but where the ratio is 0.
          deviation += weight * (ratio || 1) * part.deviation.values[part.deviation.codes[cell]];
        }
      }
    }
  }
  const base = part.level * bilinear(part.space, s1, s2, wraps) * bilinear(part.direction, a, b, false);
  const value = base * mean;
  return [
    value,
    base * deviation,
    value * bilinear(part.spaceError, s1, s2, wraps),
    value * bilinear(part.directionError, a, b, false),
  ];
}

export class Field {
  /** `rayFlux`: of each of as many equal rays as the field rests on; NaN if that is not known. */
  constructor(parts, rayFlux) {
    Object.assign(this, { parts, rayFlux });
  }

  /** From what the page holds. */
  static async read(packed) {
    const table = (one, value) => (one ? readTable(one) : constantTable(value, 2));
    const parts = packed.parts.map(async (part) => ({
      chart: part.chart,
      level: part.level,
      cellsLeft: part.cells_left,
      withinLeft: part.within_left,
      ratio: await readTable(part.ratio),
      deviation: await readTable(part.deviation),
      space: await table(part.space, 1),
      direction: await table(part.direction, 1),
      spaceError: await table(part.space_error, 0),
      directionError: await table(part.direction_error, 0),
    }));
    return new Field(await Promise.all(parts), packed.ray_flux ?? NaN);
  }

  /** Luminance along one line and its standard error. */
  luminance(point, direction) {
    let value = 0;
    let variance = 0;
    for (const part of this.parts) {
      const place = cross(part.chart, point, direction);
      if (!place) continue;
      const [mean, ...kinds] = readPart(part, place);
      value += mean;
      for (const d of kinds) variance += d * d;
    }
    return { value, error: Math.sqrt(variance) };
  }

  /**
   * Mean luminance of a pixel of a view and its standard error, as the core's maps have them: where points differ much, or a
   * pixel beside it has another luminance, there are more of them, and what is left of the doubt is in the error.
   */
  pixel(view, column, row, samples = 16) {
    const seen = this.average(view, column, row, samples);
    const wanted = Math.max(LEFT[0] * seen.error, LEFT[1] * seen.value);
    if (samples === 1 || !(seen.left > wanted || this.stepBeside(view, column, row, samples, seen.value) > wanted)) return seen;
    const { value, error, left } = this.average(view, column, row, Math.min(samples * FINER, MOST_POINTS));
    return { value, error: Math.hypot(error, left) };
  }

  /** The pixels of the view, for figures of regions, read at so many points each. */
  grid(view, samples) {
    const { columns, rows, width } = view;
    return {
      columns,
      rows,
      steps: [width / columns, width / columns],
      place: (column, row) => view.place(column, row),
      cosine: (column, row) => view.cosine(column, row),
      read: (column, row) => this.pixel(view, column, row, samples),
    };
  }

  /** How far the average over a pixel may be off by an edge before its outermost points, of which the pixels beside it tell. */
  stepBeside(view, column, row, samples, value) {
    if (samples < OWN_POINTS) return 0;
    const beside = [[-1, 0], [1, 0], [0, -1], [0, 1]].map(([right, down]) => [column + right, row + down]);
    const there = beside.filter(([x, y]) => x >= 0 && x < view.columns && y >= 0 && y < view.rows);
    const steps = there.map(([x, y]) => Math.abs(this.average(view, x, y, samples).value - value));
    return (0.25 * Math.max(0, ...steps)) / samples;
  }

  /** The average over so many points of a pixel, its standard error, and how far it may be off that over the whole pixel. */
  average(view, column, row, samples) {
    const lines = lattice(samples).map(([du, dv]) => view.line(column + du, row + dv));
    const totals = new Float64Array(samples);
    let value = 0;
    let variance = 0;
    for (const part of this.parts) {
      const wraps = part.chart.shape === "tube";
      const sums = [0, 0, 0, 0];
      let first = null;
      const away = [0, 0];
      const squares = [0, 0];
      let points = 0;
      lines.forEach(([point, direction], at) => {
        const place = cross(part.chart, point, direction);
        if (!place) return;
        first ??= place;
        points += 1;
        const read = readPart(part, place);
        totals[at] += read[0];
        read.forEach((x, i) => (sums[i] += x));
        for (const axis of [0, 1]) {
          let step = place[axis] - first[axis];
          if (wraps && axis === 0) step -= Math.round(step);
          away[axis] += step;
          squares[axis] += step * step;
        }
      });
      if (points === 0) continue;
      const side = (axis) => Math.sqrt(12 * Math.max(squares[axis] / points - (away[axis] / points) ** 2, 0));
      const area = side(0) * side(1);
      value += sums[0] / samples;
      variance += varianceOf(part, sums.map((x) => x / samples), area);
    }
    return { value, error: Math.sqrt(variance), left: latticeError(totals) };
  }
  /**
   * Intensity towards a direction and its standard error, ∫ L cos θ dA over the surface [cd or W/sr], as pieces of work: each
   * returns its sums, of which `intensity` makes the whole. `most`: points along either side of a part.
   */
  intensityPieces(direction, most = INTENSITY_POINTS[1]) {
    return this.parts.flatMap((part, index) => {
      const d = turned(part.chart.axes, direction);
      const sides = [0, 1].map((axis) => {
        const cells = Math.max(part.ratio.shape[axis], part.space.shape[axis], INTENSITY_POINTS[0]);
        return Math.min(cells, most);
      });
      const each = (areaOf(part.chart) / (sides[0] * sides[1])) * 1e-6;
      return Array.from({ length: sides[0] }, (_, i) => () => {
        const sums = [0, 0, 0, 0];
        let lit = 0;
        for (let j = 0; j < sides[1]; j++) {
          const found = departing(part.chart, [(i + 0.5) / sides[0], (j + 0.5) / sides[1]], d);
          if (!found) continue;
          lit += 1 / (sides[0] * sides[1]);
          readPart(part, found.place).forEach((x, k) => (sums[k] += x * found.cosine * each));
        }
        return { index, sums, lit };
      });
    });
  }

  /** The whole of those pieces; their errors average out as they do over a pixel that holds all of the source. */
  intensity(pieces) {
    let value = 0;
    let variance = 0;
    this.parts.forEach((part, index) => {
      const own = pieces.filter((piece) => piece.index === index);
      const lit = own.reduce((sum, piece) => sum + piece.lit, 0);
      const sums = [0, 1, 2, 3].map((k) => own.reduce((sum, piece) => sum + piece.sums[k], 0));
      value += sums[0];
      variance += varianceOf(part, sums, lit);
    });
    return { value, error: Math.sqrt(variance) };
  }
}
