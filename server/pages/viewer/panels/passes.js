// Where the time of a picture goes: its passes as one stacked bar, and the last 60 pictures.
import { roundUp, whenSized } from "../charts.js";
import { h, svg } from "../dom.js";
import { time } from "../format.js";

const STAGES = ["gbuffer", "shadow", "technique", "shade", "readback", "encode"];
const NAMES = { gbuffer: "what is seen", shadow: "shadow inputs", technique: "method", shade: "shading",
  readback: "read back", encode: "encoding" };
const KEPT = 60;

export function mount(element, store, api) {
  const total = h("span", { class: "dim" });
  element.tools.append(total);
  const bar = h("div", { class: "stack", role: "img", "aria-label": "No picture yet" });
  const list = h("ul", { class: "passes", tabIndex: 0, "aria-label": "Passes of this picture" });
  const drawing = svg("svg", { class: "history", role: "img" });
  const plot = h("div", { class: "plot" }, drawing);
  element.classList.add("passes-body");
  element.append(bar, h("div", { class: "split" }, list, h("div", { class: "past" },
    h("p", { class: "caption" }, "the last 60 pictures, ms"), plot,
    h("ul", { class: "legend" }, STAGES.map((stage, i) => h("li", { dataset: { stage: i } }, h("i"), NAMES[stage]))))));
  const kept = [];
  let box = { width: 0, height: 0 };

  const stageOf = pass => Math.max(0, STAGES.indexOf(pass.stage));

  function showPasses(passes, stages) {
    const parts = passes.map(pass => ({ name: pass.name, ms: pass.ms ?? 0, stage: stageOf(pass), count: pass.count }));
    for (const name of ["readback", "encode"]) // no passes of the renderer
      if (stages?.[name] > 0 && !parts.some(part => part.stage === STAGES.indexOf(name)))
        parts.push({ name: NAMES[name], ms: stages[name], stage: STAGES.indexOf(name), count: 1 });
    const sum = parts.reduce((all, part) => all + part.ms, 0) || 1;
    bar.setAttribute("aria-label", parts.map(part => part.name + " " + time(part.ms)).join(", "));
    bar.replaceChildren(...parts.filter(part => part.ms / sum > 0.002).map(part => h("i", { dataset: { stage: part.stage },
      style: { flexGrow: part.ms / sum }, title: part.name + ": " + time(part.ms) + ", " + NAMES[STAGES[part.stage]] })));
    list.replaceChildren(...[...parts].sort((a, b) => b.ms - a.ms).map(part => h("li", { dataset: { stage: part.stage } },
      h("i"), h("span", {}, part.name + (part.count > 1 ? " × " + part.count : "")), h("b", {}, time(part.ms)))));
    total.textContent = time(sum);
  }

  function note(stages) {
    kept.push(STAGES.map(stage => stages[stage] ?? 0));
    if (kept.length > KEPT) kept.shift();
    draw();
  }

  function draw() {
    const { width, height } = box;
    if (!width) return;
    const sums = kept.map(stages => stages.reduce((all, ms) => all + ms, 0));
    const most = roundUp(Math.max(...sums, 1)), left = 34, top = 8, floor = height - 4;
    const y = ms => floor - (floor - top) * ms / most, step = (width - left) / KEPT;
    drawing.setAttribute("viewBox", "0 0 " + width + " " + height);
    drawing.setAttribute("aria-label", "Times of the last " + kept.length + " pictures, the last one " +
      time(sums.at(-1) ?? 0));
    drawing.replaceChildren(svg("g", { class: "axes" }, [0, most / 2, most].map(ms => [
      svg("line", { x1: left, x2: width, y1: y(ms), y2: y(ms) }),
      svg("text", { x: left - 6, y: y(ms) + 4, "text-anchor": "end" }, ms >= 1000 ? ms / 1000 + " s" : ms)])),
    ...kept.map((stages, i) => {
      let from = 0;
      const x = left + (KEPT - kept.length + i) * step;
      return svg("g", {}, svg("title", {}, time(sums[i])), stages.map((ms, stage) => {
        const part = svg("rect", { x: x + 0.5, width: Math.max(1, step - 1), y: y(from + ms), "data-stage": stage,
          height: Math.max(0, y(from) - y(from + ms)) });
        from += ms;
        return part;
      }));
    }));
  }

  whenSized(plot, (width, height) => { box = { width, height }; draw(); });
  const listen = () => api.view.addEventListener("timing", ({ detail }) => {
    if (detail.passes) showPasses(detail.passes, detail.stages);
    const cached = !detail.brief && api.record.cache.result; // took no time now
    if (cached) total.textContent += ", when it was made";
    else note(detail.stages);
  });
  listen();
}
