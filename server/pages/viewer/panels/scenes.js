// The stored scenes, and the way to bring another one.
import { h } from "../dom.js";
import { count } from "../format.js";

export function mount(element, store, api) {
  const list = h("ul", { class: "gallery" });
  const input = h("input", { type: "file", multiple: true, class: "unseen", id: "file",
    accept: ".glb,.gltf,.zip,.bin,.png,.jpg,.jpeg,.webp", onchange: () => upload(input.files) });
  const drop = h("label", { class: "drop", htmlFor: "file" }, input,
    h("b", {}, "Drop a scene here"), h("span", {}, ".glb, .zip, or a .gltf with its files"));
  element.append(drop, list);

  const upload = api.guard(async files => {
    if (!files.length) return;
    const scene = await api.daemon.upload([...files]);
    await api.loadScenes();
    pick(scene.id);
  });
  const pick = scene => store.set({ scene, camera: null, lights: null, variant: "", animation: "",
    time_s: 0, exposure: 0 }, { push: true });

  function fill() {
    list.replaceChildren(...api.scenes.map(scene => h("li", {}, h("button", { type: "button",
      value: scene.id, onclick: () => pick(scene.id),
      "aria-pressed": String(scene.id === store.get("scene")) },
    // An image cannot send a token.
    api.token ? null : h("img", { alt: "", loading: "lazy", width: 96, height: 72,
      src: "v1/scenes/" + scene.id + "/render?technique=hard&width=192&height=144&priority=batch" }),
    h("span", {}, h("b", {}, scene.name ?? scene.id.slice(0, 10)),
      h("small", {}, count(scene.triangles) + " triangles"))))));
  }
  api.on("scenes", fill);
  store.on(["scene"], ({ scene }) => {
    for (const button of list.querySelectorAll("button"))
      button.setAttribute("aria-pressed", String(button.value === scene));
  });
  for (const kind of ["dragover", "dragleave", "drop"])
    document.addEventListener(kind, event => {
      event.preventDefault();
      drop.classList.toggle("over", kind === "dragover");
      if (kind === "drop") upload(event.dataTransfer.files);
    });
}
