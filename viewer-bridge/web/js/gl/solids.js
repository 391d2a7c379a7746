// The meshes of colliders: a ball in two halves, which the shader separates into a capsule, a cube, and those of a scene.

import { cross, normalize, subtract } from "../geometry/math.js";

/** Floats per vertex: position 3, normal 3, and the end of the axis that the vertex belongs to, 0 or 1. */
export const VERTEX_FLOATS = 7;
const SECTORS = 40;
const RINGS_OF_HALF = 10;

/** @typedef {import("../geometry/math.js").Vec3} Vec3 */
/** @typedef {{ vertices: Float32Array, indices: Uint16Array }} Solid */

/** The unit ball with its axis along y. The equator occurs twice, once per half. @returns {Solid} */
export function ball() {
  /** @type {number[]} */
  const vertices = [];
  /** @type {number[]} */
  const indices = [];
  for (const end of [0, 1]) {
    for (let ring = 0; ring <= RINGS_OF_HALF; ring++) {
      const latitude = ((ring / RINGS_OF_HALF - 1 + end) * Math.PI) / 2;
      for (let sector = 0; sector <= SECTORS; sector++) {
        const longitude = (sector / SECTORS) * 2 * Math.PI;
        const at = [Math.cos(latitude) * Math.cos(longitude), Math.sin(latitude), Math.cos(latitude) * Math.sin(longitude)];
        vertices.push(...at, ...at, end);
      }
    }
  }
  const width = SECTORS + 1;
  for (let ring = 0; ring < 2 * RINGS_OF_HALF + 1; ring++) {
    for (let sector = 0; sector < SECTORS; sector++) {
      const corner = ring * width + sector;
      indices.push(corner, corner + width, corner + 1, corner + 1, corner + width, corner + width + 1);
    }
  }
  return { vertices: new Float32Array(vertices), indices: new Uint16Array(indices) };
}

/** The cube from -1 to 1, with four corners per face. @returns {Solid} */
export function cube() {
  /** @type {number[]} */
  const vertices = [];
  /** @type {number[]} */
  const indices = [];
  for (let face = 0; face < 6; face++) {
    const axis = face >> 1;
    const side = face & 1 ? -1 : 1;
    const normal = [0, 0, 0];
    normal[axis] = side;
    const first = face * 4;
    for (const [u, v] of [[-1, -1], [1, -1], [1, 1], [-1, 1]]) {
      const at = [0, 0, 0];
      at[axis] = side;
      at[(axis + 1) % 3] = u;
      at[(axis + 2) % 3] = v * side;
      vertices.push(...at, ...normal, 0);
    }
    indices.push(first, first + 1, first + 2, first, first + 2, first + 3);
  }
  return { vertices: new Float32Array(vertices), indices: new Uint16Array(indices) };
}

/** The triangles of a mesh, each with its own normal. @param {import("../net/wire.js").ColliderMesh} mesh */
export function facets({ vertices, triangles }) {
  const facet = new Float32Array(triangles.length * VERTEX_FLOATS);
  for (let at = 0; at < triangles.length; at += 3) {
    const corners = [0, 1, 2].map((corner) => /** @type {Vec3} */ ([...vertices.subarray(3 * triangles[at + corner], 3 * triangles[at + corner] + 3)]));
    const normal = normalize(cross(subtract(corners[1], corners[0]), subtract(corners[2], corners[0])));
    corners.forEach((corner, index) => facet.set([...corner, ...normal, 0], (at + index) * VERTEX_FLOATS));
  }
  return facet;
}

/** The edges of the cube from -1 to 1, as pairs of corners. */
export function cubeEdges() {
  /** @type {number[]} */
  const ends = [];
  for (let corner = 0; corner < 8; corner++) {
    for (const bit of [1, 2, 4]) {
      if ((corner & bit) === 0) for (const end of [corner, corner | bit]) ends.push(end & 1 ? 1 : -1, end & 2 ? 1 : -1, end & 4 ? 1 : -1, 0, 0, 0, 0);
    }
  }
  return new Float32Array(ends);
}
