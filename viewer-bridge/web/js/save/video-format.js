// The format of a video, and its limits.

/** Formats from the most to the least widely played. The browser chooses the first that it can write. */
export const TYPES = Object.freeze(["video/mp4;codecs=avc1", "video/webm;codecs=vp9", "video/webm;codecs=vp8", "video/webm", "video/mp4"]);
/** Pictures per second. */
export const FRAMES_PER_SECOND = 30;
/** Limit on the size of a video: the browser keeps it in memory until it is saved. */
export const SIZE_BYTES_MAX = 512e6;
/** Bits per pixel of a picture: enough for thin threads. */
const BITS_PER_PIXEL = 0.15;
const BITS_PER_SECOND = { min: 2.5e6, max: 40e6 };
/** Longest side: encoders refuse more. */
const SIDE_MAX = 4096;

/** The best type that a browser can write, or null. @param {(type: string) => boolean} isSupported */
export const chooseType = (isSupported) => TYPES.find((type) => isSupported(type)) ?? null;

/** The ending of a file. @param {string} type */
export const endingOf = (type) => (type.startsWith("video/mp4") ? "mp4" : "webm");

/** The size of the pictures of a video: even, as encoders need it. @param {{ width: number, height: number }} picture */
export function videoSize({ width, height }) {
  const scale = Math.min(1, SIDE_MAX / Math.max(width, height));
  const even = (/** @type {number} */ side) => Math.max(2, 2 * Math.floor((side * scale) / 2));
  return { width: even(width), height: even(height) };
}

/** @param {{ width: number, height: number }} size */
export function bitsPerSecond({ width, height }) {
  return Math.round(Math.min(BITS_PER_SECOND.max, Math.max(BITS_PER_SECOND.min, width * height * FRAMES_PER_SECOND * BITS_PER_PIXEL)));
}
