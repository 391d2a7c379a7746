// The ghost of a replay: it belongs to the frame that follows it, and the status line names its distance.

import assert from "node:assert/strict";
import { test } from "node:test";
import { Simulation } from "../../js/state/simulation.js";
import { Hud } from "../../js/ui/hud.js";

const scene = {
  kind: "scene", epoch: 1, step: 0, particleCount: 2, constraintCount: 0, triangleCount: 0, isPlanar: true, min: [0, 0, 0], max: [1, 1, 1],
  positions: new Float32Array(6), ends: new Uint32Array(0), restLengths: new Float32Array(0), triangles: new Uint32Array(0),
  constraintKinds: new Uint8Array(0), name: "", unit: "px", up: "y", meshes: new Map(),
};
const frame = (step) => ({
  kind: "frame", epoch: 1, step, number: step, simTime: 0, particleCount: 2, lo: [0, 0, 0], scale: [1, 1, 1],
  positions: new Float32Array(6), nonFinite: new Uint32Array(0),
});
const ghost = (step, distance) => ({ kind: "ghost", epoch: 1, step, positions: new Float32Array(6), hidden: new Uint32Array(0), farthest: 1, distance });

test("a ghost is shown with the frame after it, and with no other", () => {
  const simulation = new Simulation();
  simulation.receive(scene);
  simulation.receive(ghost(6, NaN));
  assert.equal(simulation.ghost, null, "its frame has not arrived");
  simulation.receive(frame(7));
  assert.equal(simulation.ghost.step, 6);
  simulation.receive(frame(8));
  assert.equal(simulation.ghost, null, "the ghost has no state there");
  simulation.receive(ghost(9, 0));
  simulation.receive({ ...scene, epoch: 2 });
  simulation.receive({ ...frame(9), epoch: 2 });
  assert.equal(simulation.ghost, null, "it belongs to the scene before");
});

test("the status line has the distance of the ghost", () => {
  const simulation = new Simulation();
  simulation.receive(scene);
  const hud = new Hud({}, simulation, {});
  const text = (ghosts) => {
    ghosts.forEach((one) => simulation.receive(one));
    simulation.receive(frame(9));
    return hud.text(60);
  };
  assert.ok(!text([]).includes("ghost"));
  assert.match(text([ghost(9, 0)]), / · ghost at the same place$/);
  assert.match(text([ghost(9, 0.0125)]), / · ghost up to 0\.0125 px away \(particle 1\)$/);
  assert.match(text([ghost(8, NaN)]), / · ghost at step 8$/);
});
