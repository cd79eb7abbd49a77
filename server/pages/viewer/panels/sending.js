// Files on their way to the daemon: what was dropped, how much is sent, what became of it.
import { Penumbra } from "../../penumbra.js";

/** The files of a drop, those of folders with their paths. */
export async function dropped(transfer) {
  const entries = [...transfer.items].map(item => item.webkitGetAsEntry?.()).filter(Boolean);
  if (!entries.some(entry => entry.isDirectory)) return [...transfer.files];
  return (await Promise.all(entries.map(entry => filesOf(entry)))).flat();
}

async function filesOf(entry, folder = "") {
  const path = folder + entry.name;
  if (entry.isFile) {
    const file = await new Promise((resolve, reject) => entry.file(resolve, reject));
    // What the client sends as its name, as of a folder that was chosen.
    if (folder) Object.defineProperty(file, "webkitRelativePath", { value: path });
    return [file];
  }
  const reader = entry.createReader(), inside = [];
  for (;;) { // in pieces of a hundred
    const some = await new Promise((resolve, reject) => reader.readEntries(resolve, reject));
    if (!some.length) break;
    inside.push(...some);
  }
  return (await Promise.all(inside.map(child => filesOf(child, path + "/")))).flat();
}

/** Files that are a scene each, or together: lists of files. */
export function asScenes(files) {
  const whole = files.filter(({ name }) => /\.(glb|zip)$/i.test(name));
  const parts = files.filter(file => !whole.includes(file));
  if (parts.some(({ name }) => /\.gltf$/i.test(name))) return [files];
  return whole.length ? whole.map(file => [file]) : [files];
}

/** A name for what is sent. */
export const nameOf = files => files.find(({ name }) => /\.(gltf|glb|zip)$/i.test(name))?.name ??
  files[0]?.name ?? "scene";

/** `fetch` for one request that tells how much of its body is sent: fetch itself does not. */
function counting(tell) {
  return (url, { method, headers, body, signal }) => new Promise((resolve, reject) => {
    const request = new XMLHttpRequest();
    request.open(method, url);
    for (const [name, value] of headers) request.setRequestHeader(name, value);
    request.responseType = "blob";
    request.upload.addEventListener("progress", ({ loaded, total }) => tell(loaded, total));
    request.upload.addEventListener("load", ({ loaded }) => tell(loaded, loaded));
    request.addEventListener("error", () => reject(new TypeError("the connection broke off")));
    request.addEventListener("abort", () => reject(signal.reason));
    request.addEventListener("load", () => {
      const lines = request.getAllResponseHeaders().trim().split(/\r?\n/).filter(Boolean);
      resolve(new Response(request.response, { status: request.status, statusText: request.statusText,
        headers: lines.map(line => [line.slice(0, line.indexOf(":")), line.slice(line.indexOf(":") + 1).trim()]) }));
    });
    signal?.addEventListener("abort", () => request.abort());
    if (signal?.aborted) return reject(signal.reason);
    request.send(body);
  });
}

/**
 * Uploads a scene; `tell(sent, total)` hears of bytes, and from `sent` equal to `total` on the daemon
 * imports it.
 */
export function send(files, { token, signal, tell, name }) {
  return new Penumbra(undefined, { token, retries: 0, fetch: counting(tell) })
    .upload(files, { signal, name });
}
