// `window.viewer`, the interface of the page for tests. It is read-only, but can draw on demand.

import { inspectItem } from "./state/inspection.js";

/**
 * @typedef {{
 *   app: import("./tools/tool.js").App, colorLegend: import("./legend/legend.js").ColorLegend, charts: import("./panel/charts.js").Charts, connector: import("./net/socket.js").Connector,
 *   banner: import("./ui/banner.js").Banner, input: import("./tools/input.js").Input, faults: string[],
 *   scriptMs: () => number,
 * }} Parts
 */

/** @param {Parts} parts */
export function createViewer({ app, colorLegend, charts, connector, banner, input, faults, scriptMs }) {
  const { simulation, camera, renderer, commands } = app;
  const viewer = {
    /** Step of the drawn picture, or -1 before the first. */
    get step() { return renderer.stepDrawn; },
    /** Number of the drawn frame, or -1 before the first. */
    get frame() { return renderer.frameDrawn?.number ?? -1; },
    get framesDrawn() { return renderer.framesDrawn; },
    get epoch() { return simulation.scene?.epoch ?? null; },
    get scene() { return simulation.scene?.name ?? null; },
    /** Number of pages of the bridge, as far as it has told. */
    get pages() { return simulation.stats?.clients ?? 1; },
    get connection() { return connector.connection.state; },
    get node() { return simulation.node?.state ?? null; },
    /** Step of the earlier state on show, or null in the present. */
    get past() { return simulation.isLookingBack ? simulation.frame?.step ?? null : null; },
    /** Newest step received, on show or not. */
    get present() { return simulation.present?.step ?? -1; },
    get scenes() { return simulation.hello?.scenes ?? []; },
    get history() { return simulation.history; },
    get mode() { return simulation.hello?.mode ?? null; },
    get paused() { return simulation.isPaused; },
    get particleCount() { return simulation.scene?.particleCount ?? 0; },
    get constraintCount() { return simulation.scene?.constraintCount ?? 0; },
    get torn() { return simulation.torn.length; },
    /** Particles that are pinned, grabbed, anchored or frozen, with their flags. */
    get pins() { return [...simulation.pins]; },
    get grabbed() { return input.grabbed; },
    get colliders() { return simulation.colliders.map(({ shape, center }) => ({ shape, center: [...center] })); },
    /** The selected items, with what is known of each. */
    get selected() { return app.selection.items.map((item) => ({ ...inspectItem(simulation, item), ...item })); },
    get pointerMode() { return input.mode; },
    get toggles() { return { ...renderer.toggles }; },
    /** The drawn force arrows, in N, and their length per newton. */
    get arrows() { return renderer.arrowsDrawn.map(({ from, force, ...which }) => ({ ...which, from: [...from], force: [...force] })); },
    get unitsPerNewton() { return renderer.unitsPerNewton(); },
    /** The quantity that the colours show, the ends of the scale, and the extremes once they are known. */
    get coloring() { return { ...colorLegend.scan.found, ...renderer.coloring }; },
    /** The plots in their order, with what each says now. */
    get plots() { return charts.plots.map(({ spec, output }) => ({ title: spec.title, text: output.textContent })); },
    get plotCursor() { return charts.cursor; },
    get csv() { return charts.csv(); },
    get renderer() { return renderer.rendererName; },
    get banner() { return banner.text; },
    get notices() { return [...banner.history]; },
    get faults() { return [...faults]; },
    get unanswered() { return commands.waiting.size; },
    /** Mean time of the page's script per animation frame, without drawing, in ms. */
    get scriptMs() { return scriptMs(); },
    get camera() {
      const { viewport } = renderer;
      return {
        view: camera.view(), projection: camera.projection(viewport.width / viewport.height),
        viewProjection: camera.viewProjection(viewport), target: [...camera.target], distance: camera.distance,
        yaw: camera.yaw, pitch: camera.pitch, isFlat: camera.isFlat,
      };
    },
    /** Position of a particle in the drawn frame. @param {number} particle */
    position: (particle) => simulation.position(particle),
    /** The CSS pixel of the window at which a particle is drawn, or null. @param {number} particle */
    project(particle) {
      const at = simulation.position(particle);
      const pixel = at === null ? null : camera.project(at, renderer.viewport);
      if (pixel === null) return null;
      const box = renderer.canvas.getBoundingClientRect();
      return { x: box.left + pixel.x, y: box.top + pixel.y };
    },
    /** Draws now. Pixels can be read only in the same task. */
    draw() { renderer.draw(); },
    /** Draws, and returns the colours of a rectangle given in CSS pixels of the window: rows from the top, RGBA.
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
