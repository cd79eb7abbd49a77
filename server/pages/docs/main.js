// The API page: made in the browser of /openapi.json and /v1/techniques, and of nothing else.
import { h } from "./dom.js";
import { exampleOf, LANGUAGES } from "./samples.js";
import { brief, resolve, tree } from "./schema.js";
import { tryIt } from "./try.js";

const main = document.querySelector("#main"), contents = document.querySelector("#contents");
const search = document.querySelector("#search"), token = document.querySelector("#token");
const status = document.querySelector("#status");
const origin = new URL(".", location.href).href.replace(/\/$/, "");
const TITLES = { service: "The service", scenes: "Scenes", images: "Images for lights", jobs: "Jobs",
  techniques: "Methods", results: "Results", stats: "Figures", events: "Live figures",
  pages: "Pages and modules" };
const ORDER = ["scenes", "images", "jobs", "results", "techniques", "service", "stats", "events"];
const sections = []; // { element, text, link }
let language = 0;

const headers = () => token.value ? { Authorization: "Bearer " + token.value } : {};

/** Examples in three languages, of which all show the one that was chosen last. */
function samples(method, path, call, example) {
  const id = call.operationId, shown = h("pre", { tabIndex: 0, role: "tabpanel" });
  const tabs = LANGUAGES.map(([name], number) => h("button", { type: "button", role: "tab",
    onclick: () => choose(number) }, name));
  const update = () => {
    tabs.forEach((tab, number) => {
      tab.setAttribute("aria-selected", String(number === language));
      tab.tabIndex = number === language ? 0 : -1;
    });
    shown.textContent = LANGUAGES[language][1](origin, method, path, call, example, !document.querySelector(".token").hidden);
    shown.setAttribute("aria-label", LANGUAGES[language][0] + " example of " + id);
  };
  const copy = h("button", { type: "button", className: "copy", onclick: async () => {
    await navigator.clipboard.writeText(shown.textContent);
    copy.textContent = "Copied";
    setTimeout(() => { copy.textContent = "Copy"; }, 1500);
  } }, "Copy");
  updates.push(update);
  update();
  return h("div", { className: "samples" }, h("div", { className: "tabs" }, h("div", { role: "tablist", "aria-label": "Language",
    onkeydown: event => {
      const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
      if (!step) return;
      choose((language + step + LANGUAGES.length) % LANGUAGES.length);
      tabs[language].focus();
    } }, tabs), copy), shown);
}
const updates = [];
function choose(number) {
  language = number;
  updates.forEach(update => update());
}

function parameters(api, call) {
  const given = (call.parameters ?? []).filter(p => p.in !== "path" || p.description);
  if (!given.length) return null;
  const table = h("table", {}, h("tbody", {}, given.map(p => {
    const schema = resolve(api, p.schema ?? Object.values(p.content ?? {})[0]?.schema);
    return h("tr", {}, h("td", {}, h("code", {}, p.name), h("small", {}, p.in)),
      h("td", {}, p.description ?? schema.description ?? "", h("small", {}, brief(api, p.schema ?? {}))));
  })));
  return given.length > 8 ? h("details", {}, h("summary", {}, given.length + " keys of the query and header"), table) :
    [h("h4", {}, "Keys"), table];
}

function body(api, call) {
  const content = Object.entries(call.requestBody?.content ?? {});
  if (!content.length) return null;
  const [[, media]] = content, deep = media.schema ? tree(api, media.schema) : [];
  return [h("h4", {}, "Body: " + content.map(([type]) => type).join(", ")),
    media.schema && resolve(api, media.schema).description ? h("p", {}, resolve(api, media.schema).description) : null,
    deep.length ? h("details", {}, h("summary", {}, media.schema.$ref?.split("/").pop() ?? "Its keys"), deep) : null];
}

function answers(api, call) {
  return [h("h4", {}, "Answers"), h("ul", { className: "answers" }, Object.entries(call.responses)
    .filter(([code]) => code !== "default").map(([code, given]) => {
      const answer = resolve(api, given), media = Object.entries(answer.content ?? {});
      const json = media.find(([, m]) => m.schema && tree(api, m.schema).length);
      const line = [h("code", {}, code), " " + answer.description + " ",
        media.length ? h("span", { className: "dim" }, media.map(([type]) => type).join(", ")) : null];
      return h("li", {}, json ? h("details", { ontoggle: event => {
        const details = event.currentTarget;
        if (details.open && details.children.length === 1) details.append(...tree(api, json[1].schema));
      } }, h("summary", {}, line)) : line);
    }))];
}

/** A section that can be found, and stands in the contents. */
function section(element, text, label, group) {
  const link = h("a", { href: "#" + element.id }, label);
  sections.push({ element, text: text.toLowerCase(), link, group });
  return element;
}

function operation(api, method, path, call, group) {
  const example = exampleOf(api, path, call);
  const names = (call.parameters ?? []).map(p => p.name).join(" ");
  const article = h("article", { id: call.operationId }, h("h3", {},
    h("span", { className: "verb " + method }, method.toUpperCase()), h("span", { className: "path" }, path)),
    h("p", {}, call.summary + "."), parameters(api, call), body(api, call), answers(api, call),
    h("div", { className: "beside" }, samples(method, path, call, example),
      tryIt(method, path, call, example, () => token.value)));
  return section(article, [method, path, call.operationId, call.summary, names].join(" "), call.summary, group);
}

