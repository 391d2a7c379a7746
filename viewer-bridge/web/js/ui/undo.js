// Undo: undoes what the page has changed last. The bridge knows what that is.

import { find } from "./dom.js";
import { Question } from "./prompts.js";
import { sentence } from "./banner.js";

/** @typedef {import("../net/messages.js").Undoable} Undoable */
/** @typedef {import("../net/messages.js").OutcomeMessage} Outcome */

/** Titles of the button, by the change that it undoes. @type {Record<Undoable, string>} */
const NAMES = {
  drag: "the drag", carry: "the move of a solid or an anchor", brush: "the push", pin: "the pin", unpin: "the removal of a pin",
  cut: "the cut", reset: "the reset", set: "the change of parameters", load: "the load of another scene", rewind: "the jump to an earlier state",
};

/** Tooltip of the button. @param {Undoable} what */
export const undoTitle = (what) => `Undo ${NAMES[what]} (Ctrl+Z)`;

/** Finds the reaction of the page to the answer to an undo.
 * @param {Outcome} outcome @returns {{ notice: string } | { question: string } | null} null if the answer speaks for itself */
export function reactionTo({ status, reason, text }) {
  if (status === "applied") return { notice: text };
  return reason === "changed_by_others" ? { question: sentence(text) } : null;
}

export class Undo {
  /** @param {import("../tools/tool.js").App} app @param {import("./banner.js").Banner} banner */
  constructor({ simulation, commands }, banner) {
    this.simulation = simulation;
    this.commands = commands;
    this.banner = banner;
    this.button = find("undo", HTMLButtonElement);
    this.button.addEventListener("click", () => this.run());
    simulation.on("undoable", () => { if (simulation.undoable !== null) this.button.dataset.title = undoTitle(simulation.undoable); });
  }

  /** The reason why there is nothing to undo, or "". */
  reasonAgainst() {
    return this.simulation.undoable === null ? "Nothing to undo: this page has changed nothing." : "";
  }

  run() {
    if (!this.button.disabled) this.send(false);
  }

  /** @param {boolean} takesOthers changes of others since may be undone as well */
  send(takesOthers) {
    this.commands.run("undo", takesOthers ? { takes_others: true } : {}, (outcome) => {
      const reaction = reactionTo(outcome);
      if (reaction === null) return;
      if ("notice" in reaction) this.banner.notify(reaction.notice);
      else this.ask(reaction.question);
    });
  }

  /** @param {string} text */
  ask(text) {
    new Question().ask({ text, yes: "Undo all", no: "Keep" }, (isYes) => { if (isYes) this.send(true); });
  }
}
