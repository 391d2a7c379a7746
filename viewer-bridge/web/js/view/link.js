// The fragment of the address: the token, the scene, the camera pose, the colours, and the display toggles.

import { QUANTITIES } from "../state/quantity.js";

/** @typedef {{ target: import("../geometry/math.js").Vec3, distance: number, yaw: number, pitch: number }} CameraPose */
/** @typedef {{ token: string | null, scene: string | null, camera: CameraPose | null, colour: import("../state/quantity.js").Quantity, toggles: Record<string, boolean> }} Link */

/** Significant digits of a pose: well below a thousandth of the picture, in any unit. */
const DIGITS = 5;

/** @param {string} hash with or without its "#" @returns {Link} */
export function parseLink(hash) {
  const fields = new URLSearchParams(hash.replace(/^#/, ""));
  /** @type {Record<string, boolean>} */
  const toggles = {};
  for (const [name, value] of fields) if (name.startsWith("show.")) toggles[name.slice(5)] = value === "1";
  return { token: fields.get("token") || null, scene: fields.get("scene") || null, camera: parsePose(fields.get("camera")), colour: QUANTITIES.find((one) => one === fields.get("colour")) ?? "strain", toggles };
}

/** Parses a pose. Returns null for anything else: a link may be truncated or edited by hand. @param {string | null} text @returns {CameraPose | null} */
function parsePose(text) {
  if (text === null) return null;
  const numbers = text.split(",").map(Number);
  const [x, y, z, distance, yaw, pitch] = numbers;
  if (numbers.length !== 6 || !numbers.every(Number.isFinite) || distance <= 0) return null;
  return { target: [x, y, z], distance, yaw, pitch };
}

/** Formats the fragment, without a token. @param {Omit<Link, "token">} link */
export function formatLink(link) {
  const fields = [];
  if (link.scene !== null) fields.push(`scene=${encodeURIComponent(link.scene)}`);
  if (link.camera !== null) {
    const { target, distance, yaw, pitch } = link.camera;
    fields.push(`camera=${[...target, distance, yaw, pitch].map((number) => Number(number.toPrecision(DIGITS))).join(",")}`);
  }
  if (link.colour !== "strain") fields.push(`colour=${link.colour}`);
  for (const [name, isOn] of Object.entries(link.toggles)) fields.push(`show.${encodeURIComponent(name)}=${isOn ? 1 : 0}`);
  return fields.join("&");
}

/** Shows a pose, asks before a scene is loaded, and says that there is no such scene.
 * @typedef {{ show(pose: CameraPose | null): void, ask(wanted: string, present: string): void, miss(wanted: string): void }} Follower */

/** A link to another scene never loads it by itself: others may look at the one on show.
 * @param {Link} link @param {import("../state/simulation.js").Simulation} simulation @param {Follower} follower */
export function followLink({ scene: wanted, camera }, simulation, follower) {
  let isFollowed = false;
  const follow = () => {
    const { hello, isAlive, isRecording, node, scene } = simulation;
    if (isFollowed || hello === null || node === null || scene === null) return;
    const isHere = wanted === null || wanted === scene.name || isRecording;
    // The first scene can arrive before the news that its node runs.
    if (!isHere && !isAlive) return;
    isFollowed = true;
    if (isHere) follower.show(camera);
    else if (hello.scenes.some((one) => one.name === wanted)) follower.ask(wanted, scene.name);
    else follower.miss(wanted);
  };
  // Runs before the first frame of the scene, when the view applies the linked pose.
  simulation.on("scene", follow);
  simulation.on("node", follow);
}
