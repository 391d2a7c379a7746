// The logic of the parameter panel: rows, ranges, and the mapping between slider positions and values.
// No DOM here.

import { niceCeiling } from "../geometry/math.js";
import { blockValues, toNumber, valueOf } from "../net/messages.js";
import { ROWS } from "./tables.js";

/** @typedef {import("../net/messages.js").Values} Values */
/** @typedef {import("../net/messages.js").ParameterValue} ParameterValue */
/** @typedef {import("./tables.js").Row} Row */

/** Number of intervals of a slider. */
export const SLIDER_STEPS = 400;

/** The bends of a scene, as its shapes tell. @typedef {{ shapes: { shape: string, has_bends?: boolean }[], hasExplicitBends: boolean }} Bends */
/** A collider with its surface. @typedef {{ index: number, shape?: string, friction: number, restitution: number }} Surface */

/** The rows for a method; those of bends and colliders only if the scene has some. @param {string | null} method @param {boolean} hasBends @param {boolean} [hasColliders] */
export const rowsOf = (method, hasBends, hasColliders = false) =>
  ROWS.filter((row) => (row.method === undefined || row.method === (method ?? "xpbd")) && (hasBends || row.parts !== "blocks") && (hasColliders || row.parts !== "colliders"));

/** Adds the friction and restitution of colliders to parameters, by index, and under "all" if they are equal. Messages and JSON
 * have them at two precisions, so they are rounded to 32 bits.
 * @param {Values | null} values @param {Surface[]} colliders @returns {Values | null} */
export function withSurfaces(values, colliders) {
  const byPart = (/** @type {"friction" | "restitution"} */ name) => {
    const rounded = colliders.map((one) => Math.fround(one[name]));
    const all = rounded.length > 0 && rounded.every((value) => value === rounded[0]) ? rounded[0] : null;
    return { all, ...Object.fromEntries(colliders.map((one, k) => [one.index, rounded[k]])) };
  };
  return values === null ? null : { ...values, friction: byPart("friction"), restitution: byPart("restitution") };
}

/** True if a scene has bends. @param {Bends} scene */
export const hasBends = ({ shapes, hasExplicitBends }) => hasExplicitBends || shapes.some((shape) => shape.has_bends);

/**
 * The parts of a row, with the texts that name them: none if a value for all says the same.
 * @param {Row} row @param {Bends} scene @param {string[]} kinds of constraints @param {Surface[]} [colliders] @returns {{ part: string, text: string }[]}
 */
export function partsOf(row, { shapes, hasExplicitBends }, kinds, colliders = []) {
  if (row.parts === "kinds") return kinds.map((part) => ({ part, text: part }));
  if (row.parts === "colliders") return colliders.length > 1 ? colliders.map(({ index, shape }) => ({ part: String(index), text: `${index} ${shape}` })) : [];
  if (row.parts === undefined) return [];
  const blocks = shapes.flatMap((shape, block) => (shape.has_bends ? [{ part: String(block), text: `${block} ${shape.shape}` }] : []));
  return blocks.length > 1 || hasExplicitBends ? blocks : [];
}

/** The range of a row, wide enough for the initial and current values of the scene. @param {Row} row @param {...number} values */
export function rangeOf(row, ...values) {
  const greatest = Math.max(0, ...values.filter(Number.isFinite).map(Math.abs));
  const most = greatest > row.most ? niceCeiling(greatest * (row.kind === "vector" ? 2 : 1)) : row.most;
  return { least: row.kind === "vector" ? -most : row.least, most };
}

/** Slider position for a value, 0..=SLIDER_STEPS. @param {Row} row @param {{ least: number, most: number }} range @param {number} value */
export function positionOf(row, { least, most }, value) {
  if (row.kind !== "log") return Math.round(((value - least) / (most - least)) * SLIDER_STEPS);
  if (row.hasZero && value <= 0) return 0;
  const first = row.hasZero ? 1 : 0;
  const fraction = Math.log(Math.max(value, least) / least) / Math.log(most / least);
  return Math.round(first + Math.min(1, fraction) * (SLIDER_STEPS - first));
}

