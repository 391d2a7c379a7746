// The button that records the simulation on the host of the bridge, and the state of the recording,
// which all pages share.

import { enable, find } from "../ui/dom.js";
import { describe, endsAfterMs, isRunning, reasonAgainst, replayAddress } from "./recording-text.js";

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
