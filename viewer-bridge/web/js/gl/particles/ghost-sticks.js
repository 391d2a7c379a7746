// The ghost of a replay: the constraints of another recording as thin sticks, fainter where something hides them.

import { sameNumbers } from "../../geometry/math.js";
import { CONSTRAINT } from "../../net/wire.js";
import { STICK, drawnSticks } from "../../state/topology.js";
import { ArrayTexture, UNITS, layouts } from "../context.js";
import { STICKS } from "../styles.js";

/** @typedef {import("./sticks.js").Sticks} Sticks */

/** Thin flat sticks of all listed constraints. */
const THIN = { u_is_all: 1, u_radius: 0, u_round: 0 };
/** In front of everything else, behind something, and in 2-D. */
const VISIBLE = { ...THIN, u_forward: STICKS.solid.u_forward, u_opacity: 0.9 };
const HIDDEN = { ...VISIBLE, u_opacity: 0.25 };
const FLAT = { ...VISIBLE, u_forward: 0 };

/** The constraints that show the shape: structural ones, or all if there are none. @param {import("../../net/wire.js").Scene} scene @param {number} limit */
function ghostSticks(scene, limit) {
  const drawn = drawnSticks(scene, limit);
  const structural = drawn.filter((constraint) => scene.constraintKinds[constraint] === CONSTRAINT.structural);
  return structural.length > 0 ? structural : drawn;
}

export class GhostSticks {
  /** @param {WebGL2RenderingContext} gl @param {Sticks} sticks for positions as f32, which it fills @param {import("../../state/topology.js").Topology} topology @param {number} limit number of sticks at most */
  constructor(gl, sticks, { scene }, limit) {
    this.gl = gl;
    this.scene = scene;
    this.sticks = sticks;
    this.positions = new ArrayTexture(gl, UNITS.u_positions, layouts(gl).f32x3, scene.particleCount);
    this.styles = Uint8Array.from(scene.constraintKinds);
    this.gains = new Float32Array(scene.constraintCount);
    /** Constraints that the ghost lacks. */
    this.hidden = new Uint32Array(0);
    this.sticks.setSticks({ scene, styles: this.styles, gains: this.gains }, ghostSticks(scene, limit), new Float32Array(scene.constraintCount));
  }

  /** @param {import("../../net/wire.js").Ghost} ghost */
  write(ghost) {
    if (ghost.positions.length > 0) this.positions.write(ghost.positions);
    if (sameNumbers(ghost.hidden, this.hidden)) return;
    this.hidden = ghost.hidden.slice();
    this.styles.set(this.scene.constraintKinds);
    for (const constraint of this.hidden) this.styles[constraint] |= STICK.isGone;
    this.sticks.update(this);
  }

  /** Draws over the picture. Afterwards, the positions are those of `others` again.
   * @param {import("../context.js").Uniforms} sceneStyle @param {ArrayTexture} others @param {{ isFlat: boolean }} scene */
  draw(sceneStyle, others, { isFlat }) {
    const { gl } = this;
    this.positions.bind();
    if (!isFlat) {
      gl.enable(gl.DEPTH_TEST);
      gl.depthMask(false);
      gl.depthFunc(gl.GREATER);
      this.sticks.draw(sceneStyle, HIDDEN);
      gl.depthMask(true);
      gl.depthFunc(gl.LEQUAL);
    }
    this.sticks.draw(sceneStyle, isFlat ? FLAT : VISIBLE);
    others.bind();
  }

  delete() {
    this.positions.delete();
    this.sticks.clear();
  }
}
