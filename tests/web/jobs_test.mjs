// Sequences of the viewer, watched, played and kept; and the picture that is shown, as code.
import assert from "node:assert/strict";
import { execFile } from "node:child_process";
import { after, test } from "node:test";
import { mkdtemp, readFile, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { promisify } from "node:util";
import { CONTROL, DAEMON, PICTURES, SCENE, close, findings, loaded, loadedWith, open, page, until, viewer,
  watched } from "./page.mjs";

after(close);

const CAMERA = { eye: [0, 2, 8], target: [1, 1, 0], fov_y_deg: 40 };
const STATE = { scene: SCENE, camera: CAMERA, technique: "hard" };
const DESKTOP = { viewport: { width: 1440, height: 900 }, colorScheme: "dark" };
const button = (name, within = page) => within.getByRole("button", { name, exact: true });
const form = () => page.locator(".composer");
const job = () => page.locator(".jobs li").first();
const api = async (path, init) => (await fetch(DAEMON + path, init)).json();
async function fill(fields) {
  for (const [label, value] of Object.entries(fields)) {
    const field = form().getByLabel(label);
    await field.fill(String(value));
    await field.press("Tab");
  }
}
/** Starts what the form says; resolves to the request and the job. */
async function start() {
  const sent = page.waitForRequest(request => request.method() === "POST" && request.url().endsWith("/v1/jobs"));
  await button("Start", form()).click();
  const request = await sent, answer = await request.response();
  assert.equal(answer.status(), 202);
  return [request.postDataJSON(), await answer.json()];
}
const over = () => button("Remove", job()).waitFor();
const near = (given, wanted, tolerance) => given.forEach((value, i) =>
  assert.ok(Math.abs(value - wanted[i]) <= tolerance, given + " is not " + wanted));

test("a turntable goes around what the view looks at, is watched, played and kept", async () => {
  await open(viewer(STATE), DESKTOP);
  const { lights, exposure_ev } = await loaded();
  await button("New sequence").click();
  await fill({ frames: 4, width: 160, height: 120 });
  await page.screenshot({ path: join(PICTURES, "jobs-form.png") });
  assert.deepEqual(await findings(), []);
  const [request, { id }] = await start();
  // By quarters around +y, from +z towards +x: what is seen from (-1, 1, 8) off the target.
  [[-1, 1, 8], [8, 1, 1], [1, 1, -8], [-8, 1, -1]].forEach((off, i) => {
    const { eye, target } = request.sequence.views[i];
    near(eye, off.map((value, axis) => value + CAMERA.target[axis]), 1e-4);
    near(target, CAMERA.target, 1e-6);
  });
  assert.deepEqual([request.lights, request.exposure_ev], [lights, exposure_ev]);
  await over();
  assert.match(await job().textContent(), /^Turntable · .*4 of 4 frames/);
  assert.equal((await api("/v1/jobs/" + id)).state, "successful");
  await until(() => document.querySelector(".jobs img").naturalWidth === 160);
  const saved = page.waitForEvent("download");
  await button("Download", job()).click();
  assert.match((await saved).suggestedFilename(), /\.zip$/);
  await button("Play", job()).click();
  await until(() => /^\d of 4$/.test(document.querySelector(".player output").textContent));
  const colours = () => page.evaluate(() => document.querySelector(".player canvas").toDataURL());
  const seen = new Set();
  for (let i = 0; i < 200 && seen.size < 4; i++) {
    seen.add(await colours());
    await page.waitForTimeout(15);
  }
  assert.equal(seen.size, 4);
  await page.screenshot({ path: join(PICTURES, "jobs-player.png") });
  assert.deepEqual(await findings(), []);
  await button("Close", page.locator(".player")).click();
  await button("Remove", job()).click();
  await until(() => !document.querySelector(".jobs li"));
  assert.equal((await fetch(DAEMON + "/v1/jobs/" + id)).status, 404);
  assert.deepEqual(watched.problems, []);
});

test("views that are added become keyframes, in another format", async () => {
  await button("New sequence").click();
  await button("Keyframes", form()).click();
  await button("Add this view", form()).click();
  assert.ok(await button("Start", form()).isDisabled());
  await page.locator("penumbra-view").focus();
  await page.keyboard.press("ArrowRight");
  await loadedWith(({ camera }) => Math.abs(camera.eye[0]) > 0.1);
  await button("Add this view", form()).click();
  await fill({ rate: 10, "between views": 0.5, width: 80, height: 60 });
  await form().getByLabel("format").selectOption("webp");
  await form().getByLabel("together as").selectOption("webp");
  const [{ sequence, output }, { id }] = await start();
  assert.deepEqual(sequence.keyframes.map(({ frame }) => frame), [0, 5]);
  near(sequence.keyframes[0].camera.eye, CAMERA.eye, 1e-4);
  assert.notDeepEqual(sequence.keyframes[0].camera.eye, sequence.keyframes[1].camera.eye);
  assert.equal(output.format, "webp");
  await over();
  assert.equal((await api("/v1/jobs/" + id)).frames.done, 6);
});

test("a job is cancelled", async () => {
  await button("New sequence").click();
  await button("Turntable", form()).click();
  await fill({ frames: 400, width: 640, height: 480 });
  const [, { id }] = await start();
  await until(() => document.querySelector(".jobs progress").value > 0);
  await page.screenshot({ path: join(PICTURES, "jobs-running.png") });
  await button("Cancel", job()).click();
  await over();
  assert.equal((await api("/v1/jobs/" + id)).state, "dismissed");
});

test("a job is shown again when the daemon is back", async () => {
  await button("New sequence").click();
  await button("Turntable", form()).click();
  await fill({ frames: 60, width: 160, height: 120 });
  const [, { id }] = await start();
  await until(() => document.querySelector(".jobs progress").value > 0);
  await fetch(CONTROL + "/kill");
  await until(() => document.querySelector(".jobs .failed"));
  await fetch(CONTROL + "/start");
  await until(id => document.querySelector(".jobs li:not(.failed)[data-id='" + id + "']"), id);
  await over();
  assert.match(await job().textContent(), /60 of 60 frames/);
});

test("jobs on a phone", async () => {
  await open(viewer(STATE), { colorScheme: "light", viewport: { width: 390, height: 844 }, hasTouch: true });
  await loaded();
  await button("Service", page.locator("#tabs")).tap();
  await button("New sequence").tap();
  await page.screenshot({ path: join(PICTURES, "jobs-phone.png") });
  assert.ok(await button("Start", form()).isVisible());
  assert.equal(await page.evaluate(() => document.documentElement.scrollWidth - innerWidth), 0);
  assert.deepEqual(watched.problems, []);
});

/** The mean difference of a file's pixels from those that are shown, in levels of 255. */
const difference = (target, bytes) => target.evaluate(async ([bytes, wanted]) => {
  const read = async source => {
    const bitmap = await createImageBitmap(source), { width, height } = bitmap;
    const context = new OffscreenCanvas(width, height).getContext("2d");
    context.drawImage(bitmap, 0, 0);
    return context.getImageData(0, 0, width, height).data;
  };
  const blobOf = text => new Blob([Uint8Array.from(atob(text), c => c.charCodeAt(0))]);
  const [a, b] = [await read(blobOf(bytes)), await read(blobOf(wanted))];
  return a.length === b.length ? a.reduce((sum, value, i) => sum + Math.abs(value - b[i]), 0) / a.length : Infinity;
}, [bytes, picture]);
let picture;

test("the picture as code: what is copied gives it, in three languages", async () => {
  await open(viewer({ ...STATE, width: 320, height: 240, lights: [{ type: "disk", position: [-2, 4, 3],
    target: [0, 0, 0], radius: 0.4, power_w: 800, color: [1, 0.8, 0.6] }] }), DESKTOP);
  await page.context().grantPermissions(["clipboard-read", "clipboard-write"]);
  await loaded();
  picture = (await page.evaluate(() => document.querySelector("penumbra-view").shadowRoot
    .querySelector("canvas").toDataURL("image/png"))).split(",")[1];
  await button("Code").click();
  const folder = await mkdtemp(join(tmpdir(), "code-")), code = {};
  for (const language of ["curl", "Python", "JavaScript"]) {
    await button(language, page.locator(".recipes")).click();
    if (language === "Python") await page.screenshot({ path: join(PICTURES, "code-desktop.png") });
    await page.locator(".recipes .primary").click();
    code[language] = await page.evaluate(() => navigator.clipboard.readText());
  }
  const file = join(folder, "penumbra.png"), run = promisify(execFile);
  await run("bash", ["-c", code.curl], { cwd: folder });
  assert.ok(await difference(page, (await readFile(file)).toString("base64")) < 0.1);
  await writeFile(file, "");
  await run("python3", ["-B", "-c", code.Python], { cwd: folder,
    env: { ...process.env, PYTHONPATH: process.env.PYTHON_PACKAGE } });
  assert.ok(await difference(page, (await readFile(file)).toString("base64")) < 0.1);
  const other = await page.context().newPage();
  await other.goto(DAEMON + "/v1");
  await other.evaluate(code => {
    document.body.append(Object.assign(document.createElement("script"), { type: "module", textContent: code }));
  }, code.JavaScript);
  await other.waitForSelector("img");
  const bytes = await other.evaluate(async () => {
    const array = new Uint8Array(await (await fetch(document.images[0].src)).arrayBuffer());
    return btoa(array.reduce((text, byte) => text + String.fromCharCode(byte), ""));
  });
  assert.ok(await difference(page, bytes) < 0.1);
});

test("the address that is shared shows the same", async () => {
  await page.keyboard.press("Escape");
  await button("Share").click();
  const link = await page.evaluate(() => navigator.clipboard.readText());
  const saved = page.waitForEvent("download");
  await button("Download", page.locator("#bar")).click();
  assert.equal((await saved).suggestedFilename(), "penumbra.png");
  await open(link, DESKTOP);
  const { lights, width } = await loaded();
  assert.deepEqual([lights[0].type, lights[0].radius, width], ["disk", 0.4, 320]);
  assert.deepEqual(watched.problems, []);
});
