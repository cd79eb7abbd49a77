// Share the address, keep the picture, and ask for the same one in code.
import { announce, h } from "../dom.js";
import { openKeys } from "../keys.js";
import { download, shownRequest } from "../request.js";

async function copy(text) {
  try {
    await navigator.clipboard.writeText(text);
  } catch (reason) { // not on pages without TLS
    const field = h("textarea", { value: text, class: "unseen", "aria-hidden": "true" });
    (document.querySelector("dialog[open]") ?? document.body).append(field);
    field.select();
    document.execCommand("copy");
    field.remove();
  }
}

/** A button that copies what `text()` gives and says so. */
function copyButton(label, text, api, props = {}) {
  const button = h("button", { type: "button", ...props, onclick: api.guard(async () => {
    await copy(text());
    announce("Copied.");
    button.textContent = "Copied";
    setTimeout(() => { button.textContent = label; }, 1500);
  }) }, label);
  return button;
}

/** The picture that is shown as code, by language; a token is named where one is asked for. */
export function recipesOf({ curl, keywords, pretty }, { server, scene, request, format, token }) {
  const file = "penumbra." + format, id = JSON.stringify(scene), at = JSON.stringify(server);
  return {
    curl: curl(server, "post", "/v1/scenes/" + scene + "/render", { responses: {} },
      { path: {}, type: "application/json", body: request }, token) + " \\\n  -o " + file,
    Python: (token ? "import os\n" : "") + "import penumbra\n\nclient = penumbra.Client(" + at +
      (token ? ', token=os.environ["PENUMBRA_TOKEN"]' : "") + ")\npicture = client.scene(" + id +
      ").render(\n    " + keywords(request) + ")\npicture.save(" + JSON.stringify(file) + ")",
    JavaScript: "import { Penumbra } from " + JSON.stringify(server + "/penumbra.js") + ";\n\n" +
      "const daemon = new Penumbra(" + at + (token ? ', { token: "YOUR TOKEN" }' : "") + ");\n" +
      "const picture = await daemon.render(" + id + ", " + pretty(request) + ");\n" +
      "document.body.append(Object.assign(new Image(), { src: picture.url }));",
  };
}

export function mount(element, store, api) {
  const device = h("span", { class: "dim", id: "device" });

  const openCode = api.guard(async () => {
    const shown = shownRequest(store, api), { scene, format } = store.state;
    if (!shown) return;
    const request = format === "png" ? shown : { ...shown, output: { ...shown.output, format } };
    // The examples of the API page are written by the same rules.
    const recipes = recipesOf(await import("../samples.js"), { scene, request, format,
      server: api.daemon.server.href.replace(/\/$/, ""), token: api.token });
    const text = h("code"), tabs = h("div", { class: "kinds", role: "group", "aria-label": "Language" },
      Object.keys(recipes).map(name => h("button", { type: "button", value: name, onclick: () => show(name) }, name)));
    const show = name => {
      text.textContent = recipes[name];
      for (const tab of tabs.children) tab.setAttribute("aria-pressed", String(tab.value === name));
    };
    const dialog = h("dialog", { class: "recipes", "aria-labelledby": "recipes-title", onclose: () => dialog.remove() },
      h("h2", { id: "recipes-title" }, "This picture as code"), tabs,
      h("pre", { tabIndex: 0, role: "region", "aria-label": "Code" }, text),
      api.token ? h("p", { class: "hint" }, "The token is not in it: set PENUMBRA_TOKEN, or put it where it says so.") : null,
      h("form", { method: "dialog" }, h("button", {}, "Close"),
        copyButton("Copy", () => text.textContent, api, { class: "primary" })));
    dialog.addEventListener("click", event => event.target === dialog && dialog.close());
    document.body.append(dialog);
    show("curl");
    dialog.showModal();
  }, "The code");

  element.append(device, h("nav", { "aria-label": "Tools" },
    copyButton("Share", () => store.link, api),
    h("button", { type: "button", class: "optional", onclick: api.guard(() => download(store, api), "The download") }, "Download"),
    h("button", { type: "button", onclick: openCode }, "Code"), h("a", { href: "docs" }, "API"),
    h("button", { type: "button", title: "Keyboard", "aria-label": "Keyboard", onclick: openKeys }, "?")));
  api.on("service", service => {
    device.textContent = service.version + (service.device ? " on " + service.device.renderer +
      (service.device.software ? " (software)" : "") : "");
  });
}
