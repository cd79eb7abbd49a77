"""POST /v1/scenes/{id}/compare: figures against an independent reading of the pictures, errors."""
import http.client
import json
import os
import signal
import socket
import struct
import subprocess
import threading
import time
import unittest

import harness
from pictures import read_png
from harness import Daemon, grid_scene

VIEW = {"width": 96, "height": 72, "ground": True,
        "camera": {"eye": [0, 2.0, 1.6], "target": [0, 0.1, 0], "fov_y_deg": 50},
        "lights": [{"type": "rect", "position": [0.6, 2.5, 0.4], "target": [0, 0, 0],
                    "width": 0.8, "height": 0.8, "power_w": 60}],
        "deadline_ms": int(60000 * harness.PATIENCE)}
REFERENCE = {"name": "multisample", "params": {"samples": 128}}


def caster_scene():
    """The grid, and a speck of it half a metre lower, so that the ground lies there."""
    data = grid_scene(2, "compare")
    size, = struct.unpack("<I", data[12:16])
    document = json.loads(data[20:20 + size])
    document["nodes"].append({"mesh": 0, "scale": [0.01, 0.01, 0.01], "translation": [0, -0.005, 0]})
    document["scenes"][0]["nodes"] = [0, 1]
    return harness.glb(document, data[28 + size:])


