// The planks of a bridge: boards between its ropes, instances of one cube that the vertex shader places.

import { STICK } from "../../state/topology.js";
import { Program, UNITS } from "../context.js";
import { BLUR, HEADER, LIGHT, SCREEN, positionReader, sunlight } from "../shaders.js";
import { VERTEX_FLOATS, cube } from "../solids.js";

/** Words per instance: the left ends of the plank, of the one before it and of the one after it. The right ends follow them. */
const WORDS = 3;

/**
 * A board lies along its plank, and faces away from the line between its neighbours. Its width and thickness are
 * fractions of the distance to them, and it extends a little beyond the ropes.
 * @param {boolean} isQuantised
 */
const vertex = (isQuantised) => `${HEADER}
layout(location = 0) in vec3 a_position;
layout(location = 1) in vec3 a_normal;
layout(location = 2) in uvec3 a_lefts;
out vec3 v_position;
out vec3 v_normal;
out vec2 v_on_board;
flat out float v_grain;
out float v_height;
${positionReader(isQuantised)}
void main() {
  vec3 left = position(a_lefts.x);
  vec3 right = position(a_lefts.x + 1u);
  vec3 ahead = position(a_lefts.z) + position(a_lefts.z + 1u) - position(a_lefts.y) - position(a_lefts.y + 1u);
  float steps = a_lefts.y == a_lefts.x || a_lefts.z == a_lefts.x ? 1.0 : 2.0;
  vec3 along = (right - left) * 0.5;
  float gap = length(ahead) * 0.5 / steps;
  vec3 side = normalize(along + vec3(1e-20));
  vec3 up = normalize(cross(side, ahead) + vec3(1e-20));
  vec3 across = cross(up, side);
  vec3 half_size = vec3(length(along) * 1.06, gap * 0.1, gap * 0.4);
  mat3 axes = mat3(side, up, across);
  vec3 at = (left + right) * 0.5 + axes * (half_size * a_position);
  v_position = at;
  v_normal = axes * a_normal;
  v_on_board = vec2(half_size.x * a_position.x, half_size.z * a_position.z) / max(gap, 1e-20);
  v_grain = fract(sin(float(a_lefts.x) * 12.9898) * 43758.5453);
  v_height = dot(u_ground.xyz, at) - u_ground.w;
  gl_Position = u_view_projection * vec4(at, 1.0);
}
`;

/** Wood: long streaks, and a shade of its own for each board. @param {boolean} hasEffects */
const fragment = (hasEffects) => `${HEADER}${SCREEN}${LIGHT}${sunlight(hasEffects)}
in vec3 v_position;
in vec3 v_normal;
in vec2 v_on_board;
flat in float v_grain;
in float v_height;
float noise(float x) {
  float first = floor(x);
  vec2 ends = fract(sin(vec2(first, first + 1.0) * 78.233 + v_grain * 9.0) * 43758.5453);
  return mix(ends.x, ends.y, smoothstep(0.0, 1.0, x - first));
}
void main() {
  if (u_shadow > 0.0) {
    if (v_height < 0.0) discard;
    o_color = vec4(0.0, 0.0, 0.0, u_shadow);
    return;
  }
  float wave = v_on_board.y * 22.0 + 0.5 * sin(v_on_board.x * 1.7 + v_grain * 6.0);
  float calm = 1.0 - smoothstep(0.4, 1.2, fwidth(wave));
  vec3 wood = u_wood * (0.82 + 0.3 * v_grain) * (1.0 - 0.22 * calm * noise(wave));
  vec3 normal = normalize(v_normal);
  o_color = screen(lit(wood, v_position, normal, normalize(u_eye - v_position), 0.15, sunlight(v_position, normal, ${BLUR.scene})), 1.0);
}
`;

export class Planks {
  /** @param {WebGL2RenderingContext} gl @param {import("../context.js").Variant} variant */
  constructor(gl, { isQuantised, hasEffects }) {
    this.gl = gl;
    this.program = new Program(gl, vertex(isQuantised), fragment(hasEffects));
    this.program.setSamplers(UNITS);
    this.vao = gl.createVertexArray();
    this.instances = gl.createBuffer();
    this.count = 0;
    const { vertices, indices } = cube();
    this.indexCount = indices.length;
    gl.bindVertexArray(this.vao);
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ARRAY_BUFFER, vertices, gl.STATIC_DRAW);
    for (const [location, at] of [[0, 0], [1, 3]]) {
      gl.enableVertexAttribArray(location);
      gl.vertexAttribPointer(location, 3, gl.FLOAT, false, VERTEX_FLOATS * 4, at * 4);
    }
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, indices, gl.STATIC_DRAW);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.instances);
    gl.enableVertexAttribArray(2);
    gl.vertexAttribIPointer(2, 3, gl.UNSIGNED_INT, WORDS * 4, 0);
    gl.vertexAttribDivisor(2, 1);
    gl.bindVertexArray(null);
  }

  /** Lists the planks whose constraint is not torn. @param {import("../../state/shapes.js").Plank[]} planks @param {Uint8Array} styles of all constraints */
  set(planks, styles) {
    const { gl } = this;
    const whole = planks.filter(({ constraint }) => (styles[constraint] & STICK.isGone) === 0);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.instances);
    gl.bufferData(gl.ARRAY_BUFFER, Uint32Array.from(whole.flatMap(({ left, before, after }) => [left, before, after])), gl.DYNAMIC_DRAW);
    this.count = whole.length;
  }

  draw() {
    if (this.count === 0) return;
    const { gl } = this;
    this.program.use();
    gl.bindVertexArray(this.vao);
    gl.drawElementsInstanced(gl.TRIANGLES, this.indexCount, gl.UNSIGNED_SHORT, 0, this.count);
    gl.bindVertexArray(null);
  }
}
