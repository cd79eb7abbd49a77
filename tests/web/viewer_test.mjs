// The viewer at / in Chromium, used as people use it.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { after, test } from "node:test";
import { join } from "node:path";
import { CONTROL, DAEMON, PICTURES, SCENE, close, count, loaded, open, page, shown, until,
  watched } from "./page.mjs";

after(close);

const AXE = readFileSync(createRequire(process.env.PACKAGES + "/").resolve("axe-core/axe.min.js"), "utf8");
const SMALL = "scene=" + SCENE + "&width=64&height=48";
const PHONE = { viewport: { width: 390, height: 844 }, hasTouch: true, isMobile: true };
const LOOKS = [["desktop", { colorScheme: "light", viewport: { width: 1440, height: 900 } }],
  ["dark", { colorScheme: "dark", viewport: { width: 1440, height: 900 } }],
  ["phone", { colorScheme: "light", ...PHONE }], ["phone-dark", { colorScheme: "dark", ...PHONE }]];
const at = state => DAEMON + "/#" + state;
const text = selector => page.locator(selector).textContent();
const picture = name => page.screenshot({ path: join(PICTURES, "viewer-" + name + ".png") });

/** What axe-core finds wrong with the page. */
async function findings() {
  const { violations } = await page.evaluate(AXE + ";axe.run(document, { resultTypes: ['violations'] })");
  return violations.map(({ id, nodes }) => id + ": " + nodes.map(node => node.target.join(" ") + " " +
    node.any.concat(node.all).map(check => check.message).join(" ")).join(" | "));
}

for (const [name, options] of LOOKS)
  test("the viewer, " + name, async () => {
    await open(at("scene=" + SCENE), options);
    assert.equal((await loaded()).technique.name, "pcss");
    await until(() => [...document.images].every(image => image.complete || !image.checkVisibility()));
    assert.equal(await page.evaluate(() => document.documentElement.scrollWidth - innerWidth), 0);
    await until(() => document.querySelector(".passes li"));
    await until(() => document.querySelector(".state[data-kind=good]"));
    await picture(name);
    const from = await count();
    await page.locator("#technique").selectOption("hard");
    assert.equal((await loaded(from)).technique.name, "hard");
    assert.match(page.url(), /technique=hard/);
    await page.goBack();
    await until(() => document.querySelector("#technique").value === "pcss");
    assert.deepEqual(await findings(), []);
    assert.deepEqual(watched.problems, []);
  });

test("the first load is small, and all of it from the daemon", async () => {
  await open(at("scene=" + SCENE));
  await loaded();
  assert.ok([...watched.bytes.keys()].every(url => url.startsWith(DAEMON) || /^(data|blob):/.test(url)),
    [...watched.bytes.keys()].join(" "));
  const viewer = [...watched.bytes].filter(([url]) => !/\/(render|results|thumbnail)/.test(url));
  const sum = viewer.reduce((all, [, bytes]) => all + bytes, 0);
  assert.ok(viewer.length > 20 && sum < 200 * 1024, sum + " bytes");
});

test("its state is the address: reload and share show the same", async () => {
  await open(at(SMALL + "&technique=vsm"));
  const request = await loaded();
  assert.deepEqual([request.technique.name, request.width, request.height], ["vsm", 64, 48]);
  const param = page.locator("#panel-method .field", { hasText: "map size" });
  let from = await count();
  await param.locator("input").fill("256");
  await param.locator("input").press("Enter");
  assert.equal((await loaded(from)).technique.params.map_size, 256);
  await until(() => /256/.test(location.hash));
  await page.reload();
  assert.equal((await loaded()).technique.params.map_size, 256);
  from = await count();
  await param.locator("label").dblclick(); // back to the default
  assert.equal((await loaded(from)).technique.params.map_size, request.technique.params.map_size);
  await until(() => !/256/.test(location.hash));
});

test("keys choose methods, frame, compare and tell of themselves", async () => {
  await open(at(SMALL));
  await loaded();
  const names = await page.locator("#technique option").evaluateAll(options => options.map(o => o.value));
  let from = await count();
  await page.keyboard.press("2");
  assert.equal((await loaded(from)).technique.name, names[1]);
  await page.locator("#view canvas").focus();
  from = await count();
  await page.keyboard.press("ArrowLeft");
  await loaded(from);
  await until(() => /camera=/.test(location.hash));
  from = await count();
  await page.keyboard.press("f");
  await loaded(from);
  assert.doesNotMatch(page.url(), /camera=/);
  await page.keyboard.press("?");
  assert.match(await text("dialog"), /1 to 9/);
  assert.deepEqual(await findings(), []);
  await page.keyboard.press("Escape");
  await page.keyboard.press("c");
  await until(() => /b=raytraced/.test(location.hash));
});

