// Pinning by a click, a key or a long press.

import { PIN } from "../net/wire.js";

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
