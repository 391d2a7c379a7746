// Constraints as sticks. Each is one instanced quad around a capsule on the screen, because WebGL lines
// are only one pixel wide.

import { STICK } from "../state/topology.js";
import { Program } from "./context.js";
import { CORNER, HEADER, HEAT, SCREEN, SHADOW, positionReader } from "./shaders.js";

/** Words per instance: two ends, rest length as f32 bits, style. */
const WORDS = 4;

/** Computes the ends in pixels, and the quad around them. Divides by w here, so that interpolation is
 * linear on the screen. Clips an end behind the eye to the near plane. @param {boolean} isQuantised */
const vertex = (isQuantised) => `${HEADER}${SHADOW}${CORNER}
layout(location = 0) in uvec2 a_ends;
layout(location = 1) in float a_rest_length;
layout(location = 2) in uint a_style;
uniform mat4 u_view_projection;
uniform vec2 u_viewport;
uniform float u_pixels_per_unit;
uniform float u_radius;
uniform float u_radius_min;
uniform float u_near;
uniform float u_forward;
uniform float u_is_all;
out vec2 v_pixel;
flat out vec4 v_segment;
flat out vec2 v_radii;
flat out float v_strain;
flat out uint v_kind;
out float v_height;
${positionReader(isQuantised)}
void main() {
  uint kind = a_style & ${STICK.kindMask}u;
  bool is_hidden = (a_style & ${STICK.isGone}u) != 0u;
  bool is_thread = kind == 0u && (a_style & ${STICK.isCovered}u) == 0u;
  gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
  if (is_hidden || !(u_is_all > 0.5 || is_thread)) return;
  vec3 xa = position(a_ends.x);
  vec3 xb = position(a_ends.y);
  vec4 a = u_view_projection * vec4(xa, 1.0);
  vec4 b = u_view_projection * vec4(xb, 1.0);
  if (a.w < u_near && b.w < u_near) return;
  if (a.w < u_near) a = mix(a, b, (u_near - a.w) / (b.w - a.w));
  if (b.w < u_near) b = mix(b, a, (u_near - b.w) / (a.w - b.w));
  vec2 pa = (a.xy / a.w * 0.5 + 0.5) * u_viewport;
  vec2 pb = (b.xy / b.w * 0.5 + 0.5) * u_viewport;
  vec2 radii = max(vec2(u_radius_min), u_radius * u_pixels_per_unit / vec2(a.w, b.w));
  if (kind != 0u) radii *= 0.6;
  vec2 at = corner();
  vec2 along = pb - pa;
  along = dot(along, along) > 1e-6 ? normalize(along) : vec2(1.0, 0.0);
  vec2 across = vec2(-along.y, along.x);
  float wide = max(radii.x, radii.y) + 1.0;
  v_pixel = (at.x < 0.0 ? pa : pb) + along * at.x * wide + across * at.y * wide;
  v_segment = vec4(pa, pb);
  v_radii = radii;
  v_strain = length(xb - xa) / max(a_rest_length, 1e-20) - 1.0;
  v_kind = kind;
  v_height = dot(u_ground.xyz, at.x < 0.0 ? xa : xb) - u_ground.w;
  float depth = at.x < 0.0 ? a.z / a.w : b.z / b.w;
  gl_Position = vec4(v_pixel / u_viewport * 2.0 - 1.0, depth - u_forward, 1.0);
}
`;

