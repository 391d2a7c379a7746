// Particles as small balls; marks of pinned, anchored, grabbed and frozen particles as discs with a white ring.

import { Program, UNITS } from "../context.js";
import { HEADER, HEAT, PAINT, SCREEN, VALUES, positionReader } from "../shaders.js";

/** Styles of a point, as the shader numbers them. */
export const POINT = Object.freeze({ particle: 0, pin: 1, anchor: 2, grabbed: 3, frozen: 4 });

/** Words of a point: particle, style. */
const WORDS = 2;

/** @param {boolean} isQuantised */
const vertex = (isQuantised) => `${HEADER}
layout(location = 0) in uint a_particle;
layout(location = 1) in uint a_style;
uniform float u_radius;
uniform float u_radius_min;
uniform float u_forward;
flat out uint v_style;
flat out float v_diameter;
flat out float v_speed;
out float v_height;
${positionReader(isQuantised)}${VALUES}
void main() {
  vec3 at = position(a_particle);
  vec4 clip = u_view_projection * vec4(at, 1.0);
  float radius = max(u_radius_min, u_radius * u_pixels_per_unit / clip.w);
  if (a_style != ${POINT.particle}u) radius *= a_style == ${POINT.grabbed}u ? 1.35 : 1.0;
  v_style = a_style;
  v_speed = u_paint == ${PAINT.speeds.toFixed(1)} ? speed(a_particle) : 0.0;
  v_diameter = radius * 2.0 + 1.0;
  v_height = dot(u_ground.xyz, at) - u_ground.w;
  gl_PointSize = v_diameter;
  gl_Position = clip - vec4(0.0, 0.0, u_forward * clip.w, 0.0);
}
`;

const FRAGMENT = `${HEADER}${SCREEN}${HEAT}
flat in uint v_style;
flat in float v_diameter;
flat in float v_speed;
in float v_height;
uniform float u_round;
void main() {
  vec2 at = gl_PointCoord * 2.0 - 1.0;
  float away = length(at);
  float soft = 2.0 / v_diameter;
  float alpha = 1.0 - smoothstep(1.0 - soft, 1.0, away);
  if (u_shadow > 0.0) {
    if (alpha < 0.5 || v_height < 0.0) discard;
    o_color = vec4(0.0, 0.0, 0.0, u_shadow);
    return;
  }
  if (alpha < 0.03) discard;
  if (v_style == ${POINT.particle}u) {
    float up = sqrt(max(0.0, 1.0 - away * away));
    float light = 0.5 + 0.6 * max(0.0, dot(vec3(at.x, -at.y, up), normalize(vec3(-0.4, 0.6, 0.8))));
    vec3 base = u_paint == ${PAINT.speeds.toFixed(1)} ? heat(v_speed, 1.0) : u_particle;
    o_color = screen(base * mix(1.0, light, u_round * smoothstep(5.0, 9.0, v_diameter)), alpha);
    return;
  }
  // A small mark is all disc: rings side by side would be a white bar.
  float ring = smoothstep(0.62 - soft, 0.62, away) * smoothstep(6.0, 10.0, v_diameter);
  o_color = screen(mix(u_marks[int(v_style) - 1], u_ring, ring), alpha);
}
`;

export class Points {
  /** @param {WebGL2RenderingContext} gl @param {boolean} isQuantised */
  constructor(gl, isQuantised) {
    this.gl = gl;
    this.program = new Program(gl, vertex(isQuantised), FRAGMENT);
    this.program.setSamplers(UNITS);
    this.particles = new PointList(gl);
    this.marks = new PointList(gl);
    this.grabbed = new PointList(gl);
  }

  /** @param {PointList} list @param {import("../context.js").Uniforms} sceneStyle @param {import("../context.js").Uniforms} style */
  draw(list, sceneStyle, style) {
    if (list.count === 0) return;
    const { gl } = this;
    this.program.use();
    this.program.set(sceneStyle, style);
    gl.bindVertexArray(list.vao);
    gl.drawArrays(gl.POINTS, 0, list.count);
    gl.bindVertexArray(null);
  }
}

export class PointList {
  /** @param {WebGL2RenderingContext} gl */
  constructor(gl) {
    this.gl = gl;
    this.vao = gl.createVertexArray();
    this.buffer = gl.createBuffer();
    this.count = 0;
    gl.bindVertexArray(this.vao);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffer);
    for (const location of [0, 1]) {
      gl.enableVertexAttribArray(location);
      gl.vertexAttribIPointer(location, 1, gl.UNSIGNED_INT, WORDS * 4, location * 4);
    }
    gl.bindVertexArray(null);
  }

  /** @param {Uint32Array} words particle and style of each point */
  set(words) {
    this.gl.bindBuffer(this.gl.ARRAY_BUFFER, this.buffer);
    this.gl.bufferData(this.gl.ARRAY_BUFFER, words, this.gl.DYNAMIC_DRAW);
    this.count = words.length / WORDS;
  }
}
