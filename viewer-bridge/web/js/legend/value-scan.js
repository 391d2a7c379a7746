// Finds the least and greatest value of the picture's quantity, and the ends of its scale. A large scene is
// scanned in slices, one per animation frame, but always in one frame of the simulation.

import { valueAt } from "../state/quantity.js";

/** @typedef {import("../net/wire.js").Frame} Frame */
/** Extremes of the known values; 98 of 100 lie between `low` and `high`, which include 0. `resolution` is what the
 * rounding of the message's positions can change in a value, and `gainMax` the change of a value per unit of length.
 * @typedef {{ min: number, max: number, low: number, high: number, known: number, count: number, resolution: number, gainMax: number }} Extremes */

/** Values per slice: well below a millisecond. */
const SLICE = 10_000;
/** Part of the values beyond each end of the scale: one edge at a pin can be stretched far more than all others. */
const BEYOND = 0.01;
/** Bits of a float that a class of the histogram ignores: its width is 1/128 of its value. */
const CLASS_SHIFT = 16;
/** Number of the classes of one sign. */
const CLASSES = 0x8000;

const floats = new Float32Array(1);
const bits = new Uint32Array(floats.buffer);

export class ValueScan {
  constructor() {
    /** Numbers of values by the upper bits of a float: the classes of positive values by magnitude, then of negative ones. */
    this.classes = new Uint32Array(2 * CLASSES);
    /** @type {Frame | null} */
    this.frame = null;
    /** @type {Extremes | null} */
    this.found = null;
    this.next = 0;
    this.known = 0;
    this.min = Infinity;
    this.max = -Infinity;
    this.gainMax = 0;
  }

  /** Forgets the scan in progress, and its results. */
  restart() {
    this.frame = null;
    this.found = null;
  }

  get isRunning() {
    return this.frame !== null;
  }

  /** @param {Frame} frame */
  begin(frame) {
    this.frame = frame;
    this.next = 0;
    this.known = 0;
    this.min = Infinity;
    this.max = -Infinity;
    this.gainMax = 0;
    this.classes.fill(0);
  }

  /** Scans the next constraints. Returns true once all are done. @param {import("../net/wire.js").Scene} scene @param {Float32Array} gains @param {Uint8Array} isGone */
  addConstraints({ ends, restLengths }, gains, isGone) {
    const { positions: p, scale: [sx, sy, sz] } = /** @type {Frame} */ (this.frame);
    const end = Math.min(this.next + SLICE, gains.length);
    for (let i = this.next; i < end; i++) {
      if (gains[i] === 0 || isGone[i]) continue;
      const a = 3 * ends[2 * i], b = 3 * ends[2 * i + 1];
      const x = (p[b] - p[a]) * sx, y = (p[b + 1] - p[a + 1]) * sy, z = (p[b + 2] - p[a + 2]) * sz;
      this.add(valueAt(Math.sqrt(x * x + y * y + z * z), restLengths[i], gains[i]));
      if (Math.abs(gains[i]) > this.gainMax) this.gainMax = Math.abs(gains[i]);
    }
    return this.advance(end, gains.length);
  }

  /** Scans the next values. Returns true once all are done. @param {Float32Array} values */
  addValues(values) {
    const end = Math.min(this.next + SLICE, values.length);
    for (let i = this.next; i < end; i++) this.add(values[i]);
    return this.advance(end, values.length);
  }

  /** @param {number} value */
  add(value) {
    if (!(Math.abs(value) < Infinity)) return;
    this.known++;
    if (value < this.min) this.min = value;
    if (value > this.max) this.max = value;
    floats[0] = value;
    this.classes[bits[0] >>> CLASS_SHIFT]++;
  }

  /** @param {number} end @param {number} count */
  advance(end, count) {
    this.next = end;
    if (end < count) return false;
    const { isQuantised, scale } = /** @type {Frame} */ (this.frame);
    const resolution = isQuantised ? Math.hypot(...scale) * this.gainMax : 0;
    this.found = { min: this.min, max: this.max, low: 0 - this.end(CLASSES, -this.min), high: this.end(0, this.max), known: this.known, count, resolution, gainMax: this.gainMax };
    this.frame = null;
    return true;
  }

  /** The magnitude of one sign that a hundredth of all values exceed, up to the width of a class; 0 if fewer have that sign.
   * @param {number} first class of that sign @param {number} greatest magnitude */
  end(first, greatest) {
    let left = Math.floor(BEYOND * this.known);
    for (let index = CLASSES - 1; index >= 0; index--) {
      const count = this.classes[first + index];
      if (count > left) {
        bits[0] = (index + 1) << CLASS_SHIFT;
        return Math.min(floats[0], Math.max(greatest, 0));
      }
      left -= count;
    }
    return 0;
  }
}
