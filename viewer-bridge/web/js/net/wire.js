// Decodes the binary messages of the bridge, as viewer-bridge/PROTOCOL.md defines them. No other
// module knows an offset. Arrays are views into the message, not copies.

/** @typedef {import("../geometry/math.js").Vec3} Vec3 */

/** The header of every message. `step` is exact: the protocol keeps it below 2^53.
 * @typedef {{ version: number, epoch: number, step: number }} Header */

/**
 * @typedef {Header & {
 *   kind: "scene", particleCount: number, constraintCount: number, triangleCount: number,
 *   isPlanar: boolean,
 *   min: Vec3, max: Vec3, rateHz: number, origin: Vec3,
 *   positions: Float32Array, ends: Uint32Array, restLengths: Float32Array, triangles: Uint32Array,
 *   constraintKinds: Uint8Array, name: string, unit: string, up: string, runId: string,
 *   meshes: Map<number, ColliderMesh>, shapes: Shape[], hasExplicitBends: boolean, anchors: number[][], compliances: Float32Array,
 * }} Scene  array lengths for n particles, s constraints and t triangles: 3 n, 2 s, s, 3 t, s; compliances: s, or stiffness in pbd; anchors: the particles of each
 *
 * @typedef {{ shape: string, first: number, count: number, has_bends?: boolean }} Shape  a generated shape, with its particles
 *
 * @typedef {Header & {
 *   kind: "frame", simTime: number, particleCount: number,
 *   isPaused: boolean, isReplay: boolean, isSaturated: boolean,
 *   lo: Vec3, scale: Vec3, bounds: import("../geometry/math.js").Box, tornCount: number, solveUs: number, wakeLateUs: number,
 *   number: number, publishedNs: bigint, isQuantised: boolean,
 *   positions: Float32Array | Uint16Array, nonFinite: Uint32Array,
 * }} Frame  coordinate = lo + scale · value; lo is 0 and scale 1 unless quantised; bounds is a box around them
 *
 * @typedef {Header & { kind: "tear", first: number, constraints: Uint32Array, causes: Uint8Array }} Tear
 * @typedef {Header & { kind: "pins", particles: Uint32Array, flags: Uint32Array }} Pins
 *
 * @typedef {Header & {
 *   kind: "stats", solveUsP50: number, solveUsP99: number, wakeLateUsP50: number, wakeLateUsP99: number,
 *   periodUs: number, realTimeFactor: number, timeScale: number,
 *   stretchMean: number, stretchMax: number, stretchMaxConstraint: number,
 *   kineticJ: number, potentialJ: number, lateSteps: number, skippedPeriods: number,
 *   outcomes: number, rejected: number, frozenCount: number, tornCount: number,
 *   readers: number, clients: number, encodeUs: number, framesPerSecond: number,
 *   isPaused: boolean, isReplay: boolean,
 * }} Stats
 *
 * @typedef {{ vertices: Float32Array, triangles: Uint32Array }} ColliderMesh  by the index of its collider
 * @typedef {{
 *   index: number, shape: "plane" | "box" | "sphere" | "capsule" | "bounds" | "mesh", restitution: number, friction: number,
 *   radius: number, offset: number, normal: Vec3, center: Vec3, halfExtents: Vec3, rotation: number[],
 *   a: Vec3, b: Vec3, velocity: Vec3, angularVelocity: Vec3,
 * }} Collider
 * @typedef {Header & { kind: "colliders", colliders: Collider[] }} Colliders
 *
 * @typedef {{ kind: "collider" | "anchor" | "particle", index: number, impulse: Vec3, angularImpulse: Vec3, contacts: number }} ForceRow  in N s and N m s
 * @typedef {Header & { kind: "forces", rateHz: number, rows: ForceRow[] }} Forces
 * @typedef {Header & { kind: "speeds", speeds: Float32Array }} Speeds
 * @typedef {{ particle: number, position: Vec3, velocity: Vec3, inverseMass: number }} InspectedRow
 * @typedef {Header & { kind: "inspected", rows: InspectedRow[] }} Inspected
 * @typedef {Header & { kind: "past", count: number }} Past
 * @typedef {Header & { kind: "ghost", positions: Float32Array, hidden: Uint32Array, farthest: number, distance: number }} Ghost  a state of another recording
 * @typedef {Header & { kind: "part", ofKind: number, offset: number, size: number, unpackedSize: number, bytes: Uint8Array }} Part  a piece of a long message
 * @typedef {Scene | Frame | Tear | Pins | Stats | Colliders | Forces | Speeds | Inspected | Past | Ghost | Part} Message
 */

/** Flags of a particle in PINS. */
export const PIN = Object.freeze({ pinned: 1, grabbed: 2, anchored: 4, frozen: 8 });
/** Constraint kinds in SCENE. */
export const CONSTRAINT = Object.freeze({ structural: 0, shear: 1, bend: 2, tether: 3 });

/** Greatest value of a quantised coordinate. */
const QUANTA = 65_535;
const VERSION = 1;
const SHAPES = /** @type {const} */ (["plane", "box", "sphere", "capsule", "bounds", "mesh"]);
const RECIPIENTS = /** @type {const} */ (["collider", "anchor", "particle"]);

