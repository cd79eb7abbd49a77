// penumbra-view as users of web components expect it: attributes and properties, slots and parts, what
// screen readers say, fingers and keys, and a daemon that is killed and comes back.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { after, before, test } from "node:test";
import { join } from "node:path";
import { begin, count, end, loaded, open, page, problems, until, view } from "./pages.mjs";

const { DAEMON, AWAY, SWITCH, SCENE, PICTURES, PACKAGES } = process.env;
const markup = (more = "", server = DAEMON, inside = "") => `<script type="module"
  src="${DAEMON}/penumbra-view.js"></script><penumbra-view server="${server}" scene="${SCENE}"
  technique="hard" ${more}>${inside}</penumbra-view>`;
const get = name => page.evaluate(name => document.querySelector("penumbra-view")[name], name);
const camera = async () => (await get("currentCamera"));
const distance = ({ eye, target }) => Math.hypot(...eye.map((value, axis) => value - target[axis]));
before(begin);
after(end);

test("attributes are properties, and objects of them JSON", async () => {
  await open(markup(`width="200" height="150" params='{"bias": 0.001}' lights='[{"type":"sun"}]'`));
  const request = await loaded();
  assert.deepEqual([request.width, request.height, request.lights[0].type, request.technique.params.bias],
    [200, 150, "sun", 0.001]);
  assert.deepEqual([await get("width"), await get("params"), await get("orbit")], [200, { bias: 0.001 }, false]);
  let from = await count();
  await page.evaluate(() => Object.assign(document.querySelector("penumbra-view"),
    { request: { ground: false }, params: null, width: 160, orbit: true }));
  const changed = await loaded(from);
  assert.deepEqual([changed.ground, changed.width], [false, 160]);
  assert.equal(await page.locator("penumbra-view").getAttribute("width"), "160");
  assert.equal(await page.locator("penumbra-view").getAttribute("orbit"), "");
  from = await count();
  await page.evaluate(() => document.querySelector("penumbra-view").removeAttribute("width"));
  assert.equal((await loaded(from)).width, 320); // its size on the screen
});

test("properties that were set before it was defined hold", async () => {
  await open("<penumbra-view></penumbra-view>");
  await page.evaluate(({ DAEMON, SCENE }) => {
    Object.assign(document.querySelector("penumbra-view"),
      { server: DAEMON, scene: SCENE, technique: "none", width: 64, height: 48 });
    return import(DAEMON + "/penumbra-view.js");
  }, { DAEMON, SCENE });
  const request = await loaded();
  assert.deepEqual([request.technique.name, request.width], ["none", 64]);
});

test("the first digits of an id are enough", async () => {
  await open(markup().replace(SCENE, SCENE.slice(0, 10)));
  assert.equal((await loaded()).technique.name, "hard");
});

test("events say what they carry, and do not bubble", async () => {
  await open(markup());
  await page.evaluate(() => document.body.addEventListener("load", () => { globalThis.bubbled = true; }));
  await loaded();
  const [load, timing] = await page.evaluate(() => [told.find(t => t.kind === "load" && t.detail.done),
    told.find(t => t.kind === "timing" && !t.detail.brief)].map(t => t.detail));
  assert.ok(load.record.request && Array.isArray(load.warnings));
  assert.ok(timing.ms > 0 && timing.stages.gbuffer >= 0 && timing.passes.length > 0);
  assert.equal(await page.evaluate(() => globalThis.bubbled), undefined);
});

test("slots, parts, and what screen readers say", async () => {
  await open(markup('orbit alt="A demo room"', DAEMON, "<button id=mine>Mine</button>"));
  await loaded();
  await page.addStyleTag({ content: "penumbra-view::part(status) { background: rgb(1, 2, 3) } " +
    "penumbra-view::part(picture) { border-radius: 7px }" });
  const styles = await page.evaluate(() => ["status", "picture"].map(part => getComputedStyle(
    document.querySelector("penumbra-view").shadowRoot.querySelector(`[part=${part}]`))).map(style =>
    [style.backgroundColor, style.borderTopLeftRadius]));
  assert.deepEqual([styles[0][0], styles[1][1]], ["rgb(1, 2, 3)", "7px"]);
  await page.locator("#mine").click(); // what is put into it lies over the picture
  const tree = await page.locator("penumbra-view").evaluate(element => {
    const canvas = element.shadowRoot.querySelector("canvas");
    return [canvas.getAttribute("role"), canvas.ariaLabel, canvas.tabIndex,
      element.shadowRoot.getElementById(canvas.getAttribute("aria-describedby")).textContent,
      element.shadowRoot.querySelector("[role=status]").ariaLive];
  });
  assert.deepEqual([tree[1], tree[2], tree[4]], ["A demo room", 0, "polite"]);
  assert.match(tree[3], /Arrow keys turn/);
  await page.evaluate(readFileSync(createRequire(PACKAGES + "/").resolve("axe-core/axe.min.js"), "utf8"));
  const found = await page.evaluate(() => axe.run("penumbra-view", { resultTypes: ["violations"] }));
  assert.deepEqual(found.violations.map(v => [v.id, v.nodes[0].html]), []);
});

