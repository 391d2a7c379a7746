// The timeline of a recording: playback, and the check of its hashes.

import { enable, find, make } from "../ui/dom.js";
import { clockText } from "./timeline.js";

/** @typedef {import("./timeline-bar.js").Track} Track */

/** Rates to choose from; a different rate set by another page is added. */
const RATES = [0.1, 0.25, 0.5, 1, 2, 5, 10];

/** @implements {Track} */
export class ReplayTrack {
  /** @param {import("../state/simulation.js").Simulation} simulation @param {import("../net/commands.js").Commands} commands */
  constructor(simulation, commands) {
    this.name = /** @type {const} */ ("replay");
    this.simulation = simulation;
    this.commands = commands;
    this.rate = find("rate", HTMLSelectElement);
    this.play = find("play", HTMLButtonElement);
    this.loop = find("loop", HTMLButtonElement);
    this.hashes = find("hashes", HTMLOutputElement);
    this.onChange = () => {};
    this.play.addEventListener("click", () => commands.run(simulation.playback?.is_playing ? "pause" : "resume"));
    this.loop.addEventListener("click", () => commands.run("loop", { is_on: !(simulation.playback?.is_looping ?? false) }));
    this.rate.addEventListener("change", () => commands.run("rate", { value: Number(this.rate.value) }));
    simulation.on("timeline", () => this.showRecording());
    simulation.on("playback", () => this.showPlayback());
    simulation.on("connection", () => this.showConnection());
  }

  get isThere() {
    return this.simulation.timeline !== null;
  }

  get rateHz() {
    return this.simulation.timeline?.rate_hz ?? 1;
  }

  get marks() {
    return this.simulation.timeline?.marks ?? [];
  }

  get place() {
    return this.simulation.frame?.step ?? this.simulation.playback?.step ?? null;
  }

  range() {
    const { first_step: first, last_step: last } = this.simulation.timeline ?? { first_step: 0, last_step: 0 };
    return { first, last };
  }

  /** @param {number} step */
  clock(step) {
    return `${clockText(step / this.rateHz)} / ${clockText(this.range().last / this.rateHz)}`;
  }

  /** @param {number} step @param {() => void} done */
  seek(step, done) {
    return this.commands.run("seek", { step }, done);
  }

  /** @param {number} count */
  step(count) {
    if (this.simulation.playback?.is_playing) this.commands.run("pause");
    this.commands.run("step", { count });
  }

  showRecording() {
    const { timeline } = this.simulation;
    if (timeline !== null) {
      this.hashes.textContent = timeline.hash_text;
      this.hashes.classList.toggle("is-good", timeline.hashes === "verified");
      this.hashes.classList.toggle("is-bad", timeline.hashes === "diverged");
      this.hashes.title = timeline.file;
    }
    this.onChange();
  }

  /** Disables the controls without a connection. */
  showConnection() {
    const reason = this.simulation.isConnected ? "" : "There is no connection to the bridge.";
    for (const control of [this.play, this.loop, this.rate]) enable(control, reason);
    this.showPlayback();
  }

  showPlayback() {
    const { playback, isConnected } = this.simulation;
    if (playback === null) return;
    const isPlaying = playback.is_playing && isConnected;
    this.play.setAttribute("aria-pressed", String(isPlaying));
    this.play.setAttribute("aria-label", isPlaying ? "Pause" : "Play");
    this.loop.setAttribute("aria-pressed", String(playback.is_looping));
    const rates = [...new Set([...RATES, playback.rate])].sort((a, b) => a - b);
    this.rate.replaceChildren(...rates.map((rate) => make("option", { value: rate, selected: rate === playback.rate }, `${rate} ×`)));
    this.onChange();
  }
}
