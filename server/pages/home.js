// The dashboard: one view, and the controls around it. Its state is the address.
import { Penumbra } from "./penumbra.js";
import "./penumbra-view.js";

const at = id => document.getElementById(id);
const text = (id, value) => { at(id).textContent = value; };
const view = at("view"), state = new URLSearchParams(location.hash.slice(1));
let daemon, techniques = [], record = null, blob = null;
let first = null; // the request of the scene's first picture, as the daemon completed it
let ofScene = []; // warnings

const guard = action => async (...given) => {
  text("error", "");
  try {
    await action(...given);
  } catch (problem) {
    if (problem.status === 401) at("auth").hidden = false;
    text("error", problem.message);
  }
};

function remember(changes) {
  for (const [key, value] of Object.entries(changes))
    if (value === "" || value === null) state.delete(key); else state.set(key, value);
  history.replaceState(null, "", "#" + state);
}

function field(row) {
  const label = document.createElement("label");
  label.title = row.help;
  label.append(row.name + (row.unit ? ", " + row.unit : ""));
  const input = document.createElement(row.choices ? "select" : "input");
  if (row.choices) for (const choice of row.choices) input.append(new Option(choice, choice));
  else if (row.type === "flag") input.type = "checkbox";
  else if (row.components === 1)
    Object.assign(input, { type: "number", min: row.min, max: row.max,
      step: row.type === "float" ? "any" : 1 });
  if (row.type === "flag") input.checked = row.default; else input.value = row.default ?? "";
  input.row = row;
  label.append(input);
  return label;
}

/** What a control says, as a request has it. */
function valueOf({ row, checked, value }) {
  if (row.type === "flag") return checked;
  if (row.choices || row.type === "text" || value === "") return value;
  return row.components > 1 ? value.split(",").map(Number) : Number(value);
}

function showTechnique() {
  const t = techniques.find(t => t.name === at("technique").value);
  text("summary", t.summary + " — " + t.citation);
  at("params").replaceChildren(...t.params.map(field));
  view.params = null;
  view.technique = t.name;
  view.alt = "The scene with shadows by " + t.title;
  remember({ technique: t.name });
}

function takeParams() {
  const inputs = [...at("params").querySelectorAll("input, select")];
  view.params = Object.fromEntries(inputs.filter(input => input.value !== "")
    .map(input => [input.row.name, valueOf(input)]));
}

/** Emitters of the first picture, larger or smaller, with the power they have. */
function takeLight() {
  const times = 2 ** at("size").value, step = Number(at("exposure").value);
  const resize = light => ({ ...light, ...Object.fromEntries(
    ["width", "height", "radius", "angular_diameter_deg"].filter(key => key in light)
      .map(key => [key, light[key] * times])) });
  text("times", "× " + times.toPrecision(2));
  text("ev", step.toFixed(1) + " EV");
  view.lights = first && times !== 1 ? first.lights.map(resize) : null;
  view.request = { antialias: Number(at("antialias").value) || 1,
    output: { layer: at("layer").value || "beauty" },
    ...(first && (step || times !== 1) ?
      { exposure_ev: first.exposure_ev + step, sky_level: first.sky_level } : {}) };
}

function takeImage() {
  for (const key of ["width", "height"]) view[key] = Number(at(key).value) || null;
  takeLight();
}

function showScene(id) {
  for (const button of at("scenes").querySelectorAll("button"))
    button.setAttribute("aria-pressed", String(button.value === id));
  first = null;
  ofScene = [];
  at("size").value = at("exposure").value = 0;
  takeImage();
  view.scene = id;
  remember({ scene: id });
}

async function listScenes() {
  const items = [];
  for await (const scene of daemon.scenes()) {
    const item = document.createElement("li"), button = document.createElement("button");
    const image = document.createElement("img"), name = document.createElement("span");
    Object.assign(image, { alt: "", loading: "lazy", width: 72, height: 54 });
    if (!daemon.token) // an image cannot send one
      image.src = "v1/scenes/" + scene.id +
        "/render?technique=hard&width=144&height=108&priority=batch";
    name.textContent = scene.id.slice(0, 10) + "\n" +
      scene.triangles.toLocaleString() + " triangles";
    button.value = scene.id;
    button.append(image, name);
    button.onclick = () => showScene(scene.id);
    item.append(button);
    items.push(item);
  }
  at("scenes").replaceChildren(...items);
  return items.map(item => item.firstChild.value);
}

