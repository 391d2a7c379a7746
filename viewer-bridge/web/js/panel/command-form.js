// Commands by hand: a choice of the command, a field for each of its values, and the answer of the node.

import { sentence } from "../ui/banner.js";
import { enable, find, make } from "../ui/dom.js";
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

/** @typedef {import("./tables.js").Field} Field */

/** Examples of values, of a field or of its form. @type {Record<string, string>} */
const EXAMPLES = {
  count: "1", delta: "0 0 0.01", parameter: "damping", scene: "curtain", text: "it slips",
  whole: "0", long: "0", number: "0.2", vector: "0 1 0", rotation: "0 0 0 1", value: "0.5", kind: "structural",
};
/** Numbers per form. @type {Record<string, number>} */
const LENGTHS = { vector: 3, rotation: 4 };
/** Largest number per form. @type {Record<string, number>} */
const LARGEST = { whole: 2 ** 32 - 1, long: Number.MAX_SAFE_INTEGER };
/** Largest size of a text in UTF-8. */
const TEXT_BYTES_MAX = 160;

/** @param {Field} field */
export const exampleOf = ({ name, form }) => EXAMPLES[name] ?? EXAMPLES[form];

/** Reads the numbers in a text, separated by spaces or commas. Null if a part is not a number. @param {string} text */
function numbers(text) {
  const parts = text.split(/[\s,]+/).filter((part) => part !== "").map(Number);
  return parts.every(Number.isFinite) ? parts : null;
}

/** Reads the text of a field. A wrong one has the reason. @param {Field} field @param {string} text @returns {{ value: unknown } | { fault: string }} */
export function read(field, text) {
  const { name, form } = field;
  const trimmed = text.trim();
  const fault = (/** @type {string} */ what) => ({ fault: `${name}: ${trimmed === "" ? "missing" : `"${trimmed}" is not ${what}`} (for example ${exampleOf(field)})` });
  if (trimmed === "") return fault("");
  if (form === "kind") return { value: trimmed };
  if (form === "text") return new TextEncoder().encode(trimmed).length <= TEXT_BYTES_MAX ? { value: trimmed } : fault(`a text of at most ${TEXT_BYTES_MAX} bytes`);
  if (form === "value" && trimmed === "off") return { value: null };
  const all = numbers(trimmed);
  if (form === "value") return all !== null && (all.length === 1 || all.length === 3) ? { value: all.length === 1 ? all[0] : all } : fault("a number, three numbers or off");
  const length = LENGTHS[form];
  if (length !== undefined) return all?.length === length ? { value: all } : fault(`${length} numbers`);
  if (all?.length !== 1) return fault("a number");
  const largest = LARGEST[form];
  if (largest !== undefined && !(Number.isInteger(all[0]) && all[0] >= 0 && all[0] <= largest)) return fault(`a whole number up to ${largest}`);
  return { value: all[0] };
}

/** Builds the fields of an action. An optional field without a text is left out. @param {string} kind @param {string[]} texts of its fields @returns {{ fields: Record<string, unknown> } | { fault: string }} */
export function fieldsOf(kind, texts) {
  /** @type {Record<string, unknown>} */
  const fields = {};
  for (const [index, field] of ACTIONS[kind].entries()) {
    if (field.isOptional && texts[index].trim() === "") continue;
    const result = read(field, texts[index]);
    if ("fault" in result) return result;
    fields[field.name] = result.value;
  }
  return { fields };
}
