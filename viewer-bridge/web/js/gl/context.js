// Opening WebGL2, compiling programs, and textures that hold arrays.

/** @typedef {WebGL2RenderingContext} GL */

/** Texels of a row of an array texture; every WebGL2 device takes this width. */
export const ROW = 1024;

/**
 * The context of a canvas, or null where the browser has none. Opaque: a ground that fades out must
 * show the backdrop, not the page.
 * @param {HTMLCanvasElement} canvas @param {boolean} antialias
 */
export const openContext = (canvas, antialias) =>
  canvas.getContext("webgl2", { alpha: false, antialias, depth: true, stencil: true, powerPreference: "high-performance" });

/** What draws: for tests, that must know whether it is a software renderer. @param {GL} gl @returns {string} */
export function rendererName(gl) {
  const extension = gl.getExtension("WEBGL_debug_renderer_info");
  return String(gl.getParameter(extension ? extension.UNMASKED_RENDERER_WEBGL : gl.RENDERER));
}

/** A linked program, with the places of its uniforms looked up once. */
export class Program {
  /** @param {GL} gl @param {string} vertex @param {string} fragment */
  constructor(gl, vertex, fragment) {
    this.gl = gl;
    this.handle = link(gl, vertex, fragment);
    /** @type {Map<string, WebGLUniformLocation>} */
    this.places = new Map();
    const count = gl.getProgramParameter(this.handle, gl.ACTIVE_UNIFORMS);
    for (let index = 0; index < count; index++) {
      const uniform = gl.getActiveUniform(this.handle, index);
      const place = uniform && gl.getUniformLocation(this.handle, uniform.name);
      if (uniform && place) this.places.set(uniform.name.replace("[0]", ""), place);
    }
  }

  use() {
    this.gl.useProgram(this.handle);
  }

  /** Sets uniforms by the length of their values; a name that the compiler removed is passed over.
   * @param {Record<string, number | number[]>} values */
  set(values) {
    const { gl } = this;
    for (const [name, value] of Object.entries(values)) {
      const place = this.places.get(name);
      if (place === undefined) continue;
      if (typeof value === "number") gl.uniform1f(place, value);
      else if (value.length === 2) gl.uniform2fv(place, value);
      else if (value.length === 3) gl.uniform3fv(place, value);
      else if (value.length === 4) gl.uniform4fv(place, value);
      else if (value.length === 16) gl.uniformMatrix4fv(place, false, value);
      else gl.uniform3fv(place, value);
    }
  }

  /** Says which texture unit each sampler reads. @param {Record<string, number>} units */
  samplers(units) {
    this.use();
    for (const [name, unit] of Object.entries(units)) {
      const place = this.places.get(name);
      if (place !== undefined) this.gl.uniform1i(place, unit);
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

/** How a texture stores its texels: internal format, format, type, and numbers in a texel.
 * @typedef {{ internal: number, format: number, type: number, width: number }} Layout */

/** @param {GL} gl @returns {Record<"u16x3" | "f32x3" | "u32x2" | "u32x4", Layout>} */
export const layouts = (gl) => ({
  u16x3: { internal: gl.RGB16UI, format: gl.RGB_INTEGER, type: gl.UNSIGNED_SHORT, width: 3 },
  f32x3: { internal: gl.RGB32F, format: gl.RGB, type: gl.FLOAT, width: 3 },
  u32x2: { internal: gl.RG32UI, format: gl.RG_INTEGER, type: gl.UNSIGNED_INT, width: 2 },
  u32x4: { internal: gl.RGBA32UI, format: gl.RGBA_INTEGER, type: gl.UNSIGNED_INT, width: 4 },
});

/** An array in a texture, `ROW` elements a row: what vertex shaders read by index. */
export class ArrayTexture {
  /** @param {GL} gl @param {number} unit that it stays bound to @param {Layout} layout @param {number} count elements */
  constructor(gl, unit, layout, count) {
    this.gl = gl;
    this.unit = unit;
    this.layout = layout;
    this.count = count;
    this.handle = gl.createTexture();
    this.bind();
    gl.texStorage2D(gl.TEXTURE_2D, 1, layout.internal, ROW, Math.max(1, Math.ceil(count / ROW)));
    for (const [parameter, value] of [
      [gl.TEXTURE_MIN_FILTER, gl.NEAREST], [gl.TEXTURE_MAG_FILTER, gl.NEAREST],
      [gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE], [gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE],
    ]) gl.texParameteri(gl.TEXTURE_2D, parameter, value);
  }

  bind() {
    this.gl.activeTexture(this.gl.TEXTURE0 + this.unit);
    this.gl.bindTexture(this.gl.TEXTURE_2D, this.handle);
  }

  /** Writes the elements from `first` to before `end`, whole rows at a time.
   * @param {ArrayBufferView} array @param {number} [first] @param {number} [end] */
  write(array, first = 0, end = this.count) {
    this.bind();
    this.gl.pixelStorei(this.gl.UNPACK_ALIGNMENT, 1);
    const firstRow = Math.floor(first / ROW);
    const fullRows = Math.floor(Math.min(end + ROW - 1, this.count) / ROW) - firstRow;
    if (fullRows > 0) this.writeRows(array, firstRow, fullRows, ROW);
    const lastRow = firstRow + Math.max(fullRows, 0);
    const rest = this.count - lastRow * ROW;
    // The last row is not full, and its rest is not in the array.
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
