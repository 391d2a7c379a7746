// Triangles and sticks after tears, the fans of normals, and how low a scene can hang.

import assert from "node:assert/strict";
import { test } from "node:test";
import { FAN_WORDS, STICK, Topology, drawnSticks } from "../../js/state/topology.js";
import { lowestReach, lowestWithin } from "../../js/state/hanging.js";

/** A sheet of columns x rows, one unit apart, hanging along -y. Constraints run right, down, and diagonally down-right. */
function sheet(columns, rows) {
  const at = (c, r) => r * columns + c;
  const positions = [], ends = [], kinds = [], triangles = [];
  for (let r = 0; r < rows; r++) {
    for (let c = 0; c < columns; c++) {
      positions.push(c, -r, 0);
      if (c + 1 < columns) { ends.push(at(c, r), at(c + 1, r)); kinds.push(0); }
      if (r + 1 < rows) { ends.push(at(c, r), at(c, r + 1)); kinds.push(0); }
      if (c + 1 < columns && r + 1 < rows) {
        ends.push(at(c, r), at(c + 1, r + 1));
        kinds.push(1);
        triangles.push(at(c, r), at(c, r + 1), at(c + 1, r + 1), at(c, r), at(c + 1, r + 1), at(c + 1, r));
      }
    }
  }
  return sceneOf(positions, ends, kinds, triangles);
}

function sceneOf(positions, ends, kinds, triangles = []) {
  const lengths = kinds.map((_, i) => Math.hypot(...[0, 1, 2].map((k) => positions[3 * ends[2 * i] + k] - positions[3 * ends[2 * i + 1] + k])));
  return {
    positions: Float32Array.from(positions), ends: Uint32Array.from(ends), restLengths: Float32Array.from(lengths),
    triangles: Uint32Array.from(triangles), constraintKinds: Uint8Array.from(kinds),
    particleCount: positions.length / 3, constraintCount: kinds.length, triangleCount: triangles.length / 3,
  };
}

const find = (scene, a, b) => Array.from({ length: scene.constraintCount }, (_, i) => i).find((i) => scene.ends[2 * i] === a && scene.ends[2 * i + 1] === b);
const live = (topology) => [...topology.isDead].filter((dead) => dead === 0).length;

test("every triangle is in the fans of its three corners", () => {
  const scene = sheet(4, 3);
  const topology = new Topology(scene);
  for (let p = 0; p < scene.particleCount; p++) {
    const [first, count] = topology.fanRanges.subarray(2 * p, 2 * p + 2);
    const around = Array.from({ length: scene.triangleCount }, (_, t) => [...scene.triangles.subarray(3 * t, 3 * t + 3)]).filter((triangle) => triangle.includes(p));
    assert.equal(count, around.length);
    for (let entry = first; entry < first + count; entry++) {
      const [b, c] = topology.fans.subarray(entry * FAN_WORDS, entry * FAN_WORDS + 2);
      assert.ok(around.some((triangle) => [0, 1, 2].some((k) => triangle[k] === p && triangle[(k + 1) % 3] === b && triangle[(k + 2) % 3] === c)));
    }
  }
});

test("a fan has the rest length to its first corner, or 0 without a constraint", () => {
  const scene = sheet(2, 2);
  scene.constraintKinds.fill(0);
  const topology = new Topology(scene);
  const entry = topology.fanRanges[0];
  const words = topology.fans.subarray(entry * FAN_WORDS, entry * FAN_WORDS + FAN_WORDS);
  assert.equal(new Float32Array(Uint32Array.of(words[2]).buffer)[0], 1);
  const bare = new Topology(sceneOf([0, 0, 0, 1, 0, 0, 0, 1, 0], [], [], [0, 1, 2]));
  assert.equal(bare.fans[2], 0);
});

/** Area of the drawn triangles and pieces, where each particle is at `at`. Each must face the viewer. */
function drawnArea(topology, at) {
  const { vertices, indices } = topology.pieces();
  const floats = new Float32Array(vertices.buffer);
  const point = (index) => {
    const k = index - topology.scene.particleCount;
    if (k < 0) return at(index);
    const [a, p, q] = [...vertices.subarray(8 * k, 8 * k + 3)].map(at);
    return a.map((x, axis) => x + floats[8 * k + 4] * (p[axis] - x) + floats[8 * k + 5] * (q[axis] - x));
  };
  const corners = [...topology.indices.filter((_, i) => !topology.isDead[Math.floor(i / 3)]), ...indices];
  let area = 0;
  for (let i = 0; i < corners.length; i += 3) {
    const [a, b, c] = corners.slice(i, i + 3).map(point);
    const twice = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    assert.ok(twice > -1e-6, `piece ${i / 3} is turned over`);
    area += twice / 2;
  }
  return area;
}

