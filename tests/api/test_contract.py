"""Every address: what it answers when asked properly, and when not."""
import gzip
import hashlib
import http.client
import json
import os
import re
import sys
import unittest

import harness
from harness import SMALL, Daemon, grid_scene, png


class Contract(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.d = Daemon()
        cls.glb = grid_scene(4)
        cls.id = cls.d.upload(cls.glb)

    @classmethod
    def tearDownClass(cls):
        status = cls.d.stop()
        assert status == 0, status
        cls.d.kill()
        if len(sys.argv) == 1:  # all tests were run
            never = Daemon.contract.operations - Daemon.contract.seen
            assert not never, "never called: %s" % sorted(never)

    def problem(self, answer, status, pointer=None):
        self.assertEqual(answer.status, status, answer.body)
        self.assertEqual(answer.headers["Content-Type"], "application/problem+json")
        document = answer.json()
        self.assertEqual(document["status"], status)
        self.assertEqual(document["request_id"], answer.headers["X-Request-Id"])
        self.assertTrue(document["detail"])
        self.assertIn("retryable", document)
        self.assertEqual(document["title"],
                         {413: "Content Too Large", 414: "URI Too Long",
                          422: "Unprocessable Content"}.get(
                             status, http.client.responses[status]))
        if pointer is not None:
            self.assertEqual(document.get("pointer"), pointer)
        return document

    # ---- service documents ----

    def test_service(self):
        harness.wait(lambda: self.d.get("/v1").json()["device"])
        v1 = self.d.get("/v1").json()
        self.assertTrue(v1["device"]["renderer"])
        self.assertIn("software", v1["device"])
        self.assertEqual(v1["workers"]["configured"], 1)
        for name, link in v1["links"].items():
            if name == "events":
                self.begin(link)
            else:
                self.assertEqual(self.d.get(link).status, 200, link)

    def test_pages(self):
        for path in ("/", "/docs"):
            page = self.d.get(path)
            self.assertEqual(page.status, 200)
            self.assertTrue(page.headers["Content-Type"].startswith("text/html"))
            self.assertIn("script-src 'self';", page.headers["Content-Security-Policy"])

    def test_modules(self):
        top = os.path.join(os.path.dirname(__file__), "../..")
        viewer = os.path.join(top, "server/pages/viewer")
        files = {"/" + name: os.path.join(top, "clients/js", name)
                 for name in ("penumbra.js", "penumbra-view.js")}
        files["/"] = os.path.join(viewer, "index.html")
        for folder, _, names in os.walk(viewer):
            for name in names:
                if name != "index.html":
                    path = os.path.join(folder, name)
                    files["/viewer/" + os.path.relpath(path, viewer)] = path
        for url, path in files.items():
            with self.subTest(url=url), open(path, "rb") as file:
                plain, text = self.d.get(url), file.read()
                self.assertEqual(plain.body, text)
                small = self.d.get(url, Accept_Encoding="br, gzip;q=0.5")
                self.assertEqual(small.headers["Content-Encoding"], "gzip")
                self.assertEqual(gzip.decompress(small.body), text)
                self.assertIn("Accept-Encoding", small.headers["Vary"])
                self.assertNotEqual(small.headers["ETag"], plain.headers["ETag"])
                for coding, tag in (("", plain), ("gzip", small)):
                    again = self.d.get(url, Accept_Encoding=coding,
                                       If_None_Match=tag.headers["ETag"])
                    self.assertEqual((again.status, again.body), (304, b""))
        for url in ("/openapi.json", "/v1/techniques"):
            plain, small = self.d.get(url), self.d.get(url, Accept_Encoding="gzip")
            self.assertEqual(gzip.decompress(small.body), plain.body)
            self.assertEqual(self.d.get(url, If_None_Match=plain.headers["ETag"]).status, 304)
        for refusal in ("identity", "gzip;q=0", "*;q=0", "gzip;q=0, *"):
            answer = self.d.get("/viewer/main.js", Accept_Encoding=refusal)
            self.assertNotIn("Content-Encoding", answer.headers, refusal)
        for nothing in ("/viewer/nothing.js", "/viewer/panels/main.js", "/viewer/..", "/viewer/"):
            self.problem(self.d.get(nothing), 404)

    def test_openapi_conditional(self):
        first = self.d.get("/openapi.json")
        self.assertTrue(first.json()["openapi"].startswith("3.1"))
        again = self.d.get("/openapi.json", If_None_Match=first.headers["ETag"])
        self.assertEqual((again.status, again.body), (304, b""))

    def test_techniques(self):
        names = [t["name"] for t in self.d.get("/v1/techniques").json()["techniques"]]
        self.assertIn("pcss", names)
        for name in names:
            self.assertEqual(self.d.get("/v1/techniques/" + name).json()["name"], name)
        self.problem(self.d.get("/v1/techniques/nothing-like-it"), 404)

    def test_answers_are_held_against_the_contract(self):
        contract = Daemon.contract
        answer = self.d.get("/v1/scenes/" + self.id)
        for wrong in ({"extra": 1}, {"id": "x"}, {"bounds": {}}, {"triangles": "32"}):
            lie = harness.Answer(200, answer.headers, json.dumps({**answer.json(), **wrong}))
            with self.assertRaises(AssertionError, msg=wrong):
                contract.check("GET", "/v1/scenes/" + self.id, lie)
        less = {k: v for k, v in answer.json().items() if k != "warnings"}
        for status, body in ((200, less), (202, answer.json()), (404, answer.json())):
            with self.assertRaises(AssertionError):
                contract.check("GET", "/v1/scenes/" + self.id,
                               harness.Answer(status, answer.headers, json.dumps(body)))

    def test_contract_lists_every_address_it_serves(self):
        paths = self.d.get("/openapi.json").json()["paths"]
        for path, methods in paths.items():
            url = path.replace("{id}", self.id).replace("{name}", "pcss").replace(
                "{number}", "0").replace("panels/{file}", "panels/picture.js").replace(
                "{file}", "main.js")
            for method, operation in methods.items():
                content = operation["responses"].get("200", {}).get("content", {})
                if list(content) == ["text/event-stream"]:
                    self.begin(url)
                elif method in ("get", "head"):
                    self.assertLess(self.d.call(method.upper(), url).status, 500, url)

    def begin(self, url):
        """Asks for what may never end, and leaves when the answer has begun."""
        connection = http.client.HTTPConnection("127.0.0.1", self.d.port, timeout=60)
        self.addCleanup(connection.close)
        connection.request("GET", url)
        response = connection.getresponse()
        self.assertLess(response.status, 500, url)
        if response.status < 400:
            Daemon.contract.check("GET", url, harness.Answer(response.status, response.headers, b""))

    def test_jobs(self):
        headers = {"Content-Type": "application/json", "Idempotency-Key": "a-sequence"}
        body = json.dumps({"scene": self.id, **SMALL, "sequence": {"frames": 2}})
        answer = self.d.call("POST", "/v1/jobs", body, headers)
        self.assertEqual(answer.status, 202, answer.body)
        links = answer.json()["links"]
        self.assertEqual(answer.headers["Location"], links["self"])
        events = self.d.get(links["events"])  # until the job is over
        self.assertEqual(events.status, 200)
        self.assertEqual(self.d.get(links["self"]).json()["state"], "successful")
        self.assertEqual(self.d.get(links["frames"] + "/1").status, 200)
        self.assertEqual(self.d.get(links["self"] + "/result", Range="bytes=0-9").status, 206)
        self.assertEqual(len(self.d.get("/v1/jobs").json()["jobs"]), 1)
        self.assertEqual(self.d.call("DELETE", links["self"]).status, 204)

    # ---- addresses ----

    def test_no_such_address(self):
        for path in ("/v2", "/v1/", "//v1", "/v1/../v1", "/v1/%2e%2e/etc", "/v1%00", "/V1",
                     "/v1/scenes/" + self.id.upper(), "/v1/scenes/" + self.id[:5],
                     "/v1/scenes/%s/" % self.id, "/v1/scenes/../../etc/passwd", "/v1/jobs/",
                     "/%76%31", "/v1/scenes/%s/render/x" % self.id):
            self.problem(self.d.get(path), 404)
        self.problem(self.d.get("/v1/scenes/" + "0" * 64), 404)
        self.problem(self.d.get("/v1/images/" + "0" * 64), 404)
        self.problem(self.d.get("/v1/results/" + "0" * 64), 404)
        self.problem(self.d.get("/v1/scenes/%s/render" % ("0" * 64)), 404)

    def test_wrong_method(self):
        for method, path, allow in (
                ("POST", "/v1", "GET, HEAD"), ("DELETE", "/v1/scenes", "GET, HEAD, POST, PUT"),
                ("POST", "/v1/scenes/" + self.id, "GET, HEAD, PUT, PATCH, DELETE"),
                ("PUT", "/v1/scenes/%s/render" % self.id, "GET, HEAD, POST"),
                ("OPTIONS", "/v1", "GET, HEAD"), ("BREW", "/", "GET, HEAD")):
            answer = self.d.call(method, path)
            self.problem(answer, 405)
            self.assertEqual(set(answer.headers["Allow"].split(", ")), set(allow.split(", ")))

    def test_long_target(self):
        self.problem(self.d.get("/v1?" + "a" * 9000), 414)

    def test_trace_and_request_id(self):
        trace = "0af7651916cd43dd8448eb211c80319c"
        answer = self.d.get("/v1", traceparent="00-%s-b7ad6b7169203331-01" % trace)
        parts = answer.headers["traceparent"].split("-")
        self.assertEqual(parts[:2], ["00", trace])
        self.assertNotEqual(parts[2], "b7ad6b7169203331")
        line = harness.wait(lambda: [l for l in self.d.log().split("\n") if trace in l])[0]
        self.assertIn(answer.headers["X-Request-Id"], line)
        self.assertNotIn("traceparent", self.d.get("/v1", traceparent="00-xyz-1-1").headers)

    # ---- scenes ----

    def test_same_bytes_same_id(self):
        self.assertEqual(self.id, hashlib.sha256(self.glb).hexdigest())
        again = self.d.call("POST", "/v1/scenes", self.glb, {"Content-Type": "model/gltf-binary"})
        self.assertEqual(again.status, 200)
        self.assertEqual(again.headers["Location"], "/v1/scenes/" + self.id)
        self.assertEqual(again.json()["triangles"], 32)
        self.assertEqual(self.d.get("/v1/scenes/" + self.id).json(), again.json())

    def test_put(self):
        glb = grid_scene(3, "put")
        name = hashlib.sha256(glb).hexdigest()
        kind = {"Content-Type": "model/gltf-binary"}
        self.problem(self.d.call("PUT", "/v1/scenes/" + "1" * 64, glb, kind), 422)
        self.assertEqual(self.d.call("PUT", "/v1/scenes/" + name, glb, kind).status, 201)
        self.assertEqual(self.d.call("PUT", "/v1/scenes/" + name, glb, kind).status, 200)
        self.assertEqual(self.d.call("DELETE", "/v1/scenes/" + name).status, 204)
        self.problem(self.d.call("DELETE", "/v1/scenes/" + name), 404)
        self.problem(self.d.get("/v1/scenes/" + name), 404)
        self.problem(self.d.get("/v1/scenes/%s/render" % name), 404)

    def test_what_a_scene_is_called(self):
        answer = self.d.call("PATCH", "/v1/scenes/" + self.id, '{"name": "grid", "tags": []}',
                             {"Content-Type": "application/json"})
        self.assertEqual((answer.status, answer.json()["name"]), (200, "grid"))

    def test_pages_of_scenes(self):
        ids = {self.d.upload(grid_scene(1, "page %d" % i)) for i in range(5)}
        seen, path = [], "/v1/scenes?limit=2"
        while path:
            page = self.d.get(path).json()
            self.assertLessEqual(len(page["scenes"]), 2)
            seen += [s["id"] for s in page["scenes"]]
            path = page.get("next")
        self.assertEqual(seen, sorted(seen))
        self.assertEqual(len(seen), len(set(seen)))
        self.assertTrue(ids <= set(seen))
        self.problem(self.d.get("/v1/scenes?limit=0"), 422, "/limit")
        self.problem(self.d.get("/v1/scenes?limit=x"), 422, "/limit")
        self.problem(self.d.get("/v1/scenes?after=zz"), 422, "/after")
        self.problem(self.d.get("/v1/scenes?sort=up"), 422)
        for name in ids:
            self.assertEqual(self.d.call("DELETE", "/v1/scenes/" + name).status, 204)

    def test_curl_upload(self):
        """No type, and either form of the address that curl -T makes."""
        for path in ("/v1/scenes", "/v1/scenes/a%20scene.glb"):
            answer = self.d.call("PUT", path, self.glb)
            self.assertEqual((answer.status, answer.json()["id"]), (200, self.id))

    def test_uploads_that_are_refused(self):
        post = lambda body, kind: self.d.call("POST", "/v1/scenes", body, {"Content-Type": kind})
        self.problem(post(self.glb, "text/plain"), 415)
        self.problem(post(b"", "model/gltf-binary"), 400)
        self.assertIn(post(b"not a scene at all", "model/gltf-binary").status, (415, 422))
        self.assertIn(post(self.glb[:-20], "model/gltf-binary").status, (400, 422))
        self.problem(post(b"x", "multipart/form-data"), 415)
        self.problem(post(b"x", "multipart/form-data; boundary=b"), 400)
        self.assertEqual(self.d.leftovers(), [])

    def test_images(self):
        data = png(5, 4)
        path, kind = "/v1/images/" + hashlib.sha256(data).hexdigest(), {"Content-Type": "image/png"}
        self.assertEqual(self.d.call("PUT", path, data, kind).status, 201)
        self.assertEqual(self.d.call("POST", "/v1/images", data, kind).status, 200)
        self.assertEqual(self.d.get(path).json()["width"], 5)
        self.assertIn(self.d.get(path).json(), self.d.get("/v1/images").json()["images"])
        self.assertEqual(self.d.call("DELETE", path).status, 204)
        self.problem(self.d.get(path), 404)

    # ---- renders ----

    def test_image_and_headers(self):
        answer = self.d.render(self.id, SMALL)
        self.assertEqual(answer.status, 200, answer.body)
        self.assertEqual(answer.headers["Content-Type"], "image/png")
        self.assertTrue(answer.body.startswith(b"\x89PNG"))
        self.assertRegex(answer.headers["ETag"], r'^"[0-9a-f]{64}"$')
        self.assertEqual(answer.headers["Vary"], "Accept")
        timing = answer.timing()
        for stage in ("queue", "load", "gbuffer", "shadow", "technique", "shade", "readback",
                      "encode", "total"):
            self.assertIn(stage, timing)
        self.assertGreaterEqual(timing["total"], sum(timing.values()) - timing["total"] - 0.01)

    def test_get_and_post_are_one(self):
        post = self.d.render(self.id, SMALL)
        get = self.d.get("/v1/scenes/%s/render?technique=hard&width=64&height=48" % self.id)
        self.assertEqual(get.body, post.body)
        self.assertEqual(get.headers["ETag"], post.headers["ETag"])
        empty = self.d.call("POST", "/v1/scenes/%s/render?width=3" % self.id, b"{}",
                            {"Content-Type": "application/json"})
        self.problem(empty, 400)

    def test_comparison(self):
        asked = {"width": 48, "height": 36, "techniques": ["hard"],
                 "reference": {"name": "multisample", "params": {"samples": 16}}}
        answer = self.d.call("POST", "/v1/scenes/%s/compare" % self.id, json.dumps(asked),
                             {"Content-Type": "application/json"})
        self.assertEqual(answer.status, 200, answer.body)
        method, = answer.json()["methods"]
        self.assertIn("rmse", method)
        for link in method["links"].values():
            self.assertEqual(self.d.get(link).status, 200)

    def test_conditional(self):
        path = "/v1/scenes/%s/render?technique=none&width=40&height=30" % self.id
        first = self.d.get(path)
        tag = first.headers["ETag"]
        before = self.d.metric("penumbra_renders_total", '{technique="none"}')
        for match in (tag, 'W/"x", ' + tag):
            again = self.d.get(path, If_None_Match=match)
            self.assertEqual((again.status, again.body), (304, b""))
            self.assertEqual(again.headers["ETag"], tag)
        self.assertEqual(self.d.get(path, If_None_Match='"%s"' % ("0" * 64)).status, 200)
        self.assertEqual(self.d.metric("penumbra_renders_total", '{technique="none"}'), before)
        other = self.d.get(path + "&exposure_ev=1")
        self.assertNotEqual(other.headers["ETag"], tag)
        same = self.d.get(path + "&deadline_ms=29000&priority=batch")
        self.assertEqual(same.headers["ETag"], tag)

    def test_head(self):
        path = "/v1/scenes/%s/render?technique=none&width=40&height=30" % self.id
        get, head = self.d.get(path), self.d.call("HEAD", path)
        self.assertEqual((head.status, head.body), (200, b""))
        for name in ("ETag", "Content-Type", "Content-Length"):
            self.assertEqual(head.headers[name], get.headers[name])
        self.assertEqual(self.d.call("HEAD", "/v1").status, 200)

    def test_record(self):
        answer = self.d.render(self.id, SMALL, Accept="application/json")
        self.assertEqual(answer.status, 200, answer.body)
        record = answer.json()
        self.assertEqual(record["scene"], self.id)
        self.assertEqual(record["request"]["width"], 64)
        self.assertEqual(record["request_id"], answer.headers["X-Request-Id"])
        image = self.d.get(record["image"]["href"])
        self.assertEqual(image.headers["Content-Type"], "image/png")
        self.assertEqual(image.body, self.d.render(self.id, SMALL).body)
        # The request as completed gives the same picture again.
        self.assertEqual(self.d.render(self.id, record["request"]).body, image.body)

    def test_accept(self):
        ask = lambda accept, **more: self.d.render(self.id, {**SMALL, **more}, Accept=accept)
        self.assertEqual(ask("image/webp").headers["Content-Type"], "image/webp")
        self.assertEqual(ask("image/*").headers["Content-Type"], "image/png")
        browser = "image/avif,image/webp,image/apng,*/*;q=0.8"
        self.assertEqual(ask(browser).headers["Content-Type"], "image/png")
        self.assertEqual(ask("image/png;q=0, image/jpeg").headers["Content-Type"], "image/jpeg")
        self.problem(ask("text/html"), 406)
        self.problem(ask("image/png", output={"format": "exr"}), 406)
        exr = ask("*/*", output={"format": "exr", "layer": "all"})
        self.assertEqual(exr.headers["Content-Type"], "image/x-exr")
        self.assertTrue(exr.body.startswith(b"\x76\x2f\x31\x01"))

    def test_bad_requests(self):
        post = lambda body, kind="application/json": self.d.call(
            "POST", "/v1/scenes/%s/render" % self.id, body, {"Content-Type": kind})
        self.problem(post(b"{"), 400)
        self.problem(post(b"[" * 40 + b"]" * 40), 400)
        self.problem(post(b'{"width":NaN}'), 400)
        self.problem(post(b"\xff\xfe{}"), 400)
        self.problem(post(b"{}", "text/plain"), 415)
        self.problem(post(b" " * 70000), 413)
        for body, pointer in (
                ({"widht": 3}, "/widht"), ({"width": "3"}, "/width"), ({"width": 0}, "/width"),
                ({"width": 1.5}, "/width"), ({"width": 8192, "height": 8192}, None),
                ({"width": 1e9}, "/width"), ({"technique": {"name": "x"}}, None),
                ({"technique": {"name": "pcss", "params": {"search_taps": 0}}},
                 "/technique/params/search_taps"),
                ({"camera": {"eye": [0, 0, 0], "target": [0, 0, 0]}}, None),
                ({"lights": [{"type": "rect", "texture": {"image": "0" * 64}}]},
                 "/lights/0/texture/image"),
                ({"camera": {"index": 7}}, None),
                ({"output": {"layer": "all"}}, "/output/layer")):
            self.problem(post(json.dumps(body)), 422, pointer)
        query = lambda q: self.d.get("/v1/scenes/%s/render?%s" % (self.id, q))
        self.problem(query("width=%zz"), 400)
        self.problem(query("a%00b=1"), 400)
        self.problem(query("width=nan"), 422)
        self.problem(query("&".join("k%d=1" % i for i in range(400))), 400)

    def test_every_parameter_out_of_range(self):
        for t in self.d.get("/v1/techniques").json()["techniques"]:
            for row in t["params"]:
                if row["type"] not in ("int", "uint", "float") or row["components"] != 1:
                    continue
                for value in (row["min"] - 1, row["max"] * 2 + 1):
                    body = {"technique": {"name": t["name"], "params": {row["name"]: value}}}
                    self.problem(self.d.render(self.id, body), 422)

    def test_stats_and_metrics(self):
        self.d.render(self.id, SMALL)
        stats = self.d.get("/v1/stats").json()
        hard = [t for t in stats["techniques"] if t["name"] == "hard"][0]
        self.assertGreater(hard["total"]["p50_ms"], 0)
        self.assertGreaterEqual(hard["total"]["p95_ms"], hard["total"]["p50_ms"])
        text = self.d.admin("/metrics").body.decode()
        for line in text.strip().split("\n"):
            self.assertRegex(line, r'^(# (HELP|TYPE) \w+ .+|\w+(\{\w+="[^"]*"(,\w+="[^"]*")*\})? -?[0-9.e+-]+)$')
        families = re.findall(r"^# TYPE (\w+)", text, re.M)
        self.assertEqual(len(families), len(set(families)))
        self.assertIn("penumbra_device_info{", text)
        self.assertGreater(self.d.metric("penumbra_renders_total", '{technique="hard"}'), 0)

    def test_admin(self):
        self.assertEqual(self.d.admin("/livez").status, 200)
        harness.wait(lambda: self.d.admin("/readyz").status == 200)
        self.assertEqual(self.d.admin("/v1").status, 404)
        self.assertEqual(self.d.call("POST", "/livez", port=self.d.admin_port).status, 405)
        for path in ("/livez", "/readyz", "/metrics"):
            self.problem(self.d.get(path), 404)

    def test_delete_while_rendering_is_harmless(self):
        scene = self.d.upload(grid_scene(2, "to be deleted"))
        self.assertEqual(self.d.render(scene, SMALL).status, 200)
        self.assertEqual(self.d.call("DELETE", "/v1/scenes/" + scene).status, 204)
        self.problem(self.d.render(scene, SMALL), 404)
        self.assertEqual(self.d.upload(grid_scene(2, "to be deleted")), scene)
        self.assertEqual(self.d.render(scene, SMALL).status, 200)


if __name__ == "__main__":
    harness.main()
