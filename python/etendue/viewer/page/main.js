// The page: what it begins with, and what hands, keys and fields do.

import { COLOUR_MAPS, coloursOf } from "./colours.js";
import { Field } from "./field.js";
import { command, fields } from "./figures.js";
import { listenToKeys, listenToPointer } from "./hands.js";
import { atRest, fitCanvas, firstView, frame, reset, resized, setView } from "./motion.js";
import { Painter } from "./painter.js";
import { $, numberField, save } from "./panel.js";
import { PixelMap } from "./picture.js";
import { overview } from "./readings.js";
import { fitScale, setLook, setRange, setShown } from "./scale.js";
import { SHADERS } from "./shaders.js";
import { Solid } from "./solid.js";
import { PIXEL, draw, fixed, onFrame, onScreen, packed, server, state, waiting } from "./state.js";
import { chooseTool, clear, drawings, drawn } from "./tools.js";

const KEY_DEGREES = 1;
const KEY_SHIFT = 0.04; // of the width
const KEY_ZOOM = 1.15;

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
  onFrame(frame);
  describe();
  makeFields();
  state.subject = packed.kind === "field" ? await Field.read(packed.field) : PixelMap.read(packed.map);
  state.field = state.subject;
  fitCanvas();
  state.view = firstView();
  state.colours = coloursOf(state.look.colours);
  const brightest = overview(state.subject, state.view).at(-1) || 1;
  try {
    state.painter = new Painter($("picture"), state.subject, SHADERS, brightest);
    state.painter.setColours(state.colours);
  } catch (error) {
    complain(error);
  }
  if (packed.intensity) state.solid = new Solid($("solid"), packed.intensity, coloursOf("inferno"));
  listen();
  chooseTool("look");
  fitScale();
  setView(state.view);
  // For tests: what a user sees, by name.
  window.etendue = {
    state,
    setView: (changes) => setView(state.view.with(changes)),
    reading: (column, row) => state.subject.pixel(state.view, column, row),
    painted: (x, y) => state.painter.found(x, y),
    samples: () => state.painter?.samples ?? 0,
    coarseness: () => state.painter.coarseness,
    finished: () => !state.painter?.unfinished && !waiting(),
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
