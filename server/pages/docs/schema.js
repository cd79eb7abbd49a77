// Schemas of the OpenAPI document as trees to open.
import { h } from "./dom.js";

export const resolve = (api, schema) => schema?.$ref ?
  { ...schema.$ref.slice(2).split("/").reduce((place, key) => place?.[key], api), ...schema } : schema ?? {};
const nameOf = schema => schema?.$ref?.split("/").pop() ?? "";

/** In a word or two: "number, 0 to 5, default 1". */
export function brief(api, given) {
  const schema = resolve(api, given), words = [];
  const kind = nameOf(given) || (schema.const !== undefined ? JSON.stringify(schema.const) :
    schema.enum ? schema.enum.join(" | ") : schema.type === "array" ?
      "list of " + (brief(api, schema.items ?? {}).split(",")[0] || "anything") :
      [schema.type ?? (schema.oneOf ?? schema.anyOf ?? []).map(s => brief(api, s).split(",")[0]).join(" or ")]
        .flat().join(" or "));
  if (kind) words.push(kind);
  const inner = schema.type === "array" ? schema.items ?? {} : schema;
  const least = inner.minimum ?? inner.exclusiveMinimum;
  if (least !== undefined && inner.maximum !== undefined) words.push(least + " to " + inner.maximum);
  else if (least !== undefined) words.push("at least " + least);
  if (schema.default !== undefined) words.push("default " + JSON.stringify(schema.default));
  return words.join(", ");
}

/** The objects that a schema is made of, once each on the way down. */
function branches(api, given, above) {
  const schema = resolve(api, given), name = nameOf(given);
  if (name && above.includes(name)) return [];
  if (schema.properties) return [[name, schema]];
  const inner = schema.type === "array" ? [schema.items ?? {}] : schema.oneOf ?? schema.anyOf ?? [];
  return inner.flatMap(choice => branches(api, choice, name ? [...above, name] : above));
}

/** A table of an object's keys, with what is inside of them to be opened. */
export function tree(api, given, above = []) {
  return branches(api, given, above).map(([name, schema]) => {
    const inside = name ? [...above, name] : above;
    const rows = Object.entries(schema.properties).map(([key, member]) => {
      const whole = resolve(api, member), deeper = branches(api, member, inside);
      const more = deeper.length && h("details", { ontoggle: event => {
        const details = event.currentTarget;
        if (details.open && details.children.length === 1) details.append(...tree(api, member, inside));
      } }, h("summary", {}, deeper.map(([label]) => label || "its keys").slice(0, 3).join(", ") +
        (deeper.length > 3 ? ", and " + (deeper.length - 3) + " more" : "")));
      return h("tr", {}, h("td", {}, h("code", {}, key), schema.required?.includes(key) ?
        h("small", {}, "always") : null), h("td", {}, whole.description ?? "",
        h("small", {}, brief(api, member)), more || null));
    });
    return h("div", {}, name && above.length ? h("h4", {}, name) : null, h("table", {}, h("tbody", {}, rows)));
  });
}
