// The renderer keeps GPU resources for one scene only, and each draw reads those of its own. The context is
// a fake that counts created and deleted objects.

import assert from "node:assert/strict";
import { test } from "node:test";
import { Camera } from "../../js/geometry/camera.js";
import { UNITS } from "../../js/gl/context.js";
import { Renderer } from "../../js/gl/renderer.js";
import { facets } from "../../js/gl/solids.js";
import { Simulation } from "../../js/state/simulation.js";

/** A context that draws nothing. Constants are their names, and `live` counts the objects of each kind. */
function countingContext() {
  const live = { Texture: 0, Buffer: 0, VertexArray: 0, Program: 0 };
  /** Size of each buffer in bytes. */
  const sizes = new Map();
  let bound = null;
  const own = {
    live, bufferBytes: () => [...sizes.values()].reduce((sum, size) => sum + size, 0),
    getProgramParameter: (_, name) => (name === "ACTIVE_UNIFORMS" ? 0 : true),
    bindBuffer: (_, buffer) => { bound = buffer; },
    bufferData: (_, data) => sizes.set(bound, data.byteLength),
    deleteBuffer: (buffer) => {
      live.Buffer--;
      sizes.delete(buffer);
    },
  };
  const gl = new Proxy(own, {
    get(target, name) {
      if (name in target) return target[name];
      const [, verb, kind] = /^(create|delete)(\w+)$/.exec(name) ?? [];
      if (kind in live) return verb === "create" ? () => ({ kind, number: ++live[kind] }) : () => { live[kind]--; };
      return name === name.toUpperCase() ? name : () => null;
    },
  });
  return gl;
}

/** Lists the draws, each with the texture that the sampler of the positions reads. */
function logDraws(gl) {
  const drawn = [];
  const bound = new Map();
  let active = "";
  gl.TEXTURE0 = 0;
  gl.activeTexture = (unit) => { active = unit; };
  gl.bindTexture = (_, texture) => bound.set(active, texture);
  for (const call of ["drawElements", "drawArraysInstanced"]) gl[call] = () => drawn.push({ call, positions: bound.get(UNITS.u_positions) });
  return drawn;
}

function rendererOf(simulation) {
  const gl = countingContext();
  const canvas = { clientWidth: 80, clientHeight: 60, getContext: () => gl };
  return { renderer: new Renderer(canvas, simulation, new Camera(), false), gl };
}

/** A single triangle. */
const scene = (epoch) => ({
  kind: "scene", epoch, step: 0, particleCount: 3, constraintCount: 3, triangleCount: 1, isPlanar: false, up: "y",
  positions: Float32Array.of(0, 0, 0, 1, 0, 0, 0, 1, 0), ends: Uint32Array.of(0, 1, 1, 2, 2, 0), restLengths: Float32Array.of(1, 1, 1),
  triangles: Uint32Array.of(0, 1, 2), constraintKinds: new Uint8Array(3), min: [0, 0, 0], max: [1, 1, 0], name: "one", shapes: [],
  meshes: new Map([[1, { vertices: Float32Array.of(0, 0, 0, 1, 0, 0, 0, 0, 1), triangles: Uint32Array.of(0, 1, 2, 2, 1, 0) }]]),
});

const frame = (epoch, number, isQuantised) => ({
  kind: "frame", epoch, step: number, number, particleCount: 3, isQuantised, lo: [0, 0, 0], scale: [1, 1, 1],
  positions: isQuantised ? new Uint16Array(9) : new Float32Array(9), nonFinite: new Uint32Array(0),
  bounds: { min: [0, 0, 0], max: [1, 1, 1] },
});

test("scenes of alternating formats use no more memory than the first two", () => {
  const simulation = new Simulation();
  const { renderer, gl } = rendererOf(simulation);
  const kept = [];
  for (let epoch = 1; epoch <= 6; epoch++) {
    simulation.receive(scene(epoch));
    simulation.receive(frame(epoch, epoch, epoch % 2 === 0));
    renderer.upload();
    kept.push({ ...gl.live, bytes: gl.bufferBytes() });
  }
  assert.equal(kept[0].Texture, 6);
  assert.equal(kept[1].Texture, 6);
  assert.equal(kept[1].bytes, kept[0].bytes, "the lists of the old scene are freed");
  assert.deepEqual(kept.slice(2), [kept[1], kept[1], kept[1], kept[1]]);
});

