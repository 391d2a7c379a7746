// Round numbers for the ends of scales.

/** The smallest 1, 2 or 5 times a power of ten that is at least `value`. @param {number} value */
export function niceCeiling(value) {
  if (!(value > 0) || !Number.isFinite(value)) return 1;
  const power = 10 ** Math.floor(Math.log10(value));
  const step = [1, 2, 5, 10].find((factor) => factor * power >= value * (1 - 1e-12)) ?? 10;
  return step * power;
}

/** The greatest 1, 2 or 5 times a power of ten that is at most `value`. @param {number} value */
export function niceFloor(value) {
  if (!(value > 0) || !Number.isFinite(value)) return 1;
  const power = 10 ** Math.floor(Math.log10(value));
  const step = [5, 2, 1].find((factor) => factor * power <= value * (1 + 1e-12)) ?? 1;
  return step * power;
}
