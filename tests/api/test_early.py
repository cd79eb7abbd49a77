"""Pictures that have to end before their last sample: budget_ms and on_deadline=best."""
import struct
import unittest

import harness
from harness import Daemon, PATIENCE, glb

RECORD = {"Accept": "application/json"}
SIZE = {"width": 160, "height": 120}
RAYS = dict(SIZE, technique={"name": "raytraced", "params": {"samples": 1024}})
# Hours of work, the first samples of which take no time.
ENDLESS = dict(SIZE, technique={"name": "raytraced", "params": {"samples": 65536,
                                                              "adaptive": False}}, antialias=64)


def standing_scene():
    """A triangle that stands on the ground."""
    data = struct.pack("<9f3H", -0.5, 0, 0, 0.5, 0, 0, 0, 1, 0, 0, 1, 2)
    return glb({
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3",
                       "min": [-0.5, 0, 0], "max": [0.5, 1, 0]},
                      {"bufferView": 1, "componentType": 5123, "count": 3, "type": "SCALAR"}],
        "bufferViews": [{"buffer": 0, "byteLength": 36},
                        {"buffer": 0, "byteOffset": 36, "byteLength": 6}],
        "buffers": [{"byteLength": len(data)}]}, data)


def texts(png):
    """The text chunks of a PNG."""
    found, at = {}, 8
    while at < len(png):
        size, kind = struct.unpack(">I4s", png[at:at + 8])
        data = png[at + 8:at + 8 + size]
        if kind == b"tEXt":
            key, value = data.split(b"\0", 1)
            found[key.decode()] = value.decode()
        at += 12 + size
    return found


