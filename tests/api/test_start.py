"""From nothing to the first picture, with what the driver has compiled before in its cache."""
import json
import os
import subprocess
import tempfile
import time
import unittest

import harness
from harness import Daemon, wait

LIMIT_S = 2
# Work of one thread that takes so long where the limit was set: where it takes longer the limit is
# wider. Both are measured in turn, and the best of several starts counts.
WORK, WORK_S = 1500000, 0.095
TRIES = 8


def work():
    begun = time.monotonic()
    total = 0
    for n in range(WORK):
        total += n & 7
    return time.monotonic() - begun


class Start(unittest.TestCase):
    def start(self, cache, store):
        """Seconds to the first picture of a daemon that is told nothing."""
        begun = time.monotonic()
        d = Daemon("--warm-up=on", store=store, env={"XDG_CACHE_HOME": cache})
        try:
            answer = d.exchange("POST", "/v1/scenes/%s/render" % self.scene,
                                json.dumps({"deadline_ms": 3600000}),
                                {"Content-Type": "application/json"}, timeout=600)
            took = time.monotonic() - begun
            self.assertEqual(answer.status, 200, answer.body)
            self.assertEqual(answer.body[:4], b"\x89PNG")
            wait(lambda: d.admin("/readyz").status == 200, seconds=60)
            return took
        finally:
            d.kill()

    def test_first_picture(self):
        with tempfile.TemporaryDirectory() as folder:
            cache, store, scene = (os.path.join(folder, name) for name in
                                   ("cache", "store", "demo.glb"))
            subprocess.run([os.path.join(harness.BIN, "penumbra"), "generate", "demo", "-o", scene],
                           check=True, stdout=subprocess.DEVNULL)
            d = Daemon(store=store)
            with open(scene, "rb") as file:
                self.scene = d.upload(file.read())
            d.kill()
            os.mkdir(cache)
            print("  %.2f s with an empty cache" % self.start(cache, store))
            best = None
            for _ in range(TRIES):
                slowness = max(1, work() / WORK_S)
                took = self.start(cache, store)
                slowness = max(slowness, work() / WORK_S)
                print("  %.2f s to the first picture, the machine %.1f times as slow" % (
                    took, slowness))
                best = min(best or took / slowness, took / slowness)
                if best <= LIMIT_S:
                    break
            self.assertLessEqual(best, LIMIT_S)


if __name__ == "__main__":
    harness.main()
