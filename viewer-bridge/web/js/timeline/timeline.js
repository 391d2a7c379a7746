// The logic of the replay timeline: the position of a step, marks that share a pixel, and scrubbing
// with at most one seek in flight.

/** @typedef {import("../net/messages.js").Mark} Mark */

export class Scale {
  /** @param {number} first @param {number} last steps */
  constructor(first, last) {
    this.first = first;
    this.last = Math.max(first, last);
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
