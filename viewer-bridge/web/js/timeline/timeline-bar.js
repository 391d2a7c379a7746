// The timeline of a recording: marks, scrubbing and playback. Positions are steps, as in commands.

import { cssColor, enable, find, make, sharpContext } from "../ui/dom.js";
import { Scale, SeekGate, clockText, marksByPixel } from "./timeline.js";

/** Rates to choose from; a different rate set by another page is added. */
const RATES = [0.1, 0.25, 0.5, 1, 2, 5, 10];
/** Colour and row per kind of mark. */
const MARKS = { tear: ["--accent", 0], pin: ["--plot-a", 1], command: ["--plot-c", 1], late: ["--plot-b", 2] };
const ROW_HEIGHT = 5;
/** Least interval between updates of the clock during playback. */
const SHOW_INTERVAL_MS = 100;

export class TimelineBar {
  /** @param {import("../state/simulation.js").Simulation} simulation @param {import("../net/commands.js").Commands} commands */
  constructor(simulation, commands) {
    this.simulation = simulation;
    this.commands = commands;
    this.element = find("timeline", HTMLElement);
    this.slider = find("seek", HTMLInputElement);
    this.canvas = find("marks", HTMLCanvasElement);
    this.clock = find("clock", HTMLOutputElement);
    this.rate = find("rate", HTMLSelectElement);
    this.play = find("play", HTMLButtonElement);
    this.loop = find("loop", HTMLButtonElement);
    this.hashes = find("hashes", HTMLOutputElement);
    // An answer reopens the gate in the next animation frame, once the step has been drawn.
    this.gate = new SeekGate((step, done) => commands.run("seek", { step }, () => requestAnimationFrame(() => {
      done();
      if (simulation.frame !== null) this.follow(simulation.frame.step);
    })));
    this.isScrubbing = false;
    this.shownMs = 0;
    this.listen();
  }

  listen() {
    const { simulation, slider } = this;
    slider.addEventListener("input", () => {
      this.isScrubbing = true;
      this.gate.request(slider.valueAsNumber);
      this.showStep(slider.valueAsNumber);
    });
    // A slider that is released where it was pressed fires no change event.
    for (const type of ["change", "pointerup", "pointercancel", "blur"]) slider.addEventListener(type, () => { this.isScrubbing = false; });
    find("back", HTMLButtonElement).addEventListener("click", () => this.step(-1));
    find("forward", HTMLButtonElement).addEventListener("click", () => this.step(1));
    this.play.addEventListener("click", () => this.togglePlay());
    this.loop.addEventListener("click", () => this.commands.run("loop", { is_on: !(simulation.playback?.is_looping ?? false) }));
    this.rate.addEventListener("change", () => this.commands.run("rate", { value: Number(this.rate.value) }));
    new ResizeObserver(() => this.drawMarks()).observe(this.canvas);
    simulation.on("timeline", () => this.showRecording());
    simulation.on("playback", () => this.showPlayback());
    simulation.on("frame", (frame) => this.follow(frame.step));
    simulation.on("connection", () => this.showConnection());
  }

  /** Disables the controls without a connection. */
  showConnection() {
    const reason = this.simulation.isConnected ? "" : "There is no connection to the bridge.";
    for (const control of this.element.querySelectorAll("button, input, select")) enable(/** @type {HTMLButtonElement} */ (control), reason);
    // A disabled slider reports no release.
    this.isScrubbing = false;
    this.showPlayback();
  }

  togglePlay() {
    this.commands.run(this.simulation.playback?.is_playing ? "pause" : "resume");
  }

  /** @param {number} count */
  step(count) {
    if (this.simulation.playback?.is_playing) this.commands.run("pause");
    this.commands.run("step", { count });
  }

  showRecording() {
    const { timeline } = this.simulation;
    this.element.hidden = timeline === null;
    if (timeline === null) return;
    this.slider.min = String(timeline.first_step);
    this.slider.max = String(timeline.last_step);
    this.hashes.textContent = timeline.hash_text;
    this.hashes.classList.toggle("is-good", timeline.hashes === "verified");
    this.hashes.classList.toggle("is-bad", timeline.hashes === "diverged");
    this.hashes.title = timeline.file;
    this.drawMarks();
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
    this.follow(playback.step);
  }

  /** Moves the slider to the shown step, except while the user scrubs or a seek is in flight. @param {number} step */
  follow(step) {
    if (this.element.hidden || this.isScrubbing || this.gate.isBusy) return;
    this.slider.valueAsNumber = step;
    const now = performance.now();
    if (now - this.shownMs < SHOW_INTERVAL_MS && !this.simulation.isPaused) return;
    this.shownMs = now;
    this.showStep(step);
  }

  /** @param {number} step */
  showStep(step) {
    const rate = this.simulation.timeline?.rate_hz ?? 1;
    const last = this.simulation.timeline?.last_step ?? 0;
    this.clock.textContent = `${clockText(step / rate)} / ${clockText(last / rate)}`;
    this.slider.setAttribute("aria-valuetext", `step ${step}, ${clockText(step / rate)}`);
  }

  drawMarks() {
    const { timeline } = this.simulation;
    if (timeline === null || this.element.hidden) return;
    const { context, width } = sharpContext(this.canvas);
    const scale = new Scale(timeline.first_step, timeline.last_step);
    for (const [kind, pixels] of marksByPixel(timeline.marks, scale, width)) {
      const [color, row] = MARKS[/** @type {keyof typeof MARKS} */ (kind)] ?? ["--soft", 1];
      context.fillStyle = cssColor(String(color));
      for (const pixel of pixels.keys()) context.fillRect(pixel - 0.5, Number(row) * ROW_HEIGHT, 2, ROW_HEIGHT - 1);
    }
    const counts = new Map();
    for (const { kind, count } of timeline.marks) counts.set(kind, (counts.get(kind) ?? 0) + count);
    this.canvas.title = [...counts].map(([kind, count]) => `${kind}: ${count}`).join(", ");
  }
}
