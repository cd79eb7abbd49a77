// Examples of a call in three languages, of what the OpenAPI document says of it.

/** What stands for a path's parameters, the query's that must be said, and the body. */
export function exampleOf(api, path, call) {
  const given = {};
  for (const parameter of call.parameters ?? [])
    if (parameter.in === "path") given[parameter.name] = parameter.example;
  const content = call.requestBody?.content ?? {}, json = content["application/json"];
  const type = json?.schema ? "application/json" : Object.keys(content)[0] ?? "";
  return { path: given, body: json?.schema ? json.example ?? {} : null, type,
    file: type && !json?.schema ? (type.startsWith("image/") ? "light.png" : "scene.glb") : "" };
}

/** The address with its parameters filled in. */
export const fill = (path, given) =>
  path.replace(/\{(\w+)\}/g, (whole, name) => encodeURIComponent(given[name] ?? whole));

export const shell = text => "'" + text.replaceAll("'", "'\\''") + "'";
/** JSON with lines, short lists on one. */
export const pretty = value => JSON.stringify(value, null, 2)
  .replace(/\[\s+([^[\]{}]{1,60}?)\s+\]/g, (_, inside) => "[" + inside.replace(/\s+/g, " ") + "]");

function answersWith(call) {
  const answers = call.responses["200"] ?? call.responses["202"] ?? {};
  return Object.keys(answers.content ?? {});
}

export function curl(origin, method, path, call, example, token) {
  const lines = ["curl " + (method === "get" ? "" : "-X " + method.toUpperCase() + " ") +
    shell(origin + fill(path, example.path))];
  if (token) lines.push("-H \"Authorization: Bearer $PENUMBRA_TOKEN\"");
  if (example.type) lines.push("-H " + shell("Content-Type: " + example.type));
  if (example.file) lines.push("--data-binary @" + example.file);
  else if (example.body) lines.push("-d " + shell(pretty(example.body)));
  const types = answersWith(call);
  if (types[0]?.startsWith("image/")) lines.push("-o picture" + (types[0] === "image/jpeg" ? ".jpg" : ".png"));
  if (types.length === 1 && types[0] === "text/event-stream") lines.push("-N");
  return lines.join(" \\\n  ");
}

function python(value, indent = "") {
  if (value === true || value === false) return value ? "True" : "False";
  if (value === null) return "None";
  if (Array.isArray(value)) return "[" + value.map(v => python(v, indent)).join(", ") + "]";
  if (typeof value === "object")
    return "{" + Object.entries(value).map(([k, v]) => JSON.stringify(k) + ": " + python(v, indent)).join(", ") + "}";
  return JSON.stringify(value);
}

/** A request's keys as keywords: what the document has in objects of its own for order only is not
 * nested in Python. */
export function keywords(body) {
  const flat = {};
  for (const [key, value] of Object.entries(body)) {
    if (key === "output" || key === "sequence") Object.assign(flat, value);
    else if (key !== "scene") flat[key] = value;
  }
  return Object.entries(flat).map(([key, value]) => ",\n    " + key + "=" + python(value)).join("")
    .replace(/^,\n {4}/, "");
}

/** The packages' own calls, by operation; of the rest the examples are plain HTTP. */
const CALLS = {
  getService: ["client.service()", "await daemon.service()"],
  getStats: ["client.stats()", "await daemon.stats()"],
  listTechniques: ["client.techniques()", "await daemon.techniques()"],
  getTechnique: ["client.technique(NAME)", null],
  listScenes: ["[scene.name for scene in client.scenes()]", null],
  uploadScene: ['client.upload("scene.glb")', "await daemon.upload(file)"],
  getScene: ["client.scene(ID).info", "await daemon.scene(ID)"],
  changeScene: ["client.scene(ID).change(KEYWORDS)", "await daemon.changeScene(ID, BODY)"],
  getThumbnail: ['client.scene(ID).thumbnail().save("small.jpg")', "await daemon.thumbnail(ID)"],
  deleteScene: ["client.scene(ID).delete()", "await daemon.removeScene(ID)"],
  renderScene: ["client.scene(ID).render(KEYWORDS)", "await daemon.render(ID, BODY)"],
  compareMethods: ["client.scene(ID).compare(KEYWORDS)", "await daemon.compare(ID, BODY)"],
  startSequence: ["client.scene(SCENE).sequence(KEYWORDS)",
    'await daemon.start("sequence", SCENE, BODY)'],
  uploadImage: ['client.upload_image("light.png")', "await daemon.uploadImage(file)"],
  getImage: ["client.image(ID)", null],
  listJobs: ["[job.state for job in client.jobs()]", null],
  getJob: ["client.job(ID).state", "(await daemon.job(ID)).job"],
};

function fillCall(text, example, words) {
  const { scene, ...rest } = example.body ?? {};
  return text.replaceAll("ID", JSON.stringify(example.path.id)).replaceAll("NAME", JSON.stringify(example.path.name))
    .replace("SCENE", JSON.stringify(scene)).replace("KEYWORDS", () => words)
    .replace("BODY", () => pretty(scene ? rest : example.body));
}

export function pythonOf(origin, method, path, call, example, token) {
  const own = CALLS[call.operationId]?.[0];
  if (own) {
    const words = example.body ? keywords(example.body) : "";
    return "import penumbra\n\nclient = penumbra.Client(" + JSON.stringify(origin) +
      (token ? ", token=TOKEN" : "") + ")\nprint(" + fillCall(own, example, words) + ")";
  }
  const lines = ["import urllib.request", ""];
  lines.push("request = urllib.request.Request(" + JSON.stringify(origin + fill(path, example.path)) +
    (method === "get" ? ")" : ", method=" + JSON.stringify(method.toUpperCase()) + ")"));
  if (token) lines.push('request.add_header("Authorization", "Bearer " + TOKEN)');
  if (example.type) lines.push("request.add_header(\"Content-Type\", " + JSON.stringify(example.type) + ")");
  if (example.file) lines.push("request.data = open(" + JSON.stringify(example.file) + ", \"rb\").read()");
  lines.push("with urllib.request.urlopen(request) as answer:", "    print(answer.status, answer.read(200))");
  return lines.join("\n");
}

export function javascriptOf(origin, method, path, call, example, token) {
  const own = CALLS[call.operationId]?.[1];
  const lines = ["import { Penumbra } from " + JSON.stringify(origin + "/penumbra.js") + ";"];
  lines.push("const daemon = new Penumbra(" + JSON.stringify(origin) + (token ? ", { token: TOKEN }" : "") + ");");
  if (own) {
    lines.push("console.log(" + fillCall(own, example, "") + ");");
    return lines.join("\n");
  }
  const init = [];
  if (method !== "get") init.push("method: " + JSON.stringify(method.toUpperCase()));
  if (example.file) init.push("body: file");
  if (example.type) init.push("headers: { \"Content-Type\": " + JSON.stringify(example.type) + " }");
  lines.push("const answer = await daemon.call(" + JSON.stringify(fill(path, example.path).slice(1)) +
    (init.length ? ", { " + init.join(", ") + " }" : "") + ");");
  lines.push("console.log(answer.status, answer.headers.get(\"Content-Type\"));");
  return lines.join("\n");
}

export const LANGUAGES = [["curl", curl], ["Python", pythonOf], ["JavaScript", javascriptOf]];
