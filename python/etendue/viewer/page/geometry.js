// A scene in space, as the observer sees it: curves of its faces, rays, and the plane that cuts it.

const AXES = "xyz";

/** Where an observer sees a point on his screen [mm], or null if it lies behind him. */
export function projected(view, x, y, z) {
  const [ex, ey, ez] = view.eye;
  const [dx, dy, dz] = [x - ex, y - ey, z - ez];
  const depth = -(dx * view.toward[0] + dy * view.toward[1] + dz * view.toward[2]);
  if (!(depth > 1e-9 * view.distance)) return null;
  const scale = view.distance / depth;
  const along = (axis) => scale * (dx * axis[0] + dy * axis[1] + dz * axis[2]);
  return [along(view.right), along(view.up)];
}

/** The pieces of a line on the far side of a plane, for an observer on the near side; all of it without a plane. */
function behind(line, plane, side) {
  if (!plane) return [line];
  const axis = AXES.indexOf(plane.axis);
  const pieces = [];
  let piece = null;
  for (let i = 0; i < line.length; i += 3) {
    const height = (line[i + axis] - plane.at) * side;
    if (i > 0) {
      const before = (line[i - 3 + axis] - plane.at) * side;
      if (before > 0 !== height > 0) {
        const t = before / (before - height);
        const cut = [0, 1, 2].map((k) => line[i - 3 + k] + t * (line[i + k] - line[i - 3 + k]));
        if (height > 0) {
          piece.push(...cut);
          piece = null;
        } else {
          piece = [...cut];
          pieces.push(piece);
        }
      }
    }
    if (height <= 0) {
      if (!piece) pieces.push((piece = []));
      piece.push(line[i], line[i + 1], line[i + 2]);
    }
  }
  return pieces;
}

function stroke(pen, at, view, lines) {
  pen.beginPath();
  for (const line of lines) {
    let drawing = false;
    for (let i = 0; i < line.length; i += 3) {
      const place = projected(view, line[i], line[i + 1], line[i + 2]);
      if (place) pen[drawing ? "lineTo" : "moveTo"](...at(place));
      drawing = place !== null;
    }
  }
  pen.stroke();
}

/** `shown`: {faces, rays, axis ("" or a letter), place (0 to 1)}; `at` takes mm on the screen to the canvas. */
export function drawGeometry(pen, at, view, geometry, shown) {
  const plane = sectionOf(geometry, shown);
  const axis = plane ? AXES.indexOf(plane.axis) : 0;
  // What lies before the section, on the observer's side, is taken away.
  const side = plane && view.eye[axis] < plane.at ? -1 : 1;
  pen.lineJoin = "round";
  if (shown.faces) {
    pen.strokeStyle = "rgb(168 196 220 / 0.34)";
    pen.lineWidth = 0.8;
    for (const one of geometry.planes) stroke(pen, at, view, one.lines.flatMap((line) => behind(line, plane, side)));
  }
  if (shown.rays) {
    pen.strokeStyle = "rgb(255 205 110 / 0.4)";
    pen.lineWidth = 0.8;
    stroke(pen, at, view, geometry.rays.flatMap((line) => behind(line, plane, side)));
  }
  if (plane) {
    pen.strokeStyle = "#7fd4ff";
    pen.lineWidth = 1.6;
    stroke(pen, at, view, plane.lines);
  }
}

/** The plane that was cut nearest to the place that is asked for. */
export function sectionOf(geometry, { axis, place }) {
  const planes = geometry.planes.filter((plane) => plane.axis === axis);
  return planes[Math.min(Math.floor(place * planes.length), planes.length - 1)] ?? null;
}
