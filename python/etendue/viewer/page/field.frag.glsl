#version 300 es
// Luminance of a light field along the line of sight of each pixel, and the variance of it: field.js in single precision.
// Linear filters of float textures are not everywhere, so that every mean between cells is taken here.
precision highp float;
precision highp int;
precision highp sampler2D;

uniform sampler2D cells;      // all tables, one after the other: value, error
uniform sampler2D parts;      // a row for each part: see painter.js
uniform int partCount;
uniform sampler2D before;     // the mean of the samples so far
uniform float samples;        // how many those are
uniform vec2 size;            // of the screen [pixel]
uniform vec2 jitter;          // of this sample within the pixel
uniform vec2 extent;          // of the screen [mm]

out vec4 mean;                // luminance and its standard error in units of the reference; place on the grid of cells

const float EIGHTH = 0.7853981633974483;
const int RECTANGLE = 0, DISK = 1, HEMISPHERE = 2, TUBE = 3;

vec2 cell(int offset, int index) {
  int width = textureSize(cells, 0).x;
  return texelFetch(cells, ivec2(index % width, offset + index / width), 0).rg;
}

// Lower and upper cell, weights of both.
void tent(float x, int n, bool wraps, out ivec2 at, out vec2 weight) {
  float t = clamp(x, 0.0, 1.0) * float(n) + 0.5;
  int upper = int(t);
  float w = t - float(upper);
  weight = vec2(1.0 - w, w);
  if (wraps) {
    at = ivec2(upper == 0 ? n - 1 : upper - 1, upper >= n ? 0 : upper);
  } else {
    at = ivec2(clamp(upper - 1, 0, n - 1), min(upper, n - 1));
  }
}

vec2 bilinear(int offset, int n, vec2 at, bool wraps) {
  if (n == 1) return cell(offset, 0);
  ivec2 x, y;
  vec2 u, v;
  tent(at.x, n, wraps, x, u);
  tent(at.y, n, false, y, v);
  return u.x * (v.x * cell(offset, x.x * n + y.x) + v.y * cell(offset, x.x * n + y.y)) +
         u.y * (v.x * cell(offset, x.y * n + y.x) + v.y * cell(offset, x.y * n + y.y));
}

vec2 quadrilinear(int offset, ivec4 n, vec4 at, bool wraps) {
  ivec2 x, y, a, b;
  vec2 u, v, w, z;
  tent(at.x, n.x, wraps, x, u);
  tent(at.y, n.y, false, y, v);
  tent(at.z, n.z, false, a, w);
  tent(at.w, n.w, false, b, z);
  vec2 sum = vec2(0.0);
  for (int i = 0; i < 2; i++) {
    for (int j = 0; j < 2; j++) {
      int layer = (x[i] * n.y + y[j]) * n.z;
      vec2 inner = vec2(0.0);
      for (int k = 0; k < 2; k++) {
        int row = (layer + a[k]) * n.w;
        inner += w[k] * (z.x * cell(offset, row + b.x) + z.y * cell(offset, row + b.y));
      }
      sum += u[i] * v[j] * inner;
    }
  }
  return sum;
}

vec2 diskToSquare(vec2 p) {
  bool wide = abs(p.x) > abs(p.y);
  vec2 q = wide ? p : p.yx;
  float slope = q.x == 0.0 ? 0.0 : q.y / q.x;
  float r = (q.x < 0.0 ? -1.0 : 1.0) * length(p);
  vec2 square = vec2(r, r * atan(slope) / EIGHTH);
  return 0.5 * (wide ? square : square.yx) + 0.5;
}

