// What the charts have in common: scales and their ticks.

/** From [low, high] to [from, to], by logarithm. */
export function logScale(low, high, from, to) {
  const span = Math.log(high / low);
  return value => from + (to - from) * Math.log(value / low) / span;
}

/** Round numbers within [low, high]: decades, with 2 and 5 between where there are few. */
export function logTicks(low, high) {
  const ticks = [], decades = Math.log10(high / low);
  const steps = decades > 2.5 ? [1] : decades > 1.2 ? [1, 2, 5] : [1, 1.5, 2, 3, 4, 5, 7];
  for (let power = Math.floor(Math.log10(low)); power <= Math.ceil(Math.log10(high)); power++)
    for (const step of steps) {
      const tick = Number((step * 10 ** power).toPrecision(3));
      if (tick >= low && tick <= high) ticks.push(tick);
    }
  return ticks;
}

/** The best so far: points sorted by `x` of which each has a smaller `y` than all before. */
export function frontOf(points) {
  let best = Infinity;
  return [...points].sort((a, b) => a.x - b.x || a.y - b.y).filter(point => {
    const better = point.y < best;
    best = Math.min(best, point.y);
    return better;
  });
}

/** A line through values of one series as an SVG path, the last at the right; null: a gap. */
export function sparkPath(values, places, width, height, most) {
  const step = width / (places - 1), left = width - (values.length - 1) * step;
  let path = "", pen = "M";
  values.forEach((value, i) => {
    if (value === null || !Number.isFinite(value)) { pen = "M"; return; }
    path += pen + (left + i * step).toFixed(1) + " " + (height - height * value / most).toFixed(1);
    pen = "L";
  });
  return path;
}

/** The next "round" number, for the top of an axis from 0. */
export function roundUp(value) {
  if (!(value > 0)) return 1;
  const power = 10 ** Math.floor(Math.log10(value));
  return [1, 2, 5, 10].map(step => step * power).find(top => top >= value * 0.999);
}

/** Calls `draw(width, height)` whenever the element has another size. */
export function whenSized(element, draw) {
  new ResizeObserver(([{ contentRect }]) => {
    if (contentRect.width > 1 && contentRect.height > 1) draw(contentRect.width, contentRect.height);
  }).observe(element);
}
