// The viewer's chart of error against time, beside what penumbra compare prints.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { after, test } from "node:test";
import { join } from "node:path";
import { DAEMON, PICTURES, SCENE, close, count, loaded, open, page, until } from "./page.mjs";

after(close);

const SMALL = "scene=" + SCENE + "&width=64&height=48";
const at = state => DAEMON + "/#" + state;
const text = selector => page.locator(selector).textContent();
const picture = name => page.screenshot({ path: join(PICTURES, "viewer-" + name + ".png") });
const measured = () => until(() => /against/.test(document.querySelector("#panel-chart .note").textContent));

test("the chart's figures are those of penumbra compare, its front is the best so far", async () => {
  await open(at(SMALL));
  await loaded();
  await page.locator(".unmeasured button").click();
  await until(() => document.querySelector(".point")); // it fills in
  assert.match(await text("#panel-chart .note"), /\d+ of \d+/);
  await measured();
  const points = await page.locator(".point").evaluateAll(points => points.map(point => ({
    name: point.dataset.name, says: point.getAttribute("aria-label"), today: point.classList.contains("today"),
    best: point.classList.contains("best"), x: point.lastChild.cx.baseVal.value, y: point.lastChild.cy.baseVal.value })));
  const told = JSON.parse(execFileSync(process.env.CLIENT, ["compare", SCENE, "--server", DAEMON, "--json-record",
    "--width", "64", "--height", "48", "--deadline-ms", "3600000"], { maxBuffer: 1 << 26 }));
  const figures = told.methods.filter(method => method.rmse_penumbra > 0);
  assert.deepEqual(points.map(point => point.name).sort(), figures.map(m => m.technique.name).sort());
  assert.ok(points.length >= 20);
  for (const { technique: { name }, rmse_penumbra: error } of figures) {
    const said = points.find(point => point.name === name).says.match(/error ([\d.e-]+)/)[1];
    assert.ok(Math.abs(Number(said) - error) <= 0.06 * error, name + ": " + said + " is not " + error);
  }
  // To the left of a point of the front nothing lies lower (y grows downwards).
  for (const point of points)
    assert.equal(point.best, !points.some(other => other !== point && other.x <= point.x && other.y >= point.y), point.name);
  assert.deepEqual(points.filter(point => point.today).map(point => point.name), ["pcss"]);
  await picture("chart");
});

test("a point shows its picture, is taken by a click, and the chart is grey for another view", async () => {
  const point = page.locator(".point[data-name=hard] .dot");
  await point.hover();
  await until(() => document.querySelector(".tip img")?.naturalWidth === 64);
  assert.match(await text(".tip"), /RMSE/);
  await picture("tip");
  const from = await count();
  await point.click();
  assert.equal((await loaded(from)).technique.name, "hard");
  await until(() => document.querySelector(".point.today").dataset.name === "hard");
  assert.equal(await page.locator(".chart-body.stale").count(), 0);
  await page.locator("#panel-scene .field", { hasText: "sky intensity" }).locator("input").fill("2");
  await until(() => document.querySelector(".chart-body.stale"));
  assert.match(await text("#panel-chart .note"), /another view/);
  await page.goBack(); // the method
  await page.locator("#panel-chart [tabindex='0']").first().focus();
  await page.keyboard.press("ArrowRight");
  await page.keyboard.press("Enter");
  await until(() => document.activeElement.getAttribute("aria-pressed") === "true");
});
