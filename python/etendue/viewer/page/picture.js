// A map of pixels that is there already: nothing can be moved in it, but everything can be read.

import { cosineSeen, plus } from "./view.js";

function floats(text) {
  const letters = atob(text);
  const bytes = new Uint8Array(letters.length);
  for (let i = 0; i < letters.length; i++) bytes[i] = letters.charCodeAt(i);
  return new Float32Array(bytes.buffer);
}

export class PixelMap {
  /** Rows from the top; values that are not finite are pixels without one; `eye`: where its own observer stands. */
  constructor({ columns, rows, width, height, target, right, up, eye, values, errors }) {
    Object.assign(this, { columns, rows, width, height, target, right, up, eye, values, errors });
  }

  static read(packed) {
    return new PixelMap({ ...packed, values: floats(packed.values), errors: floats(packed.errors) });
  }

  /** How far the middle of a view lies from that of the map, right and up [mm]. */
  shift(view) {
    const way = plus(view.target, this.target, -1);
    return [this.right, this.up].map((axis) => axis.reduce((sum, x, i) => sum + x * way[i], 0));
  }

  /** The pixel of the map that the middle of a pixel of the view lies in. */
  pixel(view, column, row) {
    const [u, v] = view.place(column + 0.5, row + 0.5);
    const [right, up] = this.shift(view);
    const x = Math.floor(((u + right) / this.width + 0.5) * this.columns);
    const y = Math.floor((0.5 - (v + up) / this.height) * this.rows);
    if (!(x >= 0 && x < this.columns && y >= 0 && y < this.rows)) return { value: NaN, error: NaN, beyond: true };
    const at = y * this.columns + x;
    return { value: this.values[at], error: this.errors[at], column: x, row: y };
  }

  /** The pixels of the map itself, whatever the view shows of them, for figures of regions; places are the view's [mm]. */
  grid(view) {
    const { columns, rows, width, height } = this;
    const [right, up] = this.shift(view);
    const own = (column, row) => [(column / columns - 0.5) * width, (0.5 - row / rows) * height];
    return {
      columns,
      rows,
      steps: [width / columns, height / rows],
      place: (column, row) => plus(own(column, row), [right, up], -1),
      cosine: (column, row) => cosineSeen(this, ...own(column, row)),
      read: (column, row) => ({ value: this.values[row * columns + column], error: this.errors[row * columns + column] }),
    };
  }
}
