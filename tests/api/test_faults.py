"""Processes that die, hang or are told to stop, at the worst moment."""
import http.client
import json
import os
import random
import signal
import socket
import threading
import time
import unittest

import harness
from harness import HEAVY, PATIENCE, SMALL, Daemon, grid_scene, wait


class Load:
    """Clients in a closed loop, each request a different picture; collects every answer."""

    def __init__(self, daemon, scene, clients=3, heavy_every=4):
        self.d, self.scene, self.heavy_every = daemon, scene, heavy_every
        self.stop_flag = threading.Event()
        self.answers, self.refused = [], 0
        self.threads = [threading.Thread(target=self.run, args=(i,)) for i in range(clients)]
        for t in self.threads:
            t.start()

    def run(self, client):
        n = 0
        while not self.stop_flag.is_set():
            n += 1
            request = dict(SMALL, exposure_ev=client + n / 1000)
            if n % self.heavy_every == 0:
                request = dict(request, width=320, height=240, technique={"name": "pcss"})
            try:
                answer = self.d.render(self.scene, request, fresh=False)
                self.answers.append(answer)
            except ConnectionRefusedError:
                self.refused += 1
                return
            except (OSError, http.client.HTTPException) as error:
                self.answers.append(error)

    def end(self):
        self.stop_flag.set()
        for t in self.threads:
            t.join()
        return self.answers


