// Time series for the plots: a ring of samples, reduced to minimum and maximum per pixel column.
// No canvas here.

/** @typedef {{ min: number, max: number } | null} Column  null without a sample */

export class Series {
  /** @param {number} capacity number of samples kept */
  constructor(capacity) {
    this.samples = new Float64Array(capacity).fill(NaN);
    this.count = 0;
  }

  /** @param {number} value NaN if unknown */
  push(value) {
    this.samples[this.count++ % this.samples.length] = value;
  }

  clear() {
    this.count = 0;
    this.samples.fill(NaN);
  }

  /** The newest sample, or NaN before the first. */
  last() {
    return this.count === 0 ? NaN : this.samples[(this.count - 1) % this.samples.length];
  }

  /** Sample by position in a full ring: 0 is the oldest. @param {number} index */
  at(index) {
    const capacity = this.samples.length;
    const sample = this.count - capacity + index;
    return sample < 0 ? NaN : this.samples[sample % capacity];
  }

  /** Minimum and maximum of the samples in each of `width` columns, oldest first. @param {number} width @returns {Column[]} */
  columns(width) {
    const capacity = this.samples.length;
    /** @type {Column[]} */
    const columns = [];
    for (let column = 0; column < width; column++) {
      const first = Math.floor((column * capacity) / width);
      const end = Math.max(first + 1, Math.floor(((column + 1) * capacity) / width));
      let min = Infinity;
      let max = -Infinity;
      for (let index = first; index < end; index++) {
        const value = this.at(index);
        if (value < min) min = value;
        if (value > max) max = value;
      }
      columns.push(min <= max ? { min, max } : null);
    }
    return columns;
  }

  /** Minimum and maximum of all samples except NaN, or null. @returns {Column} */
  range() {
    return this.columns(1)[0];
  }
}
