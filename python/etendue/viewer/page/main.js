// The page: what is shown, how it is looked at, and what is read in it.

import { COLOUR_MAPS, coloursOf } from "./colours.js";
import { Field } from "./field.js";
import { sectionOf } from "./geometry.js";
import { listenToKeys, listenToPointer } from "./hands.js";
import { measured, plain, prefixed, withUnit } from "./numbers.js";
import { drawLegend, drawMarks, drawSection } from "./overlay.js";
import { Painter } from "./painter.js";
import { $, numberField, save, showRegions } from "./panel.js";
import { PixelMap } from "./picture.js";
import { measureRegion, measureSection, overview, quantile } from "./readings.js";
import { serverOf } from "./server.js";
import { SHADERS } from "./shaders.js";
import { Solid } from "./solid.js";
import { View } from "./view.js";

const PIXEL = 2; // CSS pixels of a pixel of the core's map
const REST = 220; // ms after the last touch of a wheel or key at which the picture is at rest
const KEY_DEGREES = 1;
const KEY_SHIFT = 0.04; // of the width
const KEY_ZOOM = 1.15;

const packed = JSON.parse($("subject").textContent);
const server = serverOf();
const state = {
  view: null,
  subject: null,
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
};
let painter = null;
let solid = null;
let round = 0; // of measurements: older ones are given up
let timer = 0;
let lastFrame = 0; // [ms]
let sampled = false; // whether that frame drew the light anew
let queued = false;

// --- the view -------------------------------------------------------------------------------------------------------

function firstView() {
  const box = $("stage").getBoundingClientRect();
  const [columns, rows] = [box.width, box.height].map((x) => Math.max(8, Math.floor(x / PIXEL)));
  const asked = viewOfAddress();
  const shape = { columns, rows };
  const { width, height = 0, ...rest } = packed.view;
  // All of what was framed is seen, whatever the shape of the window.
  return new View({ ...rest, width: Math.max(width, (height * columns) / rows), ...shape, ...asked });
}

/** The view that the address asks for, as #theta=30&phi=0&roll=90&width=4. */
function viewOfAddress() {
  const found = {};
  for (const [name, value] of new URLSearchParams(location.hash.slice(1))) {
    if (["theta", "phi", "distance", "roll", "width", "columns", "rows"].includes(name)) found[name] = Number(value);
    if (["target", "up"].includes(name)) found[name] = value.split(",").map(Number);
  }
  return found;
}

function setView(view, moving = false) {
  state.view = view;
  server.stop();
  if (packed.kind === "field" && painter && painter.subject !== state.field) showSubject(state.field);
  state.moving = moving;
  round += 1;
  painter?.restart(moving);
  clearTimeout(timer);
  if (!moving) rest();
  draw();
}

/** A map has been looked at already: no observer can be chosen. */
function fixed() {
  return packed.kind === "map";
}

function atRest() {
  clearTimeout(timer);
  timer = setTimeout(() => {
    state.moving = false;
    painter?.restart(false);
    rest();
    draw();
  }, REST);
}

/** What is worked out once nothing moves. */
async function rest() {
  showCommand();
  const mine = ++round;
  const current = () => mine === round;
  const { subject, view } = state;
  const known = (measured) => measured?.subject === subject && measured.view === view;
  const open = state.regions.filter((region) => !known(region.of));
  for (const region of open) region.figures = null;
  listRegions();
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
  painter?.setSubject(subject);
  $("busy").hidden = true;
}

// --- the picture ----------------------------------------------------------------------------------------------------

function draw() {
  if (queued) return;
  queued = true;
  requestAnimationFrame(frame);
}

function frame(now) {
  queued = false;
  const { view, look } = state;
  if (painter) {
    if (state.moving && sampled) painter.pace(now - lastFrame);
    lastFrame = now;
    sampled = painter.unfinished;
    if (sampled) painter.sample(view);
    painter.paint(look);
  }
  document.body.dataset.painted ??= String(performance.now()); // [ms] since the page was asked for: a test reads it
  drawMarks($("marks"), view, {
    ...state,
    geometry: packed.geometry,
    resolution: look.grid ? packed.resolution?.pitch : 0,
  });
  showReading();
  showView();
  solid?.draw(view);
  if (state.line && state.section) drawSection($("section"), state.section, packed.unit, look.logarithmic);
  // As long as it moves, frames follow one another, so that their distance tells how long one takes.
  if (painter?.unfinished || state.moving) draw();
  else document.body.dataset.ready = "true";
}

