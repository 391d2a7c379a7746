// The timeline of a recording: playback, and the check of its hashes.

import { enable, find, make } from "../ui/dom.js";
import { Notches } from "../tools/notches.js";
import { clockText, zoomed } from "./timeline.js";

/** @typedef {import("./timeline.js").Track} Track */

/** Rates to choose from; a different rate set by another page is added. */
const RATES = [0.1, 0.25, 0.5, 1, 2, 5, 10];

/** States of a ghost whose text is about to change. */
const PROGRESS = new Set(["opening", "comparing"]);

/** The address of a recording, seen from the page of another or from that of the newest. @param {string} path of the page @param {string} name */
export const addressBeside = (path, name) => `${path.replace(/(replay\/[^/]+\/)?[^/]*$/, "")}replay/${encodeURIComponent(name)}/`;

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
    this.loopStart = find("loop-start", HTMLButtonElement);
    this.loopEnd = find("loop-end", HTMLButtonElement);
    this.zoom = find("zoom", HTMLSelectElement);
    this.notches = new Notches();
    /** The part of the recording on show. */
    this.current = { first: 0, last: 0 };
    this.file = find("file", HTMLSelectElement);
    this.ghost = find("ghost", HTMLSelectElement);
    this.ghostNote = find("ghost-note", HTMLOutputElement);
    this.hashes = find("hashes", HTMLOutputElement);
    /** Recordings of the folder. @type {string[]} */
    this.names = [];
    /** Recordings in the list of ghosts. @type {string[] | null} */
    this.ghostNames = null;
    this.onChange = () => {};
    this.play.addEventListener("click", () => commands.run(simulation.playback?.is_playing ? "pause" : "resume"));
    this.loop.addEventListener("click", () => commands.run("loop", { is_on: !(simulation.playback?.is_looping ?? false) }));
    this.loopStart.addEventListener("click", () => this.loopFrom());
    this.loopEnd.addEventListener("click", () => this.loopTo());
    this.zoom.addEventListener("change", () => this.onChange());
    find("track", HTMLElement).addEventListener("wheel", (event) => this.zoomBy(event), { passive: false });
    this.rate.addEventListener("change", () => commands.run("set", { parameter: "time_scale", value: Number(this.rate.value) }));
    this.file.addEventListener("change", () => { location.href = addressBeside(location.pathname, this.file.value); });
    this.ghost.addEventListener("change", () => commands.run("ghost", this.ghost.value === "" ? {} : { name: this.ghost.value }, () => this.showGhost()));
    simulation.on("ghost", () => this.showGhost());
    simulation.on("hello", ({ recordings = [] }) => this.showFiles(recordings));
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
    const marks = this.simulation.timeline?.marks ?? [];
    const step = this.simulation.ghostChoice?.first_different_step ?? null;
    return step === null ? marks : [...marks, { kind: /** @type {const} */ ("ghost"), step, count: 1 }];
  }

  get place() {
    return this.simulation.frame?.step ?? this.simulation.playback?.step ?? null;
  }

  get looped() {
    return this.simulation.playback?.loop_steps ?? null;
  }

  get whole() {
    const { first_step: first, last_step: last } = this.simulation.timeline ?? { first_step: 0, last_step: 0 };
    return { first, last };
  }

  /** The part of the recording on show. */
  range() {
    const length = Math.max(0, Math.round(Number(this.zoom.value) * this.rateHz));
    this.current = zoomed(this.whole, this.current, this.place ?? this.whole.first, length);
    return this.current;
  }

  /** Time since the beginning of the recording, in s. @param {number} step */
  sinceBegin(step) {
    return (step - this.whole.first) / this.rateHz;
  }

  /** @param {number} step */
  clock(step) {
    return `${clockText(this.sinceBegin(step))} / ${clockText(this.sinceBegin(this.whole.last))}`;
  }

  /** Zooms in or out by one level for each notch of the wheel. @param {WheelEvent} event */
  zoomBy(event) {
    if (!this.isThere || this.zoom.disabled) return;
    event.preventDefault();
    const notch = this.notches.add(event);
    if (notch === 0) return;
    const index = this.zoom.selectedIndex - notch;
    this.zoom.selectedIndex = Math.min(Math.max(0, index), this.zoom.options.length - 1);
    this.onChange();
  }

  /** Repeats the recording from the state on show, up to the end of the loop if that is later. */
  loopFrom() {
    const { place, looped } = this;
    if (place === null) return;
    const isEnd = looped !== null && looped[1] > place;
    this.commands.run("loop", isEnd ? { is_on: true, first_step: place, last_step: looped[1] } : { is_on: true, first_step: place });
  }

  /** Repeats the recording up to the state on show, from the start of the loop if that is earlier. */
  loopTo() {
    const { place, looped } = this;
    if (place === null) return;
    const isStart = looped !== null && looped[0] < place;
    this.commands.run("loop", isStart ? { is_on: true, first_step: looped[0], last_step: place } : { is_on: true, last_step: place });
  }

  /** @param {number} step */
  showMark(step) {
    this.commands.run("seek", { step });
  }

  /** @param {number} step @param {() => void} done */
  seek(step, done) {
    return this.commands.run("seek", { step }, done);
  }

  /** @param {number} count */
  step(count) {
    if (this.simulation.playback?.is_playing) this.commands.run("pause");
    if (count > 0) this.commands.run("step", { count });
    else this.commands.run("step_back", { count: -count });
  }

  showRecording() {
    const { timeline } = this.simulation;
    if (timeline !== null) {
      this.hashes.textContent = timeline.hash_text;
      this.hashes.classList.toggle("is-good", timeline.hashes === "verified");
      this.hashes.classList.toggle("is-bad", timeline.hashes === "diverged");
      this.hashes.title = timeline.file;
      this.showFile();
      this.showGhost();
    }
    this.onChange();
  }

  /** Offers the recordings of the folder. @param {string[]} names */
  showFiles(names) {
    find("file-choice", HTMLElement).hidden = names.length < 2;
    this.file.replaceChildren(...names.map((name) => make("option", { value: name }, name)));
    this.names = names;
    this.showFile();
    this.showGhost();
  }

  /** Offers the other recordings as ghosts, and shows the comparison with the chosen one. */
  showGhost() {
    const { ghostChoice } = this.simulation;
    const given = ghostChoice?.given ?? null;
    const others = this.names.filter((name) => name !== this.shownName && name !== given);
    const names = given === null ? others : [given, ...others];
    find("ghost-choice", HTMLElement).hidden = names.length === 0;
    // An open list would close.
    if (String(names) !== String(this.ghostNames)) {
      this.ghostNames = names;
      this.ghost.replaceChildren(make("option", { value: "" }, "none"), ...names.map((name) => make("option", { value: name }, name)));
    }
    this.ghost.value = ghostChoice?.name ?? "";
    // Screen readers announce the result, not the progress.
    this.ghostNote.ariaLive = ghostChoice === null || PROGRESS.has(ghostChoice.state) ? "off" : "polite";
    this.ghostNote.textContent = this.ghostNote.title = ghostChoice?.text ?? "";
    this.ghostNote.classList.toggle("is-good", ghostChoice?.state === "equal");
    this.ghostNote.classList.toggle("is-bad", ghostChoice?.state === "failed");
    this.onChange();
  }

  /** Name of the recording on show. */
  get shownName() {
    return this.simulation.timeline?.file.replace(/\.mcap$/, "") ?? "";
  }

  /** Chooses the recording on show. */
  showFile() {
    this.file.value = this.shownName;
  }

  /** Disables the controls without a connection. */
  showConnection() {
    const reason = this.simulation.isConnected ? "" : "There is no connection to the bridge.";
    for (const control of [this.play, this.loop, this.loopStart, this.loopEnd, this.rate, this.zoom, this.file, this.ghost]) enable(control, reason);
    this.showPlayback();
  }

  showPlayback() {
    const { playback, isConnected } = this.simulation;
    if (playback === null) return;
    const isPlaying = playback.is_playing && isConnected;
    this.play.setAttribute("aria-pressed", String(isPlaying));
    this.play.setAttribute("aria-label", isPlaying ? "Pause" : "Play");
    this.loop.setAttribute("aria-pressed", String(playback.is_looping));
    const { looped, whole } = this;
    this.loopStart.setAttribute("aria-pressed", String(looped !== null && looped[0] > whole.first));
    this.loopEnd.setAttribute("aria-pressed", String(looped !== null && looped[1] < whole.last));
    const rates = [...new Set([...RATES, playback.rate])].sort((a, b) => a - b);
    this.rate.replaceChildren(...rates.map((rate) => make("option", { value: rate, selected: rate === playback.rate }, `${rate} ×`)));
    this.onChange();
  }
}
