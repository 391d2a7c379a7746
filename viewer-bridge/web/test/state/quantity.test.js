// What the picture is coloured by: strain and tension of constraints, the extremes and the scale of a scene.

import assert from "node:assert/strict";
import { test } from "node:test";
import { complianceOf, strainGains, tensionGains, valueAt } from "../../js/state/quantity.js";
import { ValueScan } from "../../js/legend/value-scan.js";
import { Topology, FAN_WORDS } from "../../js/state/topology.js";
import { ScaleEnd, scaleOf, tensionNote } from "../../js/legend/legend.js";
import { niceEnd } from "../../js/geometry/math.js";
import { unitIn, unitsOf } from "../../js/ui/format.js";

/** Constraints along the x axis from particle 0, with given lengths. */
function scene({ restLengths, compliances, kinds = restLengths.map(() => 0) }) {
  const count = restLengths.length;
  return {
    particleCount: count + 1, constraintCount: count, triangleCount: 0, triangles: new Uint32Array(0),
    ends: Uint32Array.from({ length: 2 * count }, (_, i) => (i % 2 === 0 ? 0 : (i + 1) / 2)), positions: new Float32Array(3 * count + 3),
    restLengths: Float32Array.from(restLengths), compliances: Float32Array.from(compliances), constraintKinds: Uint8Array.from(kinds),
  };
}

const frame = (lengths, change = {}) => ({ positions: Float32Array.from([0, 0, 0, ...lengths.flatMap((length) => [length, 0, 0])]), lo: [0, 0, 0], scale: [1, 1, 1], isQuantised: false, ...change });

function scanned(one, gains, lengths, change) {
  const scan = new ValueScan();
  scan.begin(frame(lengths, change));
  while (!scan.addConstraints(one, gains, new Uint8Array(gains.length)));
  return scan.found;
}

const near = (value, expected) => assert.ok(Math.abs(value - expected) <= 1e-5 * Math.max(1, Math.abs(expected)), `${value} is not ${expected}`);

test("strain is relative to the rest length, and a slack tether has none", () => {
  const gains = strainGains(scene({ restLengths: [2, 2, 0], compliances: [0, 0, 0], kinds: [0, 3, 0] }));
  near(valueAt(1.5, 2, gains[0]), -0.25);
  near(valueAt(1.5, 2, gains[1]), 0);
  near(valueAt(2.5, 2, gains[1]), 0.25);
  assert.equal(gains[2], 0, "not known without a rest length");
});

test("tension is the elongation over the compliance, and not known of a rigid constraint or in pbd", () => {
  const one = scene({ restLengths: [1, 1, 1], compliances: [0.01, 0, 0.5], kinds: [0, 0, 1] });
  const own = tensionGains(one, null, "xpbd");
  near(valueAt(1.02, 1, own[0]), 2);
  assert.deepEqual([own[1], tensionGains(one, null, "pbd")[0]], [0, 0]);
  const set = tensionGains(one, { compliance: { structural: 0.002, shear: 0 } }, "xpbd");
  near(valueAt(1.02, 1, set[0]), 10);
  near(valueAt(1.02, 1, set[1]), 10);
  assert.equal(set[2], 0, "a command made it rigid");
  assert.equal(complianceOf(one, [null, 0.25, null, null], 2), 0.25);
});

test("98 of 100 values lie on the scale, on either side of 0, and the extremes are exact", () => {
  const count = 1000;
  const one = scene({ restLengths: new Array(count).fill(1), compliances: new Array(count).fill(0) });
  const lengths = Array.from({ length: count }, (_, i) => (i === 3 ? 9 : i === 5 ? 0.2 : 1 + i / 10_000));
  const found = scanned(one, strainGains(one), lengths);
  near(found.max, 8);
  near(found.min, -0.8);
  assert.ok(found.high >= 0.0985 && found.high < 0.0999, `${found.high}`);
  assert.equal(found.low, 0, "one value of 1000 is compressed");
  assert.deepEqual([found.known, found.count, found.resolution], [count, count, 0]);
});

test("each side of 0 has its own end", () => {
  const count = 1000;
  const one = scene({ restLengths: new Array(count).fill(1), compliances: new Array(count).fill(0) });
  // A tenth is compressed by up to 1 %, the rest is stretched by up to 20 %.
  const lengths = Array.from({ length: count }, (_, i) => (i < 100 ? 1 - i / 10_000 : 1 + (i - 100) / 4500));
  const { low, high } = scanned(one, strainGains(one), lengths);
  assert.ok(low > -0.01 && low < -0.0089, `${low}`);
  assert.ok(high > 0.197 && high < 0.2, `${high}`);
});

