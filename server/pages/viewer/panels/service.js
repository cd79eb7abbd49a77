// How the service does, live: one small chart for each figure that an operator looks at.
import { roundUp, sparkPath, whenSized } from "../charts.js";
import { h, svg } from "../dom.js";
import { bytes, time } from "../format.js";

const PLACES = 120; // s

/** What is shown: a name, the figures (of /v1/events), how they read, and the least top of the axis. */
const CHARTS = [
  { name: "latency", lines: [["p50", ({ recent }) => recent.total?.p50_ms ?? null],
    ["p95", ({ recent }) => recent.total?.p95_ms ?? null]], say: time, least: 10 },
  { name: "queue", lines: [["waiting", ({ metrics }) => metrics.penumbra_queue_depth],
    ["rendering", ({ metrics }) => metrics.penumbra_renders_running]], say: String, least: 4 },
  { name: "GPU memory", lines: [["used", ({ metrics }) => metrics.penumbra_gpu_bytes]],
    say: bytes, least: 1 << 20 },
  { name: "worker restarts", lines: [["restarts", ({ metrics }) => metrics.penumbra_worker_restarts_total]],
    say: String, least: 2 },
];

function chart({ name, lines, say, least }) {
  const values = lines.map(() => []), drawing = svg("svg", { class: "spark", role: "img" });
  const figures = lines.map(([label], i) => h("span", { dataset: { series: i }, title: label },
    lines.length > 1 && [h("i"), h("span", { class: "word" }, label + " ")], h("b", {}, "–")));
  const plot = h("div", { class: "plot" }, drawing);
  const element = h("figure", {}, h("figcaption", {}, h("span", { class: "caption" }, name), h("span", { class: "figures" }, figures)), plot);
  let box = { width: 0, height: 0 };

  function draw() {
    const { width, height } = box;
    if (!width) return;
    const most = roundUp(Math.max(least, ...values.flat().filter(Number.isFinite)));
    drawing.setAttribute("viewBox", "0 0 " + width + " " + height);
    drawing.setAttribute("aria-label", name + ": " + lines.map(([label], i) => label + " " +
      (Number.isFinite(values[i].at(-1)) ? say(values[i].at(-1)) : "none")).join(", "));
    drawing.replaceChildren(svg("line", { x1: 0, x2: width, y1: height - 0.5, y2: height - 0.5, class: "floor" }),
      ...values.map((series, i) => svg("path", { d: sparkPath(series, PLACES, width, height - 2, most), fill: "none",
        "data-series": i, transform: "translate(0 1)" })));
  }
  element.note = data => {
    lines.forEach(([, pick], i) => {
      const value = data ? pick(data) ?? null : null;
      values[i].push(value);
      if (values[i].length > PLACES) values[i].shift();
      figures[i].lastChild.textContent = Number.isFinite(value) ? say(value) : "–";
    });
    draw();
  };
  whenSized(plot, (width, height) => { box = { width, height }; draw(); });
  return element;
}

export function mount(element, store, api) {
  const state = h("span", { class: "state" }, h("i"), h("span", {}, "…"));
  const charts = CHARTS.map(chart);
  element.tools.append(state);
  element.append(h("div", { class: "sparks" }, charts));
  const say = (kind, text) => {
    state.dataset.kind = kind;
    state.lastChild.textContent = text;
  };
  api.on("live", data => {
    for (const one of charts) one.note(data);
    const { penumbra_draining: draining, penumbra_ready: ready, penumbra_workers_up: up } = data.metrics;
    if (draining) say("warn", "shutting down");
    else if (!ready || !up) say("warn", "not ready");
    else say("good", "ready");
  });
  api.on("connection", ({ there }) => {
    if (there) return;
    for (const one of charts) one.note(null);
    say("bad", "away");
  });
}
