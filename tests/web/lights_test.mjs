// Lights of the viewer: their handles on the picture, their numbers, and what the picture makes of them.
import assert from "node:assert/strict";
import { after, test } from "node:test";
import { join } from "node:path";
import { PICTURES, SCENE, close, count, findings, loaded, loadedWith, open, page, until, viewer,
  wait, watched } from "./page.mjs";

after(close);

const CAMERA = { eye: [0, 1, 8], target: [0, 1, 0], fov_y_deg: 40 }; // looks along -z, level
const RECT = { type: "rect", position: [-1, 2, 1], target: [0, 0.5, 0], up: [0, 1, 0], width: 0.5,
  height: 0.25, color: [1, 1, 1], power_w: 60 };
const STATE = { scene: SCENE, camera: CAMERA, lights: [RECT], technique: "hard" };
const button = name => page.getByRole("button", { name, exact: true });
const handle = (number, type, kind) => button("Light " + number + ", " + type + ": " + kind);
const field = name => page.locator("#panel-lights").getByLabel(name, { exact: false });
/** The lights of the address, once it rests and says something of them that holds. */
const stated = async condition => {
  const read = () => JSON.parse(new URL(page.url()).hash.slice(1).split("&").map(pair =>
    pair.split("=")).filter(([key]) => key === "lights").map(([, value]) =>
    decodeURIComponent(value.replaceAll("+", " ")))[0] ?? "null");
  const { lights } = await wait(async () => {
    const before = page.url();
    await page.waitForTimeout(400);
    return page.url() === before && condition(read()) && { lights: read() };
  }, condition);
  return lights;
};
const close_to = (given, wanted, tolerance) => given.forEach((value, i) =>
  assert.ok(Math.abs(value - wanted[i]) <= tolerance, given + " is not " + wanted));

/** Pixels per metre at a depth, and the middle, of the picture on the page. */
async function scale(depth) {
  const box = await page.locator("penumbra-view").boundingBox();
  return { k: box.height / 2 / Math.tan(20 * Math.PI / 180) / depth,
    x: box.x + box.width / 2, y: box.y + box.height / 2 };
}
/** Where CAMERA sees a point, on the page: a pinhole that looks along -z. */
async function seen([x, y, z]) {
  const at = await scale(8 - z);
  return [at.x + at.k * x, at.y - at.k * (y - 1)];
}
async function middle(locator) {
  const box = await locator.boundingBox();
  return [box.x + box.width / 2, box.y + box.height / 2];
}
async function drag(locator, dx, dy, steps = 12) {
  const [x, y] = await middle(locator);
  await page.mouse.move(x, y);
  await page.mouse.down();
  for (let i = 1; i <= steps; i++) {
    await page.mouse.move(x + dx * i / steps, y + dy * i / steps);
    await page.waitForTimeout(15);
  }
  await page.mouse.up();
}

test("handles stand where the camera sees the light", async () => {
  await open(viewer(STATE));
  await loaded();
  await button("Light 1, rect").click();
  close_to(await middle(handle(1, "rect", "position")), await seen(RECT.position), 1);
  close_to(await middle(handle(1, "rect", "target")), await seen(RECT.target), 1);
});

test("dragging moves the light in the plane of the picture, in small pictures first", async () => {
  const before = watched.asked.length, { k } = await scale(7);
  await drag(handle(1, "rect", "position"), 105, 42);
  const [light] = await stated(([{ position }]) => position[0] !== -1);
  close_to(light.position, [-1 + 105 / k, 2 - 42 / k, 1], 2 / k);
  assert.deepEqual([light.target, light.power_w], [RECT.target, RECT.power_w]);
  const { lights, width } = await loadedWith(({ lights }) => lights[0].position[0] !== -1);
  close_to(lights[0].position, light.position, 1e-3);
  assert.ok(watched.asked.slice(before).some(request => request.width < width));
  assert.ok(watched.most <= 2);
});

test("aim and size are dragged, too", async () => {
  const { k } = await scale(8);
  await drag(handle(1, "rect", "target"), -60, -30);
  const [{ target }] = await stated(([{ target }]) => target[0] !== 0);
  close_to(target, [-60 / k, 0.5 + 30 / k, 0], 2 / k);
  // Of an emitter that faces the camera, the corner follows the pointer.
  await open(viewer({ ...STATE, lights: [{ ...RECT, position: [0, 1, 1], target: [0, 1, 4] }] }));
  await loaded();
  const near = await scale(7), corner = handle(1, "rect", "size");
  const [x, y] = await middle(corner);
  await drag(corner, Math.sign(x - near.x) * 50, Math.sign(y - near.y) * 20);
  const [{ width, height }] = await stated(([light]) => light.width !== 0.5);
  close_to([width, height], [0.5 + 2 * 50 / near.k, 0.25 + 2 * 20 / near.k], 2 / near.k);
});

test("the back button returns to where the light was", async () => {
  await page.goBack();
  await stated(([{ width }]) => width === 0.5);
});

