// Units of a scene. Only its unit of length varies: time is in s and mass in kg.

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
