// Constraints as sticks. Each is one instanced quad around a capsule on the screen, because WebGL lines
// are only one pixel wide.

import { sameNumbers } from "../../geometry/math.js";
import { CONSTRAINT } from "../../net/wire.js";
import { drawnSticks, STICK } from "../../state/topology.js";
import { ArrayTexture, layouts, Program, UNITS } from "../context.js";
import { BLUR, CORNER, HEADER, HEAT, LIGHT, PAINT, positionReader, SCREEN, sunlight, VALUES } from "../shaders.js";
import { STICKS } from "../styles.js";

/** Words per instance: two ends, rest length and gain as f32 bits, style, radius as a solid body as f32 bits. */
const WORDS = 6;

/**
 * Defines rod(t, aside), the colour of a solid rod at a fraction of its length, and at a distance from its
 * axis in radii. The quad of a stick faces the eye, so its normal follows from both. Defines place(alpha), which sets its depth.
 */
const ROD = `
vec3 rod(float t, vec2 aside) {
  vec3 axis = normalize(v_ends[1] - v_ends[0] + vec3(1e-20));
  vec3 at = mix(v_ends[0], v_ends[1], t);
  vec3 to_eye = normalize(u_eye - at);
  vec3 facing = normalize(to_eye - axis * dot(to_eye, axis) + vec3(1e-20));
  vec3 normal = normalize(u_right * aside.x + u_upward * aside.y + facing * sqrt(max(0.0, 1.0 - dot(aside, aside))));
  vec3 surface = at + normal * v_radius;
  return lit(u_body, surface, normal, to_eye, 0.4, sunlight(surface, normal, ${BLUR.scene}));
}
// The half transparent pixels at the edge lie behind, or they would hide the next rod of the same rope.
void place(float alpha) { gl_FragDepth = gl_FragCoord.z + (v_radius > 0.0 && alpha < 1.0 ? 1e-3 : 0.0); }
`;
const NO_ROD = `
vec3 rod(float t, vec2 aside) { return vec3(0.0); }
void place(float alpha) {}
`;

/** Computes the ends in pixels, and the quad around them. Divides by w here, so that interpolation is
 * linear on the screen. Clips an end behind the eye to the near plane. @param {import("../context.js").Variant} variant */
const vertex = ({ isQuantised }) => `${HEADER}${CORNER}
layout(location = 0) in uvec2 a_ends;
layout(location = 1) in float a_rest_length;
layout(location = 2) in uint a_style;
layout(location = 3) in float a_radius;
layout(location = 4) in float a_gain;
uniform float u_radius;
uniform float u_radius_min;
uniform float u_forward;
uniform float u_is_all;
flat out vec3 v_ends[2];
flat out float v_radius;
out vec2 v_pixel;
flat out vec4 v_segment;
flat out vec2 v_radii;
out float v_value;
flat out float v_known;
flat out uint v_kind;
out float v_height;
${positionReader(isQuantised)}${VALUES}
void main() {
  uint kind = a_style & ${STICK.kindMask}u;
  bool is_hidden = (a_style & ${STICK.isGone}u) != 0u || (kind == ${CONSTRAINT.bend}u && u_paint != ${PAINT.kinds.toFixed(1)});
  bool is_solid = u_is_solid > 0.5 && a_radius > 0.0;
  bool is_thread = kind == 0u && ((a_style & ${STICK.isCovered}u) == 0u || is_solid);
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
  v_ends[0] = xa;
  v_ends[1] = xb;
  v_radius = is_solid ? a_radius : 0.0;
  vec2 radii = max(vec2(u_radius_min), (is_solid ? a_radius : u_radius) * u_pixels_per_unit / vec2(a.w, b.w));
  if (kind != 0u) radii *= 0.6;
  vec2 at = corner();
  vec2 along = pb - pa;
  along = dot(along, along) > 1e-6 ? normalize(along) : vec2(1.0, 0.0);
  vec2 across = vec2(-along.y, along.x);
  float wide = max(radii.x, radii.y) + 1.0;
  v_pixel = (at.x < 0.0 ? pa : pb) + along * at.x * wide + across * at.y * wide;
  v_segment = vec4(pa, pb);
  v_radii = radii;
  bool is_speed = u_paint == ${PAINT.speeds.toFixed(1)};
  v_value = is_speed ? speed(at.x < 0.0 ? a_ends.x : a_ends.y) : value_of(length(xb - xa), a_rest_length, a_gain);
  v_known = is_speed || a_gain != 0.0 ? 1.0 : 0.0;
  v_kind = kind;
  v_height = dot(u_ground.xyz, at.x < 0.0 ? xa : xb) - u_ground.w;
  float depth = at.x < 0.0 ? a.z / a.w : b.z / b.w;
  gl_Position = vec4(v_pixel / u_viewport * 2.0 - 1.0, depth - u_forward, 1.0);
}
`;

