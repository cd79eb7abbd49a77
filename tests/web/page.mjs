// A page in Chromium, what goes wrong in it, what it asks the daemon for, and what its view tells.
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";

const packages = createRequire(process.env.PACKAGES + "/");
const { chromium } = packages("playwright-core");
const AXE = readFileSync(packages.resolve("axe-core/axe.min.js"), "utf8");
/** Besides the daemon and what was made for the test: where it is ended (/kill) and started (/start). */
export const { DAEMON, SCENE, SCENE_FILE, PICTURES, CONTROL } = process.env;
const PATIENCE_MS = Number(process.env.PATIENCE_MS);
let browser;

/** The page that was opened last. */
export let page;
/** Of that page: errors; renders that it asked for, that are under way, and the most at once; bytes
 * that came for each address. */
export let watched;

/** Opens a page in place of the last. */
export async function open(url, options = {}) {
  browser ??= await chromium.launch({ executablePath: process.env.CHROMIUM,
    args: ["--no-sandbox", "--disable-gpu"] });
  await page?.context().close();
  const context = await browser.newContext({ viewport: { width: 1280, height: 800 }, ...options });
  page = await context.newPage();
  page.setDefaultTimeout(PATIENCE_MS);
  const mine = watched = { problems: [], asked: [], under: new Set(), most: 0,
    bytes: new Map() };
  page.on("pageerror", reason => mine.problems.push(String(reason)));
  page.on("console", message => {
    const said = message.text() + " " + message.location().url;
    if (message.type() === "error" && !/net::ERR_|favicon/.test(said))
      mine.problems.push(said);
  });
  page.on("request", request => {
    if (request.method() !== "POST" || !request.url().endsWith("/render")) return;
    mine.asked.push(request.postDataJSON());
    mine.under.add(request);
    mine.most = Math.max(mine.most, mine.under.size);
  });
  for (const kind of ["requestfinished", "requestfailed"])
    page.on(kind, request => mine.under.delete(request));
  const tools = await context.newCDPSession(page), urls = new Map();
  await tools.send("Network.enable");
  tools.on("Network.requestWillBeSent", ({ requestId, request }) => urls.set(requestId, request.url));
  tools.on("Network.loadingFinished", ({ requestId, encodedDataLength }) =>
    mine.bytes.set(urls.get(requestId), encodedDataLength));
  await page.addInitScript(() => {
    globalThis.told = [];
    for (const kind of ["load", "timing", "error", "camerachange"])
      document.addEventListener(kind, ({ detail }) => detail && told.push({ kind, detail }), true);
  });
  await page.goto(url);
  return page;
}

export const close = () => browser?.close();

/** Waits until what `ask` resolves to is true, and returns it. */
export async function wait(ask, what) {
  for (const end = Date.now() + PATIENCE_MS; Date.now() < end;) {
    const value = await ask();
    if (value) return value;
    await page.waitForTimeout(20);
  }
  throw new Error("waited in vain for " + what);
}

/** Waits until something is true in the page, whose policy lets nobody wait there. */
export const until = (condition, given) => wait(() => page.evaluate(condition, given), condition);

/** The request of the next picture behind `from` events, once it is complete. */
export const loaded = (from = 0) => until(from => told.slice(from).find(t =>
  t.kind === "load" && t.detail.done)?.detail.record.request, from);
/** The request of a complete picture that a condition holds for. */
export const loadedWith = condition => wait(async () => (await page.evaluate(() => told.filter(t =>
  t.kind === "load" && t.detail.done).map(t => t.detail.record.request))).findLast(condition), condition);
/** Waits for a refusal behind `from` events, that is tried again or not. */
export const failed = (from, again) => until(([from, again]) => told.slice(from)
  .some(t => t.kind === "error" && t.detail.again === again), [from, again]);
/** What axe-core finds wrong with the page. */
export async function findings() {
  const { violations } = await page.evaluate(AXE + ";axe.run(document, { resultTypes: ['violations'] })");
  return violations.map(({ id, nodes }) => id + ": " + nodes.map(node => node.target.join(" ") + " " +
    node.any.concat(node.all).map(check => check.message).join(" ")).join(" | "));
}

/** Waits until no render is under way any more. */
export const idle = () => wait(() => watched.under.size === 0, "the end of all renders");
/** How many events there were. */
export const count = () => page.evaluate(() => told.length);
/** The picture that is shown, as text. */
export const shown = () => page.evaluate(() => document.querySelector("penumbra-view").shadowRoot
  .querySelector("canvas").toDataURL());
/** The address of the viewer in a state. */
export const viewer = state => DAEMON + "/#" + new URLSearchParams(Object.entries(state).map(
  ([key, value]) => [key, typeof value === "string" ? value : JSON.stringify(value)]));
