// The picture, what is said about it, and whether the daemon is there.
import "../../penumbra-view.js";
import { announce, h, settle } from "../dom.js";
import { bytes, error, time } from "../format.js";
import { bindKey, listKey } from "../keys.js";
import { requestOf } from "../state.js";

const steps = (...colours) => "linear-gradient(to right, " + colours.map((colour, i) =>
  colour + " " + 100 * i / colours.length + "% " + 100 * (i + 1) / colours.length + "%").join(", ") + ")";
const GREY = "linear-gradient(to right, #000, #fff)";
/** What the layers that are no pictures mean: colours, and what stands at both ends and between. */
const SCALES = {
  visibility: [GREY, "0 in the umbra", "1 lit"],
  penumbra: [steps("#000", "#7f7f7f", "#fff"), "0 lit", "1 penumbra", "2 umbra"],
  classes: [steps("#000", "#7f7f7f", "#fff"), "0 proved lit", "1 undecided", "2 proved umbra"],
  error: [GREY, "0", ".05", "≥ .1 standard error"],
};

export function mount(element, store, api) {
  const view = api.view = h("penumbra-view", { id: "view", orbit: true });
  api.overlay = h("div", { class: "overlay" });
  const legend = h("div", { class: "legend-box layer-legend", hidden: true });
  const notice = h("p", { class: "notice", role: "alert", hidden: true });
  const facts = h("p", { class: "facts" });
  // The overlay is the view's neighbour: what lies in the element is described as one picture.
  element.append(h("div", { class: "pictures" }, view, api.overlay, legend), notice, facts);
  let own = null; // the camera that the view reported last

  store.on(["scene", "technique", "params", "lights", "held", "ground", "sky", "sky_intensity", "exposure",
    "tone_map", "variant", "animation", "time_s", "layer", "width", "height", "antialias"], show);
  store.on(["camera"], ({ camera }) => {
    if (JSON.stringify(camera) === JSON.stringify(own)) return;
    own = camera;
    view.camera = camera;
  });
  store.on(["layer"], ({ layer }) => {
    const scale = SCALES[layer];
    legend.hidden = !scale;
    if (scale) legend.replaceChildren(h("b", {}, layer), h("i", { style: { background: scale[0] } }),
      h("div", {}, scale.slice(1).map(mark => h("span", {}, mark))));
  });
  api.on("token", token => { view.token = token || null; });

  function show(state, changed) {
    view.scene = state.scene;
    view.technique = state.technique;
    if (changed.has("params") || changed.has("technique"))
      view.params = Object.keys(state.params).length ? state.params : null;
    if (changed.has("lights")) view.lights = state.lights;
    view.width = state.width;
    view.height = state.height;
    view.request = { ...requestOf(state, api.first?.exposure_ev),
      ...(state.layer === "beauty" ? {} : { output: { layer: state.layer } }) };
    view.alt = "The scene with shadows by " + (api.technique(state.technique)?.title ?? state.technique);
  }

  const keep = settle(camera => {
    own = { eye: camera.eye.map(round), target: camera.target.map(round), fov_y_deg: camera.fov_y_deg };
    store.set({ camera: own });
  }, 150);
  view.addEventListener("camerachange", ({ detail }) => detail.user && keep(detail.camera));

  view.addEventListener("load", ({ detail }) => {
    const first = !api.first;
    api.show(detail);
    if (first && store.get("exposure")) show(store.state, new Set());
    describe(detail);
    if (!detail.done) return;
    say(null);
    const { request, total_ms, stages_ms } = detail.record;
    announce(api.technique(request.technique.name)?.title + ", " + time(total_ms ?? stages_ms.total));
  });
  view.addEventListener("timing", ({ detail }) => {
    if (detail.brief) facts.textContent = time(detail.ms) + " from question to picture";
  });
  view.addEventListener("error", ({ detail }) => {
    if (detail.error.status === 401) api.tell("token", "");
    if (api.there) say(detail.error.message + (detail.again ? " Trying again." :
      api.record ? " The last good picture stays." : ""));
  });

  function describe({ record, blob, done }) {
    const { samples, of, standard_error } = record.progress;
    const parts = [
      time(record.total_ms),
      of > 1 && samples + " of " + of + " samples",
      standard_error !== null && "± " + error(standard_error),
      record.image.width + " × " + record.image.height,
      done && bytes(blob.size),
      record.cache.result && "from the cache"];
    facts.replaceChildren(h("b", {}, api.technique(record.request.technique.name)?.title ??
      record.request.technique.name), ...parts.filter(Boolean).map(part => h("span", {}, part)));
  }

  function say(text) {
    notice.hidden = !text;
    notice.textContent = text ?? "";
  }
  api.on("problem", detail => say(detail && [detail.about, detail.error.message].filter(Boolean)
    .join(": ")));
  api.on("connection", ({ there, nextMs }) => say(there ? null :
    "The daemon does not answer. Trying again in " + Math.ceil(nextMs / 1000) + " s; what is shown stays."));

  bindKey("f", "Frame the scene", () => {
    store.set({ camera: null }, { push: true });
    own = null;
    view.camera = null;
  });
  listKey("← → ↑ ↓", "Turn (the picture has the focus); with Shift, move");
  listKey("+ -", "Nearer and farther");
  listKey("Home", "The first camera");
}

const round = value => Number(value.toPrecision(6));
