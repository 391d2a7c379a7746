// Colours of the picture for the light and dark colour schemes, and the ramp of the heat map. Colours
// are sRGB here and linear in the shaders.

/** @typedef {[number, number, number]} Color  linear light, 0..=1 */

/** @param {string} hex "#rrggbb" @returns {Color} */
export function linear(hex) {
  const channel = (/** @type {number} */ at) => (parseInt(hex.slice(at, at + 2), 16) / 255) ** 2.2;
  return [channel(1), channel(3), channel(5)];
}

/**
 * Dark blue through grey to yellow. Lightness rises evenly, and no two colours differ only in red and
 * green, so the ramp is readable in print and with colour blindness.
 */
export const HEAT_STOPS = ["#0b2f6b", "#41527a", "#7b7b7b", "#b9a85a", "#fde737"];

/** Colours of the kinds of constraints, by number: told apart with every kind of colour blindness. */
export const KIND_COLORS = ["#0072b2", "#e69f00", "#cc79a7", "#009e73"];

/** The colour of force arrows, also in their legend. */
export const FORCE_COLOR = "#009c8c";

/** The colours of a ghost, also in the timeline. */
export const GHOST_COLORS = { light: "#0a78c2", dark: "#63c7ff" };

/** The colour of a part whose value is not known: fainter than any on the ramp. */
export const UNKNOWN_COLORS = { light: "#d9d5cd", dark: "#39424d" };

/**
 * @typedef {{
 *   backdropTop: Color, backdropBottom: Color, ground: Color, gridLine: Color, gridContrast: number, shadow: number,
 *   sky: Color, bounce: Color, key: number,
 *   front: Color, back: Color, stick: Color, stickFaint: Color, particle: Color, collider: Color,
 *   flatSurface: Color, flatStick: Color, unknown: Color, wood: Color, pole: Color, body: Color,
 *   pin: Color, anchor: Color, grabbed: Color, frozen: Color, ring: Color, force: Color, ghost: Color,
 * }} Palette
 */

const MARKS = {
  pin: linear("#2f6fde"), anchor: linear("#7a4fd0"), grabbed: linear("#ff8a1f"), frozen: linear("#e0218a"), ring: linear("#ffffff"),
  force: linear(FORCE_COLOR),
};

/** @type {Palette} */
const LIGHT = {
  backdropTop: linear("#dfe5ea"), backdropBottom: linear("#f6f3ee"), ground: linear("#ebe7df"), gridLine: linear("#8d8f92"), gridContrast: 0.5, shadow: 0.26,
  sky: linear("#e9eef5"), bounce: linear("#a1968a"), key: 1.0,
  front: linear("#a3202b"), back: linear("#d8c5a4"), stick: linear("#2b3440"), stickFaint: linear("#6d7884"), particle: linear("#3b4656"), collider: linear("#9aa7b2"),
  flatSurface: linear("#e3cfca"), flatStick: linear("#8c2630"), unknown: linear(UNKNOWN_COLORS.light), wood: linear("#b98a58"), pole: linear("#c9ccd0"), body: linear("#64748a"), ghost: linear(GHOST_COLORS.light), ...MARKS,
};

/** @type {Palette} */
const DARK = {
  backdropTop: linear("#12161c"), backdropBottom: linear("#232a33"), ground: linear("#252c35"), gridLine: linear("#6f7d8c"), gridContrast: 0.34, shadow: 0.45,
  sky: linear("#aebfd6"), bounce: linear("#4a4440"), key: 0.95,
  front: linear("#b3242f"), back: linear("#d6c19c"), stick: linear("#d5dde6"), stickFaint: linear("#76838f"), particle: linear("#c3cedb"), collider: linear("#66727f"),
  flatSurface: linear("#41242a"), flatStick: linear("#e0737c"), unknown: linear(UNKNOWN_COLORS.dark), wood: linear("#a97d50"), pole: linear("#9aa4af"), body: linear("#a3b1c1"), ghost: linear(GHOST_COLORS.dark), ...MARKS,
};

/** The shared uniforms that depend only on the palette. @param {Palette} palette */
const uniformsOf = (palette) => ({
  u_sky: palette.sky, u_bounce: palette.bounce, u_key: palette.key, u_unknown: palette.unknown, u_front: palette.front, u_back: palette.back,
  u_stick_faint: palette.stickFaint, u_ring: palette.ring, u_wood: palette.wood, u_body: palette.body,
  u_marks: [palette.pin, palette.anchor, palette.grabbed, palette.frozen],
  u_heat_stops: HEAT_STOPS.map(linear), u_kinds: KIND_COLORS.map(linear),
});
const UNIFORMS = { light: uniformsOf(LIGHT), dark: uniformsOf(DARK) };

/** @param {boolean} isDark */
export const paletteUniforms = (isDark) => (isDark ? UNIFORMS.dark : UNIFORMS.light);

/** @param {boolean} isDark */
export const paletteOf = (isDark) => (isDark ? DARK : LIGHT);
