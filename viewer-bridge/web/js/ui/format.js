// Numbers as text.

/** Values below these are noise and shown as 0: a thousandth of a percent, a nanojoule. */
const NOISE = /** @type {Record<string, number>} */ ({ "%": 1e-5, J: 1e-9 });

/** Formats a value with three digits and a metric prefix: 1234 µs becomes "1.23 ms". @param {number} value @param {string} unit */
export function readable(value, unit) {
  if (!Number.isFinite(value)) return "–";
  if (Math.abs(value) < (NOISE[unit] ?? 0)) return `0 ${unit}`;
  if (unit === "%") return `${trim(value * 100)} %`;
  if (unit === "µs" && Math.abs(value) >= 1000) return `${trim(value / 1000)} ms`;
  if (unit === "J" && value !== 0) {
    if (Math.abs(value) >= 1e6) return `${trim(value / 1e6)} MJ`;
    if (Math.abs(value) >= 1e3) return `${trim(value / 1e3)} kJ`;
    if (Math.abs(value) < 1e-3) return `${trim(value * 1e6)} µJ`;
    if (Math.abs(value) < 1) return `${trim(value * 1e3)} mJ`;
  }
  return unit === "" ? trim(value) : `${trim(value)} ${unit}`;
}

/** Formats a number with three digits, without an exponent if possible. @param {number} value */
export function trim(value) {
  if (value === 0) return "0";
  const size = Math.abs(value);
  if (size >= 1e6 || size < 1e-3) return value.toExponential(1);
  return size >= 100 ? value.toFixed(0) : String(Number(value.toPrecision(3)));
}

/**
 * The units that belong to a unit of length. In metres they have their own names; a force in pixels is in kg px/s².
 * @param {string} length
 */
export function unitsOf(length) {
  const isMetric = length === "m";
  return {
    length,
    speed: `${length}/s`,
    force: isMetric ? "N" : `kg ${length}/s²`,
    energy: isMetric ? "J" : `kg ${length}²/s²`,
    compliance: isMetric ? "m/N" : "s²/kg",
  };
}

/** A unit given for metres, in another unit of length. @param {string} unit "m/s²", "kg/m³", "N", "N m", "N m²" or "m/N" @param {string} length */
export function unitIn(unit, length) {
  if (length === "m") return unit;
  const units = unitsOf(length);
  if (unit === "N") return units.force;
  // A rigidity: N is kg m/s².
  if (unit === "N m" || unit === "N m²") return `kg ${length}${unit === "N m" ? "²" : "³"}/s²`;
  return unit === "m/N" ? units.compliance : unit.replace(/\bm(?=$|\/|³)/, length);
}

/** The units of the scene on show. @param {import("../net/wire.js").Scene | null} scene */
export const sceneUnits = (scene) => unitsOf(scene?.unit ?? "m");
