// penumbra-view in a page of another origin, in Chromium.
import assert from "node:assert/strict";
import { createServer } from "node:http";
import { after, before, test } from "node:test";
import { DAEMON, SCENE, close, count, failed, idle, loaded, open, page, shown, until,
  watched } from "./page.mjs";

let server;

const MARKUP = `<!doctype html><html lang="en"><title>other</title>
<style>penumbra-view { width: 480px; height: 360px }</style>
<script type="module" src="${DAEMON}/penumbra-view.js"></script>
<penumbra-view server="${DAEMON}" scene="${SCENE}" technique="hard" orbit></penumbra-view></html>`;

before(async () => {
  server = createServer((request, response) => {
    response.setHeader("Content-Type", "text/html");
    response.setHeader("Content-Security-Policy",
      `default-src 'none'; style-src 'unsafe-inline'; script-src ${DAEMON}; connect-src ${DAEMON}`);
    response.end(MARKUP);
  });
  await new Promise(resolve => server.listen(0, "127.0.0.1", resolve));
});

after(async () => {
  await close();
  server.close();
});

const other = options => open("http://127.0.0.1:" + server.address().port, options);

const set = given => page.evaluate(given =>
  void Object.assign(document.querySelector("penumbra-view"), given), given);

test("two lines show a picture in a page of another origin, whose policy is strict", async () => {
  await other();
  const request = await loaded();
  assert.deepEqual([request.width, request.height, request.technique.name], [480, 360, "hard"]);
  const colours = await page.evaluate(() => {
    const canvas = document.querySelector("penumbra-view").shadowRoot.querySelector("canvas");
    const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
    return new Set(new Uint32Array(data.buffer)).size;
  });
  assert.ok(colours > 100);
  assert.deepEqual(watched.problems, []);
});

test("dragging turns it in small pictures, then comes the full one, lit the same", async () => {
  const first = await loaded(), before = await shown(), from = await count();
  await page.mouse.move(240, 180);
  await page.mouse.down();
  for (let step = 1; step <= 20; step++) await page.mouse.move(240 + 5 * step, 180);
  await page.mouse.up();
  const last = await loaded(from);
  assert.notDeepEqual(last.camera.eye, first.camera.eye);
  assert.deepEqual([last.lights, last.width], [first.lights, 480]);
  const azimuth = ({ eye, target }) => Math.atan2(eye[0] - target[0], eye[2] - target[2]);
  const turned = ((azimuth(first.camera) - azimuth(last.camera)) * 180 / Math.PI + 360) % 360;
  assert.ok(Math.abs(turned - 180 * 100 / 360) < 0.1, turned + " degrees"); // 100 of 360 px
  assert.ok(watched.asked.some(request => request.width < 480));
  assert.ok(watched.most <= 2, watched.most + " at once"); // one that is being aborted, and its successor
  assert.notEqual(await shown(), before);
});

test("keys turn, and Home returns", async () => {
  const home = await page.evaluate(() =>
    told.find(t => t.kind === "load").detail.record.request.camera);
  await page.locator("penumbra-view canvas").focus();
  let from = await count();
  await page.keyboard.press("ArrowLeft");
  assert.notDeepEqual((await loaded(from)).camera.eye, home.eye);
  from = await count();
  await page.keyboard.press("Home");
  const { eye } = (await loaded(from)).camera;
  eye.forEach((value, axis) => assert.ok(Math.abs(value - home.eye[axis]) < 1e-4));
});

test("100 fast changes leave no request behind and end with the right picture", async () => {
  const from = await count();
  await page.evaluate(async () => {
    const view = document.querySelector("penumbra-view");
    for (let i = 0; i < 100; i++) {
      view.technique = i === 99 ? "pcss" : i % 2 ? "hard" : "none";
      await new Promise(resolve => setTimeout(resolve, 3));
    }
  });
  await until(from => told.slice(from).some(t =>
    t.kind === "load" && t.detail.done && t.detail.record.request.technique.name === "pcss"), from);
  await page.waitForTimeout(300); // for what should not come
  await idle();
  const last = await page.evaluate(() => told.filter(t => t.kind === "load").at(-1).detail.record);
  assert.equal(last.request.technique.name, "pcss");
  assert.equal(watched.under.size, 0);
  assert.ok(watched.most <= 2, watched.most + " at once");
});

test("a service that goes away is said, and shown again when it is back", async () => {
  let from = await count();
  await page.context().setOffline(true);
  await set({ technique: "hard" });
  await failed(from, true);
  assert.match(await page.locator("penumbra-view [part=status]").textContent(), /does not answer.*\. Trying again\.$/);
  from = await count();
  await page.context().setOffline(false);
  assert.equal((await loaded(from)).technique.name, "hard");
  assert.equal(await page.locator("penumbra-view [part=status]").textContent(), "");
});

test("what the daemon refuses is said once", async () => {
  const from = await count(), before = watched.asked.length;
  await set({ params: { nothing_like_it: 1 } });
  await failed(from, false);
  await page.waitForTimeout(1500);
  assert.equal(watched.asked.length, before + 1);
  assert.match(await page.locator("penumbra-view [part=status]").textContent(), /nothing_like_it/);
});
