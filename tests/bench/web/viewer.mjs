// What the viewer promises, measured in Chromium against a daemon that is running: bytes of the first
// load, when it is interactive, pictures a second while it is turned, input to picture, the chart.
//
// usage: PACKAGES=build/dev/web node tests/bench/web/viewer.mjs http://127.0.0.1:8080 SCENE
// PACKAGES is the folder in which the tests of tests/web keep what npm gave them. A quiet machine.
import { createRequire } from "node:module";

const [server, scene] = process.argv.slice(2), SECONDS = 6;
if (!process.env.PACKAGES || !scene) {
  console.error("usage: PACKAGES=build/dev/web node tests/bench/web/viewer.mjs SERVER SCENE");
  process.exit(2);
}
const { chromium } = createRequire(process.env.PACKAGES + "/")("playwright-core");
const browser = await chromium.launch({ executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
  args: ["--no-sandbox", "--disable-gpu"] });
// The page's policy lets nobody wait in it.
const context = await browser.newContext({ viewport: { width: 1440, height: 900 }, bypassCSP: true });
const page = await context.newPage(), tools = await context.newCDPSession(page), urls = new Map();
page.setDefaultTimeout(300000);
let bytes = 0, failed = false;
await tools.send("Network.enable");
tools.on("Network.requestWillBeSent", ({ requestId, request }) => urls.set(requestId, request.url));
tools.on("Network.loadingFinished", ({ requestId, encodedDataLength }) => {
  if (!/\/(render|results|thumbnail)/.test(urls.get(requestId))) bytes += encodedDataLength;
});
await page.addInitScript(() => {
  Object.assign(globalThis, { inputs: [], sent: [], shown: [], full: [], ready: 0 });
  const ask = fetch;
  globalThis.fetch = (url, options) => {
    if (/\/render$/.test(url) && /"jpeg"/.test(options?.body ?? "")) sent.push(performance.now());
    return ask(url, options);
  };
  document.addEventListener("timing", ({ target, detail }) => {
    if (target.id !== "view") return;
    const now = performance.now();
    if (detail.brief) shown.push({ now, sent: sent.at(-1) });
    else full.push({ now, ms: detail.ms });
  }, true);
  document.addEventListener("camerachange", ({ detail }) => detail.user && inputs.push(performance.now()), true);
  const look = () => document.querySelectorAll("#technique option").length > 1 ? ready = performance.now() :
    requestAnimationFrame(look);
  requestAnimationFrame(look);
});

const rank = (values, share) => values.toSorted((a, b) => a - b)[Math.min(values.length - 1,
  Math.floor(share * values.length))];
function say(what, value, unit, bound, atLeast = false) {
  const holds = atLeast ? value >= bound : value <= bound;
  failed ||= bound !== undefined && !holds;
  console.log(what.padEnd(52) + value.toFixed(unit === "s" || unit === "/s" ? 1 : 0).padStart(8) + " " + unit +
    (bound === undefined ? "" : "  " + (holds ? "holds" : "MISSED") + ": at " + (atLeast ? "least " : "most ") + bound));
}

await page.goto(server + "/#scene=" + scene + "&width=480&height=360&technique=pcss");
await page.waitForFunction(() => full.length && ready);
say("first load over the wire, without pictures", bytes / 1024, "KiB", 200);
say("interactive", await page.evaluate(() => ready), "ms", 1000);
say("first full picture", await page.evaluate(() => full[0].now), "ms");

const box = await page.locator("#view").boundingBox();
const [x, y] = [box.x + box.width * 0.7, box.y + box.height / 2];
await page.evaluate(() => { inputs.length = sent.length = shown.length = full.length = 0; });
await page.mouse.move(x, y);
await page.mouse.down();
for (let i = 0, begun = Date.now(); Date.now() - begun < SECONDS * 1000; i++) {
  await page.mouse.move(x + 150 * Math.sin(i / 40), y + 20 * Math.sin(i / 23));
  await page.waitForTimeout(8);
}
const released = await page.evaluate(() => performance.now());
await page.mouse.up();
await page.waitForFunction(() => full.length);
const seen = await page.evaluate(() => ({ inputs, shown, full }));
const latest = seen.shown.map(({ now, sent }) => now - seen.inputs.findLast(input => input <= sent));
const every = seen.inputs.map(input => seen.shown.find(({ sent }) => sent >= input)?.now - input)
  .filter(Number.isFinite);
say("pictures while it is turned, 480 x 360", seen.shown.length / SECONDS, "/s", 15, true);
say("newest input to the picture that has it, median", rank(latest, 0.5), "ms");
say("the same, 95 %", rank(latest, 0.95), "ms", 120);
say("any input to a picture that has it, 95 %", rank(every, 0.95), "ms");
say("full picture after release", seen.full[0].now - released, "ms");
say("of that its own time", seen.full[0].ms, "ms");

await page.goto(server + "/#scene=" + scene + "&width=400&height=300&technique=pcss");
await page.reload();
await page.waitForFunction(() => full.length);
const begun = Date.now();
await page.locator(".unmeasured button").click();
await page.waitForFunction(() => /against/.test(document.querySelector("#panel-chart .note").textContent));
say("chart of " + await page.locator(".point").count() + " methods, 400 x 300", (Date.now() - begun) / 1000, "s", 20);
await browser.close();
process.exit(failed ? 1 : 0);
