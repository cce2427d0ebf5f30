// Charts of a carrier surface: where a line leaves a part, in double precision. theory.md, eq. 37; the core's `surface.rs`.

const EIGHTH = Math.PI / 4;

function clamp(x) {
  return x < 0 ? 0 : x > 1 ? 1 : x;
}

/** From the unit disk to the unit square: the concentric map of Shirley and Chiu, inverted. */
export function diskToSquare(x, y) {
  const wide = Math.abs(x) > Math.abs(y);
  const along = wide ? x : y;
  const across = wide ? y : x;
  const slope = along === 0 ? 0 : across / along;
  const radius = Math.sqrt(x * x + y * y);
  const r = along < 0 ? -radius : radius;
  const other = (r * Math.atan(slope)) / EIGHTH;
  return wide ? [0.5 * r + 0.5, 0.5 * other + 0.5] : [0.5 * other + 0.5, 0.5 * r + 0.5];
}

/** From the unit square to the unit disk, by that map. */
export function squareToDisk(u, v) {
  const [a, b] = [2 * u - 1, 2 * v - 1];
  const wide = Math.abs(a) > Math.abs(b);
  const [r, other] = wide ? [a, b] : [b, a];
  const turn = r === 0 ? 0 : (other / r) * EIGHTH;
  const [along, across] = [r * Math.cos(turn), r * Math.sin(turn)];
  return wide ? [along, across] : [across, along];
}

/** Azimuth of (x, y) as a fraction of a turn; the seam lies at -x. */
function turns(x, y) {
  return clamp(Math.atan2(y, x) / (2 * Math.PI) + 0.5);
}

function departure(inside, s1, s2, p, q) {
  return inside && s1 >= 0 && s1 <= 1 && s2 >= 0 && s2 <= 1 ? [s1, s2, p, q] : null;
}

/** [s1, s2, a, b] of a crossing under the direction cosines p and q, or null if these are not in the beam. */
function within([u, v, radius], crossing) {
  if (!crossing) return null;
  const [s1, s2, p, q] = crossing;
  const [x, y] = [(p - u) / radius, (q - v) / radius];
  if (radius < 1 && x * x + y * y > 1) return null;
  const [a, b] = diskToSquare(x, y);
  return [s1, s2, clamp(a), clamp(b)];
}

function crossShape(chart, o, d) {
  switch (chart.shape) {
    case "rectangle":
      return crossRectangle(chart.size, chart.focus, o, d);
    case "disk":
      return crossDisk(chart.size, o, d);
    case "hemisphere":
      return crossHemisphere(chart.size, o, d);
    case "tube":
      return crossTube(chart.size, o, d);
    default:
      throw new Error(`there is no chart of the shape ${chart.shape}`);
  }
}

function crossRectangle([width, height], focus, o, d) {
  const lean = 1 - d[2];
  const depth = focus[0] + lean * (focus[1] + lean * (focus[2] + lean * focus[3]));
  const t = (depth - o[2]) / d[2];
  return departure(d[2] > 0, (o[0] + t * d[0]) / width + 0.5, (o[1] + t * d[1]) / height + 0.5, d[0], d[1]);
}

function crossDisk([radius], o, d) {
  const t = -o[2] / d[2];
  const x = (o[0] + t * d[0]) / radius;
  const y = (o[1] + t * d[1]) / radius;
  const [s1, s2] = diskToSquare(x, y);
  return departure(d[2] > 0 && x * x + y * y <= 1, clamp(s1), clamp(s2), d[0], d[1]);
}

function crossHemisphere([radius], o, d) {
  const back = -(o[0] * d[0] + o[1] * d[1] + o[2] * d[2]);
  const near = o.map((x, i) => x + d[i] * back);
  const halfChord = radius * radius - (near[0] ** 2 + near[1] ** 2 + near[2] ** 2);
  const half = Math.sqrt(Math.max(halfChord, 0));
  const n = near.map((x, i) => (x + d[i] * half) / radius);
  const lift = 1 / (1 + Math.max(n[2], 0));
  const azimuthal = Math.sqrt(lift);
  const shear = (d[0] * n[0] + d[1] * n[1]) * lift + d[2];
  const [s1, s2] = diskToSquare(n[0] * azimuthal, n[1] * azimuthal);
  const inside = halfChord > 0 && n[2] >= 0;
  return departure(inside, clamp(s1), clamp(s2), d[0] - n[0] * shear, d[1] - n[1] * shear);
}

function crossTube([radius, height], o, d) {
  const across = d[0] * d[0] + d[1] * d[1];
  const t = -(o[0] * d[0] + o[1] * d[1]) / across;
  let x = o[0] + t * d[0];
  let y = o[1] + t * d[1];
  const halfChord = (radius * radius - (x * x + y * y)) / across;
  const out = t + Math.sqrt(Math.max(halfChord, 0));
  x = (o[0] + out * d[0]) / radius;
  y = (o[1] + out * d[1]) / radius;
  const z = o[2] + out * d[2];
  return departure(across > 0 && halfChord > 0, turns(x, y), z / height + 0.5, d[1] * x - d[0] * y, d[2]);
}

/** A vector in the axes of a part. */
export function turned(axes, v) {
  return axes.map((axis) => axis[0] * v[0] + axis[1] * v[1] + axis[2] * v[2]);
}

/**
 * Where the line through `point` along the unit vector `direction` leaves a part: [s1, s2, a, b], or null if it does not.
 */
export function cross(chart, point, direction) {
  const o = turned(chart.axes, point.map((x, i) => x - chart.centre[i]));
  return within(chart.beam, crossShape(chart, o, turned(chart.axes, direction)));
}

export function areaOf({ shape, size: [width, height] }) {
  const areas = {
    rectangle: width * height,
    disk: Math.PI * width * width,
    hemisphere: 2 * Math.PI * width * width,
    tube: 2 * Math.PI * width * height,
  };
  return areas[shape];
}

/**
 * The light that leaves a part at the place (s1, s2) along a unit vector `d` in the axes of the part: the cosine to the normal
 * there and [s1, s2, a, b], or null if it goes inwards.
 */
export function departing({ shape, beam }, [s1, s2], d) {
  let [cosine, p, q] = [d[2], d[0], d[1]];
  if (shape === "hemisphere") {
    const [x, y] = squareToDisk(s1, s2);
    const r2 = x * x + y * y;
    const scale = Math.sqrt(Math.max(2 - r2, 0));
    const n = [x * scale, y * scale, Math.max(1 - r2, 0)];
    const shear = (d[0] * n[0] + d[1] * n[1]) / (1 + n[2]) + d[2];
    cosine = d[0] * n[0] + d[1] * n[1] + d[2] * n[2];
    [p, q] = [d[0] - n[0] * shear, d[1] - n[1] * shear];
  } else if (shape === "tube") {
    const [nx, ny] = [-Math.cos(2 * Math.PI * s1), -Math.sin(2 * Math.PI * s1)];
    cosine = d[0] * nx + d[1] * ny;
    [p, q] = [d[1] * nx - d[0] * ny, d[2]];
  }
  const place = within(beam, departure(cosine > 0, s1, s2, p, q));
  return place && { cosine, place };
}
