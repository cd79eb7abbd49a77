// Cameras, variants and animations of a file in the viewer.
import assert from "node:assert/strict";
import { after, before, test } from "node:test";
import { join } from "node:path";
import { DAEMON, PICTURES, close, findings, loaded, loadedWith, open, page, shown, until, viewer,
  watched } from "./page.mjs";

let scene;
const HALF = Math.SQRT1_2;
const line = name => page.getByRole("group", { name: "Animation" }).getByLabel(name);

/** A box that turns by 90 degrees around +y in two seconds, red or green, and a camera. */
function file() {
  const corners = [0, 1, 2, 3, 4, 5, 6, 7].map(i => [i & 1 ? 1 : -1, i & 2 ? 0.4 : 0, i & 4 ? 0.3 : -0.3]);
  const faces = [4, 5, 7, 4, 7, 6, 1, 0, 2, 1, 2, 3, 0, 4, 6, 0, 6, 2, 5, 1, 3, 5, 3, 7, 6, 7, 3, 6, 3, 2, 0, 1, 5, 0, 5, 4];
  const parts = [new Float32Array(corners.flat()), new Uint32Array(faces), new Float32Array([0, 2]),
    new Float32Array([0, 0, 0, 1, 0, HALF, 0, HALF])].map(part => Buffer.from(part.buffer));
  let at = 0;
  const bufferViews = parts.map(part => ({ buffer: 0, byteOffset: (at += part.length) - part.length, byteLength: part.length }));
  const mappings = [0, 1].map(material => ({ material, variants: [material] }));
  return JSON.stringify({ asset: { version: "2.0" }, scene: 0, scenes: [{ nodes: [0, 1] }],
    nodes: [{ mesh: 0 }, { camera: 0, name: "from the left", translation: [-4, 0.5, 0], rotation: [0, -HALF, 0, HALF] }],
    cameras: [{ type: "perspective", perspective: { yfov: 0.5, znear: 0.1 } }],
    extensionsUsed: ["KHR_materials_variants"],
    extensions: { KHR_materials_variants: { variants: [{ name: "red" }, { name: "green" }] } },
    materials: [[1, 0, 0, 1], [0, 1, 0, 1]].map(baseColorFactor => ({ pbrMetallicRoughness: { baseColorFactor, metallicFactor: 0 } })),
    meshes: [{ primitives: [{ attributes: { POSITION: 0 }, indices: 1, material: 0,
      extensions: { KHR_materials_variants: { mappings } } }] }],
    animations: [{ name: "turn", channels: [{ sampler: 0, target: { node: 0, path: "rotation" } }],
      samplers: [{ input: 2, output: 3 }] }],
    buffers: [{ byteLength: at, uri: "data:application/octet-stream;base64," + Buffer.concat(parts).toString("base64") }], bufferViews,
    accessors: [{ bufferView: 0, componentType: 5126, count: 8, type: "VEC3", min: [-1, 0, -0.3], max: [1, 0.4, 0.3] },
      { bufferView: 1, componentType: 5125, count: 36, type: "SCALAR" },
      { bufferView: 2, componentType: 5126, count: 2, type: "SCALAR", min: [0], max: [2] },
      { bufferView: 3, componentType: 5126, count: 2, type: "VEC4" }] });
}

before(async () => {
  const answer = await fetch(DAEMON + "/v1/scenes?name=box.gltf", { method: "POST", body: file(),
    headers: { "Content-Type": "model/gltf+json" } });
  scene = await answer.json();
  assert.deepEqual([scene.animations[0].name, scene.animations[0].duration_s], ["turn", 2]);
});
after(close);

test("a scene with animations has a time line, which poses it", async () => {
  await open(viewer({ scene: scene.id, technique: "hard" }), { viewport: { width: 1440, height: 900 },
    colorScheme: "dark" });
  assert.equal((await loaded()).animation, "");
  await line("Animation").selectOption("turn");
  await loadedWith(({ animation, time_s }) => animation === "turn" && time_s === 0);
  const before = await shown();
  await line("Time in seconds").fill("1");
  const { time_s } = await loadedWith(({ time_s }) => time_s === 1);
  assert.equal(time_s, 1);
  assert.notEqual(await shown(), before);
  await until(() => /animation=turn.*time_s=1/.test(location.hash)); // written when all is still
  await page.screenshot({ path: join(PICTURES, "animation-desktop.png") });
  assert.deepEqual(await findings(), []);
});

test("it plays as fast as asked, in small pictures, one question at a time", async () => {
  await line("Time in seconds").fill("0");
  await loadedWith(({ time_s }) => time_s === 0);
  await line("Speed").selectOption("0.25");
  const from = watched.asked.length;
  await page.locator("#stage").focus();
  const begun = await page.evaluate(() => performance.now());
  await page.keyboard.press("Space");
  await until(() => Number(document.querySelector(".timeline input").value) > 0.2);
  const [time, now] = await page.evaluate(() =>
    [Number(document.querySelector(".timeline input").value), performance.now()]);
  assert.ok(time <= (now - begun) / 1000 * 0.25 + 0.05, time + " s of it");
  await page.keyboard.press("Space");
  const stopped = await line("Time in seconds").inputValue();
  const { width } = await loadedWith(({ time_s, width }) => time_s > 0.2 && width);
  const during = watched.asked.slice(from);
  assert.ok(during.some(request => request.width < width));
  assert.ok(watched.most <= 2);
  const times = during.map(request => request.time_s);
  assert.deepEqual(times, [...times].sort((a, b) => a - b)); // no older question behind a newer one
  assert.equal(await line("Time in seconds").inputValue(), stopped);
  await page.keyboard.press(".");
  await loadedWith(({ time_s }) => Math.abs(time_s - Number(stopped) - 1 / 24) < 2e-3);
});

test("the file's cameras and variants are chosen", async () => {
  const panel = page.locator("#panel-scene");
  await panel.getByLabel("camera").selectOption({ label: "from the left" });
  const { camera } = await loadedWith(({ camera }) => camera.eye[0] < -3.9);
  camera.eye.forEach((value, axis) => assert.ok(Math.abs(value - [-4, 0.5, 0][axis]) < 1e-4));
  await panel.getByLabel("variant").selectOption("green");
  await loadedWith(({ variant }) => variant === "green");
  const [red, green] = await page.evaluate(() => {
    const canvas = document.querySelector("penumbra-view").shadowRoot.querySelector("canvas");
    return [...canvas.getContext("2d").getImageData(canvas.width / 2, canvas.height * 0.55, 1, 1).data];
  });
  assert.ok(green > 2 * red, red + " " + green);
  assert.deepEqual(watched.problems, []);
});

test("the time line on a phone", async () => {
  await open(viewer({ scene: scene.id, technique: "hard", animation: "turn", time_s: 1.5 }),
    { colorScheme: "light", viewport: { width: 390, height: 844 }, hasTouch: true });
  assert.equal((await loaded()).time_s, 1.5);
  await page.screenshot({ path: join(PICTURES, "animation-phone.png") });
  assert.equal(await page.evaluate(() => document.documentElement.scrollWidth - innerWidth), 0);
  await page.getByRole("button", { name: "Play" }).tap();
  await until(() => Number(document.querySelector(".timeline input").value) < 1.4); // around
  await page.getByRole("button", { name: "Pause" }).tap();
});
