"""One slow render stops nobody: others come in between, and a render that nobody waits for ends."""
import hashlib
import http.client
import json
import os
import random
import struct
import threading
import unittest

import harness
from harness import SMALL, Daemon, glb, grid_scene, png, wait

# Takes much longer than everything else here together.
ENDLESS = {"technique": {"name": "multisample", "params": {"samples": 1024}}, "antialias": 64,
           "width": 1600, "height": 1200, "deadline_ms": 3600000}
SAMPLED = [dict(ENDLESS, technique={"name": name, "params": params}) for name, params in (
    ("multisample", {"samples": 1024}), ("raytraced", {"samples": 4096, "backend": "cpu"}),
    ("raytraced", {"samples": 4096, "backend": "gpu"}), ("stochastic", {}), ("adaptive-sampling", {}),
    ("pcss", {}), ("cascaded", {}))]


def moving_scene():
    """A triangle that rises by 0.5 m in a second."""
    data = struct.pack("<9f3H2x2f6f", -0.5, 0, 0, 0.5, 0, 0, 0, 1, 0, 0, 1, 2, 0, 1, 0, 0, 0, 0, 0.5, 0)
    views = [(0, 36), (36, 6), (44, 8), (52, 24)]
    accessor = lambda view, kind, count, shape, **more: dict(
        bufferView=view, componentType=kind, count=count, type=shape, **more)
    return glb({
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [accessor(0, 5126, 3, "VEC3", min=[-0.5, 0, 0], max=[0.5, 1, 0]),
                      accessor(1, 5123, 3, "SCALAR"),
                      accessor(2, 5126, 2, "SCALAR", min=[0], max=[1]), accessor(3, 5126, 2, "VEC3")],
        "animations": [{"samplers": [{"input": 2, "output": 3}],
                        "channels": [{"sampler": 0, "target": {"node": 0, "path": "translation"}}]}],
        "bufferViews": [{"buffer": 0, "byteOffset": at, "byteLength": size} for at, size in views],
        "buffers": [{"byteLength": len(data)}]}, data)


