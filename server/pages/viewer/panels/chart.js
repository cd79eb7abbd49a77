// Error against time: every method a point on this scene and view, as the comparison measures it.
import { frontOf, logScale, logTicks, whenSized } from "../charts.js";
import { announce, h, svg } from "../dom.js";
import { error as errorText, short, time } from "../format.js";
import { compareRequest, shortName, viewOf } from "../measure.js";
import { VIEW_KEYS } from "../state.js";

const MEASURES = [["rmse_penumbra", "RMSE, penumbra"], ["rmse", "RMSE, all pixels"], ["flip", "FLIP"]];
const REACH = 28; // px, around a point
const MARGIN = { left: 46, right: 28, top: 10, bottom: 20 };

export function mount(element, store, api) {
  let rows = [], reference = null, size = null, measuredView = null, stop = null, total = 0;
  let points = [], hovered = null, thumbs = new Map(), box = { width: 0, height: 0 };

  const measure = h("select", { "aria-label": "Error measure", class: "small",
    onchange: () => store.set({ error: measure.value }) }, MEASURES.map(([key, text]) => new Option(text, key)));
  const button = h("button", { type: "button", id: "measure", onclick: () => stop ? stop.abort() : run() });
  element.tools.append(measure, button);
  const drawing = svg("svg", { class: "chart", role: "group", "aria-label": "Methods by time and error" });
  const empty = h("div", { class: "unmeasured" }, h("p", {}, "Which shadow is good enough here, and what does it cost?"),
    h("button", { type: "button", class: "primary", onclick: () => run() }, "Measure every method on this view"));
  const note = h("p", { class: "note dim" });
  const tip = h("div", { class: "tip", hidden: true, role: "presentation" });
  const plot = h("div", { class: "plot" }, drawing, empty);
  element.append(plot, note);
  element.classList.add("chart-body");
  document.body.append(tip);

  // ---- measuring ----

  const run = api.guard(async () => {
    if (!api.record || stop) return;
    stop = new AbortController();
    const { signal } = stop, info = api.technique(store.get("technique"));
    const request = compareRequest(api.record, store.state), { params, technique } = store.state;
    const all = api.techniques.filter(({ name }) => name !== "auto" && name !== "raytraced");
    total = all.length + 1;
    // One with settings of its own is a point of its own.
    if (Object.keys(params).length && technique !== "auto" && info) {
      request.techniques = [...all.map(({ name }) => name), { name: technique, params }];
      total++;
    }
    for (const url of thumbs.values()) URL.revokeObjectURL(url);
    [rows, reference, thumbs, hovered] = [[], null, new Map(), null];
    measuredView = viewOf(store.state);
    size = [request.width, request.height];
    show();
    try {
      for await (const { event, data } of api.daemon.measure(store.get("scene"), request, { signal })) {
        if (event === "reference") reference = data;
        if (event === "method") rows.push(data);
        if (event === "done") ({ reference, methods: rows } = data);
        show();
      }
      announce("Measured " + rows.length + " methods. The front: " +
        frontOf(points).map(point => point.name).join(", "));
    } catch (reason) {
      if (!signal.aborted) throw reason;
    } finally {
      stop = null;
      show();
    }
  }, "The comparison");

  const isStale = () => measuredView !== null && measuredView !== viewOf(store.state);

  // ---- drawing ----

  function show() {
    const { error } = store.state;
    measure.value = error;
    points = rows.filter(row => !row.error && row.total_ms > 0 && row[error] > 0).map(row => ({
      x: row.total_ms, y: row[error], row, name: shortName(row.technique, api.technique(row.technique.name)) }));
    const stale = isStale();
    element.classList.toggle("stale", stale && !stop);
    empty.hidden = Boolean(stop) || rows.length > 0;
    button.hidden = !empty.hidden;
    button.textContent = stop ? "Stop" : "Measure again";
    button.classList.toggle("primary", stale && !stop);
    const done = rows.length + (reference ? 1 : 0);
    const failed = rows.filter(row => row.error);
    note.textContent = stop ? done + " of " + total + (reference ? "" : ": tracing the reference") :
      rows.length ? [stale ? "Of another view: measure again." : null,
        size.join(" × ") + " px against " + reference?.technique.name + " of " +
          (reference?.technique.params.samples ?? "") + " samples (" + time(reference?.total_ms) + ")",
        failed.length ? "failed: " + failed.map(row => row.technique.name).join(", ") : null]
        .filter(Boolean).join(" · ") : "";
    element.style.setProperty("--done", stop ? done / total : 0);
    draw();
  }

  function draw() {
    const { width, height } = box, { technique, params } = store.state;
    if (!width) return;
    const focused = drawing.contains(document.activeElement) ? document.activeElement.dataset?.name : null;
    drawing.setAttribute("viewBox", "0 0 " + width + " " + height);
    const bounds = (pick, low, high) => points.length ? [Math.min(...points.map(pick)) / 1.25,
      Math.max(...points.map(pick)) * 1.25] : [low, high];
    const [x0, x1] = bounds(p => p.x, 10, 1000), [y0, y1] = bounds(p => p.y, 0.01, 1);
    const x = logScale(x0, x1, MARGIN.left, width - MARGIN.right);
    const y = logScale(y0, y1, height - MARGIN.bottom, MARGIN.top);
    const axes = svg("g", { class: "axes", "aria-hidden": "true" },
      logTicks(x0, x1).map((tick, i, ticks) => [svg("line", { x1: x(tick), x2: x(tick), y1: MARGIN.top, y2: height - MARGIN.bottom }),
        svg("text", { x: x(tick), y: height - MARGIN.bottom + 14, "text-anchor": "middle" },
          short(tick) + (i === ticks.length - 1 ? " ms" : ""))]),
      logTicks(y0, y1).map(tick => [svg("line", { x1: MARGIN.left, x2: width - MARGIN.right, y1: y(tick), y2: y(tick) }),
        svg("text", { x: MARGIN.left - 6, y: y(tick) + 4, "text-anchor": "end" }, short(tick).replace(/^0\./, "."))]));
    const front = frontOf(points);
    const line = svg("polyline", { class: "front", fill: "none",
      points: front.map(p => x(p.x) + "," + y(p.y)).join(" ") });
    const today = shortName({ name: technique, params }, api.technique(technique));
    const placed = [];
    const marks = points.map(point => {
      [point.left, point.top, point.isFront, point.isToday] = [x(point.x), y(point.y), front.includes(point),
        point.name === today];
      return point;
    });
    drawing.replaceChildren(axes, line, ...marks.map(mark), ...labels(marks, width, placed));
    roving(focused);
  }

  function mark(point) {
    const { left, top, isFront, isToday } = point;
    const group = svg("g", { class: ["point", isFront && "best", isToday && "today"].filter(Boolean).join(" "),
      role: "button", tabindex: -1, "data-name": point.name, "aria-pressed": String(isToday),
      "aria-label": point.name + ": " + time(point.x) + ", error " + errorText(point.y) +
        (isFront ? ", on the front" : "") },
    isToday ? svg("circle", { cx: left, cy: top, r: 9, class: "ring" }) : null,
    svg("circle", { cx: left, cy: top, r: isFront ? 4.5 : 4, class: "dot" }));
    group.addEventListener("focus", () => hover(point));
    group.addEventListener("blur", () => hover(null));
    group.addEventListener("keydown", event => key(event, point));
    return group;
  }

  /** Names of the front, of today's method and of those for which there is room. */
  function labels(marks, width, placed) {
    const order = [...marks].sort((a, b) => b.isToday - a.isToday || b.isFront - a.isFront);
    const taken = marks.map(p => [p.left - 5, p.top - 5, p.left + 5, p.top + 5]);
    return order.flatMap(point => {
      const long = point.name.length * 6.6, places = [[9, 4, "start"], [-9, 4, "end"], [0, -9, "middle"], [0, 18, "middle"]];
      for (const [dx, dy, anchor] of places) {
        const from = point.left + dx - (anchor === "end" ? long : anchor === "middle" ? long / 2 : 0);
        const area = [from, point.top + dy - 10, from + long, point.top + dy + 3];
        if (area[0] < MARGIN.left || area[2] > width || area[1] < 0 || area[3] > box.height - MARGIN.bottom) continue;
        const hits = other => area[0] < other[2] && area[2] > other[0] && area[1] < other[3] && area[3] > other[1];
        const own = taken[marks.indexOf(point)];
        if ([...placed, ...taken.filter(other => other !== own)].some(hits)) continue;
        placed.push(area);
        return svg("text", { x: point.left + dx, y: point.top + dy, "text-anchor": anchor, "aria-hidden": "true",
          class: "name" + (point.isToday ? " today" : point.isFront ? " best" : "") }, point.name);
      }
      return [];
    });
  }

  // ---- hand and keyboard ----

  const nearest = event => {
    const frame = drawing.getBoundingClientRect();
    let best = null, least = REACH;
    for (const point of points) {
      const away = Math.hypot(event.clientX - frame.left - point.left, event.clientY - frame.top - point.top);
      if (away < least) [best, least] = [point, away];
    }
    return best;
  };
  drawing.addEventListener("pointermove", event => {
    const point = nearest(event);
    drawing.style.cursor = point ? "pointer" : "";
    hover(point);
  });
  drawing.addEventListener("pointerleave", () => hover(null));
  drawing.addEventListener("click", event => {
    const point = nearest(event);
    if (point) take(point);
  });

  function take({ row }) {
    const info = api.technique(row.technique.name);
    const params = Object.fromEntries(Object.entries(row.technique.params).filter(([key, value]) => JSON.stringify(value) !==
      JSON.stringify(info?.params.find(param => param.name === key)?.default)));
    store.set({ technique: row.technique.name, params }, { push: true });
  }

  /** One of the points can be reached with Tab, the others from it with arrows. */
  function roving(name) {
    const groups = [...drawing.querySelectorAll(".point")];
    const chosen = groups.find(group => group.dataset.name === name) ??
      groups.find(group => group.classList.contains("today")) ?? groups[0];
    chosen?.setAttribute("tabindex", 0);
    if (name && chosen?.dataset.name === name) chosen.focus();
  }

  function key(event, point) {
    const step = { ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1 }[event.key];
    if (event.key === "Enter" || event.key === " ") take(point);
    else if (step) {
      const sorted = [...points].sort((a, b) => a.x - b.x);
      const next = sorted[(sorted.indexOf(point) + step + sorted.length) % sorted.length];
      for (const group of drawing.querySelectorAll(".point")) {
        group.setAttribute("tabindex", group.dataset.name === next.name ? 0 : -1);
        if (group.dataset.name === next.name) group.focus();
      }
    } else return;
    event.preventDefault();
    event.stopPropagation();
  }

  async function thumbOf(row) {
    const { image } = row.links;
    if (!image) return null;
    if (!thumbs.has(image)) {
      const kept = thumbs;
      const answer = await api.daemon.call(image);
      kept.set(image, URL.createObjectURL(await answer.blob()));
    }
    return thumbs.get(image) ?? null;
  }

  function hover(point) {
    if (point === hovered) return;
    hovered = point;
    tip.hidden = !point;
    for (const group of drawing.querySelectorAll(".point"))
      group.classList.toggle("hover", group.dataset.name === point?.name);
    if (!point) return;
    const { row } = point;
    const picture = h("img", { alt: "", width: 200, height: Math.round(200 * size[1] / size[0]) });
    tip.replaceChildren(picture, h("b", {}, api.technique(row.technique.name)?.title ?? point.name),
      h("dl", {}, ...[["time", time(row.total_ms)], ["its shadow", time(row.shadow_ms)],
        ["RMSE, penumbra", errorText(row.rmse_penumbra)], ["RMSE", errorText(row.rmse)],
        ["SSIM", row.ssim.toFixed(4)], ["FLIP", errorText(row.flip)]]
        .map(([name, value]) => [h("dt", {}, name), h("dd", {}, value)])));
    thumbOf(row).then(url => { if (url) picture.src = url; }, () => picture.remove());
    const frame = drawing.getBoundingClientRect(), { offsetWidth: wide, offsetHeight: high } = tip;
    // Over the picture: the other points stay in sight.
    tip.style.left = Math.max(8, Math.min(frame.left + point.left - wide / 2, innerWidth - wide - 8)) + "px";
    tip.style.top = Math.max(8, frame.top - high - 8) + "px";
  }

  whenSized(plot, (width, height) => { box = { width, height }; draw(); });
  store.on([...VIEW_KEYS, "width", "height"], () => {
    if (stop && isStale()) stop.abort(); // the figures would be of what is gone
    show();
  });
  store.on(["technique", "params", "error"], show);
  api.on("techniques", show);
}
