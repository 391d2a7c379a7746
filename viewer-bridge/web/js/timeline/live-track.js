// The timeline of a live simulation: looking back, returning to the present, and going on from an earlier
// state. Looking back changes nothing for the simulation or for other pages.

import { find } from "../ui/dom.js";
import { askOthers } from "../ui/prompts.js";
import { clockText } from "./timeline.js";

/** @typedef {import("./timeline.js").Track} Track */
/** @typedef {import("../net/messages.js").OutcomeMessage} Outcome */

/** The steps from `first` to `last` of the last `seconds`, or all of them if it is 0. @param {number} first @param {number} last @param {number} seconds @param {number} rateHz */
export function rangeOfLast(first, last, seconds, rateHz) {
  const earliest = seconds === 0 ? first : Math.max(first, last - Math.round(seconds * rateHz));
  return { first: Math.min(earliest, last), last };
}

/** Text for the user after the page has gone on from an earlier state. @param {number} step the state that it showed @param {Outcome} outcome @param {number} rateHz */
export function goneOnText(step, { step: now, state_step }, rateHz) {
  // The clock goes on from the present, so the time of the state on it would mislead.
  const ago = (((now ?? step) - step) / rateHz).toFixed(1);
  if (state_step === undefined || state_step === step) return { text: `The simulation goes on from the state of ${ago} s ago.`, level: "info" };
  const earlier = ((step - state_step) / rateHz).toPrecision(2);
  return {
    text: `The node no longer keeps step ${step}. It goes on from step ${state_step}, ${earlier} s earlier. (sim-node run --history keeps more.)`,
    level: "warning",
  };
}

/** @implements {Track} */
export class LiveTrack {
  /** @param {import("../state/simulation.js").Simulation} simulation @param {import("../net/commands.js").Commands} commands @param {import("../ui/banner.js").Banner} banner */
  constructor(simulation, commands, banner) {
    this.name = /** @type {const} */ ("live");
    this.simulation = simulation;
    this.commands = commands;
    this.banner = banner;
    this.presentButton = find("present", HTMLButtonElement);
    this.goOnButton = find("go-on", HTMLButtonElement);
    this.span = find("span", HTMLSelectElement);
    this.note = find("history-note", HTMLOutputElement);
    this.onChange = () => {};
    /** The range on show. It stands still while the page looks back. */
    this.current = { first: 0, last: 0 };
    this.isGoingOn = false;
    this.presentButton.addEventListener("click", () => this.simulation.returnToPresent());
    this.goOnButton.addEventListener("click", () => this.askToGoOn());
    this.span.addEventListener("change", () => this.change());
    for (const topic of /** @type {const} */ (["history", "past", "node", "connection", "scene"])) simulation.on(topic, () => this.change());
  }

  get isThere() {
    const { simulation } = this;
    return simulation.hello?.mode === "live" && simulation.scene !== null;
  }

  get rateHz() {
    return this.simulation.scene?.rateHz || 1;
  }

  get marks() {
    return this.simulation.history?.marks ?? [];
  }

  get looped() {
    return null;
  }

  get place() {
    return this.simulation.frame?.step ?? null;
  }

  range() {
    const { history, present, frame, isLookingBack } = this.simulation;
    const last = present?.step ?? 0;
    if (!isLookingBack) this.current = rangeOfLast(history?.first_step ?? last, last, Number(this.span.value), this.rateHz);
    const { first } = this.current;
    return { first: Math.min(first, frame?.step ?? first), last: this.current.last };
  }

  /** Time since the load of the scene, in s. @param {number} step */
  sinceBegin(step) {
    return step / this.rateHz;
  }

  /** @param {number} step */
  clock(step) {
    const { present, isLookingBack } = this.simulation;
    const time = clockText(step / this.rateHz);
    return isLookingBack && present !== null ? `${time} (−${((present.step - step) / this.rateHz).toFixed(1)} s)` : time;
  }

  /** Looks at the last kept state at or before a step. The end of the timeline is the present. @param {number} step @param {() => void} done */
  seek(step, done) {
    if (step < this.current.last) return this.commands.run("look", { step }, done);
    this.simulation.returnToPresent();
    done();
    return true;
  }

  /** @param {number} step */
  showMark(step) {
    this.commands.run("look", { step, toward: "after" });
  }

  /** Looks at the kept state before or after the one on show. @param {number} count */
  step(count) {
    const { simulation } = this;
    if (simulation.frame === null || (count > 0 && !simulation.isLookingBack)) return;
    const step = Math.max(0, simulation.frame.step + count);
    this.commands.run("look", { step, toward: count < 0 ? "before" : "after" }, ({ state_step }) => {
      if (count > 0 && state_step !== undefined && state_step >= (simulation.present?.step ?? 0)) simulation.returnToPresent();
    });
  }

  /** Lets the simulation go on from the state on show. Asks first if other pages show the simulation. */
  askToGoOn() {
    const words = { effect: "Going on from here replaces its state for everybody.", yes: "Go on from here", no: "Keep it" };
    askOthers(this.simulation, words, () => this.goOn());
  }

  /** Lets the simulation go on from the state on show. */
  goOn() {
    const { simulation, rateHz } = this;
    if (simulation.frame === null || this.reasonAgainst() !== "") return;
    const { step } = simulation.frame;
    this.isGoingOn = this.commands.run("rewind", { to_step: step }, (outcome) => {
      this.isGoingOn = false;
      this.change();
      if (outcome.status !== "applied" || outcome.step === null) return;
      const { text, level } = goneOnText(step, outcome, rateHz);
      this.banner.notify(text, level);
      simulation.returnAt(outcome.step);
    });
    this.change();
  }

  /** The reason why the simulation cannot go on from the state on show, or "". */
  reasonAgainst() {
    const { simulation } = this;
    if (!simulation.isLookingBack) return "Move the timeline to an earlier state first.";
    if (!simulation.isConnected) return "There is no connection to the bridge.";
    if (!simulation.isAlive) return "No node is running.";
    return this.isGoingOn ? "The node has not answered yet." : "";
  }

  change() {
    const { simulation } = this;
    const reason = this.reasonAgainst();
    this.goOnButton.disabled = reason !== "";
    this.goOnButton.title = reason || "Let the simulation go on from the state on show";
    this.presentButton.disabled = !simulation.isLookingBack;
    find("timeline", HTMLElement).classList.toggle("is-past", simulation.isLookingBack);
    this.note.textContent = simulation.history?.text ?? "";
    const present = !simulation.isAlive ? "" : simulation.isPaused ? " The simulation is paused." : " The simulation goes on meanwhile.";
    this.banner.set("past", simulation.isLookingBack ? `You are looking at an earlier state.${present}` : "");
    this.onChange();
  }
}
