// Generated from the tables of parameters and actions; do not edit. `UPDATE_GOLDEN=1 cargo test -p viewer-bridge golden` rewrites it.

/**
 * A row of the panel. A "log" slider is logarithmic, and starts with 0 if `hasZero`. `whenOn` is the value
 * of a parameter when it is switched on. A row with `parts` has a value for all constraints or bends, or for those of a part: a
 * kind of constraint, a generated block with bends, or a collider. Without a value, each has its own.
 * @typedef {{
 *   name: string, label: string, unit: string, kind: "vector" | "linear" | "log" | "whole",
 *   least: number, most: number, canBeOff?: boolean, hasZero?: boolean, whenOn?: number, method?: "xpbd" | "pbd", parts?: "kinds" | "blocks" | "colliders",
 * }} Row
 */

/** The sliders, in units of a scene in metres. The values of a scene can widen a range. @type {Row[]} */
export const ROWS = [
  { name: "gravity", label: "Gravity", unit: "m/s²", kind: "vector", least: -20, most: 20 },
  { name: "wind.velocity", label: "Wind", unit: "m/s", kind: "vector", least: -20, most: 20 },
  { name: "wind.drag", label: "Wind drag", unit: "kg/m³", kind: "linear", least: 0, most: 2, canBeOff: true, whenOn: 0.6 },
  { name: "damping", label: "Damping", unit: "1/s", kind: "linear", least: 0, most: 5 },
  { name: "compliance", label: "Compliance", unit: "m/N", kind: "log", least: 0.00000001, most: 10, hasZero: true, method: "xpbd", parts: "kinds" },
  { name: "stiffness", label: "Stiffness", unit: "", kind: "linear", least: 0, most: 1, method: "pbd", parts: "kinds" },
  { name: "bending", label: "Bending", unit: "N m", kind: "log", least: 0.0000001, most: 10, hasZero: true, parts: "blocks" },
  { name: "iterations", label: "Iterations", unit: "", kind: "whole", least: 1, most: 32 },
  { name: "substeps", label: "Substeps", unit: "", kind: "whole", least: 1, most: 32 },
  { name: "tear_force", label: "Tear force", unit: "N", kind: "log", least: 0.001, most: 100000, canBeOff: true, whenOn: 50 },
  { name: "tear_stretch", label: "Tear stretch", unit: "×", kind: "linear", least: 1.01, most: 4, canBeOff: true, whenOn: 1.5 },
  { name: "tear_distance", label: "Tear distance", unit: "m", kind: "log", least: 0.001, most: 100, canBeOff: true, whenOn: 0.1 },
  { name: "contact.thickness", label: "Contact distance", unit: "m", kind: "log", least: 0.001, most: 1, canBeOff: true, whenOn: 0.02 },
  { name: "contact.friction", label: "Contact friction", unit: "", kind: "linear", least: 0, most: 2 },
  { name: "friction", label: "Collider friction", unit: "", kind: "linear", least: 0, most: 2, parts: "colliders" },
  { name: "restitution", label: "Collider bounce", unit: "", kind: "linear", least: 0, most: 1, parts: "colliders" },
  { name: "time_scale", label: "Speed", unit: "×", kind: "log", least: 0.01, most: 10 },
];

/** @typedef {{ name: string, form: "whole" | "long" | "number" | "vector" | "rotation" | "text" | "value" | "kind", isOptional?: boolean }} Field */

/** The fields of each action that a user can give by hand. @type {Record<string, Field[]>} */
export const ACTIONS = {
  pin: [{ name: "particle", form: "whole" }],
  unpin: [{ name: "particle", form: "whole" }],
  grab: [{ name: "particle", form: "whole" }, { name: "target", form: "vector" }, { name: "over_s", form: "number", isOptional: true }],
  move: [{ name: "particle", form: "whole" }, { name: "target", form: "vector" }, { name: "over_s", form: "number", isOptional: true }],
  release: [{ name: "particle", form: "whole" }],
  pause: [],
  resume: [],
  step: [{ name: "count", form: "whole" }],
  reset: [],
  push: [{ name: "center", form: "vector" }, { name: "radius", form: "number" }, { name: "delta", form: "vector" }, { name: "limit", form: "number", isOptional: true }],
  cut: [{ name: "constraint", form: "whole" }],
  cut_radius: [{ name: "center", form: "vector" }, { name: "radius", form: "number" }],
  cut_segment: [{ name: "from", form: "vector" }, { name: "to", form: "vector" }, { name: "direction", form: "vector" }],
  move_anchor: [{ name: "anchor", form: "whole" }, { name: "translation", form: "vector" }, { name: "rotation", form: "rotation", isOptional: true }, { name: "over_s", form: "number", isOptional: true }],
  move_collider: [{ name: "collider", form: "whole" }, { name: "translation", form: "vector" }, { name: "rotation", form: "rotation", isOptional: true }, { name: "over_s", form: "number", isOptional: true }],
  set: [{ name: "parameter", form: "text" }, { name: "value", form: "value" }, { name: "constraint_kind", form: "kind", isOptional: true }, { name: "block", form: "whole", isOptional: true }, { name: "collider", form: "whole", isOptional: true }],
  load: [{ name: "scene", form: "text" }],
  rewind: [{ name: "to_step", form: "long", isOptional: true }, { name: "back_steps", form: "whole", isOptional: true }],
  mark: [{ name: "text", form: "text" }],
  drive_body: [{ name: "collider", form: "whole" }, { name: "translation", form: "vector" }, { name: "rotation", form: "rotation", isOptional: true }, { name: "velocity", form: "vector", isOptional: true }, { name: "angular_velocity", form: "vector", isOptional: true }, { name: "force", form: "vector", isOptional: true }, { name: "torque", form: "vector", isOptional: true }],
};
