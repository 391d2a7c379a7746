// Saves the picture, with its legends, as a file of the user.

import { HEAT_STOPS } from "../gl/theme.js";
import { cssColor, find, save } from "../ui/dom.js";
import { drawLegends } from "./legend-art.js";

export class PictureButton {
  /** @param {import("../gl/renderer.js").Renderer} renderer @param {Composition} composition @param {import("../ui/banner.js").Banner} banner */
  constructor(renderer, composition, banner) {
    this.renderer = renderer;
    this.composition = composition;
    this.banner = banner;
    find("picture", HTMLButtonElement).addEventListener("click", () => this.save());
  }

  save() {
    const { renderer, composition } = this;
    renderer.draw();
    const canvas = document.createElement("canvas");
    canvas.width = renderer.canvas.width;
    canvas.height = renderer.canvas.height;
    const context = canvas.getContext("2d");
    const name = `${composition.fileName()}.png`;
    if (context === null) return this.fail();
    composition.paint(context);
    canvas.toBlob((blob) => (blob === null ? this.fail() : save(blob, name)), "image/png");
  }

  fail() {
    this.banner.notify("The picture could not be saved: the browser has no memory for it. Make the window smaller.", "error");
  }
}

/** The place of an area within another one, as large as it fits and in the middle.
 * @param {{ width: number, height: number }} inner @param {{ width: number, height: number }} outer */
export function fitted(inner, outer) {
  const scale = Math.min(outer.width / inner.width, outer.height / inner.height);
  const [width, height] = [inner.width * scale, inner.height * scale];
  return { x: (outer.width - width) / 2, y: (outer.height - height) / 2, width, height };
}

export class Composition {
  /** @param {import("../tools/tool.js").App} app @param {HTMLCanvasElement} overlay @param {{ describe(): import("../legend/legend.js").LegendText | null }[]} legends from the top */
  constructor({ renderer, simulation }, overlay, legends) {
    this.renderer = renderer;
    this.simulation = simulation;
    this.overlay = overlay;
    this.legends = legends;
    /** The colours of the page, and the scheme that they belong to. @type {import("./legend-art.js").LegendColors | null} */
    this.colors = null;
    this.isDark = false;
  }

  /** Paints the picture over a whole canvas. The picture must have been drawn in the same task.
   * @param {CanvasRenderingContext2D} context */
  paint(context) {
    const { renderer, overlay } = this;
    const { viewport, canvas } = renderer;
    const colors = this.pageColors();
    context.setTransform(1, 0, 0, 1, 0, 0);
    const { x, y, width, height } = fitted(canvas, context.canvas);
    context.fillStyle = colors.surface;
    context.fillRect(0, 0, context.canvas.width, context.canvas.height);
    context.drawImage(canvas, x, y, width, height);
    if (overlay.width > 0 && overlay.height > 0) context.drawImage(overlay, x, y, width, height);
    // The legends are laid out in CSS pixels.
    context.setTransform(width / viewport.width, 0, 0, height / viewport.height, x, y);
    const legends = this.legends.flatMap((one) => one.describe() ?? []);
    drawLegends(context, legends, viewport, { colors, ramp: HEAT_STOPS });
  }

  pageColors() {
    const { isDark } = this.renderer;
    if (this.colors === null || this.isDark !== isDark) {
      this.isDark = isDark;
      this.colors = { surface: cssColor("--surface"), line: cssColor("--line"), text: cssColor("--text"), soft: cssColor("--soft") };
    }
    return this.colors;
  }

  /** Name of a file without its ending: the scene, and the step on show. */
  fileName() {
    const { scene, frame } = this.simulation;
    return `${scene?.name || "catenary"}-${frame?.step ?? 0}`;
  }
}