test("keys turn, move, zoom and return", async () => {
  await open(markup("orbit"));
  await loaded();
  const home = await camera();
  await view("canvas").focus();
  const press = async key => {
    await page.keyboard.press(key);
    return camera();
  };
  const near = (a, b) => a.every((value, axis) => Math.abs(value - b[axis]) < 1e-4);
  const turned = await press("ArrowRight");
  assert.ok(near(turned.target, home.target) && !near(turned.eye, home.eye));
  const moved = await press("Shift+ArrowUp");
  assert.ok(!near(moved.target, turned.target));
  assert.ok(distance(await press("+")) < distance(moved));
  assert.ok(distance(await press("-")) > 0.99 * distance(moved));
  const back = await press("Home");
  assert.ok(near(back.eye, home.eye) && near(back.target, home.target));
  const before = await camera();
  await page.keyboard.press("Control+ArrowLeft"); // the browser's own
  assert.deepEqual(await camera(), before);
});

/** Fingers go from and to points, in steps. */
async function fingers(from, to) {
  const session = await page.context().newCDPSession(page);
  const send = (type, points) => session.send("Input.dispatchTouchEvent", { type,
    touchPoints: points.map(([x, y], id) => ({ x, y, id })) });
  await send("touchStart", from);
  for (let step = 1; step <= 8; step++)
    await send("touchMove", from.map((point, finger) => point.map((value, axis) =>
      value + (to[finger][axis] - value) * step / 8)));
  await send("touchEnd", []);
}

test("one finger turns, two zoom and move, and the page stays", async () => {
  await open(markup("orbit") + "<div style='height: 3000px'></div>",
    { hasTouch: true, viewport: { width: 390, height: 700 } });
  await loaded();
  const home = await camera();
  let from = await count();
  await fingers([[100, 100]], [[160, 100]]);
  const turned = await camera();
  assert.notDeepEqual(turned.eye, home.eye);
  assert.deepEqual(turned.target, home.target);
  assert.ok(Math.abs(distance(turned) - distance(home)) < 1e-6);
  assert.deepEqual((await loaded(from)).width, 320); // the full picture, when they are lifted
  await fingers([[140, 100], [160, 100]], [[100, 100], [200, 100]]);
  const closer = await camera();
  assert.ok(Math.abs(distance(closer) / distance(turned) - 1 / 5) < 0.02, "from 20 to 100 pixels apart");
  await fingers([[120, 100], [180, 100]], [[120, 160], [180, 160]]);
  const moved = await camera();
  assert.ok(Math.abs(distance(moved) / distance(closer) - 1) < 0.02);
  const shift = Math.hypot(...moved.target.map((value, axis) => value - closer.target[axis]));
  const height = 2 * distance(closer) * Math.tan(closer.fov_y_deg * Math.PI / 360);
  assert.ok(Math.abs(shift / height - 60 / 240) < 0.02, "60 of 240 pixels");
  assert.equal(await page.evaluate(() => scrollY), 0);
  await page.screenshot({ path: join(PICTURES, "element-phone.png") });
});

test("without orbit fingers scroll the page", async () => {
  await open(markup() + "<div style='height: 3000px'></div>", { hasTouch: true, viewport: { width: 390, height: 700 } });
  await loaded();
  const before = await page.evaluate(() => told.filter(t => t.kind === "camerachange" && t.detail.user).length);
  await fingers([[100, 200]], [[100, 60]]);
  await until(() => scrollY > 0);
  assert.equal(await page.evaluate(() => told.filter(t => t.kind === "camerachange" && t.detail.user).length), before);
});

test("a daemon that is killed is said, and shown again when it is back", async () => {
  await open(markup("orbit", AWAY));
  await loaded();
  await fetch(SWITCH + "/stop");
  let from = await count();
  await page.evaluate(() => { document.querySelector("penumbra-view").technique = "pcss"; });
  await until(from => told.slice(from).some(t => t.kind === "error" && t.detail.again), from);
  assert.match(await view("[part=status]").textContent(), /does not answer/);
  from = await count();
  await fetch(SWITCH + "/start");
  assert.equal((await loaded(from)).technique.name, "pcss");
  assert.equal(await view("[part=status]").textContent(), "");
});

test("what is taken out of the page asks for nothing any more, and goes on when it is put back", async () => {
  await open(markup("orbit"));
  await loaded();
  await page.evaluate(() => {
    globalThis.kept = document.querySelector("penumbra-view");
    kept.remove();
    kept.technique = "none";
  });
  let asked = 0;
  page.on("request", () => asked++);
  await page.waitForTimeout(300);
  assert.equal(asked, 0);
  await page.evaluate(() => {
    for (const kind of ["load"]) kept.addEventListener(kind, ({ detail }) => told.push({ kind, detail }));
    document.body.append(kept);
  });
  await until(() => told.at(-1)?.kind && told.some(t => t.kind === "load" && t.detail.done &&
    t.detail.record.request.technique.name === "none"));
  assert.deepEqual(problems, []);
});