/** @param {import("../context.js").Variant} variant */
const fragment = ({ hasEffects }) => `${HEADER}${SCREEN}${HEAT}
flat in vec3 v_ends[2];
flat in float v_radius;
in vec2 v_pixel;
flat in vec4 v_segment;
flat in vec2 v_radii;
in float v_value;
flat in float v_known;
flat in uint v_kind;
in float v_height;
uniform float u_round;
uniform float u_opacity;
${hasEffects ? LIGHT + sunlight(true) + ROD : NO_ROD}
void main() {
  vec2 along = v_segment.zw - v_segment.xy;
  float t = clamp(dot(v_pixel - v_segment.xy, along) / max(dot(along, along), 1e-6), 0.0, 1.0);
  float radius = mix(v_radii.x, v_radii.y, t);
  float away = length(v_pixel - v_segment.xy - along * t);
  float alpha = clamp(radius + 0.5 - away, 0.0, 1.0);
  place(alpha);
  if (u_shadow > 0.0) {
    if (alpha < 0.5 || v_height < 0.0) discard;
    o_color = vec4(0.0, 0.0, 0.0, u_shadow);
    return;
  }
  if (alpha < 0.03) discard;
  vec3 base = v_kind == 0u ? u_stick : u_stick_faint;
  if (u_paint > 0.0) base = u_paint == ${PAINT.kinds.toFixed(1)} ? u_kinds[int(v_kind)] : heat(v_value, v_known);
  // A thick stick is shaded like a rod: darker towards its edges.
  float edge = clamp(away / max(radius, 1e-3), 0.0, 1.0);
  float shade = mix(1.0, 0.45 + 0.65 * sqrt(1.0 - edge * edge), u_round * smoothstep(1.5, 4.0, radius));
  bool is_lit = v_radius > 0.0 && u_paint <= 0.0;
  vec2 aside = (v_pixel - v_segment.xy - along * t) / max(radius, 1e-3);
  o_color = screen(is_lit ? rod(t, aside) : base * shade, alpha * (is_lit ? 1.0 : u_opacity));
}
`;

export class Sticks {
  /** @param {WebGL2RenderingContext} gl @param {import("../context.js").Variant} variant */
  constructor(gl, variant) {
    this.gl = gl;
    this.program = new Program(gl, vertex(variant), fragment(variant));
    this.program.setSamplers(UNITS);
    this.vao = gl.createVertexArray();
    this.buffer = gl.createBuffer();
    /** Constraints, in the order of the instances. */
    this.drawn = /** @type {Uint32Array} */ (new Uint32Array(0));
    this.words = new Uint32Array(0);
  }

  /** @param {Pick<import("../../state/topology.js").Topology, "scene" | "styles" | "gains">} topology @param {Uint32Array} drawn @param {Float32Array} radii of all constraints */
  setSticks({ scene, styles, gains }, drawn, radii) {
    const { gl } = this;
    this.drawn = drawn;
    this.words = new Uint32Array(drawn.length * WORDS);
    const numbers = new Float32Array(this.words.buffer);
    drawn.forEach((constraint, k) => {
      this.words[k * WORDS] = scene.ends[2 * constraint];
      this.words[k * WORDS + 1] = scene.ends[2 * constraint + 1];
      numbers[k * WORDS + 2] = scene.restLengths[constraint];
      numbers[k * WORDS + 3] = gains[constraint];
      this.words[k * WORDS + 4] = styles[constraint];
      numbers[k * WORDS + 5] = radii[constraint];
    });
    gl.bindVertexArray(this.vao);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffer);
    gl.bufferData(gl.ARRAY_BUFFER, this.words, gl.DYNAMIC_DRAW);
    gl.vertexAttribIPointer(0, 2, gl.UNSIGNED_INT, WORDS * 4, 0);
    gl.vertexAttribPointer(1, 1, gl.FLOAT, false, WORDS * 4, 8);
    gl.vertexAttribPointer(4, 1, gl.FLOAT, false, WORDS * 4, 12);
    gl.vertexAttribIPointer(2, 1, gl.UNSIGNED_INT, WORDS * 4, 16);
    gl.vertexAttribPointer(3, 1, gl.FLOAT, false, WORDS * 4, 20);
    for (const location of [0, 1, 2, 3, 4]) {
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

  /** Uploads the styles and gains again. @param {Pick<import("../../state/topology.js").Topology, "styles" | "gains">} topology */
  update({ styles, gains }) {
    const { gl } = this;
    const floats = new Float32Array(this.words.buffer);
    for (let k = 0; k < this.drawn.length; k++) {
      floats[k * WORDS + 3] = gains[this.drawn[k]];
      this.words[k * WORDS + 4] = styles[this.drawn[k]];
    }
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffer);
    gl.bufferSubData(gl.ARRAY_BUFFER, 0, this.words);
  }

