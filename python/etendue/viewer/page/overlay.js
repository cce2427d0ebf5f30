// What is drawn over the picture: regions, the line of a cross section, the pointer, a ruler; and diagrams beside it.

import { drawGeometry } from "./geometry.js";
import { plain, prefixed, ticks } from "./numbers.js";

const LINE = "#7fd4ff";
const FAINT = "#8b96a3";

/** A canvas as sharp as the screen, empty; its pen counts in CSS pixels. */
export function penOf(canvas) {
  const scale = window.devicePixelRatio || 1;
  canvas.width = Math.round(canvas.clientWidth * scale);
  canvas.height = Math.round(canvas.clientHeight * scale);
  const pen = canvas.getContext("2d");
  pen.scale(scale, scale);
  pen.font = "11px system-ui, sans-serif";
  return pen;
}

/** Regions, line and pointer; `marks` holds them in mm on the screen, `resolution` the pitch that is resolved [mm]. */
export function drawMarks(canvas, view, { regions, line, drawing, pointer, resolution, geometry, shown }) {
  const pen = penOf(canvas);
  const [width, height] = [canvas.clientWidth, canvas.clientHeight];
  const scale = width / view.width;
  const at = ([x, y]) => [width / 2 + x * scale, height / 2 - y * scale];
  if (geometry) drawGeometry(pen, at, view, geometry, shown);
  const path = (corners, closed) => {
    pen.beginPath();
    corners.forEach((corner, i) => pen[i ? "lineTo" : "moveTo"](...at(corner)));
    if (closed) pen.closePath();
  };
  const stroke = () => {
    for (const [colour, thick] of [["rgb(0 0 0 / 0.65)", 3.5], [LINE, 1.5]]) {
      pen.strokeStyle = colour;
      pen.lineWidth = thick;
      pen.stroke();
    }
  };
  regions.forEach((region, i) => {
    path(region.corners, true);
    stroke();
    const [x, y] = at(region.corners.reduce((best, c) => (c[1] > best[1] ? c : best)));
    label(pen, String(i + 1), x, y - 8);
  });
  if (line) {
    path(line, false);
    stroke();
    line.forEach((end, i) => label(pen, i ? "B" : "A", ...at(end).map((x, k) => x - (k ? 10 : 0))));
  }
  if (drawing) {
    path(drawing, false);
    pen.setLineDash([4, 3]);
    stroke();
    pen.setLineDash([]);
  }
  if (pointer && resolution) {
    pen.beginPath();
    pen.arc(...at(pointer), Math.max((resolution / 2) * scale, 0.5), 0, 2 * Math.PI);
    stroke();
  }
  drawRuler(pen, height, scale);
}

function label(pen, text, x, y) {
  pen.font = "bold 12px system-ui, sans-serif";
  pen.textAlign = "center";
  pen.lineWidth = 3;
  pen.strokeStyle = "rgb(0 0 0 / 0.8)";
  pen.strokeText(text, x, y);
  pen.fillStyle = LINE;
  pen.fillText(text, x, y);
}

/** A length in the lower left corner. */
function drawRuler(pen, height, scale) {
  const longest = 130 / scale;
  const power = 10 ** Math.floor(Math.log10(longest));
  const length = [5, 2, 1].map((f) => f * power).find((x) => x <= longest) ?? power;
  const [x, y] = [16, height - 16];
  for (const [colour, thick] of [["rgb(0 0 0 / 0.7)", 4], ["#e8edf2", 2]]) {
    pen.strokeStyle = colour;
    pen.lineWidth = thick;
    pen.beginPath();
    pen.moveTo(x, y);
    pen.lineTo(x + length * scale, y);
    pen.stroke();
  }
  const [factor, unit] = length < 1e-3 ? [1e-6, "nm"] : length < 1 ? [1e-3, "µm"] : length < 1e3 ? [1, "mm"] : [1e3, "m"];
  const text = `${Number((length / factor).toPrecision(3))} ${unit}`;
  pen.textAlign = "left";
  pen.lineWidth = 3;
  pen.strokeStyle = "rgb(0 0 0 / 0.7)";
  pen.strokeText(text, x, y - 6);
  pen.fillStyle = "#e8edf2";
  pen.fillText(text, x, y - 6);
}

