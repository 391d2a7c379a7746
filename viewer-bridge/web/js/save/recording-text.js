// The words about a recording of the simulation.

import { trim } from "../ui/format.js";
import { sentence } from "../ui/banner.js";

/** @typedef {import("../net/messages.js").RecordingMessage} Recording */

const UNITS = ["kB", "MB", "GB", "TB"];

/** A time as on a clock: minutes and seconds, and hours if there are any. @param {number} seconds */
export function clock(seconds) {
  const whole = Math.max(0, Math.floor(seconds));
  const two = (/** @type {number} */ number) => String(number).padStart(2, "0");
  const [hours, minutes] = [Math.floor(whole / 3600), Math.floor(whole / 60) % 60];
  return hours > 0 ? `${hours}:${two(minutes)}:${two(whole % 60)}` : `${minutes}:${two(whole % 60)}`;
}

/** A size with a decimal prefix, as the recorder writes it. @param {number} bytes */
export function readableBytes(bytes) {
  if (bytes < 1000) return `${bytes} B`;
  const power = Math.min(UNITS.length, Math.floor(Math.log10(bytes) / 3));
  return `${trim(bytes / 1000 ** power)} ${UNITS[power - 1]}`;
}

/** The losses. @param {Record<string, number>} lost numbers of missing messages by topic */
export function losses(lost) {
  const topics = Object.entries(lost);
  return topics.length === 0 ? "nothing lost" : `lost ${topics.map(([topic, count]) => `${count} ${topic}`).join(", ")}`;
}

/** Describes the recording in a line. @param {Recording} recording */
export function describe({ state, text, seconds, snapshots, size_bytes: size, lost }) {
  if (state === "failed") return sentence(`recording failed: ${text}`);
  const numbers = [clock(seconds), readableBytes(size), losses(lost)].join(" · ");
  if (state === "finished") return `${text === "" ? "Recorded" : sentence(text)} ${numbers}`;
  if (state === "finishing") return `Finishing · ${numbers}`;
  return snapshots === 0 ? `${clock(seconds)} · waits for the next step` : numbers;
}

/** True while a recording is being made. @param {Recording | null} recording */
export const isRunning = (recording) => recording?.state === "recording" || recording?.state === "finishing";

/** Time for which a page shows a finished recording of another page, in ms. */
const OF_OTHERS_MS = 15_000;

/** Time after which the line of a recording that has ended goes away by itself: the page that has asked for the recording, and one
 * that is to know of a failure, keep it. @param {Recording | null} recording @param {boolean} isOwn */
export const endsAfterMs = (recording, isOwn) => (isOwn || recording?.state === "failed" ? Infinity : OF_OTHERS_MS);

/** The reason why the button does nothing, or "".
 * @param {Recording | null} recording @param {{ isConnected: boolean, isReplay: boolean, hasNode: boolean }} page */
export function reasonAgainst(recording, { isConnected, isReplay, hasNode }) {
  if (!isConnected) return "There is no connection to the bridge.";
  if (isReplay) return "This is a recording already.";
  if (recording === null) return "This bridge makes no recordings.";
  if (recording.state === "unavailable") return sentence(recording.text);
  if (recording.state === "finishing") return "The end of the recording is being written.";
  // A recording can also be stopped without a node.
  return hasNode || isRunning(recording) ? "" : "No node is running.";
}

/** The address of the page of a recording, relative to that of the live page. @param {string} name @param {string | null} token */
export const replayAddress = (name, token) => `replay/${encodeURIComponent(name)}/${token === null ? "" : `#token=${encodeURIComponent(token)}`}`;
