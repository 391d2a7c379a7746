// A text field for a value beside its slider.

import { make } from "../ui/dom.js";
import { editable, typedValue } from "./parameters.js";

/** @typedef {import("./parameters.js").Row} Row */
/** @typedef {import("../net/messages.js").ParameterValue} ParameterValue */

export class ValueField {
  /** @param {Row} row @param {string} label for screen readers @param {(value: number | null) => void} onValue @param {(text: string) => void} onWrong */
  constructor(row, label, onValue, onWrong) {
    this.input = make("input", { type: "text", inputmode: "decimal", class: "value", "aria-label": label, autocomplete: "off", spellcheck: "false" });
    this.shown = "";
    this.input.addEventListener("focus", () => this.input.select());
    this.input.addEventListener("change", () => {
      const value = typedValue(row, this.input.value);
      if (value !== undefined) return onValue(value);
      onWrong(this.input.value);
      this.input.value = this.shown;
    });
    this.input.addEventListener("keydown", ({ key }) => {
      // Escape leaves the field without a change.
      if (key === "Escape") this.input.value = this.shown;
      if (key === "Escape" || key === "Enter") this.input.blur();
    });
  }

  /** Shows a value, unless the user is typing another one. @param {ParameterValue} value @param {string} [word] in place of "off" */
  show(value, word = "off") {
    this.shown = typeof value === "number" ? editable(value) : word;
    if (!this.input.matches(":focus")) this.input.value = this.shown;
  }
}
