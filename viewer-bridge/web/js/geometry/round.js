// Round numbers for the ends of scales.

/** The smallest 1, 2 or 5 times a power of ten that is at least `value`. @param {number} value */
export function niceCeiling(value) {
  if (!(value > 0) || !Number.isFinite(value)) return 1;
  const power = 10 ** Math.floor(Math.log10(value));
  const step = [1, 2, 5, 10].find((factor) => factor * power >= value * (1 - 1e-12)) ?? 10;
  return step * power;
}

/** Factors of the ends of a colour scale: each is at most 4/3 of the one before. */
const ENDS = [1, 1.2, 1.5, 2, 2.5, 3, 4, 5, 6, 8, 10];

/** The smallest short number that is at least `value`, so that `value` fills three quarters of it; 0 for 0. @param {number} value */
export function niceEnd(value) {
  if (!(value > 0) || !Number.isFinite(value)) return 0;
  const power = 10 ** Math.floor(Math.log10(value));
  const end = ENDS.find((factor) => factor * power >= value * (1 - 1e-6)) ?? 10;
  return Number((end * power).toPrecision(2));
}

/** The greatest 1, 2 or 5 times a power of ten that is at most `value`. @param {number} value */
export function niceFloor(value) {
  if (!(value > 0) || !Number.isFinite(value)) return 1;
  const power = 10 ** Math.floor(Math.log10(value));
  const step = [5, 2, 1].find((factor) => factor * power <= value * (1 + 1e-12)) ?? 1;
  return step * power;
}
