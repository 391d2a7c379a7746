// WebGL2 basics: opening a context, compiling programs, and textures that hold arrays.

import { BLOCK } from "./uniforms.js";

/** @typedef {WebGL2RenderingContext} GL */
/** Values of plain uniforms by name. @typedef {Record<string, number | number[]>} Uniforms */

/** Texels per row of an array texture; every WebGL2 device supports this width. */
export const ROW = 1024;

/** Texture units by the samplers of the shaders. */
export const UNITS = Object.freeze({ u_positions: 0, u_fan_ranges: 1, u_fans: 2, u_splits: 3, u_flat_places: 4, u_shadow_map: 5, u_speeds: 6 });
/** Unit for uploads. No shader reads it, so an upload never changes what a draw reads. */
const UPLOAD_UNIT = Object.keys(UNITS).length;

/**
 * Opens the WebGL2 context of a canvas; null if the browser has no WebGL2. The canvas is opaque, because
 * the ground must fade into the backdrop, not into the page.
 * @param {HTMLCanvasElement} canvas @param {boolean} antialias
 */
export const openContext = (canvas, antialias) =>
  canvas.getContext("webgl2", { alpha: false, antialias, depth: true, stencil: true, powerPreference: "high-performance" });

/** Name of the renderer. Tests use it to detect a software renderer. @param {GL} gl @returns {string} */
export function rendererName(gl) {
  const extension = gl.getExtension("WEBGL_debug_renderer_info");
  return String(gl.getParameter(extension ? extension.UNMASKED_RENDERER_WEBGL : gl.RENDERER));
}

/** Variant of the shaders: they read quantised positions, and draw shadows, weave and solid bodies.
 * @typedef {{ isQuantised: boolean, hasEffects: boolean }} Variant */

/** True for a renderer without a graphics processor, for which effects are too slow. @param {string} name */
export const isSoftware = (name) => /swiftshader|llvmpipe|lavapipe|softpipe|software|basic render/i.test(name);

/** @type {Uniforms} */
const NONE = {};

/** A linked program, with the locations of its plain uniforms. The shared ones are in a block (uniforms.js). */
export class Program {
  /** @param {GL} gl @param {string} vertex @param {string} fragment */
  constructor(gl, vertex, fragment) {
    this.gl = gl;
    this.handle = link(gl, vertex, fragment);
    /** @type {Map<string, WebGLUniformLocation>} */
    this.locations = new Map();
    /** The names of the uniforms, for loops that must not allocate. @type {string[]} */
    this.names = [];
    const count = gl.getProgramParameter(this.handle, gl.ACTIVE_UNIFORMS);
    for (let index = 0; index < count; index++) {
      const uniform = gl.getActiveUniform(this.handle, index);
      const location = uniform && gl.getUniformLocation(this.handle, uniform.name);
      if (uniform && location) this.locations.set(uniform.name.replace("[0]", ""), location);
    }
    this.names = [...this.locations.keys()];
    const block = gl.getUniformBlockIndex(this.handle, BLOCK.name);
    // Some drivers drop a block that no shader reads.
    if (block !== gl.INVALID_INDEX) gl.uniformBlockBinding(this.handle, block, BLOCK.binding);
  }

  use() {
    this.gl.useProgram(this.handle);
  }

  /** Sets the uniforms that have a value, choosing the type by its length. Values of `own` take precedence.
   * @param {Uniforms} values @param {Uniforms} own */
  set(values, own = NONE) {
    const { gl } = this;
    // By index: an iterator would allocate.
    for (let index = 0; index < this.names.length; index++) {
      const name = this.names[index];
      const value = own[name] ?? values[name];
      if (value === undefined) continue;
      const location = this.locations.get(name) ?? null;
      if (typeof value === "number") gl.uniform1f(location, value);
      else if (value.length === 2) gl.uniform2fv(location, value);
      else if (value.length === 3) gl.uniform3fv(location, value);
      else if (value.length === 4) gl.uniform4fv(location, value);
      else if (value.length === 16) gl.uniformMatrix4fv(location, false, value);
      else gl.uniform3fv(location, value);
    }
  }

  /** Assigns a texture unit to each sampler. @param {Record<string, number>} units */
  setSamplers(units) {
    this.use();
    for (const [name, unit] of Object.entries(units)) {
      const location = this.locations.get(name);
      if (location !== undefined) this.gl.uniform1i(location, unit);
    }
  }
}

