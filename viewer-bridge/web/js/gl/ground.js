// The background: a soft backdrop, and a ground. The lines of the ground are computed per pixel, so
// they neither flicker at the horizon nor end at an edge.

import { addScaled, dot, tangents } from "../geometry/math.js";
import { Program, UNITS } from "./context.js";
import { BLUR, CORNER, HEADER, SCREEN, sunlight } from "./shaders.js";

/** Size of the ground, in radii of the scene; it fades out towards its edge. */
const SIZE_RADII = 6;

const BACKDROP_VERTEX = `${HEADER}${CORNER}
out vec2 v_at;
void main() { v_at = corner(); gl_Position = vec4(v_at, 0.999, 1.0); }
`;

const BACKDROP_FRAGMENT = `${HEADER}${SCREEN}
in vec2 v_at;
uniform vec3 u_top;
uniform vec3 u_bottom;
void main() {
  vec3 color = mix(u_bottom, u_top, smoothstep(-0.9, 1.0, v_at.y));
  // Noise below one 8-bit step, so that wide gradients show no bands.
  float grain = fract(sin(dot(gl_FragCoord.xy, vec2(12.9898, 78.233))) * 43758.5453) - 0.5;
  o_color = screen(color, 1.0) + vec4(vec3(grain / 255.0), 0.0);
}
`;

const GROUND_VERTEX = `${HEADER}${CORNER}
uniform vec3 u_middle;
uniform vec3 u_along;
uniform vec3 u_across;
uniform float u_size;
out vec2 v_at;
out vec3 v_position;
void main() {
  v_at = corner() * u_size;
  vec3 at = u_middle + u_along * v_at.x + u_across * v_at.y;
  v_position = at;
  gl_Position = u_view_projection * vec4(at, 1.0);
}
`;

/** Grid lines at two spacings, a factor of ten apart. The finer ones fade out before they merge. */
const groundFragment = (/** @type {boolean} */ hasEffects) => `${HEADER}${SCREEN}${sunlight(hasEffects)}
in vec2 v_at;
in vec3 v_position;
uniform vec3 u_normal;
uniform float u_darkness;
uniform vec2 u_shift;
uniform vec3 u_fill;
uniform vec3 u_line;
uniform float u_size;
uniform float u_spacing;
uniform float u_contrast;
float lines(float spacing) {
  vec2 cell = (v_at + u_shift) / spacing;
  vec2 width = fwidth(cell);
  vec2 away = abs(fract(cell - 0.5) - 0.5);
  vec2 line = 1.0 - smoothstep(width * 0.4, width * 1.4, away);
  vec2 calm = 1.0 - smoothstep(0.06, 0.35, width);
  return max(line.x * calm.x, line.y * calm.y);
}
void main() {
  float fade = 1.0 - smoothstep(0.08, 1.0, length(v_at) / u_size);
  float line = u_contrast * max(lines(u_spacing * 10.0), lines(u_spacing) * 0.5);
  o_color = screen(mix(u_fill, u_line, line), fade * fade);
  o_color.rgb *= 1.0 - u_darkness * (1.0 - sunlight(v_position, u_normal, ${BLUR.ground}));
}
`;

export class Ground {
  /** @param {WebGL2RenderingContext} gl @param {boolean} hasEffects */
  constructor(gl, hasEffects) {
    this.gl = gl;
    this.backdrop = new Program(gl, BACKDROP_VERTEX, BACKDROP_FRAGMENT);
    this.program = new Program(gl, GROUND_VERTEX, groundFragment(hasEffects));
    this.program.setSamplers(UNITS);
    this.vao = gl.createVertexArray();
  }

  /** @param {import("./context.js").Uniforms} uniforms */
  drawBackdrop(uniforms) {
    this.quad(this.backdrop, uniforms);
  }

  /** Draws a plane as a patch of ground that fades out, with grid lines at round coordinates.
   * @param {import("../state/simulation.js").Plane} plane @param {import("../geometry/camera.js").Camera} camera @param {number} sceneRadius @param {import("./theme.js").Palette} palette */
  drawPlane({ normal, offset }, camera, sceneRadius, palette) {
    const middle = addScaled(camera.target, normal, offset - dot(normal, camera.target));
    const [along, across] = tangents(normal);
    const spacing = 10 ** Math.floor(Math.log10(camera.distance * 0.16));
    const period = spacing * 10;
    const shift = [along, across].map((axis) => ((dot(axis, middle) % period) + period) % period);
    this.quad(this.program, {
      u_middle: middle, u_along: along, u_across: across, u_size: Math.max(sceneRadius, camera.distance * 0.4) * SIZE_RADII, u_shift: shift, u_spacing: spacing,
      u_fill: palette.ground, u_line: palette.gridLine, u_contrast: palette.gridContrast, u_normal: normal, u_darkness: palette.shadow,
    });
  }

  /** @param {Program} program @param {import("./context.js").Uniforms} uniforms */
  quad(program, uniforms) {
    const { gl } = this;
    program.use();
    program.set(uniforms);
    gl.bindVertexArray(this.vao);
    gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
    gl.bindVertexArray(null);
  }
}