class Early(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.d = Daemon()
        cls.addClassCleanup(cls.d.kill)
        cls.scene = cls.d.upload(standing_scene())

    def record(self, request, **more):
        answer = self.d.render(self.scene, request, **RECORD, **more)
        self.assertEqual(answer.status, 200, answer.body)
        return answer.json()

    def test_budget(self):
        record = self.record(dict(RAYS, budget_ms=1))
        progress = record["progress"]
        self.assertGreater(progress["samples"], 0)
        self.assertLess(progress["samples"], progress["of"])
        self.assertEqual(progress["of"], 1024)
        self.assertIn("%d of 1024 samples" % progress["samples"], " ".join(record["warnings"]))
        image = self.d.get(record["image"]["href"])
        self.assertEqual(image.status, 200)

    def test_budget_is_enough(self):
        plain = self.d.render(self.scene, RAYS)
        ample = self.d.render(self.scene, dict(RAYS, budget_ms=3600000))
        self.assertEqual(plain.body, ample.body)
        self.assertEqual(plain.headers["ETag"], ample.headers["ETag"])
        self.assertEqual(self.record(dict(RAYS, budget_ms=3600000))["progress"]["samples"], 1024)

    def test_frames(self):
        """Whole jittered frames are what a method can be left after that takes its samples at once."""
        request = dict(SIZE, technique="hard", antialias=64, budget_ms=1)
        progress = self.record(request)["progress"]
        self.assertEqual(progress["of"], 64)
        self.assertGreaterEqual(progress["samples"], 1)
        self.assertLess(progress["samples"], 64)

    def test_sketch(self):
        """What takes its samples at once and cannot have them has cheaper shadows, and says so."""
        request = dict(SIZE, technique="stochastic", budget_ms=1)
        record = self.record(request)
        self.assertEqual((record["progress"]["samples"], record["progress"]["of"]), (0, 1))
        self.assertIn("sketch", " ".join(record["warnings"]))
        self.assertEqual(record["request"]["technique"]["params"]["maps"], 32)
        self.assertEqual(self.d.render(self.scene, request).headers["Cache-Control"], "no-store")
        whole = self.record(dict(request, budget_ms=3600000))
        self.assertEqual(whole["progress"]["samples"], 1)
        self.assertFalse([w for w in whole["warnings"] if "sketch" in w])

    def test_is_nobody_elses(self):
        """What ended early is not kept for the request, and who asks for all gets all."""
        request = dict(SIZE, technique={"name": "multisample", "params": {"samples": 40}})
        early = self.d.render(self.scene, dict(request, budget_ms=1), fresh=False)
        self.assertEqual(early.status, 200)
        self.assertEqual(early.headers["Cache-Control"], "no-store")
        self.assertEqual(texts(early.body)["penumbra:of"], "40")
        self.assertEqual(texts(early.body)["penumbra:samples"], "4")
        full = self.d.render(self.scene, request, fresh=False)
        self.assertNotIn("cache", full.headers["Server-Timing"])
        self.assertNotEqual(full.headers["ETag"], early.headers["ETag"])
        self.assertNotIn("penumbra:of", texts(full.body))
        self.assertEqual(full.headers["Cache-Control"], "no-cache")
        # Better than what was asked for, and at once.
        again = self.d.render(self.scene, dict(request, budget_ms=1), fresh=False)
        self.assertEqual(again.body, full.body)

    def test_is_gone_on_with(self):
        """More samples of what was drawn before are added to it, and nobody sees a difference."""
        def maps(samples, **more):
            return dict(SIZE, technique={"name": "multisample", "params": {"samples": samples}},
                        camera={"orbit": {"azimuth_deg": 77}}, **more)
        self.assertEqual(self.record(maps(16), fresh=False)["progress"]["taken_over"], 0)
        other = self.d.upload(harness.grid_scene(name="between"))
        self.d.render(other, maps(16), fresh=False)
        more = self.record(maps(64), fresh=False)
        self.assertEqual(more["progress"]["taken_over"], 16)
        self.assertEqual(more["shadow_maps"], 64)
        afresh = self.d.render(self.scene, maps(64))
        kept = self.d.get(more["image"]["href"])
        self.assertEqual(kept.body, afresh.body)
        # Who wants a new picture gets one.
        self.assertEqual(self.record(maps(64))["progress"]["taken_over"], 0)
        # Where the time ends is where the next one begins.
        early = self.record(maps(256, budget_ms=1), fresh=False)["progress"]
        late = self.record(maps(256), fresh=False)["progress"]
        self.assertEqual(early["taken_over"], 64)
        self.assertEqual(late["taken_over"], early["samples"])

    def test_error_of_several_lights(self):
        lights = [{"type": "rect", "position": [x, 3, 1], "target": [0, 0, 0]} for x in (-2, 2)]
        request = dict(RAYS, lights=lights, budget_ms=3600000)
        progress = self.record(request)["progress"]
        self.assertEqual(progress["samples"], 1024)
        self.assertGreater(progress["standard_error"], 0)
        self.assertLess(progress["standard_error"], 0.1)

    def test_deadline(self):
        """The endless one has a picture long before, and no end."""
        late = dict(ENDLESS, deadline_ms=int(4000 * PATIENCE), on_deadline="best")
        record = self.record(late)
        progress = record["progress"]
        self.assertGreater(progress["samples"], 0)
        self.assertLess(progress["samples"], progress["of"])
        self.assertEqual(record["request"]["on_deadline"], "best")
        self.assertGreater(progress["standard_error"], 0)
        self.assertLess(progress["standard_error"], 0.5)
        self.assertEqual(self.d.metric("penumbra_worker_restarts_total"), 0)

    def test_nothing_in_time(self):
        for request in (dict(ENDLESS, deadline_ms=1, on_deadline="best"),
                        dict(ENDLESS, deadline_ms=300),
                        dict(ENDLESS, deadline_ms=300, on_deadline="error")):
            answer = self.d.render(self.scene, request)
            self.assertEqual(answer.status, 504, answer.body)
            self.assertEqual(answer.json()["pointer"], "/deadline_ms")

    def test_refused(self):
        for key, value in (("budget_ms", -1), ("budget_ms", 1e300), ("budget_ms", 0.5),
                           ("budget_ms", "soon"), ("budget_ms", None), ("on_deadline", "maybe"),
                           ("on_deadline", 7), ("on_deadline", ["best"])):
            answer = self.d.render(self.scene, dict(SIZE, **{key: value}))
            self.assertEqual(answer.status, 422, (key, value))
            self.assertEqual(answer.json()["pointer"], "/" + key)


if __name__ == "__main__":
    harness.main()