test("l and the arrow keys move lights, Shift along their axis", async () => {
  const distance = ({ position, target }) => Math.hypot(...position.map((v, i) => v - target[i]));
  await open(viewer({ ...STATE, lights: [RECT, { ...RECT, position: [1, 2, 1] }] }));
  await loaded();
  await page.keyboard.press("l");
  assert.equal(await page.evaluate(() => document.activeElement.getAttribute("aria-label")),
    "Light 2, rect: position");
  await page.keyboard.press("ArrowRight");
  const [first, second] = await stated(([, { position }]) => position[0] > 1);
  assert.deepEqual(first.position, RECT.position);
  await page.keyboard.press("Shift+ArrowUp");
  const [, third] = await stated(([, light]) => distance(light) > distance(second));
  const direction = light => light.position.map((v, i) => (v - light.target[i]) / distance(light));
  close_to(direction(third), direction(second), 1e-3);
});

test("lights are added, become others as bright, removed, and given back", async () => {
  await open(viewer({ scene: SCENE, technique: "hard" }));
  const own = (await loaded()).lights;
  await button("Add a light").click();
  const two = await loadedWith(({ lights }) => lights.length === own.length + 1);
  assert.notDeepEqual(two.lights[0].position, two.lights[1].position);
  await field("type").selectOption("point");
  const { lights: [, point] } = await loadedWith(({ lights }) => lights[1]?.type === "point");
  // A Lambertian emitter has power / pi in its axis, a point power / 4 pi.
  assert.ok(Math.abs(point.power_w / two.lights[1].power_w - 4) < 1e-3);
  await button("Remove this light").click();
  await loadedWith(({ lights }) => lights.length === own.length);
  await page.goBack();
  await loadedWith(({ lights }) => lights[1]?.type === "point");
  await button("Back to the scene's own lights").click();
  await stated(lights => lights === null);
});

test("a stop more is twice the power, and seen as such: the exposure stays", async () => {
  await open(viewer({ scene: SCENE, technique: "hard" }));
  const before = await loaded();
  const slider = field("intensity");
  await slider.focus();
  for (let i = 0; i < 10; i++) await page.keyboard.press("ArrowRight");
  const after = await loadedWith(({ lights: [light] }) =>
    Math.abs(light.power_w / before.lights[0].power_w - 2) < 1e-3);
  close_to([after.exposure_ev, after.sky_level], [before.exposure_ev, before.sky_level], 1e-4);
  await page.locator("#panel-lights label", { hasText: "intensity" }).dblclick();
  await loadedWith(({ lights: [light] }) =>
    Math.abs(light.power_w / before.lights[0].power_w - 1) < 1e-3);
});

test("colour, and an emission image from a file", async () => {
  await field("colour").fill("#ff8000");
  const { lights: [{ color }] } = await loadedWith(({ lights: [light] }) => light.color[1] < 0.9);
  close_to(color, [1, 0.21586, 0], 1e-3); // 128 of 255 in linear light
  const chooser = page.waitForEvent("filechooser");
  await field("emission").selectOption({ label: "From a file …" });
  // Two pixels, white and black.
  await (await chooser).setFiles({ name: "stripe.png", mimeType: "image/png", buffer: Buffer.from(
    "iVBORw0KGgoAAAANSUhEUgAAAAIAAAABCAAAAADRSSBWAAAAC0lEQVR4nGP4zwAAAgEBADK6K5IAAAAASUVORK5CYII=", "base64") });
  const { lights: [{ texture }] } = await loadedWith(({ lights: [light] }) => light.texture?.image);
  assert.match(texture.image, /^[0-9a-f]{64}$/);
  assert.equal(await field("emission").locator("option:checked").textContent(), "stripe.png");
  assert.deepEqual(watched.problems, []);
});

for (const [name, options] of [["desktop", { viewport: { width: 1440, height: 900 }, colorScheme: "dark" }],
  ["light", { viewport: { width: 1440, height: 900 }, colorScheme: "light" }],
  ["phone", { colorScheme: "dark", viewport: { width: 390, height: 844 }, hasTouch: true }]])
  test("how lights look, " + name, async () => {
    await open(viewer({ ...STATE, technique: "pcss", lights: [{ ...RECT, position: [-1, 1.6, 1.5] },
      { type: "spot", position: [1.2, 2.2, 1], target: [0, 0, 0], outer_cone_deg: 20, power_w: 20,
        color: [0.2, 0.5, 1] }] }), options);
    await loaded();
    if (name === "phone") await button("Lights").click();
    await button("Light 2, spot").click();
    await until(() => document.querySelectorAll(".handle.chosen").length === 3);
    await page.screenshot({ path: join(PICTURES, "lights-" + name + ".png") });
    assert.deepEqual(await findings(), []);
    assert.equal(await page.evaluate(() => document.documentElement.scrollWidth - innerWidth), 0);
    if (name === "phone") { // by a finger
      const [x, y] = await middle(handle(1, "rect", "position")), from = await count();
      const touch = await page.context().newCDPSession(page);
      const send = (type, ...at) => touch.send("Input.dispatchTouchEvent", { type, touchPoints: at });
      await send("touchStart", { x, y });
      for (let i = 1; i <= 10; i++) await send("touchMove", { x: x + 4 * i, y });
      await send("touchEnd");
      assert.ok((await loaded(from)).lights[0].position[0] > -1);
    }
    assert.deepEqual(watched.problems, []);
  });
