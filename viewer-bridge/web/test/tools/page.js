// A page without a picture, whose canvas and socket are the test's.

import { Camera, sceneAxes } from "../../js/geometry/camera.js";
import { Commands } from "../../js/net/commands.js";
import { Selection } from "../../js/state/selection.js";
import { Simulation } from "../../js/state/simulation.js";
import { Input } from "../../js/tools/input.js";

export const VIEWPORT = { width: 800, height: 600 };

/** A scene of particles, and triangles between them. */
export const sceneOf = (positions, change = {}) => ({
  kind: "scene", epoch: 1, step: 0, particleCount: positions.length / 3, constraintCount: 0, triangleCount: (change.triangles ?? []).length / 3, isPlanar: false,
  min: [0, 0, 0], max: [0, 0, 0], rateHz: 60, origin: [0, 0, 0], positions: new Float32Array(positions), ends: new Uint32Array(0),
  restLengths: new Float32Array(0), constraintKinds: new Uint8Array(0), name: "", unit: "m", up: "y", runId: "",
  shapes: [], anchors: [], meshes: new Map(), compliances: new Float32Array(0), ...change, triangles: new Uint32Array(change.triangles ?? []),
});

/** A page that shows a scene, and an event of the mouse in the middle of the picture, where the origin is. Returns also what it sends. */
export function pageOf(scene, canChange = true) {
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
  const camera = new Camera();
  if (scene.isPlanar) Object.assign(camera, { isFlat: true, axes: sceneAxes("y", 2) });
  const app = { simulation, camera, renderer: { viewport: VIEWPORT, isDirty: false, toggles: { surface: true } }, commands, selection: new Selection(simulation) };
  const input = new Input(canvas, app, () => canChange);
  simulation.receive(scene);
  simulation.receive({
    kind: "frame", epoch: scene.epoch, step: 1, particleCount: scene.particleCount, lo: [0, 0, 0], scale: [1, 1, 1], number: 1,
    positions: scene.positions, nonFinite: new Uint32Array(0),
  });
  const { x, y } = camera.project([0, 0, 0], VIEWPORT);
  const event = { pointerId: 1, pointerType: "mouse", button: 0, clientX: x, clientY: y, get timeStamp() { return performance.now(); } };
  return { app, input, simulation, camera, commands, sent, canvas, listeners, event, selection: app.selection };
}
