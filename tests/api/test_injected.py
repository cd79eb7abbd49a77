"""Faults that the programs cannot make themselves, injected (faults.c): each is contained, named in
the log, and over when its cause is."""
import errno
import json
import mmap
import os
import struct
import tempfile
import threading
import unittest

from harness import SMALL, Daemon, grid_scene, main, wait

# struct control of faults.c
DAEMON, WORKER, IMPORTER = range(3)
FIELDS = ("allocations", "writes", "write_errno", "accepts", "gl_errors", "gl_code", "gl_reset",
          "clock_s", "hits", "own")
SIZE = 16 * 4
LIBRARY = os.path.join(os.environ.get("PENUMBRA_BIN", ""), "libpenumbra_faults.so")
OUT_OF_MEMORY, CONTEXT_LOST = 0x0505, 0x0507
GUILTY, INNOCENT = 0x8253, 0x8254
LARGE = dict(SMALL, width=320, height=240, technique={"name": "multisample"})


class Faults:
    def __init__(self):
        self.file = tempfile.NamedTemporaryFile()
        self.file.write(bytes(3 * SIZE))
        self.file.flush()
        self.memory = mmap.mmap(self.file.fileno(), 3 * SIZE)

    def set(self, process, **values):
        for name, value in values.items():
            struct.pack_into("=i", self.memory, process * SIZE + 4 * FIELDS.index(name), value)

    def read(self, process, name):
        return struct.unpack_from("=i", self.memory, process * SIZE + 4 * FIELDS.index(name))[0]

    def none(self):
        self.memory[:] = bytes(3 * SIZE)


