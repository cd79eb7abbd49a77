"""Sessions: what a frame of `temporal` knows of those before, whose it is, and what of HTTP's
statelessness it does not have."""
import json
import os
import signal
import threading
import unittest

import harness
from harness import Daemon, wait
from pictures import read_png, sliding_box

SMALL = {"width": 64, "height": 48, "sky": False, "edges": "none",
         "technique": {"name": "temporal", "params": {"map_size": 256}}}
VIEW = {"camera": {"orbit": {"azimuth_deg": 30}}}


def frames(answer):
    """Frames and share that a picture says it rests on besides itself."""
    parts = dict(p.split("=") for p in answer.headers["X-Penumbra-History"].split(", "))
    return int(parts["frames"]), float(parts["share"])


class Session(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.d = Daemon("--client-share=0", "--warm-up=off")
        cls.scene = cls.d.upload(sliding_box())

    @classmethod
    def tearDownClass(cls):
        cls.d.kill()

    def picture(self, session=None, fresh=False, **more):
        request = dict(SMALL, **VIEW)
        if session is not None:
            request["session"] = session
        answer = self.d.render(self.scene, dict(request, **more), fresh=fresh)
        self.assertEqual(answer.status, 200, answer.body[:300])
        return answer

    def test_frames_go_on(self):
        alone = self.picture(fresh=True)
        self.assertIn("ETag", alone.headers)
        self.assertNotIn("X-Penumbra-History", alone.headers)
        bodies = []
        for n in range(4):
            answer = self.picture("a")
            self.assertEqual(frames(answer), (n, min(n, 1)))
            self.assertEqual(answer.headers["Cache-Control"], "no-store")
            for name in ("ETag", "Content-Location"):
                self.assertNotIn(name, answer.headers)
            bodies.append(answer.body)
        self.assertEqual(bodies[0], alone.body)
        self.assertEqual(len(set(bodies)), 4)
        # Another name, the same requests: the same pictures.
        self.assertEqual([self.picture("b").body for _ in range(4)], bodies)
        # A session is not in the way of what stands for itself.
        again = self.picture(fresh=False)
        self.assertEqual(again.body, alone.body)
        self.assertEqual(self.picture("").headers["ETag"], alone.headers["ETag"])
        # Nothing was kept: what a client claims to have does not count.
        answer = self.d.render(self.scene, dict(SMALL, session="a", **VIEW), fresh=False,
                               If_None_Match=alone.headers["ETag"])
        self.assertEqual((answer.status, frames(answer)[0]), (200, 4))

    def test_other_methods_do_not_look(self):
        hard = self.picture(technique="hard")
        named = self.picture("a", technique="hard")
        self.assertEqual(named.body, hard.body)
        self.assertEqual(named.headers["ETag"], hard.headers["ETag"])

    def test_record(self):
        def record(**more):
            answer = self.d.render(self.scene, dict(SMALL, **VIEW, **more), Accept="application/json")
            self.assertEqual(answer.status, 200, answer.body)
            return answer.json()
        for n in range(3):
            told = record(session="r")
            self.assertEqual(told["history"], {"session": "r", "frames": n, "share": min(n, 1)})
            self.assertEqual(told["request"]["session"], "r")
            self.assertNotIn("etag", told["image"])
            self.assertNotIn("href", told["image"])
        self.assertNotIn("history", record())
        self.assertNotIn("history", record(session="r", technique="hard"))

    def test_a_light_that_is_chosen_stands_still(self):
        lights = []
        for azimuth in (0, 40, 80):
            answer = self.d.render(self.scene, dict(
                SMALL, session="key", camera={"orbit": {"azimuth_deg": azimuth}}), Accept="application/json")
            lights.append(answer.json()["request"]["lights"])
            self.assertEqual(answer.json()["history"]["frames"], len(lights) - 1)
        self.assertEqual(lights[0], lights[1])
        self.assertEqual(lights[0], lights[2])

    def test_two_at_a_time(self):
        """Frames of one session come one after the other; other sessions beside them."""
        answers = []

        def ask(session):
            answers.append((session, self.d.render(
                self.scene, dict(SMALL, session=session, antialias=8, **VIEW), timeout=300)))
        threads = [threading.Thread(target=ask, args=("ab"[n % 2],)) for n in range(12)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual({a.status for _, a in answers}, {200})
        for session in "ab":
            told = sorted(frames(a)[0] for s, a in answers if s == session)
            self.assertEqual(told, list(range(6)))

    def test_a_worker_that_dies(self):
        for n in range(3):
            self.assertEqual(frames(self.picture("w"))[0], n)
        worker = self.d.worker()
        os.kill(worker, signal.SIGKILL)
        wait(lambda: self.d.worker() != worker)
        self.assertEqual(frames(self.picture("w")), (0, 0))
        self.assertEqual(frames(self.picture("w")), (1, 1))

    def test_names(self):
        self.picture("")
        worker = self.d.worker()
        for name in ("x" * 59, "\u00e4\u2603", "a b/../%00&=", "7"):
            self.assertEqual(frames(self.picture(name))[0], 0, name)
            self.assertEqual(frames(self.picture(name))[0], 1, name)
        for name in ("x" * 60, "x" * 5000, ["a"], {"a": 1}, None, True, "a\0b",
                     "\n\t\x01"):
            answer = self.d.render(self.scene, dict(SMALL, session=name))
            self.assertEqual(answer.status // 100, 4, (name, answer.body[:200]))
            if name != "a\0b":
                self.assertIn("session", answer.json().get("pointer", ""), name)
        answer = self.d.get("/v1/scenes/%s/render?technique=temporal&width=32&height=32&session=%s" %
                            (self.scene, "%ff%fe"))
        self.assertIn(answer.status, (200, 400, 422))
        self.assertEqual(self.d.worker(), worker)

    def test_many_names_and_sizes(self):
        """Neither makes the worker grow: the oldest sessions leave."""
        def memory():
            return self.d.render(self.scene, dict(SMALL, session="m"),
                                 Accept="application/json").json()["gpu_bytes"]
        for n in range(20):
            self.picture("n%d" % n)
        before = memory()
        for n in range(30):
            self.picture("o%d" % n)
        self.assertLessEqual(memory(), before + (1 << 20))
        for n in range(8):
            answer = self.picture("size", width=40 + 7 * n, height=90 - 3 * n)
            self.assertEqual(frames(answer)[0], 0)
        self.assertEqual(frames(self.picture("o29"))[0], 1)
        self.assertEqual(frames(self.picture("n0"))[0], 0)
        for camera in ({"eye": [float("nan"), 0, 0]}, {"eye": [1e300, 0, 0]},
                       {"eye": [0, 0, 0], "target": [0, 0, 0]}, {"orbit": {"azimuth_deg": float("inf")}}):
            answer = self.d.render(self.scene, dict(SMALL, session="o29", camera=camera))
            self.assertIn(answer.status, (400, 422), answer.body)
        self.assertEqual(frames(self.picture("o29"))[0], 2)

    def test_compare_has_no_history(self):
        self.picture("c")
        body = {"techniques": ["temporal"], "reference": "raytraced", "width": 64, "height": 48,
                "session": "c"}
        answers = [self.d.call("POST", "/v1/scenes/%s/compare" % self.scene, json.dumps(body),
                               {"Content-Type": "application/json"}, timeout=300) for _ in range(2)]
        self.assertEqual({a.status for a in answers}, {200}, answers[0].body[:300])
        first, second = ([m["rmse"] for m in a.json()["methods"]] for a in answers)
        self.assertEqual(first, second)
        self.assertEqual(frames(self.picture("c"))[0], 1)


class Workers(unittest.TestCase):
    """Of several workers one has what a session's frames have left."""

    def setUp(self):
        self.d = Daemon("--client-share=0", "--workers=3")
        self.addCleanup(self.d.kill)
        wait(lambda: self.d.metric("penumbra_workers_up") == 3)
        self.scene = self.d.upload(sliding_box())

    def frame(self, session):
        answer = self.d.render(self.scene, dict(SMALL, session=session, **VIEW), timeout=300)
        self.assertEqual(answer.status, 200, answer.body)
        return frames(answer)[0]

    def test_frames_go_where_the_last_one_is(self):
        told = {name: [] for name in "abcdef"}

        def ask(name):
            for _ in range(5):
                told[name].append(self.frame(name))
        threads = [threading.Thread(target=ask, args=(name,)) for name in told]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(told, {name: list(range(5)) for name in told})

    def test_workers_that_are_gone(self):
        self.assertEqual([self.frame("s") for _ in range(3)], [0, 1, 2])
        workers = self.d.children("penumbra-worker")
        for pid in workers:  # the session's is among them
            os.kill(pid, signal.SIGKILL)
        wait(lambda: self.d.metric("penumbra_workers_up") == 3 and
             not set(workers) & set(self.d.children("penumbra-worker")))
        self.assertEqual([self.frame("s") for _ in range(3)], [0, 1, 2])


class Moving(unittest.TestCase):
    """A plate slides over a floor: its shadow leaves no trail."""

    def visibility(self, scene, **request):
        answer = self.d.render(scene, dict(
            request, width=128, height=96, ground=False, sky=False, edges="none",
            camera={"eye": [0, 2.6, 3.6], "target": [0, 0.2, 0]}, animation="slide",
            lights=[{"type": "rect", "position": [0, 4, 0], "target": [0, 0, 0], "up": [0, 0, 1],
                     "width": 0.8, "height": 0.8}],
            output={"layer": "visibility", "bit_depth": 16}))
        self.assertEqual(answer.status, 200, answer.body[:300])
        return [p[0] / 65535 for row in read_png(answer.body)[2] for p in row]

    @staticmethod
    def is_lit_around(truth, i):
        """Not at the rim of the penumbra as it is now, over which steps are smoothed."""
        return all(0 <= i + 128 * y + x < len(truth) and truth[i + 128 * y + x] > 0.99
                   for y in range(-2, 3) for x in range(-2, 3))

    def test_no_trail(self):
        self.d = Daemon("--warm-up=off")
        self.addCleanup(self.d.kill)
        scene = self.d.upload(sliding_box())
        rays = {"name": "raytraced", "params": {"samples": 64}}
        shadow = None
        for _ in range(12):  # the past has all its weight
            self.visibility(scene, technique="temporal", session="s", time_s=1)
        before = self.visibility(scene, technique=rays, time_s=1)
        for n in range(1, 13):
            ours = self.visibility(scene, technique="temporal", session="s", time_s=1 + 0.1 * n)
            if n == 4:
                shadow = self.visibility(scene, technique=rays, time_s=1 + 0.1 * n)
        truth = self.visibility(scene, technique=rays, time_s=1 + 0.1 * 12)
        # Where it was long ago, and where it was eight frames ago, there is none; nor is light left
        # where it is now.
        for was, what in ((before, "at first"), (shadow, "eight frames ago")):
            left = [1 - o for i, (o, w) in enumerate(zip(ours, was))
                    if w < 0.3 and self.is_lit_around(truth, i)]
            self.assertGreater(len(left), 50, what)
            self.assertLess(sum(left) / len(left), 0.03, what)
            self.assertLess(max(left), 0.1, what)
        dark = [o for o, t in zip(ours, truth) if t < 0.01]
        self.assertGreater(len(dark), 50)
        self.assertLess(sum(dark) / len(dark), 0.05)


if __name__ == "__main__":
    harness.main()
