// The surface: two-sided cloth. The vertex shader computes the normal of a particle from the intact
// triangles around it, so after a tear the CPU only lists the triangles that are gone.

import { Program, UNITS } from "../context.js";
import { BLUR, HEADER, HEAT, LIGHT, PAINT, SCREEN, VALUES, positionReader, sunlight } from "../shaders.js";

/** Defines surface_position(vertex, particle): a vertex is a particle, or moves with one (state/splits.js). */
const SURFACE_POSITION = `
uniform usampler2D u_splits;
vec3 surface_position(uint vertex, out uint particle) {
  particle = vertex;
  uint count = uint(u_particle_count);
  if (vertex < count) return position(vertex);
  uint first = 2u * (vertex - count);
  uvec4 corners = texelFetch(u_splits, texel(first), 0);
  vec2 weights = uintBitsToFloat(texelFetch(u_splits, texel(first + 1u), 0).xy);
  particle = corners.x;
  vec3 at = position(particle);
  return at + weights.x * (position(corners.y) - at) + weights.y * (position(corners.z) - at);
}
`;

/** Defines flat_place(vertex): the place of a vertex in the surface laid flat (state/weave.js). */
const FLAT_PLACE = `
uniform highp sampler2D u_flat_places;
vec2 flat_place_of(uint particle) { return texelFetch(u_flat_places, texel(particle), 0).xy; }
vec2 flat_place(uint vertex) {
  uint count = uint(u_particle_count);
  if (vertex < count) return flat_place_of(vertex);
  uint first = 2u * (vertex - count);
  uvec4 corners = texelFetch(u_splits, texel(first), 0);
  vec2 weights = uintBitsToFloat(texelFetch(u_splits, texel(first + 1u), 0).xy);
  vec2 at = flat_place_of(corners.x);
  return at + weights.x * (flat_place_of(corners.y) - at) + weights.y * (flat_place_of(corners.z) - at);
}
`;
const NO_FLAT_PLACE = "vec2 flat_place(uint vertex) { return vec2(0.0); }\n";

/**
 * Defines weave(place, position): the brightness of the threads, around 1. A thread that lies on top is bright
 * in its middle. The threads fade out before pixels could alias them, and broader stripes take their place; both
 * fade where the surface could not be laid flat.
 */
const WEAVE = `
float fading(vec2 cell) {
  vec2 width = fwidth(cell);
  return 1.0 - smoothstep(0.12, 0.3, max(width.x, width.y));
}
float weave(vec2 place, vec3 at) {
  vec4 flat_rate = vec4(dFdx(place), dFdy(place));
  float rate = dot(dFdx(at), dFdx(at)) + dot(dFdy(at), dFdy(at));
  float stretch = dot(flat_rate, flat_rate) / max(rate, 1e-20);
  float faith = smoothstep(0.3, 0.6, stretch) * (1.0 - smoothstep(1.7, 3.0, stretch));
  vec2 cell = place / u_thread;
  vec2 id = floor(cell);
  vec2 inside = fract(cell) - 0.5;
  bool is_weft = mod(id.x + id.y, 2.0) < 0.5;
  float across = is_weft ? inside.y : inside.x;
  float along = is_weft ? inside.x : inside.y;
  float height = cos(across * 3.1416) * (0.65 + 0.35 * cos(along * 3.1416));
  float near = fading(cell);
  float threads = (height - 0.56) * 0.42 * near;
  vec2 stripe = place / (u_thread * 16.0);
  vec2 ridge = abs(fract(stripe) - 0.5);
  float stripes = (smoothstep(0.44, 0.47, ridge.x) + smoothstep(0.44, 0.47, ridge.y)) * -0.1 * fading(stripe * 4.0) * (1.0 - near);
  return 1.0 + faith * (threads + stripes);
}
`;
const NO_WEAVE = "float weave(vec2 place, vec3 at) { return 1.0; }\n";

const NORMAL_FROM_FAN = `
uniform usampler2D u_fan_ranges;
uniform usampler2D u_fans;
void main() {
  uint particle;
  vec3 surface = surface_position(uint(gl_VertexID), particle);
  vec3 at = position(particle);
  uvec2 range = texelFetch(u_fan_ranges, texel(particle), 0).xy;
  vec3 normal = vec3(0.0);
  float value = 0.0;
  float known = 0.0;
  for (uint entry = range.x; entry < range.x + range.y; entry++) {
    uvec4 fan = texelFetch(u_fans, texel(entry), 0);
    vec3 to_first = position(fan.x) - at;
    normal += cross(to_first, position(fan.y) - at);
    float gain = uintBitsToFloat(fan.w);
    if (gain != 0.0) { value += value_of(length(to_first), uintBitsToFloat(fan.z), gain); known += 1.0; }
  }
  v_position = surface;
  v_normal = normal;
  v_value = value / max(known, 1.0);
  v_known = min(known, 1.0);
  if (u_paint == ${PAINT.speeds.toFixed(1)}) { v_value = speed(particle); v_known = 1.0; }
  if (u_paint == ${PAINT.kinds.toFixed(1)}) v_known = 0.0;
  v_flat_place = flat_place(uint(gl_VertexID));
  gl_Position = u_view_projection * vec4(surface, 1.0);
}
`;

