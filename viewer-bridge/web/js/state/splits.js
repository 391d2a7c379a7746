// The pieces of triangles with torn edges. An edge tears in its middle, so a cut is a line through the
// surface, and each piece stays with the corners that it still hangs on.

/** @typedef {{ particle: number, x: number, y: number, isIntact: boolean, fan: number }} Spoke  an edge at a particle, laid flat */
/**
 * The triangles around the particles. A corner is an index into the list of triangles; `edge` of a corner
 * is the one to the next corner.
 * @typedef {{
 *   triangles: ArrayLike<number>, cornersAt(particle: number): ArrayLike<number>,
 *   isTorn(corner: number): boolean, restLength(corner: number): number,
 * }} Mesh
 */

/** Words of a vertex that is not a particle: particles a, p, q and 0, then the weights of p - a and q - a as f32 bits, 0, 0. */
export const SPLIT_WORDS = 8;
/** Least sine of the angle between two edges from which a third direction is derived. */
const SINE_MIN = 0.3;

/** Part of the way to the middle of a torn edge that a piece reaches: the rest shows the cut while it is closed. */
const REACH = 0.96;

/** The next corner of the same triangle. @param {number} corner */
export const nextCorner = (corner) => corner - (corner % 3) + ((corner + 1) % 3);

/**
 * The pieces of triangles: vertices of SPLIT_WORDS words, and indices. An index from `particleCount` on is
 * that of a vertex. A corner without two intact edges has no piece.
 * @param {Mesh} mesh @param {Iterable<number>} split triangles with a torn edge @param {number} particleCount
 */
export function splitPieces(mesh, split, particleCount) {
  /** @type {number[]} */
  const vertices = [];
  /** @type {number[]} */
  const indices = [];
  const layouts = new Map();
  const known = new Map();
  const layoutOf = (/** @type {number} */ a) => {
    if (!layouts.has(a)) layouts.set(a, spokesOf(mesh, a));
    return /** @type {Map<number, Spoke>} */ (layouts.get(a));
  };
  /** The vertex at `share` of the sum of the edges from a to others. @param {number} a @param {number[]} others @param {number} share */
  const vertexAt = (a, others, share) => {
    const key = others.length === 1 ? a * particleCount + others[0] : NaN;
    const index = known.get(key);
    if (index !== undefined) return index;
    const spokes = layoutOf(a);
    const words = anchored(a, spokes, others.map((one) => /** @type {Spoke} */ (spokes.get(one))), share);
    const made = words === null ? null : particleCount + vertices.length / SPLIT_WORDS;
    if (words !== null) vertices.push(...words);
    if (!Number.isNaN(key)) known.set(key, made);
    return made;
  };
  const middle = (/** @type {number} */ a, /** @type {number} */ b) => vertexAt(a, [b], 0.5 * REACH);
  const add = (/** @type {(number | null)[]} */ ...corners) => { if (!corners.includes(null)) indices.push(.../** @type {number[]} */ (corners)); };
  for (const triangle of split) {
    const corners = [3 * triangle, 3 * triangle + 1, 3 * triangle + 2];
    const torn = corners.filter((corner) => mesh.isTorn(corner));
    if (torn.length === 1) {
      const [a, b, c] = from(mesh, torn[0]);
      // Where a has no other edge, the third corner carries the middle.
      const between = () => {
        vertices.push(c, a, b, 0, floatBits(0.5), floatBits(0.5), 0, 0);
        return particleCount + vertices.length / SPLIT_WORDS - 1;
      };
      add(a, middle(a, b) ?? between(), c);
      add(middle(b, a) ?? between(), b, c);
    } else if (torn.length === 2) {
      // Only the edge between a and b is intact.
      const [a, b, c] = from(mesh, /** @type {number} */ (corners.find((corner) => !torn.includes(corner))));
      add(a, b, middle(b, c));
      add(a, middle(b, c), middle(a, c));
      add(c, middle(c, a), middle(c, b));
    } else {
      for (const corner of corners) {
        const [a, b, c] = from(mesh, corner);
        const center = vertexAt(a, [b, c], REACH / 3);
        add(a, middle(a, b), center);
        add(a, center, middle(a, c));
      }
    }
  }
  return { vertices: Uint32Array.from(vertices), indices: Uint32Array.from(indices) };
}

