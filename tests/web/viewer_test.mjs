// The viewer at / in Chromium, used as people use it.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { after, test } from "node:test";
import { join } from "node:path";
import { CONTROL, DAEMON, PICTURES, SCENE, close, count, findings, idle, loaded, open, page, shown, until,
  watched } from "./page.mjs";

after(close);

const SMALL = "scene=" + SCENE + "&width=64&height=48";
const PHONE = { viewport: { width: 390, height: 844 }, hasTouch: true, isMobile: true };
const LOOKS = [["desktop", { colorScheme: "light", viewport: { width: 1440, height: 900 } }],
  ["dark", { colorScheme: "dark", viewport: { width: 1440, height: 900 } }],
  ["phone", { colorScheme: "light", ...PHONE }], ["phone-dark", { colorScheme: "dark", ...PHONE }]];
const at = state => DAEMON + "/#" + state;
const text = selector => page.locator(selector).textContent();
const picture = name => page.screenshot({ path: join(PICTURES, "viewer-" + name + ".png") });

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

test("100 fast changes of method leave no request behind, and end with the right picture", async () => {
  await open(at(SMALL));
  await loaded();
  const names = await page.locator("#technique option").evaluateAll(options => options.map(o => o.value));
  const from = await count();
  for (let i = 0; i < 99; i++) await page.keyboard.press(String(1 + i % 4));
  await page.keyboard.press("4");
  await until(([from, name]) => told.slice(from).some(t => t.kind === "load" && t.detail.done &&
    t.detail.record.request.technique.name === name), [from, names[3]]);
  await page.waitForTimeout(300); // for what should not come
  await idle();
  const last = await page.evaluate(() => told.findLast(t => t.kind === "load").detail.record.request);
  assert.equal(last.technique.name, names[3]);
  assert.equal(await page.locator("#technique").inputValue(), names[3]);
  assert.equal(watched.under.size, 0);
  assert.ok(watched.most <= 2, watched.most + " at once");
});

test("the picture is never blank, gets better in sight, and says how good it is", async () => {
  await open(at("scene=" + SCENE + "&width=240&height=180&technique=raytraced"));
  await loaded();
  await page.evaluate(() => {
    globalThis.blank = 0;
    globalThis.frames = 0;
    const canvas = document.querySelector("#view").shadowRoot.querySelector("canvas");
    const look = () => {
      const { width, height } = canvas;
      if (canvas.getContext("2d").getImageData(width >> 1, height >> 1, 1, 1).data[3] !== 255) blank++;
      frames++;
      requestAnimationFrame(look);
    };
    look();
  });
  const box = await page.locator("#view").boundingBox();
  await page.mouse.move(box.x + box.width / 2, box.y + box.height * 0.6);
  await page.mouse.down();
  for (let step = 1; step <= 15; step++) await page.mouse.move(box.x + box.width / 2 + 6 * step, box.y + box.height * 0.6);
  const from = await count();
  await page.mouse.up();
  await loaded(from);
  await page.keyboard.press("4");
  await until(() => told.at(-1).kind === "timing");
  assert.ok(await page.evaluate(() => frames) > 5);
  assert.equal(await page.evaluate(() => blank), 0);
  await page.locator("#technique").selectOption("raytraced");
  const samples = page.locator("#panel-method .field", { hasText: "samples" }).locator("input");
  const before = await count();
  await samples.fill("512");
  await samples.press("Enter");
  await until(from => told.slice(from).some(t => t.kind === "load" && t.detail.done &&
    t.detail.record.request.technique.params.samples === 512), before);
  assert.match(await text(".facts"), /512 of 512 samples± \.\d+240 × 180/);
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
    page.locator("#panel-output").getByRole("button", { name: "Download" }).click()]);
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
