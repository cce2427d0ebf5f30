// Rectangles, polygons and lines that are drawn over the picture.

import { listRegions } from "./figures.js";
import { rest } from "./motion.js";
import { $ } from "./panel.js";
import { draw, onScreen, state } from "./state.js";

export function chooseTool(name) {
  Object.assign(state, { tool: name, drawing: null, polygon: null }); // a polygon that was begun is given up
  for (const button of document.querySelectorAll("[data-tool]")) {
    button.setAttribute("aria-pressed", String(button.dataset.tool === name));
  }
  $("stage").classList.toggle("drawing", name !== "look");
  draw();
}

export function drawn(corners) {
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

export const drawings = {
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

export function clear() {
  Object.assign(state, { regions: [], line: null, section: null, drawing: null, polygon: null });
  $("section-box").hidden = true;
  listRegions();
  draw();
}
