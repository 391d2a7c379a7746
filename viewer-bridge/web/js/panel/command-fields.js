// The commands that a user can give by hand, with their fields (PROTOCOL.md, section 4), and how a typed text becomes a value.

/** @typedef {"index" | "count" | "step" | "number" | "vector" | "rotation" | "text" | "value"} Form */
/** @typedef {{ name: string, form: Form, example: string, isOptional?: boolean }} Field */

/** @type {Field} */
const PARTICLE = { name: "particle", form: "index", example: "0" };
/** @type {Field} */
const CENTER = { name: "center", form: "vector", example: "0 1 0" };
/** @type {Field} */
const RADIUS = { name: "radius", form: "number", example: "0.2" };
/** @type {Field[]} */
const MOTION = [{ name: "target", form: "vector", example: "0 1 0" }, { name: "over_s", form: "number", example: "0.017", isOptional: true }];
/** @type {Field} */
const OVER = { name: "over_s", form: "number", example: "1", isOptional: true };
/** @type {Field[]} */
const POSE = [{ name: "translation", form: "vector", example: "0 0.1 0" }, { name: "rotation", form: "rotation", example: "0 0 0 1", isOptional: true }];
/** @type {Field} */
const COLLIDER = { name: "collider", form: "index", example: "0" };

/** The fields per command. @type {Record<string, Field[]>} */
export const COMMANDS = {
  pin: [PARTICLE],
  unpin: [PARTICLE],
  grab: [PARTICLE, ...MOTION],
  move: [PARTICLE, ...MOTION],
  release: [PARTICLE],
  push: [CENTER, RADIUS, { name: "delta", form: "vector", example: "0 0 0.01" }, { name: "limit", form: "number", example: "2", isOptional: true }],
  cut: [{ name: "constraint", form: "index", example: "0" }],
  cut_radius: [CENTER, RADIUS],
  cut_segment: [{ name: "from", form: "vector", example: "-1 1 0" }, { name: "to", form: "vector", example: "1 1 0" }, { name: "direction", form: "vector", example: "0 0 1" }],
  move_collider: [COLLIDER, ...POSE, OVER],
  move_anchor: [{ name: "anchor", form: "index", example: "0" }, ...POSE, OVER],
  drive_body: [COLLIDER, ...POSE, ...["velocity", "angular_velocity", "force", "torque"].map((name) => (/** @type {Field} */ ({ name, form: "vector", example: "0 0 0", isOptional: true })))],
  set: [{ name: "parameter", form: "text", example: "damping" }, { name: "value", form: "value", example: "0.5" }, { name: "constraint_kind", form: "text", example: "structural", isOptional: true }, { name: "block", form: "index", example: "0", isOptional: true }, { ...COLLIDER, isOptional: true }],
  step: [{ name: "count", form: "count", example: "1" }],
  rewind: [{ name: "to_step", form: "step", example: "0" }],
  load: [{ name: "scene", form: "text", example: "curtain" }],
  mark: [{ name: "text", form: "text", example: "it slips" }],
  reset: [],
  pause: [],
  resume: [],
};

/** Numbers per form. @type {Partial<Record<Form, number>>} */
const LENGTHS = { vector: 3, rotation: 4 };
/** Largest number per form. @type {Partial<Record<Form, number>>} */
const LARGEST = { index: 2 ** 32 - 1, count: 2 ** 31 - 1, step: Number.MAX_SAFE_INTEGER };

/** Reads the numbers in a text, separated by spaces or commas. Null if a part is not a number. @param {string} text */
function numbers(text) {
  const parts = text.split(/[\s,]+/).filter((part) => part !== "").map(Number);
  return parts.every(Number.isFinite) ? parts : null;
}

/** Reads the text of a field. A wrong one has the reason. @param {Field} field @param {string} text @returns {{ value: unknown } | { fault: string }} */
export function read({ name, form, example }, text) {
  const trimmed = text.trim();
  const fault = (/** @type {string} */ what) => ({ fault: `${name}: ${trimmed === "" ? "missing" : `"${trimmed}" is not ${what}`} (for example ${example})` });
  if (trimmed === "") return fault("");
  if (form === "text") return { value: trimmed };
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

/** Builds the fields of a message. An optional field without a text is left out. @param {string} command @param {string[]} texts of its fields @param {number} epoch of the load on show @returns {{ fields: Record<string, unknown> } | { fault: string }} */
export function messageOf(command, texts, epoch) {
  /** @type {Record<string, unknown>} */
  const fields = {};
  for (const [index, field] of COMMANDS[command].entries()) {
    if (field.isOptional && texts[index].trim() === "") continue;
    const result = read(field, texts[index]);
    if ("fault" in result) return result;
    fields[field.name] = result.value;
  }
  // In messages of pages, a cut names several constraints of a load.
  return { fields: command === "cut" ? { epoch, constraints: [fields.constraint] } : fields };
}