function technique(t, group) {
  const article = h("article", { id: "method-" + t.name }, h("h3", {}, t.title, h("code", {}, t.name)),
    h("p", { className: "wide" }, t.summary), h("p", { className: "wide dim" }, t.citation + " Cost: " + t.cost_class + ". " + t.artefacts),
    h("table", { className: "wide" }, h("tbody", {}, t.params.map(row => h("tr", {}, h("td", {}, h("code", {}, row.name)),
      h("td", {}, row.help, h("small", {}, (row.choices ? row.choices.join(" | ") : row.min !== undefined ?
        row.min + " to " + row.max + (row.unit ? " " + row.unit : "") : row.type) + ", default " +
        JSON.stringify(row.default))))))));
  return section(article, [t.name, t.title, t.summary, ...t.params.map(p => p.name)].join(" "), t.title, group);
}

/** Only what has every word that is typed. */
function filter() {
  const words = search.value.toLowerCase().split(/\s+/).filter(Boolean);
  let shown = 0;
  for (const { element, text, link } of sections) {
    const fits = words.every(word => text.includes(word));
    element.hidden = link.hidden = !fits;
    shown += fits;
  }
  for (const heading of document.querySelectorAll("main > h2, nav h2")) {
    const group = heading.dataset.group;
    heading.hidden = !sections.some(s => s.group === group && !s.element.hidden);
  }
  status.textContent = shown ? "" : "Nothing here has all of these words.";
}

function heading(group) {
  const title = TITLES[group] ?? group;
  main.append(h("h2", { dataset: { group }, id: "group-" + group }, title));
  return title;
}

/** What examples are of: a scene, an image and a job that there are. */
async function fillExamples(api) {
  const ids = {};
  for (const kind of ["scenes", "images", "jobs"]) {
    const answer = await fetch("v1/" + kind + "?limit=1", { headers: headers() });
    if (answer.status === 401) document.querySelector(".token").hidden = false;
    ids[kind] = answer.ok ? (await answer.json())[kind][0]?.id : null;
  }
  for (const [path, methods] of Object.entries(api.paths))
    for (const call of Object.values(methods)) {
      const id = ids[path.split("/")[2]];
      for (const parameter of call.parameters ?? [])
        if (id && parameter.in === "path" && parameter.name === "id") parameter.example = id;
      const example = call.requestBody?.content?.["application/json"]?.example;
      if (example?.scene && ids.scenes) example.scene = ids.scenes;
    }
}

async function build() {
  const api = await (await fetch("openapi.json")).json();
  await fillExamples(api);
  const groups = new Map();
  for (const [path, methods] of Object.entries(api.paths))
    for (const [method, call] of Object.entries(methods)) {
      const group = path.startsWith("/v1") ? call.tags?.[0] ?? "service" : "pages";
      groups.set(group, [...groups.get(group) ?? [], [method, path, call]]);
    }
  status.textContent = "";
  const place = ([group]) => (ORDER.indexOf(group) + ORDER.length + 1) % (ORDER.length + 1);
  for (const [group, calls] of [...groups].sort((a, b) => place(a) - place(b))) {
    heading(group);
    main.append(...calls.map(([method, path, call]) => operation(api, method, path, call, group)));
  }
  const list = await fetch("v1/techniques", { headers: headers() });
  if (list.ok) {
    heading("Every method");
    main.append(...(await list.json()).techniques.map(t => technique(t, "Every method")));
  }
  let last = null;
  for (const { link, group } of sections) {
    if (group !== last) contents.append(h("h2", { dataset: { group } }, TITLES[group] ?? group));
    contents.append(link);
    last = group;
  }
  filter();
  if (location.hash) document.getElementById(decodeURIComponent(location.hash.slice(1)))?.scrollIntoView();
  const seen = new IntersectionObserver(entries => {
    for (const { target, isIntersecting } of entries) {
      if (!isIntersecting) continue;
      contents.querySelector("[aria-current]")?.removeAttribute("aria-current");
      const { link } = sections.find(s => s.element === target);
      link.setAttribute("aria-current", "true");
      const { top, bottom } = link.getBoundingClientRect();
      if (top < 60 || bottom > innerHeight) link.scrollIntoView({ block: "nearest" });
    }
  }, { rootMargin: "-70px 0px -75% 0px" });
  sections.forEach(s => seen.observe(s.element));
}

search.addEventListener("input", filter);
document.addEventListener("keydown", event => {
  if (event.key !== "/" || /INPUT|TEXTAREA|SELECT/.test(document.activeElement.tagName)) return;
  event.preventDefault();
  search.focus();
});
token.addEventListener("change", async () => {
  for (const element of main.querySelectorAll(":scope > h2, :scope > article")) element.remove();
  contents.replaceChildren();
  sections.length = updates.length = 0;
  await build();
});
build().catch(reason => { status.textContent = "The document cannot be read: " + reason.message; });