/** Value at a slider position, rounded to the precision of the slider. @param {Row} row @param {{ least: number, most: number }} range @param {number} position */
export function valueAt(row, { least, most }, position) {
  if (row.kind !== "log") {
    const value = least + (position / SLIDER_STEPS) * (most - least);
    if (row.kind === "whole") return Math.round(value);
    // Rounded to a fraction of a slider step, so that 0 is exact and 9.81 is not 9.8099995.
    const grain = niceCeiling((most - least) / 1000) / 2;
    return Number((Math.round(value / grain) * grain).toPrecision(6));
  }
  if (row.hasZero && position === 0) return 0;
  const first = row.hasZero ? 1 : 0;
  return Number((least * (most / least) ** ((position - first) / (SLIDER_STEPS - first))).toPrecision(2));
}

/** The components of a vector parameter; zeros if it is off. @param {unknown} value @returns {[number, number, number]} */
export function vectorOf(value) {
  if (!Array.isArray(value)) return [0, 0, 0];
  return [toNumber(value[0]), toNumber(value[1]), toNumber(value[2])];
}

/** A value as text that can be edited: all digits of a 32-bit number, and "off" for none. @param {ParameterValue} value */
export function editable(value) {
  return typeof value === "number" ? String(Number(value.toPrecision(6))) : "off";
}

/** The value that a user typed for a row: a number, or null for "off". Undefined if it is neither.
 * @param {Row} row @param {string} text @returns {number | null | undefined} */
export function typedValue(row, text) {
  const word = text.trim().toLowerCase();
  if (word === "off") return row.canBeOff ? null : undefined;
  // A comma separates decimals in many countries; thousands are never separated.
  const value = Number(word.replace(",", "."));
  if (word === "" || !Number.isFinite(value)) return undefined;
  return row.kind === "whole" && !Number.isInteger(value) ? undefined : value;
}

/** The unit of a row for a part, in metres: on a line, such as a rope, a rigidity has another one than on a surface.
 * @param {Row} row @param {{ shape: string, has_bends?: boolean }[]} shapes of the scene @param {string} part */
export function unitOf(row, shapes, part) {
  if (row.parts !== "blocks") return row.unit;
  const bent = part === "all" ? shapes.filter((shape) => shape.has_bends) : [shapes[Number(part)]];
  return bent.length > 0 && bent.every((shape) => shape?.shape === "rope") ? "N m²" : row.unit;
}

/**
 * The commands that restore the parameters of the scene, and the labels of rows that no command restores:
 * "set" cannot give each constraint or bend its own value back.
 * @param {Row[]} rows @param {Values} values @param {Values} initial @param {string[]} kinds of constraints
 */
export function restoring(rows, values, initial, kinds) {
  /** @type {{ name: string, value: ParameterValue, part?: string }[]} */
  const changes = [];
  /** @type {string[]} */
  const lost = [];
  for (const row of rows) {
    const blocks = row.parts === "blocks" ? blockValues(values).map((one) => String(one.block)) : [];
    // A value that all colliders have in the scene is one command.
    const isEqual = row.parts !== "colliders" || valueOf(initial, row.name, "all") !== null;
    const colliders = isEqual ? ["all"] : Object.keys(values[row.name] ?? {}).filter((part) => part !== "all");
    for (const part of row.parts === "kinds" ? kinds : row.parts === "colliders" ? colliders : [undefined, ...blocks]) {
      const [now, first] = [values, initial].map((one) => valueOf(one, row.name, part ?? ""));
      if (String(now) === String(first)) continue;
      if (first === null && row.parts !== undefined) lost.push(row.label);
      else changes.push({ name: row.name, value: first, ...(part === undefined || part === "all" ? {} : { part }) });
    }
  }
  return { changes, lost: [...new Set(lost)] };
}
