// Sky, ground, exposure, the file's cameras and variants.
import { choiceField, sliderField, switchField } from "../fields.js";

export function mount(element, store, api) {
  const set = key => value => store.set({ [key]: value });
  const fields = {
    camera: choiceField({ label: "camera", choices: [["", "framed"]], value: "", start: "",
      take: value => store.set({ camera: value === "" ? null : { index: Number(value) } }, { push: true }) }),
    variant: choiceField({ label: "variant", choices: [["", "as the file has it"]], value: "",
      start: "", take: set("variant") }),
    exposure: sliderField({ label: "exposure", unit: "EV", min: -4, max: 4, step: 0.1, value: 0,
      start: 0, say: value => (value > 0 ? "+" : "") + value.toFixed(1),
      help: "Stops beside what the daemon chose for the scene.", take: set("exposure") }),
    tone_map: choiceField({ label: "tone map", choices: ["none", "reinhard", "aces"], value: "none",
      start: "none", take: set("tone_map") }),
    sky: switchField({ label: "sky", value: true, start: true, take: set("sky") }),
    sky_intensity: sliderField({ label: "sky intensity", unit: "×", min: 0, max: 4, step: 0.05,
      value: 1, start: 1, say: value => value.toFixed(2), take: set("sky_intensity") }),
    ground: choiceField({ label: "ground", choices: [["true", "seen"], ["shadow", "only its shadow"],
      ["false", "none"]], value: "true", start: "true",
    take: value => store.set({ ground: value === "shadow" ? value : value === "true" }) }),
  };
  element.classList.add("fields");
  element.append(...Object.values(fields));

  function fill(scene) {
    fields.camera.hidden = !scene?.cameras.length;
    fields.variant.hidden = !scene?.variants.length;
    fields.camera.offer([["", "framed"], ["moved", "as moved"],
      ...(scene?.cameras ?? []).map(camera => [camera.index, camera.name || "camera " + camera.index])]);
    fields.camera.querySelector("option[value=moved]").hidden = true;
    fields.variant.offer([["", "as the file has it"],
      ...(scene?.variants ?? []).map(variant => [variant.name, variant.name])]);
    show(store.state);
  }
  function show(state) {
    for (const key of ["variant", "exposure", "tone_map", "sky", "sky_intensity"])
      fields[key].show(state[key]);
    fields.ground.show(String(state.ground));
    fields.camera.show(!state.camera ? "" : String(state.camera.index ?? "moved"));
  }
  api.on("scene", fill);
  fill(null);
  store.on(["camera", "variant", "exposure", "tone_map", "sky", "sky_intensity", "ground"], show);
}