  /** @param {import("../context.js").Uniforms} sceneStyle @param {import("../context.js").Uniforms} style takes precedence */
  draw(sceneStyle, style) {
    if (this.drawn.length === 0) return;
    const { gl } = this;
    this.program.use();
    this.program.set(sceneStyle, style);
    gl.bindVertexArray(this.vao);
    gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, this.drawn.length);
    gl.bindVertexArray(null);
  }
}

/** Thin flat sticks of all listed constraints. */
const THIN = { u_is_all: 1, u_radius: 0, u_round: 0 };
/** In front of everything else, behind something, and in 2-D. */
const VISIBLE = { ...THIN, u_forward: STICKS.solid.u_forward, u_opacity: 0.9 };
const HIDDEN = { ...VISIBLE, u_opacity: 0.25 };
const FLAT = { ...VISIBLE, u_forward: 0 };

/** The constraints that show the shape: structural ones, or all if there are none. @param {import("../../net/wire.js").Scene} scene @param {number} limit */
function ghostSticks(scene, limit) {
  const drawn = drawnSticks(scene, limit);
  const structural = drawn.filter((constraint) => scene.constraintKinds[constraint] === CONSTRAINT.structural);
  return structural.length > 0 ? structural : drawn;
}

export class GhostSticks {
  /** @param {WebGL2RenderingContext} gl @param {Sticks} sticks for positions as f32, which it fills @param {import("../../state/topology.js").Topology} topology @param {number} limit number of sticks at most */
  constructor(gl, sticks, { scene }, limit) {
    this.gl = gl;
    this.scene = scene;
    this.sticks = sticks;
    this.positions = new ArrayTexture(gl, UNITS.u_positions, layouts(gl).f32x3, scene.particleCount);
    this.styles = Uint8Array.from(scene.constraintKinds);
    this.gains = new Float32Array(scene.constraintCount);
    /** Constraints that the ghost lacks. */
    this.hidden = new Uint32Array(0);
    this.sticks.setSticks({ scene, styles: this.styles, gains: this.gains }, ghostSticks(scene, limit), new Float32Array(scene.constraintCount));
  }

  /** @param {import("../../net/wire.js").Ghost} ghost */
  write(ghost) {
    if (ghost.positions.length > 0) this.positions.write(ghost.positions);
    if (sameNumbers(ghost.hidden, this.hidden)) return;
    this.hidden = ghost.hidden.slice();
    this.styles.set(this.scene.constraintKinds);
    for (const constraint of this.hidden) this.styles[constraint] |= STICK.isGone;
    this.sticks.update(this);
  }

  /** Draws over the picture. Afterwards, the positions are those of `others` again.
   * @param {import("../context.js").Uniforms} sceneStyle @param {ArrayTexture} others @param {{ isFlat: boolean }} scene */
  draw(sceneStyle, others, { isFlat }) {
    const { gl } = this;
    this.positions.bind();
    if (!isFlat) {
      gl.enable(gl.DEPTH_TEST);
      gl.depthMask(false);
      gl.depthFunc(gl.GREATER);
      this.sticks.draw(sceneStyle, HIDDEN);
      gl.depthMask(true);
      gl.depthFunc(gl.LEQUAL);
    }
    this.sticks.draw(sceneStyle, isFlat ? FLAT : VISIBLE);
    others.bind();
  }

  delete() {
    this.positions.delete();
    this.sticks.clear();
  }
}
