"""One slow render stops nobody: others come in between, and a render that nobody waits for ends."""
import http.client
import json
import os
import random
import threading
import unittest

import harness
from harness import SMALL, Daemon, grid_scene, wait

# Takes much longer than everything else here together.
ENDLESS = {"technique": {"name": "multisample", "params": {"samples": 1024}}, "antialias": 64,
           "width": 1600, "height": 1200, "deadline_ms": 3600000}
SAMPLED = [dict(ENDLESS, technique={"name": name, "params": params}) for name, params in (
    ("multisample", {"samples": 1024}), ("raytraced", {"samples": 4096, "backend": "cpu"}),
    ("raytraced", {"samples": 4096, "backend": "gpu"}), ("stochastic", {}), ("adaptive-sampling", {}),
    ("pcss", {}), ("cascaded", {}))]


class Turns(unittest.TestCase):
    def setUp(self):
        self.d = Daemon("--client-share=0")
        self.addCleanup(self.d.kill)
        self.scene = self.d.upload(grid_scene(4))
        self.small = self.d.render(self.scene, SMALL)
        self.assertEqual(self.small.status, 200)

    def begin(self, request):
        """Sends a request without waiting for its answer."""
        connection = http.client.HTTPConnection("127.0.0.1", self.d.port)
        connection.request("POST", "/v1/scenes/%s/render" % self.scene, json.dumps(request),
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

    def descriptors(self):
        return len(os.listdir("/proc/%d/fd" % self.d.worker()))


if __name__ == "__main__":
    harness.main()
