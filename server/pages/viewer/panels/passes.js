// The passes of this picture.
import { h } from "../dom.js";
import { time } from "../format.js";

export function mount(element, store, api) {
  const list = h("ul", { class: "plain" });
  element.append(list);
  api.on("picture", ({ record, done }) => done && list.replaceChildren(...record.passes
    .map(pass => h("li", {}, pass.name + " " + time(pass.ms)))));
}
