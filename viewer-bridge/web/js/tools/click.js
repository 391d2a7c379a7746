// Clicks: selecting and pinning.

import { pickConstraint, pickParticle } from "../geometry/pick.js";
import { CONSTRAINT, PIN } from "../net/wire.js";
import { particleAt } from "./tool.js";

/** Radius in CSS pixels of a click with a mouse and a finger. */
const CLICK_REACH = { mouse: 8, touch: 16 };

/** @param {import("./tool.js").App} app @param {import("../geometry/pick.js").Pixel} at @param {number} reach of a grab @param {boolean} isTouch @returns {import("../state/selection.js").Item | null} */
export function itemAt(app, at, reach, isTouch) {
  const { camera, renderer } = app;
  const { frame, scene, topology } = app.simulation;
  if (frame === null || scene === null || topology === null) return null;
  const view = camera.viewProjection(renderer.viewport);
  const radius = isTouch ? CLICK_REACH.touch : CLICK_REACH.mouse;
  const near = pickParticle(frame, view, renderer.viewport, at, radius);
  if (near !== null) return { kind: "particle", index: near };
  const isShown = (/** @type {number} */ i) => !topology.isGone[i] && scene.constraintKinds[i] !== CONSTRAINT.bend;
  const constraint = pickConstraint(frame, view, renderer.viewport, at, radius, scene.ends, isShown);
  if (constraint !== null) return { kind: "constraint", index: constraint };
  const particle = particleAt(app, at, reach);
  return particle === null ? null : { kind: "particle", index: particle };
}

/** @typedef {import("./tool.js").App} App */

/** @param {App} app @param {number} particle */
const isPinned = ({ simulation }, particle) => ((simulation.pins.get(particle) ?? 0) & PIN.pinned) !== 0;

/** Pins a free particle, or unpins a pinned one. @param {App} app @param {number} particle */
export const togglePin = (app, particle) => setPin(app, particle, !isPinned(app, particle));

/** Pins particles; unpins them if all of them are pinned. @param {App} app @param {number[]} particles */
export function togglePins(app, particles) {
  const isOn = !particles.every((one) => isPinned(app, one));
  for (const particle of particles) if (isPinned(app, particle) !== isOn) setPin(app, particle, isOn);
}

/** @param {App} app @param {number} particle @param {boolean} isOn */
function setPin({ simulation, commands }, particle, isOn) {
  commands.run(isOn ? "pin" : "unpin", { particle }, ({ status }) => {
    if (status === "applied" && simulation.isPaused) simulation.expectPin(particle, isOn);
  });
}
