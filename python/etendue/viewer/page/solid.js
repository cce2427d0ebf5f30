// The intensity solid: luminous intensity as a body about the source, and the present direction in it.

import { colourAt } from "./colours.js";
import { normalised } from "./view.js";

const TILT = 22; // of the camera above the horizon [°]
const FILL = 0.8; // of the canvas by the largest intensity

function unit(theta, phi) {
  const [t, p] = [theta, phi].map((x) => (x * Math.PI) / 180);
  return [Math.sin(t) * Math.cos(p), Math.sin(t) * Math.sin(p), Math.cos(t)];
}

export class Solid {
  /** `packed`: C-planes and γ [°], values [cd] row by row, unit. */
  constructor(canvas, packed, colours) {
    Object.assign(this, { canvas, ...packed, colours, turn: -60 });
    this.most = this.values.reduce((most, x) => Math.max(most, x), 0) || 1;
  }

  value(plane, ring) {
    return this.values[(plane % this.c.length) * this.gamma.length + ring];
  }

  /** Right, up and near of a point in the solid's own picture. */
  seen([x, y, z]) {
    const [c, s] = [Math.cos((this.turn * Math.PI) / 180), Math.sin((this.turn * Math.PI) / 180)];
    const [ct, st] = [Math.cos((TILT * Math.PI) / 180), Math.sin((TILT * Math.PI) / 180)];
    const [a, near] = [-s * x + c * y, c * x + s * y];
    return [a, z * ct - near * st, near * ct + z * st];
  }

  /** `here`: the intensity towards the observer of the view. */
  draw(view, here) {
    const { canvas } = this;
    const scale = window.devicePixelRatio || 1;
    const [width, height] = [canvas.clientWidth, canvas.clientHeight].map((x) => Math.round(x * scale));
    if (width === 0) return;
    if (canvas.width !== width || canvas.height !== height || !this.body) {
      Object.assign(canvas, { width, height });
      this.drawBody(width, height, scale);
    }
    const pen = canvas.getContext("2d");
    pen.clearRect(0, 0, width, height);
    pen.drawImage(this.body, 0, 0);
    this.drawDirection(pen, scale, view, here);
  }

  /** The body itself, which does not change, on a canvas of its own; and where points of it are on that. */
  drawBody(width, height, scale) {
    this.body = Object.assign(document.createElement("canvas"), { width, height });
    const pen = this.body.getContext("2d");
    pen.lineJoin = "round";
    const points = this.c.map((c, i) =>
      this.gamma.map((g, j) => this.seen(unit(g, c).map((x) => (x * this.value(i, j)) / this.most))),
    );
    // All of it in the middle of the canvas, as large as fits.
    const flat = [...points.flat(), [0, 0, 0]];
    const ends = [0, 1].map((axis) => flat.reduce(([low, high], p) => [Math.min(low, p[axis]), Math.max(high, p[axis])], [0, 0]));
    const zoom = FILL / Math.max((ends[0][1] - ends[0][0]) / width, (ends[1][1] - ends[1][0]) / height);
    const middle = ends.map(([low, high]) => (low + high) / 2);
    this.place = (p) => [width / 2 + (p[0] - middle[0]) * zoom, height / 2 - (p[1] - middle[1]) * zoom];
    const faces = [];
    for (let i = 0; i < this.c.length; i++) {
      for (let j = 0; j + 1 < this.gamma.length; j++) {
        const next = (i + 1) % this.c.length;
        const corners = [points[i][j], points[next][j], points[next][j + 1], points[i][j + 1]];
        const value = (this.value(i, j) + this.value(next, j + 1)) / 2 / this.most;
        if (value > 1e-4) faces.push({ corners, value, depth: corners.reduce((sum, c) => sum + c[2], 0) });
      }
    }
    faces.sort((a, b) => a.depth - b.depth);
    for (const { corners, value } of faces) {
      pen.beginPath();
      corners.forEach((c, k) => pen[k ? "lineTo" : "moveTo"](...this.place(c)));
      pen.closePath();
      const [a, b, c] = corners;
      const [u, v] = [b, c].map((p) => p.map((x, k) => x - a[k]));
      const normal = normalised([u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]].map((x) => x || 1e-30));
      pen.fillStyle = pen.strokeStyle = colourAt(this.colours, 0.25 + 0.6 * value * (0.55 + 0.45 * Math.abs(normal[2])));
      pen.fill();
      pen.stroke();
    }
    this.drawAxes(pen, scale);
  }

  drawAxes(pen, scale) {
    const { place } = this;
    pen.strokeStyle = pen.fillStyle = "#7d8894";
    pen.lineWidth = scale;
    pen.font = `${10 * scale}px system-ui, sans-serif`;
    for (const [axis, name] of [[[0.5, 0, 0], "x"], [[0, 0.5, 0], "y"]]) {
      pen.beginPath();
      pen.moveTo(...place(this.seen([0, 0, 0])));
      const end = place(this.seen(axis));
      pen.lineTo(...end);
      pen.stroke();
      pen.fillText(name, end[0] + 3 * scale, end[1] + 3 * scale);
    }
  }

  drawDirection(pen, scale, view, here) {
    const { place } = this;
    const value = here / this.most;
    const direction = unit(view.theta, view.phi);
    const tip = place(this.seen(direction.map((x) => x * Math.max(value, 0.02))));
    const end = place(this.seen(direction.map((x) => x * Math.max(1.12 * value, 0.35))));
    pen.strokeStyle = pen.fillStyle = "#7fd4ff";
    pen.lineWidth = 1.5 * scale;
    pen.beginPath();
    pen.moveTo(...place(this.seen([0, 0, 0])));
    pen.lineTo(...end);
    pen.stroke();
    pen.beginPath();
    pen.arc(...tip, 3.5 * scale, 0, 2 * Math.PI);
    pen.fill();
  }
}
