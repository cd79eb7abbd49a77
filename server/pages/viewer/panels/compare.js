// Two methods on one view: wiped, blinked, or as a map of what differs, with its scale.
import "../../penumbra-view.js";
import { announce, h } from "../dom.js";
import { error as errorText } from "../format.js";
import { bindKey } from "../keys.js";
import { compareRequest } from "../measure.js";

const MAPS = {
  difference: { name: "Difference", link: "difference",
    legend: ["linear-gradient(to right, #00f, #fff, #f00)", "≤ −.25 too dark", "0 equal", "≥ +.25 too light"] },
  ssim: { name: "SSIM", link: "ssim_map", legend: ["linear-gradient(to right, #000, #fff)", "0 unlike", "", "1 alike"] },
  flip: { name: "FLIP", link: "flip_map",
    legend: ["linear-gradient(to right, #000, #f00, #ff0, #fff)", "0 equal", "", "1 far"] },
};
const PIXELS = 4 << 20; // the most that a comparison takes

export function mount(element, store, api) {
  const stage = api.overlay.parentElement, a = api.view;
  const pick = h("select", { "aria-label": "Compare with", class: "small", onchange: () =>
    store.set({ b: pick.value || null }, { push: true }) });
  const kinds = h("div", { class: "segments", role: "group", "aria-label": "How to compare" },
    [["wipe", "Wipe"], ...Object.entries(MAPS).map(([key, { name }]) => [key, name])].map(([value, name]) =>
      h("button", { type: "button", value, onclick: () => store.set({ map: value }) }, name)));
  const hint = h("span", { class: "dim" }, "hold ", h("kbd", {}, "b"), " to blink");
  const figures = h("span", { class: "dim" });
  element.append(h("label", {}, h("span", { class: "caption" }, "Compare with"), pick), kinds, hint);

  const b = h("penumbra-view", { class: "b", "aria-hidden": "true" });
  const map = h("img", { class: "map", alt: "", hidden: true });
  const handle = h("div", { class: "wipe", role: "slider", tabIndex: 0, "aria-label": "Wipe between the two methods",
    "aria-valuemin": 0, "aria-valuemax": 100 }, h("i"));
  const names = [h("span", { class: "name-a" }), h("span", { class: "name-b" })];
  const legend = h("div", { class: "legend-box", hidden: true });
  const layer = h("div", { class: "comparison" }, b, map, ...names, handle, legend);
  let at = 0.5, mapOf = "", stop = null, url = "";

  function wipe(to) {
    at = Math.min(Math.max(to, 0), 1);
    layer.style.setProperty("--wipe", at * 100 + "%");
    handle.setAttribute("aria-valuenow", Math.round(at * 100));
    handle.setAttribute("aria-valuetext", Math.round(at * 100) + " % " + names[0].textContent);
  }
  wipe(0.5);
  handle.addEventListener("pointerdown", event => {
    handle.setPointerCapture(event.pointerId);
    event.preventDefault();
    handle.focus();
  });
  handle.addEventListener("pointermove", event => {
    if (!handle.hasPointerCapture(event.pointerId)) return;
    const frame = layer.getBoundingClientRect();
    wipe((event.clientX - frame.left) / frame.width);
  });
  handle.addEventListener("dblclick", () => wipe(0.5));
  handle.addEventListener("keydown", event => {
    const to = { ArrowLeft: at - 0.02, ArrowRight: at + 0.02, PageUp: at + 0.1, PageDown: at - 0.1, Home: 0, End: 1 }[event.key];
    if (to === undefined) return;
    event.preventDefault();
    wipe(to);
  });

  /** The other picture: of the same camera, lights and exposure as the one that is shown. */
  function follow() {
    const { b: other, map: kind } = store.state, { record } = api;
    if (!other || !record) return;
    if (kind !== "wipe") return measureMap();
    const { camera, lights, output, width, height, technique, ...rest } = record.request;
    void technique;
    const request = Object.fromEntries(["ground", "sky", "sky_level", "sky_intensity", "exposure_ev", "tone_map",
      "variant", "animation", "time_s", "antialias"].map(key => [key, rest[key]]));
    Object.assign(b, { token: api.token || null, scene: store.get("scene"), technique: other, lights, camera, width, height,
      request: { ...request, ...(output.layer === "beauty" ? {} : { output: { layer: output.layer } }) } });
  }

  const measureMap = api.guard(async () => {
    const { b: other, map: kind, scene, technique, params } = store.state;
    const shown = api.record.request, shrink = Math.min(1, Math.sqrt(PIXELS / (shown.width * shown.height)));
    const request = { ...compareRequest(api.record, { width: Math.floor(shown.width * shrink),
      height: Math.floor(shown.height * shrink) }), techniques: [{ name: technique, params }], reference: other };
    const key = JSON.stringify([request, kind]);
    if (key === mapOf) return;
    mapOf = key;
    stop?.abort();
    const { signal } = stop = new AbortController();
    layer.classList.add("waiting");
    figures.textContent = "Measuring…";
    try {
      const { methods: [row] } = await api.daemon.compare(scene, request, { signal });
      const link = row.links?.[MAPS[kind].link];
      const answer = await api.daemon.call(link, { signal });
      URL.revokeObjectURL(url);
      map.src = url = URL.createObjectURL(await answer.blob());
      map.hidden = false;
      figures.textContent = "RMSE " + errorText(row.rmse) + " · SSIM " + row.ssim.toFixed(4) + " · FLIP " + errorText(row.flip);
      announce(technique + " beside " + other + ": " + figures.textContent);
      layer.classList.remove("waiting");
    } catch (reason) {
      mapOf = "";
      if (!signal.aborted) throw reason;
    }
  }, "The comparison");

  function show({ b: other, map: kind, technique }, changed) {
    const on = Boolean(other);
    pick.value = other ?? "";
    if (on && !layer.isConnected) stage.insertBefore(layer, api.overlay);
    if (!on) layer.remove();
    kinds.hidden = !on;
    hint.hidden = !on || kind !== "wipe";
    for (const button of kinds.children) button.setAttribute("aria-pressed", String(button.value === kind));
    const wiped = kind === "wipe";
    b.hidden = handle.hidden = !wiped;
    if (wiped) map.hidden = true;
    legend.hidden = wiped;
    names[0].textContent = technique;
    names[1].textContent = other ?? "";
    for (const name of names) name.hidden = !wiped;
    if (!wiped) {
      const { name, legend: [colours, ...marks] } = MAPS[kind];
      legend.replaceChildren(h("b", {}, name), h("i", { style: { background: colours } }),
        h("div", {}, marks.map(mark => h("span", {}, mark))), figures);
    }
    if (!on) {
      mapOf = "";
      map.hidden = true;
      stop?.abort();
    } else if (changed.has("b") || changed.has("map")) follow();
  }

  api.on("techniques", techniques => {
    pick.replaceChildren(new Option("nothing", ""), ...techniques.filter(({ name }) => name !== "auto")
      .map(({ name, title }) => new Option(name === "raytraced" ? title + " (the truth)" : title, name)));
    show(store.state, new Set());
  });
  store.on(["b", "map", "technique"], show);
  api.on("picture", ({ done }) => done && follow());
  a.addEventListener("camerachange", ({ detail }) => detail.user && layer.classList.add("waiting"));
  b.addEventListener("load", () => layer.classList.remove("waiting"));

  const blink = on => layer.classList.toggle("blink", on);
  bindKey("c", "Compare with the truth, or stop", () => store.set({ b: store.get("b") ? null : "raytraced" }, { push: true }));
  bindKey("b", "Hold: the other picture of a comparison", () => store.get("b") ? blink(true) : false);
  addEventListener("keyup", event => event.key === "b" && blink(false));
  addEventListener("blur", () => blink(false));
}
