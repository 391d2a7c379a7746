// The selection, what the inspector knows of it, and which clicks select.

import assert from "node:assert/strict";
import { test } from "node:test";
import { pickConstraint } from "../../js/geometry/pick.js";
import { identity } from "../../js/geometry/math.js";
import { holderOf, inspectConstraint, inspectParticle, distanceOf } from "../../js/state/inspection.js";
import { SELECTED_MAX, Selection, parseItems } from "../../js/state/selection.js";
import { Simulation } from "../../js/state/simulation.js";
import { Subscription } from "../../js/state/subscription.js";

/** Four particles in a row, 1 apart, joined by a compliant, a rigid and a slack constraint. */
const scene = (epoch, change = {}) => ({
  kind: "scene", epoch, step: 0, name: "row", particleCount: 4, constraintCount: 3, triangleCount: 0, isPlanar: false, up: "y", unit: "m",
  positions: Float32Array.of(0, 0, 0, 1, 0, 0, 2, 0, 0, 3, 0, 0), ends: Uint32Array.of(0, 1, 1, 2, 2, 3), restLengths: Float32Array.of(0.5, 1, 2),
  compliances: Float32Array.of(0.25, 0, 0.5), constraintKinds: Uint8Array.of(0, 1, 3), triangles: new Uint32Array(0), min: [0, 0, 0], max: [3, 0, 0], meshes: new Map(), ...change,
});
const frame = (epoch, step) => ({ kind: "frame", epoch, step, number: step, particleCount: 4, lo: [0, 0, 0], scale: [1, 1, 1], positions: Float32Array.of(0, 0, 0, 1, 0, 0, 2, 0, 0, 3, 0, 0), nonFinite: new Uint32Array(0) });
const particle = (index) => ({ kind: "particle", index });
const constraint = (index) => ({ kind: "constraint", index });

function started() {
  const simulation = new Simulation();
  const selection = new Selection(simulation);
  simulation.receive(scene(1));
  simulation.receive(frame(1, 1));
  return { simulation, selection };
}

test("a selection has the exact states of its particles and of the ends of its constraints", () => {
  const { simulation, selection } = started();
  const sent = [];
  const subscription = new Subscription(simulation, { send: (message) => sent.push(message) > 0 }, { forces: () => false, speeds: () => false, inspected: () => selection.particles });
  subscription.tick();
  assert.deepEqual(sent, [], "there is no connection");
  simulation.setConnected(true);
  subscription.tick();
  assert.deepEqual(sent, [], "an empty selection asks for nothing");
  selection.toggle(particle(3));
  selection.toggle(constraint(0));
  subscription.tick();
  subscription.tick();
  assert.deepEqual(sent, [{ type: "inspect", particles: [0, 1, 3] }]);
  simulation.receive({ kind: "inspected", epoch: 1, step: 2, rows: [{ particle: 3, position: [3, 0.5, 0], velocity: [0, 3, 4], inverseMass: 2 }] });
  simulation.receive(frame(1, 2));
  const values = inspectParticle(simulation, 3);
  assert.deepEqual([values.position, values.speed, values.inverseMass], [[3, 0.5, 0], 5, 2]);
  simulation.receive(frame(1, 3));
  assert.ok(Number.isNaN(inspectParticle(simulation, 3).speed), "the frame came without states");
  simulation.setConnected(false);
  simulation.setConnected(true);
  subscription.tick();
  assert.equal(sent.length, 2, "a new connection is asked again");
  selection.clear();
  subscription.tick();
  assert.deepEqual(sent.at(-1), { type: "inspect", particles: [] });
});

test("a selection survives a reset and the same scene in a new run, and no other scene", () => {
  const { simulation, selection } = started();
  selection.set([particle(2)]);
  simulation.receiveText({ type: "reset", step: 5 });
  simulation.receive(scene(2));
  assert.deepEqual(selection.items, [particle(2)]);
  simulation.receive(scene(3, { name: "other" }));
  assert.deepEqual([selection.items, selection.particles], [[], []]);
});

