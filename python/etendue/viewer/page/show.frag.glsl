#version 300 es
// Luminance in colours: scale, isolines, and overlays of error and of resolution.
precision highp float;
precision highp int;
precision highp sampler2D;

uniform sampler2D light;      // what field.frag.glsl or map.frag.glsl found
uniform sampler2D colours;    // one row
uniform vec2 size;            // of the canvas [pixel]
uniform vec2 range;           // lowest and highest value in colours
uniform bool logarithmic;
uniform bool errors;          // relative standard error instead of luminance
uniform float isolines;       // how many levels; 0: none
uniform bool grid;            // edges of the cells of the light field
uniform bool sparse;          // whether pixels may have no value

out vec4 colour;

// 0 to 1 along the scale; the ends hold what lies beyond.
float scaled(float value) {
  if (logarithmic) {
    if (value <= 0.0) return 0.0;
    return clamp(log(value / range.x) / log(range.y / range.x), 0.0, 1.0);
  }
  return clamp((value - range.x) / (range.y - range.x), 0.0, 1.0);
}

float shown(vec4 found) {
  if (!errors) return found.x;
  return found.x > 0.0 ? found.y / found.x : 0.0;
}

vec4 found(ivec2 at) {
  ivec2 top = textureSize(light, 0) - 1;
  return texelFetch(light, clamp(at, ivec2(0), top), 0);
}

// The picture may be coarser than the canvas while it moves.
vec4 between(vec2 at) {
  vec2 pixels = vec2(textureSize(light, 0));
  if (sparse || pixels == size) return found(ivec2(at / size * pixels));
  vec2 t = at / size * pixels - 0.5;
  ivec2 lower = ivec2(floor(t));
  vec2 w = t - floor(t);
  return mix(mix(found(lower), found(lower + ivec2(1, 0)), w.x),
             mix(found(lower + ivec2(0, 1)), found(lower + ivec2(1, 1)), w.x), w.y);
}

void main() {
  vec4 here = between(gl_FragCoord.xy);
  if (sparse && here.z == 0.0) {
    colour = vec4(0.157, 0.173, 0.188, 1.0);
    return;
  }
  float t = scaled(shown(here));
  // Colours lie in the middle of their cells.
  float count = float(textureSize(colours, 0).x);
  float at = t * (count - 1.0);
  int lower = int(min(floor(at), count - 2.0));
  vec3 tint = mix(texelFetch(colours, ivec2(lower, 0), 0).rgb, texelFetch(colours, ivec2(lower + 1, 0), 0).rgb,
                  at - float(lower));
  if (isolines > 0.0) {
    float level = floor(t * isolines);
    float beside = floor(scaled(shown(between(gl_FragCoord.xy + vec2(1.0, 0.0)))) * isolines);
    float below = floor(scaled(shown(between(gl_FragCoord.xy - vec2(0.0, 1.0)))) * isolines);
    if (level != beside || level != below) tint = mix(tint, vec3(t > 0.55 ? 0.0 : 1.0), 0.65);
  }
  if (grid && !sparse) {
    ivec2 pixel = ivec2(gl_FragCoord.xy / size * vec2(textureSize(light, 0)));
    vec2 cell = floor(found(pixel).zw);
    vec2 beside = floor(found(pixel + ivec2(1, 0)).zw);
    vec2 below = floor(found(pixel - ivec2(0, 1)).zw);
    if (cell != beside || cell != below) tint = mix(tint, vec3(0.55, 0.85, 1.0), 0.6);
  }
  colour = vec4(tint, 1.0);
}
