// Series of numbers over time and what is drawn of them: a ring of samples, least and greatest per
// pixel column, and a scale of round numbers. No canvas here.

/** @typedef {{ min: number, max: number } | null} Column  null where there is no sample */

export class Series {
  /** @param {number} capacity samples that are kept */
  constructor(capacity) {
    this.samples = new Float64Array(capacity).fill(NaN);
    this.count = 0;
  }

  /** @param {number} value NaN for "not known" */
  push(value) {
    this.samples[this.count++ % this.samples.length] = value;
  }

  clear() {
    this.count = 0;
    this.samples.fill(NaN);
  }

  /** The newest sample, NaN before the first. */
  last() {
    return this.count === 0 ? NaN : this.samples[(this.count - 1) % this.samples.length];
  }

  /** Sample by age: 0 is the oldest one that a full ring has. @param {number} index */
  at(index) {
    const capacity = this.samples.length;
    const sample = this.count - capacity + index;
    return sample < 0 ? NaN : this.samples[sample % capacity];
  }

  /** Least and greatest of the samples under each of `width` columns, oldest first. @param {number} width @returns {Column[]} */
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

  /** Least and greatest of all samples that are numbers, or null. @returns {Column} */
  range() {
    return this.columns(1)[0];
  }
}

/** The least of 1, 2, 5 times a power of ten that is not below `value`. @param {number} value */
export function niceCeiling(value) {
  if (!(value > 0) || !Number.isFinite(value)) return 1;
  const power = 10 ** Math.floor(Math.log10(value));
  const step = [1, 2, 5, 10].find((factor) => factor * power >= value * (1 - 1e-12)) ?? 10;
  return step * power;
}

/** What is less is noise and written as 0: a hundred-thousandth of a percent, a nanojoule. */
const LEAST = /** @type {Record<string, number>} */ ({ "%": 1e-5, J: 1e-9 });

/** A number with three digits and its prefix: 1234 µs is "1.23 ms" by the caller's unit. @param {number} value @param {string} unit */
export function readable(value, unit) {
  if (!Number.isFinite(value)) return "–";
  const least = LEAST[unit] ?? 0;
  if (Math.abs(value) < least) return `0 ${unit}`;
  if (unit === "%") return `${trim(value * 100)} %`;
  if (unit === "µs" && Math.abs(value) >= 1000) return `${trim(value / 1000)} ms`;
  if (unit === "J" && value !== 0) {
    if (Math.abs(value) >= 1e6) return `${trim(value / 1e6)} MJ`;
    if (Math.abs(value) >= 1e3) return `${trim(value / 1e3)} kJ`;
    if (Math.abs(value) < 1e-3) return `${trim(value * 1e6)} µJ`;
    if (Math.abs(value) < 1) return `${trim(value * 1e3)} mJ`;
  }
  return `${trim(value)} ${unit}`;
}

/** Three digits, without an exponent where it can be. @param {number} value */
export function trim(value) {
  if (value === 0) return "0";
  const size = Math.abs(value);
  if (size >= 1e6 || size < 1e-3) return value.toExponential(1);
  return size >= 100 ? value.toFixed(0) : String(Number(value.toPrecision(3)));
}