// Where the line leaves a shape, and the direction cosines along it there: chart.js.
bool crossing(int shape, vec2 extent, vec4 focus, vec3 o, vec3 d, out vec4 at) {
  if (shape == RECTANGLE) {
    if (d.z <= 0.0) return false;
    float lean = 1.0 - d.z;
    float depth = focus.x + lean * (focus.y + lean * (focus.z + lean * focus.w));
    vec2 place = (o.xy + (depth - o.z) / d.z * d.xy) / extent + 0.5;
    at = vec4(place, d.xy);
    return all(greaterThanEqual(place, vec2(0.0))) && all(lessThanEqual(place, vec2(1.0)));
  }
  if (shape == DISK) {
    if (d.z <= 0.0) return false;
    vec2 place = (o.xy - o.z / d.z * d.xy) / extent.x;
    at = vec4(clamp(diskToSquare(place), 0.0, 1.0), d.xy);
    return dot(place, place) <= 1.0;
  }
  if (shape == HEMISPHERE) {
    vec3 near = o - d * dot(o, d);
    float halfChord = extent.x * extent.x - dot(near, near);
    vec3 n = (near + d * sqrt(max(halfChord, 0.0))) / extent.x;
    float lift = 1.0 / (1.0 + max(n.z, 0.0));
    float shear = dot(d.xy, n.xy) * lift + d.z;
    at = vec4(clamp(diskToSquare(n.xy * sqrt(lift)), 0.0, 1.0), d.xy - n.xy * shear);
    return halfChord > 0.0 && n.z >= 0.0;
  }
  float across = dot(d.xy, d.xy);
  if (across <= 0.0) return false;
  float t = -dot(o.xy, d.xy) / across;
  vec2 foot = o.xy + t * d.xy;
  float halfChord = (extent.x * extent.x - dot(foot, foot)) / across;
  float leaves = t + sqrt(max(halfChord, 0.0));
  vec2 n = (o.xy + leaves * d.xy) / extent.x;
  float height = (o.z + leaves * d.z) / extent.y + 0.5;
  float turn = clamp(atan(n.y, n.x) / (8.0 * EIGHTH) + 0.5, 0.0, 1.0);
  at = vec4(turn, height, d.y * n.x - d.x * n.y, d.z);
  return halfChord > 0.0 && height >= 0.0 && height <= 1.0;
}

void main() {
  vec2 place = ((gl_FragCoord.xy + jitter) / size - 0.5) * extent;
  float value = 0.0, variance = 0.0, brightest = 0.0;
  vec2 grid = vec2(0.0);
  for (int i = 0; i < partCount; i++) {
    // The screen and the eye in the part's axes, about the part's centre: small numbers, so that single precision suffices.
    vec4 target = texelFetch(parts, ivec2(0, i), 0);
    vec4 right = texelFetch(parts, ivec2(1, i), 0);
    vec4 up = texelFetch(parts, ivec2(2, i), 0);
    vec4 eye = texelFetch(parts, ivec2(3, i), 0);
    vec4 focus = texelFetch(parts, ivec2(4, i), 0);
    vec4 n = texelFetch(parts, ivec2(5, i), 0);
    vec4 offsets = texelFetch(parts, ivec2(6, i), 0);
    vec4 sides = texelFetch(parts, ivec2(7, i), 0);
    int shape = int(target.w);
    vec3 aside = right.xyz * place.x + up.xyz * place.y;
    vec3 direction = normalize(eye.xyz - aside);
    vec4 at;
    if (!crossing(shape, vec2(right.w, up.w), focus, target.xyz + aside, direction, at)) continue;
    // Within the beam of the part: its middle in the last two of the sides, its radius in the last of the offsets.
    vec2 turned = (at.zw - sides.zw) / offsets.w;
    if (offsets.w < 1.0 && dot(turned, turned) > 1.0) continue;
    at.zw = clamp(diskToSquare(turned), 0.0, 1.0);
    bool wraps = shape == TUBE;
    vec2 ratio = quadrilinear(int(offsets.x), ivec4(n), at, wraps);
    vec2 space = bilinear(int(offsets.y), int(sides.x), at.xy, wraps);
    vec2 turn = bilinear(int(offsets.z), int(sides.y), at.zw, false);
    float base = eye.w * space.x * turn.x;
    float light = base * ratio.x;
    value += light;
    vec3 errors = vec3(base * ratio.y, light * space.y, light * turn.y);
    variance += dot(errors, errors);
    if (light >= brightest) {
      brightest = light;
      grid = at.xy * n.xy;
    }
  }
  vec4 here = vec4(value, sqrt(variance), grid);
  vec4 old = texelFetch(before, ivec2(gl_FragCoord.xy), 0);
  mean = samples > 0.0 ? vec4(mix(old.xy, here.xy, 1.0 / (samples + 1.0)), old.zw) : here;
}
