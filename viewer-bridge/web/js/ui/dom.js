// Helpers for DOM elements and 2-D canvases.

/** Returns the element with an id, and throws if it is missing. @template {Element} T @param {string} id @param {{ new (): T }} Type @returns {T} */
export function find(id, Type) {
  const element = document.getElementById(id);
  if (!(element instanceof Type)) throw new Error(`the page has no ${Type.name} #${id}`);
  return element;
}

/**
 * Creates an element with attributes and children.
 * @template {keyof HTMLElementTagNameMap} K
 * @param {K} tag @param {Record<string, string | number | boolean>} [attributes] @param {(Node | string)[]} children
 * @returns {HTMLElementTagNameMap[K]}
 */
export function make(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (typeof value === "boolean") element.toggleAttribute(name, value);
    else element.setAttribute(name, String(value));
  }
  element.append(...children);
  return element;
}

/** Enables a control if there is no reason against it; its tooltip gives the reason. @param {HTMLButtonElement | HTMLInputElement | HTMLSelectElement} control @param {string} reason */
export function enable(control, reason) {
  control.dataset.title ??= control.title;
  control.disabled = reason !== "";
  control.title = reason || control.dataset.title;
}

/** Clears a canvas, sizes it to device pixels, and returns its context with the size in CSS pixels. @param {HTMLCanvasElement} canvas */
export function sharpContext(canvas) {
  const ratio = Math.min(devicePixelRatio || 1, 2);
  const width = Math.max(1, canvas.clientWidth);
  const height = Math.max(1, canvas.clientHeight);
  if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
  }
  const context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.clearRect(0, 0, width, height);
  return { context, width, height };
}

/** Value of a custom property of the style sheet. @param {string} name */
export const cssColor = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

/** Time in ms in which the browser takes the content. */
const KEPT_MS = 10_000;

/** @param {Blob} content @param {string} name */
export function save(content, name) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(content);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), KEPT_MS);
}