/** @param {import("../context.js").Variant} variant */
const vertex = ({ isQuantised, hasEffects }) => `${HEADER}
out vec3 v_position;
out vec3 v_normal;
out float v_value;
out float v_known;
out vec2 v_flat_place;
${positionReader(isQuantised)}${VALUES}${SURFACE_POSITION}${hasEffects ? FLAT_PLACE : NO_FLAT_PLACE}${NORMAL_FROM_FAN}`;

/** @param {import("../context.js").Variant} variant */
const fragment = ({ hasEffects }) => `${HEADER}${SCREEN}${LIGHT}${HEAT}${sunlight(hasEffects)}${hasEffects ? WEAVE : NO_WEAVE}
in vec3 v_position;
in vec3 v_normal;
in float v_value;
in float v_known;
in vec2 v_flat_place;
uniform vec4 u_flat;
void main() {
  vec3 base = gl_FrontFacing ? u_front : u_back;
  if (u_flat.a > 0.0) {
    o_color = screen(u_paint > 0.0 ? heat(v_value, v_known) : u_flat.rgb, u_flat.a);
    return;
  }
  vec3 face = cross(dFdx(v_position), dFdy(v_position));
  vec3 normal = dot(v_normal, v_normal) > 0.0 ? normalize(v_normal) : normalize(face);
  normal = gl_FrontFacing ? normal : -normal;
  vec3 to_eye = normalize(u_eye - v_position);
  bool is_heat = u_paint > 0.0;
  base *= weave(v_flat_place, v_position);
  if (is_heat) base = heat(v_value, v_known);
  vec3 color = lit(base, v_position, normal, to_eye, is_heat ? 0.2 : 1.0, sunlight(v_position, normal, ${BLUR.scene}));
  // Shading would distort the colours of the heat map, so about half of it is unshaded.
  o_color = screen(is_heat ? mix(base, color, 0.45) : color, 1.0);
}
`;

/** @param {boolean} isQuantised */
const shadowVertex = (isQuantised) => `${HEADER}
out float v_height;
${positionReader(isQuantised)}${SURFACE_POSITION}
void main() {
  uint particle;
  vec3 at = surface_position(uint(gl_VertexID), particle);
  v_height = dot(u_ground.xyz, at) - u_ground.w;
  gl_Position = u_view_projection * vec4(at, 1.0);
}
`;

const SHADOW_FRAGMENT = `${HEADER}${SCREEN}
in float v_height;
void main() {
  if (v_height < 0.0) discard;
  o_color = vec4(0.0, 0.0, 0.0, u_shadow);
}
`;

export class Cloth {
  /** @param {WebGL2RenderingContext} gl @param {import("../context.js").Variant} variant */
  constructor(gl, variant) {
    this.gl = gl;
    this.program = new Program(gl, vertex(variant), fragment(variant));
    this.shadow = new Program(gl, shadowVertex(variant.isQuantised), SHADOW_FRAGMENT);
    for (const program of [this.program, this.shadow]) program.setSamplers(UNITS);
    this.vao = gl.createVertexArray();
    this.indices = gl.createBuffer();
    this.count = 0;
  }

  /** @param {Uint32Array} triangles @param {Uint32Array} pieces of split triangles */
  setTriangles(triangles, pieces) {
    const { gl } = this;
    gl.bindVertexArray(this.vao);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, this.indices);
    const all = new Uint32Array(triangles.length + pieces.length);
    all.set(triangles);
    all.set(pieces, triangles.length);
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, all, gl.DYNAMIC_DRAW);
    gl.bindVertexArray(null);
    this.count = all.length;
  }

  /** @param {import("../context.js").Uniforms} style */
  draw(style) {
    this.drawWith(this.program, style);
  }

  drawShadow() {
    this.drawWith(this.shadow, {});
  }

  /** @param {Program} program @param {import("../context.js").Uniforms} style */
  drawWith(program, style) {
    if (this.count === 0) return;
    const { gl } = this;
    program.use();
    program.set(style);
    gl.bindVertexArray(this.vao);
    gl.drawElements(gl.TRIANGLES, this.count, gl.UNSIGNED_INT, 0);
    gl.bindVertexArray(null);
  }
}
