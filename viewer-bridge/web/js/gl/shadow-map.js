// The shadow map: the depths of the scene as the light sees it. The light counts as distant.

import { add, dot, length, multiply, scale, scaleThenMove, subtract, tangents } from "../geometry/math.js";
import { UNITS } from "./context.js";

/** @typedef {import("../geometry/math.js").Vec3} Vec3 */
/** @typedef {import("../geometry/math.js").Box} Box */
/** @typedef {import("../geometry/math.js").Mat4} Mat4 */
/** `clip` takes a point to the picture of the light, `map` to the map, both with depth. `texel` is the size of a texel in the scene.
 * @typedef {{ clip: Mat4, map: Mat4, texel: number, size: number }} LightView */

/** Texels along each side of the map. */
export const MAP_SIZE = 2048;
/** Margin around the box, as a fraction of its radius. */
const MARGIN = 0.02;
/** From -1..=1 of the picture of the light to 0..=1 of the map. */
const TO_MAP = scaleThenMove([0.5, 0.5, 0.5], [0.5, 0.5, 0.5]);

/** The view of a distant light onto a box. @param {Vec3} light direction towards the light @param {Box} box @returns {LightView} */
export function lightView(light, box) {
  const middle = scale(add(box.min, box.max), 0.5);
  const radius = Math.max(length(subtract(box.max, box.min)) / 2, 1e-6) * (1 + MARGIN);
  const [x, y] = tangents(light);
  const z = scale(light, -1);
  // Rows of the matrix: the axes of the light, so that the depth grows away from it.
  const clip = [
    x[0] / radius, y[0] / radius, z[0] / radius, 0, x[1] / radius, y[1] / radius, z[1] / radius, 0,
    x[2] / radius, y[2] / radius, z[2] / radius, 0, -dot(x, middle) / radius, -dot(y, middle) / radius, -dot(z, middle) / radius, 1,
  ];
  return { clip, map: multiply(TO_MAP, clip), texel: (2 * radius) / MAP_SIZE, size: radius };
}

/** The part of a box within a reach of a point, along each axis; null if there is none. @param {Box} box @param {Vec3} middle @param {number} reach @returns {Box | null} */
export function clipBox({ min, max }, middle, reach) {
  /** @type {Box} */
  const near = { min: [0, 0, 0], max: [0, 0, 0] };
  for (let axis = 0; axis < 3; axis++) {
    near.min[axis] = Math.max(min[axis], middle[axis] - reach);
    near.max[axis] = Math.min(max[axis], middle[axis] + reach);
    if (near.min[axis] > near.max[axis]) return null;
  }
  return near;
}

export class ShadowMap {
  /** @param {WebGL2RenderingContext} gl */
  constructor(gl) {
    this.gl = gl;
    this.texture = this.depthTexture(MAP_SIZE);
    /** Bound in place of the map while that is drawn: no texture can be read and drawn to at the same time. */
    this.substitute = this.depthTexture(1);
    this.framebuffer = gl.createFramebuffer();
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.framebuffer);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.TEXTURE_2D, this.texture, 0);
    gl.drawBuffers([gl.NONE]);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  }

  /** @param {number} size */
  depthTexture(size) {
    const { gl } = this;
    const texture = gl.createTexture();
    this.bind(texture);
    gl.texStorage2D(gl.TEXTURE_2D, 1, gl.DEPTH_COMPONENT24, size, size);
    for (const [parameter, value] of [
      [gl.TEXTURE_MIN_FILTER, gl.LINEAR], [gl.TEXTURE_MAG_FILTER, gl.LINEAR], [gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE], [gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE],
      [gl.TEXTURE_COMPARE_MODE, gl.COMPARE_REF_TO_TEXTURE], [gl.TEXTURE_COMPARE_FUNC, gl.LEQUAL],
    ]) gl.texParameteri(gl.TEXTURE_2D, parameter, value);
    return texture;
  }

  /** @param {WebGLTexture | null} texture */
  bind(texture) {
    this.gl.activeTexture(this.gl.TEXTURE0 + UNITS.u_shadow_map);
    this.gl.bindTexture(this.gl.TEXTURE_2D, texture);
  }

  /** Draws the bodies that cast shadows into the map. @param {() => void} drawBodies */
  draw(drawBodies) {
    const { gl } = this;
    this.bind(this.substitute);
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.framebuffer);
    gl.viewport(0, 0, MAP_SIZE, MAP_SIZE);
    gl.enable(gl.DEPTH_TEST);
    gl.depthFunc(gl.LEQUAL);
    gl.depthMask(true);
    gl.clear(gl.DEPTH_BUFFER_BIT);
    // Surfaces that the light grazes need more room than those that face it.
    gl.enable(gl.POLYGON_OFFSET_FILL);
    gl.polygonOffset(1.5, 2);
    drawBodies();
    gl.disable(gl.POLYGON_OFFSET_FILL);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    this.bind(this.texture);
  }
}
