// Commands by hand: a choice of the command, a field for each of its values, and the answer of the node.

import { sentence } from "../ui/banner.js";
import { enable, find, make } from "../ui/dom.js";
import { exampleOf, fieldsOf } from "./command-fields.js";
import { ACTIONS } from "./tables.js";

export class CommandForm {
  /** @param {import("../tools/tool.js").App} app */
  constructor(app) {
    this.app = app;
    this.form = find("command-form", HTMLFormElement);
    this.choice = find("command", HTMLSelectElement);
    this.rows = find("command-fields", HTMLElement);
    this.send = find("command-send", HTMLButtonElement);
    this.answer = find("command-answer", HTMLOutputElement);
    /** @type {HTMLInputElement[]} */
    this.inputs = [];
    /** The texts per field, which other commands share. @type {Map<string, string>} */
    this.texts = new Map();
    this.choice.append(...Object.keys(ACTIONS).map((name) => make("option", { value: name }, name)));
    this.choice.addEventListener("change", () => this.build());
    this.form.addEventListener("submit", (event) => {
      event.preventDefault();
      this.submit();
    });
    for (const topic of /** @type {const} */ (["node", "connection", "hello"])) app.simulation.on(topic, () => this.update());
    this.build();
    this.update();
  }

  build() {
    this.inputs = ACTIONS[this.choice.value].map((field) => {
      const { name, isOptional } = field;
      const example = exampleOf(field);
      const input = make("input", { type: "text", class: "value", placeholder: isOptional ? `${example} (optional)` : example, autocomplete: "off", spellcheck: "false" });
      input.value = this.texts.get(name) ?? "";
      input.addEventListener("input", () => this.texts.set(name, input.value));
      return input;
    });
    this.rows.replaceChildren(...this.inputs.map((input, index) => make("label", {}, make("span", {}, ACTIONS[this.choice.value][index].name), input)));
    this.answer.textContent = "";
  }

  update() {
    const { isReplay, isConnected, isAlive } = this.app.simulation;
    const reason = isReplay ? "A recording cannot be changed." : !isConnected ? "There is no connection to the bridge." : isAlive ? "" : "No node is running.";
    enable(this.send, reason);
  }

  submit() {
    const command = this.choice.value;
    const message = fieldsOf(command, this.inputs.map(({ value }) => value));
    this.answer.textContent = "";
    if ("fault" in message) return this.say(message.fault, true);
    this.app.commands.run(command, message.fields, ({ status, step, applied, text, reason }) => {
      if (this.choice.value !== command) return false;
      if (status === "applied") this.say(step === null ? "Nothing to do." : `Applied in step ${step}${applied > 1 ? ` (${applied} parts)` : ""}.`, false);
      else this.say(sentence(text || reason), true);
      return true;
    });
  }

  /** @param {string} text @param {boolean} isWrong */
  say(text, isWrong) {
    this.answer.textContent = text;
    this.answer.classList.toggle("is-wrong", isWrong);
  }
}
