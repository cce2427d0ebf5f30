// The scale and the colours, and what is seen of a scene.

import { coloursOf } from "./colours.js";
import { sectionOf } from "./geometry.js";
import { plain } from "./numbers.js";
import { $ } from "./panel.js";
import { overview, quantile } from "./readings.js";
import { draw, packed, state } from "./state.js";

export function fitScale() {
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

export function setRange(low, high) {
  const { look } = state;
  look.range = [low, high];
  state.ranges[look.errors ? "error" : "light"] = look.range;
  draw();
}

export function setLook(changes) {
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
    state.painter?.setColours(state.colours);
  }
  $("logarithmic").checked = look.logarithmic;
  $("grid").checked = look.grid;
  $("isolines").value = String(look.isolines);
  $("overlay").value = look.errors ? "error" : "light";
  $("resolution").hidden = !look.grid;
  draw();
}

/** What is seen of the scene's faces and rays, and where it is cut. */
export function setShown(changes) {
  Object.assign(state.shown, changes);
  const plane = sectionOf(packed.geometry, state.shown);
  $("section-place").hidden = !plane;
  for (const [id, name] of [["show-faces", "faces"], ["show-rays", "rays"]]) $(id).checked = state.shown[name];
  $("section-axis").value = state.shown.axis;
  $("section-at").textContent = plane ? `${plane.axis} = ${plain(plane.at, 4)} mm` : "";
  draw();
}
