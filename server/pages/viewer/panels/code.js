// Share the address, and the same picture as code.
import { announce, h } from "../dom.js";
import { openKeys } from "../keys.js";

export function mount(element, store, api) {
  const device = h("span", { class: "dim", id: "device" });
  const share = h("button", { type: "button", onclick: api.guard(async () => {
    await navigator.clipboard.writeText(store.link);
    announce("The address is copied.");
    share.textContent = "Copied";
    setTimeout(() => { share.textContent = "Share"; }, 1500);
  }) }, "Share");
  element.append(device, h("nav", { "aria-label": "Tools" }, share,
    h("a", { href: "docs" }, "API"),
    h("button", { type: "button", title: "Keyboard", "aria-label": "Keyboard", onclick: openKeys }, "?")));
  api.on("service", service => {
    device.textContent = service.version + (service.device ? " on " + service.device.renderer +
      (service.device.software ? " (software)" : "") : "");
  });
}
