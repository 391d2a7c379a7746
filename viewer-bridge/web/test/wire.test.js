// The page decodes the golden messages of the bridge, so that the Rust encoder and the JavaScript
// decoder cannot drift apart.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";
import { decode } from "../js/net/wire.js";

const golden = JSON.parse(readFileSync(new URL("../../tests/golden/messages.json", import.meta.url), "utf8"));
const SHAPES = ["plane", "box", "sphere", "capsule", "bounds", "mesh"];
const KINDS = ["", "scene", "frame", "frame", "tear", "pins", "stats", "colliders", "forces", "speeds", "inspected", "past", "ghost", "part"];
const RECIPIENTS = ["collider", "anchor", "particle"];

/** Decodes hex into an array buffer that starts at offset 0. */
const bufferOf = (hex) => Uint8Array.from(hex.match(/../g), (byte) => parseInt(byte, 16)).buffer;

const triples = (flat) => Array.from({ length: flat.length / 3 }, (_, i) => [...flat.subarray(3 * i, 3 * i + 3)]);

/** Fields of each kind of message, under the names of the golden file. */
const readers = {
  scene: (m) => ({
    positions: triples(m.positions), rest_lengths: [...m.restLengths], triangles: triples(m.triangles), kinds: [...m.constraintKinds], compliances: [...m.compliances],
    ends: Array.from({ length: m.constraintCount }, (_, i) => [m.ends[2 * i], m.ends[2 * i + 1]]),
    min: m.min, max: m.max, origin: m.origin, rate_hz: m.rateHz,
    flags: m.isPlanar ? 1 : 0,
    text: { name: m.name, unit: m.unit, up: m.up, run_id: m.runId, shapes: m.shapes, has_explicit_bends: m.hasExplicitBends, anchors: m.anchors },
    meshes: [...m.meshes].map(([collider, mesh]) => ({ collider, vertices: triples(mesh.vertices), triangles: triples(mesh.triangles) })),
  }),
  frame: (m) => ({
    sim_time_s: m.simTime, number: m.number, torn_count: m.tornCount, solve_us: m.solveUs, wake_late_us: m.wakeLateUs,
    publish_monotonic_ns: Number(m.publishedNs), not_finite: [...m.nonFinite],
    flags: (m.isPaused ? 1 : 0) | (m.isReplay ? 2 : 0) | (m.isSaturated ? 4 : 0),
    positions: Array.from({ length: m.particleCount }, (_, i) => [0, 1, 2].map((k) => m.lo[k] + m.scale[k] * m.positions[3 * i + k])),
  }),
  tear: (m) => ({ first: m.first, constraints: [...m.constraints], causes: [...m.causes].map((cause) => (cause === 255 ? 2 ** 32 - 1 : cause)) }),
  pins: (m) => ({ held: [...m.particles].map((particle, i) => [particle, m.flags[i]]) }),
  stats: (m) => ({
    solve_us: [m.solveUsP50, m.solveUsP99], wake_late_us: [m.wakeLateUsP50, m.wakeLateUsP99], period_us: m.periodUs,
    real_time_factor: m.realTimeFactor, time_scale: m.timeScale, stretch_mean: m.stretchMean, stretch_max: m.stretchMax,
    stretch_max_constraint: m.stretchMaxConstraint, kinetic_j: m.kineticJ, potential_j: m.potentialJ,
    late_steps: m.lateSteps, skipped_periods: m.skippedPeriods, outcome_count: m.outcomes, rejected_count: m.rejected,
    frozen_count: m.frozenCount, torn_count: m.tornCount, reader_count: m.readers, client_count: m.clients,
    encode_us: m.encodeUs, frames_per_second: m.framesPerSecond, flags: (m.isPaused ? 1 : 0) | (m.isReplay ? 2 : 0),
  }),
  colliders: (m) => ({ colliders: m.colliders }),
  speeds: (m) => ({ speeds: [...m.speeds] }),
  inspected: (m) => ({ particles: m.rows.map((row) => ({ particle: row.particle, position: row.position, velocity: row.velocity, inverse_mass: row.inverseMass })) }),
  ghost: (m) => ({ farthest: m.farthest, distance: m.distance, positions: triples(m.positions), hidden: [...m.hidden] }),
  past: (m) => ({ count: m.count }),
  part: (m) => ({ of_kind: m.ofKind, offset: m.offset, size: m.size, unpacked_size: m.unpackedSize, bytes: [...m.bytes] }),
  forces: (m) => ({
    rate_hz: m.rateHz,
    rows: m.rows.map((row) => ({ kind: RECIPIENTS.indexOf(row.kind), index: row.index, impulse: row.impulse, angular_impulse: row.angularImpulse, contacts: row.contacts })),
  }),
};

for (const { name, hex, fields } of golden) {
  test(`the golden message "${name}" decodes to its fields`, () => {
    const message = decode(bufferOf(hex));
    assert.equal(message.kind, KINDS[fields.kind]);
    assert.deepEqual([message.epoch, message.step], [fields.epoch, fields.step]);
    const read = readers[message.kind](message);
    for (const [field, value] of Object.entries(read)) {
      if (field === "colliders") compareColliders(value, fields.colliders);
      else if (field === "positions" && message.kind === "frame") compareNumbers(value.flat(), fields.positions.flat());
      else assert.deepEqual(value, fields[field], field);
    }
    // The page reads every field that the golden file lists.
    const known = new Set([...Object.keys(read), "epoch", "kind", "step", "lo", "scale"]);
    assert.deepEqual(Object.keys(fields).filter((field) => !known.has(field)), []);
  });
}

function compareNumbers(read, written) {
  assert.equal(read.length, written.length);
  read.forEach((value, i) => assert.ok(Math.abs(value - written[i]) <= 1e-6 * Math.max(1, Math.abs(written[i])), `${i}: ${value} is not ${written[i]}`));
}

function compareColliders(read, written) {
  assert.equal(read.length, written.length);
  read.forEach((one, i) => {
    const other = written[i];
    assert.deepEqual([one.index, one.shape, one.restitution, one.friction], [i, SHAPES[other.shape], other.restitution, other.friction]);
    assert.deepEqual([one.radius, one.offset, one.normal, one.center, one.a, one.b], [other.radius, other.offset, other.normal, other.center, other.a, other.b]);
    assert.deepEqual([one.halfExtents, one.rotation], [other.half_extents, other.rotation]);
    assert.deepEqual([one.velocity, one.angularVelocity], [other.velocity, other.angular_velocity]);
  });
}

test("unknown kinds and versions are ignored", () => {
  const buffer = new ArrayBuffer(16);
  const view = new DataView(buffer);
  view.setUint16(0, 99, true);
  view.setUint16(2, 1, true);
  assert.equal(decode(buffer), null);
  view.setUint16(0, 4, true);
  view.setUint16(2, 2, true);
  assert.equal(decode(buffer), null);
});

test("a truncated message is refused at every length", () => {
  for (const { name, hex, fields } of golden) {
    const whole = bufferOf(hex);
    for (const length of [4, 15, 20, Math.floor(whole.byteLength / 2 / 4) * 4, whole.byteLength - 4]) {
      if (length >= whole.byteLength) continue;
      // The padding after the last array may be missing.
      if (length === whole.byteLength - 4 && endsInPadding(fields)) continue;
      assert.throws(() => decode(whole.slice(0, length)), RangeError, `${name} truncated to ${length}`);
    }
  }
});

const endsInPadding = (fields) => fields.kind === 3 || fields.kind === 4 || fields.kind === 6;
