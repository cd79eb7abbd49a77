// A sequence from the view that is shown: around its target, along the file's animation, or through
// views that are added one by one while the camera and the lights are moved.
import { Orbit } from "../../penumbra-view.js";
import { h } from "../dom.js";
import { choiceField, numberField, toolButton } from "../fields.js";
import { brief, shownRequest } from "../request.js";

const KINDS = { turntable: "Turntable", animation: "Animation", keyframes: "Keyframes" };
const FORMATS = ["png", "jpeg", "webp", "exr", "tiff"];
const VIEW_BYTES = 160; // at most, of a view in a request
export const FPS = 24;

/** Cameras around a target, in even steps from where one stands. */
export function around(camera, frames, turns) {
  return Array.from({ length: frames }, (_, i) => {
    const orbit = Orbit.from(camera);
    orbit.azimuth_deg += 360 * turns * i / frames;
    return brief(orbit.camera);
  });
}

/** The form; `start(request, title, fps)` is called with what it says. */
export function composer(store, api, start) {
  const wish = { frames: 36, turns: 1, fps: FPS, seconds: 2, format: "png", archive: "zip", width: null,
    height: null };
  let kind = "turntable", keys = [];
  const form = h("form", { class: "composer", hidden: true, "aria-label": "New sequence",
    onsubmit: event => { event.preventDefault(); submit(); } });
  const tabs = h("div", { class: "kinds", role: "group", "aria-label": "Kind" },
    Object.entries(KINDS).map(([value, text]) => h("button", { type: "button", value,
      onclick: () => { kind = value; build(); } }, text)));
  const fields = h("div", { class: "fields" }), strip = h("div", { class: "keyframes" });
  const sum = h("p", { class: "hint" });
  const go = h("button", { class: "primary" }, "Start");
  form.append(h("header", {}, h("h2", {}, "New sequence"), toolButton("Close", "M4 4l8 8M12 4l-8 8",
    () => show(false))), tabs, fields, strip, sum, go);
  form.addEventListener("keydown", event => event.key === "Escape" && show(false));

  const animation = () => {
    const all = api.scene?.animations ?? [], word = store.get("animation");
    return all.find(({ name, index }) => name === word || String(index) === word) ?? all[0];
  };
  const take = key => value => { wish[key] = value; tell(); };
  const number = (key, label, rest) => numberField({ label, value: wish[key], take: take(key), ...rest });

  function build() {
    for (const tab of tabs.children) tab.setAttribute("aria-pressed", String(tab.value === kind));
    // Around a target, each view is a camera of its own in the request.
    const { sequence_frames = 10000, json_bytes = 2 ** 18 } = api.service?.limits ?? {};
    const most = Math.min(sequence_frames, Math.floor(json_bytes / VIEW_BYTES));
    const rows = {
      turntable: () => [number("frames", "frames", { min: 1, max: most, whole: true, start: 36 }),
        number("turns", "turns", { min: -100, max: 100, start: 1 })],
      animation: () => [number("fps", "rate", { unit: "frames/s", min: 0.01, max: 1000, start: FPS })],
      keyframes: () => [number("fps", "rate", { unit: "frames/s", min: 0.01, max: 1000, start: FPS }),
        number("seconds", "between views", { unit: "s", min: 0.05, max: 600, start: 2 })],
    }[kind]();
    const side = { min: 1, max: 8192, whole: true, unit: "px", start: null, empty: "as shown" };
    fields.replaceChildren(...rows, number("width", "width", side), number("height", "height", side),
      choiceField({ label: "format", choices: FORMATS, value: wish.format, start: "png",
        take: value => { wish.format = value; if (value !== "webp") wish.archive = "zip"; build(); } }),
      choiceField({ label: "together as", value: wish.archive, start: "zip", choices: [["zip", "zip"],
        ...(wish.format === "webp" ? [["webp", "moving picture"]] : [])], take: take("archive") }));
    strip.hidden = kind !== "keyframes";
    strip.replaceChildren(...keys.map((key, i) => h("button", { type: "button", class: "chip",
      "aria-label": "View " + (i + 1) + ": show it", onclick: () => store.set({ camera: key.camera,
        lights: key.lights }, { push: true }) }, "view " + (i + 1))),
    h("button", { type: "button", onclick: add }, "Add this view"),
    keys.length > 0 && h("button", { type: "button", onclick: () => { keys = []; build(); } }, "Clear"));
    tell();
  }

  function add() {
    const request = shownRequest(store, api);
    if (request) keys.push({ camera: request.camera, lights: request.lights });
    build();
  }

  /** How many frames, or why there can be none. */
  function count() {
    if (kind === "turntable") return [wish.frames];
    if (kind === "animation") {
      if (!animation()) return [0, "This scene has no animation."];
      return [Math.max(1, Math.round(animation().duration_s * wish.fps))];
    }
    if (keys.length < 2) return [0, "Add two views or more; move the camera in between."];
    const types = key => key.lights.map(({ type }) => type).join();
    if (keys.some(key => types(key) !== types(keys[0]))) return [0, "The lights are others in some views."];
    return [step() * (keys.length - 1) + 1];
  }
  const step = () => Math.max(1, Math.round(wish.seconds * wish.fps));

  function tell() {
    const [frames, why] = count();
    go.disabled = !frames || !api.record;
    sum.textContent = why ?? frames + (frames === 1 ? " frame" : " frames") + (kind === "turntable" ? "" :
      ", " + (frames / wish.fps).toFixed(1) + " s");
  }

  function submit() {
    const request = shownRequest(store, api), [frames] = count();
    if (!request || !frames) return;
    const { camera, output, ...rest } = request, sequence = { archive: wish.archive, fps: wish.fps };
    if (kind === "turntable") sequence.views = around(api.view.currentCamera, frames, wish.turns);
    if (kind === "animation") Object.assign(rest, { camera, animation: animation().name || animation().index, time_s: 0 });
    if (kind === "animation") sequence.frames = frames;
    if (kind === "keyframes") {
      delete rest.lights;
      sequence.keyframes = keys.map((key, i) => ({ frame: i * step(), ...key }));
      sequence.interpolation = "cubic";
    }
    start({ ...rest, width: wish.width ?? rest.width, height: wish.height ?? rest.height, sequence,
      output: { ...output, format: wish.format } }, KINDS[kind], kind === "turntable" ? FPS : wish.fps);
    show(false);
  }

  function show(on = form.hidden) {
    form.hidden = !on;
    if (on) {
      build();
      tabs.querySelector("[aria-pressed=true]").focus();
    }
  }
  api.on("picture", () => form.hidden || tell());
  api.on("scene", () => { keys = []; if (!form.hidden) build(); });
  return { form, show };
}
