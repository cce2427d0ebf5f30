// An observer and the pixel grid through his target: the conventions of `etendue.Observer` and `etendue.Screen`.

/** Cosine and sine of an angle in degrees, exact at quarter turns. */
function cosSin(angle) {
  const quarter = Math.floor(angle / 90);
  const rest = ((angle - 90 * quarter) * Math.PI) / 180;
  let [c, s] = [Math.cos(rest), Math.sin(rest)];
  for (let i = 0; i < ((quarter % 4) + 4) % 4; i++) [c, s] = [-s, c];
  return [c, s];
}

export function plus(a, b, factor = 1) {
  return a.map((x, i) => x + factor * b[i]);
}

export function normalised(v) {
  const length = Math.hypot(...v);
  return v.map((x) => x / length);
}

function cross(a, b) {
  return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
}

/** Cosine between the normal of a screen and the line from a place on it [mm] to the eye, as `etendue.Screen.cosine`. */
export function cosineSeen({ target, right, up, eye }, u, v) {
  const way = plus(plus(plus(eye, target, -1), right, -u), up, -v);
  const normal = cross(right, up);
  return Math.abs(way[0] * normal[0] + way[1] * normal[1] + way[2] * normal[2]) / Math.hypot(...way);
}

/** Sine of the angle between `up` and the line of sight below which nothing is upright, as in `etendue.Observer`. */
const ALONG_THE_LINE = 1e-6;

export class View {
  /**
   * theta, phi [°], distance [mm], target [mm]; up, a direction or null, and roll [°]; width of the screen [mm]; columns and
   * rows, whose pixels are square; plane of the screen, "view" or "xy", in which nothing is upright but +Y.
   */
  constructor({ theta, phi, distance, target, up = null, roll = 0, width, columns, rows, plane = "view" }) {
    Object.assign(this, { theta, phi, distance, target, upright: up, roll, width, columns, rows, plane });
    const [c, s] = cosSin(phi);
    const [ct, st] = cosSin(theta);
    this.right = [ct * c * c + s * s, (ct - 1) * c * s, -st * c];
    this.up = [(ct - 1) * c * s, ct * s * s + c * c, -st * s];
    this.toward = [st * c, st * s, ct];
    // Along `up` the view has no side that is upright, and keeps the axes of a view without one.
    if (up && Math.hypot(...cross(normalised(up), this.toward)) > ALONG_THE_LINE) {
      this.right = normalised(cross(normalised(up), this.toward));
      this.up = cross(this.toward, this.right);
    }
    if (roll) {
      const [cr, sr] = cosSin(roll);
      const { right, up: above } = this;
      this.right = plus(right.map((x) => cr * x), above, sr);
      this.up = plus(above.map((x) => cr * x), right, -sr);
    }
    if (plane === "xy") [this.right, this.up] = [[1, 0, 0], [0, 1, 0]];
    this.eye = plus(target, this.toward, distance);
  }

  get height() {
    return (this.width / this.columns) * this.rows;
  }

  get pixelArea() {
    return (this.width / this.columns) ** 2;
  }

  with(changes) {
    return new View({ ...this, up: this.upright, ...changes });
  }

  /** Place on the screen [mm], right and up of the target, of a point counted in pixels from the upper left corner. */
  place(column, row) {
    return [(column / this.columns - 0.5) * this.width, (0.5 - row / this.rows) * this.height];
  }

  /** The line of sight through that point: the point, and the direction in which light comes along it. */
  line(column, row) {
    const [u, v] = this.place(column, row);
    const point = plus(plus(this.target, this.right, u), this.up, v);
    return [point, normalised(plus(this.eye, point, -1))];
  }

  /** Cosine between the screen's normal and the line through that point: the apparent area of a pixel has it. */
  cosine(column, row) {
    return cosineSeen(this, ...this.place(column, row));
  }

  /** The view from another side: turned by so many degrees about its own axes, as a hand would turn the source. */
  orbited(rightwards, upwards) {
    const [a, b] = [rightwards, upwards].map((x) => (x * Math.PI) / 180);
    const angle = Math.hypot(a, b);
    if (angle === 0) return this;
    const aside = plus(this.right.map((x) => (x * a) / angle), this.up, b / angle);
    const toward = plus(this.toward.map((x) => x * Math.cos(angle)), aside, Math.sin(angle));
    const sine = Math.hypot(toward[0], toward[1]);
    const theta = (Math.atan2(sine, toward[2]) * 180) / Math.PI;
    // At the poles every azimuth is the same place, and the old one keeps the picture from jumping.
    const phi = sine < 1e-12 ? this.phi : (Math.atan2(toward[1], toward[0]) * 180) / Math.PI;
    return this.with({ theta, phi });
  }

  /** Shifted on the screen, in mm. */
  shifted(rightwards, upwards) {
    return this.with({ target: plus(plus(this.target, this.right, rightwards), this.up, upwards) });
  }
}