test("the surface and its shadows are drawn at the positions of their own recording while a ghost moves", () => {
  for (const hasEffects of [true, false]) {
    const simulation = new Simulation();
    const { renderer, gl } = rendererOf(simulation);
    renderer.toggles.effects = hasEffects;
    const drawn = logDraws(gl);
    simulation.receive(scene(1));
    simulation.receive({ kind: "colliders", epoch: 1, step: 0, colliders: [{ index: 0, shape: "plane", normal: [0, 1, 0], offset: -1 }] });
    for (const step of [1, 2, 3]) {
      const positions = Float32Array.of(5, 5, 5, 6, 5, 5, 5, 6, 5);
      simulation.receive({ kind: "ghost", epoch: 1, step, positions, hidden: new Uint32Array(0), farthest: 0, distance: 5 });
      simulation.receive(frame(1, step, false));
      drawn.length = 0;
      renderer.draw();
      const [own, others] = [renderer.buffers.positions.handle, renderer.buffers.ghost.positions.handle];
      const surfaces = drawn.filter(({ call }) => call === "drawElements");
      assert.ok(surfaces.length >= 2, "a surface and a shadow");
      assert.ok(surfaces.every(({ positions }) => positions === own), `a surface of the ghost at step ${step}`);
      // The ghost is drawn last, once behind the rest and once in front of it.
      assert.ok(drawn.slice(-2).every(({ positions }) => positions === others));
    }
  }
});

test("a mesh is drawn at the pose of its collider, each triangle with its normal", () => {
  const simulation = new Simulation();
  const { renderer } = rendererOf(simulation);
  const half = Math.SQRT1_2;
  simulation.receive(scene(1));
  simulation.receive({ kind: "colliders", epoch: 1, step: 0, colliders: [{ index: 1, shape: "mesh", center: [1, 2, 3], rotation: [0, half, 0, half], radius: 0 }] });
  simulation.receive(frame(1, 1, false));
  renderer.upload();
  const [placed] = renderer.colliders.placed;
  assert.deepEqual([placed.solid, placed.a], [1, [1, 2, 3]]);
  // The quarter turn about y takes x to -z.
  assert.ok(Math.abs(placed.shape[2] + 1) < 1e-6);
  assert.equal(renderer.colliders.loadedMeshes.get(1).count, 6);
  const corners = facets(simulation.scene.meshes.get(1));
  assert.deepEqual([...corners.subarray(3, 6)].map(Math.abs), [0, 1, 0]);
  assert.equal(corners[4], -corners[4 + 3 * 7], "the second triangle faces the other way");
});

test("a device that cannot compile the effects draws without them", () => {
  const simulation = new Simulation();
  const { renderer, gl } = rendererOf(simulation);
  let source = "";
  gl.shaderSource = (_, text) => { source += text; };
  gl.linkProgram = () => {
    const isLinked = !source.includes("u_shadow_map");
    gl.getProgramParameter = (_, name) => (name === "ACTIVE_UNIFORMS" ? 0 : isLinked);
    source = "";
  };
  gl.isContextLost = () => false;
  gl.getAttachedShaders = () => [];
  simulation.receive(scene(1));
  simulation.receive(frame(1, 1, false));
  assert.equal(renderer.toggles.effects, true);
  renderer.uploadOrSimplify();
  assert.equal(renderer.toggles.effects, false);
  assert.equal(renderer.buffers.flatPlaces, null);
});

test("a scene of another bridge with the same epoch is uploaded", () => {
  const simulation = new Simulation();
  const { renderer } = rendererOf(simulation);
  for (const number of [1, 2]) {
    simulation.receive(scene(1));
    simulation.receive(frame(1, number, false));
    renderer.upload();
    assert.equal(renderer.buffers.topology, simulation.topology);
  }
});
