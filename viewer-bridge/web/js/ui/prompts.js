// Words to a newcomer: the hint over the cloth, and the questions before a load that others would notice.

import { find } from "./dom.js";

/** Names of the shapes of scenes. @type {Record<string, string>} */
const NAMES = { cloth: "the cloth", rope: "the rope", bridge: "the bridge", web: "the web", ragdoll: "the ragdoll" };

/** Text of the hint: what a press does in a mode.
 * @param {{ shape: string }[]} shapes of the scene @param {boolean} isTouch @param {import("../tools/input.js").Mode} mode */
export function hintText(shapes, isTouch, mode) {
  const kinds = [...new Set(shapes.map((one) => one.shape))];
  const thing = kinds.length === 0 ? "any particle" : kinds.length === 1 ? NAMES[kinds[0]] ?? "it" : "anything";
  const text = {
    grab: `Drag ${thing}.`, brush: `Drag over ${thing} to push it.`, cut: `Drag across ${thing} to cut it.`,
    pin: `${isTouch ? "Tap" : "Click"} a particle to pin it, or to remove its pin.`,
  }[mode];
  return isTouch || mode === "cut" ? text : `${text} Right-drag cuts${mode === "pin" ? "" : " it"}.`;
}

/** A hint that fades after a while, returns with another mode, and disappears for good at the first use of a tool. */
export class Hint {
  /** @param {import("../tools/tool.js").App} app @param {import("../tools/input.js").Input} input */
  constructor(app, input) {
    this.element = find("hint", HTMLElement);
    this.isTouched = false;
    const show = () => {
      const { scene, frame } = app.simulation;
      this.element.hidden = this.isTouched || scene === null || frame === null || !input.canChange();
      if (scene !== null) this.element.textContent = hintText(scene.shapes, matchMedia("(pointer: coarse)").matches, input.mode);
    };
    for (const topic of /** @type {const} */ (["scene", "frame", "node", "hello", "connection"])) app.simulation.on(topic, show);
    input.onMode = () => {
      show();
      for (const fade of this.element.getAnimations()) fade.currentTime = 0;
    };
    input.onTouch = () => {
      this.isTouched = true;
      show();
    };
  }
}

/** Does what changes the scene on every page: at once if no other page shows it, else after a question.
 * @param {import("../state/simulation.js").Simulation} simulation @param {{ effect: string, yes: string, no: string }} words `effect` is a sentence @param {() => void} act */
export function askOthers(simulation, { effect, yes, no }, act) {
  const others = (simulation.stats?.clients ?? 1) - 1;
  if (others < 1) return act();
  const text = `${others === 1 ? "Another page shows" : `${others} other pages show`} this simulation. ${effect}`;
  new Question().ask({ text, yes, no }, (isYes) => { if (isYes) act(); });
}

/** A question with two answers over the picture. It does not block the page. */
export class Question {
  constructor() {
    this.element = find("question", HTMLElement);
    this.text = find("question-text", HTMLElement);
    this.yes = find("question-yes", HTMLButtonElement);
    this.no = find("question-no", HTMLButtonElement);
  }

  /** @param {{ text: string, yes: string, no: string }} words @param {(isYes: boolean) => void} onAnswer */
  ask({ text, yes, no }, onAnswer) {
    this.text.textContent = text;
    this.yes.textContent = yes;
    this.no.textContent = no;
    this.element.hidden = false;
    for (const button of [this.yes, this.no]) button.onclick = () => {
      this.element.hidden = true;
      onAnswer(button === this.yes);
    };
    this.no.focus({ preventScroll: true });
  }
}