function fitCanvas() {
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

function resized() {
  const { columns, rows } = fitCanvas();
  setView(state.view.with({ columns, rows, width: (state.view.width / state.view.columns) * columns }));
}

// --- the scale ------------------------------------------------------------------------------------------------------

function fitScale() {
  const { look } = state;
  const shares = ["share-low", "share-high"].map((id) => Math.min(Math.max(Number($(id).value) / 100, 0), 1));
  const values = overview(state.subject, state.view, look.errors);
  if (values.length === 0) return;
  let [low, high] = shares.map((share) => quantile(values, share));
  // A little of the brightest would fill the scale with what hardly anybody sees; nothing at all leaves no scale.
  if (!(high > 0)) high = values.at(-1) || 1;
  if (look.errors) high = Math.min(high, 1); // what is less sure than that is not known
  if (!look.logarithmic && low < 0.02 * high) low = 0;
  if (look.logarithmic && !(low > high * 1e-4)) low = high * 1e-3;
  if (!(low < high)) low = look.logarithmic ? high / 10 : 0;
  setRange(low, high);
}

function setRange(low, high) {
  const { look } = state;
  look.range = [low, high];
  state.ranges[look.errors ? "error" : "light"] = look.range;
  draw();
}

function setLook(changes) {
  const { look } = state;
  Object.assign(look, changes);
  if ("errors" in changes) {
    const kept = state.ranges[look.errors ? "error" : "light"];
    if (kept) look.range = kept;
    else fitScale();
  }
  if (look.logarithmic && !(look.range[0] > 0)) look.range = [look.range[1] * 1e-3, look.range[1]];
  if ("colours" in changes || "errors" in changes) {
    const name = look.errors && look.colours === "inferno" ? "viridis" : look.colours;
    state.colours = coloursOf(name);
    painter?.setColours(state.colours);
  }
  $("logarithmic").checked = look.logarithmic;
  $("grid").checked = look.grid;
  $("isolines").value = String(look.isolines);
  $("overlay").value = look.errors ? "error" : "light";
  $("resolution").hidden = !look.grid;
  draw();
}

/** What is seen of the scene's faces and rays, and where it is cut. */
function setShown(changes) {
  Object.assign(state.shown, changes);
  const plane = sectionOf(packed.geometry, state.shown);
  $("section-place").hidden = !plane;
  for (const [id, name] of [["show-faces", "faces"], ["show-rays", "rays"]]) $(id).checked = state.shown[name];
  $("section-axis").value = state.shown.axis;
  $("section-at").textContent = plane ? `${plane.axis} = ${plain(plane.at, 4)} mm` : "";
  draw();
}

// --- what is read ---------------------------------------------------------------------------------------------------

/** Value and standard error of the pixel under a place [CSS pixels] on the picture. */
function readingAt(x, y) {
  const [column, row] = [x, y].map((p) => Math.floor(p / PIXEL));
  return { column, row, ...state.subject.pixel(state.view, column, row) };
}

function showReading() {
  const { look, pointer } = state;
  const [factor, unit] = look.errors ? [0.01, "%"] : prefixed(look.range[1], packed.unit);
  const legend = { ...look, unit, factor, title: look.errors ? "relative standard error" : packed.quantity };
  let mark = NaN;
  if (pointer) {
    const found = readingAt(...pointer);
    const [u, v] = state.view.place(found.column + 0.5, found.row + 0.5);
    const share = found.value > 0 && Number.isFinite(found.error) ? ` · ± ${plain((100 * found.error) / found.value, 2)} %` : "";
    $("reading").textContent = measured(found.value, found.error, packed.unit);
    $("place").textContent = `${plain(u, 4)} mm right, ${plain(v, 4)} mm up${share} · pixel ${found.column}, ${found.row}`;
    mark = look.errors ? found.error / found.value : found.value;
  }
  drawLegend($("legend"), state.colours, legend, mark);
}

function listRegions() {
  showRegions(state.regions, packed.unit, packed.flux_unit, (region) => {
    state.regions = state.regions.filter((one) => one !== region);
    listRegions();
    draw();
  });
}

const fields = {};

function showView() {
  const { view, look } = state;
  for (const name of ["theta", "phi", "distance", "width"]) fields[name](view[name]);
  ["x", "y", "z"].forEach((axis, i) => fields[`target-${axis}`](view.target[i]));
  const unit = look.errors ? 0.01 : 1;
  fields.low(look.range[0] / unit, 4);
  fields.high(look.range[1] / unit, 4);
  $("scale-unit").textContent = look.errors ? "%" : packed.unit;
  if (solid) $("intensity").textContent = `${withUnit(solid.towards(view.theta, view.phi), packed.intensity.unit)} here`;
}

/** The view as the command line takes it; numbers with so many digits that the core's map has the same pixels. */
function command() {
  const { view } = state;
  const digits = (x) => String(Number(x.toPrecision(12)));
  const turns = [view.upright && `--up=${view.upright.map(digits).join(",")} `, view.roll && `--roll=${digits(view.roll)} `];
  const upright = turns.filter(Boolean).join("");
  const file = /^[\w./-]+$/.test(packed.file) ? packed.file : `'${packed.file.replaceAll("'", `'\\''`)}'`;
  return (
    `etendue luminance ${file} --observer=${digits(view.theta)},${digits(view.phi)} --distance ${digits(view.distance)} ` +
    `--target=${view.target.map(digits).join(",")} ${upright}--size ${digits(view.width)},${digits(view.height)} ` +
    `--pixels ${view.columns},${view.rows} -o map.exr`
  );
}

function showCommand() {
  $("command").textContent = fixed() ? "" : command();
}

// --- tools ----------------------------------------------------------------------------------------------------------

function chooseTool(name) {
  Object.assign(state, { tool: name, drawing: null, polygon: null }); // a polygon that was begun is given up
  for (const button of document.querySelectorAll("[data-tool]")) {
    button.setAttribute("aria-pressed", String(button.dataset.tool === name));
  }
  $("stage").classList.toggle("drawing", name !== "look");
  draw();
}

function onScreen([x, y]) {
  return state.view.place(x / PIXEL, y / PIXEL);
}

function drawn(corners) {
  state.drawing = null;
  if (state.tool === "line") {
    state.line = corners;
    state.section = null;
    $("section-box").hidden = false;
  } else {
    state.regions.push({ kind: state.tool, corners, figures: null });
  }
  rest();
  draw();
}

function rectangle([a, b]) {
  return [a, [b[0], a[1]], b, [a[0], b[1]]];
}

const drawings = {
  begin(place) {
    const here = onScreen(place);
    if (state.tool === "polygon") {
      state.polygon = [...(state.polygon ?? []), here];
      state.drawing = state.polygon;
    } else {
      state.start = here;
    }
    draw();
  },
  extend(place) {
    if (state.tool === "polygon") return;
    const ends = [state.start, onScreen(place)];
    state.drawing = state.tool === "line" ? ends : [...rectangle(ends), ends[0]];
    draw();
  },
  end(place) {
    if (state.tool === "polygon") return;
    const ends = [state.start, onScreen(place)];
    const large = Math.hypot(ends[0][0] - ends[1][0], ends[0][1] - ends[1][1]) > (2 * state.view.width) / state.view.columns;
    state.drawing = null;
    if (large) drawn(state.tool === "line" ? ends : rectangle(ends));
    draw();
  },
  finish() {
    if (state.tool !== "polygon" || (state.polygon?.length ?? 0) < 3) return;
    const corners = state.polygon;
    state.polygon = null;
    drawn(corners);
  },
};

function clear() {
  Object.assign(state, { regions: [], line: null, section: null, drawing: null, polygon: null });
  $("section-box").hidden = true;
  listRegions();
  draw();
}

// --- hands ----------------------------------------------------------------------------------------------------------

function orbit(rightwards, upwards) {
  if (!fixed()) setView(state.view.orbited(rightwards, upwards), true);
}

function shift(right, up) {
  const size = state.view.width / (state.view.columns * PIXEL);
  setView(state.view.shifted(-right * size, -up * size), true);
}

/** Larger or smaller about a place of the picture, which stays where it is. */
function zoom(factor, place) {
  const { view } = state;
  const [u, v] = place ? onScreen(place) : [0, 0];
  const width = Math.min(Math.max(view.width * factor, 1e-6), 1e6);
  const real = width / view.width;
  setView(view.with({ width }).shifted(u * (1 - real), v * (1 - real)), true);
}

function listen() {
  listenToPointer($("stage"), () => state.tool, {
    orbit,
    shift,
    zoom,
    point(place) {
      state.pointer = place;
      draw();
    },
    rest: atRest,
    restSoon: atRest,
    ...drawings,
  });
  const turn = (rightwards, upwards) => () => {
    orbit(rightwards, upwards);
    atRest();
  };
  const move = (right, up) => () => {
    const step = KEY_SHIFT * state.view.columns * PIXEL;
    shift(right * step, up * step);
    atRest();
  };
  const zoomed = (factor) => () => {
    zoom(factor, null);
    atRest();
  };
  const keys = { "?": () => $("help").showModal(), 0: reset, c: clear, f: fitScale, Enter: drawings.finish };
  for (const [arrow, [x, y]] of Object.entries({ ArrowLeft: [1, 0], ArrowRight: [-1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] })) {
    keys[arrow] = turn(x * KEY_DEGREES, y * KEY_DEGREES);
    keys[`Shift+${arrow}`] = turn(10 * x * KEY_DEGREES, 10 * y * KEY_DEGREES);
  }
  Object.assign(keys, { w: move(0, -1), s: move(0, 1), a: move(1, 0), d: move(-1, 0) });
  Object.assign(keys, { "+": zoomed(1 / KEY_ZOOM), "=": zoomed(1 / KEY_ZOOM), "-": zoomed(KEY_ZOOM) });
  for (const [key, name] of Object.entries({ v: "look", r: "rectangle", p: "polygon", l: "line" })) {
    keys[key] = () => chooseTool(name);
  }
  keys.g = () => setLook({ logarithmic: !state.look.logarithmic });
  keys.e = () => setLook({ errors: !state.look.errors });
  keys.i = () => setLook({ isolines: state.look.isolines ? 0 : 10 });
  listenToKeys(keys);
  window.addEventListener("resize", resized);
}

function reset() {
  setView(firstView());
}

function makeFields() {
  const above = (value) => value > 0;
  const view = (name) => (value) => setView(state.view.with({ [name]: value }));
  fields.theta = numberField("theta", (x) => x >= 0 && x <= 180, view("theta"));
  fields.phi = numberField("phi", () => true, view("phi"));
  fields.distance = numberField("distance", above, view("distance"));
  fields.width = numberField("width", above, view("width"));
  ["x", "y", "z"].forEach((axis, i) => {
    fields[`target-${axis}`] = numberField(`target-${axis}`, () => true, (value) => {
      setView(state.view.with({ target: state.view.target.map((x, k) => (k === i ? value : x)) }));
    });
  });
  const unit = () => (state.look.errors ? 0.01 : 1);
  const [low, high] = [() => state.look.range[0], () => state.look.range[1]];
  fields.low = numberField("low", (x) => x * unit() < high() && (x > 0 || !state.look.logarithmic), (x) => setRange(x * unit(), high()));
  fields.high = numberField("high", (x) => x * unit() > low(), (x) => setRange(low(), x * unit()));
  for (const name of COLOUR_MAPS) $("colours").append(new Option(name, name));
  $("colours").addEventListener("change", (event) => setLook({ colours: event.target.value }));
  $("overlay").addEventListener("change", (event) => setLook({ errors: event.target.value === "error" }));
  $("isolines").addEventListener("change", (event) => setLook({ isolines: Number(event.target.value) }));
  $("logarithmic").addEventListener("change", (event) => setLook({ logarithmic: event.target.checked }));
  $("grid").addEventListener("change", (event) => setLook({ grid: event.target.checked }));
  for (const [id, name] of [["show-faces", "faces"], ["show-rays", "rays"]]) {
    $(id).addEventListener("change", (event) => setShown({ [name]: event.target.checked }));
  }
  $("section-axis").addEventListener("change", (event) => setShown({ axis: event.target.value }));
  $("section-place").addEventListener("input", (event) => setShown({ place: Number(event.target.value) }));
  $("fit").addEventListener("click", fitScale);
  $("reset").addEventListener("click", reset);
  $("clear").addEventListener("click", clear);
  $("help-button").addEventListener("click", () => $("help").showModal());
  for (const button of document.querySelectorAll("[data-tool]")) {
    button.addEventListener("click", () => chooseTool(button.dataset.tool));
  }
  $("copy").addEventListener("click", () => navigator.clipboard?.writeText(command()));
  $("save-section").addEventListener("click", () => {
    const lines = (state.section ?? []).map((p) => `${p.at},${p.value},${p.error}`);
    save("section.csv", [[`position from A [mm],${packed.quantity} [${packed.unit}],standard error`, ...lines, ""].join("\n")], "text/csv");
  });
}

// --- beginning ------------------------------------------------------------------------------------------------------

function describe() {
  document.body.dataset.kind = packed.kind;
  $("name").textContent = packed.name;
  $("facts").textContent = packed.facts;
  $("quantity").textContent = packed.quantity;
  $("overlay").options[0].text = packed.quantity;
  $("accuracy").textContent = packed.accuracy;
  $("notes").replaceChildren(
    ...packed.notes.map((note) => Object.assign(document.createElement("li"), { textContent: note })),
  );
  $("notes-box").hidden = packed.notes.length === 0;
  $("resolution").textContent = packed.resolution?.text ?? "";
  $("grid-box").hidden = !packed.resolution;
  $("solid-box").hidden = !packed.intensity;
  $("geometry-box").hidden = !packed.geometry;
  $("left-out").hidden = !packed.geometry?.left_out;
  $("observer-box").hidden = fixed();
  $("copy").hidden = fixed();
  $("export-box").hidden = fixed() && !packed.server;
  for (const format of packed.server?.formats ?? []) {
    const button = Object.assign(document.createElement("button"), { textContent: format.toUpperCase() });
    button.title = "Worked out by the core for this view";
    button.addEventListener("click", async () => {
      button.disabled = true;
      try {
        const blob = await server.map(state.view, format, state.look);
        save(`${packed.name.replace(/\.\w+$/, "")}.${format}`, [blob], blob.type);
      } catch (error) {
        complain(error);
      }
      button.disabled = false;
    });
    $("export").append(button);
  }
}

function complain(error) {
  $("trouble").hidden = false;
  $("trouble").textContent = error.message;
}

async function begin() {
  describe();
  makeFields();
  state.subject = packed.kind === "field" ? await Field.read(packed.field) : PixelMap.read(packed.map);
  state.field = state.subject;
  fitCanvas();
  state.view = firstView();
  state.colours = coloursOf(state.look.colours);
  const brightest = overview(state.subject, state.view).at(-1) || 1;
  try {
    painter = new Painter($("picture"), state.subject, SHADERS, brightest);
    painter.setColours(state.colours);
  } catch (error) {
    complain(error);
  }
  if (packed.intensity) solid = new Solid($("solid"), packed.intensity, coloursOf("inferno"));
  listen();
  chooseTool("look");
  fitScale();
  setView(state.view);
  // For tests: what a user sees, by name.
  window.etendue = {
    state,
    setView: (changes) => setView(state.view.with(changes)),
    reading: (column, row) => state.subject.pixel(state.view, column, row),
    painted: (x, y) => painter.found(x, y),
    samples: () => painter?.samples ?? 0,
    coarseness: () => painter.coarseness,
    finished: () => !painter?.unfinished && !queued,
    failed: () => ($("trouble").hidden ? null : $("trouble").textContent),
    setLook,
    setShown,
    drawn(tool, corners) {
      chooseTool(tool);
      drawn(corners);
    },
  };
}

begin().catch(complain);
