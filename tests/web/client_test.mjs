// The JavaScript client against a daemon: URL OF THE MODULE, URL OF THE DAEMON, GLB, GLTF FOLDER.
import assert from "node:assert/strict";
import { createHash } from "node:crypto";
import { readFileSync } from "node:fs";
import { createServer } from "node:http";
import { test } from "node:test";

const { Penumbra, PenumbraError, Picture, readEvents } = await import(process.env.MODULE);
const glb = readFileSync(process.env.SCENE), id = createHash("sha256").update(glb).digest("hex");
const daemon = new Penumbra(process.env.DAEMON);
const small = { technique: "hard", width: 64, height: 48, deadline_ms: 300000 };
const isPng = bytes => Buffer.from(bytes).toString("latin1", 0, 8) === "\x89PNG\r\n\x1a\n";
const bytesOf = async blob => new Uint8Array(await blob.arrayBuffer());

/** A server whose answers are made by `answer(request, response, number)`. */
async function stub(answer) {
  let number = 0;
  const server = createServer((request, response) => answer(request, response, number++));
  await new Promise(resolve => server.listen(0, "127.0.0.1", resolve));
  return { url: "http://127.0.0.1:" + server.address().port, get asked() { return number; },
    close: () => { server.closeAllConnections(); server.close(); } };
}

test("uploads of every kind give the id that the bytes have", async () => {
  const array = new Uint8Array(glb);
  for (const data of [new Blob([glb]), array, array.buffer, new DataView(array.buffer)])
    assert.equal((await daemon.upload(data)).id, id);
  const scenes = [];
  for await (const scene of daemon.scenes()) scenes.push(scene.id);
  assert.ok(scenes.includes(id));
  assert.equal((await daemon.scene(id)).triangles, 32);
});

test("scenes have names, tags and small pictures", async () => {
  const named = await daemon.upload(Object.assign(new Blob([glb]), { name: "Tea pot.glb" }));
  assert.equal(named.name, "Tea pot");
  const changed = await daemon.changeScene(id.slice(0, 8), { name: "Room & hall", tags: ["a"] });
  assert.deepEqual([changed.name, changed.tags, changed.id], ["Room & hall", ["a"], id]);
  for (const [query, found] of [[{ name: "& HALL" }, 1], [{ tag: "a" }, 1], [{ tag: "b" }, 0]]) {
    const scenes = [];
    for await (const scene of daemon.scenes(query)) scenes.push(scene.id);
    assert.deepEqual(scenes, found ? [id] : [], JSON.stringify(query));
  }
  const bytes = await bytesOf((await daemon.thumbnail(id)).blob);
  assert.deepEqual([...bytes.subarray(0, 2)], [0xff, 0xd8]);
  await daemon.changeScene(id, { name: null, tags: null });
  assert.equal((await daemon.scene(id)).name, "");
});

test("a glTF with its files goes as a form", async () => {
  const document = JSON.parse(glb.toString("utf8", 20, 20 + glb.readUInt32LE(12)));
  document.buffers[0].uri = "parts/grid.bin";
  const begin = 20 + glb.readUInt32LE(12) + 8;
  const file = (name, data) => Object.assign(new Blob([data]), { name });
  const scene = await daemon.upload([file("grid.gltf", JSON.stringify(document)),
    file("parts/grid.bin", glb.subarray(begin))]);
  assert.equal(scene.triangles, 32);
});

test("a render is the plain answer, with its times", async () => {
  const picture = await daemon.render(id, small);
  assert.ok(picture instanceof Picture);
  const bytes = await bytesOf(picture.blob);
  assert.ok(isPng(bytes));
  const plain = await fetch(process.env.DAEMON + "/v1/scenes/" + id +
    "/render?technique=hard&width=64&height=48&deadline_ms=300000");
  assert.deepEqual(bytes, new Uint8Array(await plain.arrayBuffer()));
  assert.equal(picture.etag, plain.headers.get("etag"));
  assert.ok(picture.timings.total > 0);
  assert.equal(await (await fetch(picture.url)).arrayBuffer().then(b => b.byteLength), bytes.length);
  picture.release();
  const record = await daemon.record(id, small);
  assert.equal(record.request.width, 64);
  assert.ok(record.stages_ms && record.passes && record.warnings);
});

test("a picture that gets better ends with the plain answer", async () => {
  const request = { ...small, technique: { name: "multisample", params: { samples: 64 } } };
  const steps = [];
  for await (const step of daemon.refine(id, request)) steps.push(step);
  assert.deepEqual(steps.map(step => step.done), steps.map((_, i) => i === steps.length - 1));
  const { progress } = steps.at(-1).record;
  assert.equal(progress.samples, progress.of);
  assert.deepEqual(await bytesOf(steps.at(-1).picture.blob),
    await bytesOf((await daemon.render(id, request)).blob));
});

test("an aborted request rejects with the signal's reason", async () => {
  const controller = new AbortController(), reason = new Error("enough");
  controller.abort(reason);
  await assert.rejects(daemon.render(id, small, { signal: controller.signal }), reason);
  await assert.rejects(async () => {
    for await (const step of daemon.refine(id, small, { signal: controller.signal })) void step;
  }, reason);
});

test("errors carry the problem document", async () => {
  await assert.rejects(daemon.render(id, { width: -1 }), failure => {
    assert.ok(failure instanceof PenumbraError);
    assert.equal(failure.problem.pointer, "/width");
    assert.ok(failure.problem.request_id && failure.message.includes("/width"));
    return failure.status >= 400 && failure.status < 500 && !failure.retryable;
  });
});

