// How the text that a user types for a field of an action becomes a value.

import { ACTIONS } from "./tables.js";

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
