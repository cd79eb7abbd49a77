// A call that is tried in the page.
import { h } from "./dom.js";
import { fill, pretty } from "./samples.js";

const MOST_TEXT = 20000, EVENTS_MS = 4000;

/** How an answer is shown: pictures as such, JSON with lines, the beginning of what has no end. */
async function show(answer, stop) {
  const type = answer.headers.get("Content-Type") ?? "";
  if (type.startsWith("image/")) {
    const blob = await answer.blob();
    return [h("img", { src: URL.createObjectURL(blob), alt: "The answer, " + blob.size + " bytes",
      onload: event => URL.revokeObjectURL(event.target.src) })];
  }
  if (/event-stream|x-mixed-replace/.test(type)) {
    const reader = answer.body.getReader(), decoder = new TextDecoder();
    let text = "";
    setTimeout(stop, EVENTS_MS);
    try {
      for (let piece; !(piece = await reader.read()).done && text.length < MOST_TEXT;)
        text += decoder.decode(piece.value, { stream: true });
    } catch { /* stopped */ }
    return [h("pre", { tabIndex: 0 }, text.slice(0, MOST_TEXT))];
  }
  if (/zip|octet-stream/.test(type)) return [h("p", {}, (await answer.blob()).size + " bytes")];
  const text = await answer.text();
  let shown = text;
  try { shown = pretty(JSON.parse(text)); } catch { /* as it is */ }
  return shown ? [h("pre", { tabIndex: 0 }, shown.length > MOST_TEXT ? shown.slice(0, MOST_TEXT) + "\n..." : shown)] : [];
}

/** The form of a call. `token()` is sent, where there is one. */
export function tryIt(method, path, call, example, token) {
  const fields = {}, rows = [];
  const parameters = (call.parameters ?? []).filter(p => p.in === "path" || p.in === "query");
  const add = parameter => {
    const { name } = parameter, options = parameter.schema?.enum;
    const field = options ? h("select", {}, h("option", {}, ""), options.map(o => h("option", {}, o))) :
      h("input", { value: parameter.in === "path" ? example.path[name] ?? "" : "", spellcheck: false });
    fields[parameter.in + " " + name] = field;
    return h("label", {}, h("code", {}, name), field);
  };
  rows.push(...parameters.filter(p => p.in === "path").map(add));
  const queries = parameters.filter(p => p.in === "query");
  if (queries.length > 6)
    rows.push(h("label", {}, h("code", {}, "?query"), fields.whole = h("input", { spellcheck: false,
      value: "technique=pcss&width=320&height=240" })));
  else rows.push(...queries.map(add));
  let body = null;
  if (example.file) rows.push(h("label", {}, h("code", {}, "file"), body = h("input", { type: "file" })));
  else if (example.body) rows.push(h("label", { className: "tall" }, h("code", {}, "body"),
    body = h("textarea", { value: pretty(example.body), spellcheck: false })));
  const result = h("div", { className: "result", hidden: true, role: "status" });
  let running = null;
  const send = h("button", { className: "send" }, method === "delete" ? "Delete" : "Send");
  const form = h("form", { onsubmit: async event => {
    event.preventDefault();
    if (running) return running.abort();
    running = new AbortController();
    send.textContent = "Stop";
    const given = {}, query = new URLSearchParams(fields.whole?.value);
    for (const [key, field] of Object.entries(fields)) {
      const [where, name] = key.split(" ");
      if (where === "path") given[name] = field.value;
      else if (where === "query" && field.value) query.set(name, field.value);
    }
    const headers = {}, sent = body?.files ? body.files[0] : body?.value;
    if (token()) headers.Authorization = "Bearer " + token();
    if (body) headers["Content-Type"] = body.files ? "application/octet-stream" : "application/json";
    const address = fill(path, given).slice(1) + (query.size ? "?" + query : "");
    const begun = performance.now();
    try {
      const answer = await fetch(address || "./", { method: method.toUpperCase(), headers, signal: running.signal,
        ...(sent ? { body: sent } : {}) });
      const parts = await show(answer, () => running?.abort());
      const times = answer.headers.get("Server-Timing");
      result.replaceChildren(h("p", { className: answer.ok ? "" : "failed" }, answer.status + " " +
        answer.statusText + ", " + Math.round(performance.now() - begun) + " ms"), ...parts,
        times ? h("p", { className: "dim" }, h("code", {}, times)) : "");
    } catch (reason) {
      result.replaceChildren(h("p", { className: "failed" }, running.signal.aborted ? "Stopped." :
        "No answer: " + reason.message));
    }
    result.hidden = false;
    running = null;
    send.textContent = method === "delete" ? "Delete" : "Send";
  } }, rows, h("div", { className: "row" }, send));
  return h("details", { className: "try" }, h("summary", {}, "Try it"), form, result);
}
