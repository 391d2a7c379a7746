// Types of the text messages that the page receives (viewer-bridge/PROTOCOL.md, section 3).

/** @typedef {number | number[] | null} ParameterValue */
/** @typedef {{ name: string, rate_hz: number, dimensions: number, text: string, picture?: string }} SceneEntry */
/**
 * @typedef {{
 *   type: "hello", protocol: number, version: string, client: number, mode: "live" | "replay", format: string,
 *   scenes: SceneEntry[], recordings?: string[],
 *   limits: { constraints_per_cut: number, [name: string]: number },
 * }} Hello
 * @typedef {{
 *   type: "node", state: "none" | "alive" | "lost", text: string, run_id: string | null, scene: string | null,
 *   method: string | null, rate_hz: number, is_paused: boolean, is_replay: boolean, time_scale: number, process_id: number | null,
 * }} NodeState
 * @typedef {Record<string, ParameterValue | Record<string, ParameterValue>>} Values
 * @typedef {{ type: "parameters", is_complete: boolean, values: Values | null, initial: Values | null, initial_colliders?: { friction: number, restitution: number }[] }} Parameters
 * @typedef {{ type: "outcome", id: number | null, kind: string, status: "applied" | "rejected" | "unanswered", step: number | null, applied: number, rejected: number, reason: string, text: string, state_step?: number }} OutcomeMessage
 * @typedef {{ kind: "tear" | "pin" | "command" | "late" | "ghost", step: number, count: number, commands?: string[] }} Mark
 * @typedef {{
 *   type: "timeline", file: string, scene: string, rate_hz: number, first_step: number, last_step: number,
 *   first_time_s: number, last_time_s: number, marks: Mark[], hashes: string, hash_text: string, incomplete: string,
 * }} TimelineMessage
 * @typedef {{ type: "playback", is_playing: boolean, rate: number, is_looping: boolean, loop_steps: number[] | null, step: number, time_s: number }} Playback
 * @typedef {{
 *   type: "ghost", state: "none" | "opening" | "comparing" | "equal" | "different" | "failed", name: string | null, given: string | null,
 *   text: string, first_different_step: number | null,
 * }} GhostMessage
 * @typedef {{ type: "history", first_step: number | null, marks: Mark[], text: string }} HistoryMessage
 * @typedef {{
 *   type: "recording", state: "unavailable" | "idle" | "recording" | "finishing" | "finished" | "failed", text: string, name: string | null,
 *   path: string | null, seconds: number, snapshots: number, size_bytes: number, lost: Record<string, number>,
 * }} RecordingMessage
 * @typedef {"drag" | "carry" | "brush" | "pin" | "unpin" | "cut" | "reset" | "set" | "load" | "rewind"} Undoable
 * @typedef {{ type: "undoable", what: Undoable | null }} UndoableMessage
 * @typedef {Hello | NodeState | Parameters | OutcomeMessage | TimelineMessage | Playback | GhostMessage | HistoryMessage | UndoableMessage | RecordingMessage | { type: "clients", count: number }
 *   | { type: "reset", step: number } | { type: "notice", level: string, text: string }} TextMessage
 */

/** Reads a number. JSON has no infinities, so the protocol writes them as words. @param {unknown} value @returns {number} */
export function toNumber(value) {
  if (typeof value === "number") return value;
  if (value === "inf") return Infinity;
  return value === "-inf" ? -Infinity : NaN;
}

/** A parameter, for one kind of constraint or one generated block if it has values for them. Null if it is off, or if each
 * constraint or bend has its own value.
 * @param {Values | null} values @param {string} name @param {string} part @returns {ParameterValue} */
export function valueOf(values, name, part) {
  const ofBlock = name === "bending" ? blockValues(values).find((one) => String(one.block) === part) : undefined;
  if (ofBlock !== undefined) return toNumber(ofBlock.value);
  const value = values?.[name] ?? null;
  if (value === null || typeof value !== "object" || Array.isArray(value)) return typeof value === "string" ? toNumber(value) : value;
  return value[part] ?? null;
}

/** The blocks with a `bending` of their own. @param {Values | null} values @returns {{ block: number, value: number | string }[]} */
export const blockValues = (values) => /** @type {any} */ (values)?.bending_by_block ?? [];