const FRAGMENT = `${HEADER}${SHADOW}${SCREEN}${HEAT}
in vec2 v_pixel;
flat in vec4 v_segment;
flat in vec2 v_radii;
flat in float v_strain;
flat in uint v_kind;
in float v_height;
uniform vec3 u_stick;
uniform vec3 u_stick_faint;
uniform float u_round;
uniform float u_opacity;
void main() {
  vec2 along = v_segment.zw - v_segment.xy;
  float t = clamp(dot(v_pixel - v_segment.xy, along) / max(dot(along, along), 1e-6), 0.0, 1.0);
  float radius = mix(v_radii.x, v_radii.y, t);
  float away = length(v_pixel - v_segment.xy - along * t);
  float alpha = clamp(radius + 0.5 - away, 0.0, 1.0);
  if (u_shadow > 0.0) {
    if (alpha < 0.5 || v_height < 0.0) discard;
    o_color = vec4(0.0, 0.0, 0.0, u_shadow);
    return;
  }
  if (alpha < 0.03) discard;
  vec3 base = u_heat_max > 0.0 ? heat(v_strain) : v_kind == 0u ? u_stick : u_stick_faint;
  // A thick stick is shaded like a rod: darker towards its edges.
  float edge = clamp(away / max(radius, 1e-3), 0.0, 1.0);
  float rod = mix(1.0, 0.45 + 0.65 * sqrt(1.0 - edge * edge), u_round * smoothstep(1.5, 4.0, radius));
  o_color = screen(base * rod, alpha * u_opacity);
}
`;

export class Sticks {
  /** @param {WebGL2RenderingContext} gl @param {boolean} isQuantised */
  constructor(gl, isQuantised) {
    this.gl = gl;
    this.program = new Program(gl, vertex(isQuantised), FRAGMENT);
    this.program.setSamplers({ u_positions: 0 });
    this.vao = gl.createVertexArray();
    this.buffer = gl.createBuffer();
    /** Constraints, in the order of the instances. */
    this.drawn = /** @type {Uint32Array} */ (new Uint32Array(0));
    this.words = new Uint32Array(0);
  }

  /** @param {import("../net/wire.js").Scene} scene @param {Uint32Array} drawn @param {Uint8Array} styles */
  setSticks(scene, drawn, styles) {
    const { gl } = this;
    this.drawn = drawn;
    this.words = new Uint32Array(drawn.length * WORDS);
    const lengths = new Float32Array(this.words.buffer);
    drawn.forEach((constraint, k) => {
      this.words[k * WORDS] = scene.ends[2 * constraint];
      this.words[k * WORDS + 1] = scene.ends[2 * constraint + 1];
      lengths[k * WORDS + 2] = scene.restLengths[constraint];
      this.words[k * WORDS + 3] = styles[constraint];
    });
    gl.bindVertexArray(this.vao);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffer);
    gl.bufferData(gl.ARRAY_BUFFER, this.words, gl.DYNAMIC_DRAW);
    gl.vertexAttribIPointer(0, 2, gl.UNSIGNED_INT, WORDS * 4, 0);
    gl.vertexAttribPointer(1, 1, gl.FLOAT, false, WORDS * 4, 8);
    gl.vertexAttribIPointer(2, 1, gl.UNSIGNED_INT, WORDS * 4, 12);
    for (const location of [0, 1, 2]) {
      gl.enableVertexAttribArray(location);
      gl.vertexAttribDivisor(location, 1);
    }
    gl.bindVertexArray(null);
  }

  clear() {
    const { gl } = this;
    this.drawn = new Uint32Array(0);
    this.words = new Uint32Array(0);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffer);
    gl.bufferData(gl.ARRAY_BUFFER, this.words, gl.DYNAMIC_DRAW);
  }

  /** @param {Uint8Array} styles of all constraints */
  setStyles(styles) {
    const { gl } = this;
    for (let k = 0; k < this.drawn.length; k++) this.words[k * WORDS + 3] = styles[this.drawn[k]];
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffer);
    gl.bufferSubData(gl.ARRAY_BUFFER, 0, this.words);
  }

  /** @param {Record<string, number | number[]>} uniforms */
  draw(uniforms) {
    if (this.drawn.length === 0) return;
    const { gl } = this;
    this.program.use();
    this.program.set(uniforms);
    gl.bindVertexArray(this.vao);
    gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, this.drawn.length);
    gl.bindVertexArray(null);
  }
}