/** Reads consecutive fields of a message. Throws a RangeError beyond its end. */
class Reader {
  /** @param {ArrayBuffer} buffer */
  constructor(buffer) {
    this.view = new DataView(buffer);
    this.at = 0;
  }

  u16() {
    this.at += 2;
    return this.view.getUint16(this.at - 2, true);
  }

  u32() {
    this.at += 4;
    return this.view.getUint32(this.at - 4, true);
  }

  u64() {
    this.at += 8;
    return this.view.getBigUint64(this.at - 8, true);
  }

  f32() {
    this.at += 4;
    return this.view.getFloat32(this.at - 4, true);
  }

  f64() {
    this.at += 8;
    return this.view.getFloat64(this.at - 8, true);
  }

  /** A u64 below 2^53. */
  count64() {
    return Number(this.u64());
  }

  /** @returns {Vec3} */
  f32x3() {
    return [this.f32(), this.f32(), this.f32()];
  }

  f32x4() {
    return [this.f32(), ...this.f32x3()];
  }

  /** @returns {Vec3} */
  f64x3() {
    return [this.f64(), this.f64(), this.f64()];
  }

  /** Returns a view of `count` elements, and skips the padding after it.
   * @template {Uint8Array | Uint16Array | Uint32Array | Float32Array} T
   * @param {{ new (buffer: ArrayBuffer, at: number, count: number): T, BYTES_PER_ELEMENT: number }} Type
   * @param {number} count @returns {T} */
  array(Type, count) {
    const view = new Type(/** @type {ArrayBuffer} */ (this.view.buffer), this.at, count);
    this.at += Math.ceil((count * Type.BYTES_PER_ELEMENT) / 4) * 4;
    return view;
  }

  /** Reads fields into an object. @param {Fields} fields @param {any} [object] */
  read(fields, object = {}) {
    for (const { name, type, factor, count } of fields) {
      object[name] = count === undefined ? /** @type {any} */ (this)[type]() : this.array(/** @type {any} */ (ARRAYS)[type], factor * object[count]);
    }
    return object;
  }

  /** Reads `count` rows. @param {Fields} fields @param {number} sizeBytes of a row @param {number} count @returns {any[]} */
  rows(fields, sizeBytes, count) {
    if (this.at + count * sizeBytes > this.view.byteLength) throw new RangeError("the message ends within its rows");
    return Array.from({ length: count }, () => this.read(fields));
  }
}

/** @typedef {{ name: string, type: string, factor: number, count: string | undefined }[]} Fields */

const ARRAYS = { u8: Uint8Array, u16: Uint16Array, u32: Uint32Array, f32: Float32Array };

/** Reads a layout, whose fields are in the order of the message: `name:type`, or `name:type[3*n]` for an array with three
 * elements for each of the field `n` before it. @param {string} layout @returns {Fields} */
const fieldsOf = (layout) => layout.split(/\s+/).map((field) => {
  const [, name, type, factor = "1", count] = /** @type {string[]} */ (/^(\w+):(\w+)(?:\[(?:(\d)\*)?(\w+)\])?$/.exec(field));
  return { name, type, factor: Number(factor), count };
});

const FRAME_HEAD = `simTime:f64 particleCount:u32 flags:u32 lo:f32x3 scale:f32x3 nonFiniteCount:u32 tornCount:u32 solveUs:f32 wakeLateUs:f32
  number:u32 reserved:u32 publishedNs:u64`;

