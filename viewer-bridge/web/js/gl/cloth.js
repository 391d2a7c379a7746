// The surface: two-sided cloth. The vertex shader computes the normal of a particle from the intact
// triangles around it, so after a tear the CPU only lists the triangles that are gone.

import { Program } from "./context.js";
import { HEADER, HEAT, LIGHT, SCREEN, SHADOW, positionReader } from "./shaders.js";

/** Defines surface_position(vertex, particle): a vertex is a particle, or moves with one (state/splits.js). */
const SURFACE_POSITION = `
uniform usampler2D u_splits;
uniform float u_particle_count;
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

const NORMAL_FROM_FAN = `
uniform usampler2D u_fan_ranges;
uniform usampler2D u_fans;
void main() {
  uint particle;
  vec3 surface = surface_position(uint(gl_VertexID), particle);
  vec3 at = position(particle);
  uvec2 range = texelFetch(u_fan_ranges, texel(particle), 0).xy;
  vec3 normal = vec3(0.0);
  float strain = 0.0;
  float edges = 0.0;
  for (uint entry = range.x; entry < range.x + range.y; entry++) {
    uvec4 fan = texelFetch(u_fans, texel(entry), 0);
    vec3 to_first = position(fan.x) - at;
    normal += cross(to_first, position(fan.y) - at);
    float rest_length = uintBitsToFloat(fan.z);
    if (rest_length > 0.0) { strain += length(to_first) / rest_length - 1.0; edges += 1.0; }
  }
  v_position = surface;
  v_normal = normal;
  v_strain = strain / max(edges, 1.0);
  gl_Position = u_view_projection * vec4(surface, 1.0);
}
`;

/** @param {boolean} isQuantised */
const vertex = (isQuantised) => `${HEADER}
uniform mat4 u_view_projection;
out vec3 v_position;
out vec3 v_normal;
out float v_strain;
${positionReader(isQuantised)}${SURFACE_POSITION}${NORMAL_FROM_FAN}`;

const FRAGMENT = `${HEADER}${SCREEN}${LIGHT}${HEAT}
in vec3 v_position;
in vec3 v_normal;
in float v_strain;
uniform vec3 u_eye;
uniform vec3 u_front;
uniform vec3 u_back;
uniform vec4 u_flat;
void main() {
  vec3 base = gl_FrontFacing ? u_front : u_back;
  if (u_flat.a > 0.0) {
    o_color = screen(u_heat_max > 0.0 ? heat(v_strain) : u_flat.rgb, u_flat.a);
    return;
  }
  vec3 face = cross(dFdx(v_position), dFdy(v_position));
  vec3 normal = dot(v_normal, v_normal) > 0.0 ? normalize(v_normal) : normalize(face);
  normal = gl_FrontFacing ? normal : -normal;
  vec3 to_eye = normalize(u_eye - v_position);
  bool is_heat = u_heat_max > 0.0;
  if (is_heat) base = heat(v_strain);
  vec3 color = lit(base, v_position, normal, to_eye, is_heat ? 0.2 : 1.0);
  // Shading would distort the colours of the heat map, so about half of it is unshaded.
  o_color = screen(is_heat ? mix(base, color, 0.45) : color, 1.0);
}
`;

/** @param {boolean} isQuantised */
const shadowVertex = (isQuantised) => `${HEADER}${SHADOW}
uniform mat4 u_view_projection;
out float v_height;
${positionReader(isQuantised)}${SURFACE_POSITION}
void main() {
  uint particle;
  vec3 at = surface_position(uint(gl_VertexID), particle);
  v_height = dot(u_ground.xyz, at) - u_ground.w;
  gl_Position = u_view_projection * vec4(at, 1.0);
}
`;

const SHADOW_FRAGMENT = `${HEADER}${SHADOW}${SCREEN}
in float v_height;
void main() {
  if (v_height < 0.0) discard;
  o_color = vec4(0.0, 0.0, 0.0, u_shadow);
}
`;

export class Cloth {
  /** @param {WebGL2RenderingContext} gl @param {boolean} isQuantised */
  constructor(gl, isQuantised) {
    this.gl = gl;
    this.program = new Program(gl, vertex(isQuantised), FRAGMENT);
    this.shadow = new Program(gl, shadowVertex(isQuantised), SHADOW_FRAGMENT);
    for (const program of [this.program, this.shadow]) program.setSamplers({ u_positions: 0, u_fan_ranges: 1, u_fans: 2, u_splits: 3 });
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

  /** @param {Record<string, number | number[]>} uniforms */
  draw(uniforms) {
    this.drawWith(this.program, uniforms);
  }

  /** @param {Record<string, number | number[]>} uniforms */
  drawShadow(uniforms) {
    this.drawWith(this.shadow, uniforms);
  }

  /** @param {Program} program @param {Record<string, number | number[]>} uniforms */
  drawWith(program, uniforms) {
    if (this.count === 0) return;
    const { gl } = this;
    program.use();
    program.set(uniforms);
    gl.bindVertexArray(this.vao);
    gl.drawElements(gl.TRIANGLES, this.count, gl.UNSIGNED_INT, 0);
    gl.bindVertexArray(null);
  }
}