test("two methods are wiped, blinked and mapped", async () => {
  await open(at(SMALL + "&technique=hard&b=raytraced"));
  await until(() => told.some(t => t.kind === "load" && t.detail.done &&
    t.detail.record.request.technique.name === "raytraced"));
  await until(() => !document.querySelector(".comparison.waiting"));
  const cut = () => page.evaluate(() => getComputedStyle(document.querySelector(".comparison .b")).clipPath);
  const frame = await page.locator(".comparison").boundingBox();
  await page.mouse.move(frame.x + frame.width / 2, frame.y + 60);
  await page.mouse.down();
  await page.mouse.move(frame.x + frame.width / 4, frame.y + 60);
  await page.mouse.up();
  assert.equal(await page.locator(".wipe").getAttribute("aria-valuenow"), "25");
  assert.match(await cut(), /25%/);
  await picture("wipe");
  await page.keyboard.down("b");
  assert.equal(await cut(), "none");
  await page.keyboard.up("b");
  assert.match(await cut(), /25%/);
  for (const [name, legend] of [["Difference", /too dark.*too light/], ["SSIM", /1 alike/], ["FLIP", /0 equal/]]) {
    await page.getByRole("button", { name, exact: true }).click();
    await until(() => !document.querySelector(".comparison.waiting") &&
      document.querySelector(".comparison .map:not([hidden])")?.naturalWidth === 64);
    assert.match(await text(".comparison .legend-box"), legend);
    assert.match(await text(".comparison .legend-box"), /RMSE .\d+ · SSIM .* · FLIP/);
    await picture("map-" + name.toLowerCase());
  }
  assert.deepEqual(await findings(), []);
  assert.deepEqual(watched.problems, []);
});

test("layers have a scale", async () => {
  await open(at(SMALL + "&technique=raytraced"));
  await loaded();
  const layer = page.locator("#panel-output .field", { hasText: "layer" }).locator("select");
  await until(() => document.querySelectorAll("#panel-output select")[0].options.length > 5);
  for (const [name, legend] of [["penumbra", /0 lit.*1 penumbra.*2 umbra/], ["classes", /undecided/],
    ["error", /standard error/]]) {
    const from = await count();
    await layer.selectOption(name);
    assert.equal((await loaded(from)).output.layer, name);
    assert.match(await text(".layer-legend"), legend);
  }
  await layer.selectOption("beauty");
  await until(() => document.querySelector(".layer-legend").hidden);
});

test("a download is the picture in the format that is asked for", async () => {
  await open(at(SMALL + "&format=webp"));
  await loaded();
  const [file] = await Promise.all([page.waitForEvent("download"),
    page.getByRole("button", { name: "Download" }).click()]);
  assert.equal(file.suggestedFilename(), "penumbra.webp");
  assert.equal(readFileSync(await file.path()).subarray(8, 12).toString(), "WEBP");
});

test("an error keeps the last good picture and says what to do", async () => {
  await open(at(SMALL));
  await loaded();
  const before = await shown();
  await page.evaluate(() => { location.hash += "&params=" + encodeURIComponent('{"nothing_like_it":1}'); });
  await until(() => !document.querySelector(".notice").hidden);
  assert.match(await text(".notice"), /nothing_like_it/);
  assert.equal(await shown(), before);
  await page.goBack();
  await until(() => document.querySelector(".notice").hidden);
});

test("the daemon's end is said, its return needs no reload", async () => {
  await open(at(SMALL));
  await loaded();
  await until(() => document.querySelector(".state[data-kind=good]"));
  await fetch(CONTROL + "/kill");
  await until(() => !document.querySelector(".notice").hidden);
  assert.match(await text(".notice"), /does not answer.*Trying again/);
  assert.equal(await page.locator(".state").getAttribute("data-kind"), "bad");
  await picture("away");
  const from = await count();
  await page.locator("#technique").selectOption("hard");
  await fetch(CONTROL + "/start");
  assert.equal((await loaded(from)).technique.name, "hard");
  await until(() => document.querySelector(".notice").hidden &&
    document.querySelector(".state[data-kind=good]"));
});