test("Shift adds and removes items up to a limit, and Tab goes round", () => {
  const { selection } = started();
  for (let k = 0; k < 4; k++) selection.toggle(particle(k));
  selection.toggle(particle(1));
  for (let k = 0; k < 3; k++) selection.toggle(constraint(k));
  assert.equal(selection.items.length, SELECTED_MAX);
  selection.step(1);
  assert.deepEqual(selection.items, [constraint(0)]);
  selection.step(-1);
  assert.deepEqual(selection.items, [constraint(2)]);
  selection.turn();
  assert.deepEqual(selection.items, [particle(3)]);
  selection.turn();
  assert.deepEqual(selection.items, [constraint(2)]);
});

test("typed items name their fault and its remedy", () => {
  const one = scene(1);
  assert.deepEqual(parseItems(" 3, C2 p0", one), [particle(3), constraint(2), particle(0)]);
  assert.deepEqual(parseItems("", one), []);
  assert.match(String(parseItems("4", one)), /no particle 4: the scene has 0 to 3/);
  assert.match(String(parseItems("c3", one)), /no constraint 3: the scene has 0 to 2/);
  assert.match(String(parseItems("x1", one)), /“x1” is neither/);
  assert.match(String(parseItems("1 1 1 1 1 1 1", one)), /At most 6/);
});

test("the tension of a compliant constraint is known, a slack tether has none, and a torn one says why", () => {
  const { simulation } = started();
  const [soft, rigid, slack] = [0, 1, 2].map((one) => inspectConstraint(simulation, one));
  assert.deepEqual([soft.strain, soft.tension, soft.cause], [1, 2, null]);
  assert.deepEqual([rigid.isRigid, rigid.tension], [true, null]);
  assert.deepEqual([slack.length, slack.strain, slack.tension], [1, 0, 0]);
  simulation.receiveText({ type: "parameters", is_complete: true, values: { compliance: { structural: 1, shear: 0.5 } }, initial: null });
  assert.deepEqual([inspectConstraint(simulation, 0).tension, inspectConstraint(simulation, 1).tension], [0.5, 0]);
  simulation.receive({ kind: "tear", epoch: 1, first: 0, constraints: Uint32Array.of(1, 0), causes: Uint8Array.of(3, 0) });
  assert.match(inspectConstraint(simulation, 1).cause, /cut/);
  assert.match(inspectConstraint(simulation, 0).cause, /tear force/);
  assert.equal(inspectConstraint(simulation, 0).tension, null);
  simulation.receive({ kind: "tear", epoch: 1, first: 0, constraints: Uint32Array.of(1), causes: Uint8Array.of(255) });
  assert.match(inspectConstraint(simulation, 1).cause, /not known/);
  assert.equal(inspectConstraint(simulation, 0).cause, null);
  assert.equal(distanceOf(simulation, 0, 3), 3);
});

test("the holder of a particle is named, and this page told from others", () => {
  assert.equal(holderOf(0, false), "nothing: it is free");
  assert.equal(holderOf(1, false), "pinned");
  assert.equal(holderOf(2, true), "grabbed by this page");
  assert.equal(holderOf(3, false), "grabbed by another client, pinned");
  assert.equal(holderOf(4, false), "anchored");
});

test("the force on a pinned particle is its impulse at the rate of the steps", () => {
  const { simulation } = started();
  simulation.receive({ kind: "forces", epoch: 1, step: 2, rateHz: 240, rows: [{ kind: "particle", index: 0, impulse: [0, -0.5, 0] }] });
  simulation.receive(frame(1, 2));
  assert.deepEqual(inspectParticle(simulation, 0).force, [0, -120, 0]);
  assert.equal(inspectParticle(simulation, 1).force, null);
});

test("a click picks the nearest constraint of the foremost layer", () => {
  const points = { positions: Float32Array.of(-0.5, 0, 0, 0.5, 0, 0, -0.5, 0.2, 0, 0.5, 0.2, 0), lo: [0, 0, 0], scale: [1, 1, 1] };
  const viewport = { width: 100, height: 100 };
  const pick = (x, y, isShown = () => true) => pickConstraint(points, identity(), viewport, { x, y }, 8, [0, 1, 2, 3], isShown);
  assert.equal(pick(50, 52), 0);
  assert.equal(pick(50, 42), 1);
  assert.equal(pick(50, 46), 0);
  assert.equal(pick(50, 46, (i) => i === 1), 1);
  assert.equal(pick(50, 70), null);
  assert.equal(pick(10, 50), null, "beyond its end");
});
