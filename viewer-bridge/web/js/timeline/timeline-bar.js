// The timeline under the picture: marks, scrubbing and stepping. Positions are steps, as in commands. It
// shows a recording, or the past of a live simulation.

import { enable, find } from "../ui/dom.js";
import { MarkRow, stepOfMark } from "./marks.js";
import { Scale, SeekGate, clockText } from "./timeline.js";

/** @typedef {import("./timeline.js").Track} Track */

/** Least interval between updates of the timeline while time passes, and between drawings of marks that move. */
const SHOW_INTERVAL_MS = 100;
const MARKS_INTERVAL_MS = 500;

export class TimelineBar {
  /** @param {import("../state/simulation.js").Simulation} simulation @param {{ replay: Track, live: Track }} tracks */
  constructor(simulation, tracks) {
    this.simulation = simulation;
    this.tracks = tracks;
    this.element = find("timeline", HTMLElement);
    this.slider = find("seek", HTMLInputElement);
    this.back = find("back", HTMLButtonElement);
    this.forward = find("forward", HTMLButtonElement);
    this.previousMark = find("previous-mark", HTMLButtonElement);
    this.nextMark = find("next-mark", HTMLButtonElement);
    this.marks = new MarkRow((step) => this.track.showMark(step), () => this.show());
    this.clock = find("clock", HTMLOutputElement);
    // An answer reopens the gate in the next animation frame, once the step has been drawn.
    this.gate = new SeekGate((step, done) => this.track.seek(step, () => requestAnimationFrame(() => {
      done();
      this.follow(true);
    })));
    this.isScrubbing = false;
    this.shownMs = 0;
    this.marksMs = 0;
    this.listen();
    this.show();
  }

  get track() {
    return this.simulation.isReplay ? this.tracks.replay : this.tracks.live;
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
    this.back.addEventListener("click", () => this.step(-1));
    this.forward.addEventListener("click", () => this.step(1));
    this.previousMark.addEventListener("click", () => this.goToMark(-1));
    this.nextMark.addEventListener("click", () => this.goToMark(1));
    new ResizeObserver(() => this.drawMarks()).observe(this.marks.canvas);
    for (const track of [this.tracks.replay, this.tracks.live]) track.onChange = () => this.show();
    simulation.on("hello", () => this.show());
    simulation.on("connection", () => this.showConnection());
    // No frame may follow that of a pause or of the past.
    simulation.on("frame", () => this.follow(simulation.isPaused || simulation.isLookingBack));
    simulation.on("present", () => this.follow(false));
  }

  /** Ends a scrub, because a slider that is disabled meanwhile reports no release. */
  showConnection() {
    this.isScrubbing = false;
    this.show();
  }

  /** The reason why the timeline cannot be moved, or "". */
  reasonAgainst() {
    if (!this.simulation.isConnected) return "There is no connection to the bridge.";
    return this.track.isThere ? "" : "There is nothing to show yet.";
  }

  /** @param {number} count */
  step(count) {
    if (this.track.isThere) this.track.step(count);
  }

  /** Shows the nearest mark after the state on show, or before it. @param {number} direction */
  goToMark(direction) {
    const { track } = this;
    if (!track.isThere || track.place === null) return;
    const step = stepOfMark(this.marks.shown(track.marks), track.place, direction);
    if (step !== null) track.showMark(step);
  }

  /** Shows the range and the marks of the track. An empty timeline keeps its place, so that the picture never jumps. */
  show() {
    const { track } = this;
    this.element.dataset.track = track.name;
    this.element.setAttribute("aria-label", track.name === "live" ? "History" : "Recording");
    const reason = this.reasonAgainst();
    for (const control of [this.back, this.forward, this.slider]) enable(control, reason);
    const reasonOfMarks = reason || (this.marks.shown(track.marks).length > 0 ? "" : track.marks.length > 0 ? "All marks are switched off in the legend." : "There are no marks.");
    for (const control of [this.previousMark, this.nextMark]) enable(control, reasonOfMarks);
    this.marksMs = 0;
    this.follow(true);
    if (this.marksMs === 0) this.drawMarks();
  }

  /** Moves the slider to the step on show, except while the user scrubs or a seek is in flight. @param {boolean} isUrgent shows it at once */
  follow(isUrgent) {
    const { track, slider } = this;
    if (!track.isThere || this.isScrubbing || this.gate.isBusy || track.place === null) return;
    const now = performance.now();
    if (!isUrgent && now - this.shownMs < SHOW_INTERVAL_MS) return;
    this.shownMs = now;
    const { first, last } = track.range();
    [slider.min, slider.max] = [String(first), String(last)];
    slider.valueAsNumber = track.place;
    this.showStep(track.place);
    // The range of a live timeline moves all the time.
    const isDue = track.name === "replay" || now - this.marksMs >= MARKS_INTERVAL_MS;
    if (this.marksMs !== 0 && !(isDue && this.marks.isOutside(first, last))) return;
    this.marksMs = now;
    this.drawMarks();
  }

  /** @param {number} step */
  showStep(step) {
    const { track } = this;
    this.clock.textContent = track.clock(step);
    this.clock.title = `Step ${step}, simulated time ${clockText(step / track.rateHz)}`;
    this.slider.setAttribute("aria-valuetext", `step ${step}, ${clockText(track.sinceBegin(step))}`);
  }

  drawMarks() {
    this.marks.draw(this.track, new Scale(Number(this.slider.min), Number(this.slider.max)));
  }
}
