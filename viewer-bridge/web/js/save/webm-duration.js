// The duration of a WebM video. Browsers write a video as a stream that never ends: without its duration, players
// show no length and cannot seek. Elements and their sizes: RFC 8794 (EBML) and RFC 9559 (Matroska).

/** An element of EBML: its header begins at `at`, its content lies at `begin..end`; `end` is null for an unknown size.
 * @typedef {{ id: number, at: number, begin: number, end: number | null }} Element */
/** @typedef {Element & { end: number }} SizedElement */

const ID = Object.freeze({ header: 0x1a45dfa3, segment: 0x18538067, seekHead: 0x114d9b74, info: 0x1549a966, timestampScale: 0x2ad7b1, duration: 0x4489 });
/** Nanoseconds of a unit of time, unless Info says otherwise. */
const TIMESTAMP_SCALE_NS = 1e6;
/** Bytes of a Duration: its ID, its size, and a double. */
const DURATION_BYTES = 11;
/** Bytes of the head of a file that are searched for Info. */
export const HEAD_BYTES = 4096;

/** The integer of variable length at `at`: the leading zeros of its first byte count the bytes that follow. @param {DataView} bytes @param {number} at */
function variableInt(bytes, at) {
  const first = bytes.getUint8(at);
  if (first === 0) throw new RangeError("an integer has at most 8 bytes");
  const length = Math.clz32(first) - 23;
  const mask = 0xff >> length;
  let value = first & mask;
  let isAllOnes = value === mask;
  for (let k = 1; k < length; k++) {
    const next = bytes.getUint8(at + k);
    value = value * 256 + next;
    isAllOnes &&= next === 0xff;
  }
  return { length, value, isUnknown: isAllOnes };
}

/** The ID of an element: an integer with its marker. @param {DataView} bytes @param {number} at */
function idAt(bytes, at) {
  const { length, value } = variableInt(bytes, at);
  return { length, id: value + 2 ** (7 * length) };
}

/** @param {DataView} bytes @param {number} at @returns {Element} */
function elementAt(bytes, at) {
  const { id, length } = idAt(bytes, at);
  const size = variableInt(bytes, at + length);
  const begin = at + length + size.length;
  return { id, at, begin, end: size.isUnknown ? null : begin + size.value };
}

/** @param {Element} element @returns {element is SizedElement} */
const hasSize = (element) => element.end !== null;

/** The child of an element with an ID, or null. @param {DataView} bytes @param {SizedElement} parent @param {number} id @returns {SizedElement | null} */
function childOf(bytes, { begin, end }, id) {
  for (let at = begin; at < end; ) {
    const element = elementAt(bytes, at);
    if (!hasSize(element)) return null;
    if (element.id === id) return element;
    at = element.end;
  }
  return null;
}

/** The Info of a stream, or null. @param {DataView} bytes @returns {SizedElement | null} */
function infoOfStream(bytes) {
  const header = elementAt(bytes, 0);
  if (header.id !== ID.header || header.end === null) return null;
  const segment = elementAt(bytes, header.end);
  if (segment.id !== ID.segment || segment.end !== null) return null;
  let info = elementAt(bytes, segment.begin);
  // Firefox begins with an empty SeekHead. One with positions would no longer be right.
  if (info.id === ID.seekHead && info.end === info.begin) info = elementAt(bytes, info.end);
  return info.id === ID.info && hasSize(info) && info.end <= bytes.byteLength ? info : null;
}

/** The value of an element: an unsigned integer. @param {DataView} bytes @param {SizedElement} element */
function uintOf(bytes, { begin, end }) {
  let value = 0;
  for (let at = begin; at < end; at++) value = value * 256 + bytes.getUint8(at);
  return value;
}

/** The value of an element: a float of 4 or 8 bytes, or 0. @param {DataView} bytes @param {SizedElement} element */
function floatOf(bytes, { begin, end }) {
  if (end === begin) return 0;
  return end - begin === 4 ? bytes.getFloat32(begin) : bytes.getFloat64(begin);
}

/** The place of the duration in the head of a stream that has none, or null.
 * @param {DataView} bytes @returns {{ info: SizedElement, at: number, end: number, scaleNs: number } | null} */
function placeOfDuration(bytes) {
  const info = infoOfStream(bytes);
  if (info === null) return null;
  const scale = childOf(bytes, info, ID.timestampScale);
  const scaleNs = (scale && uintOf(bytes, scale)) || TIMESTAMP_SCALE_NS;
  const duration = childOf(bytes, info, ID.duration);
  if (duration === null) return { info, at: info.end, end: info.end, scaleNs };
  // Firefox leaves room for it.
  return floatOf(bytes, duration) === 0 ? { info, at: duration.at, end: duration.end, scaleNs } : null;
}

/**
 * The head of a WebM video as parts, with its duration. The head is unchanged if it has a duration or is not that of a
 * stream: inserted bytes would make sizes and positions in it wrong.
 * @param {Uint8Array<ArrayBuffer>} head @param {number} seconds @returns {BlobPart[]}
 */
export function withDuration(head, seconds) {
  const bytes = new DataView(head.buffer, head.byteOffset, head.byteLength);
  let place;
  try {
    place = placeOfDuration(bytes);
  } catch (error) {
    // The head ends within an element, or has none.
    if (error instanceof RangeError) return [head];
    throw error;
  }
  if (place === null) return [head];
  const { info, at, end, scaleNs } = place;
  const infoHeader = new DataView(new ArrayBuffer(12));
  infoHeader.setUint32(0, ID.info);
  // A size of 8 bytes.
  infoHeader.setUint32(4, 0x01000000);
  infoHeader.setUint32(8, info.end - info.begin - (end - at) + DURATION_BYTES);
  const duration = new DataView(new ArrayBuffer(DURATION_BYTES));
  duration.setUint16(0, ID.duration);
  duration.setUint8(2, 0x88);
  duration.setFloat64(3, (seconds * 1e9) / scaleNs);
  return [head.subarray(0, info.at), infoHeader.buffer, head.subarray(info.begin, at), duration.buffer, head.subarray(end)];
}
