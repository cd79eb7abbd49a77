// What the picture shows, how large, and as which file.
import { h } from "../dom.js";
import { choiceField, numberField } from "../fields.js";
import { download } from "../request.js";

export function mount(element, store, api) {
  const set = key => value => store.set({ [key]: value });
  const size = { min: 1, max: 8192, whole: true, empty: "as shown", unit: "px", start: null };
  const fields = {
    layer: choiceField({ label: "layer", choices: ["beauty"], value: "beauty", start: "beauty",
      take: set("layer") }),
    width: numberField({ ...size, label: "width", take: set("width") }),
    height: numberField({ ...size, label: "height", take: set("height") }),
    antialias: numberField({ label: "antialias", unit: "frames", min: 1, max: 64, whole: true,
      value: 1, start: 1, take: set("antialias") }),
    format: choiceField({ label: "format", choices: ["png"],
      value: "png", start: "png", take: set("format") }),
  };
  const known = api.guard(async () => { // not needed for the first picture
    const { layer, format } = (await api.schemas()).Output.properties;
    fields.layer.offer(layer.enum.filter(name => name !== "all"));
    fields.format.offer(format.enum);
    show(store.state);
  });
  api.addEventListener("picture", known, { once: true });
  element.classList.add("fields");
  element.append(...Object.values(fields), h("button", { type: "button", class: "wide",
    onclick: api.guard(() => download(store, api)) }, "Download"));
  store.on(["layer", "width", "height", "antialias", "format"], show);

  function show(state) {
    for (const [key, field] of Object.entries(fields)) field.show(state[key]);
  }
}
