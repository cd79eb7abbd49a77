"""Jobs: renders that nobody waits for, and sequences of many views."""
import io
import json
import os
import struct
import subprocess
import sys
import tempfile
import unittest
import zipfile

import harness
from harness import HEAVY, SMALL, Daemon, grid_scene, wait
sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "../unit"))
import pose_files
from jobs import ASYNC, TINY, Events, ended, frame, job, post, single, start


def chunks(data):
    """(name, bytes) of the parts of a WebP file or of one of its frames."""
    at, found = 0, []
    while at < len(data):
        name, size = struct.unpack_from("<4sI", data, at)
        found.append((name, data[at + 8:at + 8 + size]))
        at += 8 + size + size % 2
    return found


def still(data):
    return [c for c in chunks(data[12:]) if c[0] in (b"VP8 ", b"VP8L", b"ALPH")]


def animation(data):
    """(parts, milliseconds) of each frame."""
    assert data[:4] == b"RIFF" and data[8:12] == b"WEBP"
    return [([c for c in chunks(body[16:])], int.from_bytes(body[12:15], "little"))
            for name, body in chunks(data[12:]) if name == b"ANMF"]


class Jobs(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.d = Daemon("--jobs-share=64")
        cls.scene = cls.d.upload(grid_scene(4))

    @classmethod
    def tearDownClass(cls):
        status = cls.d.stop()
        assert status == 0, status
        cls.d.kill()

    def problem(self, answer, status, pointer=None):
        self.assertEqual(answer.status, status, answer.body)
        self.assertEqual(answer.headers["Content-Type"], "application/problem+json")
        if pointer is not None:
            self.assertEqual(answer.json().get("pointer", ""), pointer)

    # ---- one render ----

    def test_render(self):
        d, path = self.d, "/v1/scenes/%s/render" % self.scene
        answer = post(d, path, SMALL, Prefer="respond-async, wait=1")
        self.assertEqual(answer.status, 202)
        self.assertEqual(answer.headers["Preference-Applied"], "respond-async")
        document = answer.json()
        self.assertEqual(answer.headers["Location"], "/v1/jobs/" + document["id"])
        self.assertEqual((document["kind"], document["frames"]["total"]), ("render", 1))
        done = ended(d, document["id"])
        self.assertEqual((done["state"], done["progress"]), ("successful", 1))
        self.assertEqual(done["expires_unix_s"] - done["ended_unix_s"], 86400)
        result = d.get(done["links"]["result"])
        self.assertEqual(result.headers["Content-Type"], "image/png")
        self.assertEqual(result.body, d.render(self.scene, SMALL).body)
        self.assertEqual(result.body, frame(d, document["id"], 0))
        self.assertEqual(done["bytes"], len(result.body))

    def test_accept_chooses_the_format(self):
        answer = post(self.d, "/v1/scenes/%s/render" % self.scene, SMALL, Prefer="respond-async",
                      Accept="image/webp")
        done = ended(self.d, answer.json()["id"])
        self.assertEqual(self.d.get(done["links"]["result"]).headers["Content-Type"], "image/webp")

    def test_what_is_answered_at_once_all_the_same(self):
        for request, accept in (({**SMALL, "technique": {"name": "temporal"}, "session": "a"}, None),
                                (SMALL, "text/event-stream"), ({**SMALL, "progressive": True}, None)):
            headers = {"Prefer": "respond-async", **({"Accept": accept} if accept else {})}
            answer = post(self.d, "/v1/scenes/%s/render" % self.scene, request, **headers)
            self.assertEqual(answer.status, 200)
            self.assertNotIn("Preference-Applied", answer.headers)

    def test_compare(self):
        request = {"width": 40, "height": 30, "techniques": ["hard", "pcss"],
                   "reference": {"name": "multisample", "params": {"samples": 16}}}
        answer = post(self.d, "/v1/scenes/%s/compare" % self.scene, request, Prefer="respond-async")
        self.assertEqual(answer.status, 202, answer.body)
        done = ended(self.d, answer.json()["id"])
        self.assertEqual(done["state"], "successful", done)
        result = self.d.get(done["links"]["result"]).json()
        at_once = post(self.d, "/v1/scenes/%s/compare" % self.scene,
                       {**request, "deadline_ms": 300000}).json()
        for a, b in zip(result["methods"], at_once["methods"]):
            self.assertEqual(a["technique"], b["technique"])
            self.assertEqual(a["rmse"], b["rmse"])
            self.assertEqual(self.d.get(a["links"]["image"]).body,
                             self.d.get(b["links"]["image"]).body)

    def test_refused_like_any_request(self):
        path = "/v1/scenes/%s/render" % self.scene
        self.problem(post(self.d, path, {"widht": 1}, Prefer="respond-async"), 422)
        self.problem(post(self.d, "/v1/scenes/%s/render" % ("0" * 64), SMALL,
                          Prefer="respond-async"), 404)

    # ---- sequences ----

    def check_frames(self, id, count, some=None):
        done = ended(self.d, id)
        self.assertEqual((done["state"], done["frames"]["done"]), ("successful", count), done)
        pictures = [frame(self.d, id, i) for i in range(count)]
        for i in some or range(count):
            self.assertEqual(pictures[i], single(self.d, id, self.scene, i), i)
        return done, pictures

    def test_turntable(self):
        id = start(self.d, self.scene, {"frames": 8, "turntable": {"elevation_deg": 20}})["id"]
        done, pictures = self.check_frames(id, 8)
        for i in (0, 3, 7):  # and as anybody would ask for the view
            answer = self.d.render(self.scene, {**TINY, "camera": {"orbit": {
                "azimuth_deg": 45 * i - (360 if i > 4 else 0), "elevation_deg": 20}}})
            self.assertEqual(answer.body, pictures[i], i)
        self.assertGreater(len(set(pictures)), 1)
        result = self.d.get(done["links"]["result"])
        self.assertEqual(result.headers["Content-Type"], "application/zip")
        with zipfile.ZipFile(io.BytesIO(result.body)) as archive:
            self.assertEqual(archive.namelist(), ["%06d.png" % i for i in range(8)])
            self.assertEqual([archive.read(n) for n in archive.namelist()], pictures)
        self.assertEqual(done["bytes"], sum(map(len, pictures)) + len(result.body))

    def test_views(self):
        cameras = [{"eye": [2, 1 + 0.2 * i, 2], "target": [0, 0.3, 0]} for i in range(3)]
        id = start(self.d, self.scene, {"views": cameras, "archive": "none"})["id"]
        done, pictures = self.check_frames(id, 3)
        self.assertNotIn("result", done["links"])
        for camera, picture in zip(cameras, pictures):
            self.assertEqual(self.d.render(self.scene, {**TINY, "camera": camera}).body, picture)

    def test_keyframes_of_the_camera(self):
        keys = [{"frame": 0, "camera": {"eye": [2, 1, 2]}}, {"frame": 4, "camera": {"eye": [-2, 2, 2]}}]
        id = start(self.d, self.scene, {"keyframes": keys})["id"]
        pictures = self.check_frames(id, 5)[1]
        middle = self.d.render(self.scene, {**TINY, "camera": {"eye": [0, 1.5, 2]}})
        self.assertEqual(middle.body, pictures[2])

    def test_lights_that_move_keep_the_exposure_of_the_first_frame(self):
        light = lambda x: [{"type": "rect", "position": [x, 3, 1], "power_w": 40 + 30 * x}]
        keys = [{"frame": 0, "lights": light(0)}, {"frame": 3, "lights": light(3)}]
        id = start(self.d, self.scene, {"keyframes": keys}, technique="pcss")["id"]
        pictures = self.check_frames(id, 4)[1]
        requests = [self.d.get("/v1/jobs/%s/frames/%d" % (id, i), Accept="application/json").json()
                    for i in range(4)]
        self.assertEqual(len({r["exposure_ev"] for r in requests}), 1)
        self.assertEqual(len({r["sky_level"] for r in requests}), 1)
        self.assertEqual([r["lights"][0]["power_w"] for r in requests], [40, 70, 100, 130])
        open_request = {**TINY, "technique": "pcss", "lights": light(0)}
        self.assertEqual(self.d.render(self.scene, open_request).body, pictures[0])

    def test_exr_and_webp(self):
        id = start(self.d, self.scene, {"frames": 2}, output={"format": "exr", "layer": "depth"})["id"]
        self.assertTrue(all(p[:4] == b"\x76\x2f\x31\x01" for p in self.check_frames(id, 2)[1]))
        id = start(self.d, self.scene, {"frames": 7, "fps": 30, "archive": "webp", "turntable": {}},
                   output={"format": "webp"})["id"]
        done, pictures = self.check_frames(id, 7)
        result = self.d.get(done["links"]["result"])
        self.assertEqual(result.headers["Content-Type"], "image/webp")
        self.assertEqual(animation(result.body), [
            (stills, 33 + (i in (1, 4))) for i, stills in enumerate(map(still, pictures))])

    def test_the_file_s_own_animation(self):
        scene = self.d.upload(pose_files.skinned(11, 1, normals=False, floor=True))
        name = self.d.get("/v1/scenes/" + scene).json()["animations"][0]["name"]
        id = start(self.d, scene, {"frames": 4, "fps": 8}, animation=name, time_s=0.125,
                   width=64, height=48)["id"]
        self.assertEqual(ended(self.d, id)["state"], "successful")
        pictures = [frame(self.d, id, i) for i in range(4)]
        for i, picture in enumerate(pictures):
            alone = self.d.render(scene, {**TINY, "width": 64, "height": 48, "animation": name,
                                          "time_s": 0.125 * (1 + i)})
            self.assertEqual(alone.body, picture, i)
        self.assertEqual(len(set(pictures)), 4)

    def test_sequence_refused(self):
        refuse = lambda pointer, sequence, status=422, **request: self.problem(
            post(self.d, "/v1/jobs", {"scene": self.scene, **TINY, **request, "sequence": sequence}),
            status, pointer)
        refuse("/sequence/frames", {"frames": 10001})
        refuse("/sequence/frame", {"frame": 1})
        refuse("/sequence", {"turntable": {}, "views": [{}]})
        refuse("/sequence/turntable/turns", {"turntable": {"turns": 1e9}})
        refuse("/sequence/views/1/eye", {"views": [{}, {"eye": [1, 2]}]})
        refuse("/sequence/keyframes/1", {"keyframes": [{"frame": 1, "camera": {"eye": [1, 1, 1]}},
                                                       {"frame": 1, "camera": {"eye": [1, 1, 2]}}]})
        refuse("/sequence/keyframes/0/camera/index", {"keyframes": [{"frame": 0, "camera": {"index": -1}}]})
        refuse("/sequence/keyframes/0", {"keyframes": [{"frame": 0, "camera": {"index": 0}}]})
        refuse("/sequence/archive", {"archive": "webp"})
        refuse("/technique", {}, technique="auto")
        refuse("/camera", {"turntable": {}}, camera={"eye": [1, 1, 1]})
        # The eye meets the target half way.
        refuse("/sequence", {"keyframes": [{"frame": 0, "camera": {"eye": [0, 1, 1], "target": [0, 1, 0]}},
                                           {"frame": 2, "camera": {"eye": [0, 1, -1], "target": [0, 1, 0]}}]})
        self.problem(post(self.d, "/v1/jobs", {**TINY}), 422, "/scene")
        self.problem(post(self.d, "/v1/jobs", {**TINY, "scene": "0" * 64}), 404)
        self.problem(self.d.call("POST", "/v1/jobs?a=1", "{}", ASYNC), 400)

    def test_frames_that_cannot_be_had(self):
        """What is there stays, and the job says why it ended."""
        id = start(self.d, self.scene, {"views": [{}, {"eye": [1, 2, 3]}, {"index": 7}]})["id"]
        done = ended(self.d, id)
        self.assertEqual(done["state"], "failed")
        self.assertIn("Frame 2", done["error"]["detail"])
        self.assertEqual(done["frames"]["failed"], 1)
        there = [self.d.get("/v1/jobs/%s/frames/%d" % (id, i)).status for i in range(3)]
        self.assertEqual(there.count(200), done["frames"]["done"])
        self.assertEqual(there[2], 404)
        self.problem(self.d.get("/v1/jobs/%s/result" % id), 404)

    # ---- files ----

    def test_ranges(self):
        id = start(self.d, self.scene, {"frames": 3})["id"]
        path = ended(self.d, id)["links"]["result"]
        whole = self.d.get(path)
        size, tag = len(whole.body), whole.headers["ETag"]
        self.assertEqual(whole.headers["Accept-Ranges"], "bytes")
        self.assertIn("Expires", whole.headers)
        got = b""
        for first in range(0, size, 100):
            last = min(first + 99, size - 1)
            part = self.d.get(path, Range="bytes=%d-%d" % (first, first + 99))
            self.assertEqual((part.status, part.headers["Content-Range"]),
                             (206, "bytes %d-%d/%d" % (first, last, size)))
            self.assertEqual(part.headers["ETag"], tag)
            got += part.body
        self.assertEqual(got, whole.body)
        self.assertEqual(self.d.get(path, Range="bytes=-10").body, whole.body[-10:])
        self.assertEqual(self.d.get(path, Range="bytes=%d-" % (size - 3)).body, whole.body[-3:])
        self.assertEqual(self.d.get(path, Range="bytes=0-5", If_Range=tag).body, whole.body[:6])
        for ignored in ({"Range": "bytes=0-5", "If_Range": '"other"'}, {"Range": "bytes=0-1,4-5"},
                        {"Range": "lines=1-2"}, {"Range": "bytes=5-2"}):
            answer = self.d.get(path, **ignored)
            self.assertEqual((answer.status, answer.body), (200, whole.body), ignored)
        head = self.d.exchange("HEAD", path, headers={"Range": "bytes=0-5"})
        self.assertEqual((head.status, head.headers["Content-Length"]), (200, str(size)))
        outside = self.d.get(path, Range="bytes=%d-" % size)
        self.problem(outside, 416)
        self.assertEqual(outside.headers["Content-Range"], "bytes */%d" % size)
        self.assertEqual(self.d.get(path, If_None_Match=tag).status, 304)
        head = self.d.call("HEAD", path)
        self.assertEqual((head.status, int(head.headers["Content-Length"])), (200, size))

    def test_a_damaged_file_is_never_sent(self):
        id = start(self.d, self.scene, {"frames": 2})["id"]
        ended(self.d, id)
        with open(os.path.join(self.d.store, "jobs", id, "000001.png"), "r+b") as file:
            file.seek(20)
            file.write(b"damage")
        self.problem(self.d.get("/v1/jobs/%s/frames/1" % id), 500)
        self.assertEqual(self.d.get("/v1/jobs/%s/frames/0" % id).status, 200)

    # ---- events ----

    def test_events(self):
        frame_count = 80  # more than are sent at once
        id = start(self.d, self.scene, {"frames": frame_count, "turntable": {}})["id"]
        seen, last = [], None
        while True:  # from connection to connection
            events = Events(self.d, id, last)
            if events.response.status == 204:
                events.close()
                break
            self.assertEqual(events.response.headers["Content-Type"], "text/event-stream")
            for number, event in enumerate(events):
                seen.append(event)
                last = event[0]
                if number == 20:
                    break
            events.close()
        ids = [e[0] for e in seen]
        self.assertEqual(ids, sorted(set(ids)))
        frames = [e[2]["frame"] for e in seen if e[1] == "frame"]
        self.assertEqual(sorted(frames), list(range(frame_count)))
        self.assertEqual([e[2]["done"] for e in seen if e[1] == "frame"],
                         list(range(1, frame_count + 1)))
        self.assertEqual((seen[-1][1], seen[-1][2]["state"]), ("state", "successful"))
        late = list(Events(self.d, id))  # from the beginning, when all is over
        self.assertEqual([e[2]["done"] for e in late if e[1] == "frame"],
                         list(range(1, frame_count + 1)))
        self.assertEqual(late[-1], seen[-1])
        for event in seen[:30]:
            if event[1] == "frame":
                self.assertEqual(len(self.d.get(event[2]["href"]).body), event[2]["bytes"])

    # ---- cancelling ----

    def test_cancel(self):
        before = self.d.metric("penumbra_renders_cancelled_total")
        id = start(self.d, self.scene, {"frames": 500, "turntable": {}}, antialias=16,
                   **{k: HEAVY[k] for k in ("technique", "width", "height")})["id"]
        wait(lambda: self.d.metric("penumbra_renders_running"))
        answer = self.d.call("DELETE", "/v1/jobs/" + id)
        self.assertEqual((answer.status, answer.json()["state"]), (200, "dismissed"))
        wait(lambda: self.d.metric("penumbra_renders_running") == 0)
        self.assertGreater(self.d.metric("penumbra_renders_cancelled_total"), before)
        self.assertEqual(job(self.d, id)["state"], "dismissed")
        self.assertEqual([e[2]["state"] for e in Events(self.d, id) if e[1] == "state"][-1:],
                         ["dismissed"])
        self.assertEqual(self.d.call("DELETE", "/v1/jobs/" + id).status, 204)

    def test_who_waits_goes_first(self):
        id = start(self.d, self.scene, {"frames": 300, "turntable": {}}, width=400, height=300,
                   antialias=8)["id"]
        wait(lambda: job(self.d, id)["state"] == "running")
        for _ in range(5):
            self.assertEqual(self.d.render(self.scene, SMALL).status, 200)
        self.assertEqual(job(self.d, id)["state"], "running")
        wait(lambda: self.d.metric("penumbra_jobs_under_way"))
        self.assertEqual(self.d.metric("penumbra_jobs_available"), 1)
        self.d.call("DELETE", "/v1/jobs/" + id)

    # ---- keys ----

    def test_idempotency_key(self):
        body = {"scene": self.scene, **TINY, "sequence": {"frames": 2}}
        first = post(self.d, "/v1/jobs", body, Idempotency_Key="one")
        again = post(self.d, "/v1/jobs", body, Idempotency_Key="one")
        self.assertEqual([first.status, again.status], [202, 202])
        self.assertEqual(again.headers["Location"], first.headers["Location"])
        other = post(self.d, "/v1/jobs", body, Idempotency_Key="two")
        self.assertNotEqual(other.headers["Location"], first.headers["Location"])
        body["sequence"]["frames"] = 3
        self.problem(post(self.d, "/v1/jobs", body, Idempotency_Key="one"), 422)
        path = "/v1/scenes/%s/render" % self.scene
        self.problem(post(self.d, path, SMALL, Idempotency_Key="one"), 422)
        at_once = [post(self.d, path, SMALL, Idempotency_Key="three") for _ in range(2)]
        self.assertEqual(at_once[0].body, at_once[1].body)
        self.problem(post(self.d, path, TINY, Idempotency_Key="three"), 422)
        self.problem(post(self.d, path, SMALL, Idempotency_Key="x" * 256), 400)
        # With the job its key goes, too.
        ended(self.d, first.json()["id"])
        self.d.call("DELETE", first.headers["Location"])
        self.assertEqual(post(self.d, "/v1/jobs", body, Idempotency_Key="one").status, 202)

    # ---- the command-line client ----

    def penumbra(self, *arguments):
        run = subprocess.run([os.path.join(harness.BIN, "penumbra"), *arguments, "--server",
                              "http://127.0.0.1:%d" % self.d.port], capture_output=True, text=True)
        return run.returncode, run.stdout, run.stderr

    def test_cli(self):
        small = ["sequence", self.scene, "--technique", "hard", "--width", "24", "--height", "16",
                 "--frames", "5", "--turntable-elevation-deg", "20"]
        with tempfile.TemporaryDirectory() as folder:
            out = os.path.join(folder, "frames")
            self.assertEqual(self.penumbra(*small, "-o", out)[0], 0)
            frames = []
            for name in sorted(os.listdir(out)):
                with open(os.path.join(out, name), "rb") as file:
                    frames.append(file.read())
            self.assertEqual(len(frames), 5)
            view = {**TINY, "camera": {"orbit": {"azimuth_deg": 72, "elevation_deg": 20}}}
            self.assertEqual(frames[1], self.d.render(self.scene, view).body)
            self.assertEqual(self.penumbra(*small, "-o", out + ".zip")[0], 0)
            with zipfile.ZipFile(out + ".zip") as archive:
                self.assertEqual([archive.read(n) for n in archive.namelist()], frames)
            self.assertEqual(self.penumbra(*small, "-o", out + ".webp")[0], 0)
            with open(out + ".webp", "rb") as file:
                self.assertEqual(len(animation(file.read())), 5)
        status, id, _ = self.penumbra(*small, "--detach")
        self.assertEqual((status, len(id.strip())), (0, 64))
        self.assertIn("5 of      5 frames", self.penumbra("jobs", "wait", id.strip())[1])
        self.assertIn(id.strip(), self.penumbra("jobs")[1])
        self.assertEqual(json.loads(self.penumbra("jobs", "show", id.strip())[1])["id"], id.strip())
        self.assertEqual(self.penumbra("jobs", "cancel", id.strip())[0], 0)
        self.assertEqual(self.penumbra("jobs", "show", id.strip())[0], 3)
        self.assertEqual(self.penumbra("sequence", self.scene)[0], 2)
        self.assertEqual(self.penumbra("sequence", self.scene, "--frames", "x", "--detach")[0], 2)

    # ---- what there is ----

    def test_unknown(self):
        for rest in ("", "/events", "/frames/0", "/result"):
            self.problem(self.d.get("/v1/jobs/%s%s" % ("0" * 64, rest)), 404)
        self.problem(self.d.call("DELETE", "/v1/jobs/" + "0" * 64), 404)
        for path in ("/v1/jobs/x", "/v1/jobs/%s/frames/01" % ("0" * 64),
                     "/v1/jobs/%s/frames/-1" % ("0" * 64)):
            self.problem(self.d.get(path), 404)

    def test_list(self):
        path = "/v1/scenes/%s/render" % self.scene
        ids = [post(self.d, path, TINY, Prefer="respond-async").json()["id"] for _ in range(5)]
        for id in ids:
            ended(self.d, id)
        found, page = [], "/v1/jobs?limit=2&state=successful"
        while page:
            document = self.d.get(page).json()
            self.assertLessEqual(len(document["jobs"]), 2)
            found += [j["id"] for j in document["jobs"]]
            page = document.get("next")
        self.assertEqual(len(found), document["total"])
        self.assertEqual(found, sorted(found, reverse=True))
        self.assertEqual([i for i in found if i in ids], ids[::-1])
        self.assertEqual(self.d.get("/v1/jobs?state=accepted").json()["jobs"], [])
        self.problem(self.d.get("/v1/jobs?state=lost"), 422, "/state")

    def test_delete(self):
        done = ended(self.d, post(self.d, "/v1/scenes/%s/render" % self.scene, TINY,
                                  Prefer="respond-async").json()["id"])
        folder = os.path.join(self.d.store, "jobs", done["id"])
        self.assertTrue(os.path.isdir(folder))
        self.assertEqual(self.d.call("DELETE", "/v1/jobs/" + done["id"]).status, 204)
        self.problem(self.d.get("/v1/jobs/" + done["id"]), 404)
        self.assertFalse(os.path.exists(folder))


if __name__ == "__main__":
    harness.main()