/** The scale of colours with its numbers. `mark`: a value to be pointed at. */
export function drawLegend(canvas, colours, { range: [low, high], logarithmic, unit, factor, title, isolines }, mark) {
  const pen = penOf(canvas);
  const [left, right, top, thick] = [14, canvas.clientWidth - 14, 20, 12];
  const share = (x) => (logarithmic ? Math.log(Math.max(x, low) / low) / Math.log(high / low) : (x - low) / (high - low));
  const at = (x) => left + Math.min(Math.max(share(x), 0), 1) * (right - left);
  const strip = pen.createLinearGradient(left, 0, right, 0);
  colours.forEach((colour, i) => strip.addColorStop(i / (colours.length - 1), `rgb(${colour.join(" ")})`));
  pen.fillStyle = strip;
  pen.fillRect(left, top, right - left, thick);
  pen.fillStyle = "rgb(255 255 255 / 0.55)";
  for (let i = 1; i < isolines; i++) pen.fillRect(left + (i / isolines) * (right - left), top, 1, thick);
  pen.fillStyle = "#c9d1da";
  pen.textAlign = "left";
  pen.fillText(title + (unit ? ` in ${unit}` : ""), left, 13);
  pen.textAlign = "center";
  let end = -Infinity;
  for (const tick of ticks(low, high, Math.max(3, (right - left) / 80), logarithmic)) {
    const text = plain(Number((tick / factor).toPrecision(4)), 4).replace(/(\.\d*?)0+$/, "$1").replace(/\.$/, "");
    const half = pen.measureText(text).width / 2;
    const x = Math.min(Math.max(at(tick), left + half), right - half);
    pen.fillRect(at(tick) - 0.5, top + thick, 1, 4);
    if (x - half < end + 6) continue;
    end = x + half;
    pen.fillText(text, x, top + thick + 15);
  }
  if (Number.isFinite(mark)) {
    const x = at(mark);
    pen.fillStyle = LINE;
    pen.beginPath();
    pen.moveTo(x, top - 1);
    pen.lineTo(x - 4, top - 8);
    pen.lineTo(x + 4, top - 8);
    pen.fill();
  }
}

/** A cross section: values with a band of one standard error, over the length from A to B. */
export function drawSection(canvas, points, unit, logarithmic) {
  const pen = penOf(canvas);
  const live = points.filter((p) => Number.isFinite(p.value));
  if (live.length === 0) return;
  const most = live.reduce((m, p) => Math.max(m, p.value + (p.error || 0)), 0);
  const least = logarithmic ? Math.max(live.reduce((m, p) => (p.value > 0 ? Math.min(m, p.value) : m), most), most * 1e-5) : 0;
  const [factor, name] = prefixed(most, unit);
  const [left, right, top, bottom] = [44, canvas.clientWidth - 12, 18, canvas.clientHeight - 22];
  const span = points.at(-1).at + points[0].at;
  const x = (p) => left + (p / span) * (right - left);
  const share = (v) => (logarithmic ? Math.log(Math.max(v, least) / least) / Math.log(most / least || 2) : v / (most || 1));
  const y = (v) => bottom - Math.min(Math.max(share(v), 0), 1) * (bottom - top);
  pen.lineWidth = 1;
  for (const tick of ticks(least || 0, most, 4, logarithmic)) {
    pen.strokeStyle = "rgb(255 255 255 / 0.1)";
    pen.beginPath();
    pen.moveTo(left, y(tick));
    pen.lineTo(right, y(tick));
    pen.stroke();
    pen.fillStyle = FAINT;
    pen.textAlign = "right";
    pen.fillText(String(Number((tick / factor).toPrecision(3))), left - 5, y(tick) + 4);
  }
  pen.textAlign = "center";
  for (const tick of ticks(0, span, 5, false)) pen.fillText(String(Number(tick.toPrecision(4))), x(tick), bottom + 14);
  pen.textAlign = "left";
  pen.fillText(name, 4, 11);
  pen.textAlign = "right";
  pen.fillText("mm from A", right, 11);
  pen.fillStyle = "rgb(127 212 255 / 0.25)";
  pen.beginPath();
  live.forEach((p, i) => pen[i ? "lineTo" : "moveTo"](x(p.at), y(p.value + (p.error || 0))));
  [...live].reverse().forEach((p) => pen.lineTo(x(p.at), y(p.value - (p.error || 0))));
  pen.fill();
  pen.strokeStyle = LINE;
  pen.lineWidth = 1.5;
  pen.beginPath();
  live.forEach((p, i) => pen[i ? "lineTo" : "moveTo"](x(p.at), y(p.value)));
  pen.stroke();
}
