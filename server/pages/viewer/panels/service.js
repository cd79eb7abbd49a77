// How the service does.
import { h } from "../dom.js";
import { time } from "../format.js";

export function mount(element, store, api) {
  const text = h("p", { class: "hint" });
  element.append(text);
  api.on("live", ({ recent, metrics }) => {
    text.textContent = recent.renders + " renders in 10 s, median " + time(recent.total?.p50) +
      ", " + metrics.penumbra_queue_depth + " waiting";
  });
}
