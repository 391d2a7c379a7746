// The logic of the replay bar: where a step is on it, which marks share a pixel, and scrubbing that
// never has more than one seek under way.

/** @typedef {import("./messages.js").Mark} Mark */

export class Scale {
  /** @param {number} first @param {number} last steps */
  constructor(first, last) {
    this.first = first;
    this.last = Math.max(first, last);
  }

  /** 0..=1. @param {number} step */
  fraction(step) {
    if (this.last === this.first) return 0;
    return Math.min(1, Math.max(0, (step - this.first) / (this.last - this.first)));
  }

  /** The nearest step. @param {number} fraction */
  step(fraction) {
    return Math.round(this.first + Math.min(1, Math.max(0, fraction)) * (this.last - this.first));
  }
}

/** How many of each kind are marked in each pixel of a bar. @param {Mark[]} marks @param {Scale} scale @param {number} width */
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

/** Lets one seek through at a time, and keeps the newest of those that were asked for meanwhile. */
export class SeekGate {
  /** @param {(step: number, done: () => void) => boolean} seek whether it could be sent */
  constructor(seek) {
    this.seek = seek;
    this.isBusy = false;
    /** @type {number | null} */
    this.wanted = null;
  }

  /** @param {number} step */
  request(step) {
    this.wanted = step;
    this.next();
  }

  next() {
    if (this.isBusy || this.wanted === null) return;
    const step = this.wanted;
    this.wanted = null;
    this.isBusy = true;
    let isAnswered = false;
    const isSent = this.seek(step, () => {
      // An answer that comes twice must not open the gate for a third.
      if (isAnswered) return;
      isAnswered = true;
      this.isBusy = false;
      this.next();
    });
    if (!isSent) this.isBusy = false;
  }

  /** The connection is gone: no answer will come. */
  reset() {
    this.isBusy = false;
    this.wanted = null;
  }
}

/** Minutes, seconds and milliseconds. @param {number} seconds */
export function clockText(seconds) {
  const whole = Math.max(0, Math.round(seconds * 1000));
  const minutes = Math.floor(whole / 60_000);
  const rest = ((whole % 60_000) / 1000).toFixed(3).padStart(6, "0");
  return `${minutes}:${rest}`;
}
