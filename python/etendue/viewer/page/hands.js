// Mouse, touch and keys: what a user does to the picture, in words of the view.

const DEGREES_PER_PIXEL = 0.25;
const ZOOM_PER_PIXEL = 0.0015;

/**
 * Calls `on.orbit(rightwards, upwards)` [°], `on.shift(right, up)` [CSS pixels], `on.zoom(factor, place)`, `on.point(place)`,
 * `on.begin/extend/end(place)` of what is drawn by a tool, `on.rest()` after the last; places are [x, y] in CSS pixels.
 * `tool()`: "look", or the name of a tool that draws.
 */
export function listenToPointer(element, tool, on) {
  const fingers = new Map();
  let drawing = false;
  const placeOf = (event) => {
    const box = element.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  };
  const spread = () => {
    const [a, b] = [...fingers.values()];
    return { size: Math.hypot(a[0] - b[0], a[1] - b[1]), middle: [(a[0] + b[0]) / 2, (a[1] + b[1]) / 2] };
  };
  element.addEventListener("pointerdown", (event) => {
    element.setPointerCapture(event.pointerId);
    fingers.set(event.pointerId, placeOf(event));
    element.focus({ preventScroll: true });
    if (tool() !== "look" && event.button === 0 && fingers.size === 1) {
      drawing = true;
      on.begin(placeOf(event));
    }
  });
  element.addEventListener("pointermove", (event) => {
    const here = placeOf(event);
    const before = fingers.get(event.pointerId);
    if (!before) {
      on.point(here);
      return;
    }
    if (fingers.size === 2) {
      const old = spread();
      fingers.set(event.pointerId, here);
      const now = spread();
      on.shift(now.middle[0] - old.middle[0], old.middle[1] - now.middle[1]);
      if (now.size > 0) on.zoom(old.size / now.size, now.middle);
      return;
    }
    fingers.set(event.pointerId, here);
    const [dx, dy] = [here[0] - before[0], here[1] - before[1]];
    if (drawing) on.extend(here);
    else if (event.shiftKey || event.buttons === 2 || event.buttons === 4) on.shift(dx, -dy);
    else on.orbit(-dx * DEGREES_PER_PIXEL, dy * DEGREES_PER_PIXEL);
    on.point(here);
  });
  const lifted = (event) => {
    if (!fingers.delete(event.pointerId)) return;
    if (drawing) on.end(placeOf(event));
    drawing = false;
    on.rest();
  };
  element.addEventListener("pointerup", lifted);
  element.addEventListener("pointercancel", lifted);
  element.addEventListener("pointerleave", () => on.point(null));
  element.addEventListener("contextmenu", (event) => event.preventDefault());
  element.addEventListener("dblclick", (event) => on.finish(placeOf(event)));
  element.addEventListener(
    "wheel",
    (event) => {
      event.preventDefault();
      const pixels = event.deltaMode === 1 ? event.deltaY * 30 : event.deltaY;
      on.zoom(Math.exp(pixels * ZOOM_PER_PIXEL), placeOf(event));
      on.restSoon();
    },
    { passive: false },
  );
}

/** Calls the function of a key in `keys`, unless somebody is typing. Names have "Shift+" before them where it is held. */
export function listenToKeys(keys) {
  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || /^(INPUT|SELECT|TEXTAREA)$/.test(event.target.tagName)) return;
    const letter = event.key.length === 1 ? event.key.toLowerCase() : event.key;
    const action = keys[(event.shiftKey && event.key.length > 1 ? "Shift+" : "") + letter];
    if (!action) return;
    event.preventDefault();
    action();
  });
}