test("a comparison", async () => {
  const request = { width: 48, height: 36, techniques: ["hard"], deadline_ms: 300000,
    reference: { name: "multisample", params: { samples: 16 } } };
  const { methods } = await daemon.compare(id, request);
  assert.equal(methods[0].technique.name, "hard");
  assert.equal(typeof methods[0].rmse, "number");
  const told = [];
  for await (const { event, data } of daemon.measure(id, request)) told.push([event, data]);
  assert.deepEqual(told.map(([event]) => event), ["reference", "method", "done"]);
  assert.equal(told[1][1].rmse, methods[0].rmse);
  assert.deepEqual(told[2][1].methods, [told[1][1]]);
});

test("a job tells its frames and gives them", async () => {
  const key = "key-" + id.slice(0, 8);
  const request = { ...small, deadline_ms: undefined, sequence: { frames: 3 } };
  const job = await daemon.start("sequence", id, request, { key });
  assert.equal((await daemon.start("sequence", id, request, { key })).id, job.id);
  const frames = [], ids = [];
  for await (const { event, id: number, data } of job.events()) {
    ids.push(number);
    if (event === "frame") frames.push(data.frame);
  }
  assert.deepEqual(frames.sort(), [0, 1, 2]);
  assert.equal((await job.finished()).state, "successful");
  assert.ok(isPng(await bytesOf(await job.frame(1))));
  assert.ok((await job.result()).size > 0);
  const after = [];
  for await (const { id: number } of job.events({ after: ids[0] })) after.push(number);
  assert.deepEqual(after, ids.filter(number => Number(number) > Number(ids[0])).slice(-after.length));
  assert.ok(after.length < ids.length);
  const all = [];
  for await (const { id } of daemon.jobs()) all.push(id);
  assert.ok(all.includes(job.id));
  await job.remove();
  await assert.rejects(daemon.job(job.id), { status: 404 });
});

test("what the service counts, live", async () => {
  for await (const stats of daemon.events()) {
    assert.equal(typeof stats.metrics, "object");
    break;
  }
});

test("Retry-After is waited for, in seconds or as a date, and the tries are counted", async () => {
  const busy = await stub((request, response, number) => {
    const last = number === 2;
    response.writeHead(last ? 200 : number ? 503 : 429, { "Content-Type": "application/json",
      "Retry-After": number ? new Date(Date.now() - 5000).toUTCString() : "1" });
    response.end(last ? "{\"techniques\": []}" : "{\"retryable\": true}");
  });
  const begun = performance.now();
  assert.deepEqual(await new Penumbra(busy.url, { retries: 2 }).techniques(), []);
  assert.ok(performance.now() - begun >= 990);
  busy.close();
  const full = await stub((request, response) => {
    response.writeHead(503, { "Retry-After": "0" });
    response.end();
  });
  await assert.rejects(new Penumbra(full.url, { retries: 3 }).techniques(), { status: 503 });
  assert.equal(full.asked, 4);
  await assert.rejects(new Penumbra(full.url, { retries: 0 }).techniques(), { status: 503 });
  assert.equal(full.asked, 5);
  full.close();
});

test("what is not for now is not sent twice", async () => {
  const wrong = await stub((request, response) => {
    response.writeHead(422, { "Content-Type": "application/problem+json" });
    response.end("{\"status\": 422, \"detail\": \"no\", \"retryable\": false}");
  });
  await assert.rejects(new Penumbra(wrong.url).techniques(), { status: 422, message: "no" });
  assert.equal(wrong.asked, 1);
  wrong.close();
});

test("events go on behind the last one when the connection breaks", async () => {
  const seen = [];
  const broken = await stub((request, response, number) => {
    seen.push(request.headers["last-event-id"]);
    if (number === 2) return response.writeHead(204).end();
    response.writeHead(200, { "Content-Type": "text/event-stream" });
    response.write("id: " + (number + 5) + "\nevent: state\ndata: {\"n\": " + number + "}\n\n");
    if (number) response.end();
    else setTimeout(() => response.destroy(), 50);
  });
  const told = [];
  for await (const { data } of new Penumbra(broken.url).listen("v1/jobs/1/events")) told.push(data.n);
  assert.deepEqual(told, [0, 1]);
  assert.deepEqual(seen, [undefined, "5", "6"]);
  broken.close();
});

test("event streams in whatever pieces they come", async () => {
  const text = ": hello\r\n\r\nid: 7\r\nevent: a\r\ndata: {\"x\":\r\ndata: \"é\"}\r\n\r\n" +
    "data: 2\n\nretry: 9\n\ndata\rdata:3\r\r";
  const bytes = new TextEncoder().encode(text);
  for (const step of [1, 2, 3, 7, bytes.length]) {
    const stream = new ReadableStream({ start(controller) {
      for (let at = 0; at < bytes.length; at += step)
        controller.enqueue(bytes.subarray(at, at + step));
      controller.close();
    } });
    const told = [];
    for await (const event of readEvents(stream)) told.push(event);
    assert.deepEqual(told, [{ event: "a", id: "7", data: { x: "é" } },
      { event: "message", id: "7", data: 2 }, { event: "message", id: "7", data: 3 }]);
  }
});

test("a token is sent, and a path in front of the service is kept", async () => {
  const guarded = await stub((request, response) => {
    response.writeHead(200, { "Content-Type": "application/json" });
    response.end(JSON.stringify({ techniques: [request.headers.authorization, request.url] }));
  });
  assert.deepEqual(await new Penumbra(guarded.url + "/shadows", { token: "secret" }).techniques(),
    ["Bearer secret", "/shadows/v1/techniques"]);
  guarded.close();
});
