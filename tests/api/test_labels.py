"""What scenes are called: names, tags, the first digits of their ids, and their small pictures."""
import hashlib
import itertools
import json
import os
import unittest
import urllib.parse

import harness
from harness import SMALL, Daemon, grid_scene, png
from test_access import ADMIN, ALICE, BOB, READER, SENDER, TOKENS


def twins(digits):
    """Two scenes whose ids begin alike: of some thousand, two do (a birthday)."""
    seen = {}
    for n in itertools.count():
        data = grid_scene(1, "twin %d" % n)
        begin = hashlib.sha256(data).hexdigest()[:digits]
        if begin in seen:
            return seen[begin], data
        seen[begin] = data


def form(files):
    parts = b"".join(b'--b\r\nContent-Disposition: form-data; name="f"; filename="%s"\r\n\r\n%s\r\n'
                     % (name.encode(), data) for name, data in files.items())
    return parts + b"--b--\r\n", "multipart/form-data; boundary=b"


class Labels(unittest.TestCase):
    def setUp(self):
        self.d = Daemon()

    def tearDown(self):
        if self.d.process.poll() is None:
            self.assertEqual(self.d.stop(), 0)
        self.d.kill()

    def change(self, scene, headers=None, **changes):
        return self.d.call("PATCH", "/v1/scenes/" + scene, json.dumps(changes),
                           {"Content-Type": "application/json", **(headers or {})})

    def label(self, scene):
        info = self.d.get("/v1/scenes/" + scene).json()
        return info["name"], info["tags"]

    def listed(self, **query):
        page = self.d.get("/v1/scenes?" + urllib.parse.urlencode(query)).json()
        self.assertEqual(page["total"], len(page["scenes"]))
        return {s["id"] for s in page["scenes"]}

    def restart(self):
        self.assertEqual(self.d.stop(), 0)
        self.d.start()

    # ---- names ----

    def test_names_of_files(self):
        glb = {"Content-Type": "model/gltf-binary"}
        nth = iter(range(100))
        new = lambda: grid_scene(1, "named %d" % next(nth))
        for method, path, body, name in (
                ("POST", "/v1/scenes", new(), ""),
                ("POST", "/v1/scenes?name=A%20hall.glb", new(), "A hall"),
                ("POST", "/v1/scenes?name=folder/caf%C3%A9.GLTF", new(), "café"),
                ("POST", "/v1/scenes?name=%ff%fe", new(), ""),
                ("POST", "/v1/scenes?name=a%0ab", new(), ""),
                ("POST", "/v1/scenes?name=" + "x" * 500, new(), "x" * 127),
                ("POST", "/v1/scenes?name=" + "%C3%A9" * 100, new(), "é" * 63),
                ("PUT", "/v1/scenes/tea%20pot.glb", new(), "tea pot"),
                ("PUT", None, new(), ""), ("PUT", "?name=put", new(), "put")):
            with self.subTest(path=path):
                if path is None or path.startswith("?"):
                    path = "/v1/scenes/" + hashlib.sha256(body).hexdigest() + (path or "")
                answer = self.d.call(method, path, body, glb)
                self.assertEqual(answer.status, 201, answer.body)
                self.assertEqual((answer.json()["name"], answer.json()["tags"]), (name, []))
        for files, name in (({"car.glb": new()}, "car"), ({"blob": new()}, "blob")):
            body, kind = form(files)
            answer = self.d.call("POST", "/v1/scenes", body, {"Content-Type": kind})
            self.assertEqual((answer.status, answer.json()["name"]), (201, name))

    def test_a_name_stays(self):
        data = grid_scene(2, "stays")
        put = lambda query: self.d.call("POST", "/v1/scenes" + query, data)
        scene = put("").json()["id"]
        self.assertEqual(put("?name=first").json()["name"], "first")
        self.assertEqual(put("?name=second").json()["name"], "first")
        answer = self.change(scene, name=" The hall  ", tags=["a b", "c", "c", "ü"])
        self.assertEqual(answer.status, 200, answer.body)
        self.assertEqual(answer.json(), self.d.get("/v1/scenes/" + scene).json())
        self.assertEqual(self.label(scene), ("The hall", ["a b", "c", "ü"]))
        self.change(scene, tags=["only"])
        self.assertEqual(self.label(scene), ("The hall", ["only"]))
        self.restart()
        self.assertEqual(self.label(scene), ("The hall", ["only"]))
        self.assertEqual(put("?name=third").json()["name"], "The hall")
        self.change(scene, name=None, tags=None)
        self.assertEqual(self.label(scene), ("", []))
        self.change(scene, name="again")
        self.assertEqual(self.d.call("DELETE", "/v1/scenes/" + scene).status, 204)
        self.assertEqual(put("").json()["name"], "")

    def test_what_is_no_label(self):
        scene = self.d.upload(grid_scene(2, "strict"))
        self.change(scene, name="was", tags=["was"])
        for wrong, pointer in (({"name": 1}, "/name"), ({"name": "x" * 128}, "/name"),
                               ({"name": "a\nb"}, "/name"), ({"name": "a\u007f"}, "/name"),
                               ({"tags": "a"}, "/tags"), ({"tags": [1]}, "/tags"),
                               ({"tags": [" "]}, "/tags"), ({"tags": ["x" * 40]}, "/tags"),
                               ({"tags": [str(i) for i in range(17)]}, "/tags"),
                               ({"id": "x"}, None), ({"name": "new", "owner": "me"}, None)):
            answer = self.change(scene, **wrong)
            self.assertEqual(answer.status, 422, wrong)
            self.assertEqual(answer.json().get("pointer") or None, pointer, wrong)
        for text, status in ((b"[]", 422), (b"{", 400), (b'{"name": "\xff"}', 400), (b"", 200)):
            answer = self.d.call("PATCH", "/v1/scenes/" + scene, text,
                                 {"Content-Type": "application/merge-patch+json"})
            self.assertEqual(answer.status, status, text)
        self.assertEqual(self.label(scene), ("was", ["was"]))
        self.assertEqual(self.change("0" * 64, name="x").status, 404)
        self.assertEqual(self.d.call("PATCH", "/v1/scenes/" + scene, b"name=x",
                                     {"Content-Type": "text/plain"}).status, 415)

    def test_lists_by_name_and_tag(self):
        scenes = [self.d.upload(grid_scene(1, "listed %d" % i)) for i in range(7)]
        for i, scene in enumerate(scenes):
            self.change(scene, name="Room %d & more" % i, tags=["odd" if i % 2 else "even", "all"])
        self.assertEqual(self.listed(tag="all"), set(scenes))
        self.assertEqual(self.listed(tag="odd"), set(scenes[1::2]))
        self.assertEqual(self.listed(name="ROOM 3"), {scenes[3]})
        self.assertEqual(self.listed(name="room", tag="even"), set(scenes[::2]))
        self.assertEqual(self.listed(name="nobody"), set())
        self.assertEqual(self.listed(tag="od"), set())
        seen, path = [], "/v1/scenes?limit=2&tag=even&name=" + urllib.parse.quote("& more")
        while path:
            page = self.d.get(path).json()
            self.assertEqual(page["total"], 4)
            seen += [s["id"] for s in page["scenes"]]
            path = page.get("next")
        self.assertEqual(seen, sorted(scenes[::2]))
        self.assertEqual(self.d.get("/v1/images?tag=x").status, 422)

    def test_a_damaged_label_hides_nothing(self):
        hurt, whole = (self.d.upload(grid_scene(n, "label")) for n in (1, 2))
        for scene in (hurt, whole):
            self.change(scene, name="named", tags=["t"])
        for damage in (b"", b"x" * 9, b"0" * 16 + b'\n{"name":"lie","tags":[]}', b"\xff" * 40000):
            self.assertEqual(self.d.stop(), 0)
            with open(os.path.join(self.d.store, "scenes", hurt, "label"), "wb") as file:
                file.write(damage)
            self.d.start()
            self.assertEqual(self.label(hurt), ("", []), damage[:20])
            self.assertEqual(self.label(whole), ("named", ["t"]))
            self.assertEqual(self.listed(), {hurt, whole})
            self.assertEqual(self.d.render(hurt, SMALL).status, 200)
            self.assertIn("damaged", self.d.log())
        self.assertEqual(self.change(hurt, name="again").json()["name"], "again")

    def test_whose_it_is_to_name(self):
        self.d.kill()
        self.d = Daemon(start=False)
        path = os.path.join(self.d.folder, "tokens")
        with open(path, "w") as file:
            file.write(TOKENS % 300000)
        os.chmod(path, 0o600)
        self.d.flags += ["--token-file=" + path]
        self.d.start()
        scene = self.d.call("POST", "/v1/scenes", grid_scene(2, "hers"), ALICE).json()["id"]
        for who, status in ((BOB, 403), (SENDER, 403), (READER, 403), ({}, 401), (ALICE, 200),
                            (ADMIN, 200)):
            self.assertEqual(self.change(scene, who, name="mine").status, status, who)
        self.assertEqual(self.d.call("GET", "/v1/scenes/%s/thumbnail" % scene,
                                     headers=READER).status, 200)
        self.assertEqual(self.d.get("/v1/scenes/%s/thumbnail" % scene).status, 401)

    # ---- first digits ----

    def test_first_digits(self):
        scene = self.d.upload(grid_scene(2, "digits"))
        image = self.d.call("POST", "/v1/images", png(4, 4), {"Content-Type": "image/png"}).json()
        for digits in (6, 7, 12, 63, 64):
            self.assertEqual(self.d.get("/v1/scenes/" + scene[:digits]).json()["id"], scene)
            self.assertEqual(self.d.get("/v1/images/" + image["id"][:digits]).json(), image)
        picture = self.d.render(scene, SMALL)
        short = self.d.render(scene[:8], SMALL)
        self.assertEqual((short.body, short.headers["ETag"]), (picture.body, picture.headers["ETag"]))
        self.assertEqual(self.change(scene[:9], name="short").json()["id"], scene)
        for path in ("/v1/scenes/" + scene[:5], "/v1/scenes/" + scene[:8].upper(),
                     "/v1/scenes/%s0" % scene, "/v1/results/" + picture.headers["ETag"][1:9],
                     "/v1/scenes/" + ("0" if scene[0] != "0" else "1") * 8,
                     "/v1/scenes/" + scene[:8] + ("0" if scene[8] != "0" else "1")):
            self.assertEqual(self.d.get(path).status, 404, path)
        whole = self.d.call("PUT", "/v1/scenes/" + scene[:8], grid_scene(2, "digits"))
        self.assertEqual(whole.status, 422)
        self.assertEqual(self.d.call("DELETE", "/v1/scenes/" + scene[:6]).status, 204)
        self.assertEqual(self.d.get("/v1/scenes/" + scene).status, 404)

    def test_digits_of_several(self):
        ids = sorted(self.d.upload(data) for data in twins(6))
        self.assertEqual(ids[0][:6], ids[1][:6])
        for method, path in (("GET", ""), ("GET", "/render"), ("DELETE", ""), ("GET", "/thumbnail")):
            answer = self.d.call(method, "/v1/scenes/" + ids[0][:6] + path)
            self.assertEqual(answer.status, 409, path)
            named = answer.json()["detail"].partition(": ")[2].rstrip(".").split(", ")
            self.assertEqual(len(named), 2)
            for candidate, scene in zip(named, ids):  # each of them can be given
                self.assertEqual(self.d.get("/v1/scenes/" + candidate).json()["id"], scene)
        self.assertEqual(self.d.call("DELETE", "/v1/scenes/" + ids[0]).status, 204)
        self.assertEqual(self.d.get("/v1/scenes/" + ids[1][:6]).json()["id"], ids[1])

    def test_digits_of_jobs(self):
        scene = self.d.upload(grid_scene(2, "job"))
        body = json.dumps({"scene": scene, **SMALL, "sequence": {"frames": 1}})
        start = lambda: self.d.call("POST", "/v1/jobs", body,
                                    {"Content-Type": "application/json"}).json()["id"]
        job, other = start(), start()
        self.d.get("/v1/jobs/%s/events" % job[:32])
        common = len(os.path.commonprefix([job, other]))
        self.assertEqual(self.d.get("/v1/jobs/" + job[:max(6, common + 1)]).json()["id"], job)
        if common >= 6:
            self.assertEqual(self.d.get("/v1/jobs/" + job[:common]).status, 409)
        self.assertEqual(self.d.get("/v1/jobs/ffffffffff").status, 404)

    # ---- small pictures ----

    def test_thumbnail(self):
        scene = self.d.upload(grid_scene(3, "small"))
        path = "/v1/scenes/%s/thumbnail" % scene
        held = self.d.metric("penumbra_store_bytes")
        first = self.d.get(path)
        self.assertEqual((first.status, first.headers["Content-Type"]), (200, "image/jpeg"))
        # It is the default picture, small.
        plain = self.d.render(scene, {"width": 320, "height": 240,
                                      "output": {"format": "jpeg", "quality": 85}})
        self.assertEqual(first.body, plain.body)
        again = self.d.get(path, If_None_Match=first.headers["ETag"])
        self.assertEqual((again.status, again.body), (304, b""))
        file = os.path.join(self.d.store, "scenes", scene, "thumbnail")
        self.assertEqual(self.d.metric("penumbra_store_bytes"), held + os.path.getsize(file))
        self.restart()
        self.assertEqual(self.d.metric("penumbra_store_bytes"), held + os.path.getsize(file))
        with self.d.paused():  # nobody has to draw it
            self.assertEqual(self.d.get(path).body, first.body)
        with open(file, "r+b") as f:
            f.seek(100)
            f.write(b"\0" * 50)
        self.assertEqual(self.d.get(path).body, first.body)
        self.assertEqual(self.d.get(path, If_None_Match=first.headers["ETag"]).status, 304)
        self.assertEqual(self.d.call("HEAD", path).headers["ETag"], first.headers["ETag"])
        self.assertEqual(self.d.call("DELETE", "/v1/scenes/" + scene).status, 204)
        self.assertEqual(self.d.metric("penumbra_store_bytes"), 0)
        self.assertEqual(self.d.get(path).status, 404)

    def test_a_thumbnail_that_finds_no_room(self):
        scene = self.d.upload(grid_scene(3, "full"))
        held = int(self.d.metric("penumbra_store_bytes"))
        self.assertEqual(self.d.stop(), 0)
        self.d.flags.append("--store-limit=%d" % held)
        self.d.start()
        for _ in range(2):
            self.assertEqual(self.d.get("/v1/scenes/%s/thumbnail" % scene).status, 200)
        self.assertEqual(self.d.metric("penumbra_store_bytes"), held)


if __name__ == "__main__":
    harness.main()