/** The kinds of messages: name, layout, and the rest of the decoding. @type {Record<number, { kind: string, fields: Fields, complete?: (message: any, reader: Reader) => object }>} */
const KINDS = {
  1: {
    kind: "scene", complete: completeScene, fields: fieldsOf(`particleCount:u32 constraintCount:u32 triangleCount:u32 flags:u32 min:f32x3 max:f32x3
      rateHz:u32 jsonBytes:u32 origin:f64x3 positions:f32[3*particleCount] ends:u32[2*constraintCount] restLengths:f32[constraintCount]
      triangles:u32[3*triangleCount] constraintKinds:u8[constraintCount] json:u8[jsonBytes]`),
  },
  2: { kind: "frame", complete: completeFrame, fields: fieldsOf(`${FRAME_HEAD} positions:f32[3*particleCount] nonFinite:u32[nonFiniteCount]`) },
  3: { kind: "frame", complete: completeFrame, fields: fieldsOf(`${FRAME_HEAD} positions:u16[3*particleCount] nonFinite:u32[nonFiniteCount]`) },
  4: { kind: "tear", fields: fieldsOf("first:u32 count:u32 constraints:u32[count] causes:u8[count]") },
  5: { kind: "pins", complete: completePins, fields: fieldsOf("count:u32 reserved:u32 pairs:u32[2*count]") },
  6: {
    kind: "stats", complete: pauseOf, fields: fieldsOf(`solveUsP50:f32 solveUsP99:f32 wakeLateUsP50:f32 wakeLateUsP99:f32 periodUs:f32 realTimeFactor:f32
      timeScale:f32 stretchMean:f32 stretchMax:f32 stretchMaxConstraint:u32 kineticJ:f64 potentialJ:f64 lateSteps:count64 skippedPeriods:count64
      outcomes:count64 rejected:count64 frozenCount:u32 tornCount:u32 readers:u32 clients:u32 encodeUs:f32 framesPerSecond:f32 flags:u32`),
  },
  7: { kind: "colliders", complete: completeColliders, fields: fieldsOf("count:u32 reserved:u32") },
  8: { kind: "forces", complete: completeForces, fields: fieldsOf("count:u32 rateHz:u32") },
  9: { kind: "speeds", fields: fieldsOf("count:u32 reserved:u32 speeds:f32[count]") },
  10: { kind: "inspected", complete: ({ count }, reader) => ({ rows: reader.rows(INSPECTED, 32, count) }), fields: fieldsOf("count:u32 reserved:u32") },
  11: { kind: "past", fields: fieldsOf("count:u32 reserved:u32") },
  12: { kind: "ghost", fields: fieldsOf("count:u32 hiddenCount:u32 farthest:u32 distance:f32 positions:f32[3*count] hidden:u32[hiddenCount]") },
  13: { kind: "part", fields: fieldsOf("ofKind:u32 offset:u32 size:u32 unpackedSize:u32 count:u32 bytes:u8[count]") },
};
const COLLIDER = fieldsOf(`shape:u32 restitution:f32 friction:f32 radius:f32 offset:f32 normal:f32x3 center:f32x3 halfExtents:f32x3 rotation:f32x4
  a:f32x3 b:f32x3 velocity:f32x3 angularVelocity:f32x3`);
const FORCE = fieldsOf("kind:u32 index:u32 impulse:f32x3 angularImpulse:f32x3 contacts:u32 reserved:u32");
const INSPECTED = fieldsOf("particle:u32 position:f32x3 velocity:f32x3 inverseMass:f32");
const MESH = fieldsOf("collider:u32 vertexCount:u32 triangleCount:u32 vertices:f32[3*vertexCount] triangles:u32[3*triangleCount]");

/**
 * Decodes a message. Returns null for a kind or version that this page does not know.
 * @param {ArrayBuffer} buffer
 * @returns {Message | null}
 * @throws {RangeError} if the message is shorter than its counts require
 */
export function decode(buffer) {
  const reader = new Reader(buffer);
  const known = KINDS[reader.u16()];
  const version = reader.u16();
  if (known === undefined || version !== VERSION) return null;
  const message = { kind: known.kind, version, epoch: reader.u32(), step: reader.count64() };
  reader.read(known.fields, message);
  return /** @type {any} */ (Object.assign(message, known.complete?.(message, reader)));
}

/** @param {{ flags: number }} message */
function pauseOf({ flags }) {
  return { isPaused: (flags & 1) !== 0, isReplay: (flags & 2) !== 0 };
}

/** @param {any} message @param {Reader} reader */
function completeScene({ flags, constraintCount, json: bytes }, reader) {
  const json = JSON.parse(new TextDecoder().decode(bytes));
  const meshes = new Map();
  for (let left = reader.u32(); left > 0; left--) {
    const { collider, vertices, triangles } = reader.read(MESH);
    meshes.set(collider, { vertices, triangles });
  }
  return {
    isPlanar: (flags & 1) !== 0,
    name: json.name ?? "", unit: json.unit ?? "m", up: json.up ?? "y", runId: json.run_id ?? "", shapes: json.shapes ?? [], hasExplicitBends: json.has_explicit_bends ?? false, anchors: json.anchors ?? [],
    meshes, compliances: reader.array(Float32Array, constraintCount),
  };
}

/** @param {any} message */
function completeFrame({ flags, lo, scale, positions }) {
  const isQuantised = positions instanceof Uint16Array;
  return {
    ...pauseOf({ flags }), isSaturated: (flags & 4) !== 0, isQuantised,
    bounds: { min: lo, max: lo.map((/** @type {number} */ value, /** @type {number} */ axis) => value + scale[axis] * (isQuantised ? QUANTA : 1)) },
    lo: isQuantised ? lo : [0, 0, 0], scale: isQuantised ? scale : [1, 1, 1],
  };
}

/** @param {{ pairs: Uint32Array }} message */
function completePins({ pairs }) {
  return { particles: pairs.filter((_, index) => index % 2 === 0), flags: pairs.filter((_, index) => index % 2 === 1) };
}

/** A shape of a later version is left out. @param {{ count: number }} message @param {Reader} reader */
function completeColliders({ count }, reader) {
  const all = reader.rows(COLLIDER, 120, count).map((one, index) => ({ ...one, index, shape: SHAPES[one.shape] }));
  return { colliders: all.filter(({ shape }) => shape !== undefined) };
}

/** A kind of a later version is left out. @param {{ count: number }} message @param {Reader} reader */
function completeForces({ count }, reader) {
  const all = reader.rows(FORCE, 40, count).map((row) => ({ ...row, kind: RECIPIENTS[row.kind] }));
  return { rows: all.filter(({ kind }) => kind !== undefined) };
}