const restAt = (scene) => (p) => [...scene.positions.subarray(3 * p, 3 * p + 2)];

/** All constraints between two rows, as a cut between them tears. */
const between = (scene, columns, row) => Array.from({ length: scene.constraintCount }, (_, i) => i)
  .filter((i) => Math.floor(scene.ends[2 * i] / columns) !== Math.floor(scene.ends[2 * i + 1] / columns) && Math.floor(scene.ends[2 * i] / columns) === row);

/** Greatest area of a cut line through the sheet: four cells long, a twentieth of a cell wide. */
const LINE = 4 / 20;

test("a cut is a line: the pieces of a sheet at rest cover all but that line", () => {
  for (const torn of [(scene) => [find(scene, 3, 4)], (scene) => between(scene, 5, 1), (scene) => [find(scene, 6, 7), find(scene, 7, 12), find(scene, 6, 12)]]) {
    const scene = sheet(5, 4);
    const topology = new Topology(scene);
    assert.equal(drawnArea(topology, restAt(scene)), 12);
    topology.remove(torn(scene));
    const area = drawnArea(topology, restAt(scene));
    assert.ok(area > 12 - LINE && area < 12, `${area}`);
    topology.restore();
    assert.equal(topology.pieces().indices.length, 0);
  }
});

test("the halves of a cut sheet part along the line, and each keeps its own area and shape", () => {
  const scene = sheet(5, 4);
  const topology = new Topology(scene);
  topology.remove(between(scene, 5, 1));
  // The lower half falls, and turns by a right angle.
  const apart = (p) => {
    const [x, y] = restAt(scene)(p);
    return p < 10 ? [x, y] : [-y + 3, x - 9];
  };
  assert.ok(Math.abs(drawnArea(topology, apart) - drawnArea(topology, restAt(scene))) < 1e-5);
});

test("a cut through cells without diagonal constraints parts them as well", () => {
  const scene = sheet(5, 4);
  const kept = Array.from({ length: scene.constraintCount }, (_, i) => i).filter((i) => scene.constraintKinds[i] === 0);
  const bare = { ...scene, ends: Uint32Array.from(kept.flatMap((i) => [scene.ends[2 * i], scene.ends[2 * i + 1]])), restLengths: scene.restLengths.filter((_, i) => kept.includes(i)), constraintKinds: new Uint8Array(kept.length), constraintCount: kept.length };
  const topology = new Topology(bare);
  topology.remove(between(bare, 5, 1));
  const apart = (p) => restAt(bare)(p).map((value, axis) => (axis === 1 && p >= 10 ? value - 7 : value));
  assert.ok(Math.abs(drawnArea(topology, apart) - drawnArea(topology, restAt(bare))) < 1e-5, "no piece spans the gap");
});

test("a particle that hangs on nothing has no piece", () => {
  const scene = sheet(3, 3);
  const topology = new Topology(scene);
  topology.remove(Array.from({ length: scene.constraintCount }, (_, i) => i).filter((i) => scene.ends[2 * i] === 4 || scene.ends[2 * i + 1] === 4));
  const { vertices } = topology.pieces();
  for (let k = 0; k < vertices.length; k += 8) assert.ok(!vertices.subarray(k, k + 3).includes(4));
});

test("a torn side removes its triangles and no others", () => {
  const scene = sheet(3, 3);
  const topology = new Topology(scene);
  topology.remove([find(scene, 3, 4)]);
  assert.equal(live(topology), 6, "an inner edge has two triangles");
  topology.remove([find(scene, 7, 8)]);
  assert.equal(live(topology), 5, "an edge at the border has one triangle");
  topology.remove([find(scene, 1, 5)]);
  assert.equal(live(topology), 3, "a diagonal is a side of both triangles of its cell");
  for (let t = 0; t < scene.triangleCount; t++) {
    const corners = [...topology.indices.subarray(3 * t, 3 * t + 3)];
    assert.deepEqual(corners, topology.isDead[t] ? [0, 0, 0] : [...scene.triangles.subarray(3 * t, 3 * t + 3)]);
  }
});

