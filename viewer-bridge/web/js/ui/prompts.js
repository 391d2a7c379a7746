// Words to a newcomer: the hint over the cloth, and the question before a link loads a scene.

import { find } from "./dom.js";

/** Text of the hint. @param {boolean} hasSurface @param {boolean} isTouch */
export function hintText(hasSurface, isTouch) {
  const thing = hasSurface ? "Drag the cloth." : "Drag any particle.";
  return isTouch ? thing : `${thing} Right-drag cuts it.`;
}

/** A hint that disappears for good at the first use of a tool. */
export class Hint {
  /** @param {import("../tools/tool.js").App} app @param {import("../tools/input.js").Input} input */
  constructor(app, input) {
    this.element = find("hint", HTMLElement);
    this.isTouched = false;
    const show = () => {
      const { scene, frame } = app.simulation;
      this.element.hidden = this.isTouched || scene === null || frame === null || !input.canChange();
      if (scene !== null) this.element.textContent = hintText(scene.triangleCount > 0, matchMedia("(pointer: coarse)").matches);
    };
    for (const topic of /** @type {const} */ (["scene", "frame", "node", "hello", "connection"])) app.simulation.on(topic, show);
    input.onTouch = () => {
      this.isTouched = true;
      show();
    };
  }
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
