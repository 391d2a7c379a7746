// The plots as a table: a row for each time at which any of them has a sample.

/** @typedef {{ name: string, series: import("./series.js").Series }} Column */

/** @param {Column[]} columns @param {number} rateHz steps per second */
export function csvOf(columns, rateHz) {
  const lines = [["time_s", "step", ...columns.map(({ name }) => name)].map(quoted).join(",")];
  const next = columns.map(() => 0);
  for (;;) {
    const times = columns.map(({ series }, k) => (next[k] < series.size ? series.timeAt(next[k]) : Infinity));
    const time = Math.min(...times, Infinity);
    if (time === Infinity) return `${lines.join("\r\n")}\r\n`;
    const cells = columns.map(({ series }, k) => {
      if (times[k] !== time) return "";
      const value = series.valueAt(next[k]++);
      return Number.isFinite(value) ? String(value) : "";
    });
    lines.push([Number(time.toPrecision(12)), Math.round(time * rateHz), ...cells].join(","));
  }
}

/** @param {string} cell */
const quoted = (cell) => (/[",\r\n]/.test(cell) ? `"${cell.replaceAll('"', '""')}"` : cell);
