// The view: set, in motion, at rest, and drawn frame by frame.

import { intensityHere, listRegions, showCommand, showReading, showView } from "./figures.js";
import { typed } from "./numbers.js";
import { drawMarks, drawSection } from "./overlay.js";
import { $ } from "./panel.js";
import { PixelMap } from "./picture.js";
import { measureIntensity, measureRegion, measureSection } from "./readings.js";
import { PIXEL, draw, fixed, packed, server, state } from "./state.js";
import { View } from "./view.js";

const REST = 220; // ms after the last touch of a wheel or key at which the picture is at rest

let round = 0; // of measurements: older ones are given up
let timer = 0;
let lastFrame = 0; // [ms]
let sampled = false; // whether that frame drew the light anew

export function firstView() {
  const box = $("stage").getBoundingClientRect();
  const [columns, rows] = [box.width, box.height].map((x) => Math.max(8, Math.floor(x / PIXEL)));
  const asked = viewOfAddress();
  const shape = { columns, rows };
  const { width, height = 0, ...rest } = packed.view;
  // All of what was framed is seen, whatever the shape of the window.
  return new View({ ...rest, width: Math.max(width, (height * columns) / rows), ...shape, ...asked });
}

/** Which finite numbers an address may ask for, where not all of them. */
const ALLOWED = {
  theta: (x) => x >= 0 && x <= 180,
  distance: (x) => x > 0,
  width: (x) => x > 0,
  columns: (x) => x >= 8 && x % 1 === 0,
  rows: (x) => x >= 8 && x % 1 === 0,
};

/** The view that the address asks for, as #theta=30&phi=0&roll=90&width=4, without what is no view; of a map, what can be moved. */
function viewOfAddress() {
  const found = {};
  const numbers = fixed() ? ["width"] : ["theta", "phi", "distance", "roll", "width", "columns", "rows"];
  const vectors = fixed() ? ["target"] : ["target", "up"];
  for (const [name, text] of new URLSearchParams(location.hash.slice(1))) {
    const values = text.split(",").map(typed);
    if (!values.every(Number.isFinite)) continue;
    if (numbers.includes(name) && values.length === 1 && (ALLOWED[name]?.(values[0]) ?? true)) found[name] = values[0];
    if (vectors.includes(name) && values.length === 3 && (name === "target" || values.some(Boolean))) found[name] = values;
  }
  return found;
}

export function setView(view, moving = false) {
  state.view = view;
  server.stop();
  if (packed.kind === "field" && state.painter && state.painter.subject !== state.field) showSubject(state.field);
  state.moving = moving;
  round += 1;
  state.painter?.restart(moving);
  clearTimeout(timer);
  if (!moving) rest();
  draw();
}

export function atRest() {
  clearTimeout(timer);
  timer = setTimeout(() => {
    state.moving = false;
    state.painter?.restart(false);
    rest();
    draw();
  }, REST);
}

/** What is worked out once nothing moves. */
export async function rest() {
  showCommand();
  const mine = ++round;
  const current = () => mine === round;
  const { subject, view } = state;
  const known = (measured) => measured?.subject === subject && measured.view === view;
  const open = state.regions.filter((region) => !known(region.of));
  for (const region of open) region.figures = null;
  listRegions();
  if (state.solid && intensityHere().quick) {
    const found = await measureIntensity(state.field, view, current);
    if (!current()) return;
    state.here = { theta: view.theta, phi: view.phi, ...found };
    draw();
  }
  for (const region of open) {
    const figures = await measureRegion(subject, view, region.corners, current);
    if (!current()) return;
    Object.assign(region, { figures, of: { subject, view } });
    listRegions();
  }
  if (state.line && !(state.section && known(state.sectionOf))) {
    const section = await measureSection(subject, view, state.line, current);
    if (!current()) return;
    Object.assign(state, { section, sectionOf: { subject, view } });
    draw();
  }
  $("section-box").hidden = !state.line;
  if (packed.kind === "field" && packed.server?.refines) await refine(current);
}

/** The view by lines of sight, in the place of the light field's picture. */
function refine(current) {
  return server.refine(state.view, (words, map) => {
    if (!current()) return;
    if (map) showSubject(PixelMap.read(map));
    $("busy").hidden = false;
    $("busy").textContent = words;
    draw();
  });
}

function showSubject(subject) {
  state.subject = subject;
  state.painter?.setSubject(subject);
  $("busy").hidden = true;
}

export function frame(now) {
  const { view, look } = state;
  if (state.painter) {
    if (state.moving && sampled) state.painter.pace(now - lastFrame);
    lastFrame = now;
    sampled = state.painter.unfinished;
    if (sampled) state.painter.sample(view);
    state.painter.paint(look);
  }
  document.body.dataset.painted ??= String(performance.now()); // [ms] since the page was asked for: a test reads it
  drawMarks($("marks"), view, {
    ...state,
    geometry: packed.geometry,
    resolution: look.grid ? packed.resolution?.pitch : 0,
  });
  showReading();
  showView();
  state.solid?.draw(view, intensityHere().value);
  if (state.line && state.section) drawSection($("section"), state.section, packed.unit, look.logarithmic);
  // As long as it moves, frames follow one another, so that their distance tells how long one takes.
  if (state.painter?.unfinished || state.moving) draw();
  else document.body.dataset.ready = "true";
}

export function fitCanvas() {
  const box = $("stage").getBoundingClientRect();
  const [columns, rows] = [box.width, box.height].map((x) => Math.max(8, Math.floor(x / PIXEL)));
  const [width, height] = [columns * PIXEL, rows * PIXEL];
  for (const canvas of [$("picture"), $("marks")]) {
    canvas.style.width = `${width}px`;
    canvas.style.height = `${height}px`;
  }
  const scale = window.devicePixelRatio || 1;
  $("picture").width = Math.round(width * scale);
  $("picture").height = Math.round(height * scale);
  return { columns, rows };
}

export function resized() {
  const { columns, rows } = fitCanvas();
  setView(state.view.with({ columns, rows, width: (state.view.width / state.view.columns) * columns }));
}

export function reset() {
  setView(firstView());
}
