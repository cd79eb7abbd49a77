// What of penumbra-view needs no document: the camera, the size of pictures, the order of questions.
import assert from "node:assert/strict";
import { test } from "node:test";

const { Latest, Orbit, Pace } = await import(process.env.MODULE);
const near = (given, wanted, tolerance = 1e-9) => given.forEach((value, i) =>
  assert.ok(Math.abs(value - wanted[i]) < tolerance, given + " is not " + wanted));
const minus = (a, b) => a.map((value, i) => value - b[i]);
const dot = (a, b) => a.reduce((sum, value, i) => sum + value * b[i], 0);
const cross = ([a, b, c], [x, y, z]) => [b * z - c * y, c * x - a * z, a * y - b * x];
const unit = v => v.map(value => value / Math.hypot(...v));

/** Where a point is in the picture, in heights of it from the middle, right and down; by the rules of
 * a pinhole camera that looks from eye to target. */
function project({ eye, target, up, fov_y_deg }, point) {
  const forward = unit(minus(target, eye)), right = unit(cross(forward, up));
  const top = cross(right, forward), to = minus(point, eye);
  const height = 2 * dot(to, forward) * Math.tan(fov_y_deg * Math.PI / 360);
  return [dot(to, right) / height, -dot(to, top) / height];
}

test("an orbit's eye stands where its angles say", () => {
  const at = (azimuth_deg, elevation_deg) => new Orbit({ target: [1, 2, 3], azimuth_deg,
    elevation_deg, distance: 2 }).camera.eye;
  near(at(0, 0), [1, 2, 5]); // the front, +z
  near(at(90, 0), [3, 2, 3]); // towards +x
  near(at(180, 0), [1, 2, 1]);
  near(at(0, 30), [1, 3, 3 + Math.sqrt(3)]);
  near(at(45, 45), [2, 2 + Math.SQRT2, 4]);
});

test("the orbit of a camera is that camera", () => {
  for (const eye of [[3, 1, 2], [-4, -0.5, 1], [0.1, 5, 0.2]]) {
    const orbit = Orbit.from({ eye, target: [0.5, 0.25, -1], fov_y_deg: 30 });
    near(orbit.camera.eye, eye);
    near(orbit.camera.target, [0.5, 0.25, -1]);
    assert.equal(orbit.camera.fov_y_deg, 30);
  }
});

test("turning keeps the distance, is undone by turning back, and never goes over the top", () => {
  const orbit = new Orbit({ target: [1, 0, 0], distance: 3, azimuth_deg: 170 }), eye = orbit.camera.eye;
  orbit.turn(-30, 12);
  assert.ok(orbit.azimuth_deg === -160 && orbit.elevation_deg === 37);
  near([Math.hypot(...minus(orbit.camera.eye, orbit.target))], [3]);
  orbit.turn(30, -12);
  near(orbit.camera.eye, eye);
  orbit.turn(0, 500);
  assert.ok(orbit.elevation_deg < 90);
});

test("what is turned follows the pointer", () => {
  const orbit = new Orbit({ azimuth_deg: 20, elevation_deg: 10, distance: 4 });
  const front = orbit.axes.back.map(value => value / 10);
  orbit.turn(3, 2);
  const [right, down] = project(orbit.camera, front);
  assert.ok(right > 0 && down > 0);
});

test("what is panned stays under the pointer", () => {
  for (const elevation_deg of [-40, 0, 65]) {
    const orbit = new Orbit({ target: [1, 2, 3], azimuth_deg: 77, elevation_deg, distance: 7 });
    const point = orbit.target;
    near(project(orbit.camera, point), [0, 0]);
    orbit.pan(0.25, -0.125);
    near(project(orbit.camera, point), [0.25, -0.125]);
  }
});

test("zoom multiplies the distance", () => {
  const orbit = new Orbit({ distance: 2 });
  orbit.zoom(3);
  assert.equal(orbit.distance, 6);
  orbit.zoom(0);
  assert.ok(orbit.distance > 0);
});

test("the picture of a movement is the largest that is made in time", () => {
  for (const full of [5, 50, 91, 92, 400, 1000, 2900]) { // ms of the full picture
    const pace = new Pace(70, 8), took = level => full / 2 ** level;
    for (let i = 0; i < 20; i++) pace.note(took(pace.level));
    assert.ok(took(pace.level) <= 1.3 * 70, full + " ms: level " + pace.level);
    assert.ok(pace.level === 0 || took(pace.level - 1) >= 0.8 * 70, full + ": level " + pace.level);
    near([pace.scale ** 2], [took(pace.level) / full]);
  }
  const pace = new Pace(70, 3);
  pace.note(1e6);
  assert.equal(pace.level, 2);
});

/** A server that is slow: answers when told, counts what is under way, and heeds the signal. */
function slow() {
  const asked = [], under = new Set();
  let most = 0;
  const latest = new Latest((question, signal) => new Promise((resolve, reject) => {
    const job = { question, signal, end: () => { under.delete(job); resolve(); } };
    asked.push(job);
    under.add(job);
    most = Math.max(most, under.size);
    signal.addEventListener("abort", () => { under.delete(job); reject(signal.reason); });
  }));
  return { latest, asked, under, get most() { return most; } };
}
const turn = () => new Promise(resolve => setImmediate(resolve));

test("100 fast changes leave nothing behind and end with the last", async () => {
  for (const pause of [false, true]) {
    const server = slow();
    for (let method = 0; method < 100; method++) {
      server.latest.ask({ method });
      if (pause) await turn();
    }
    await turn();
    assert.equal(server.most, 1);
    assert.deepEqual([...server.under].map(job => job.question.method), [99]);
    assert.equal(server.asked.filter(job => job.signal.aborted).length, server.asked.length - 1);
    if (!pause) assert.equal(server.asked.length, 2); // what came between was never sent
    server.asked.at(-1).end();
    await server.latest.idle();
    assert.equal(server.under.size, 0);
  }
});

test("pictures of a movement are let through, and the newest follows", async () => {
  const server = slow();
  for (let step = 0; step < 50; step++) server.latest.ask({ brief: true, step });
  await turn();
  assert.deepEqual(server.asked.map(job => job.question.step), [0]);
  server.asked[0].end();
  await turn();
  assert.deepEqual(server.asked.map(job => job.question.step), [0, 49]);
  assert.ok(!server.asked.some(job => job.signal.aborted));
  server.latest.ask({ brief: false, step: "rest" }); // the movement is over
  await turn();
  assert.ok(server.asked[1].signal.aborted);
  server.latest.ask({ brief: true, step: "again" }); // and another begins
  await turn();
  assert.ok(server.asked[2].signal.aborted);
  assert.deepEqual([...server.under].map(job => job.question.step), ["again"]);
  server.latest.stop();
  await server.latest.idle();
  assert.equal(server.under.size, 0);
});

test("an answer that fails holds nothing up", async () => {
  let tries = 0;
  const latest = new Latest(async () => { tries++; throw new Error("no"); });
  latest.ask({});
  await latest.idle();
  latest.ask({});
  await latest.idle();
  assert.equal(tries, 2);
});