/** @param {GL} gl @param {string} vertex @param {string} fragment */
function link(gl, vertex, fragment) {
  const program = gl.createProgram();
  for (const [type, source] of /** @type {const} */ ([[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]])) {
    const shader = /** @type {WebGLShader} */ (gl.createShader(type));
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
    gl.deleteShader(shader);
  }
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS) && !gl.isContextLost()) {
    const logs = (gl.getAttachedShaders(program) ?? []).map((shader) => gl.getShaderInfoLog(shader));
    throw new Error(`shader: ${gl.getProgramInfoLog(program)} ${logs.join(" ")}`);
  }
  return program;
}

/** Storage of the texels of a texture: internal format, format, type, and components per texel.
 * @typedef {{ internal: number, format: number, type: number, width: number }} Layout */

/** @param {GL} gl @returns {Record<"u16x3" | "f32x3" | "f32x2" | "f32x1" | "u32x2" | "u32x4", Layout>} */
export const layouts = (gl) => ({
  u16x3: { internal: gl.RGB16UI, format: gl.RGB_INTEGER, type: gl.UNSIGNED_SHORT, width: 3 },
  f32x3: { internal: gl.RGB32F, format: gl.RGB, type: gl.FLOAT, width: 3 },
  f32x2: { internal: gl.RG32F, format: gl.RG, type: gl.FLOAT, width: 2 },
  f32x1: { internal: gl.R32F, format: gl.RED, type: gl.FLOAT, width: 1 },
  u32x2: { internal: gl.RG32UI, format: gl.RG_INTEGER, type: gl.UNSIGNED_INT, width: 2 },
  u32x4: { internal: gl.RGBA32UI, format: gl.RGBA_INTEGER, type: gl.UNSIGNED_INT, width: 4 },
});

/** An array in a texture, `ROW` elements per row. Vertex shaders read it by index, from its unit, once it is bound. */
export class ArrayTexture {
  /** @param {GL} gl @param {number} unit texture unit of its sampler @param {Layout} layout @param {number} count elements */
  constructor(gl, unit, layout, count) {
    this.gl = gl;
    this.unit = unit;
    this.layout = layout;
    this.count = count;
    this.handle = gl.createTexture();
    this.bindTo(UPLOAD_UNIT);
    gl.texStorage2D(gl.TEXTURE_2D, 1, layout.internal, ROW, Math.max(1, Math.ceil(count / ROW)));
    for (const [parameter, value] of [
      [gl.TEXTURE_MIN_FILTER, gl.NEAREST], [gl.TEXTURE_MAG_FILTER, gl.NEAREST],
      [gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE], [gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE],
    ]) gl.texParameteri(gl.TEXTURE_2D, parameter, value);
  }

  /** Makes the next draws read it. */
  bind() {
    this.bindTo(this.unit);
  }

  /** @param {number} unit */
  bindTo(unit) {
    this.gl.activeTexture(this.gl.TEXTURE0 + unit);
    this.gl.bindTexture(this.gl.TEXTURE_2D, this.handle);
  }

  /** Uploads the elements in first..end, as whole rows.
   * @param {ArrayBufferView} array @param {number} [first] @param {number} [end] */
  write(array, first = 0, end = this.count) {
    this.bindTo(UPLOAD_UNIT);
    this.gl.pixelStorei(this.gl.UNPACK_ALIGNMENT, 1);
    const firstRow = Math.floor(first / ROW);
    const fullRows = Math.floor(Math.min(end + ROW - 1, this.count) / ROW) - firstRow;
    if (fullRows > 0) this.writeRows(array, firstRow, fullRows, ROW);
    const lastRow = firstRow + Math.max(fullRows, 0);
    const rest = this.count - lastRow * ROW;
    // The array ends within the last row.
    if (end > lastRow * ROW && rest > 0) this.writeRows(array, lastRow, 1, Math.min(rest, ROW));
  }

  /** @param {ArrayBufferView} array @param {number} row @param {number} rows @param {number} columns */
  writeRows(array, row, rows, columns) {
    const { gl, layout } = this;
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, row, columns, rows, layout.format, layout.type, array, row * ROW * layout.width);
  }

  delete() {
    this.gl.deleteTexture(this.handle);
  }
}
