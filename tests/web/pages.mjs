// Pages of another origin, ORIGIN, opened in Chromium; for the tests of the element.
import { createServer } from "node:http";
import { createRequire } from "node:module";

const { chromium } = createRequire(process.env.PACKAGES + "/")("playwright-core");
export const PATIENCE_MS = Number(process.env.PATIENCE_MS);
let browser, server, served = "";
export let page, problems;

export async function begin() {
  browser = await chromium.launch({ executablePath: process.env.CHROMIUM,
    args: ["--no-sandbox", "--disable-gpu"] });
  server = createServer((request, response) => {
    response.setHeader("Content-Type", "text/html");
    response.end(request.url === "/" ? served : "");
  });
  await new Promise(resolve => server.listen(new URL(process.env.ORIGIN).port, "127.0.0.1", resolve));
}

export async function end() {
  await browser?.close();
  server?.close();
}

/** Opens a page with this in its body. What elements tell is kept in `told`. */
export async function open(body, options = {}) {
  served = "<!doctype html><html lang=en><meta charset=utf-8><title>other</title>" +
    "<style>penumbra-view { width: 320px; height: 240px }</style><body>" + body;
  await page?.context().close();
  page = await (await browser.newContext({ viewport: { width: 900, height: 700 }, ...options })).newPage();
  page.setDefaultTimeout(PATIENCE_MS);
  problems = [];
  page.on("pageerror", reason => problems.push(String(reason)));
  page.on("console", message => message.type() === "error" && problems.push(message.text()));
  await page.addInitScript(() => {
    globalThis.told = [];
    for (const kind of ["load", "timing", "error", "camerachange"])
      document.addEventListener(kind, ({ detail }) => detail && told.push({ kind, detail }), true);
  });
  await page.goto(process.env.ORIGIN + "/");
}

/** Waits until something is true in the page. */
export async function until(condition, given) {
  for (const end = Date.now() + PATIENCE_MS; Date.now() < end;) {
    const value = await page.evaluate(condition, given);
    if (value) return value;
    await page.waitForTimeout(20);
  }
  throw new Error("waited in vain; " + JSON.stringify(problems) + await page.evaluate(() =>
    JSON.stringify(told.slice(-3).map(({ kind, detail }) => [kind, String(detail.error ?? "")]))));
}

export const count = () => page.evaluate(() => told.length);
/** The request of the next complete picture behind `from` events. */
export const loaded = (from = 0) => until(from => told.slice(from).find(t =>
  t.kind === "load" && t.detail.done)?.detail.record.request, from);
export const view = given => page.locator("penumbra-view " + given);
