// Saves the picture, with its legends, as a file of the user.

import { find } from "../ui/dom.js";
import { save } from "../ui/save.js";

export class PictureButton {
  /** @param {import("../gl/renderer.js").Renderer} renderer @param {import("./composition.js").Composition} composition @param {import("../ui/banner.js").Banner} banner */
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
