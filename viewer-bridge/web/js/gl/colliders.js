// Colliders: solids in 3-D, filled shapes in 2-D.

import { add, addScaled, frameOf, length, normalize, rotate, scale, subtract, tangents } from "../geometry/math.js";
import { Program, UNITS } from "./context.js";
import { BLUR, HEADER, LIGHT, SCREEN, sunlight } from "./shaders.js";
import { VERTEX_FLOATS, ball, cube, cubeEdges, facets } from "./solids.js";

/** @typedef {import("../geometry/math.js").Vec3} Vec3 */
/** @typedef {import("../net/wire.js").Collider} Collider */
/** @typedef {import("./styles.js").ColliderStyle} ColliderStyle */
/** A solid in the scene: `solid` is a number for the mesh of that collider, `shape` has its axes scaled by its size, `turn` its unit axes for normals, `a` and `b` are the ends of its axis.
 * @typedef {{ solid: "ball" | "cube" | "edges" | number, shape: number[], turn: number[], a: Vec3, b: Vec3 }} Placed */

/** @typedef {{ vao: WebGLVertexArrayObject | null, buffers: (WebGLBuffer | null)[], count: number }} Loaded */

/** Extent of half planes in 2-D, in radii of the scene. */
const HALF_PLANE_RADII = 200;

const VERTEX = `${HEADER}
layout(location = 0) in vec3 a_position;
layout(location = 1) in vec3 a_normal;
layout(location = 2) in float a_end;
uniform mat4 u_shape;
uniform mat4 u_turn;
uniform vec3 u_a;
uniform vec3 u_b;
out vec3 v_position;
out vec3 v_normal;
out float v_height;
void main() {
  vec3 at = mix(u_a, u_b, a_end) + mat3(u_shape) * a_position;
  v_position = at;
  v_normal = mat3(u_turn) * a_normal;
  v_height = dot(u_ground.xyz, at) - u_ground.w;
  gl_Position = u_view_projection * vec4(at, 1.0);
}
`;

const fragment = (/** @type {boolean} */ hasEffects) => `${HEADER}${SCREEN}${LIGHT}${sunlight(hasEffects)}
in vec3 v_position;
in vec3 v_normal;
in float v_height;
uniform vec3 u_collider;
uniform vec4 u_flat;
void main() {
  if (u_shadow > 0.0) {
    if (v_height < 0.0) discard;
    o_color = vec4(0.0, 0.0, 0.0, u_shadow);
  } else if (u_flat.a > 0.0) {
    o_color = screen(u_flat.rgb, u_flat.a);
  } else {
    vec3 to_eye = normalize(u_eye - v_position);
    // A mesh has two sides.
    vec3 normal = normalize(v_normal) * (dot(v_normal, to_eye) < 0.0 ? -1.0 : 1.0);
    o_color = screen(lit(u_collider, v_position, normal, to_eye, 0.3, sunlight(v_position, normal, ${BLUR.scene})), 1.0);
  }
}
`;

const NO_ROTATION = [0, 0, 0, 1];
const ORIGIN = /** @type {Vec3} */ ([0, 0, 0]);

/** A box with the given half extents, rotated by a quaternion. @param {Vec3} center @param {Vec3} half @param {number[]} rotation @returns {Placed} */
function placeBox(center, half, rotation) {
  const axes = [[1, 0, 0], [0, 1, 0], [0, 0, 1]].map((axis) => rotate(rotation, /** @type {Vec3} */ (axis)));
  return {
    solid: "cube", a: center, b: center,
    shape: frameOf(scale(axes[0], half[0]), scale(axes[1], half[1]), scale(axes[2], half[2]), ORIGIN),
    turn: frameOf(axes[0], axes[1], axes[2], ORIGIN),
  };
}

/** @param {Vec3} a @param {Vec3} b @param {number} radius @returns {Placed} */
export function placeCapsule(a, b, radius) {
  const axis = length(subtract(b, a)) > 0 ? normalize(subtract(b, a)) : /** @type {Vec3} */ ([0, 1, 0]);
  const [u, v] = tangents(axis);
  return { solid: "ball", a, b, shape: frameOf(scale(u, radius), scale(axis, radius), scale(v, radius), ORIGIN), turn: frameOf(u, axis, v, ORIGIN) };
}

/** The half plane behind a line, as a flat box far bigger than the picture. @param {Vec3} normal @param {number} offset @param {Vec3} near @param {number} size */
function placeHalfPlane(normal, offset, near, size) {
  const along = /** @type {Vec3} */ ([-normal[1], normal[0], 0]);
  const foot = addScaled(scale(normal, offset), along, near[0] * along[0] + near[1] * along[1]);
  const angle = Math.atan2(along[1], along[0]);
  return placeBox(addScaled(foot, normal, -size), [size, size, 0], [0, 0, Math.sin(angle / 2), Math.cos(angle / 2)]);
}

/** The solids that draw a collider. A plane in 3-D has none: the shader of the ground draws it.
 * @param {Collider} one @param {boolean} isPlanar @param {Vec3} near @param {number} radius of the scene @returns {Placed[]} */
