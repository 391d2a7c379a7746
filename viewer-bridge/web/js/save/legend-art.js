// Draws the legends into a picture, as the page shows them.

/** @typedef {import("../legend/legend.js").LegendText} LegendText */
/** Colours of the page. @typedef {{ surface: string, line: string, text: string, soft: string }} LegendColors */
/** A line of a legend, at the top left of the box. @typedef {{ kind: "title" | "line" | "ends" | "ramp" | "kind" | "arrow", y: number, texts: string[], color?: string, width?: number }} Row */

/** Width of a legend without its padding, and other sizes, in CSS pixels. */
const WIDTH = 180;
const PADDING = 10;
const MARGIN = 12;
const GAP = 6;
const LINE = 17;
const RADIUS = 8;
const FONT = "12.5px system-ui, -apple-system, \"Segoe UI\", \"DejaVu Sans\", sans-serif";
/** Distance of a text from its swatch. */
const SWATCH = { width: 16, height: 4, gap: 7 };
const RAMP = { height: 10, gap: 5 };
const ARROW = { shaft: 3, head: 9, half: 5.5 };

/** Divides a text into lines that are not wider than `width`; a longer word has a line of its own.
 * @param {string} text @param {number} width @param {(text: string) => number} measure */
export function wrap(text, width, measure) {
  /** @type {string[]} */
  const lines = [];
  for (const word of text.split(/\s+/).filter(Boolean)) {
    const longer = lines.length === 0 ? word : `${lines[lines.length - 1]} ${word}`;
    if (lines.length > 0 && measure(longer) <= width) lines[lines.length - 1] = longer;
    else lines.push(word);
  }
  return lines;
}

/** Places the rows of a legend from the top. @param {LegendText} legend @param {(text: string) => number} measure @returns {{ rows: Row[], height: number }} */
export function layOut(legend, measure) {
  let y = PADDING;
  /** @type {Row[]} */
  const rows = [];
  const add = (/** @type {Omit<Row, "y">} */ row, /** @type {number} */ height) => {
    rows.push({ ...row, y });
    y += height;
  };
  add({ kind: "title", texts: [legend.title] }, LINE + 2);
  if (legend.ends !== undefined) {
    add({ kind: "ramp", texts: [] }, RAMP.height + RAMP.gap);
    add({ kind: "ends", texts: legend.ends }, LINE);
  }
  for (const { text, color } of legend.kinds ?? []) add({ kind: "kind", texts: [text], color }, LINE);
  if (legend.arrow !== undefined) add({ kind: "arrow", texts: [], color: legend.arrow.color, width: legend.arrow.length }, 2 * ARROW.half + 2);
  for (const text of legend.lines) for (const line of wrap(text, WIDTH, measure)) add({ kind: "line", texts: [line] }, LINE);
  return { rows, height: y + PADDING - 4 };
}

/** Draws legends above each other into the lower right corner of an area in CSS pixels.
 * @param {CanvasRenderingContext2D} context @param {LegendText[]} legends @param {{ width: number, height: number }} area
 * @param {{ colors: LegendColors, ramp: readonly string[] }} style */
export function drawLegends(context, legends, area, { colors, ramp }) {
  const left = area.width - MARGIN - WIDTH - 2 * PADDING;
  let bottom = area.height - MARGIN;
  context.save();
  context.textBaseline = "top";
  for (const legend of [...legends].reverse()) {
    context.font = FONT;
    const { rows, height } = layOut(legend, (text) => context.measureText(text).width);
    const top = bottom - height;
    drawBox(context, left, top, height, colors);
    for (const row of rows) drawRow(context, row, left + PADDING, top + row.y, { colors, ramp });
    bottom = top - GAP;
  }
  context.restore();
}

/** @param {CanvasRenderingContext2D} context @param {number} left @param {number} top @param {number} height @param {LegendColors} colors */
function drawBox(context, left, top, height, colors) {
  context.beginPath();
  context.roundRect(left, top, WIDTH + 2 * PADDING, height, RADIUS);
  context.fillStyle = colors.surface;
  context.fill();
  context.strokeStyle = colors.line;
  context.lineWidth = 1;
  context.stroke();
}

/** @param {CanvasRenderingContext2D} context @param {Row} row @param {number} x @param {number} y @param {{ colors: LegendColors, ramp: readonly string[] }} style */
function drawRow(context, { kind, texts, color, width }, x, y, { colors, ramp }) {
  context.font = kind === "title" ? `600 ${FONT}` : FONT;
  context.fillStyle = kind === "ends" ? colors.soft : colors.text;
  context.textAlign = "left";
  if (kind === "ramp") return drawRamp(context, x, y, ramp);
  if (kind === "arrow") return drawArrow(context, x, y, color ?? colors.text, width ?? 0);
  if (kind === "kind") {
    context.fillStyle = color ?? colors.text;
    context.fillRect(x, y + 5, SWATCH.width, SWATCH.height);
    context.fillStyle = colors.text;
    context.fillText(texts[0], x + SWATCH.width + SWATCH.gap, y, WIDTH - SWATCH.width - SWATCH.gap);
    return;
  }
  texts.forEach((text, place) => {
    const share = texts.length < 2 ? 0 : place / (texts.length - 1);
    context.textAlign = share === 0 ? "left" : share === 1 ? "right" : "center";
    context.fillText(text, x + share * WIDTH, y, WIDTH / Math.max(1, texts.length - 1));
  });
}

/** @param {CanvasRenderingContext2D} context @param {number} x @param {number} y @param {readonly string[]} ramp */
function drawRamp(context, x, y, ramp) {
  const gradient = context.createLinearGradient(x, 0, x + WIDTH, 0);
  ramp.forEach((color, stop) => gradient.addColorStop(stop / (ramp.length - 1), color));
  context.fillStyle = gradient;
  context.fillRect(x, y, WIDTH, RAMP.height);
}

/** @param {CanvasRenderingContext2D} context @param {number} x @param {number} y @param {string} color @param {number} length */
function drawArrow(context, x, y, color, length) {
  if (length <= 0) return;
  const middle = y + ARROW.half;
  const neck = Math.max(0, length - ARROW.head);
  context.fillStyle = color;
  context.fillRect(x, middle - ARROW.shaft / 2, neck, ARROW.shaft);
  context.beginPath();
  context.moveTo(x + length, middle);
  context.lineTo(x + neck, middle - ARROW.half);
  context.lineTo(x + neck, middle + ARROW.half);
  context.fill();
}
