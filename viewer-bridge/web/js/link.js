// What a link says behind its "#": the token, which scene, where the camera stands, what is shown.

/** @typedef {{ target: import("./math.js").Vec3, distance: number, yaw: number, pitch: number }} CameraPose */
/** @typedef {{ token: string | null, scene: string | null, camera: CameraPose | null, toggles: Record<string, boolean> }} Link */

/** Digits of a pose: a thousandth of what is seen, in any unit. */
const DIGITS = 5;

/** @param {string} hash with or without its "#" @returns {Link} */
export function parseLink(hash) {
  const fields = new URLSearchParams(hash.replace(/^#/, ""));
  /** @type {Record<string, boolean>} */
  const toggles = {};
  for (const [name, value] of fields) if (name.startsWith("show.")) toggles[name.slice(5)] = value === "1";
  return { token: fields.get("token") || null, scene: fields.get("scene") || null, camera: parsePose(fields.get("camera")), toggles };
}

/** What is no pose is ignored: a link may be cut or written by hand. @param {string | null} text @returns {CameraPose | null} */
function parsePose(text) {
  if (text === null) return null;
  const numbers = text.split(",").map(Number);
  const [x, y, z, distance, yaw, pitch] = numbers;
  if (numbers.length !== 6 || !numbers.every(Number.isFinite) || distance <= 0) return null;
  return { target: [x, y, z], distance, yaw, pitch };
}

/** The part behind "#"; the token is never in it. @param {Omit<Link, "token">} link */
export function formatLink(link) {
  const fields = [];
  if (link.scene !== null) fields.push(`scene=${encodeURIComponent(link.scene)}`);
  if (link.camera !== null) {
    const { target, distance, yaw, pitch } = link.camera;
    fields.push(`camera=${[...target, distance, yaw, pitch].map((number) => Number(number.toPrecision(DIGITS))).join(",")}`);
  }
  for (const [name, isOn] of Object.entries(link.toggles)) fields.push(`show.${encodeURIComponent(name)}=${isOn ? 1 : 0}`);
  return fields.join("&");
}
