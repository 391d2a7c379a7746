// The button that records the simulation on the host of the bridge, and the state of the recording,
// which all pages share.

import { sentence } from "../ui/banner.js";
import { enable, find } from "../ui/dom.js";
import { trim } from "../ui/format.js";

export class RecordingControl {
  /** @param {import("../tools/tool.js").App} app @param {string | null} token */
  constructor({ simulation, commands }, token) {
    this.simulation = simulation;
    this.commands = commands;
    this.token = token;
    this.button = find("record", HTMLButtonElement);
    this.title = this.button.title;
    this.label = find("record-label", HTMLElement);
    this.line = find("recording", HTMLElement);
    this.text = find("recording-text", HTMLOutputElement);
    this.open = find("recording-open", HTMLAnchorElement);
    this.close = find("recording-close", HTMLButtonElement);
    /** For screen readers: the start and the end, but not each number. */
    this.said = find("recording-said", HTMLElement);
    /** The line of the last recording is closed: by the user, after a while, or because this page has not seen it run. */
    this.isClosed = true;
    /** This page has asked for the newest recording, or for its end. */
    this.isOwn = false;
    /** This page has asked for a recording that has not begun. */
    this.hasAsked = false;
    this.wasRunning = false;
    this.timer = 0;
    this.button.addEventListener("click", () => this.toggle());
    this.close.addEventListener("click", () => this.closeLine());
    for (const topic of /** @type {const} */ (["hello", "node", "connection"])) simulation.on(topic, () => this.show());
    simulation.on("recording", () => this.update());
  }

  toggle() {
    if (this.button.disabled) return;
    const isEnd = isRunning(this.simulation.recording);
    if (isEnd) this.isOwn = true;
    else this.hasAsked = true;
    this.commands.run(isEnd ? "stop_recording" : "record");
  }

  update() {
    const { recording } = this.simulation;
    clearTimeout(this.timer);
    const isNew = isRunning(recording) && !this.wasRunning;
    this.wasRunning = isRunning(recording);
    if (isNew) [this.isOwn, this.hasAsked] = [this.hasAsked, false];
    if (isRunning(recording)) this.isClosed = false;
    else if (!this.isClosed) this.closeLater(endsAfterMs(recording, this.isOwn));
    this.show();
    const isQuiet = recording === null || recording.state === "idle" || recording.state === "unavailable";
    const said = isQuiet ? "" : isRunning(recording) ? "Recording." : describe(recording);
    if (this.said.textContent !== said) this.said.textContent = said;
  }

  /** Closes the line of a recording that has ended. @param {number} ms */
  closeLater(ms) {
    if (ms < Infinity) this.timer = setTimeout(() => this.closeLine(), ms);
  }

  closeLine() {
    this.isClosed = true;
    this.show();
  }

  show() {
    const { recording, isConnected, isReplay, node } = this.simulation;
    const isNow = isConnected && isRunning(recording);
    this.button.dataset.title = isNow ? "Stop the recording" : this.title;
    enable(this.button, reasonAgainst(recording, { isConnected, isReplay, hasNode: node?.state === "alive" }));
    this.button.setAttribute("aria-pressed", String(isNow));
    const label = isNow ? "Stop" : "Record";
    if (this.label.textContent !== label) this.label.textContent = label;
    const hasEnded = recording?.state === "finished" || recording?.state === "failed";
    this.line.hidden = !isNow && !(isConnected && hasEnded && !this.isClosed);
    if (recording === null || this.line.hidden) return;
    this.line.dataset.state = recording.state;
    this.line.title = recording.path ?? "";
    this.text.textContent = describe(recording);
    this.close.hidden = isNow;
    this.open.hidden = recording.name === null;
    if (recording.name !== null) this.open.href = replayAddress(recording.name, this.token);
  }
}

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
