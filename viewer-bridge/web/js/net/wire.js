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
const COLLIDER_BYTES = 120;
const RECIPIENTS = /** @type {const} */ (["collider", "anchor", "particle"]);
const FORCE_BYTES = 40;
const INSPECTED_BYTES = 32;

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

  /** @returns {Vec3} */
  f32x3() {
    return [this.f32(), this.f32(), this.f32()];
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
}

const DECODERS = /** @type {Record<number, (reader: Reader, header: Header) => Message>} */ ({
  1: decodeScene,
  2: (reader, header) => decodeFrame(reader, header, false),
  3: (reader, header) => decodeFrame(reader, header, true),
  4: decodeTear,
  5: decodePins,
  6: decodeStats,
  7: decodeColliders,
  8: decodeForces,
  9: decodeSpeeds,
  10: decodeInspected,
  11: decodePast,
  12: decodeGhost,
  13: decodePart,
});

/**
 * Decodes a message. Returns null for a kind or version that this page does not know.
 * @param {ArrayBuffer} buffer
 * @returns {Message | null}
 * @throws {RangeError} if the message is shorter than its counts require
 */
export function decode(buffer) {
  const reader = new Reader(buffer);
  const kind = reader.u16();
  const version = reader.u16();
  const decoder = DECODERS[kind];
  if (decoder === undefined || version !== VERSION) return null;
  return decoder(reader, { version, epoch: reader.u32(), step: Number(reader.u64()) });
}

/** @param {Reader} reader @param {Header} header @returns {Scene} */
function decodeScene(reader, header) {
  const particleCount = reader.u32();
  const constraintCount = reader.u32();
  const triangleCount = reader.u32();
  const flags = reader.u32();
  const min = reader.f32x3();
  const max = reader.f32x3();
  const rateHz = reader.u32();
  const jsonBytes = reader.u32();
  const origin = /** @type {Vec3} */ ([reader.f64(), reader.f64(), reader.f64()]);
  const positions = reader.array(Float32Array, 3 * particleCount);
  const ends = reader.array(Uint32Array, 2 * constraintCount);
  const restLengths = reader.array(Float32Array, constraintCount);
  const triangles = reader.array(Uint32Array, 3 * triangleCount);
  const constraintKinds = reader.array(Uint8Array, constraintCount);
  const json = JSON.parse(new TextDecoder().decode(reader.array(Uint8Array, jsonBytes)));
  return {
    kind: "scene", ...header, particleCount, constraintCount, triangleCount,
    isPlanar: (flags & 1) !== 0,
    min, max, rateHz, origin, positions, ends, restLengths, triangles, constraintKinds,
    name: json.name ?? "", unit: json.unit ?? "m", up: json.up ?? "y", runId: json.run_id ?? "", shapes: json.shapes ?? [], hasExplicitBends: json.has_explicit_bends ?? false, anchors: json.anchors ?? [],
    meshes: decodeMeshes(reader), compliances: reader.array(Float32Array, constraintCount),
  };
}

/** @param {Reader} reader @returns {Map<number, ColliderMesh>} */
function decodeMeshes(reader) {
  const meshes = new Map();
  for (let left = reader.u32(); left > 0; left--) {
    const collider = reader.u32();
    const vertexCount = reader.u32();
    const triangleCount = reader.u32();
    meshes.set(collider, { vertices: reader.array(Float32Array, 3 * vertexCount), triangles: reader.array(Uint32Array, 3 * triangleCount) });
  }
  return meshes;
}

/** @param {Reader} reader @param {Header} header @param {boolean} isQuantised @returns {Frame} */
function decodeFrame(reader, header, isQuantised) {
  const simTime = reader.f64();
  const particleCount = reader.u32();
  const flags = reader.u32();
  const lo = reader.f32x3();
  const scale = reader.f32x3();
  const nonFiniteCount = reader.u32();
  const tornCount = reader.u32();
  const solveUs = reader.f32();
  const wakeLateUs = reader.f32();
  const number = reader.u32();
  reader.u32();
  const publishedNs = reader.u64();
  const positions = isQuantised ? reader.array(Uint16Array, 3 * particleCount) : reader.array(Float32Array, 3 * particleCount);
  return {
    kind: "frame", ...header, simTime, particleCount,
    isPaused: (flags & 1) !== 0, isReplay: (flags & 2) !== 0, isSaturated: (flags & 4) !== 0,
    bounds: { min: lo, max: /** @type {Vec3} */ (lo.map((value, axis) => value + scale[axis] * (isQuantised ? QUANTA : 1))) },
    lo: isQuantised ? lo : [0, 0, 0], scale: isQuantised ? scale : [1, 1, 1],
    tornCount, solveUs, wakeLateUs, number, publishedNs, isQuantised, positions,
    nonFinite: reader.array(Uint32Array, nonFiniteCount),
  };
}

/** @param {Reader} reader @param {Header} header @returns {Tear} */
function decodeTear(reader, header) {
  const first = reader.u32();
  const count = reader.u32();
  return { kind: "tear", ...header, first, constraints: reader.array(Uint32Array, count), causes: reader.array(Uint8Array, count) };
}

/** @param {Reader} reader @param {Header} header @returns {Pins} */
function decodePins(reader, header) {
  const count = reader.u32();
  reader.u32();
  const pairs = reader.array(Uint32Array, 2 * count);
  return {
    kind: "pins", ...header,
    particles: pairs.filter((_, index) => index % 2 === 0),
    flags: pairs.filter((_, index) => index % 2 === 1),
  };
}

