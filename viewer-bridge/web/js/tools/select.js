// Selecting with a click: a particle if one is close, else a constraint, else a particle within reach of a grab.

import { pickConstraint, pickParticle } from "../geometry/pick.js";
import { particleAt } from "./tool.js";
import { CONSTRAINT } from "../net/wire.js";

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
