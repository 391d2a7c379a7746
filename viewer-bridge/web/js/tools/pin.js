// Pinning by a click, a key or a long press.

import { PIN } from "../net/wire.js";

/** Pins a free particle, or unpins a pinned one. @param {import("./tool.js").App} app @param {number} particle */
export function togglePin({ simulation, commands }, particle) {
  const isPinned = ((simulation.pins.get(particle) ?? 0) & PIN.pinned) !== 0;
  commands.run(isPinned ? "unpin" : "pin", { particle }, ({ status }) => {
    if (status === "applied" && simulation.isPaused) simulation.expectPin(particle, !isPinned);
  });
}
