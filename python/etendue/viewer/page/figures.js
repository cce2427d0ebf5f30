// What is read: under the pointer, of the regions, of the view itself.

import { measured, plain, prefixed, withUnit } from "./numbers.js";
import { drawLegend } from "./overlay.js";
import { $, showRegions } from "./panel.js";
import { PIXEL, draw, fixed, packed, state } from "./state.js";

/** Value and standard error of the pixel under a place [CSS pixels] on the picture. */
function readingAt(x, y) {
  const [column, row] = [x, y].map((p) => Math.floor(p / PIXEL));
  return { column, row, ...state.subject.pixel(state.view, column, row) };
}

export function showReading() {
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

export function listRegions() {
  showRegions(state.regions, packed.unit, packed.flux_unit, (region) => {
    state.regions = state.regions.filter((one) => one !== region);
    listRegions();
    draw();
  });
}

export const fields = {};

const QUICK = 16; // points along either side of a part for the intensity while the view moves

/** Intensity towards the observer: of few points until `motion` has worked it out at rest. */
export function intensityHere() {
  const { view, field, here } = state;
  if (here?.theta !== view.theta || here.phi !== view.phi) {
    const pieces = field.intensityPieces(view.toward, QUICK).map((work) => work());
    state.here = { theta: view.theta, phi: view.phi, quick: true, ...field.intensity(pieces) };
  }
  return state.here;
}

export function showView() {
  const { view, look } = state;
  for (const name of ["theta", "phi", "distance", "width"]) fields[name](view[name]);
  ["x", "y", "z"].forEach((axis, i) => fields[`target-${axis}`](view.target[i]));
  const unit = look.errors ? 0.01 : 1;
  fields.low(look.range[0] / unit, 4);
  fields.high(look.range[1] / unit, 4);
  $("scale-unit").textContent = look.errors ? "%" : packed.unit;
  if (state.solid) {
    const { value, error, quick } = intensityHere();
    const { unit } = packed.intensity;
    $("intensity").textContent = `${quick ? `≈ ${withUnit(value, unit, 3)}` : measured(value, error, unit)} here`;
  }
}

/** The view as the command line takes it; numbers with so many digits that the core's map has the same pixels. */
export function command() {
  const { view } = state;
  const digits = (x) => String(Number(x.toPrecision(12)));
  const turns = [view.upright && `--up=${view.upright.map(digits).join(",")} `, view.roll && `--roll=${digits(view.roll)} `];
  const upright = turns.filter(Boolean).join("");
  const file = /^[\w./-]+$/.test(packed.file) ? packed.file : `'${packed.file.replaceAll("'", `'\\''`)}'`;
  return (
    `etendue luminance ${file} ${packed.options}--observer=${digits(view.theta)},${digits(view.phi)} ` +
    `--distance ${digits(view.distance)} --target=${view.target.map(digits).join(",")} ${upright}--size ${digits(view.width)},${digits(view.height)} ` +
    `--pixels ${view.columns},${view.rows} -o map.exr`
  );
}

export function showCommand() {
  $("command").textContent = fixed() ? "" : command();
}