class Turns(unittest.TestCase):
    def setUp(self):
        self.d = Daemon("--client-share=0")
        self.addCleanup(self.d.kill)
        self.scene = self.d.upload(grid_scene(4))
        self.small = self.d.render(self.scene, SMALL)
        self.assertEqual(self.small.status, 200)

    def begin(self, request, scene=None, who="127.0.0.1"):
        """Sends a request of the client `who` without waiting for its answer."""
        connection = http.client.HTTPConnection("127.0.0.1", self.d.port, source_address=(who, 0))
        connection.request("POST", "/v1/scenes/%s/render" % (scene or self.scene), json.dumps(request),
                           {"Content-Type": "application/json", "Cache-Control": "no-cache"})
        self.addCleanup(connection.close)
        return connection

    def running(self):
        return self.d.metric("penumbra_renders_running")

    def check_nothing_happened(self):
        for name in ("worker_restarts", "worker_hangs", "render_retries"):
            self.assertEqual(self.d.metric("penumbra_%s_total" % name), 0, name)
        self.assertEqual(self.d.metric("penumbra_quarantined_scenes"), 0)
        self.assertEqual(self.d.render(self.scene, SMALL).body, self.small.body)

    def test_others_come_in_between(self):
        long = self.begin(ENDLESS)
        wait(lambda: self.running() == 1)
        for method in ("hard", "pcss", "raytraced", "none"):
            answer = self.d.render(self.scene, dict(SMALL, technique=method))
            self.assertEqual(answer.status, 200, answer.body)
            self.assertEqual(self.running(), 1, "the long one has ended, or never began")
        long.close()
        wait(lambda: self.running() == 0)
        self.assertEqual(self.d.metric("penumbra_renders_cancelled_total"), 1)
        self.check_nothing_happened()

    def test_clients_that_leave(self):
        for request in SAMPLED:
            connection = self.begin(request)
            wait(lambda: self.running() == 1)
            connection.close()
            wait(lambda: self.running() == 0)
        self.assertEqual(self.d.metric("penumbra_renders_cancelled_total"), len(SAMPLED))
        self.check_nothing_happened()

    def test_deadlines_free_the_worker(self):
        for request in SAMPLED[:3]:
            answer = self.d.render(self.scene, dict(request, deadline_ms=300))
            self.assertEqual(answer.status, 504, answer.body)
            wait(lambda: self.running() == 0)
        self.check_nothing_happened()

    def test_one_of_two_leaves(self):
        """A render that two wait for goes on for the other."""
        request = dict(SMALL, technique={"name": "multisample", "params": {"samples": 256}})
        answers = []
        with self.d.paused():
            leaves = self.begin(request)  # fresh: of its own
            stays = threading.Thread(target=lambda: answers.append(
                self.d.render(self.scene, request, fresh=False)))
            joins = threading.Thread(target=lambda: answers.append(
                self.d.render(self.scene, request, fresh=False)))
            stays.start()
            wait(lambda: self.running() == 2)
            joins.start()
            wait(lambda: self.d.metric("penumbra_renders_shared_total") == 1)
            leaves.close()
        stays.join()
        joins.join()
        self.assertEqual([a.status for a in answers], [200, 200])
        self.assertEqual(answers[0].body, answers[1].body)
        self.check_nothing_happened()

    def test_largest_picture(self):
        """The largest picture there can be, with everything, ends by its client's leaving."""
        largest = dict(ENDLESS, width=4096, height=4096, technique={"name": "pcss"})
        connection = self.begin(largest)
        wait(lambda: self.running() == 1)
        self.assertEqual(self.d.render(self.scene, SMALL).status, 200)
        connection.close()
        wait(lambda: self.running() == 0)
        self.check_nothing_happened()

    def test_many_that_leave_at_random(self):
        """Memory, descriptors and targets stay as they are, and others are served as ever."""
        choose = random.Random(1)
        for round in range(3):
            for n in range(20):
                request = dict(choose.choice(SAMPLED), width=320, height=200)
                connection = self.begin(request)
                threading.Event().wait(choose.random() * 0.2)
                connection.close()
                if n % 4 == 0:
                    self.assertEqual(self.d.render(self.scene, SMALL).body, self.small.body)
            wait(lambda: self.running() == 0)
            now = self.descriptors()
            if round:
                self.assertLessEqual(now, before)
            before = now
        self.check_nothing_happened()

    def later(self, request, scene=None):
        """A request whose answer comes into the list."""
        answers = []
        thread = threading.Thread(target=lambda: answers.append(
            self.d.render(scene or self.scene, request)))
        thread.start()
        return thread, answers

    def test_a_scene_in_two_poses_waits_its_turn(self):
        scene = self.d.upload(moving_scene())
        pose = lambda time, request=SMALL: dict(request, animation="0", time_s=time)
        still = self.d.render(scene, pose(1))
        self.assertEqual(still.status, 200, still.body)
        long = self.begin(pose(0, ENDLESS), scene)
        wait(lambda: self.running() == 1)
        thread, answers = self.later(pose(1), scene)
        wait(lambda: self.d.metric("penumbra_queue_depth") == 1)
        for _ in range(harness.IN_TURNS + 2):  # others do not wait for it
            self.assertEqual(self.d.render(self.scene, SMALL).body, self.small.body)
        self.assertEqual((answers, self.d.metric("penumbra_queue_depth")), ([], 1))
        long.close()
        thread.join()
        self.assertEqual((answers[0].status, answers[0].body), (200, still.body))
        self.check_nothing_happened()

    def test_what_others_hold_is_waited_for(self):
        """With little GPU memory a scene and an image do not fit beside a scene in use, but alone."""
        big, other = grid_scene(200, "a"), grid_scene(200, "b")
        size = self.d.get("/v1/scenes/" + self.d.upload(big)).json()["gpu_bytes"]
        self.d.kill()
        picture = png(1024, 1024)
        image = hashlib.sha256(picture).hexdigest()
        self.d = Daemon("--client-share=0", "--gpu-memory=%d" % (2 * size + (3 << 20)))
        self.addCleanup(self.d.kill)
        big, other = self.d.upload(big), self.d.upload(other)
        answer = self.d.call("PUT", "/v1/images/" + image, picture, {"Content-Type": "image/png"})
        self.assertIn(answer.status, (200, 201), answer.body)
        lit = dict(SMALL, lights=[{"type": "rect", "position": [0, 2, 0.1], "target": [0, 0, 0],
                                   "width": 1, "height": 1, "texture": {"image": image}}])
        alone = self.d.render(other, lit)
        self.assertEqual(alone.status, 200, alone.body)
        long = self.begin(dict(ENDLESS, width=64, height=48), big)
        wait(lambda: self.running() == 1)
        thread, answers = self.later(lit, other)
        wait(lambda: self.d.metric("penumbra_queue_depth") == 1)
        small = self.d.render(big, SMALL)
        self.assertEqual((small.status, answers), (200, []))
        long.close()
        thread.join()
        self.assertEqual((answers[0].status, answers[0].body), (200, alone.body), answers[0].body[:300])
        # What would not fit alone is told so at once, with the numbers.
        answer = self.d.render(other, dict(SMALL, width=2000, height=2000))
        self.assertEqual(answer.status, 413, answer.body)
        self.assertRegex(answer.json()["detail"], r"\d+ MiB are allowed.*fewer pixels.*--gpu-memory")
        for name in ("worker_restarts", "worker_hangs"):
            self.assertEqual(self.d.metric("penumbra_%s_total" % name), 0, name)

    def test_what_would_be_late_is_refused_at_once(self):
        request = lambda n, **more: dict(
            SMALL, technique={"name": "multisample", "params": {"samples": 64}}, exposure_ev=n,
            deadline_ms=3600000, **more)
        first = self.d.render(self.scene, request(0), Accept="application/json").json()["renderer"]
        self.assertIsNone(first["expected_ms"])
        used = self.d.render(self.scene, request(1), Accept="application/json").json()["renderer"]
        self.assertGreater(used["expected_ms"], 0)
        with self.d.paused():
            waiting = [self.later(request(2 + n)) for n in range(harness.IN_TURNS + 8)]
            wait(lambda: self.d.metric("penumbra_queue_depth") == 8)
            late = self.d.render(self.scene, dict(
                request(20), deadline_ms=max(1, int(used["expected_ms"]))))
            self.assertEqual(late.status, 503, late.body)
            self.assertGreaterEqual(int(late.headers["Retry-After"]), 1)
            self.assertEqual(late.json()["pointer"], "/deadline_ms")
            waiting.append(self.later(request(21)))  # who can wait is let in
        for thread, answers in waiting:
            thread.join()
            self.assertEqual(answers[0].status, 200, answers[0].body)
        self.assertEqual(self.d.metric("penumbra_renders_refused_late_total"), 1)
        self.check_nothing_happened()

    def test_what_takes_long_leaves_places(self):
        """Neither batches nor one client's long renders keep others out."""
        for more, who in (({"priority": "batch"}, "127.0.0.1"), ({}, "127.0.0.2")):
            long = [self.begin(dict(ENDLESS, exposure_ev=n, **more), who=who)
                    for n in range(harness.IN_TURNS + 2)]
            wait(lambda: self.running() == harness.IN_TURNS and
                 self.d.metric("penumbra_queue_depth") == 2)
            for _ in range(harness.IN_TURNS):
                self.assertEqual(self.d.render(self.scene, SMALL).body, self.small.body)
            self.assertEqual(self.running(), harness.IN_TURNS)
            for connection in long:
                connection.close()
            wait(lambda: self.running() + self.d.metric("penumbra_queue_depth") == 0)
        self.check_nothing_happened()

    def descriptors(self):
        return len(os.listdir("/proc/%d/fd" % self.d.worker()))


if __name__ == "__main__":
    harness.main()
