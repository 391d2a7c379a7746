// The uniforms that all draws of a pass share, in one block. A picture writes them in place and uploads them
// once per pass. Setting each of them in every program would make garbage and take most of the time of a draw.
// Those outside of the block are called plain.

import { HEAT_STOPS, KIND_COLORS } from "./theme.js";

/** Place of a member in a block, in bytes. @typedef {{ offset: number, size: number }} Place */
/** @typedef {keyof typeof MEMBERS} Member */
/** A number, a vector, a matrix, or a list of vectors. @typedef {number | ArrayLike<number> | number[][]} Value */

/** The members with their GLSL types. A number after a vec3 fills the gap that the next vec3 would otherwise leave. `u_shadow` is 0 but in passes that draw shadows. */
const MEMBERS = Object.freeze(/** @type {const} */ ({
  u_view_projection: "mat4",
  u_eye: "vec3", u_near: "float",
  u_right: "vec3", u_pixels_per_unit: "float",
  u_upward: "vec3", u_shadow: "float",
  u_viewport: "vec2", u_is_solid: "float", u_paint: "float",
  u_lo: "vec3", u_particle_count: "float",
  u_scale: "vec3", u_thread: "float",
  u_up: "vec3", u_heat_low: "float",
  u_ground: "vec4",
  u_to_shadow_map: "mat4",
  u_lamp: "vec3", u_texel: "float",
  u_sky: "vec3", u_key: "float",
  u_bounce: "vec3", u_heat_high: "float",
  u_unknown: "vec3", u_front: "vec3", u_back: "vec3", u_stick: "vec3", u_stick_faint: "vec3",
  u_particle: "vec3", u_ring: "vec3", u_wood: "vec3", u_body: "vec3",
  u_marks: "vec3[4]", u_heat_stops: `vec3[${HEAT_STOPS.length}]`, u_kinds: `vec3[${KIND_COLORS.length}]`,
}));

/** Name and binding point of the block. */
export const BLOCK = Object.freeze({ name: "Shared", binding: 0 });

/** The block in GLSL. It needs the default precisions before it, which both stages of a program must share. */
export const BLOCK_SOURCE = `layout(std140) uniform ${BLOCK.name} {
${Object.entries(MEMBERS).map(([name, type]) => `  ${type} ${name};\n`).join("")}};
`;

/** Size and alignment of the GLSL types, in bytes (OpenGL ES 3.0, section 2.12.6.4). @type {Record<string, { size: number, alignment: number }>} */
const TYPES = {
  float: { size: 4, alignment: 4 }, vec2: { size: 8, alignment: 8 }, vec3: { size: 12, alignment: 16 },
  vec4: { size: 16, alignment: 16 }, mat4: { size: 64, alignment: 16 },
};
/** Alignment of arrays, of their elements, and of the block itself, in bytes. */
const WIDE = 16;
/** Bytes of a number. */
const FLOAT = Float32Array.BYTES_PER_ELEMENT;

/** The least multiple of `alignment` that is at least `value`. @param {number} value @param {number} alignment */
const alignUp = (value, alignment) => Math.ceil(value / alignment) * alignment;

/** @param {string} type "vec3", or "vec3[4]" for an array */
function extentOf(type) {
  const [element, count] = type.split(/[[\]]/);
  const { size, alignment } = TYPES[element];
  return count === undefined ? { size, alignment } : { size: Number(count) * alignUp(size, WIDE), alignment: WIDE };
}

/** Places the members of a block by the rules of std140. @param {Record<string, string>} members GLSL types by name @returns {{ places: Map<string, Place>, size: number }} */
export function std140(members) {
  /** @type {Map<string, Place>} */
  const places = new Map();
  let end = 0;
  for (const [name, type] of Object.entries(members)) {
    const { size, alignment } = extentOf(type);
    const offset = alignUp(end, alignment);
    places.set(name, { offset, size });
    end = offset + size;
  }
  return { places, size: alignUp(end, WIDE) };
}

const LAYOUT = std140(MEMBERS);

/** The values of the block in one pass, and their buffer. */
export class SharedUniforms {
  /** @param {WebGL2RenderingContext} gl */
  constructor(gl) {
    this.gl = gl;
    this.numbers = new Float32Array(LAYOUT.size / FLOAT);
    const views = [...LAYOUT.places].map(([name, { offset, size }]) => [name, this.numbers.subarray(offset / FLOAT, (offset + size) / FLOAT)]);
    /** The members as views of `numbers`, to write in place. */
    this.members = /** @type {Readonly<Record<Member, Float32Array>>} */ (Object.freeze(Object.fromEntries(views)));
    /** @type {WebGLBuffer | null} */
    this.buffer = null;
  }

  /** Creates the buffer: at first, and again after the context was lost. The values stay. */
  create() {
    const { gl } = this;
    this.buffer = gl.createBuffer();
    gl.bindBuffer(gl.UNIFORM_BUFFER, this.buffer);
    gl.bufferData(gl.UNIFORM_BUFFER, this.numbers, gl.DYNAMIC_DRAW);
  }

  /** Writes some members. @param {Partial<Record<Member, Value>>} values */
  write(values) {
    // Object.entries would allocate.
    for (const name in values) this.writeMember(this.members[/** @type {Member} */ (name)], /** @type {Value} */ (values[/** @type {Member} */ (name)]));
  }

  /** @param {Float32Array} member @param {Value} value */
  writeMember(member, value) {
    if (typeof value === "number") member[0] = value;
    // An element of an array takes 16 bytes, as a vec4 does.
    else if (Array.isArray(value[0])) /** @type {number[][]} */ (value).forEach((vector, k) => member.set(vector, (k * WIDE) / FLOAT));
    else member.set(/** @type {ArrayLike<number>} */ (value));
  }

  /** Copies the values of another pass. @param {SharedUniforms} other */
  copyFrom(other) {
    this.numbers.set(other.numbers);
  }

  /** Uploads the values, for all draws until another block is bound. */
  upload() {
    this.bind();
    this.gl.bufferSubData(this.gl.UNIFORM_BUFFER, 0, this.numbers);
  }

  /** Binds the uploaded values for the next draws. */
  bind() {
    this.gl.bindBufferBase(this.gl.UNIFORM_BUFFER, BLOCK.binding, this.buffer);
  }
}