test("a constraint whose triangles are gone becomes a stick, and a torn one does not", () => {
  const scene = sheet(2, 2);
  const topology = new Topology(scene);
  const [top, right, diagonal] = [find(scene, 0, 1), find(scene, 1, 3), find(scene, 0, 3)];
  assert.ok(topology.styles[right] & STICK.isCovered);
  topology.remove([top]);
  assert.equal(topology.styles[right] & STICK.isCovered, 0);
  assert.ok(topology.styles[diagonal] & STICK.isCovered, "the other triangle covers it");
  assert.ok(topology.styles[top] & STICK.isGone);
  topology.restore();
  assert.equal(live(topology), 2);
  assert.ok(topology.styles[right] & STICK.isCovered);
  assert.equal(topology.styles[top] & STICK.isGone, 0);
});

/** One triangle with three constraints along its first edge: bend, structural, shear. */
const strutted = () => {
  const scene = sceneOf([0, 0, 0, 1, 0, 0, 0, 1, 0], [0, 1, 1, 0, 0, 1], [2, 0, 1], [0, 1, 2]);
  scene.restLengths.set([3, 1, 2]);
  return scene;
};

test("the last constraint along an edge removes its triangle, of whichever kind it is", () => {
  for (const order of [[0, 2, 1], [1, 0, 2], [2, 1, 0]]) {
    const topology = new Topology(strutted());
    assert.ok([0, 1, 2].every((constraint) => topology.styles[constraint] & STICK.isCovered));
    topology.remove(order.slice(0, 2));
    assert.equal(live(topology), 1);
    topology.remove(order.slice(2));
    assert.equal(live(topology), 0);
  }
});

test("a fan has the rest length of an intact constraint, structural first", () => {
  const topology = new Topology(strutted());
  const restLength = () => new Float32Array(topology.fans.buffer)[topology.fanEntries[0] * FAN_WORDS + 2];
  assert.equal(restLength(), 1);
  topology.remove([2]);
  assert.equal(restLength(), 1);
  topology.remove([1]);
  assert.equal(restLength(), 3);
  topology.remove([0]);
  assert.equal(restLength(), 0, "the triangle is gone");
  const loose = strutted();
  loose.constraintKinds.set([2, 1, 1]);
  const shear = new Topology(loose);
  const lengths = [[], [1], [0], [2]].map((torn) => {
    shear.remove(torn);
    return new Float32Array(shear.fans.buffer)[shear.fanEntries[0] * FAN_WORDS + 2];
  });
  assert.deepEqual(lengths, [3, 3, 2, 0]);
});

test("constraints and triangles of a particle without a position are not drawn", () => {
  const topology = new Topology(sheet(3, 3));
  topology.removeAround(Uint32Array.of(4));
  assert.equal(live(topology), 2, "six of the eight triangles have the middle as a corner");
});

test("sticks are listed up to a limit, structural first and bend last", () => {
  const scene = sceneOf([0, 0, 0, 1, 0, 0, 2, 0, 0], [0, 2, 0, 1, 1, 2, 0, 1], [2, 1, 0, 3]);
  assert.deepEqual([...drawnSticks(scene, 10)], [2, 1, 3, 0]);
  assert.deepEqual([...drawnSticks(scene, 1)], [2]);
});

test("a rope pinned at one end can hang down by its whole length", () => {
  const count = 11;
  const positions = Array.from({ length: count }, (_, i) => [i * 0.1, 2, 0]).flat();
  const scene = sceneOf(positions, Array.from({ length: count - 1 }, (_, i) => [i, i + 1]).flat(), new Array(count - 1).fill(0));
  assert.ok(Math.abs(lowestReach(scene, [0], [0, 1, 0]) - 1) < 1e-6);
  assert.equal(lowestReach(scene, [], [0, 1, 0]), null);
});

test("a taut rope pinned at both ends cannot sag, and one of double length hangs like a V", () => {
  const count = 11;
  const positions = Array.from({ length: count }, (_, i) => [i * 0.1, 2, 0]).flat();
  const scene = sceneOf(positions, Array.from({ length: count - 1 }, (_, i) => [i, i + 1]).flat(), new Array(count - 1).fill(0));
  assert.ok(Math.abs(lowestReach(scene, [0, count - 1], [0, 1, 0]) - 2) < 1e-3);
  scene.restLengths.fill(0.2);
  const deepest = 2 - Math.sqrt(1 - 0.25);
  assert.ok(Math.abs(lowestReach(scene, [0, count - 1], [0, 1, 0]) - deepest) < 0.02);
});

test("two balls intersect lowest between their centres, or nowhere", () => {
  assert.ok(Math.abs(lowestWithin(5, 5, 6, 0) + 4) < 1e-12, "the triangle with sides 3, 4, 5");
  assert.equal(lowestWithin(1, 1, 3, 0), null);
});
