#version 300 es
// A map of pixels, as it is: the value of the pixel that each point of the screen lies in, and its standard error.
precision highp float;
precision highp sampler2D;

uniform sampler2D cells;      // value in units of the reference, standard error, 1 if the pixel has a value
uniform vec2 size;            // of the screen [pixel]
uniform vec2 extent;          // of the screen [mm]
uniform vec2 shift;           // of the middle of the screen from that of the map [mm]
uniform vec2 whole;           // of the map [mm]

out vec4 mean;

void main() {
  vec2 place = (gl_FragCoord.xy / size - 0.5) * extent + shift;
  vec2 at = vec2(place.x / whole.x + 0.5, 0.5 - place.y / whole.y);
  ivec2 pixels = textureSize(cells, 0);
  bool inside = all(greaterThanEqual(at, vec2(0.0))) && all(lessThan(at, vec2(1.0)));
  vec4 here = inside ? texelFetch(cells, min(ivec2(at * vec2(pixels)), pixels - 1), 0) : vec4(0.0);
  mean = vec4(here.xy, here.z, 0.0);
}
