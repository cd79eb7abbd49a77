"""Full queues, used-up shares, deadlines, sharing, caches, budgets: what the service does when asked
for more than it has."""
import base64
import json
import os
import re
import shutil
import ssl
import struct
import subprocess
import tempfile
import threading
import time
import unittest
import urllib.request
import zlib

import harness
from pictures import chunk, mesh_scene
from harness import HEAVY, IN_TURNS, PATIENCE, SMALL, Daemon, grid_scene, wait


def textured_scene(side, seed):
    """A square under three textures of side x side; each takes 16 / 3 side^2 bytes of memory."""
    slots = ("baseColorTexture", "metallicRoughnessTexture")
    head = chunk(b"IHDR", struct.pack(">IIBBBBB", side, side, 8, 2, 0, 0, 0))
    images = [b"\x89PNG\r\n\x1a\n" + head + chunk(b"IDAT", zlib.compress(
        (b"\0" + bytes((seed, 40 * i, 200)) * side) * side, 1)) + chunk(b"IEND", b"") for i in range(3)]
    uris = ["data:image/png;base64," + base64.b64encode(i).decode() for i in images]
    return mesh_scene([(x, 0.5, z) for x in (-1, 1) for z in (-1, 1)], [(0, 1, 0)] * 4,
                      [0, 1, 2, 2, 1, 3], material={
        "pbrMetallicRoughness": {slot: {"index": i} for i, slot in enumerate(slots)},
        "emissiveTexture": {"index": 2}, "emissiveFactor": [1, 1, 1]},
        images=[{"uri": u} for u in uris], textures=[{"source": i} for i in range(3)])


class Crowd:
    """Requests that run at the same time."""

    def __init__(self):
        self.threads, self.answers = [], []

    def add(self, function, *args, **named):
        thread = threading.Thread(target=lambda: self.answers.append(function(*args, **named)))
        thread.start()
        self.threads.append(thread)

    def join(self):
        for t in self.threads:
            t.join()
        return self.answers


