// The method and its parameters, as /v1/techniques describes them.
import { h } from "../dom.js";
import { paramField } from "../fields.js";
import { bindKey } from "../keys.js";

export function mount(element, store, api) {
  const select = h("select", { id: "technique", "aria-label": "Method", onchange: () => take(select.value) });
  const summary = h("p", { class: "hint" });
  const params = h("div", { class: "fields" });
  const more = h("details", {}, h("summary", {}, "Artefacts and source"), h("p", { class: "hint" }));
  element.append(select, summary, params, more);
  let fields = new Map();

  const take = technique => store.set({ technique, params: {} }, { push: true });

  function build({ technique, params: given }) {
    const info = api.technique(technique);
    if (!info) return;
    select.value = technique;
    summary.textContent = info.summary;
    more.lastChild.textContent = info.artefacts + " " + info.citation + ".";
    fields = new Map(info.params.map(param => [param.name, paramField(param,
      given[param.name] ?? param.default, value => {
        const next = { ...store.get("params") };
        if (JSON.stringify(value) === JSON.stringify(param.default)) delete next[param.name];
        else next[param.name] = value;
        store.set({ params: next });
      })]));
    params.replaceChildren(...fields.values());
  }

  api.on("techniques", techniques => {
    select.replaceChildren(...techniques.map(t => new Option(t.title, t.name)));
    build(store.state);
  });
  store.on(["technique", "params"], (state, changed) => {
    if (changed.has("technique")) return build(state);
    for (const param of api.technique(state.technique)?.params ?? [])
      fields.get(param.name)?.show(state.params[param.name] ?? param.default);
  });
  bindKey("1 to 9", "The first nine methods", event => {
    const technique = api.techniques[Number(event.key) - 1];
    if (technique) take(technique.name);
  }, event => /^[1-9]$/.test(event.key));
}
