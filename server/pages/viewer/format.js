// Numbers as people read them.

/** Milliseconds with three figures: "0.42 ms", "12.3 ms", "1.24 s". */
export function time(ms) {
  if (!Number.isFinite(ms)) return "–";
  if (ms >= 1000) return (ms / 1000).toPrecision(3) + " s";
  return (ms >= 100 ? ms.toFixed(0) : ms >= 10 ? ms.toFixed(1) : ms.toFixed(2)) + " ms";
}

/** "532 B", "1.4 MiB". */
export function bytes(count) {
  const units = ["B", "KiB", "MiB", "GiB", "TiB"];
  let at = 0;
  for (; count >= 1000 && at < units.length - 1; at++) count /= 1024;
  return (at && count < 9.95 ? count.toFixed(1) : Math.round(count)) + " " + units[at];
}

/** An error of visibility: ".042", "0". */
export function error(value) {
  if (value === null || value === undefined) return "–";
  if (value === 0) return "0";
  return (value < 0.001 ? value.toExponential(1) : value.toPrecision(2)).replace(/^0\./, ".");
}

/** "69,453". */
export const count = value => value.toLocaleString("en");

/** A number without the tail that float has: 0.0005, 12.35. */
export const short = value => String(Number(Number(value).toPrecision(5)));
