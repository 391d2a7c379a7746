// Forces as arrows. They are drawn over everything else, because many begin inside a collider.

import { Program } from "./context.js";
import { HEADER, SCREEN } from "./shaders.js";

/** Floats per instance: both ends. */
const FLOATS = 6;
/** Vertices per instance: two triangles for the shaft, one for the head. */
const VERTICES = 9;

/** Computes the ends in pixels, and the arrow between them. Clips an end behind the eye to the near plane. */
const VERTEX = `${HEADER}
layout(location = 0) in vec3 a_from;
layout(location = 1) in vec3 a_to;
uniform float u_width;
uniform float u_rim;
vec2 shape(float long_px) {
  float head = min(u_width * 4.0, long_px);
  int id = gl_VertexID;
  if (id < 6) {
    bool is_far = id == 1 || id == 2 || id == 4;
    bool is_left = id == 0 || id == 1 || id == 3;
    return vec2(is_far ? long_px - head : -u_rim, (u_width * 0.5 + u_rim) * (is_left ? 1.0 : -1.0));
  }
  if (id == 8) return vec2(long_px + u_rim * 2.0, 0.0);
  return vec2(long_px - head - u_rim, (u_width * 1.7 + u_rim * 1.6) * (id == 6 ? 1.0 : -1.0));
}
void main() {
  vec4 a = u_view_projection * vec4(a_from, 1.0);
  vec4 b = u_view_projection * vec4(a_to, 1.0);
  gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
  if (a.w < u_near && b.w < u_near) return;
  if (a.w < u_near) a = mix(a, b, (u_near - a.w) / (b.w - a.w));
  if (b.w < u_near) b = mix(b, a, (u_near - b.w) / (a.w - b.w));
  vec2 pa = (a.xy / a.w * 0.5 + 0.5) * u_viewport;
  vec2 pb = (b.xy / b.w * 0.5 + 0.5) * u_viewport;
  float long_px = length(pb - pa);
  // A force along the view has no direction on the screen.
  if (long_px < 0.5) return;
  vec2 along = (pb - pa) / long_px;
  vec2 at = shape(long_px);
  vec2 pixel = pa + along * at.x + vec2(-along.y, along.x) * at.y;
  gl_Position = vec4(pixel / u_viewport * 2.0 - 1.0, 0.0, 1.0);
}
`;

const FRAGMENT = `${HEADER}${SCREEN}
uniform vec3 u_color;
void main() { o_color = screen(u_color, 1.0); }
`;

export class Arrows {
  /** @param {WebGL2RenderingContext} gl */
  constructor(gl) {
    this.gl = gl;
    this.program = new Program(gl, VERTEX, FRAGMENT);
    this.vao = gl.createVertexArray();
    this.buffer = gl.createBuffer();
    this.count = 0;
    gl.bindVertexArray(this.vao);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffer);
    for (const location of [0, 1]) {
      gl.enableVertexAttribArray(location);
      gl.vertexAttribPointer(location, 3, gl.FLOAT, false, FLOATS * 4, location * 12);
      gl.vertexAttribDivisor(location, 1);
    }
    gl.bindVertexArray(null);
  }

  /** @param {import("../state/forces.js").Arrow[]} arrows @param {number} unitsPerNewton */
  set(arrows, unitsPerNewton) {
    const { gl } = this;
    this.count = arrows.length;
    if (this.count === 0) return;
    const ends = new Float32Array(arrows.length * FLOATS);
    arrows.forEach(({ from, force }, k) => {
      ends.set(from, k * FLOATS);
      for (let axis = 0; axis < 3; axis++) ends[k * FLOATS + 3 + axis] = from[axis] + force[axis] * unitsPerNewton;
    });
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffer);
    gl.bufferData(gl.ARRAY_BUFFER, ends, gl.DYNAMIC_DRAW);
  }

  /** Draws each arrow on a rim, so that it is visible on any background.
   * @param {{ width: number, rim: number, color: number[], rimColor: number[] }} style sizes in device pixels */
  draw({ width, rim, color, rimColor }) {
    if (this.count === 0) return;
    const { gl } = this;
    gl.disable(gl.DEPTH_TEST);
    this.program.use();
    gl.bindVertexArray(this.vao);
    for (const pass of [{ u_rim: rim, u_color: rimColor }, { u_rim: 0, u_color: color }]) {
      this.program.set({ u_width: width, ...pass });
      gl.drawArraysInstanced(gl.TRIANGLES, 0, VERTICES, this.count);
    }
    gl.bindVertexArray(null);
  }
}
