// Material coordinates of a surface: where each particle lies in the cloth laid flat. The weave is drawn in
// them, so its threads bend with every fold, and tell a fold from a shadow.

import { CONSTRAINT } from "../net/wire.js";
import { nextCorner } from "./splits.js";

/** @typedef {import("../net/wire.js").Scene} Scene */
/** @typedef {import("./topology.js").Topology} Topology */

/**
 * Lays a surface flat, triangle after triangle, with the rest lengths of its edges. A sheet keeps its shape. A
 * closed surface cannot lie flat: its triangles are distorted where two ways around it meet.
 * @param {Topology} topology
 * @returns {Float32Array} x, y of each particle; 0, 0 without a triangle
 */
export function layFlat(topology) {
  const { triangleCount, particleCount, triangles } = topology.scene;
  const flat = new Float32Array(2 * particleCount);
  const isPlaced = new Uint8Array(particleCount);
  const isReached = new Uint8Array(triangleCount);
  const queue = new Uint32Array(triangleCount);
  let end = 0;
  const reach = (/** @type {number} */ triangle) => {
    if (isReached[triangle]) return;
    isReached[triangle] = 1;
    queue[end++] = triangle;
  };
  for (let seed = 0, begin = 0; seed < triangleCount; seed++) {
    if (isReached[seed]) continue;
    placeFirst(topology, seed, flat, isPlaced);
    reach(seed);
    for (; begin < end; begin++) {
      for (let corner = 3 * queue[begin]; corner < 3 * queue[begin] + 3; corner++) {
        const across = opposite(topology, corner);
        if (across < 0) continue;
        const apex = triangles[nextCorner(nextCorner(across))];
        if (!isPlaced[apex]) {
          placeApex(topology, across, flat);
          isPlaced[apex] = 1;
        }
        reach(Math.floor(across / 3));
      }
    }
  }
  return flat;
}

/** Places a triangle on its own, with a structural edge along x: the threads follow it.
 * @param {Topology} topology @param {number} triangle @param {Float32Array} flat @param {Uint8Array} isPlaced */
function placeFirst(topology, triangle, flat, isPlaced) {
  const { triangles, constraintKinds } = topology.scene;
  const corners = [3 * triangle, 3 * triangle + 1, 3 * triangle + 2];
  const isThread = (/** @type {number} */ corner) => topology.edgeConstraints.at(corner).some((one) => constraintKinds[one] === CONSTRAINT.structural);
  const corner = corners.find(isThread) ?? corners[0];
  const [a, b, c] = [corner, nextCorner(corner), nextCorner(nextCorner(corner))].map((one) => triangles[one]);
  flat[2 * b] = flat[2 * a] + topology.restLength(corner);
  flat[2 * b + 1] = flat[2 * a + 1];
  placeApex(topology, corner, flat);
  isPlaced[a] = isPlaced[b] = isPlaced[c] = 1;
}

/** Places the third corner of a triangle to the left of the edge of a corner, by the law of cosines.
 * @param {Topology} topology @param {number} corner @param {Float32Array} flat */
function placeApex(topology, corner, flat) {
  const { triangles } = topology.scene;
  const [second, third] = [nextCorner(corner), nextCorner(nextCorner(corner))];
  const [a, b, c] = [triangles[corner], triangles[second], triangles[third]];
  const [ab, bc, ca] = [topology.restLength(corner), topology.restLength(second), topology.restLength(third)];
  const [dx, dy] = [flat[2 * b] - flat[2 * a], flat[2 * b + 1] - flat[2 * a + 1]];
  const length = Math.hypot(dx, dy) || 1;
  const along = (ab * ab + ca * ca - bc * bc) / (2 * (ab || 1));
  const aside = Math.sqrt(Math.max(0, ca * ca - along * along));
  flat[2 * c] = flat[2 * a] + (dx * along - dy * aside) / length;
  flat[2 * c + 1] = flat[2 * a + 1] + (dy * along + dx * aside) / length;
}

/** The corner on the other side of an edge: that of the triangle in which the edge runs the other way. -1 at a border.
 * @param {Topology} topology @param {number} corner */
function opposite(topology, corner) {
  const { scene: { triangles }, fanRanges, cornerByEntry } = topology;
  const [a, b] = [triangles[corner], triangles[nextCorner(corner)]];
  for (let entry = fanRanges[2 * b]; entry < fanRanges[2 * b] + fanRanges[2 * b + 1]; entry++) {
    if (triangles[nextCorner(cornerByEntry[entry])] === a) return cornerByEntry[entry];
  }
  return -1;
}
