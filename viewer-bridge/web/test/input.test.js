// Tools when the scene changes under them.

import assert from "node:assert/strict";
import { test } from "node:test";
import { Camera } from "../js/geometry/camera.js";
import { Commands } from "../js/net/commands.js";
import { Simulation } from "../js/state/simulation.js";
import { Input } from "../js/tools/input.js";

const VIEWPORT = { width: 800, height: 600 };
const SCENE = {
  kind: "scene", epoch: 1, step: 0, particleCount: 1, constraintCount: 0, triangleCount: 0, isPlanar: false,
  min: [0, 0, 0], max: [0, 0, 0], rateHz: 60, origin: [0, 0, 0], positions: new Float32Array(3), ends: new Uint32Array(0),
  restLengths: new Float32Array(0), triangles: new Uint32Array(0), constraintKinds: new Uint8Array(0), name: "", unit: "m", up: "y", runId: "",
};
const FRAME = { kind: "frame", epoch: 1, step: 1, particleCount: 1, lo: [0, 0, 0], scale: [1, 1, 1], number: 1, positions: new Float32Array(3), nonFinite: new Uint32Array(0) };

/** A page that shows one particle, and presses it with the left button. Returns the page and what it sends. */
function pressed() {
  /** @type {Map<string, (event: object) => void>} */
  const listeners = new Map();
  const canvas = {
    addEventListener: (type, listener) => listeners.set(type, listener),
    getBoundingClientRect: () => ({ left: 0, top: 0 }),
    setPointerCapture() {},
    dataset: {},
  };
  const sent = [];
  const commands = new Commands((message) => sent.push(message) > 0, () => {});
  const simulation = new Simulation();
  const app = { simulation, camera: new Camera(), renderer: { viewport: VIEWPORT, isDirty: false }, commands };
  const input = new Input(canvas, app, () => true);
  simulation.receive(SCENE);
  simulation.receive(FRAME);
  const { x, y } = app.camera.project([0, 0, 0], VIEWPORT);
  const event = { pointerId: 1, pointerType: "mouse", button: 0, clientX: x, clientY: y };
  listeners.get("pointerdown")(event);
  listeners.get("pointermove")({ ...event, clientX: x + 50 });
  return { input, simulation, sent };
}

test("a reset or another scene ends a grab with a release, and without its last motion", () => {
  for (const change of [(page) => page.receiveText({ type: "reset", step: 2 }), (page) => page.receive({ ...SCENE, epoch: 2 })]) {
    const { input, simulation, sent } = pressed();
    assert.deepEqual(sent.map(({ type }) => type), ["grab"]);
    change(simulation);
    assert.deepEqual(sent.map(({ type, particle }) => [type, particle]), [["grab", 0], ["release", 0]]);
    assert.equal(input.tool, null);
  }
});

test("a lost connection drops the tool without a message", () => {
  const { input, sent } = pressed();
  input.abandon();
  assert.deepEqual([sent.length, input.tool], [1, null]);
});

test("a motion after a rest is as quick as one without", () => {
  const { input, sent } = pressed();
  const start = input.tool.sentMs;
  const moves = () => sent.filter(({ type }) => type === "move");
  input.tick(start + 16);
  // The pointer rests for a second.
  for (let ms = 32; ms <= 1000; ms += 16) input.tick(start + ms);
  input.tool.move({ x: 500, y: 300 });
  input.tick(start + 1016);
  assert.equal(moves().length, 2);
  assert.ok(moves()[1].over_s < 0.03, `${moves()[1].over_s} s`);
});