test("a scale wastes no side that has no values", () => {
  assert.deepEqual(scaleOf(0, 20, null), { low: 0, high: 20 });
  assert.deepEqual(scaleOf(0.1, 20, null), { low: 0, high: 20 }, "noise");
  assert.deepEqual(scaleOf(5, 20, null), { low: -5, high: 20 });
  assert.deepEqual(scaleOf(5, 0.01, null), { low: -5, high: 0 });
  assert.deepEqual(scaleOf(5, 20, 1), { low: -1, high: 1 });
  assert.deepEqual(scaleOf(0, 20, 1), { low: 0, high: 1 });
  assert.deepEqual(scaleOf(0, 0, null), { low: 0, high: 1 });
  assert.deepEqual(scaleOf(1, 0.6, null), { low: -1, high: 1 }, "0 is in the middle");
});

test("values fill three quarters of a scale with short ends", () => {
  assert.deepEqual([0.085, 0.18, 1, 1.21, 23, 0.0081, 0].map(niceEnd), [0.1, 0.2, 1, 1.5, 25, 0.01, 0]);
  for (let value = 1e-6; value < 1e6; value *= 1.01) assert.ok(niceEnd(value) >= value * 0.999 && value >= 0.74 * niceEnd(value), `${value}`);
});

test("an end of a scale stays while its values vary, and follows them down within a few scans", () => {
  const end = new ScaleEnd();
  const follow = (value, times = 1) => {
    for (let i = 0; i < times; i++) end.follow(value);
    return end.value;
  };
  assert.deepEqual([follow(0.18), follow(0.22)], [0.2, 0.25]);
  for (let i = 0; i < 100; i++) assert.equal(follow(0.18 + 0.04 * Math.sin(i)), 0.25);
  // A swing that comes back within two seconds.
  follow(0.2);
  for (let i = 0; i < 5; i++) assert.deepEqual([follow(0.01, 7), follow(0.2)], [0.25, 0.25]);
  assert.equal(follow(0.012, 8), 0.012);
  assert.equal(follow(0, 8), 0);
});

test("a large scene is scanned in slices of one frame, and the rounding of its positions is known", () => {
  const count = 45_000;
  const one = scene({ restLengths: new Array(count).fill(1), compliances: new Array(count).fill(0.5) });
  const scan = new ValueScan();
  scan.begin(frame(new Array(count).fill(2), { isQuantised: true, scale: [0.75, 0, 0] }));
  const gone = new Uint8Array(count);
  const gains = tensionGains(one, null, "xpbd");
  assert.deepEqual([1, 2, 3, 4, 5].map(() => scan.addConstraints(one, gains, gone)), [false, false, false, false, true]);
  near(scan.found.max, 1);
  near(scan.found.resolution, 1.5);
  assert.equal(scan.isRunning, false);
});

test("speeds that are not finite are left out", () => {
  const scan = new ValueScan();
  scan.begin(frame([]));
  assert.ok(scan.addValues(Float32Array.of(0, 3, NaN, Infinity)));
  assert.deepEqual([scan.found.min, scan.found.max, scan.found.known], [0, 3, 2]);
});

test("the legend says of which constraints the tension is not known", () => {
  assert.match(tensionNote({ known: 0, count: 9 }, "xpbd"), /rigid/);
  assert.match(tensionNote({ known: 4, count: 9 }, "xpbd"), /unknown: 5 of 9/);
  assert.match(tensionNote({ known: 9, count: 9 }, "xpbd"), /exact at rest/);
  assert.match(tensionNote({ known: 0, count: 9 }, "pbd"), /no forces/);
});

test("the surface has the gain of the first intact constraint along each edge", () => {
  const one = {
    ...scene({ restLengths: [1, 1, 1], compliances: [0.5, 0, 0.25] }), particleCount: 3, triangleCount: 1,
    ends: Uint32Array.of(0, 1, 1, 2, 2, 0), triangles: Uint32Array.of(0, 1, 2),
  };
  const topology = new Topology(one);
  topology.setGains(tensionGains(one, null, "xpbd"));
  const gains = new Float32Array(topology.fans.buffer);
  assert.deepEqual([0, 1, 2].map((entry) => gains[entry * FAN_WORDS + 3]), [2, 0, 4]);
  topology.remove([2]);
  assert.equal(gains[2 * FAN_WORDS + 3], 0);
});

test("units follow the unit of length of the scene", () => {
  assert.deepEqual(unitsOf("m"), { length: "m", speed: "m/s", force: "N", energy: "J", compliance: "m/N" });
  assert.deepEqual(unitsOf("px"), { length: "px", speed: "px/s", force: "kg px/s²", energy: "kg px²/s²", compliance: "s²/kg" });
  assert.deepEqual(["m/s²", "kg/m³", "m", "N", "N m", "N m²", "m/N", "1/s", "×", ""].map((unit) => unitIn(unit, "px")), ["px/s²", "kg/px³", "px", "kg px/s²", "kg px²/s²", "kg px³/s²", "s²/kg", "1/s", "×", ""]);
  assert.equal(unitIn("kg/m³", "m"), "kg/m³");
});