/** @param {Reader} reader @param {Header} header @returns {Stats} */
function decodeStats(reader, header) {
  // The fields are in the order of the message: each call reads the next one.
  const stats = {
    kind: /** @type {const} */ ("stats"), ...header,
    solveUsP50: reader.f32(), solveUsP99: reader.f32(),
    wakeLateUsP50: reader.f32(), wakeLateUsP99: reader.f32(),
    periodUs: reader.f32(), realTimeFactor: reader.f32(), timeScale: reader.f32(),
    stretchMean: reader.f32(), stretchMax: reader.f32(), stretchMaxConstraint: reader.u32(),
    kineticJ: reader.f64(), potentialJ: reader.f64(),
    lateSteps: Number(reader.u64()), skippedPeriods: Number(reader.u64()),
    outcomes: Number(reader.u64()), rejected: Number(reader.u64()),
    frozenCount: reader.u32(), tornCount: reader.u32(), readers: reader.u32(), clients: reader.u32(),
    encodeUs: reader.f32(), framesPerSecond: reader.f32(),
  };
  const flags = reader.u32();
  return { ...stats, isPaused: (flags & 1) !== 0, isReplay: (flags & 2) !== 0 };
}

/** @param {Reader} reader @param {Header} header @returns {Colliders} */
function decodeColliders(reader, header) {
  const count = reader.u32();
  reader.u32();
  if (reader.at + count * COLLIDER_BYTES > reader.view.byteLength) throw new RangeError("the message ends within its colliders");
  /** @type {Collider[]} */
  const colliders = [];
  for (let index = 0; index < count; index++) {
    const collider = decodeCollider(reader, index);
    if (collider !== null) colliders.push(collider);
  }
  return { kind: "colliders", ...header, colliders };
}

/** Skips a shape of a later version. @param {Reader} reader @param {number} index @returns {Collider | null} */
function decodeCollider(reader, index) {
  const shape = SHAPES[reader.u32()];
  const restitution = reader.f32();
  const friction = reader.f32();
  const radius = reader.f32();
  const offset = reader.f32();
  const normal = reader.f32x3();
  const center = reader.f32x3();
  const halfExtents = reader.f32x3();
  const rotation = [reader.f32(), reader.f32(), reader.f32(), reader.f32()];
  const a = reader.f32x3();
  const b = reader.f32x3();
  const velocity = reader.f32x3();
  const angularVelocity = reader.f32x3();
  if (shape === undefined) return null;
  return { index, shape, restitution, friction, radius, offset, normal, center, halfExtents, rotation, a, b, velocity, angularVelocity };
}

/** @param {Reader} reader @param {Header} header @returns {Forces} */
function decodeForces(reader, header) {
  const count = reader.u32();
  const rateHz = reader.u32();
  if (reader.at + count * FORCE_BYTES > reader.view.byteLength) throw new RangeError("the message ends within its forces");
  /** @type {ForceRow[]} */
  const rows = [];
  for (let row = 0; row < count; row++) {
    const kind = RECIPIENTS[reader.u32()];
    const [index, impulse, angularImpulse, contacts] = [reader.u32(), reader.f32x3(), reader.f32x3(), reader.u32()];
    reader.u32();
    // A kind of a later version is skipped.
    if (kind !== undefined) rows.push({ kind, index, impulse, angularImpulse, contacts });
  }
  return { kind: "forces", ...header, rateHz, rows };
}

/** @param {Reader} reader @param {Header} header @returns {Speeds} */
function decodeSpeeds(reader, header) {
  const count = reader.u32();
  reader.u32();
  return { kind: "speeds", ...header, speeds: reader.array(Float32Array, count) };
}

/** @param {Reader} reader @param {Header} header @returns {Inspected} */
function decodeInspected(reader, header) {
  const count = reader.u32();
  reader.u32();
  if (reader.at + count * INSPECTED_BYTES > reader.view.byteLength) throw new RangeError("the message ends within its particles");
  /** @type {InspectedRow[]} */
  const rows = [];
  for (let row = 0; row < count; row++) rows.push({ particle: reader.u32(), position: reader.f32x3(), velocity: reader.f32x3(), inverseMass: reader.f32() });
  return { kind: "inspected", ...header, rows };
}

/** @param {Reader} reader @param {Header} header @returns {Part} */
function decodePart(reader, header) {
  const [ofKind, offset, size, unpackedSize, count] = [reader.u32(), reader.u32(), reader.u32(), reader.u32(), reader.u32()];
  return { kind: "part", ...header, ofKind, offset, size, unpackedSize, bytes: reader.array(Uint8Array, count) };
}

/** @param {Reader} reader @param {Header} header @returns {Past} */
function decodePast(reader, header) {
  const count = reader.u32();
  reader.u32();
  return { kind: "past", ...header, count };
}

/** @param {Reader} reader @param {Header} header @returns {Ghost} */
function decodeGhost(reader, header) {
  const count = reader.u32();
  const hiddenCount = reader.u32();
  const [farthest, distance] = [reader.u32(), reader.f32()];
  return { kind: "ghost", ...header, positions: reader.array(Float32Array, 3 * count), hidden: reader.array(Uint32Array, hiddenCount), farthest, distance };
}
