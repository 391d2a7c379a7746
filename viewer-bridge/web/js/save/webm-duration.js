// The duration of a WebM video. Browsers write a video as a stream that never ends: without its duration, players
// show no length and cannot seek. Elements and their sizes: RFC 8794 (EBML) and RFC 9559 (Matroska).

/** An element of EBML: its content lies at `begin..end`; `end` is null for a size that is not known yet.
 * @typedef {{ id: number, at: number, begin: number, end: number | null }} Element */
/** @typedef {Element & { end: number }} Whole */

const ID = Object.freeze({ header: 0x1a45dfa3, segment: 0x18538067, info: 0x1549a966, duration: 0x4489, unit: 0x2ad7b1 });
/** Nanoseconds of a unit of time, unless Info says otherwise. */
const UNIT_NS = 1e6;
/** Bytes of a Duration: its ID, its size, and a double. */
const DURATION_BYTES = 11;
/** Bytes at the beginning of a file in which Info lies. */
export const HEAD_BYTES = 4096;

/** A number of variable length at `at`: leading zeros of its first byte count the bytes that follow. @param {DataView} bytes @param {number} at */
function variableInt(bytes, at) {
  const first = bytes.getUint8(at);
  const length = Math.clz32(first) - 23;
  let value = first;
  let isAllOnes = ((first + 1) & first) === 0;
  for (let k = 1; k < length; k++) {
    value = value * 256 + bytes.getUint8(at + k);
    isAllOnes &&= bytes.getUint8(at + k) === 0xff;
  }
  const marker = 2 ** (7 * length);
  return { length, withMarker: value, value: value - marker, isUnknown: isAllOnes };
}

/** @param {DataView} bytes @param {number} at @returns {Element} */
function elementAt(bytes, at) {
  const id = variableInt(bytes, at);
  const size = variableInt(bytes, at + id.length);
  const begin = at + id.length + size.length;
  return { id: id.withMarker, at, begin, end: size.isUnknown ? null : begin + size.value };
}

/** @param {Element} element @returns {element is Whole} */
const isWhole = (element) => element.end !== null;

/** The child of an element with an ID, or null. @param {DataView} bytes @param {Whole} parent @param {number} id @returns {Whole | null} */
function childOf(bytes, { begin, end }, id) {
  for (let at = begin; at < end; ) {
    const element = elementAt(bytes, at);
    if (!isWhole(element)) return null;
    if (element.id === id) return element;
    at = element.end;
  }
  return null;
}

/** The Info of a stream that has no duration, or null. @param {DataView} bytes @returns {Whole | null} */
function infoOfStream(bytes) {
  try {
    const header = elementAt(bytes, 0);
    if (header.id !== ID.header || header.end === null) return null;
    const segment = elementAt(bytes, header.end);
    if (segment.id !== ID.segment || segment.end !== null) return null;
    // A list of places in the file (SeekHead) would come before it.
    const info = elementAt(bytes, segment.begin);
    if (info.id !== ID.info || !isWhole(info) || info.end > bytes.byteLength) return null;
    return childOf(bytes, info, ID.duration) === null ? info : null;
  } catch (error) {
    // The bytes end within an element.
    if (error instanceof RangeError) return null;
    throw error;
  }
}

/** Nanoseconds of a unit of time. @param {DataView} bytes @param {Whole} info */
function unitOf(bytes, info) {
  const unit = childOf(bytes, info, ID.unit);
  if (unit === null) return UNIT_NS;
  let value = 0;
  for (let at = unit.begin; at < unit.end; at++) value = value * 256 + bytes.getUint8(at);
  return value;
}

/**
 * The parts of the beginning of a WebM video, with its duration. The beginning stays as it is if it has one, or if it is
 * not that of a stream: inserted bytes would make the sizes and places in it wrong.
 * @param {Uint8Array<ArrayBuffer>} head @param {number} seconds @returns {BlobPart[]}
 */
export function withDuration(head, seconds) {
  const bytes = new DataView(head.buffer, head.byteOffset, head.byteLength);
  const info = infoOfStream(bytes);
  if (info === null) return [head];
  const opening = new DataView(new ArrayBuffer(12));
  opening.setUint32(0, ID.info);
  // A size of 8 bytes.
  opening.setUint32(4, 0x01000000);
  opening.setUint32(8, info.end - info.begin + DURATION_BYTES);
  const duration = new DataView(new ArrayBuffer(DURATION_BYTES));
  duration.setUint16(0, ID.duration);
  duration.setUint8(2, 0x88);
  duration.setFloat64(3, (seconds * 1e9) / unitOf(bytes, info));
  return [head.subarray(0, info.at), opening.buffer, head.subarray(info.begin, info.end), duration.buffer, head.subarray(info.end)];
}