class Limits(unittest.TestCase):
    def daemon(self, *flags, **named):
        d = Daemon(*flags, **named)
        self.addCleanup(d.kill)
        self.addCleanup(lambda: self.assertEqual(d.stop(), 0))
        return d

    def brief(self, n):
        """Renders that differ, and that only a paused worker keeps waiting."""
        return dict(SMALL, exposure_ev=n / 16, deadline_ms=600000)

    def test_full_queue(self):
        d = self.daemon("--queue-limit=2", "--client-share=0")
        scene = d.upload(grid_scene(4))
        d.render(scene, SMALL)  # the worker is up
        crowd = Crowd()
        with d.paused():
            for n in range(IN_TURNS + 2):  # the last two are in the queue
                crowd.add(d.render, scene, self.brief(n))
                wait(lambda: d.metric("penumbra_renders_running") +
                     d.metric("penumbra_queue_depth") > n)
            full = d.render(scene, self.brief(99))
            self.assertEqual(full.status, 503, full.body)
            self.assertGreaterEqual(int(full.headers["Retry-After"]), 1)
            self.assertTrue(full.json()["retryable"])
            ready = d.admin("/readyz")
            self.assertEqual((ready.status, ready.body), (503, b"The queue is full."))
            self.assertEqual(d.admin("/livez").status, 200)
            self.assertEqual(d.get("/v1").status, 200)
        self.assertEqual({a.status for a in crowd.join()}, {200})
        self.assertEqual(d.metric("penumbra_renders_refused_full_total"), 1)
        wait(lambda: d.admin("/readyz").status == 200)

    def test_share_of_a_client(self):
        tokens = tempfile.NamedTemporaryFile("w", suffix=".tokens")
        tokens.write("# two clients\nalice alices-token-0123456789\nbobs-token-0123456789\n")
        tokens.flush()
        d = self.daemon("--client-share=2", "--token-file=" + tokens.name)
        alice = {"Authorization": "Bearer alices-token-0123456789"}
        bob = {"Authorization": "Bearer bobs-token-0123456789"}
        for head in ({}, {"Authorization": "Bearer alices-token-012345678"},
                     {"Authorization": "Basic alices-token-0123456789"}):
            refused = d.call("GET", "/v1/scenes", headers=head)
            self.assertEqual(refused.status, 401)
            self.assertEqual(refused.headers["WWW-Authenticate"], "Bearer")
        self.assertEqual(d.get("/openapi.json").status, 200)
        answer = d.call("POST", "/v1/scenes", grid_scene(4),
                        {"Content-Type": "model/gltf-binary", **alice})
        scene = answer.json()["id"]
        self.assertEqual(d.render(scene, SMALL, **alice).status, 200)
        crowd = Crowd()
        with d.paused():
            for n in range(2):
                crowd.add(d.render, scene, self.brief(n), **alice)
            wait(lambda: d.metric("penumbra_renders_running") == 2)
            refused = d.render(scene, self.brief(3), **alice)
            self.assertEqual(refused.status, 429, refused.body)
            self.assertGreaterEqual(int(refused.headers["Retry-After"]), 1)
            crowd.add(d.render, scene, SMALL, **bob)
            wait(lambda: d.metric("penumbra_renders_running") == 3)
        self.assertEqual({a.status for a in crowd.join()}, {200})
        self.assertEqual(d.render(scene, SMALL, **alice).status, 200)
        self.assertNotIn("alices-token", d.log())

    def test_deadline(self):
        d = self.daemon()
        scene = d.upload(grid_scene(4))
        self.assertEqual(d.render(scene, SMALL).status, 200)
        with d.paused():  # the answer does not wait for the worker
            start = time.monotonic()
            late = d.render(scene, dict(self.brief(0), deadline_ms=150))
            took = time.monotonic() - start
            self.assertEqual(late.status, 504, late.body)
            self.assertGreater(took, 0.14)
            # Behind it in the queue.
            queued = d.render(scene, dict(SMALL, exposure_ev=3, deadline_ms=1))
            self.assertEqual(queued.status, 504)
        self.assertEqual(d.render(scene, SMALL).status, 200)

    def test_identical_requests_share_one_render(self):
        d = self.daemon()
        scene = d.upload(grid_scene(4))
        d.render(scene, SMALL)
        crowd = Crowd()
        for n in range(20):
            crowd.add(d.render, scene, dict(HEAVY, deadline_ms=600000), fresh=False)
        answers = crowd.join()
        self.assertEqual({a.status for a in answers}, {200})
        self.assertEqual(len({a.body for a in answers}), 1)
        self.assertEqual(d.metric("penumbra_renders_total", '{technique="multisample"}'), 1)

    def test_interactive_before_batch(self):
        d = self.daemon("--client-share=0")
        scene = d.upload(grid_scene(4))
        d.render(scene, SMALL)
        order = []

        def ask(name, request):
            self.assertEqual(d.render(scene, request).status, 200)
            order.append(name)

        crowd = Crowd()
        with d.paused():
            for n in range(IN_TURNS):
                crowd.add(ask, "first", self.brief(n))
            wait(lambda: d.metric("penumbra_renders_running") == IN_TURNS)
            for n in range(3):
                crowd.add(ask, "batch", dict(HEAVY, exposure_ev=n, priority="batch",
                                                 deadline_ms=600000))
            wait(lambda: d.metric("penumbra_queue_depth") == 3)
            crowd.add(ask, "interactive", dict(SMALL, exposure_ev=9))
            wait(lambda: d.metric("penumbra_queue_depth") == 4)
        crowd.join()
        self.assertLess(order.index("interactive"), order.index("batch"), order)

    def test_same_request_same_bytes(self):
        """100 repeats that are all rendered, between other pictures and after eviction."""
        d = self.daemon("--gpu-memory=24M")
        scene = d.upload(grid_scene(40, "repeated"))
        others = [d.upload(grid_scene(90 + n, "other %d" % n)) for n in range(3)]
        request = {"technique": {"name": "pcss"}, "width": 120, "height": 90}
        first = d.render(scene, request)
        for n in range(100):
            if n % 10 == 5:
                self.assertEqual(d.render(others[n // 10 % 3], SMALL).status, 200)
            again = d.render(scene, request)
            self.assertEqual(again.status, 200)
            self.assertEqual(again.body, first.body, "repeat %d" % n)
        self.assertEqual(d.metric("penumbra_renders_total", '{technique="pcss"}'), 101)

    def test_gpu_memory_budget(self):
        budget = 16 << 20
        d = self.daemon("--gpu-memory=16M")
        scenes = [d.upload(grid_scene(120, "big %d" % n)) for n in range(5)]
        size = d.get("/v1/scenes/" + scenes[0]).json()["gpu_bytes"]
        self.assertGreater(5 * size, budget)
        record = lambda s: d.render(s, SMALL, Accept="application/json").json()
        # One frame's own shadow inputs are needed whatever the budget.
        working_set = record(scenes[0])["gpu_bytes"] - size
        pictures = {}
        for s in scenes + scenes[::-1]:
            pictures.setdefault(s, set()).add(d.render(s, SMALL).body)
            self.assertLessEqual(record(s)["gpu_bytes"], budget + working_set)
        self.assertEqual({len(p) for p in pictures.values()}, {1})
        told = lambda s: d.get("/v1/scenes/" + s).json()["resident"]
        self.assertEqual((told(scenes[0]), told(scenes[4])), (True, False))
        listed = {s["id"]: s["resident"] for s in d.get("/v1/scenes").json()["scenes"]}
        self.assertEqual((listed[scenes[0]], listed[scenes[4]]), (True, False))
        self.assertFalse(record(scenes[4])["cache"]["scene_resident"])
        self.assertTrue(record(scenes[4])["cache"]["scene_resident"])
        whole = self.daemon("--gpu-memory=1M")
        scene = whole.upload(grid_scene(300, "never fits"))
        self.assertEqual(whole.render(scene, SMALL).status, 413)

    def test_memory_follows_the_budget(self):
        """Of the worker's process, the driver's part and mapped files included, at its peak."""
        budget, room = 160, 150  # MiB
        d = self.daemon("--gpu-memory=%dM" % budget)
        d.worker()
        if not d.get("/v1").json()["device"]["software"]:
            self.skipTest("the budget is of the GPU's memory here")
        scenes = [d.upload(textured_scene(2048, n)) for n in range(5)]
        for scene in scenes + scenes[:2]:
            self.assertEqual(d.render(scene, SMALL).status, 200)
            self.assertEqual(d.render(scene, {**SMALL, "technique": "raytraced"}).status, 200)
        with open("/proc/%d/status" % d.worker()) as status:
            peak = int(re.search(r"VmHWM:\s*(\d+) kB", status.read())[1]) >> 10
        self.assertLess(peak, budget + room)

    def test_result_cache_is_bounded(self):
        d = self.daemon("--result-cache=300K")
        scene = d.upload(grid_scene(4))
        for n in range(40):
            self.assertEqual(d.render(scene, dict(SMALL, exposure_ev=n / 8)).status, 200)
        self.assertLessEqual(d.metric("penumbra_cache_bytes"), 300 << 10)
        self.assertGreater(d.metric("penumbra_cache_evictions_total"), 0)
        none = self.daemon("--result-cache=0")
        scene = none.upload(grid_scene(4))
        first = none.render(scene, SMALL, fresh=False)
        again = none.render(scene, SMALL, fresh=False)
        self.assertEqual(first.body, again.body)
        self.assertNotIn("cache", again.timing())
        self.assertEqual(none.metric("penumbra_renders_total", '{technique="hard"}'), 2)

    def test_settings(self):
        for flags in (["--queue-limit=0"], ["--no-such-thing=1"], ["--gpu-memory=x"],
                      ["--device=abacus"], ["--listen=0.0.0.0:0"], ["--listen=nonsense"],
                      ["--tls-cert=/dev/null"], ["--token-file=/dev/null"], ["--require-gpu=maybe"]):
            with self.subTest(flags=flags), self.assertRaises(RuntimeError):
                Daemon(*flags)
        d = self.daemon(env={"PENUMBRA_QUEUE_LIMIT": "7", "PENUMBRA_LOG_FORMAT": "json"})
        self.assertEqual(d.get("/v1").json()["limits"]["queued_renders"], 7)
        lines = [json.loads(l) for l in wait(d.log).strip().split("\n")]
        self.assertTrue(any(l.get("target") == "/v1" and l["status"] == 200 for l in lines))

    def test_require_gpu(self):
        """Never silently software: with --require-gpu a machine without a GPU is refused."""
        d = self.daemon()
        wait(lambda: d.get("/v1").json()["device"])
        if not d.get("/v1").json()["device"]["software"]:
            self.skipTest("there is a GPU")
        refused = Daemon("--require-gpu")
        self.addCleanup(refused.kill)
        self.assertEqual(refused.process.wait(30 * PATIENCE), 3)
        self.assertIn("no device", refused.log())

    def test_tls(self):
        folder = tempfile.mkdtemp()
        self.addCleanup(shutil.rmtree, folder)
        cert, key = os.path.join(folder, "cert"), os.path.join(folder, "key")
        made = subprocess.run(["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt",
                               "ec_paramgen_curve:prime256v1", "-nodes", "-days", "2", "-subj",
                               "/CN=localhost", "-addext", "subjectAltName=IP:127.0.0.1",
                               "-keyout", key, "-out", cert], capture_output=True)
        if made.returncode:
            self.skipTest("openssl cannot make a certificate")
        d = self.daemon("--tls-cert=" + cert, "--tls-key=" + key)
        context = ssl.create_default_context(cafile=cert)
        ask = lambda method, path, body=None, kind=None: urllib.request.urlopen(
            urllib.request.Request("https://127.0.0.1:%d%s" % (d.port, path), body,
                                   {"Content-Type": kind} if kind else {}, method=method),
            context=context, timeout=30 * PATIENCE)
        data = grid_scene(60, "over TLS")
        scene = json.load(ask("POST", "/v1/scenes", data, "model/gltf-binary"))["id"]
        picture = ask("POST", "/v1/scenes/%s/render" % scene, json.dumps(SMALL).encode(),
                      "application/json").read()
        self.assertTrue(picture.startswith(b"\x89PNG"))
        got, closed = harness.raw(d.port, b"GET /v1 HTTP/1.1\r\nHost: x\r\n\r\n", timeout=3)
        self.assertNotIn(b"HTTP/1.1 200", got)
        self.assertTrue(closed)
        with self.assertRaises(RuntimeError):
            Daemon("--tls-cert=" + key, "--tls-key=" + cert)

    def test_cors(self):
        d = self.daemon("--cors-origin=https://example.org")
        answer = d.get("/v1")
        self.assertEqual(answer.headers["Access-Control-Allow-Origin"], "https://example.org")
        asked = d.call("OPTIONS", "/v1/scenes", headers={"Origin": "https://example.org",
                                                        "Access-Control-Request-Method": "POST"})
        self.assertEqual(asked.status, 204)
        self.assertIn("POST", asked.headers["Access-Control-Allow-Methods"])
        self.assertNotIn("Access-Control-Allow-Origin", self.daemon().get("/v1").headers)

    def test_warm_up(self):
        """Ready once the usual request has run. That the rest is compiled some time, load.auto waits
        for: beside other tests it gives way."""
        d = self.daemon("--warm-up=on")
        self.assertEqual(d.admin("/livez").status, 200)
        wait(lambda: d.admin("/readyz").status == 200, seconds=60)
        warm = d.metric("penumbra_worker_warm_up_seconds")
        self.assertGreater(warm, 0)
        self.assertGreater(d.metric("penumbra_program_compiles_total"), 0)
        print("\n  warm-up %.0f ms" % (warm * 1e3))

    def test_the_end_does_not_wait_for_the_shader_cache(self):
        with tempfile.TemporaryDirectory() as empty:
            d = Daemon("--warm-up=on", env={"XDG_CACHE_HOME": empty})
            wait(lambda: d.admin("/readyz").status == 200, seconds=60)
            self.assertEqual(d.stop(), 0)
            d.kill()


if __name__ == "__main__":
    harness.main()