const upload = guard(async files => {
  if (!files.length) return;
  text("facts", "Uploading and reading…");
  const scene = await daemon.upload([...files]);
  await listScenes();
  showScene(scene.id);
  ofScene = scene.warnings;
});

/** The request of the picture that is shown, without what the daemon would choose itself anyway. */
function curl() {
  const { technique, camera, lights, width, height, exposure_ev, sky_level, output } =
    record.request;
  const asked = { technique, width, height, camera, lights, exposure_ev, sky_level, output,
    ...view.request };
  return "curl -o shadow.png -H 'Content-Type: application/json'" +
    (daemon.token ? " -H 'Authorization: Bearer TOKEN'" : "") + " \\\n  '" +
    new URL("v1/scenes/" + view.scene + "/render", daemon.server) + "' \\\n  -d '" +
    JSON.stringify(asked) + "'";
}

view.addEventListener("load", ({ detail }) => {
  ({ record, blob } = detail);
  first ??= record.request;
  if (!detail.done) return;
  text("error", [...ofScene, ...detail.warnings].join("\n"));
  text("curl", curl());
});

view.addEventListener("timing", ({ detail }) => {
  const { ms, stages, brief } = detail;
  text("facts", ms.toFixed(0) + " ms in the browser" + (brief ? "" :
    ", " + (blob.size / 1024).toFixed(0) + " KiB, " + record.image.width + " × " +
    record.image.height + (record.cache.result ? ", from the cache" : "")));
  const parts = Object.entries(stages).filter(([, ms]) => typeof ms === "number");
  const most = Math.max(...parts.map(([, ms]) => ms), 1e-3);
  at("timing").replaceChildren(...parts.map(([name, ms]) => {
    const bar = document.createElement("div"), value = document.createElement("b"),
      line = document.createElement("i");
    bar.className = "bar";
    value.textContent = ms.toFixed(2) + " ms";
    line.style.width = 100 * ms / most + "%";
    bar.append(name, value, line);
    return bar;
  }));
});

view.addEventListener("error", ({ detail }) => {
  if (detail.error.status === 401) at("auth").hidden = false;
});

const start = guard(async () => {
  const token = at("token").value || sessionStorage.getItem("token") || "";
  daemon = new Penumbra(undefined, { token });
  view.token = token || null;
  const service = await daemon.service();
  text("device", service.version + (service.device ? " on " + service.device.renderer +
    (service.device.software ? " (software)" : "") : " (no device yet)"));
  techniques = await daemon.techniques();
  at("technique").replaceChildren(...techniques.map(t => new Option(t.title, t.name)));
  const wanted = [state.get("technique"), "pcss"]
    .find(name => techniques.some(t => t.name === name));
  if (wanted) at("technique").value = wanted;
  showTechnique();
  const { layer } = (await daemon.json("openapi.json")).components.schemas.Output.properties;
  at("layer").title = layer.description;
  at("layer").replaceChildren(...layer.enum.filter(l => l !== "all").map(l => new Option(l, l)));
  const ids = await listScenes(), scene = state.get("scene");
  if (ids.length) showScene(ids.includes(scene) ? scene : ids[0]);
  else text("facts", "No scene is stored yet.");
});

at("technique").onchange = guard(showTechnique);
at("params").onchange = guard(takeParams);
for (const id of ["size", "exposure"]) at(id).oninput = guard(takeLight);
for (const id of ["width", "height", "antialias", "layer"]) at(id).onchange = guard(takeImage);
for (const id of ["size", "exposure"]) at(id).ondblclick = () => {
  at(id).value = 0;
  at(id).dispatchEvent(new Event("input"));
};
at("file").onchange = () => upload(at("file").files);
at("reset").onclick = () => view.resetCamera();
at("copy").onclick = guard(async () => {
  getSelection().selectAllChildren(at("curl")); // to be copied by hand where the page may not
  await navigator.clipboard?.writeText(at("curl").textContent);
});
at("download").onclick = () => {
  if (!blob) return;
  const link = document.createElement("a");
  Object.assign(link, { href: URL.createObjectURL(blob),
    download: "penumbra." + blob.type.split("/")[1] });
  link.click();
  URL.revokeObjectURL(link.href);
};
at("token").onchange = () => {
  sessionStorage.setItem("token", at("token").value);
  start();
};
for (const kind of ["dragover", "dragleave", "drop"])
  document.addEventListener(kind, event => {
    event.preventDefault();
    at("drop").classList.toggle("over", kind === "dragover");
    if (kind === "drop") upload(event.dataTransfer.files);
  });
start();
