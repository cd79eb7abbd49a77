// Scenes of the viewer: brought, named, found, removed.
import assert from "node:assert/strict";
import { after, test } from "node:test";
import { mkdir, mkdtemp, readFile, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { DAEMON, PICTURES, SCENE, SCENE_FILE, close, findings, loaded, loadedWith, open, page, until, viewer,
  watched } from "./page.mjs";

after(close);

const api = async (path, init) => (await fetch(DAEMON + path, init)).json();
const chosen = () => page.evaluate(() => document.querySelector(".gallery [aria-pressed=true] b")?.textContent);
const becomes = name => until(name =>
  document.querySelector(".gallery [aria-pressed=true] b")?.textContent === name, name);
const idOf = async name => (await api("/v1/scenes?name=" + encodeURIComponent(name))).scenes[0]?.id;

const pictured = id => until(id => told.some(({ kind, detail }) =>
  kind === "load" && detail.done && detail.record.scene === id), id);

/** A triangle as a .gltf whose bytes are a file beside it. */
async function folder() {
  const path = join(await mkdtemp(join(tmpdir(), "viewer-")), "wedge");
  await mkdir(join(path, "data"), { recursive: true });
  await writeFile(join(path, "data", "points.bin"), Buffer.from(new Float32Array([0, 0, 0, 1, 0, 0, 0, 1, 0]).buffer));
  await writeFile(join(path, "wedge.gltf"), JSON.stringify({ asset: { version: "2.0" }, scene: 0,
    scenes: [{ nodes: [0] }], nodes: [{ mesh: 0 }], buffers: [{ uri: "data/points.bin", byteLength: 36 }],
    meshes: [{ primitives: [{ attributes: { POSITION: 0 } }] }],
    bufferViews: [{ buffer: 0, byteLength: 36 }], accessors: [{ bufferView: 0, componentType: 5126,
      count: 3, type: "VEC3", min: [0, 0, 0], max: [1, 1, 0] }] }));
  return path;
}

/** Drops a file on the page, as from the desktop. */
async function dropFile(name, bytes) {
  const transfer = await page.evaluateHandle(([name, text]) => {
    const transfer = new DataTransfer();
    transfer.items.add(new File([Uint8Array.from(atob(text), c => c.charCodeAt(0))], name));
    return transfer;
  }, [name, bytes.toString("base64")]);
  await page.dispatchEvent("#stage", "dragenter", { dataTransfer: transfer });
  assert.ok(await page.locator(".veil").isVisible());
  await page.dispatchEvent("#stage", "drop", { dataTransfer: transfer });
  assert.ok(!await page.locator(".veil").isVisible());
}

test("an empty service offers a drop zone and three scenes, one click away", async () => {
  await fetch(DAEMON + "/v1/scenes/" + SCENE, { method: "DELETE" });
  await open(DAEMON + "/", { viewport: { width: 1440, height: 900 }, colorScheme: "light" });
  await until(() => document.querySelector(".empty").checkVisibility());
  await page.screenshot({ path: join(PICTURES, "scenes-empty.png") });
  assert.deepEqual(await findings(), []);
  for (const name of ["Still life", "Colonnade", "Leaves"]) {
    await page.locator(".samples button", { hasText: name }).evaluate(button => button.click());
    await becomes(name);
    const id = await idOf(name), scene = await api("/v1/scenes/" + id);
    assert.deepEqual(scene.warnings, []);
    await pictured(id);
    assert.match(page.url(), new RegExp(id));
  }
  assert.ok(!await page.locator(".empty").isVisible());
  await until(() => [...document.querySelectorAll(".gallery img")].every(image => image.naturalWidth > 0));
  await page.screenshot({ path: join(PICTURES, "scenes-samples.png") });
  assert.deepEqual(watched.problems, []);
});

test("a dropped file is sent, imported and shown", async () => {
  await dropFile("Demo garden.glb", await readFile(SCENE_FILE));
  await becomes("Demo garden");
  await pictured(SCENE);
  assert.match(page.url(), new RegExp(SCENE));
});

test("a folder is sent with its paths", async () => {
  await page.locator("input[webkitdirectory]").setInputFiles(await folder());
  await becomes("wedge");
  assert.equal((await api("/v1/scenes/" + await idOf("wedge"))).triangles, 1);
});

test("what is no scene is said with its reason, and what can be done", async () => {
  await dropFile("notes.glb", Buffer.from("no scene at all"));
  const alert = page.locator(".sending.failed");
  await alert.waitFor();
  assert.match(await alert.textContent(), /^notes\.glb.*Again/);
  assert.ok((await alert.locator("[role=alert]").textContent()).length > 10);
  assert.equal(await chosen(), "wedge");
  await page.screenshot({ path: join(PICTURES, "scenes-failed.png") });
  assert.deepEqual(await findings(), []);
  await alert.getByRole("button", { name: "Close" }).click();
  assert.equal(await alert.count(), 0);
});

test("an upload shows its bytes and can be cancelled", async () => {
  const wire = await page.context().newCDPSession(page); // a slow line
  await wire.send("Network.enable");
  await wire.send("Network.emulateNetworkConditions",
    { offline: false, latency: 0, downloadThroughput: -1, uploadThroughput: 200000 });
  const before = (await api("/v1/scenes")).scenes.length;
  await dropFile("slow.glb", Buffer.alloc(3000000));
  const row = page.locator(".sending");
  await until(() => /^Sending .* of 2\.9 MiB/.test(document.querySelector(".sending small")?.textContent));
  await row.getByRole("button", { name: "Cancel" }).click();
  await until(() => !document.querySelector(".sending"));
  await wire.send("Network.emulateNetworkConditions",
    { offline: false, latency: 0, downloadThroughput: -1, uploadThroughput: -1 });
  assert.equal((await api("/v1/scenes")).scenes.length, before);
});

test("names and tags are changed, and searched", async () => {
  await open(viewer({ scene: SCENE, technique: "hard" }), { viewport: { width: 1440, height: 900 },
    colorScheme: "dark" });
  await loaded();
  await page.getByText("Name, tags, details").click();
  const name = page.locator(".about").getByLabel("name"), tags = page.locator(".about").getByLabel("tags");
  await name.fill("Garden");
  await name.press("Enter");
  await becomes("Garden");
  await tags.fill("outdoors, test , outdoors");
  await tags.press("Enter");
  await until(() => document.querySelectorAll(".gallery .tags i").length === 2);
  const scene = await api("/v1/scenes/" + SCENE);
  assert.deepEqual([scene.name, scene.tags], ["Garden", ["outdoors", "test"]]);
  await page.screenshot({ path: join(PICTURES, "scenes-details.png") });
  assert.deepEqual(await findings(), []);
});

test("warnings of a file are one line, which opens", async () => {
  const glb = Buffer.from(JSON.stringify({ asset: { version: "2.0" }, scene: 0, scenes: [{ nodes: [0] }],
    nodes: [{ mesh: 0 }], extensionsUsed: ["VENDOR_unknown"], buffers: [{ byteLength: 36,
      uri: "data:application/octet-stream;base64," + Buffer.from(new Float32Array([0, 0, 0, 2, 0, 0, 0, 2, 0]).buffer).toString("base64") }],
    meshes: [{ primitives: [{ attributes: { POSITION: 0 }, mode: 0 }, { attributes: { POSITION: 0 } }] }], bufferViews: [{ buffer: 0, byteLength: 36 }],
    accessors: [{ bufferView: 0, componentType: 5126, count: 3, type: "VEC3", min: [0, 0, 0], max: [2, 2, 0] }] }));
  await dropFile("points.gltf", glb);
  await becomes("points");
  const { warnings } = await api("/v1/scenes/" + await idOf("points"));
  assert.ok(warnings.length > 0);
  const box = page.locator(".warnings");
  assert.ok((await box.locator("summary").textContent()).includes(warnings[0]));
  await box.locator("summary").click();
  assert.deepEqual(await box.locator("li").allTextContents(), warnings);
});

test("what is removed is gone, after a second click, and another one is shown", async () => {
  const id = await idOf("points");
  if (!await page.locator(".about").getAttribute("open").then(open => open !== null))
    await page.getByText("Name, tags, details").click();
  await page.getByRole("button", { name: "Remove", exact: true }).click();
  await page.getByRole("button", { name: "Really remove it?" }).click();
  await until(id => !document.querySelector(".gallery [value='" + id + "']"), id);
  assert.equal((await fetch(DAEMON + "/v1/scenes/" + id)).status, 404);
  assert.notEqual(await chosen(), "points");
  assert.deepEqual(watched.problems, []);
});

test("scenes on a phone", async () => {
  await open(viewer({ scene: SCENE, technique: "hard" }), { colorScheme: "light",
    viewport: { width: 390, height: 844 }, hasTouch: true });
  await loadedWith(({ technique }) => technique.name === "hard");
  await page.locator("#tabs").getByRole("button", { name: "Scenes" }).tap();
  await until(() => [...document.querySelectorAll(".gallery img")].some(image => image.naturalWidth > 0));
  await page.screenshot({ path: join(PICTURES, "scenes-phone.png") });
  assert.equal(await page.evaluate(() => document.documentElement.scrollWidth - innerWidth), 0);
  await page.locator(".gallery .card", { hasText: "Colonnade" }).tap();
  await becomes("Colonnade");
  assert.deepEqual(watched.problems, []);
});