class Compare(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.d = Daemon()
        cls.id = cls.d.upload(caster_scene())

    @classmethod
    def tearDownClass(cls):
        status = cls.d.stop()
        assert status == 0, status
        cls.d.kill()

    def compare(self, body, status=200):
        answer = self.d.call("POST", "/v1/scenes/%s/compare" % self.id, json.dumps(body),
                             {"Content-Type": "application/json"})
        self.assertEqual(answer.status, status, answer.body)
        return answer.json()

    def picture(self, href):
        answer = self.d.get(href)
        self.assertEqual(answer.status, 200)
        self.assertEqual(answer.headers["Content-Type"], "image/png")
        return read_png(answer.body)[2]

    def test_colours(self):
        """One mean visibility times the light's mean colour is wrong in every channel, and right in
        the mean: only the coloured figures tell it from cells that take their own colours."""
        light = {"type": "rect", "width": 1.5, "height": 1.5,
                 "texture": {"pattern": "two-colour"}}
        modes = [{"name": "adaptive", "params": {"mode": mode}} for mode in ("average", "fixed2")]
        mean, cells = self.compare({**VIEW, "lights": [light], "techniques": modes,
                                    "reference": REFERENCE})["methods"]
        self.assertLess(abs(mean["rmse"] - cells["rmse"]), 0.5 * max(mean["rmse"], cells["rmse"]))
        for mean_error, cell_error in zip(mean["rmse_channels"][:2], cells["rmse_channels"][:2]):
            self.assertGreater(mean_error, 1.5 * cell_error)
        self.assertGreater(mean["rmse_picture"], cells["rmse_picture"])

    def test_figures(self):
        methods = ["hard", "pcss", REFERENCE, {"name": "multisample", "params": {"samples": 4}}]
        answer = self.compare({**VIEW, "techniques": methods, "reference": REFERENCE})
        hard, pcss, same, few = answer["methods"]
        self.assertEqual([m["technique"]["name"] for m in answer["methods"]],
                         ["hard", "pcss", "multisample", "multisample"])
        self.assertEqual(answer["reference"]["technique"]["params"]["samples"], 128)
        # The reference against itself.
        self.assertEqual((same["rmse"], same["flip"], same["mean_error"]), (0, 0, 0))
        self.assertEqual((same["rmse_channels"], same["rmse_picture"]), ([0, 0, 0], 0))
        self.assertAlmostEqual(same["ssim"], 1, places=6)
        self.assertAlmostEqual(same["ssim_contrast"], 1, places=6)
        # More samples are nearer, and soft is nearer than hard.
        self.assertLess(pcss["rmse"], 0.5 * hard["rmse"])
        self.assertLess(few["rmse_penumbra"], hard["rmse_penumbra"])
        for m in (hard, pcss, few):
            self.assertGreater(m["rmse_penumbra"], m["rmse"])
            self.assertGreater(m["penumbra_pixels"], 50)
            self.assertLess(m["ssim"], 1)
            self.assertGreaterEqual(m["ssim_contrast"], m["ssim"])
            # One white light: all channels are the mean visibility.
            for channel in m["rmse_channels"]:
                self.assertAlmostEqual(channel, m["rmse"], delta=2e-3 * m["rmse"] + 1e-6)
            self.assertGreater(m["rmse_picture"], 0)
            self.assertGreater(m["flip"], 0)
            self.assertGreater(m["shadow_ms"], 0)
            self.assertGreaterEqual(m["total_ms"], m["shadow_ms"])
            self.assertTrue(any(p["stage"] == "technique" for p in m["passes"]), m["passes"])

    def test_figures_are_those_of_the_renders(self):
        """RMSE anew from 16-bit pictures of the visibility that ordinary renders give."""
        answer = self.compare({**VIEW, "techniques": ["hard"], "reference": REFERENCE})
        planes = []
        for technique in ("hard", REFERENCE):
            image = self.d.render(self.id, {**VIEW, "technique": technique,
                                            "output": {"layer": "visibility"}})
            self.assertEqual(image.status, 200)
            rows = read_png(image.body)[2]
            # The light is white: its colour channels are the mean visibility.
            planes.append([p[0] / 255 for row in rows for p in row])
        square = sum((a - b) ** 2 for a, b in zip(*planes)) / len(planes[0])
        self.assertAlmostEqual(answer["methods"][0]["rmse"], square ** 0.5, delta=2e-3)

    def test_pictures(self):
        answer = self.compare({**VIEW, "techniques": ["hard", REFERENCE], "reference": REFERENCE})
        hard, same = answer["methods"]
        # The picture is the one that a render gives, to one step of 255.
        shown = self.picture(hard["links"]["image"])
        image = self.d.render(self.id, {**VIEW, "technique": "hard"})
        rendered = read_png(image.body)[2]
        worst = max(abs(a - b) for r, s in zip(shown, rendered) for p, q in zip(r, s)
                    for a, b in zip(p[:3], q[:3]))
        self.assertLessEqual(worst, 1)
        white = {(255, 255, 255)}
        self.assertEqual({p[:3] for r in self.picture(same["links"]["difference"]) for p in r},
                         white)
        self.assertEqual({p[:3] for r in self.picture(same["links"]["ssim_map"]) for p in r}, white)
        self.assertEqual({p[:3] for r in self.picture(same["links"]["flip_map"]) for p in r},
                         {(0, 0, 0)})
        # Hard shadows are too light in one half of a penumbra and too dark in the other.
        difference = [p for r in self.picture(hard["links"]["difference"]) for p in r]
        self.assertTrue(any(p[0] == 255 and p[1] < 100 for p in difference))
        self.assertTrue(any(p[2] == 255 and p[1] < 100 for p in difference))

    def test_wrong_scale_shows(self):
        """A penumbra of half its width, as from a light of half its size, is far from the truth."""
        light = {**VIEW["lights"][0], "width": 0.4, "height": 0.4}
        planes = []
        for lights, technique in ((VIEW["lights"], REFERENCE), (VIEW["lights"], "pcss"),
                                  ([light], "pcss")):
            image = self.d.render(self.id, {**VIEW, "lights": lights, "technique": technique,
                                            "output": {"layer": "visibility"}})
            planes.append([p[0] / 255 for row in read_png(image.body)[2] for p in row])
        right, wrong = (sum((a - b) ** 2 for a, b in zip(planes[0], p)) for p in planes[1:])
        self.assertGreater(wrong, 2.5 * right)

    def test_default_reference(self):
        answer = self.compare({**VIEW, "width": 32, "height": 24, "techniques": ["hard"]})
        reference = answer["reference"]["technique"]
        self.assertEqual(reference["params"]["samples"], 1024)
        names = [t["name"] for t in self.d.get("/v1/techniques").json()["techniques"]]
        if "raytraced" in names:
            self.assertEqual((reference["name"], answer["warnings"]), ("raytraced", []))
        else:
            self.assertEqual(reference["name"], "multisample")
            self.assertIn("raytraced", answer["warnings"][0])

    def test_all(self):
        answer = self.compare({**VIEW, "width": 32, "height": 24, "techniques": "all",
                               "reference": {"name": "multisample", "params": {"samples": 16}}})
        names = [t["name"] for t in self.d.get("/v1/techniques").json()["techniques"]]
        compared = [m["technique"]["name"] for m in answer["methods"]]
        self.assertEqual(set(compared), set(names) - {"multisample", "auto"})
        self.assertEqual([m for m in answer["methods"] if "error" in m], [])

    def test_refused(self):
        for body, pointer in (
                ({"techniques": []}, "/techniques"),
                ({"techniques": "some"}, "/techniques"),
                ({"techniques": ["hard", "nothing"]}, "/techniques/1"),
                ({"techniques": [{"name": "pcss", "params": {"filter_taps": -1}}]},
                 "/techniques/0/params/filter_taps"),
                ({"reference": {"name": "none", "params": {"x": 1}}}, "/reference/params/x"),
                ({"technique": "pcss"}, "/technique"),
                ({"output": {"layer": "depth"}}, "/output"),
                ({"width": 4000, "height": 4000}, "/width"),
                ({"wide": 1}, "/wide")):
            problem = self.compare(body, 422)
            self.assertEqual(problem.get("pointer"), pointer, problem)
        self.assertEqual(self.compare([], 422)["status"], 422)
        missing = self.d.call("POST", "/v1/scenes/%s/compare" % ("0" * 64), "{}",
                              {"Content-Type": "application/json"})
        self.assertEqual(missing.status, 404)

    def test_deadline(self):
        problem = self.compare({**VIEW, "techniques": ["hard", "pcss"], "deadline_ms": 1}, 504)
        self.assertEqual(problem["pointer"], "/deadline_ms")
        self.assertIn("0 of 3 images", problem["detail"])
        # Half-way through: the worker stands still once the first image is there, and the deadline
        # leaves time for that one, however slow the machine is.
        slow = [{"name": "multisample", "params": {"samples": 1024 - n}} for n in range(20)]
        start = time.monotonic()
        self.compare({**VIEW, "techniques": ["none"], "reference": "none"})
        limit = 10000 + int(10000 * (time.monotonic() - start))
        done = lambda: self.d.metric("penumbra_renders_total", '{technique="none"}')
        before, problems = done(), []
        thread = threading.Thread(target=lambda: problems.append(self.compare(
            {**VIEW, "techniques": ["none"] + slow, "reference": "none", "deadline_ms": limit},
            504)))
        thread.start()
        harness.wait(lambda: done() > before)
        with self.d.paused():
            thread.join()
        self.assertRegex(problems[0]["detail"], r"[1-9]\d* of 22 images")
        # Nothing is left behind that would keep others from being served.
        image = self.d.render(self.id, {**VIEW, "technique": "hard"})
        self.assertEqual(image.status, 200)

    def test_client(self):
        """penumbra compare: an aligned table, and the pictures in a folder."""
        scene = os.path.join(self.d.folder, "scene.glb")
        out = os.path.join(self.d.folder, "out")
        with open(scene, "wb") as file:
            file.write(caster_scene())
        body = os.path.join(self.d.folder, "body.json")
        with open(body, "w") as file:
            json.dump({**VIEW, "reference": REFERENCE}, file)
        run = subprocess.run(
            [os.path.join(harness.BIN, "penumbra"), "compare", scene, "--server",
             "http://127.0.0.1:%d" % self.d.port, "--json", body, "--techniques", "hard,pcss",
             "--out", out], capture_output=True, text=True, timeout=60 * harness.PATIENCE)
        self.assertEqual(run.returncode, 0, run.stderr)
        lines = run.stdout.splitlines()
        self.assertEqual([line.split()[0] for line in lines],
                         ["method", "hard", "pcss", "multisample"])
        self.assertEqual(len({len(line) for line in lines}), 1, run.stdout)
        self.assertEqual(sorted(os.listdir(out)), sorted(
            ["comparison.json", "reference.png"] +
            ["%s%s.png" % (name, kind) for name in ("01-hard", "02-pcss")
             for kind in ("", "-difference", "-ssim", "-flip")]))
        with open(os.path.join(out, "comparison.json")) as file:
            written = json.load(file)["methods"]
        self.assertEqual("%.5f" % written[0]["rmse"], lines[1].split()[1])
        with open(os.path.join(out, "01-hard-difference.png"), "rb") as file:
            self.assertEqual(read_png(file.read())[:2], (VIEW["width"], VIEW["height"]))
        wrong = subprocess.run(
            [os.path.join(harness.BIN, "penumbra"), "compare", scene, "--server",
             "http://127.0.0.1:%d" % self.d.port, "--techniques", "hard,soft"],
            capture_output=True, text=True, timeout=60 * harness.PATIENCE)
        self.assertEqual(wrong.returncode, 3)
        self.assertIn("soft", wrong.stderr)

    def test_client_without_a_folder(self):
        """A folder that cannot be made is told before anything is rendered; pictures that the
        server does not keep are told too."""
        d = Daemon("--result-cache=0")
        self.addCleanup(d.kill)
        scene = os.path.join(d.folder, "scene.glb")
        with open(scene, "wb") as file:
            file.write(caster_scene())
        command = [os.path.join(harness.BIN, "penumbra"), "compare", scene, "--server",
                   "http://127.0.0.1:%d" % d.port, "--techniques", "hard", "--width", "32",
                   "--height", "24", "--out"]
        run = subprocess.run(command + [scene], capture_output=True, text=True,
                             timeout=60 * harness.PATIENCE)
        self.assertEqual((run.returncode, run.stdout), (1, ""), run.stderr)
        self.assertEqual(d.metric("penumbra_cache_misses_total"), 0)
        out = os.path.join(d.folder, "out")
        run = subprocess.run(command + [out], capture_output=True, text=True,
                             timeout=60 * harness.PATIENCE)
        self.assertEqual(run.returncode, 0, run.stderr)
        self.assertIn("kept no pictures", run.stderr)
        self.assertEqual(os.listdir(out), ["comparison.json"])

    def test_client_leaves(self):
        """When the caller hangs up, the rest is not rendered."""
        slow = [{"name": "multisample", "params": {"samples": 1024 - n}} for n in range(20)]
        body = json.dumps({**VIEW, "techniques": slow, "reference": "none"}).encode()

        abandoned = self.d.metric("penumbra_renders_abandoned_total")
        rendered = lambda: self.d.metric("penumbra_renders_total", '{technique="multisample"}')
        before = rendered() or 0
        with socket.create_connection(("127.0.0.1", self.d.port)) as s:
            s.sendall(b"POST /v1/scenes/%s/compare HTTP/1.1\r\nHost: x\r\nContent-Type: "
                      b"application/json\r\nContent-Length: %d\r\n\r\n" % (
                          self.id.encode(), len(body)) + body)
            harness.wait(lambda: self.d.metric("penumbra_renders_running"))
        harness.wait(lambda: self.d.metric("penumbra_renders_abandoned_total") == abandoned + 1)
        harness.wait(lambda: self.d.metric("penumbra_renders_running") == 0 and
                     self.d.metric("penumbra_queue_depth") == 0)
        self.assertLess((rendered() or 0) - before, len(slow))

    def begin_events(self, body):
        """The answer as server-sent events, and a generator of them."""
        connection = http.client.HTTPConnection("127.0.0.1", self.d.port,
                                                timeout=60 * harness.PATIENCE)
        self.addCleanup(connection.close)
        connection.request("POST", "/v1/scenes/%s/compare" % self.id, json.dumps(body),
                           {"Content-Type": "application/json", "Accept": "text/event-stream"})
        answer = connection.getresponse()

        def events():
            kind = None
            for line in answer:
                field, _, value = line.decode().rstrip("\n").partition(": ")
                if field == "event":
                    kind = value
                elif field == "data":
                    yield kind, json.loads(value)
        return connection, answer, events()

    def test_events(self):
        """The rows of the comparison, one after the other, and it."""
        body = {**VIEW, "techniques": ["hard", "pcss", "vsm"], "reference": REFERENCE}
        _, answer, events = self.begin_events(body)
        self.assertEqual((answer.status, answer.headers["Content-Type"]), (200, "text/event-stream"))
        told = list(events)
        self.assertEqual([kind for kind, _ in told], ["reference"] + 3 * ["method"] + ["done"])
        whole = told[-1][1]
        self.assertEqual([data for _, data in told[:-1]], [whole["reference"]] + whole["methods"])
        figures = [{k: m[k] for k in ("rmse", "rmse_penumbra", "ssim", "flip", "links")}
                   for m in whole["methods"]]
        again = self.compare(body)
        self.assertEqual(figures, [{k: m[k] for k in figures[0]} for m in again["methods"]])
        self.assertEqual(sorted(whole), sorted(again))

    def test_events_refused(self):
        """Before the first picture an error is a plain answer, after it an event."""
        _, answer, _ = self.begin_events({**VIEW, "techniques": ["nothing-like-it"]})
        self.assertEqual(answer.status, 422)
        slow = [{"name": "multisample", "params": {"samples": 1024 - n}} for n in range(20)]
        _, answer, events = self.begin_events({**VIEW, "techniques": slow, "reference": "none"})
        self.assertEqual((answer.status, next(events)[0]), (200, "reference"))
        self.assertEqual(self.d.call("DELETE", "/v1/scenes/" + self.id).status, 204)
        told = list(events)
        self.d.upload(caster_scene())
        self.assertEqual(told[-1][0], "problem")
        self.assertEqual(told[-1][1]["status"], 404)

    def test_events_left(self):
        """Rows are there before the last is measured; when the reader goes, the rest is not."""
        slow = [{"name": "multisample", "params": {"samples": 1024 - n}} for n in range(20)]
        abandoned = self.d.metric("penumbra_renders_abandoned_total")
        connection, answer, events = self.begin_events(
            {**VIEW, "techniques": slow, "reference": "none"})
        self.assertEqual([next(events)[0] for _ in range(2)], ["reference", "method"])
        answer.close()
        connection.close()
        harness.wait(lambda: self.d.metric("penumbra_renders_abandoned_total") == abandoned + 1)
        harness.wait(lambda: self.d.metric("penumbra_renders_running") == 0 and
                     self.d.metric("penumbra_queue_depth") == 0)

    def test_worker_dies(self):
        """A measurement is given to the next worker, like any render."""
        pid = self.d.worker()
        killer = threading.Timer(0.15, lambda: os.kill(pid, signal.SIGKILL))
        killer.start()
        answer = self.compare({**VIEW, "techniques": ["hard", "pcf", "pcss", "vsm", "cssm"],
                               "reference": REFERENCE})
        killer.join()
        self.assertEqual(len([m for m in answer["methods"] if m.get("rmse", 0) > 0]), 5)


class Auto(unittest.TestCase):
    """"technique": "auto" measures once and then chooses."""
    @classmethod
    def setUpClass(cls):
        cls.d = Daemon()
        cls.id = cls.d.upload(caster_scene())
        cls.d.worker()

    @classmethod
    def tearDownClass(cls):
        cls.d.kill()

    def record(self, wish, **more):
        answer = self.d.render(
            self.id, {**VIEW, "technique": {"name": "auto", "params": wish}, **more},
            fresh=False, Accept="application/json")
        self.assertEqual(answer.status, 200, answer.body)
        return answer.json()

    def files(self):
        folder = os.path.join(self.d.store, "scenes", self.id)
        return {name: os.path.getmtime(os.path.join(folder, name))
                for name in os.listdir(folder) if name.startswith("calibration")}

    def check_error(self, record, limit):
        """Its error against raytraced, at the full size, by way of a comparison."""
        request = record["request"]
        compared = self.d.call(
            "POST", "/v1/scenes/%s/compare" % self.id,
            json.dumps({**VIEW, "techniques": [request["technique"]]}),
            {"Content-Type": "application/json"}).json()
        self.assertLessEqual(compared["methods"][0]["rmse"], limit)

    def test_error(self):
        chosen = {}
        for limit in (0.3, 0.02, 0.005):
            record = self.record({"max_rmse": limit})
            chosen[limit] = record["request"]["technique"]["name"]
            self.assertNotEqual(chosen[limit], "auto")
            self.assertIn("max_rmse %g" % limit, record["choice"])
            self.assertTrue(record["choice"].startswith(chosen[limit]))
            self.check_error(record, limit)
        self.assertNotIn(chosen[0.005], ("none", "hard"))

    def test_measures_once(self):
        self.record({"max_rmse": 0.05})
        before = self.files()
        self.assertEqual(len(before), 1)
        renders = self.d.metric("penumbra_cache_misses_total")
        again = self.record({"max_rmse": 0.05}, width=48, height=36)
        self.assertEqual(self.files(), before)
        self.assertLess(self.d.metric("penumbra_cache_misses_total") - renders, 3)
        self.assertGreater(again["total_ms"], 0)
        # Another view has another error: it is measured, and both are kept.
        self.record({"max_rmse": 0.05}, camera={"orbit": {"azimuth_deg": 70}})
        self.assertNotEqual(self.files(), before)

    def test_budget(self):
        wide = self.record({"budget_ms": 50000})
        self.assertEqual(wide["warnings"], [])
        self.assertIn("most accurate", wide["choice"])
        # What nothing meets is served all the same, by what comes nearest, and said.
        tight = self.record({"budget_ms": 0.01})
        self.assertEqual(len(tight["warnings"]), 1)
        self.assertIn("nothing meets", tight["warnings"][0])

    def test_kinds_of_view(self):
        """With a budget alone, times of another view of the same kind will do: a camera or a light
        that moves is not measured anew for every image, more lights are."""
        folder = os.path.join(self.d.store, "scenes", self.id)

        def tables():
            with open(os.path.join(folder, next(iter(self.files())))) as file:
                return len(json.load(file)["tables"])
        self.record({"budget_ms": 50000})
        known = tables()
        light = VIEW["lights"][0]
        for moved in ({"camera": {"orbit": {"azimuth_deg": 33}}},
                      {"lights": [{**light, "position": [0.5, 2.4, 0.4], "power_w": 50}]}):
            record = self.record({"budget_ms": 50000}, **moved)
            self.assertIn("from another view", record["choice"])
        self.assertEqual(tables(), known)
        record = self.record({"budget_ms": 50000},
                             lights=[light, {**light, "position": [-0.5, 2.4, 0.4]}])
        self.assertNotIn("from another view", record["choice"])
        self.assertEqual(tables(), known + 1)

    def test_restart(self):
        """A daemon that is started again knows what was measured; from a damaged file it learns
        nothing, and measures anew."""
        first = self.record({"max_rmse": 0.05})
        self.assertEqual(self.d.stop(), 0)
        self.d.start()
        self.d.worker()
        before = self.files()
        again = self.record({"max_rmse": 0.05})
        self.assertEqual(self.files(), before)
        self.assertEqual(again["choice"].split(",")[0].split(":")[1],
                         first["choice"].split(",")[0].split(":")[1])  # the RMSE
        path = os.path.join(self.d.store, "scenes", self.id, next(iter(before)))
        for damage in (b"", b"{", b"[]", b'{"measured_by": 1}', b"\0" * 5000,
                       b'{"tables": [{"setup": "x"}]}'):
            with open(path, "wb") as file:
                file.write(damage)
            self.record({"max_rmse": 0.05})
            with open(path) as file:
                self.assertEqual(len(json.load(file)["tables"]), 1)

    def test_deleted(self):
        """A scene that goes away while it is measured: an error, and nothing stays behind."""
        scene = self.d.upload(harness.grid_scene(3, "deleted"))
        answers = []
        thread = threading.Thread(target=lambda: answers.append(self.d.render(
            scene, {**VIEW, "technique": "auto"}, fresh=False)))
        thread.start()
        time.sleep(0.3)
        gone = self.d.call("DELETE", "/v1/scenes/" + scene)
        thread.join()
        self.assertEqual(gone.status, 204)
        self.assertIn(answers[0].status, (200, 404), answers[0].body)
        self.assertEqual(self.d.get("/v1/scenes/" + scene).status, 404)
        self.assertEqual(self.d.render(self.id, {**VIEW, "technique": "hard"}).status, 200)

    def test_image(self):
        """As an image: the header says what was taken, and the tag is that of the same request."""
        path = "/v1/scenes/%s/render?technique=auto&max_rmse=0.1&width=64&height=48" % self.id
        first = self.d.get(path)
        self.assertEqual(first.status, 200)
        self.assertEqual(first.headers["Content-Type"], "image/png")
        self.assertIn("max_rmse 0.1", first.headers["X-Penumbra-Choice"])
        again = self.d.get(path, If_None_Match=first.headers["ETag"])
        self.assertEqual(again.status, 304)

    def test_client(self):
        out = os.path.join(self.d.folder, "chosen.png")
        run = subprocess.run(
            [os.path.join(harness.BIN, "penumbra"), "render", self.id, "-o", out, "--server",
             "http://127.0.0.1:%d" % self.d.port, "--technique", "auto", "--set", "max_rmse=0.1",
             "--width", "64", "--height", "48", "--deadline-ms", "60000"],
            capture_output=True, text=True, timeout=60 * harness.PATIENCE)
        self.assertEqual(run.returncode, 0, run.stderr)
        self.assertIn("max_rmse 0.1", run.stderr)
        self.assertTrue(os.path.getsize(out))

    def test_together(self):
        """Requests that come while a view is being measured wait for the same measurement."""
        camera = {"orbit": {"azimuth_deg": 200}}
        records = []
        threads = [threading.Thread(target=lambda: records.append(
            self.record({"max_rmse": 0.1}, camera=camera))) for _ in range(3)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(len({r["choice"] for r in records}), 1)

    def test_deadline(self):
        """One that cannot wait is told so; the measurement goes on for the next."""
        camera = {"orbit": {"azimuth_deg": 300}}
        answer = self.d.render(self.id, {**VIEW, "technique": "auto", "camera": camera,
                                         "deadline_ms": 1})
        self.assertEqual(answer.status, 504, answer.body)
        self.assertTrue(self.record({"max_rmse": 0.1}, camera=camera)["choice"])

    def test_refused(self):
        for params in ({"max_rmse": -1}, {"max_rmse": 2}, {"budget_ms": "1"}, {"speed": 1}):
            answer = self.d.render(self.id, {"technique": {"name": "auto", "params": params}})
            self.assertEqual(answer.status, 422)
        answer = self.d.call("POST", "/v1/scenes/%s/compare" % self.id,
                             json.dumps({"techniques": ["auto"]}),
                             {"Content-Type": "application/json"})
        self.assertEqual((answer.status, answer.json()["pointer"]), (422, "/techniques/0"))


if __name__ == "__main__":
    harness.main()