class Faults(unittest.TestCase):
    def setUp(self):
        self.d = Daemon()

    def tearDown(self):
        if self.d.process.poll() is None:
            self.assertEqual(self.d.stop(), 0)
        self.assertEqual(self.d.children("penumbra"), [])
        self.d.kill()

    def in_background(self, scene, request, **more):
        box = []
        thread = threading.Thread(
            target=lambda: box.append(self.d.render(scene, request, **more)))
        thread.start()
        return thread, box

    def test_kill_during_a_render(self):
        """The client still gets its picture, the right one, and a worker is back."""
        scene = self.d.upload(grid_scene(8))
        expected = self.d.render(scene, HEAVY)
        self.assertEqual(expected.status, 200)
        thread, box = self.in_background(scene, HEAVY)
        wait(lambda: self.d.metric("penumbra_renders_running") == 1)
        time.sleep(0.05)
        os.kill(self.d.worker(), signal.SIGKILL)
        thread.join()
        self.assertEqual(box[0].status, 200, box[0].body[:300])
        self.assertEqual(box[0].body, expected.body)
        self.assertEqual(self.d.metric("penumbra_worker_restarts_total"), 1)
        self.assertEqual(self.d.metric("penumbra_render_retries_total"), 1)
        back = self.d.metric("penumbra_worker_back_seconds")
        self.assertGreater(back, 0)
        print("\n  worker back after %.0f ms" % (back * 1e3))

    def test_kills_at_random_moments_under_load(self):
        scene = self.d.upload(grid_scene(8))
        load = Load(self.d, scene)
        dice = random.Random(7)
        for n in range(5):
            pid = self.d.worker()
            time.sleep(dice.uniform(0, 0.5))
            os.kill(pid, signal.SIGKILL)
            wait(lambda: self.d.metric("penumbra_worker_restarts_total") == n + 1)
        wait(lambda: len(load.answers) > 10)
        answers = load.end()
        bad = [a if isinstance(a, Exception) else (a.status, a.body[:200])
               for a in answers if isinstance(a, Exception) or a.status != 200]
        self.assertEqual(bad, [])
        self.assertEqual(self.d.metric("penumbra_worker_restarts_total"), 5)
        self.assertEqual(self.d.metric("penumbra_quarantined_scenes"), 0)

    def test_scene_that_crashes_twice_is_held_back(self):
        bad, good = self.d.upload(grid_scene(8, "bad")), self.d.upload(grid_scene(8, "good"))
        self.d.worker()
        thread, box = self.in_background(bad, HEAVY)
        for round in range(2):
            wait(lambda: self.d.metric("penumbra_worker_crashes_total") == round)
            wait(lambda: self.d.metric("penumbra_workers_up") == 1)
            wait(lambda: self.d.metric("penumbra_renders_running") == 1)
            time.sleep(0.15)
            for pid in self.d.children("penumbra-worker"):
                os.kill(pid, signal.SIGSEGV)
        thread.join()
        self.assertEqual(box[0].status, 500, box[0].body)
        held = self.d.render(bad, HEAVY)
        self.assertEqual(held.status, 422, held.body)
        self.assertGreater(int(held.headers["Retry-After"]), 0)
        self.assertEqual(self.d.render(bad, SMALL).status, 200)  # this was not tried yet
        self.assertEqual(self.d.render(good, SMALL).status, 200)
        self.assertEqual(self.d.metric("penumbra_quarantined_scenes"), 1)

    def test_hung_worker_is_replaced(self):
        self.d.stop()
        self.d.flags.append("--hang-timeout-ms=4000")
        self.d.start()
        scene = self.d.upload(grid_scene(4))
        self.assertEqual(self.d.render(scene, SMALL).status, 200)
        thread, box = self.in_background(scene, dict(HEAVY, antialias=16, deadline_ms=600))
        wait(lambda: self.d.metric("penumbra_renders_running") == 1)
        time.sleep(0.2)
        os.kill(self.d.worker(), signal.SIGSTOP)
        thread.join()
        late = box[0]
        self.assertEqual(late.status, 504, late.body)
        self.assertTrue(late.json()["retryable"])
        wait(lambda: self.d.metric("penumbra_worker_hangs_total") == 1)
        self.assertEqual(self.d.render(scene, SMALL).status, 200)

    def test_worker_that_stands_still(self):
        """Whatever is said of hangs: not ready soon, replaced before long, and no scene is blamed."""
        # One that is stopped for less than the time that it is given goes on.
        worker = self.d.worker()
        os.kill(worker, signal.SIGSTOP)
        wait(lambda: "No worker answers" in self.d.admin("/readyz").body.decode())
        os.kill(worker, signal.SIGCONT)
        wait(lambda: self.d.admin("/readyz").status == 200)
        self.assertEqual(self.d.worker(), worker)
        self.d.stop()
        self.d.flags.append("--silence-timeout-ms=5000")
        self.d.start()
        scene = self.d.upload(grid_scene(4))
        expected = self.d.render(scene, SMALL).body
        for i in range(2):
            worker = self.d.worker()
            thread, box = self.in_background(scene, dict(SMALL, exposure_ev=i))
            thread.join()
            os.kill(worker, signal.SIGSTOP)
            thread, box = self.in_background(scene, SMALL)
            wait(lambda: self.d.admin("/readyz").status == 503)
            thread.join()
            self.assertEqual((box[0].status, box[0].body == expected), (200, True), box[0].body[:200])
            self.assertNotEqual(self.d.worker(), worker)
            wait(lambda: self.d.admin("/readyz").status == 200)
        self.assertEqual(self.d.metric("penumbra_worker_hangs_total"), 2)
        self.assertEqual(self.d.metric("penumbra_quarantined_scenes"), 0)

    def test_worker_that_dies_at_once(self):
        """No worker at all: requests wait, then time out; the daemon stays alive and not ready."""
        self.d.stop()
        self.d.flags.append("--worker-path=/bin/false")
        self.d.start()
        scene = self.d.upload(grid_scene(4))
        self.assertEqual(self.d.render(scene, dict(SMALL, deadline_ms=300)).status, 504)
        self.assertEqual(self.d.admin("/livez").status, 200)
        self.assertEqual(self.d.admin("/readyz").status, 503)
        self.d.flags.pop()

    def test_importers_killed_under_load(self):
        """Only the upload whose importer was killed fails; nothing stays behind."""
        scene = self.d.upload(grid_scene(4))
        stop, outcomes = threading.Event(), []

        def uploads(n):
            count = 0
            while not stop.is_set() and count < 400:
                count += 1
                data = grid_scene(60, "upload %d %d" % (n, count))
                outcomes.append(self.d.call("POST", "/v1/scenes", data,
                                            {"Content-Type": "model/gltf-binary"}))

        threads = [threading.Thread(target=uploads, args=(n,)) for n in range(3)]
        load = Load(self.d, scene, clients=1)
        for t in threads:
            t.start()
        killed = 0
        end = time.monotonic() + 60
        while killed < 8 and time.monotonic() < end:
            time.sleep(0.03)
            for pid in self.d.children("penumbra-import")[:1]:
                try:
                    os.kill(pid, signal.SIGKILL)
                    killed += 1
                except ProcessLookupError:
                    pass
        stop.set()
        for t in threads:
            t.join()
        self.assertEqual({a.status for a in load.end()}, {200})
        statuses = [a.status for a in outcomes]
        self.assertLessEqual(set(statuses), {201, 422, 500})
        self.assertGreater(killed, 3)
        failed = len([s for s in statuses if s != 201])
        self.assertGreater(failed, 0)
        self.assertLessEqual(failed, killed)
        self.assertEqual(self.d.leftovers(), [])
        self.assertEqual(self.d.get("/v1/scenes").json()["total"],
                         1 + len([s for s in statuses if s == 201]))

    def test_importer_that_never_ends(self):
        self.d.stop()
        hang = os.path.join(self.d.folder, "hang")
        with open(hang, "w") as f:
            f.write("#!/bin/sh\nexec sleep 100\n")
        os.chmod(hang, 0o755)
        self.d.flags += ["--import-timeout-ms=500", "--import-path=" + hang]
        self.d.start()
        answer = self.d.call("POST", "/v1/scenes", grid_scene(1), {"Content-Type": "model/gltf-binary"})
        self.assertEqual(answer.status, 422, answer.body)
        self.assertEqual(self.d.leftovers(), [])

    def test_restart_keeps_everything(self):
        scenes = [self.d.upload(grid_scene(n)) for n in (1, 2, 3)]
        before = {s: self.d.render(s, SMALL) for s in scenes}
        def listing():
            scenes = self.d.get("/v1/scenes").json()
            for scene in scenes["scenes"]:
                del scene["resident"]
            return scenes

        listed = listing()
        self.assertEqual(self.d.stop(), 0)
        os.makedirs(os.path.join(self.d.store, "tmp", "77"))
        with open(os.path.join(self.d.store, "tmp", "77", "source"), "w") as f:
            f.write("left by a crash")
        self.d.start()
        self.assertEqual(self.d.leftovers(), [])
        self.assertEqual(listing(), listed)
        for s in scenes:
            again = self.d.render(s, SMALL)
            self.assertEqual(again.body, before[s].body)
            self.assertEqual(again.headers["ETag"], before[s].headers["ETag"])

    def test_kill_9_of_the_daemon(self):
        scene = self.d.upload(grid_scene(4))
        picture = self.d.render(scene, SMALL).body
        workers = self.d.children("penumbra-worker")
        self.d.process.kill()
        self.d.process.wait()
        wait(lambda: not any(os.path.exists("/proc/%d" % pid) for pid in workers))
        self.d.start()
        self.assertEqual(self.d.render(scene, SMALL).body, picture)

    def test_old_blob_is_imported_again(self):
        scene = self.d.upload(grid_scene(4))
        picture = self.d.render(scene, SMALL).body
        self.d.stop()
        blob = os.path.join(self.d.store, "scenes", scene, "scene.pscene")
        with open(blob, "r+b") as f:
            f.seek(8)
            f.write(b"\0\0\0\0")
        self.d.start()
        answer = wait(lambda: (lambda a: a.status != 503 and a)(self.d.render(scene, SMALL)))
        self.assertEqual((answer.status, answer.body), (200, picture))

    def test_two_daemons_do_not_share_a_store(self):
        with self.assertRaises(RuntimeError):
            Daemon(store=self.d.store)

    def test_sigterm_under_load(self):
        """Every accepted request is answered in full, and the exit status is 0."""
        scene = self.d.upload(grid_scene(8))
        load = Load(self.d, scene, clients=4)
        # A big download that is being read slowly when the signal comes, and a long render.
        big = dict(SMALL, width=2000, height=1500, output={"format": "exr", "bit_depth": 32})
        whole = self.d.render(scene, big, fresh=False)
        slow = socket.create_connection(("127.0.0.1", self.d.port), timeout=30 * PATIENCE)
        slow.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 17)
        body = json.dumps(big).encode()
        slow.sendall(b"POST /v1/scenes/%s/render HTTP/1.1\r\nHost: x\r\nContent-Length: %d\r\n\r\n" %
                     (scene.encode(), len(body)) + body)
        got = slow.recv(100)
        thread, box = self.in_background(scene, HEAVY)
        wait(lambda: self.d.metric("penumbra_renders_running") >= 1)
        time.sleep(0.1)
        self.d.process.send_signal(signal.SIGTERM)
        time.sleep(0.3)
        while True:
            piece = slow.recv(1 << 16)
            if not piece:
                break
            got += piece
        slow.close()
        status = self.d.process.wait(60 * PATIENCE)
        thread.join()
        answers = load.end()
        self.assertEqual(status, 0)
        self.assertEqual(got.split(b"\r\n\r\n", 1)[1], whole.body)
        self.assertEqual(box[0].status, 200, box[0].body[:200])
        for a in answers:
            self.assertNotIsInstance(a, Exception, repr(a))
            self.assertIn(a.status, (200, 503))
            if a.status == 503:
                self.assertIn("Retry-After", a.headers)

    def test_second_sigterm_is_faster(self):
        scene = self.d.upload(grid_scene(8))
        thread, box = self.in_background(scene, dict(HEAVY, antialias=64, deadline_ms=600000))
        wait(lambda: self.d.metric("penumbra_renders_running") == 1)
        self.d.process.send_signal(signal.SIGTERM)
        time.sleep(0.3)
        self.d.process.send_signal(signal.SIGTERM)
        self.assertEqual(self.d.process.wait(30 * PATIENCE), 0)
        thread.join()
        self.assertEqual(box[0].status, 503)


if __name__ == "__main__":
    harness.main()
