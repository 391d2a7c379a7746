// Orbiting and panning with the pointer.

/** @typedef {import("../geometry/pick.js").Pixel} Pixel */
/** @typedef {import("./tool.js").App} App */
/** @typedef {import("./tool.js").Tool} Tool */

/** @implements {Tool} */
export class ViewTool {
  /** @param {App} app @param {Pixel} start @param {"orbit" | "pan"} motion */
  constructor(app, start, motion) {
    this.app = app;
    this.start = start;
    this.before = start;
    this.motion = motion;
  }

  /** @param {Pixel} to */
  move(to) {
    const { camera, renderer } = this.app;
    const dx = to.x - this.before.x;
    const dy = to.y - this.before.y;
    if (this.motion === "pan" || camera.isFlat) camera.pan(dx, dy, renderer.viewport);
    else camera.orbit(dx, dy);
    this.before = to;
    renderer.isDirty = true;
  }

  tick() {}

  end() {}

  cancel() {}

  describe() {
    return {};
  }
}
