// The lights: placed on the picture, with their numbers here.
import { h } from "../dom.js";
import { choiceField, colorField, numberField, sliderField, textField, toolButton } from "../fields.js";
import { addGizmos } from "./gizmos.js";
import { bindKey } from "../keys.js";
import { Rig, SIZES, fromHex, retyped, strength, toHex } from "./rig.js";

const TYPES = Object.keys(SIZES);
const UPLOAD = "upload";

export function mount(element, store, api) {
  const rig = new Rig(store, api), gizmos = addGizmos(rig, api);
  const list = h("div", { class: "chips", role: "group", "aria-label": "Which light" });
  const box = h("div", { class: "fields" });
  const file = h("input", { type: "file", hidden: true,
    accept: "image/png,image/jpeg,image/webp" });
  const seen = toolButton("Handles on the picture (g)", "M8 1v3M8 12v3M1 8h3M12 8h3M8 5a3 3 0 1 1 0 6 3 3 0 0 1 0-6",
    () => toggle(), { "aria-pressed": "true" });
  const reset = toolButton("Back to the scene's own lights", "M3 8a5 5 0 1 0 1.6-3.7M3 2v3h3", () => rig.reset());
  const plus = toolButton("Add a light", "M8 3v10M3 8h10", () => rig.add());
  element.tools.append(reset, seen, plus);
  element.append(list, box, file);
  let fields = {}, built = "", images = [], patterns = [];

  function toggle() {
    gizmos.show(!gizmos.shown);
    seen.setAttribute("aria-pressed", String(gizmos.shown));
  }

  function show() {
    const { lights, selected, light } = rig;
    reset.hidden = !rig.touched;
    plus.disabled = lights.length >= (api.service?.limits.lights ?? 8);
    while (list.children.length > lights.length) list.lastChild.remove();
    lights.forEach(({ type, color = [1, 1, 1] }, i) => {
      const chip = list.children[i] ?? list.appendChild(h("button", { type: "button", class: "chip",
        onclick: () => rig.select(i) }, h("i", {}), h("span", {})));
      chip.firstChild.style.background = toHex(color);
      chip.lastChild.textContent = type;
      chip.setAttribute("aria-label", "Light " + (i + 1) + ", " + type);
      chip.setAttribute("aria-pressed", String(i === selected));
    });
    const base = rig.base();
    const wanted = light ? [selected, light.type, strength(light)[0], JSON.stringify(base),
      images.length, patterns.length].join(" ") : "none " + rig.known;
    if (wanted !== built) build(light, base);
    built = wanted;
    if (!light) return;
    const [power] = strength(light);
    for (const [key, field] of Object.entries(fields))
      field.show(key === "stops" ? stops(light[power], base?.[power]) : key === "emission" ?
        emission(light) : key === "color" ? toHex(light.color ?? [1, 1, 1]) : light[key] ?? 0);
  }

  const stops = (value, base) => base > 0 && value > 0 ?
    Math.min(Math.max(Math.round(10 * Math.log2(value / base)) / 10, -6), 6) : 0;
  const emission = ({ texture }) => texture?.pattern ?? texture?.image ?? "";

  function build(light, base) {
    fields = {};
    if (!light) {
      box.replaceChildren(h("p", { class: "hint" }, rig.known ? "No light: only the sky." : "They come with a scene."));
      return;
    }
    const change = key => value => rig.change({ [key]: value });
    const [power, unit] = strength(light), own = base && power in base ? base[power] : undefined;
    fields.type = choiceField({ label: "type", choices: TYPES, value: light.type, start: base && TYPES[0],
      take: type => rig.replace(retyped(rig.light, type)) });
    if (own > 0)
      fields.stops = sliderField({ label: "intensity", unit: "EV", min: -6, max: 6, step: 0.1, value: 0,
        start: 0, say: value => (value > 0 ? "+" : "") + value.toFixed(1),
        help: "Stops beside what suits the scene.",
        take: value => rig.change({ [power]: Number((own * 2 ** value).toPrecision(5)) }) });
    fields[power] = numberField({ label: power.replace("_w", ""), unit, min: 0, value: light[power],
      start: own, take: change(power) });
    fields.color = colorField({ label: "colour", value: toHex(light.color ?? [1, 1, 1]),
      start: base && toHex(base.color ?? [1, 1, 1]), take: hex => rig.change({ color: fromHex(hex) }) });
    for (const [key, unit, min = 1e-9, max = 1e9] of SIZES[light.type])
      fields[key] = numberField({ label: key.replace("_deg", "").replaceAll("_", " "), unit, min, max,
        value: light[key], start: base?.[key], take: change(key) });
    for (const key of ["position", "target"])
      fields[key] = textField({ label: key, unit: "m", components: 3, value: light[key],
        start: base?.[key], take: change(key) });
    if (light.type === "rect")
      fields.emission = choiceField({ label: "emission", value: emission(light), start: "",
        help: "What it shines like over its area; black cuts shapes.",
        choices: [["", "even"], ...patterns, ...images.map(({ id, name }) => [id, name]),
          [UPLOAD, "From a file …"]], take: takeEmission });
    box.replaceChildren(...Object.values(fields), h("button", { type: "button", class: "wide",
      onclick: () => rig.remove() }, "Remove this light"));
  }

  function takeEmission(value) {
    if (value === UPLOAD) {
      fields.emission.show(emission(rig.light));
      file.click();
      return;
    }
    const { texture, ...rest } = rig.light;
    rig.replace(!value ? rest : { ...rest,
      texture: patterns.includes(value) ? { pattern: value } : { image: value } });
  }

  file.addEventListener("change", api.guard(async () => {
    const [chosen] = file.files;
    file.value = "";
    if (!chosen) return;
    const { id } = await api.daemon.uploadImage(chosen);
    images = [{ id, name: chosen.name }, ...images.filter(image => image.id !== id)];
    takeEmission(id);
  }, "The emission image"));

  const know = api.guard(async () => { // not needed for the first picture
    const [schemas, stored] = await Promise.all([api.schemas(), api.daemon.json("v1/images?limit=100")]);
    patterns = schemas.LightPattern.enum;
    images = [...images, ...stored.images.map(({ id, width, height }) =>
      ({ id, name: id.slice(0, 6) + ", " + width + " × " + height }))];
    show();
  });
  api.addEventListener("picture", know, { once: true });
  rig.addEventListener("change", show);
  show();

  bindKey("l", "The next light; arrow keys move it, with Shift along its axis", () => {
    if (!rig.lights.length) return false;
    if (!gizmos.shown) toggle();
    rig.next();
    gizmos.focus();
  });
  bindKey("g", "Handles of the lights, shown or not", toggle);
}
