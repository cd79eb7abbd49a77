// The stored scenes: chosen, named, tagged, removed, and brought by dropping files.
import { announce, h, icon, settle } from "../dom.js";
import { toolButton } from "../fields.js";
import { bytes, count } from "../format.js";
import { asScenes, dropped, nameOf, send } from "./sending.js";

const SAMPLES = { "Still life": "contact, and round things", "Colonnade": "long shadows of thin bars",
  "Leaves": "many layers" };
const MANY = 7; // scenes, from which on they are searched
const UP = "M8 11V3M4.5 6.5 8 3l3.5 3.5M3 13h10";

export function mount(element, store, api) {
  const picker = props => h("input", { type: "file", hidden: true, onchange: event => {
    bring([...event.target.files]);
    event.target.value = "";
  }, ...props });
  const files = picker({ multiple: true, accept: ".glb,.gltf,.zip,.bin,.png,.jpg,.jpeg,.webp,.ktx2" });
  const folder = picker({ webkitdirectory: true });
  const sent = h("div", { class: "sent" });
  const search = h("input", { type: "search", placeholder: "Name or tag", "aria-label": "Find scenes",
    hidden: true, oninput: () => fill() });
  const list = h("ul", { class: "gallery" });
  const drop = zone();
  element.tools.append(
    toolButton("Upload a folder", "M2 5a1 1 0 0 1 1-1h3l1.5 2H13a1 1 0 0 1 1 1v5a1 1 0 0 1-1 1H3a1 1 0 0 1-1-1z", () => folder.click()),
    toolButton("Upload files", UP, () => files.click()));
  const thumbnails = new Map(); // promises of addresses, by id
  const empty = h("div", { class: "empty", hidden: true }, h("h2", {}, "Bring a scene"), zone(),
    h("p", {}, "or begin with one of these"), h("div", { class: "samples" }, samples()));
  const veil = h("div", { class: "veil", hidden: true }, h("b", {}, "Drop to upload"));
  element.append(sent, search, list, drop, files, folder);
  document.getElementById("stage").append(empty);
  document.body.append(veil);

  function zone() {
    return h("button", { type: "button", class: "drop", onclick: () => files.click() }, icon(UP),
      h("b", {}, "Drop a scene here"), h("span", {}, ".glb, .zip, a folder, or a .gltf with its files"));
  }
  function samples() {
    return Object.entries(SAMPLES).map(([name, about]) => h("button", { type: "button",
      onclick: api.guard(async () => bring([(await import("./samples.js")).sample(name)])) },
    h("b", {}, name), h("small", {}, about)));
  }
  const pick = scene => store.set({ scene, camera: null, lights: null, held: null, variant: "",
    animation: "", time_s: 0, exposure: 0 }, { push: true });

  // ---- bringing ----

  function bring(chosen) {
    for (const scene of asScenes(chosen)) if (scene.length) upload(scene);
  }

  /** One upload with its own row: bytes, then the import, then the picture. */
  async function upload(scene) {
    const name = nameOf(scene), stopping = new AbortController();
    const bar = h("progress", { max: 1, value: 0, "aria-label": name });
    const said = h("small", { role: "status" });
    const stop = h("button", { type: "button", onclick: () => stopping.abort() }, "Cancel");
    const row = h("div", { class: "sending" }, h("b", {}, name), stop, bar, said);
    sent.append(row);
    const close = () => row.remove();
    let imports = null;
    try {
      const stored = await send(scene, { token: api.token, signal: stopping.signal,
        tell(done, total) {
          bar.value = total ? done / total : 1;
          if (done < total) said.textContent = "Sending " + bytes(done) + " of " + bytes(total);
          else imports ??= watchImport(bar, said);
        } });
      imports?.();
      said.textContent = "Stored; the first picture follows.";
      await api.loadScenes();
      pick(stored.id);
      announce(name + " is stored.");
      close();
    } catch (reason) {
      imports?.();
      if (stopping.signal.aborted) return close();
      row.classList.add("failed");
      said.textContent = reason.message;
      said.setAttribute("role", "alert");
      bar.remove();
      stop.replaceWith(h("button", { type: "button", onclick: () => { close(); upload(scene); } }, "Again"),
        h("button", { type: "button", "aria-label": "Close", onclick: close }, "×"));
    }
  }

  /** Says what the daemon does with the file; returns what ends it. */
  function watchImport(bar, said) {
    const begun = performance.now();
    bar.removeAttribute("value"); // nobody knows how long
    const tell = () => {
      const waiting = api.live?.metrics.penumbra_imports_waiting ?? 0;
      said.textContent = (waiting ? "Waits for " + waiting + " other imports" :
        "Importing: meshes, textures, trees") + ", " + Math.round((performance.now() - begun) / 1000) + " s";
    };
    tell();
    const timer = setInterval(tell, 1000);
    return () => clearInterval(timer);
  }

  let inside = 0; // how deep the pointer is in elements of the page
  const carries = event => event.dataTransfer?.types.includes("Files");
  document.addEventListener("dragenter", event => { if (carries(event)) veil.hidden = ++inside < 1; });
  document.addEventListener("dragleave", event => { if (carries(event)) veil.hidden = --inside < 1; });
  document.addEventListener("dragover", event => carries(event) && event.preventDefault());
  document.addEventListener("drop", api.guard(async event => {
    if (!carries(event)) return;
    event.preventDefault();
    inside = 0;
    veil.hidden = true;
    bring(await dropped(event.dataTransfer));
  }));

  // ---- the gallery ----

  function thumbnail(id) {
    if (!thumbnails.has(id)) // not by `src`: an image cannot send a token
      thumbnails.set(id, api.daemon.thumbnail(id).then(picture => picture.url, () => {
        thumbnails.delete(id);
        return "";
      }));
    return thumbnails.get(id);
  }
  const sight = new IntersectionObserver(entries => entries.filter(entry => entry.isIntersecting)
    .forEach(async ({ target }) => {
      sight.unobserve(target);
      target.src = await thumbnail(target.dataset.id) || "data:,";
    }));

  function card(scene) {
    const current = scene.id === store.get("scene"), name = scene.name || scene.id.slice(0, 10);
    const image = h("img", { alt: "", width: 72, height: 54, dataset: { id: scene.id } });
    sight.observe(image);
    return h("li", {}, h("button", { type: "button", value: scene.id, class: "card",
      "aria-pressed": String(current), onclick: () => current || pick(scene.id) }, image,
    h("span", {}, h("b", {}, name), h("small", {}, count(scene.triangles) +
      (scene.triangles === 1 ? " triangle" : " triangles")),
      scene.tags.length > 0 && h("small", { class: "tags" }, scene.tags.map(tag => h("i", {}, tag))))),
    current && warnings(scene), current && editor(scene));
  }

  function warnings({ warnings }) {
    if (!warnings.length) return null;
    return h("details", { class: "warnings" }, h("summary", {}, warnings.length === 1 ? "1 warning" :
      warnings.length + " warnings", h("span", {}, " " + warnings[0])),
    h("ul", {}, warnings.map(warning => h("li", {}, warning))));
  }

  function editor(scene) {
    const change = api.guard(async changes => {
      await api.daemon.changeScene(scene.id, changes);
      await api.loadScenes();
    }, "The scene's name");
    const field = (label, value, make) => h("label", {}, h("span", {}, label),
      h("input", { type: "text", value, onchange: ({ target }) => change(make(target.value.trim())) }));
    const remove = h("button", { type: "button", class: "danger", onclick: () => {
      if (remove.dataset.sure) return gone(scene);
      remove.dataset.sure = "yes";
      remove.textContent = "Really remove it?";
      settle(() => { delete remove.dataset.sure; remove.textContent = "Remove"; }, 4000)();
    } }, "Remove");
    return h("details", { class: "about", open: opened, ontoggle: event => { opened = event.target.open; } },
      h("summary", {}, "Name, tags, details"),
      field("name", scene.name, name => ({ name: name || null })),
      field("tags", scene.tags.join(", "), text => ({ tags: [...new Set(text.split(",").map(tag =>
        tag.trim()).filter(Boolean))] })),
      h("dl", {}, Object.entries({ materials: count(scene.materials), textures: count(scene.textures),
        animations: count(scene.animations.length), GPU: bytes(scene.gpu_bytes),
        file: bytes(scene.source_bytes), id: scene.id.slice(0, 12) })
        .flatMap(([key, value]) => [h("dt", {}, key), h("dd", {}, value)])), remove);
  }
  let opened = false;

  const gone = api.guard(async ({ id }) => {
    await api.daemon.removeScene(id);
    if (store.get("scene") === id)
      pick(api.scenes.find(scene => scene.id !== id)?.id);
    await api.loadScenes();
    announce("The scene is removed.");
  });

  function fill() {
    const wanted = search.value.trim().toLowerCase();
    search.hidden = api.scenes.length < MANY && !wanted;
    empty.hidden = !known || api.scenes.length > 0;
    drop.hidden = !empty.hidden;
    const held = document.activeElement?.closest?.(".gallery button")?.value;
    list.replaceChildren(...api.scenes.filter(({ name, tags, id }) => !wanted ||
      [name, id, ...tags].some(text => text.toLowerCase().includes(wanted))).map(card));
    if (held) list.querySelector("button[value='" + held + "']")?.focus();
  }
  let known = false;
  api.on("scenes", () => { known = true; fill(); });
  store.on(["scene"], () => {
    fill();
    list.querySelector("[aria-pressed=true]")?.scrollIntoView({ block: "nearest" });
  });
  // Of others that share the daemon.
  let stored;
  api.on("live", ({ metrics: { penumbra_scenes: scenes } }) => {
    if (stored !== undefined && stored !== scenes && scenes !== api.scenes.length)
      api.loadScenes().catch(() => {}); // said by who asks next
    stored = scenes;
  });
}
