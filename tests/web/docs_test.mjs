// The API page in Chromium. What its examples are is left in EXAMPLES, to be run by others.
import assert from "node:assert/strict";
import { readFileSync, writeFileSync } from "node:fs";
import { createRequire } from "node:module";
import { after, before, test } from "node:test";
import { join } from "node:path";

const require = createRequire(process.env.PACKAGES + "/"), { chromium } = require("playwright-core");
const { DAEMON, LOCKED, TOKEN, PICTURES } = process.env, PATIENCE_MS = Number(process.env.PATIENCE_MS);
let browser, page, problems;

before(async () => {
  browser = await chromium.launch({ executablePath: process.env.CHROMIUM,
    args: ["--no-sandbox", "--disable-gpu"] });
});
after(() => browser?.close());

async function open(url, options = {}) {
  await page?.context().close();
  page = await (await browser.newContext({ viewport: { width: 1400, height: 900 }, ...options })).newPage();
  page.setDefaultTimeout(PATIENCE_MS);
  problems = [];
  page.on("pageerror", reason => problems.push(String(reason)));
  page.on("console", message => message.type() === "error" && !/401/.test(message.text()) &&
    problems.push(message.text()));
  page.on("request", request => {
    if (!request.url().startsWith(new URL(url).origin) && !/^(blob|data):/.test(request.url()))
      problems.push("asks another host: " + request.url());
  });
  await page.goto(url);
  await page.waitForSelector("#startSequence");
}
const visible = () => page.locator("main article:visible").evaluateAll(all => all.map(a => a.id));

test("every operation and method is there, found by its words, and nothing is asked elsewhere", async () => {
  const answer = await open(DAEMON + "/docs");
  void answer;
  const api = await (await fetch(DAEMON + "/openapi.json")).json();
  const { techniques } = await (await fetch(DAEMON + "/v1/techniques")).json();
  const wanted = [...Object.values(api.paths).flatMap(path => Object.values(path).map(call => call.operationId)),
    ...techniques.map(t => "method-" + t.name)];
  await page.waitForSelector("#method-" + techniques.at(-1).name);
  assert.deepEqual((await visible()).sort(), wanted.sort());
  await page.keyboard.press("/");
  await page.keyboard.type("thumb");
  assert.deepEqual(await visible(), ["getThumbnail"]);
  assert.equal(await page.locator("main > h2:visible").count(), 1);
  await page.locator("#search").fill("filter_taps pcss");
  assert.ok((await visible()).includes("method-pcss"));
  await page.locator("#search").fill("nothing like it");
  assert.match(await page.locator("#status").textContent(), /Nothing/);
  await page.locator("#search").fill("");
  assert.deepEqual(problems, []);
});

test("a schema opens to its leaves", async () => {
  await page.locator("#renderScene summary", { hasText: "RenderRequest" }).click();
  const camera = page.locator("#renderScene tr", { has: page.locator("td > code", { hasText: /^camera$/ }) }).first();
  await camera.locator("summary").first().click();
  assert.ok(await camera.locator("code", { hasText: "fov_y_deg" }).first().isVisible());
});

test("a call is tried: its picture, its refusal, its file", async () => {
  const article = page.locator("#renderScene");
  await article.locator(".try > summary").click();
  await article.locator(".send").click();
  await article.locator(".result img").waitFor();
  assert.match(await article.locator(".result p").first().textContent(), /^200 /);
  await article.locator("textarea").fill('{"width": 0}');
  await article.locator(".send").click();
  await article.locator(".failed").waitFor();
  assert.match(await article.locator(".result").textContent(), /422[^]*\/width/);
  const upload = page.locator("#uploadScene");
  await upload.locator(".try > summary").click();
  await upload.locator("input[type=file]").setInputFiles({ name: "a.glb", mimeType: "", buffer: readFileSync(process.env.GLB) });
  await upload.locator(".send").click();
  await upload.locator(".result pre").waitFor();
  assert.match(await upload.locator(".result").textContent(), /20[01] [^]*"triangles"/);
  const live = page.locator("#watchService");
  await live.locator(".try > summary").click();
  await live.locator(".send").click();
  await live.locator(".result pre").waitFor();
  assert.match(await live.locator(".result pre").textContent(), /event: stats/);
  problems = problems.filter(said => !/status of 422/.test(said));
  assert.deepEqual(problems, []);
});

test("examples in three languages, chosen for all at once, by keys too", async () => {
  const examples = {};
  for (const [number, name] of ["curl", "Python", "JavaScript"].entries()) {
    await page.locator("#getScene [role=tab]").nth(number).click();
    examples[name] = await page.locator("article .samples").evaluateAll(all => Object.fromEntries(all.map(
      sample => [sample.closest("article").id, sample.querySelector("pre").textContent])));
  }
  assert.equal(await page.locator("#getJob [role=tab][aria-selected=true]").textContent(), "JavaScript");
  await page.locator("#getScene [role=tab]").nth(2).press("ArrowRight");
  assert.equal(await page.locator("#getJob [role=tab][aria-selected=true]").textContent(), "curl");
  writeFileSync(process.env.EXAMPLES, JSON.stringify(examples));
});

test("where tokens are asked for the page is the same, and sends one", async () => {
  await open(LOCKED + "/docs");
  await page.locator("#token").fill(TOKEN);
  await page.locator("#token").press("Enter");
  await page.waitForSelector("#method-pcss");
  assert.match(await page.locator("#getScene pre").first().textContent(), /PENUMBRA_TOKEN/);
  await page.locator("#getService .try > summary").click();
  await page.locator("#getService .send").click();
  await page.locator("#getService .result pre").waitFor();
  assert.match(await page.locator("#getService .result p").first().textContent(), /^200 /);
  assert.deepEqual(problems, []);
});

for (const [name, options] of [["desktop", { colorScheme: "light" }], ["dark", { colorScheme: "dark" }],
  ["phone", { viewport: { width: 390, height: 844 } }]])
  test("no barriers, " + name, async () => {
    await open(DAEMON + "/docs#renderScene", options);
    await page.waitForSelector("#method-pcss");
    assert.equal(await page.evaluate(() => document.documentElement.scrollWidth - innerWidth), 0);
    await page.screenshot({ path: join(PICTURES, "docs-" + name + ".png") });
    const source = readFileSync(require.resolve("axe-core/axe.min.js"), "utf8");
    await page.evaluate(source);
    const found = await page.evaluate(() => axe.run(document, { resultTypes: ["violations"] }));
    assert.deepEqual(found.violations.map(v => [v.id, v.nodes[0].html.slice(0, 200), v.nodes.length]), []);
  });
