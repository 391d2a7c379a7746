// GLSL shared by all programs: particle positions by index, the heat ramp, lighting.

import { HEAT_STOPS } from "./theme.js";
import { BLOCK_SOURCE } from "./uniforms.js";

/** The version, the precisions, and the shared uniforms. Both stages of a program need equal precisions, or it does not link. */
export const HEADER = `#version 300 es
precision highp float;
precision highp int;
precision highp usampler2D;
${BLOCK_SOURCE}`;

/** Defines position(particle), for positions as 16-bit integers or as floats. @param {boolean} isQuantised */
export const positionReader = (isQuantised) => `
uniform highp ${isQuantised ? "usampler2D" : "sampler2D"} u_positions;
ivec2 texel(uint index) { return ivec2(int(index & 1023u), int(index >> 10u)); }
vec3 position(uint particle) { return u_lo + u_scale * vec3(texelFetch(u_positions, texel(particle), 0).xyz); }
`;

/** Values of u_paint: what the picture is coloured by. */
export const PAINT = Object.freeze({ off: 0, constraints: 1, speeds: 2, kinds: 3 });

/** Defines heat(value), the colour of a value between the ends of the scale, and that of an unknown one. */
export const HEAT = `
vec3 heat(float value, float known) {
  if (known < 0.5) return u_unknown;
  float at = clamp((value / known - u_heat_low) / (u_heat_high - u_heat_low), 0.0, 1.0) * ${(HEAT_STOPS.length - 1).toFixed(1)};
  int stop = min(int(at), ${HEAT_STOPS.length - 2});
  return mix(u_heat_stops[stop], u_heat_stops[stop + 1], at - float(stop));
}
`;

/** Defines speed(particle), and value_of(length, rest_length, gain) of a constraint (state/quantity.js). */
export const VALUES = `
uniform highp sampler2D u_speeds;
float speed(uint particle) { return texelFetch(u_speeds, texel(particle), 0).x; }
float value_of(float span, float rest_length, float gain) {
  float value = (span - rest_length) * abs(gain);
  return gain < 0.0 ? max(value, 0.0) : value;
}
`;

/** Defines lit(base, at, normal, to_eye, sheen, sun): a soft sky, one key light with a wrapped edge, light through thin cloth, and
 * the fibres that catch light at a grazing angle. `sun` is the part of the key light that arrives, 0..=1. In a fold, the normal
 * between two vertices can turn away from the eye: there is no grazing light, which would be a grey smear. */
export const LIGHT = `
vec3 lit(vec3 base, vec3 at, vec3 normal, vec3 to_eye, float sheen, float sun) {
  vec3 to_light = normalize(u_lamp - at);
  vec3 around = mix(u_bounce, u_sky, 0.5 + 0.5 * dot(normal, u_up));
  float facing = dot(normal, to_light);
  float direct = pow(clamp((facing + 0.25) / 1.25, 0.0, 1.0), 1.6);
  float through = clamp(-facing, 0.0, 1.0) * 0.12 * sheen;
  vec3 color = base * (around * 0.42 + u_key * sun * (direct + through));
  float gloss = pow(clamp(dot(normal, normalize(to_light + to_eye)), 0.0, 1.0), 28.0);
  float toward = dot(normal, to_eye);
  float rim = pow(1.0 - clamp(toward, 0.0, 1.0), 4.0) * smoothstep(0.0, 0.3, toward) * clamp(facing + 0.5, 0.0, 1.0);
  return color + sheen * u_key * sun * (gloss * 0.07 + rim * 0.3 * base);
}
`;

/** Defines screen(color, alpha): converts linear light to sRGB. */
export const SCREEN = `
out vec4 o_color;
vec4 screen(vec3 color, float alpha) { return vec4(pow(clamp(color, 0.0, 1.0), vec3(1.0 / 2.2)), alpha); }
`;

/** Taps of a soft shadow. */
const TAPS = 14;

/**
 * Defines sunlight(at, normal, blur): the part of the key light that arrives at a point, 0..=1, from the shadow map
 * (shadow-map.js). The edge of a shadow is `blur` wide, in texels. Without effects there is no map, and everything is lit.
 *
 * The taps lie on a spiral that each pixel turns by its own angle, which makes the edge soft instead of stepped.
 * @param {boolean} hasEffects
 */
export const sunlight = (hasEffects) => (hasEffects ? `
uniform highp sampler2DShadow u_shadow_map;
float sunlight(vec3 at, vec3 normal, float blur) {
  // A point a little in front of the surface, so that no surface lies in its own shadow.
  vec3 place = (u_to_shadow_map * vec4(at + normal * u_texel * (1.0 + 0.5 * blur), 1.0)).xyz;
  if (any(lessThan(place.xy, vec2(0.0))) || any(greaterThan(place.xy, vec2(1.0)))) return 1.0;
  // Beyond the depth of the map nothing casts a shadow, but much can lie in one.
  float depth = min(place.z, 0.99999);
  float turn = 6.2832 * fract(52.9829 * fract(dot(gl_FragCoord.xy, vec2(0.06711, 0.00584))));
  float texel = 1.0 / float(textureSize(u_shadow_map, 0).x);
  float light = 0.0;
  for (int tap = 0; tap < ${TAPS}; tap++) {
    float angle = float(tap) * 2.39996 + turn;
    float away = blur * texel * sqrt((float(tap) + 0.5) / ${TAPS.toFixed(1)});
    light += textureLod(u_shadow_map, vec3(place.xy + away * vec2(cos(angle), sin(angle)), depth), 0.0);
  }
  return light / ${TAPS.toFixed(1)};
}
` : "float sunlight(vec3 at, vec3 normal, float blur) { return 1.0; }\n");

/** Edges of shadows in texels: on the scene itself, and on the ground. */
export const BLUR = { scene: "2.5", ground: "9.0" };

/** Defines corner(): a corner of a quad, from gl_VertexID 0..=3 of a triangle strip. */
export const CORNER = "vec2 corner() { return vec2(float(gl_VertexID & 1), float(gl_VertexID >> 1)) * 2.0 - 1.0; }\n";
