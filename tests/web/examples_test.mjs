// The HTML and JavaScript of the papers, as it stands there, in pages of another origin.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { after, before, test } from "node:test";
import { begin, count, end, loaded, open, page, problems, until } from "./pages.mjs";

const { DAEMON, LOCKED, SCENE, VIEWER } = process.env;
const EXAMPLES = JSON.parse(process.env.EXAMPLES).map(([paper, kind, text]) => ({ paper, kind,
  text: text.replaceAll("{id}", SCENE).replaceAll(/"ID"|\/ID\//g, id => id.replace("ID", SCENE)) }));
// So much to draw that no machine shows the last picture first.
const much = number => "width=320&height=" + (240 + 8 * number) + "&deadline_ms=3600000&params.samples=192";
/** What an image of the page shows. */
function pixels(which) {
  const image = document.images[which], canvas = document.createElement("canvas");
  Object.assign(canvas, { width: image.naturalWidth, height: image.naturalHeight });
  canvas.getContext("2d").drawImage(image, 0, 0);
  return canvas.toDataURL();
}
before(begin);
after(end);

const shows = ({ text }, word) => text.includes(word);
const html = EXAMPLES.filter(e => e.kind === "html"), scripts = EXAMPLES.filter(e => e.kind === "js");
const elements = html.filter(e => shows(e, "<penumbra-view ")), images = html.filter(e => shows(e, "<img "));

test("none is left out", () => {
  assert.ok(elements.length >= 2 && images.length >= 2 && scripts.length >= 2);
  assert.equal(elements.length + images.length, html.length);
});

for (const [number, { paper, text }] of elements.entries())
  test("two lines show a view: " + paper + " " + number, async () => {
    await open(text);
    const request = await loaded();
    assert.equal(request.technique.name, "pcss");
    const from = await count();
    await page.mouse.move(100, 100);
    await page.mouse.down();
    await page.mouse.move(160, 100, { steps: 5 });
    await page.mouse.up();
    assert.notDeepEqual((await loaded(from)).camera.eye, request.camera.eye);
    assert.deepEqual(problems, []);
  });

for (const [number, { paper, text }] of images.entries())
  test("an image that refines by itself: " + paper + " " + number, async () => {
    // A path alone is for a page of the daemon's own.
    const absolute = text.replace(/src="\//, 'src="' + DAEMON + "/");
    await open(absolute.replace("<img ", "<img crossorigin ").replace("progressive=true", "progressive=true&" + much(number)));
    await until(() => document.images[0].naturalWidth === 320);
    const address = absolute.match(/src="([^"]*)"/)[1].replace("progressive=true", much(number));
    await page.evaluate(address => document.body.insertAdjacentHTML("beforeend",
      `<img id=plain crossorigin src="${address}">`), address);
    const seen = new Set();
    for (let done = false; !done; await page.waitForTimeout(50)) {
      done = await page.evaluate(() => document.querySelector("#plain").complete);
      seen.add(await page.evaluate(pixels, 0));
    }
    const plain = await page.evaluate(pixels, 1);
    await until(new Function("plain", `return (${pixels})(0) === plain`), plain); // the last one
    assert.ok(seen.size >= 2, seen.size + " pictures");
    assert.deepEqual(problems, []);
  });

for (const [number, { paper, text }] of scripts.entries())
  test("the client as a module: " + paper + " " + number, async () => {
    await open("<img id=image alt='' width=80 height=60><penumbra-view></penumbra-view>");
    const glb = readFileSync(process.env.GLB).toString("base64");
    await page.evaluate(({ text, glb }) => {
      globalThis.file = new File([Uint8Array.from(atob(glb), c => c.charCodeAt(0))], "demo.glb");
      globalThis.image = document.querySelector("#image");
      const script = document.createElement("script");
      script.type = "module";
      script.textContent = text + "\nglobalThis.ended = true;\n" +
        "globalThis.zipped = typeof zip === 'undefined' ? null : zip.size;";
      document.body.append(script);
    }, { text, glb });
    await until(() => globalThis.ended);
    if (shows({ text }, "zip")) assert.ok(await page.evaluate(() => zipped) > 1000);
    if (shows({ text }, "image.src")) await until(() => image.naturalWidth > 0);
    assert.deepEqual(problems, []);
  });

test("with a token, as an attribute and as a property", async () => {
  const markup = `<script type="module" src="${LOCKED}/penumbra-view.js"></script>
    <penumbra-view server="${LOCKED}" scene="${SCENE}" technique="hard"></penumbra-view>`;
  await open(markup);
  await until(() => told.some(t => t.kind === "error" && t.detail.error.status === 401));
  await page.evaluate(async ({ LOCKED, SENDER, bytes }) => {
    const { Penumbra } = await import(LOCKED + "/penumbra.js");
    const daemon = new Penumbra(LOCKED, { token: SENDER });
    await daemon.upload(new Blob([Uint8Array.from(atob(bytes), c => c.charCodeAt(0))]));
  }, { LOCKED, SENDER: process.env.SENDER, bytes: readFileSync(process.env.GLB).toString("base64") });
  let from = await count();
  await page.evaluate(token => { document.querySelector("penumbra-view").token = token; }, VIEWER);
  assert.equal((await loaded(from)).technique.name, "hard");
  assert.ok(!(await page.content()).includes(VIEWER)); // it does not stand in the document
  await open(markup.replace("technique=", `token="${VIEWER}" technique=`));
  assert.equal((await loaded()).technique.name, "hard");
});

test("an origin that was not named is refused", async () => {
  await open("");
  const other = process.env.ORIGIN.replace("127.0.0.1", "localhost");
  await page.goto(other + "/");
  assert.equal(await page.evaluate(DAEMON => fetch(DAEMON + "/v1").then(() => "read", () => "refused"), DAEMON), "refused");
});
