"""Jobs on daemons of their own: small limits, kills, damage, other clients."""
import io
import json
import os
import signal
import sqlite3
import threading
import unittest
import zipfile

import harness
from harness import SMALL, Daemon, grid_scene, wait
from jobs import TINY, Events, ended, frame, job, post, single, start


class Bounds(unittest.TestCase):
    def daemon(self, *flags, **options):
        d = Daemon(*flags, **options)
        self.addCleanup(d.kill)
        return d, d.upload(grid_scene(4))

    def problem(self, answer, status, text):
        self.assertEqual(answer.status, status, answer.body)
        self.assertIn(text, answer.json()["detail"])
        return answer

    def kill_9(self, d):
        d.process.kill()
        d.process.wait()
        d.start()

    def test_numbers(self):
        d, scene = self.daemon("--jobs-share=2", "--jobs=3")
        body = {"scene": scene, **TINY, "sequence": {"frames": 3}}
        with d.paused():
            ids = [start(d, scene, {"frames": 3})["id"] for _ in range(2)]
            answer = self.problem(post(d, "/v1/jobs", body), 429, "under way")
            self.assertGreaterEqual(int(answer.headers["Retry-After"]), 1)
        for id in ids:
            self.assertEqual(ended(d, id)["state"], "successful")
        self.assertEqual(post(d, "/v1/jobs", body).status, 202)

    def test_all_clients_together(self):
        d, scene = self.daemon("--jobs=1")
        with d.paused():
            id = start(d, scene, {"frames": 2})["id"]
            answer = self.problem(post(d, "/v1/scenes/%s/render" % scene, TINY,
                                       Prefer="respond-async"), 503, "under way")
            self.assertGreaterEqual(int(answer.headers["Retry-After"]), 1)
        self.assertEqual(ended(d, id)["state"], "successful")

    def test_kept(self):
        d, scene = self.daemon("--jobs-kept=8", "--jobs-keep-s=100")
        body = {"scene": scene, **TINY, "sequence": {"frames": 1}}
        for _ in range(2):  # a quarter
            ended(d, post(d, "/v1/jobs", body).json()["id"])
        answer = self.problem(post(d, "/v1/jobs", body), 429, "expires")
        self.assertTrue(90 <= int(answer.headers["Retry-After"]) <= 100, answer.headers)

    def test_bytes(self):
        d, scene = self.daemon("--jobs-limit=2K")
        done = ended(d, start(d, scene, {"frames": 200, "turntable": {}})["id"])
        self.assertEqual(done["state"], "failed")
        self.assertIn("no room", done["error"]["detail"])
        self.assertTrue(0 < done["bytes"] <= 2048, done)
        there = [d.get("/v1/jobs/%s/frames/%d" % (done["id"], i)).status for i in range(200)]
        self.assertEqual(there.count(200), done["frames"]["done"])
        self.assertEqual(d.render(scene, SMALL).status, 200)

    def test_expiry(self):
        d, scene = self.daemon("--jobs-keep-s=1")
        document = start(d, scene, {"frames": 2})
        folder = os.path.join(d.store, "jobs", document["id"])
        wait(lambda: d.get(document["links"]["self"]).status == 404, 60)
        wait(lambda: not os.path.exists(folder))
        self.assertEqual(d.get("/v1/jobs").json()["total"], 0)

    def test_killed_ten_times(self):
        """100 frames, none lost, and none that was there made again."""
        d, scene = self.daemon()
        id = start(d, scene, {"frames": 100, "turntable": {"turns": 0.9}}, antialias=4)["id"]
        folder = os.path.join(d.store, "jobs", id)
        there = {}
        for kill in range(10):
            wait(lambda: job(d, id)["frames"]["done"] >= 9 * kill + 5, 120)
            d.process.kill()
            d.process.wait()
            for name in os.listdir(folder):
                if name.endswith(".png"):
                    inode = os.stat(os.path.join(folder, name)).st_ino
                    self.assertEqual(there.setdefault(name, inode), inode)
            d.start()
        self.assertLess(len(there), 100)  # it was killed while at work
        done = ended(d, id)
        self.assertEqual((done["state"], done["frames"]["done"]), ("successful", 100))
        for name, inode in there.items():
            self.assertEqual(os.stat(os.path.join(folder, name)).st_ino, inode, name)
        pictures = [frame(d, id, i) for i in range(100)]
        for i, picture in enumerate(pictures):
            self.assertEqual(picture, single(d, id, scene, i), i)
        with zipfile.ZipFile(io.BytesIO(d.get(done["links"]["result"]).body)) as archive:
            self.assertEqual([archive.read(n) for n in sorted(archive.namelist())], pictures)
        frames = [e[2]["frame"] for e in Events(d, id) if e[1] == "frame"]
        self.assertEqual(sorted(frames), list(range(100)))

    def test_events_go_on_after_a_kill(self):
        d, scene = self.daemon()
        id = start(d, scene, {"frames": 60, "turntable": {}}, antialias=4)["id"]
        seen = []
        for event in Events(d, id):
            seen.append(event)
            if event[1] == "frame" and event[2]["done"] == 5:
                break
        self.kill_9(d)
        seen += list(Events(d, id, seen[-1][0]))
        frames = [e[2]["frame"] for e in seen if e[1] == "frame"]
        self.assertEqual(sorted(frames), list(range(60)))
        self.assertEqual(seen[-1][2]["state"], "successful")

    def test_a_file_without_a_row_is_taken_up(self):
        """Killed between the two: the frame is there already."""
        d, scene = self.daemon()
        id = start(d, scene, {"frames": 4})["id"]
        picture = ended(d, id) and frame(d, id, 2)
        d.stop()
        with sqlite3.connect(os.path.join(d.store, "jobs", "jobs.db")) as database:
            database.execute("DELETE FROM frames WHERE number = 2")
            database.execute("UPDATE jobs SET state = 1, done = 3, result_name = ''")
        database.close()
        path = os.path.join(d.store, "jobs", id, "000002.png")
        inode = os.stat(path).st_ino
        d.start()
        self.assertEqual(ended(d, id)["state"], "successful")
        self.assertEqual(frame(d, id, 2), picture)
        self.assertEqual(os.stat(path).st_ino, inode)

    def test_comparison_goes_on(self):
        """Killed between its last image and its document: it is made again."""
        d, scene = self.daemon()
        request = {"width": 40, "height": 30, "techniques": ["hard", "pcf", "vsm"],
                   "reference": {"name": "multisample", "params": {"samples": 16}}}
        id = post(d, "/v1/scenes/%s/compare" % scene, request,
                  Prefer="respond-async").json()["id"]
        first = ended(d, id) and d.get("/v1/jobs/%s/result" % id).json()
        self.assertEqual(len([e for e in Events(d, id) if e[1] == "frame"]), 4)
        d.stop()
        with sqlite3.connect(os.path.join(d.store, "jobs", "jobs.db")) as database:
            database.execute("UPDATE jobs SET state = 1, result_name = '', result_bytes = 0")
        database.close()
        os.remove(os.path.join(d.store, "jobs", id, "result.json"))
        d.start()
        done = ended(d, id)
        self.assertEqual((done["state"], done["frames"]["done"]), ("successful", 4))
        again = d.get(done["links"]["result"]).json()
        self.assertEqual([m["rmse"] for m in again["methods"]], [m["rmse"] for m in first["methods"]])

    def test_keys_outlive_the_daemon(self):
        d, scene = self.daemon()
        body = {"scene": scene, **TINY, "sequence": {"frames": 2}}
        first = post(d, "/v1/jobs", body, Idempotency_Key="k").headers["Location"]
        self.kill_9(d)
        self.assertEqual(post(d, "/v1/jobs", body, Idempotency_Key="k").headers["Location"], first)

    def test_one_key_at_the_same_time(self):
        d, scene = self.daemon()
        body = {"scene": scene, **TINY, "sequence": {"frames": 2}}
        found = []
        ask = lambda: found.append(post(d, "/v1/jobs", body, Idempotency_Key="k"))
        threads = [threading.Thread(target=ask) for _ in range(12)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual([a.status for a in found], 12 * [202])
        self.assertEqual(len({a.headers["Location"] for a in found}), 1)
        self.assertEqual(d.get("/v1/jobs").json()["total"], 1)

    def test_workers_that_die(self):
        d, scene = self.daemon()
        id = start(d, scene, {"frames": 60, "turntable": {}}, antialias=8)["id"]
        for kill in range(4):
            wait(lambda: job(d, id)["frames"]["done"] >= 10 * kill + 3)
            os.kill(d.worker(), signal.SIGKILL)
        done = ended(d, id)
        self.assertEqual((done["state"], done["frames"]["done"]), ("successful", 60), done)
        for i in (0, 30, 59):
            self.assertEqual(frame(d, id, i), single(d, id, scene, i))

    def test_drained_in_the_middle(self):
        d, scene = self.daemon()
        id = start(d, scene, {"frames": 200, "turntable": {}}, antialias=4)["id"]
        events = Events(d, id)
        wait(lambda: job(d, id)["frames"]["done"] > 3)
        self.assertEqual(d.stop(), 0)
        list(events)  # the stream ends with the daemon
        d.start()
        self.assertEqual(ended(d, id)["frames"]["done"], 200)

    def test_damaged_database(self):
        d, scene = self.daemon()
        ended(d, start(d, scene, {"frames": 2})["id"])
        d.stop()
        path = os.path.join(d.store, "jobs", "jobs.db")
        with open(path, "wb") as file:
            file.write(b"no database at all " * 500)
        d.start()
        for answer in (d.get("/v1/jobs"), post(d, "/v1/jobs", {"scene": scene}),
                       post(d, "/v1/scenes/%s/render" % scene, SMALL, Prefer="respond-async")):
            self.problem(answer, 503, "damaged")
        self.assertIn("damaged", d.log())
        self.assertEqual(d.render(scene, SMALL).status, 200)
        self.assertEqual(post(d, "/v1/scenes/%s/render" % scene, SMALL, Idempotency_Key="a").status,
                         200)
        os.remove(path)  # and without a restart a new one is made
        wait(lambda: d.get("/v1/jobs").status == 200, 60)

    def test_locked_database(self):
        d, scene = self.daemon()
        database = sqlite3.connect(os.path.join(d.store, "jobs", "jobs.db"), isolation_level=None)
        self.addCleanup(database.close)
        database.execute("BEGIN IMMEDIATE")
        answer = post(d, "/v1/jobs", {"scene": scene, **TINY, "sequence": {"frames": 2}})
        self.problem(answer, 503, "locked")
        self.assertEqual(d.render(scene, SMALL).status, 200)
        database.execute("ROLLBACK")
        self.assertEqual(ended(d, start(d, scene, {"frames": 2})["id"])["state"], "successful")

    def test_locked_in_the_middle(self):
        """Frames wait until they can be recorded."""
        d, scene = self.daemon()
        id = start(d, scene, {"frames": 60, "turntable": {}}, antialias=4)["id"]
        wait(lambda: job(d, id)["frames"]["done"] > 3)
        database = sqlite3.connect(os.path.join(d.store, "jobs", "jobs.db"), isolation_level=None)
        self.addCleanup(database.close)
        database.execute("PRAGMA busy_timeout = 60000")
        database.execute("BEGIN IMMEDIATE")
        wait(lambda: "locked" in d.log())
        database.execute("ROLLBACK")
        self.assertEqual(ended(d, id)["frames"]["done"], 60)

    def with_tokens(self, *flags):
        token_file = os.path.join(Daemon(start=False).folder, "tokens")
        with open(token_file, "w") as file:
            file.write("a aaaaaaaaaaaaaaaaaaaa\nb bbbbbbbbbbbbbbbbbbbb\n")
        os.chmod(token_file, 0o600)
        d = Daemon("--token-file=" + token_file, *flags)
        self.addCleanup(d.kill)
        return (d, *({"Authorization": "Bearer " + 20 * c} for c in "ab"))

    def test_clients_take_turns(self):
        """A client's short job does not wait for another's long one, whatever that has queued."""
        d, a, b = self.with_tokens()
        scene = d.call("POST", "/v1/scenes", grid_scene(4), a).json()["id"]
        ask = lambda who, frames: d.call("POST", "/v1/jobs", json.dumps({
            "scene": scene, **TINY, "antialias": 8,
            "sequence": {"frames": frames, "turntable": {}}}), who).headers["Location"]
        see = lambda who, path: d.call("GET", path, headers=who).json()
        long = [ask(a, 1000) for _ in range(3)]
        wait(lambda: see(a, long[0])["state"] == "running")
        short = ask(b, 10)
        wait(lambda: see(b, short)["state"] == "successful", 60)
        self.assertEqual(see(a, long[0])["state"], "running")
        self.assertEqual(see(a, long[1])["frames"]["done"], 0)  # one after the other
        for path in long:
            d.call("DELETE", path, headers=a)

    def test_tokens(self):
        d, a, b = self.with_tokens()
        scene = d.call("POST", "/v1/scenes", grid_scene(4), a).json()["id"]
        answer = d.call("POST", "/v1/jobs", json.dumps({"scene": scene, **TINY}), a)
        path = answer.headers["Location"]
        self.assertEqual(len(d.call("GET", "/v1/jobs", headers=a).json()["jobs"]), 1)
        self.assertEqual(d.call("GET", "/v1/jobs", headers=b).json(), {"jobs": [], "total": 0})
        self.assertEqual(d.call("GET", path, headers=a).status, 200)
        for method, address in (("GET", path), ("GET", path + "/events"), ("DELETE", path),
                                ("GET", path + "/frames/0")):
            self.assertEqual(d.call(method, address, headers=b).status, 404)
        self.assertEqual(d.call("GET", path).status, 401)


if __name__ == "__main__":
    harness.main()