@unittest.skipUnless(os.path.exists(LIBRARY), "faults cannot be preloaded into sanitized programs")
class Injected(unittest.TestCase):
    def setUp(self):
        self.faults = Faults()
        self.d = Daemon(env={"LD_PRELOAD": LIBRARY, "PENUMBRA_FAULTS": self.faults.file.name})
        self.data = grid_scene(4, "hurt")

    def tearDown(self):
        self.faults.none()
        if self.d.process.poll() is None:
            self.assertEqual(self.d.stop(), 0)
        self.d.kill()

    def post(self, data):
        return self.d.call("POST", "/v1/scenes", data, {"Content-Type": "model/gltf-binary"})

    def check_innocent(self):
        self.assertEqual(self.d.metric("penumbra_quarantined_scenes"), 0)
        self.assertEqual(self.d.metric("penumbra_worker_crashes_total"), 0)

    def check_problem(self, answer, *statuses):
        self.assertIn(answer.status, statuses, answer.body[:300])
        self.assertEqual(answer.headers["Content-Type"], "application/problem+json")

    def test_device_out_of_memory(self):
        scene = self.d.upload(self.data)
        expected = self.d.render(scene, LARGE).body
        for n in (1, 2, 5):  # at the beginning, in the middle
            before = self.d.metric("penumbra_worker_out_of_memory_total")
            self.faults.set(WORKER, gl_code=OUT_OF_MEMORY, gl_errors=n)
            answer = self.d.render(scene, LARGE)
            self.assertEqual((answer.status, answer.body == expected), (200, True),
                             answer.body[:300])
            # A device that draws it in one turn is not asked so often.
            struck = self.faults.read(WORKER, "gl_errors") == 0
            self.assertTrue(struck or n > 1)
            self.assertEqual(self.d.metric("penumbra_worker_out_of_memory_total"), before + struck)
        self.assertIn("no memory is left to it or the device", self.d.log())
        # Again and again: it is not to be had now, but it is nobody's fault.
        self.faults.set(WORKER, gl_errors=-1)
        answer = self.d.render(scene, LARGE)
        self.check_problem(answer, 503)
        self.assertGreater(int(answer.headers["Retry-After"]), 0)
        self.assertIn("memory", answer.json()["detail"])
        self.faults.none()
        self.assertEqual(self.d.render(scene, LARGE).body, expected)
        self.check_innocent()

    def test_device_out_of_memory_beside_others(self):
        """Those beside the one that has none get their pictures."""
        scene = self.d.upload(self.data)
        requests = [dict(SMALL, exposure_ev=n) for n in range(6)]
        expected = [self.d.render(scene, r).body for r in requests]
        answers = [None] * len(requests)

        def ask(n):
            answers[n] = self.d.render(scene, requests[n])
        threads = [threading.Thread(target=ask, args=(n,)) for n in range(len(requests))]
        self.faults.set(WORKER, gl_code=OUT_OF_MEMORY, gl_errors=8)
        for t in threads:
            t.start()
        for t in threads:
            t.join()
        self.assertEqual([a.status for a in answers], [200] * len(requests))
        self.assertEqual([a.body for a in answers], expected)
        self.check_innocent()

    def test_another_program_resets_the_device(self):
        scene = self.d.upload(self.data)
        expected = self.d.render(scene, SMALL).body
        for _ in range(3):
            box = []
            before = self.d.metric("penumbra_worker_restarts_total")
            self.faults.set(WORKER, gl_code=CONTEXT_LOST, gl_errors=1, gl_reset=INNOCENT)
            thread = threading.Thread(target=lambda: box.append(self.d.render(scene, SMALL)))
            thread.start()
            wait(lambda: self.d.metric("penumbra_worker_restarts_total") > before)
            self.faults.none()
            thread.join()
            self.assertEqual((box[0].status, box[0].body == expected), (200, True),
                             box[0].body[:300])
        self.assertIn("another program made the device reset", self.d.log())
        self.check_innocent()

    def test_request_resets_the_device(self):
        """Its like is refused for a while; the scene is drawn otherwise."""
        scene = self.d.upload(self.data)
        self.faults.set(WORKER, gl_code=CONTEXT_LOST, gl_errors=-1, gl_reset=GUILTY)
        self.check_problem(self.d.render(scene, LARGE), 500)
        self.faults.none()
        held = self.d.render(scene, dict(LARGE, exposure_ev=1))
        self.check_problem(held, 422)
        self.assertTrue(0 < int(held.headers["Retry-After"]) <= 600)
        self.assertTrue(held.json()["retryable"])
        self.assertEqual(self.d.render(scene, SMALL).status, 200)
        self.assertEqual(self.d.render(scene, dict(LARGE, width=100)).status, 200)
        other = self.d.upload(grid_scene(4, "other"))
        self.assertEqual(self.d.render(other, LARGE).status, 200)
        self.assertIn(scene, self.d.log())
        # A second kind of request that does it, and it is the scene.
        self.faults.set(WORKER, gl_code=CONTEXT_LOST, gl_errors=-1, gl_reset=GUILTY)
        self.check_problem(self.d.render(scene, SMALL), 500)
        self.faults.none()
        self.check_problem(self.d.render(scene, dict(LARGE, width=90)), 422)
        self.assertEqual(self.d.render(other, SMALL).status, 200)

    def sound(self, scene, expected):
        listed = self.d.get("/v1/scenes").json()["scenes"]
        self.assertIn(scene, [s["id"] for s in listed])
        answer = self.d.render(scene, SMALL)
        self.assertEqual((answer.status, answer.body == expected), (200, True), answer.body[:300])
        wait(lambda: os.listdir(os.path.join(self.d.store, "tmp")) == [])

    def test_disk(self):
        """Whichever write it is that fails: said so, nothing is left, and the next one succeeds."""
        other = self.d.upload(grid_scene(3, "other"))
        picture = self.d.render(other, SMALL).body
        for code, status in ((errno.ENOSPC, 507), (errno.EIO, 503)):
            failed, n = 0, 0
            while n < 60:
                n += 1
                data = grid_scene(2, "disk %d %d" % (code, n))
                self.faults.set(DAEMON, writes=n, write_errno=code)
                answer = self.post(data)
                self.faults.none()
                if answer.status in (200, 201):  # after all that has to be written
                    if n > failed + 3:
                        break
                    continue
                failed += 1
                self.check_problem(answer, status)
                self.sound(other, picture)
                self.assertEqual(self.post(data).status, 201)
            self.assertGreater(failed, 5)
            self.assertLess(n, 60)
        self.faults.set(DAEMON, writes=-1, write_errno=errno.ENOSPC)
        self.check_problem(self.post(self.data), 507)
        self.assertEqual(self.d.render(other, dict(SMALL, exposure_ev=1)).status, 200)
        self.faults.none()
        self.assertEqual(self.post(self.data).status, 201)

    def test_disk_of_jobs(self):
        """Whichever write it is that fails: the job is refused, or all of it is there in the end."""
        scene = self.d.upload(self.data)
        body = json.dumps({"scene": scene, **SMALL, "sequence": {"frames": 2}})
        picture, hits, n = None, 1, 0
        while hits and n < 60:
            n += 1
            self.faults.set(DAEMON, writes=n, write_errno=errno.ENOSPC, hits=0)
            answer = self.d.call("POST", "/v1/jobs", body, {"Content-Type": "application/json"})
            if answer.status != 202:
                self.faults.none()
                self.check_problem(answer, 503, 507)
                continue
            path = answer.headers["Location"]
            wait(lambda: self.d.get(path).json()["state"] not in ("accepted", "running"), 60)
            hits = self.faults.read(DAEMON, "hits")
            self.faults.none()
            self.assertEqual(self.d.get(path).json()["state"], "successful", n)
            frames = [self.d.get("%s/frames/%d" % (path, i)).body for i in range(2)]
            picture = picture or frames[0]
            self.assertEqual(frames, [picture, picture])
            self.assertEqual(self.d.get(path + "/result").status, 200)
        self.assertGreater(n, 8)
        self.assertEqual(hits, 0)
        self.faults.set(DAEMON, writes=-1, write_errno=errno.ENOSPC)
        self.check_problem(self.d.call("POST", "/v1/jobs", body), 503, 507)
        self.assertEqual(self.d.render(scene, dict(SMALL, exposure_ev=1)).status, 200)

    def test_disk_is_full_for_a_while(self):
        scene = self.d.upload(self.data)
        body = json.dumps({"scene": scene, **SMALL, "antialias": 4,
                           "sequence": {"frames": 60, "turntable": {}}})
        path = self.d.call("POST", "/v1/jobs", body).headers["Location"]
        wait(lambda: self.d.get(path).json()["frames"]["done"] > 3)
        self.faults.set(DAEMON, writes=-1, write_errno=errno.ENOSPC)
        wait(lambda: self.faults.read(DAEMON, "hits") > 3)
        self.faults.none()
        wait(lambda: self.d.get(path).json()["state"] != "running", 60)
        self.assertEqual(self.d.get(path).json()["frames"]["done"], 60)

    def test_importer_s_disk(self):
        self.faults.set(IMPORTER, writes=-1, write_errno=errno.ENOSPC)
        self.check_problem(self.post(self.data), 507)
        self.faults.none()
        self.assertEqual(self.post(self.data).status, 201)

    def test_importer_s_memory(self):
        hits = 0
        for n in (1, 2, 3, 5, 8, 13, 21, 34, 55, 89, 144):
            self.faults.set(IMPORTER, allocations=n)
            answer = self.post(grid_scene(2, "memory %d" % n))
            hits += self.faults.read(IMPORTER, "hits")
            self.faults.none()
            if answer.status != 201:
                self.check_problem(answer, 413, 422, 500, 503)
        self.assertGreater(hits, 3)
        self.assertEqual(self.post(self.data).status, 201)

    def test_worker_s_memory(self):
        """One of its allocations that fails ends the worker at worst; the picture comes all the same.
        (What a driver makes of a failed allocation of its own it does not always say.)"""
        scene = self.d.upload(self.data)
        expected = self.d.render(scene, SMALL).body
        hits = 0
        for n in (1, 2, 3, 5, 8, 13, 21, 34, 55, 89, 3000):
            self.d.worker()
            self.faults.set(WORKER, own=1, allocations=n)
            answer = self.d.render(scene, SMALL)
            hits += self.faults.read(WORKER, "hits")
            self.faults.none()
            if answer.status == 503:  # what asks for a size that a client names says so instead
                self.check_problem(answer, 503)
                self.assertIn("memory", answer.json()["detail"])
                self.assertGreater(int(answer.headers["Retry-After"]), 0)
                answer = self.d.render(scene, SMALL)
            self.assertEqual((answer.status, answer.body == expected), (200, True),
                             answer.body[:300])
        self.assertGreater(hits, 3)
        self.check_innocent()

    def test_descriptors(self):
        """accept fails for want of descriptors: who waits is served when there are some."""
        for n in (1, 20):
            self.faults.set(DAEMON, accepts=-1)
            box = []
            thread = threading.Thread(target=lambda: box.append(self.d.get("/v1/scenes")))
            thread.start()
            wait(lambda: self.faults.read(DAEMON, "hits") >= n)
            self.faults.none()
            thread.join()
            self.assertEqual(box[0].status, 200)
            self.assertEqual(self.d.admin("/livez").status, 200)

    def test_clock(self):
        """The time of day jumps: nothing that waits or keeps depends on it."""
        scene = self.d.upload(self.data)
        expected = self.d.render(scene, SMALL).body
        for step in (86400, -86400, 400000000, -400000000):
            box = []
            thread = threading.Thread(target=lambda: box.append(self.d.render(scene, LARGE)))
            thread.start()
            for process in (DAEMON, WORKER):
                self.faults.set(process, clock_s=step)
            thread.join()
            self.assertEqual(box[0].status, 200, box[0].body[:300])
            self.assertEqual(self.d.render(scene, SMALL).body, expected)
            self.assertEqual(self.post(grid_scene(2, "at %d" % step)).status, 201)
            wait(lambda: self.d.admin("/readyz").status == 200)
        self.assertEqual(self.d.metric("penumbra_worker_restarts_total"), 0)


if __name__ == "__main__":
    main()
