// What tests may ask of the page: `window.viewer`. Read-only, but for a picture on demand.

/**
 * @typedef {{
 *   bench: import("./tools.js").Bench, connector: import("./socket.js").Connector,
 *   banner: import("./banner.js").Banner, input: import("./input.js").Input, faults: string[],
 *   scriptMs: () => number,
 * }} Parts
 */

/** @param {Parts} parts */
export function viewerOf({ bench, connector, banner, input, faults, scriptMs }) {
  const { simulation, camera, renderer, commands } = bench;
  const viewer = {
    /** Step of the newest picture, -1 before the first. */
    get step() { return renderer.stepDrawn; },
    /** Number of the newest frame that was drawn, -1 before the first. */
    get frame() { return renderer.frameDrawn?.number ?? -1; },
    get framesDrawn() { return renderer.framesDrawn; },
    get epoch() { return simulation.scene?.epoch ?? null; },
    get scene() { return simulation.scene?.name ?? null; },
    get connection() { return connector.connection.state; },
    get node() { return simulation.node?.state ?? null; },
    get mode() { return simulation.hello?.mode ?? null; },
    get paused() { return simulation.isPaused; },
    get particleCount() { return simulation.scene?.particleCount ?? 0; },
    get constraintCount() { return simulation.scene?.constraintCount ?? 0; },
    get torn() { return simulation.torn.length; },
    /** Particles that are pinned, grabbed, anchored or frozen, with their flags. */
    get pins() { return [...simulation.pins]; },
    get held() { return input.tool !== null && "particle" in input.tool ? input.tool.particle : null; },
    get tool() { return input.mode; },
    get toggles() { return { ...renderer.toggles }; },
    get heatMax() { return renderer.heatMax; },
    get renderer() { return renderer.rendererName; },
    get banner() { return banner.text; },
    get notices() { return [...banner.said]; },
    get faults() { return [...faults]; },
    get unanswered() { return commands.waiting.size; },
    /** Mean time of the page's own script in an animation frame, without drawing, ms. */
    get scriptMs() { return scriptMs(); },
    get camera() {
      const { viewport } = renderer;
      return {
        view: camera.view(), projection: camera.projection(viewport.width / viewport.height),
        viewProjection: camera.viewProjection(viewport), target: [...camera.target], distance: camera.distance,
        yaw: camera.yaw, pitch: camera.pitch, isFlat: camera.isFlat,
      };
    },
    /** Position of a particle in the picture that is drawn. @param {number} particle */
    position: (particle) => simulation.position(particle),
    /** The CSS pixel of the window that shows a particle, or null. @param {number} particle */
    project(particle) {
      const at = simulation.position(particle);
      const pixel = at === null ? null : camera.project(at, renderer.viewport);
      if (pixel === null) return null;
      const box = renderer.canvas.getBoundingClientRect();
      return { x: box.left + pixel.x, y: box.top + pixel.y };
    },
    /** Draws now; pixels can be read in the same task only. */
    draw() { renderer.draw(); },
    /** The colours of a rectangle, in CSS pixels of the window, just drawn: rows from the top, RGBA.
     * @param {number} x @param {number} y @param {number} width @param {number} height */
    pixels(x, y, width, height) {
      renderer.draw();
      const { gl, canvas, viewport } = renderer;
      const box = canvas.getBoundingClientRect();
      const ratio = canvas.height / viewport.height;
      const [wide, high] = [Math.round(width * ratio), Math.round(height * ratio)];
      const bytes = new Uint8Array(wide * high * 4);
      const bottom = canvas.height - Math.round((y - box.top) * ratio) - high;
      gl.readPixels(Math.round((x - box.left) * ratio), bottom, wide, high, gl.RGBA, gl.UNSIGNED_BYTE, bytes);
      const rows = Array.from({ length: high }, (_, row) => bytes.subarray((high - 1 - row) * wide * 4, (high - row) * wide * 4));
      return { width: wide, height: high, data: rows.flatMap((row) => [...row]) };
    },
  };
  return Object.freeze(viewer);
}
