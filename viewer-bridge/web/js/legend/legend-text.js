// The contents of a legend, for a picture of it.

/**
 * `ends` are the values below the ramp of colours, from its left to its right end.
 * @typedef {{ title: string, ends?: string[], kinds?: { text: string, color: string }[], arrow?: { length: number, color: string }, lines: string[] }} LegendText
 */

/** The texts of elements that are shown and not empty. @param {HTMLElement[]} elements */
export const shownTexts = (...elements) => elements.filter((one) => !one.hidden).map((one) => one.textContent ?? "").filter((text) => text !== "");
