// A small render server around three.js in headless Chromium:
//     node three.mjs MODULES SCENES CHROMIUM [chromium options]
// MODULES holds node_modules with three and puppeteer-core, SCENES the .glb files. Prints
// {"port", "pid"}. POST /frame {"page": {query of three.html}, ...job} answers with a PNG; a page is
// opened when it is first asked for. POST /close closes all pages.
import fs from "node:fs";
import http from "node:http";
import { createRequire } from "node:module";
import os from "node:os";
import path from "node:path";
import { fileURLToPath } from "node:url";

const [modules, scenes, chromium, ...options] = process.argv.slice(2);
const here = path.dirname(fileURLToPath(import.meta.url));
const puppeteer = createRequire(path.join(path.resolve(modules), "x.js"))("puppeteer-core");
const TYPES = { ".html": "text/html", ".js": "text/javascript", ".glb": "model/gltf-binary" };
const profile = fs.mkdtempSync(path.join(os.tmpdir(), "penumbra-three-"));
const waiting = new Map();
const pages = new Map();
let jobs = 0;

const bodyOf = async (request) => {
  const parts = [];
  for await (const part of request) parts.push(part);
  return Buffer.concat(parts);
};

function file(where, response) {
  const root = where.startsWith("/node_modules/") ? modules : where.endsWith(".glb") ? scenes : here;
  const name = path.join(root, path.normalize(where));
  if (!fs.existsSync(name)) return response.writeHead(where === "/favicon.ico" ? 204 : 404).end();
  response.writeHead(200, { "content-type": TYPES[path.extname(name)] ?? "application/octet-stream" });
  fs.createReadStream(name).pipe(response);
}

const browser = await puppeteer.launch({
  executablePath: chromium, headless: true, userDataDir: profile, protocolTimeout: 3600000,
  args: ["--no-sandbox", "--no-first-run", "--disable-background-networking", "--disable-quic",
         "--disable-component-update", "--disable-sync", "--use-gl=angle", "--use-angle=gl-egl",
         "--ignore-gpu-blocklist", "--disable-background-timer-throttling",
         "--disable-renderer-backgrounding", "--disable-backgrounding-occluded-windows", ...options] });

async function pageOf(query) {
  const key = new URLSearchParams(query).toString();
  if (!pages.has(key)) {
    const page = await browser.newPage();
    page.on("pageerror", (error) => console.error("page:", String(error).slice(0, 1000)));
    page.on("console", (line) => {
      if (line.type() === "error") console.error("console:", line.text().slice(0, 1000));
    });
    await page.setViewport({ width: Number(query.width) + 50, height: Number(query.height) + 50 });
    await page.goto(`http://127.0.0.1:${server.address().port}/three.html?${key}`,
                    { timeout: 600000 });
    await page.waitForFunction("window.ready === true", { timeout: 600000, polling: 10 });
    const about = JSON.stringify(await page.evaluate(() => window.about));
    pages.set(key, { page, about });
  }
  return pages.get(key);
}

async function answer(request, response) {
  const url = new URL(request.url, "http://x");
  if (request.method === "GET") return file(decodeURIComponent(url.pathname), response);
  const body = await bodyOf(request);
  if (url.pathname === "/picture") {
    waiting.get(url.searchParams.get("job"))?.({ body, figures: url.searchParams });
    return response.writeHead(204).end();
  }
  if (url.pathname === "/close") {
    for (const { page } of pages.values()) await page.close();
    pages.clear();
    return response.writeHead(204).end();
  }
  const { page: query, ...job } = JSON.parse(body);
  const { page, about } = await pageOf(query);
  job.id = String(++jobs);
  const picture = new Promise((done) => waiting.set(job.id, done));
  const failed = page.evaluate((j) => window.frame(j), job).then(() => picture);
  const done = await Promise.race([picture, failed]);
  waiting.delete(job.id);
  response.writeHead(200, {
    "content-type": "image/png", "x-draw-ms": done.figures.get("draw_ms"),
    "x-encode-ms": done.figures.get("encode_ms"), "x-triangles": done.figures.get("triangles"),
    "x-about": about });
  response.end(done.body);
}

const server = http.createServer((request, response) => answer(request, response).catch((error) => {
  console.error(error);
  response.writeHead(500).end(String(error));
}));
server.keepAliveTimeout = 3600e3;
await new Promise((done) => server.listen(0, "127.0.0.1", done));
console.log(JSON.stringify({ port: server.address().port, pid: browser.process().pid }));

for (const signal of ["SIGTERM", "SIGINT"])
  process.on(signal, async () => {
    await Promise.race([browser.close(), new Promise((done) => setTimeout(done, 5000))]);
    browser.process()?.kill("SIGKILL");
    fs.rmSync(profile, { recursive: true, force: true, maxRetries: 5 });
    process.exit(0);
  });