export function placeCollider(one, isPlanar, near, radius) {
  const size = radius * HALF_PLANE_RADII;
  if (one.shape === "box") return [placeBox(one.center, one.halfExtents, one.rotation)];
  if (one.shape === "sphere") return [placeCapsule(one.center, one.center, one.radius)];
  if (one.shape === "mesh") return [{ ...placeBox(one.center, [1, 1, 1], one.rotation), solid: one.index }];
  if (one.shape === "capsule") return [placeCapsule(one.a, one.b, one.radius)];
  if (one.shape === "plane") return isPlanar ? [placeHalfPlane(one.normal, one.offset, near, size)] : [];
  if (!isPlanar) return [{ ...placeBox(scale(add(one.a, one.b), 0.5), scale(subtract(one.b, one.a), 0.5), NO_ROTATION), solid: "edges" }];
  return [
    placeHalfPlane([1, 0, 0], one.a[0], near, size), placeHalfPlane([-1, 0, 0], -one.b[0], near, size),
    placeHalfPlane([0, 1, 0], one.a[1], near, size), placeHalfPlane([0, -1, 0], -one.b[1], near, size),
  ];
}

export class Colliders {
  /** @param {WebGL2RenderingContext} gl @param {boolean} hasEffects */
  constructor(gl, hasEffects) {
    this.gl = gl;
    this.program = new Program(gl, VERTEX, fragment(hasEffects));
    this.program.setSamplers(UNITS);
    const [aBall, aCube] = [ball(), cube()];
    this.solids = {
      ball: this.load(aBall.vertices, aBall.indices),
      cube: this.load(aCube.vertices, aCube.indices),
      edges: this.load(cubeEdges(), null),
    };
    /** The meshes of the scene. @type {Map<number, import("../net/wire.js").ColliderMesh>} */
    this.meshes = new Map();
    /** The same, loaded. @type {Map<number, Loaded>} */
    this.loadedMeshes = new Map();
    /** @type {Placed[]} */
    this.placed = [];
    /** The poles of flags. @type {Placed[]} */
    this.poles = [];
  }

  /** Replaces the meshes by those of a scene. @param {Map<number, import("../net/wire.js").ColliderMesh>} meshes */
  loadMeshes(meshes) {
    if (meshes === this.meshes) return;
    for (const { vao, buffers } of this.loadedMeshes.values()) {
      this.gl.deleteVertexArray(vao);
      buffers.forEach((buffer) => this.gl.deleteBuffer(buffer));
    }
    this.meshes = meshes;
    this.loadedMeshes = new Map([...meshes].map(([index, mesh]) => [index, this.load(facets(mesh), null)]));
  }

  /** @param {Float32Array} vertices @param {Uint16Array | null} indices @returns {Loaded} */
  load(vertices, indices) {
    const { gl } = this;
    const vao = gl.createVertexArray();
    const buffers = [gl.createBuffer()];
    gl.bindVertexArray(vao);
    gl.bindBuffer(gl.ARRAY_BUFFER, buffers[0]);
    gl.bufferData(gl.ARRAY_BUFFER, vertices, gl.STATIC_DRAW);
    for (const [location, size, at] of [[0, 3, 0], [1, 3, 3], [2, 1, 6]]) {
      gl.enableVertexAttribArray(location);
      gl.vertexAttribPointer(location, size, gl.FLOAT, false, VERTEX_FLOATS * 4, at * 4);
    }
    if (indices !== null) {
      buffers.push(gl.createBuffer());
      gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, buffers[1]);
      gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, indices, gl.STATIC_DRAW);
    }
    gl.bindVertexArray(null);
    return { vao, buffers, count: indices === null ? vertices.length / VERTEX_FLOATS : indices.length };
  }

  /** @param {ColliderStyle} style */
  draw(style) {
    this.drawAll(this.placed, style.collider, style);
    this.drawAll(this.poles, style.pole, style);
  }

  /** @param {Placed[]} bodies @param {number[]} color @param {ColliderStyle} style */
  drawAll(bodies, color, { flat, edges }) {
    if (bodies.length === 0) return;
    const { gl } = this;
    this.program.use();
    for (const { solid, shape, turn, a, b } of bodies) {
      const isEdges = solid === "edges";
      const loaded = typeof solid === "number" ? this.loadedMeshes.get(solid) : this.solids[solid];
      const flatColor = isEdges ? edges : flat;
      if (loaded === undefined || flatColor === null) continue;
      this.program.set({ u_shape: shape, u_turn: turn, u_a: a, u_b: b, u_collider: color, u_flat: flatColor });
      gl.bindVertexArray(loaded.vao);
      if (isEdges) gl.drawArrays(gl.LINES, 0, loaded.count);
      else if (typeof solid === "number") gl.drawArrays(gl.TRIANGLES, 0, loaded.count);
      else gl.drawElements(gl.TRIANGLES, loaded.count, gl.UNSIGNED_SHORT, 0);
    }
    gl.bindVertexArray(null);
  }
}