/** The particles of a triangle, beginning at a corner. @param {Mesh} mesh @param {number} corner */
const from = (mesh, corner) => [corner, nextCorner(corner), nextCorner(nextCorner(corner))].map((one) => mesh.triangles[one]);

/** The edges at a particle, laid flat with their rest lengths and the angles between them. @param {Mesh} mesh @param {number} a */
function spokesOf(mesh, a) {
  /** @type {Map<number, Spoke>} */
  const spokes = new Map();
  const corners = Array.from(mesh.cornersAt(a));
  const following = new Map(corners.map((corner) => [mesh.triangles[nextCorner(corner)], corner]));
  const reached = new Set(corners.map((corner) => mesh.triangles[nextCorner(nextCorner(corner))]));
  // A fan at the border begins at the edge that no triangle leads to; a closed one begins anywhere.
  const starts = [...following.keys()].sort((p, q) => Number(reached.has(p)) - Number(reached.has(q)));
  starts.forEach((start, fan) => {
    let angle = 0;
    for (let first = start; !spokes.has(first) && following.has(first);) {
      const corner = /** @type {number} */ (following.get(first));
      const before = nextCorner(nextCorner(corner));
      spokes.set(first, spoke(first, angle, mesh.restLength(corner), !mesh.isTorn(corner), fan));
      angle += cornerAngle(mesh, corner);
      const second = mesh.triangles[before];
      if (!spokes.has(second) && !following.has(second)) spokes.set(second, spoke(second, angle, mesh.restLength(before), !mesh.isTorn(before), fan));
      first = second;
    }
  });
  return spokes;
}

/** @param {number} particle @param {number} angle @param {number} length @param {boolean} isIntact @param {number} fan @returns {Spoke} */
const spoke = (particle, angle, length, isIntact, fan) => ({ particle, x: length * Math.cos(angle), y: length * Math.sin(angle), isIntact, fan });

/** The angle of an unstrained triangle at a corner, by the law of cosines. @param {Mesh} mesh @param {number} corner */
function cornerAngle(mesh, corner) {
  const second = nextCorner(corner);
  const third = nextCorner(second);
  const [b, opposite, c] = [corner, second, third].map((one) => mesh.restLength(one));
  const cosine = (b * b + c * c - opposite * opposite) / (2 * b * c);
  return Math.acos(Math.min(1, Math.max(-1, cosine || 0)));
}

/** A vertex that moves with two intact edges of a particle. Returns null if there are none that span the plane.
 * @param {number} a @param {Map<number, Spoke>} spokes @param {Spoke[]} along @param {number} share */
function anchored(a, spokes, along, share) {
  const [x, y] = [along.reduce((sum, one) => sum + one.x * share, 0), along.reduce((sum, one) => sum + one.y * share, 0)];
  const intact = [...spokes.values()].filter((one) => one.isIntact && one.fan === along[0].fan);
  let best = null;
  let sineMax = SINE_MIN;
  for (let i = 0; i + 1 < intact.length; i++) {
    const [p, q] = [intact[i], intact[i + 1]];
    const cross = p.x * q.y - p.y * q.x;
    const sine = Math.abs(cross) / (Math.hypot(p.x, p.y) * Math.hypot(q.x, q.y));
    if (sine > sineMax) [best, sineMax] = [{ p, q, cross }, sine];
  }
  if (best === null) return null;
  const { p, q, cross } = best;
  return [a, p.particle, q.particle, 0, floatBits((x * q.y - y * q.x) / cross), floatBits((p.x * y - p.y * x) / cross), 0, 0];
}

const scratch = new DataView(new ArrayBuffer(4));

/** @param {number} value */
export function floatBits(value) {
  scratch.setFloat32(0, value);
  return scratch.getUint32(0);
}
