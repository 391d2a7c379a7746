// The logic of the replay timeline: the position of a step, marks that share a pixel, and scrubbing
// with at most one seek in flight.

/** @typedef {import("../net/messages.js").Mark} Mark */
/** @typedef {{ first: number, last: number }} Range  steps */
/**
 * What the timeline shows and moves. `place` is the step on show; null keeps the timeline as it is. `looped` are the first
 * and the last step that the track repeats, if it repeats a part. `showMark` shows the state at a mark or just after it.
 * @typedef {{
 *   name: "live" | "replay", isThere: boolean, rateHz: number, marks: Mark[], place: number | null,
 *   looped: number[] | null, range(): Range, clock(step: number): string, sinceBegin(step: number): number,
 *   showMark(step: number): void,
 *   seek(step: number, done: () => void): boolean, step(count: number): void, onChange: () => void,
 * }} Track
 */

export class Scale {
  /** @param {number} first @param {number} last steps */
  constructor(first, last) {
    this.first = first;
    this.last = Math.max(first, last);
  }

  /** @param {number} step */
  has(step) {
    return step >= this.first && step <= this.last;
  }

  /** Position of a step on the bar, 0..=1. @param {number} step */
  fraction(step) {
    if (this.last === this.first) return 0;
    return Math.min(1, Math.max(0, (step - this.first) / (this.last - this.first)));
  }

  /** The step nearest to a position. @param {number} fraction */
  step(fraction) {
    return Math.round(this.first + Math.min(1, Math.max(0, fraction)) * (this.last - this.first));
  }
}

/**
 * The part of a range that a zoomed timeline shows. It stays as long as the place is in it; then it moves on, with the place
 * in its first quarter, so that most of it is ahead.
 * @param {Range} whole @param {Range} current @param {number} place @param {number} length in steps; 0 shows the whole range
 * @returns {Range}
 */
export function zoomed(whole, current, place, length) {
  if (length === 0 || length >= whole.last - whole.first) return whole;
  if (current.last - current.first === length && place >= current.first && place <= current.last) return current;
  const first = Math.min(Math.max(whole.first, place - Math.floor(length / 4)), whole.last - length);
  return { first, last: first + length };
}

/** The number of marked events per kind and pixel. @param {Mark[]} marks @param {Scale} scale @param {number} width */
export function marksByPixel(marks, scale, width) {
  /** @type {Map<string, Map<number, number>>} */
  const rows = new Map();
  for (const { kind, step, count } of marks) {
    const pixel = Math.min(width - 1, Math.floor(scale.fraction(step) * width));
    const row = rows.get(kind) ?? new Map();
    row.set(pixel, (row.get(pixel) ?? 0) + count);
    rows.set(kind, row);
  }
  return rows;
}

/** Sends one seek at a time, and keeps only the newest step requested meanwhile. */
export class SeekGate {
  /** @param {(step: number, done: () => void) => boolean} seek returns false if it could not be sent */
  constructor(seek) {
    this.seek = seek;
    this.isBusy = false;
    /** @type {number | null} */
    this.requested = null;
  }

  /** @param {number} step */
  request(step) {
    this.requested = step;
    this.next();
  }

  next() {
    if (this.isBusy || this.requested === null) return;
    const step = this.requested;
    this.requested = null;
    this.isBusy = true;
    let isAnswered = false;
    const isSent = this.seek(step, () => {
      // A repeated answer must not start another seek.
      if (isAnswered) return;
      isAnswered = true;
      this.isBusy = false;
      this.next();
    });
    if (!isSent) this.isBusy = false;
  }

  /** Drops the seek in flight: a lost connection brings no answer. */
  reset() {
    this.isBusy = false;
    this.requested = null;
  }
}

/** A time as minutes, seconds and milliseconds. @param {number} seconds */
export function clockText(seconds) {
  const whole = Math.max(0, Math.round(seconds * 1000));
  const minutes = Math.floor(whole / 60_000);
  const rest = ((whole % 60_000) / 1000).toFixed(3).padStart(6, "0");
  return `${minutes}:${rest}`;
}
