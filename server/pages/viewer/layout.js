// Where the panels stand: around the picture, or on a phone as sheets from below.
import { h } from "./dom.js";

function frame({ id, title, sheet }) {
  const body = h("div", { class: "body" });
  body.tools = h("div", { class: "tools" });
  const section = h("section", { class: "panel", id: "panel-" + id, "aria-labelledby": "title-" + id,
    dataset: { sheet } }, h("header", {}, h("h2", { id: "title-" + id }, title), body.tools), body);
  return { section, body };
}

const phone = matchMedia("(max-width: 900px)");

/** Opens a phone's sheet, or closes all. */
function show(name) {
  document.body.dataset.sheet = name ?? "";
  for (const tab of document.querySelectorAll("#tabs button"))
    tab.setAttribute("aria-expanded", String(tab.value === name));
  for (const panel of document.querySelectorAll(".panel"))
    panel.classList.toggle("open", panel.dataset.sheet === name);
}

/** Puts all panels into the sheet, or each into its region. */
function place(panels) {
  for (const { id, region, title } of panels)
    if (title)
      document.getElementById(phone.matches ? "sheet" : region)
        .append(document.getElementById("panel-" + id));
}

/** Makes a place for each panel and mounts it there; what one fails in leaves the others alone. */
export function layOut(panels, store, api) {
  for (const panel of panels) {
    const region = document.getElementById(panel.region);
    let body;
    if (panel.title) {
      const made = frame(panel);
      region.append(made.section);
      body = made.body;
    } else {
      body = region.appendChild(h("div", { class: "piece", id: "piece-" + panel.id }));
    }
    try {
      panel.panel.mount(body, store, api);
    } catch (reason) {
      reportError(reason);
      body.append(h("p", { class: "bad" }, "This panel failed: " + reason.message));
    }
  }
  const sheets = [...new Set(panels.map(panel => panel.sheet).filter(Boolean))];
  document.getElementById("tabs").append(...sheets.map(name => h("button", { value: name,
    type: "button", "aria-expanded": "false", "aria-controls": "sheet",
    onclick: () => show(document.body.dataset.sheet === name ? null : name) }, name)));
  phone.addEventListener("change", () => place(panels));
  place(panels);
  show(phone.matches ? "Method" : null);
}
