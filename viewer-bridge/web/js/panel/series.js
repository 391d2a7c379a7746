// Time series for the plots: a ring of samples with their simulation times, ascending. No canvas here.

/** @typedef {{ min: number, max: number } | null} Range  null without a sample */

export class Series {
  /** @param {number} capacity number of samples kept */
  constructor(capacity) {
    this.times = new Float64Array(capacity);
    this.values = new Float64Array(capacity);
    /** Place of the oldest sample in the ring. */
    this.first = 0;
    this.size = 0;
  }

  /** Adds a sample. Those at or after its time are dropped: a replay has gone back, or a step is shown again.
   * @param {number} time in s @param {number} value NaN if unknown */
  push(time, value) {
    while (this.size > 0 && this.timeAt(this.size - 1) >= time) this.size--;
    if (this.size === this.times.length) this.first = (this.first + 1) % this.times.length;
    else this.size++;
    const place = this.place(this.size - 1);
    this.times[place] = time;
    this.values[place] = value;
  }

  clear() {
    this.first = this.size = 0;
  }

  /** A copy that later samples do not change. */
  clone() {
    const copy = new Series(this.times.length);
    copy.times.set(this.times);
    copy.values.set(this.values);
    [copy.first, copy.size] = [this.first, this.size];
    return copy;
  }

  /** @param {number} index 0 is the oldest sample */
  place(index) {
    return (this.first + index) % this.times.length;
  }

  /** @param {number} index */
  timeAt(index) {
    return this.times[this.place(index)];
  }

  /** @param {number} index */
  valueAt(index) {
    return this.values[this.place(index)];
  }

  /** The newest sample, or NaN before the first. */
  last() {
    return this.size === 0 ? NaN : this.valueAt(this.size - 1);
  }

  /** Index of the first sample at or after a time. @param {number} time */
  indexFrom(time) {
    let [low, high] = [0, this.size];
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.timeAt(middle) < time) low = middle + 1;
      else high = middle;
    }
    return low;
  }

  /** The sample nearest to a time, or NaN if none is within `reach`. @param {number} time @param {number} reach in s */
  near(time, reach) {
    const after = this.indexFrom(time);
    const before = after - 1;
    const isBefore = before >= 0 && (after === this.size || time - this.timeAt(before) < this.timeAt(after) - time);
    const index = isBefore ? before : after;
    return index < this.size && Math.abs(this.timeAt(index) - time) <= reach ? this.valueAt(index) : NaN;
  }

  /** Minimum and maximum of the samples in a window, without NaN. @param {number} from @param {number} to @returns {Range} */
  range(from, to) {
    let [min, max] = [Infinity, -Infinity];
    for (let index = this.indexFrom(from); index < this.size && this.timeAt(index) <= to; index++) {
      const value = this.valueAt(index);
      if (value < min) min = value;
      if (value > max) max = value;
    }
    return min <= max ? { min, max } : null;
  }
}
