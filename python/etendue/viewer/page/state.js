// What the page shows and how it is looked at, and the one way to have it drawn anew.

import { $ } from "./panel.js";
import { serverOf } from "./server.js";

export const PIXEL = 2; // CSS pixels of a pixel of the core's map

export const packed = JSON.parse($("subject").textContent);
export const server = serverOf();
export const state = {
  view: null,
  subject: null,
  field: null,
  here: null,
  look: { range: [0, 1], logarithmic: false, errors: false, isolines: 0, grid: false, colours: "inferno" },
  ranges: { light: null, error: null },
  tool: "look",
  regions: [],
  line: null,
  section: null,
  drawing: null,
  pointer: null,
  shown: { faces: true, rays: false, axis: "", place: 0.5 },
  moving: false,
  painter: null,
  solid: null,
};
let frame = null;
let queued = false;

/** What draws a frame, given its time [ms]. */
export function onFrame(draws) {
  frame = draws;
}

export function draw() {
  if (queued) return;
  queued = true;
  requestAnimationFrame((now) => {
    queued = false;
    frame(now);
  });
}

/** Whether a frame is asked for that is not drawn yet. */
export function waiting() {
  return queued;
}

/** A map has been looked at already: no observer can be chosen. */
export function fixed() {
  return packed.kind === "map";
}

export function onScreen([x, y]) {
  return state.view.place(x / PIXEL, y / PIXEL);
}
