// Error against time: every method a point.
import { h } from "../dom.js";

export function mount(element) {
  element.append(h("p", { class: "hint" }, "Not measured yet."));
}
