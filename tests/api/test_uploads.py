"""Uploads in every form, and files that mean harm."""
import hashlib
import io
import json
import os
import socket
import struct
import time
import unittest
import zipfile
import zlib

import harness
from harness import PATIENCE, SMALL, Daemon, grid_scene, png, raw, wait

try:
    import hostile_files
except ImportError:
    hostile_files = None


def multipart(files, boundary="8a3b"):
    """files: (file name or None for a plain field, bytes)."""
    out = b""
    for name, data in files:
        out += b"--" + boundary.encode() + b"\r\n"
        if name is None:
            out += b'Content-Disposition: form-data; name="comment"\r\n\r\n'
        else:
            out += (b'Content-Disposition: form-data; name="files"; filename="%s"\r\n'
                    b"Content-Type: application/octet-stream\r\n\r\n" % name.encode())
        out += data + b"\r\n"
    return out + b"--" + boundary.encode() + b"--\r\n", "multipart/form-data; boundary=" + boundary


def gltf_with_buffer(name="mesh.bin"):
    binary = struct.pack("<9f", 0, 0.5, 0, 0, 0.5, 1, 1, 0.5, 0)
    document = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
                "nodes": [{"mesh": 0}],
                "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
                "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3",
                               "min": [0, 0.5, 0], "max": [1, 0.5, 1]}],
                "bufferViews": [{"buffer": 0, "byteLength": 36}],
                "buffers": [{"byteLength": 36, "uri": name}]}
    return json.dumps(document).encode(), binary


class Uploads(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.d = Daemon("--import-memory=512M", "--import-cpu-seconds=10", "--upload-limit=40M")

    @classmethod
    def tearDownClass(cls):
        assert cls.d.leftovers() == [], cls.d.leftovers()
        assert cls.d.stop() == 0
        cls.d.kill()

    def post(self, body, kind, path="/v1/scenes"):
        return self.d.call("POST", path, body, {"Content-Type": kind} if kind else {})

    def test_multipart(self):
        gltf, binary = gltf_with_buffer()
        one = self.post(*multipart([("scene.gltf", gltf), ("mesh.bin", binary)]))
        self.assertEqual(one.status, 201, one.body)
        self.assertEqual(one.json()["triangles"], 1)
        # The order does not matter, nor what is not a file, nor the boundary.
        two = self.post(*multipart([(None, b"hello"), ("./mesh.bin", binary), ("scene.gltf", gltf)],
                                   "x" * 70))
        self.assertEqual((two.status, two.json()["id"]), (200, one.json()["id"]))
        self.assertEqual(self.d.render(one.json()["id"], SMALL).status, 200)

    def test_multipart_boundaries_in_pieces(self):
        """Every way to cut a body in two, and byte by byte."""
        gltf, binary = gltf_with_buffer("m.bin")
        body, kind = multipart([("s.gltf", gltf), ("m.bin", binary + b"\r\n--8a3\r\n-\r\n")], "8a3b")
        gltf_id = None
        head = ("POST /v1/scenes HTTP/1.1\r\nHost: x\r\nConnection: close\r\nContent-Type: %s\r\n"
                "Content-Length: %d\r\n\r\n" % (kind, len(body))).encode()
        for cut in list(range(1, len(body), 41)) + ["bytes"]:
            with socket.create_connection(("127.0.0.1", self.d.port), timeout=20 * PATIENCE) as s:
                s.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                s.sendall(head)
                if cut == "bytes":
                    for i in range(len(body)):
                        s.sendall(body[i:i + 1])
                else:
                    s.sendall(body[:cut])
                    time.sleep(0.003)
                    s.sendall(body[cut:])
                answer = b""
                while True:
                    piece = s.recv(65536)
                    if not piece:
                        break
                    answer += piece
            self.assertIn(int(answer.split()[1]), (200, 201), answer)
            scene = json.loads(answer.split(b"\r\n\r\n", 1)[1])["id"]
            gltf_id = gltf_id or scene
            self.assertEqual(scene, gltf_id)

    def test_spellings(self):
        """The names that forms, exporters and archivers write."""
        for uri, scene, stored in (
                ("tex\\mesh.bin", "scene.gltf", "tex/mesh.bin"),
                ("mesh.bin", "C:\\fakepath\\scene.gltf", "C:\\fakepath\\mesh.bin"),
                ("mesh.bin?v=3", "scene.gltf", "mesh.bin"),
                ("Me\u0301sh.bin", "scene.gltf", "M\u00e9sh.bin"),
                ("MESH.bin", "scene.gltf", "mesh.BIN"),
                ("T%C3%A9x\\me\u0301sh.BIN", "scene.gltf", "te\u0301X/M\u00c9SH.bin"),
                ("Gr%F6%DFe.bin", "scene.gltf", "Gr\u00f6\u00dfe.bin"),  # escape() of old scripts
                ("\uff4desh\u00a01\u200b.bin", "scene.gltf", "mesh 1.bin"),
                ("my%2520mesh.bin", "scene.gltf", "my%20mesh.bin"),
                ("50% off.bin", "scene.gltf", "50% off.bin"),
                ("..//bin/./x/..\\mesh.bin", "pack/gltf/scene.gltf", "pack/bin/mesh.bin"),
                ("bin/mesh.bin", "a/b/../scene.gltf", "a/./bin//mesh.bin"),
                ("file:///C:/Users/me/mesh%201.bin?v=1#x", "scene.gltf", "mesh 1.bin"),
                ("file://server/share/mesh.bin", "scene.gltf", "mesh.bin"),
                ("D:\\me\\tex\\mesh.bin", "scene.gltf", "tex/mesh.bin")):
            gltf, binary = gltf_with_buffer(uri)
            packed = io.BytesIO()
            with zipfile.ZipFile(packed, "w") as z:
                z.writestr(scene, gltf)
                z.writestr(stored, binary)
            for body, kind in (multipart([(scene, gltf), (stored, binary)]),
                               (packed.getvalue(), "application/zip")):
                answer = self.post(body, kind)
                self.assertIn(answer.status, (200, 201), (uri, answer.body))
                self.assertEqual((answer.json()["triangles"], answer.json()["warnings"]), (1, []))

    def test_packed_twice(self):
        """A zip around a zip is what is in it; around two, nobody knows."""
        gltf, binary = gltf_with_buffer()

        def pack(*files):
            packed = io.BytesIO()
            with zipfile.ZipFile(packed, "w") as z:
                for name, data in files:
                    z.writestr(name, data)
            return packed.getvalue()
        inner = pack(("a.gltf", gltf), ("b/a.vrm", grid_scene(2, "inner")), ("mesh.bin", binary))
        outer = pack(("source/model.ZIP", inner), ("readme.txt", b"x"), ("__MACOSX/._x.zip", b"x"))
        for query, triangles in (("", 1), ("?entry=b/a.vrm", 8)):
            answer = self.post(outer, "application/zip", "/v1/scenes" + query)
            self.assertEqual((answer.status, answer.json().get("triangles")), (201, triangles))
        for files in ((("a.zip", inner), ("b.zip", inner)), (("a.zip", outer),),
                      (("a.zip", inner[:-9]),)):
            self.assertEqual(self.post(pack(*files), "application/zip").status, 422)

    def test_json_as_people_write_it(self):
        """Padding is none of it; what JSON lacks is told by its name."""
        gltf = json.dumps({"asset": {"version": "2.0"}, "scenes": [{"nodes": []}]}).encode()
        for text in (b"\xef\xbb\xbf" + gltf, b"\r\n " + gltf + b"\n", gltf + bytes(3)):
            self.assertIn(self.post(text, None).status, (200, 201), text)
        for text, word in ((b"// mine\n" + gltf, "comments"), (b"/* mine */" + gltf, "comments"),
                           (gltf.replace(b'"scenes"', b'/* x */ "scenes"'), "comments"),
                           (gltf.replace(b"[]}]", b"[],}]"), "comma"),
                           (gltf.replace(b"[]}]", b"[]},]"), "comma"),
                           (gltf.replace(b"[]}", b'[], "extras": NaN}'), "finite"),
                           (gltf.replace(b"[]}", b'[], "extras": -Infinity}'), "finite"),
                           (gltf.replace(b'"scenes"', b"'scenes'"), "double quotes")):
            answer = self.post(text, None)
            self.assertEqual((answer.status, word in answer.json()["detail"]), (422, True),
                             (text, answer.body))

    def test_entries(self):
        """Several scenes in one upload: the answer lists them, and each has an id of its own."""
        gltf, binary = gltf_with_buffer("../mesh.bin")
        packed = io.BytesIO()
        with zipfile.ZipFile(packed, "w") as z:
            for name, data in (("mesh.bin", binary), ("a/m.gltf", gltf), ("b b/m.gltf", gltf)):
                z.writestr(name, data)
        body = packed.getvalue()
        refused = self.post(body, "application/zip")
        self.assertEqual(refused.status, 422)
        for name in ("a/m.gltf", "b b/m.gltf", "?entry="):
            self.assertIn(name, refused.json()["detail"])
        ids = []
        for name, query in (("a/m.gltf", "a/m.gltf"), ("b b/m.gltf", "b%20b%2Fm.gltf")):
            answer = self.post(body, "application/zip", "/v1/scenes?entry=" + query)
            self.assertEqual((answer.status, answer.json()["triangles"]), (201, 1), answer.body)
            entry = name.encode()
            ids.append(hashlib.sha256(b"PENENTR1" + struct.pack("<II", len(entry), 0) + entry +
                                      body).hexdigest())
            self.assertEqual(answer.json()["id"], ids[-1])
            put = self.d.call("PUT", "/v1/scenes/%s?entry=%s" % (ids[-1], query), body)
            self.assertEqual((put.status, put.json()["id"]), (200, ids[-1]))
            self.assertEqual(self.d.render(ids[-1], SMALL).status, 200)
        self.assertNotEqual(ids[0], ids[1])
        form = self.post(*multipart([("a/m.gltf", gltf), ("b/m.gltf", gltf), ("mesh.bin", binary)]))
        self.assertEqual(form.status, 422)
        body, kind = multipart([("a/m.gltf", gltf), ("b/m.gltf", gltf), ("mesh.bin", binary)])
        self.assertEqual(self.post(body, kind, "/v1/scenes?entry=b/m.gltf").status, 201)
        for query in ("entry=c.gltf", "entry=", "entry=../a/m.gltf", "entry=mesh.bin", "other=1",
                      "entry=" + "x" * 300):
            answer = self.post(body, kind, "/v1/scenes?" + query)
            self.assertEqual(answer.status, 422, query)
        self.assertEqual(self.post(png(2, 2), "image/png", "/v1/images?entry=a").status, 422)
        self.assertEqual(self.post(grid_scene(2, "alone"), "model/gltf-binary",
                                   "/v1/scenes?entry=a.glb").status, 422)

    def test_bytes_say_what_they_are(self):
        """curl sends no type with -T, and a form's with --data-binary."""
        glb, (gltf, _) = grid_scene(3, "typeless"), gltf_with_buffer("data:,%00" + "%00" * 35)
        packed = io.BytesIO()
        with zipfile.ZipFile(packed, "w") as z:
            z.writestr("s.gltf", gltf)
        for body in (glb, gltf, packed.getvalue()):
            scene = hashlib.sha256(body).hexdigest()
            status = 201
            for method, path, kind in (
                    ("PUT", "/v1/scenes", None), ("PUT", "/v1/scenes/any%20name.glb", None),
                    ("PUT", "/v1/scenes/" + scene, None), ("POST", "/v1/scenes", None),
                    ("POST", "/v1/scenes", "application/x-www-form-urlencoded"),
                    ("POST", "/v1/scenes", "application/octet-stream"),
                    ("POST", "/v1/scenes", "binary/octet-stream"),
                    ("POST", "/v1/scenes", "application/x-zip"),
                    ("POST", "/v1/scenes", "model/vnd.gltf.binary"),
                    ("POST", "/v1/scenes", "model/gltf-binary")):
                answer = self.d.call(method, path, body, {"Content-Type": kind} if kind else {})
                self.assertEqual((answer.status, answer.json()["id"]), (status, scene), answer.body)
                status = 200
        self.assertEqual(self.d.call("PUT", "/v1/scenes", b"hello world").status, 415)
        image = self.post(png(3, 2), "application/x-www-form-urlencoded", "/v1/images")
        self.assertEqual(image.status, 201)
        self.assertEqual(self.post(png(3, 2), "image/x-png", "/v1/images").status, 200)
        self.d.call("DELETE", "/v1/images/" + image.json()["id"])
        self.assertEqual(self.post(glb, "text/plain").status, 415)
        self.assertEqual(self.post(glb, "text/html").status, 415)
        self.assertEqual(self.d.call("GET", "/v1/scenes/any.glb").status, 404)

    def test_single_file_form(self):
        glb = grid_scene(2, "form")
        scene = self.post(glb, "model/gltf-binary").json()["id"]
        for name in ("any name.glb", "blob", "C:\\fakepath\\upload.bin", "a.b.c"):
            form = self.post(*multipart([(name, glb)]))
            self.assertEqual((form.status, form.json()["id"]), (200, scene), name)

    def test_zip(self):
        gltf, binary = gltf_with_buffer()
        packed = io.BytesIO()
        with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as z:
            z.writestr("folder/scene.gltf", gltf)
            z.writestr("folder/mesh.bin", binary)
        answer = self.post(packed.getvalue(), "application/zip")
        self.assertEqual(answer.status, 201, answer.body)
        self.assertEqual(answer.json()["triangles"], 1)

    def zip_of_names(self, uri, *raw_names):
        """A zip whose entries have names of such bytes, and nothing says of which code page."""
        gltf, binary = gltf_with_buffer(uri)
        packed, stand_ins = io.BytesIO(), {}
        with zipfile.ZipFile(packed, "w") as z:
            z.writestr("scene.gltf", gltf)
            for i, name in enumerate(raw_names):
                stand_ins[b"%d" % i * len(name)] = name
                z.writestr("%d" % i * len(name), binary)
        body = packed.getvalue()
        for stand_in, name in stand_ins.items():
            body = body.replace(stand_in, name)
        return self.post(body, "application/zip")

    def test_zip_names_in_other_code_pages(self):
        for uri, pages in (("K\u00f6rper/Gr\u00fc\u00dfe.bin",
                            ("cp437", "cp850", "cp1252", "mac_roman", "utf-8")),
                           ("\u30c6\u30af\u30b9\u30c1\u30e3/\u8868.bin", ("cp932", "euc_jp")),
                           ("\u8d34\u56fe/\u7eb9\u7406.bin", ("gbk", "gb18030")),
                           ("\u041c\u043e\u0434\u0435\u043b\u044c.bin", ("cp866", "cp1251", "koi8_r")),
                           ("\ubaa8\ub378.bin", ("cp949",))):
            for page in pages:
                for others in ((), ("K\u00f6rper/Anderes.bin".encode(page, "ignore"),)):
                    answer = self.zip_of_names(uri, uri.encode(page), *others)
                    self.assertIn(answer.status, (200, 201), (uri, page, answer.body))
        for names in ((b"\x94.bin", b"\xf6.bin"),  # either may be meant
                      (b"\xc3\xb6.bin",),  # what is UTF-8 is itself
                      (b"\xf6" * 9 + b".bin",), (b"a\xf6.bin",)):
            answer = self.zip_of_names("\u00e4.bin", *names)
            self.assertEqual(answer.status, 422, (names, answer.body))

    def test_zip_entries_that_nobody_can_mean(self):
        """The icon of a macOS folder, names too long, outside, of control characters: left out."""
        gltf, binary = gltf_with_buffer()
        for name in ("Icon\r", "n" * 300, "../x", "/x", "note: x", "a//b", "a\x01b"):
            packed = io.BytesIO()
            with zipfile.ZipFile(packed, "w") as z:
                z.writestr(name, b"x")
                z.writestr("scene.gltf", gltf)
                z.writestr("mesh.bin", binary)
            answer = self.post(packed.getvalue(), "application/zip")
            self.assertEqual(answer.status, 201, (name, answer.body))
            self.assertEqual((answer.json()["triangles"], answer.json()["warnings"]), (1, []))

    def test_bad_forms(self):
        gltf, binary = gltf_with_buffer()
        whole, kind = multipart([("scene.gltf", gltf), ("mesh.bin", binary)])
        for body, status in ((whole[:-10], 400), (whole.replace(b"form-data", b"attachment"), 400),
                             (multipart([(None, b"x")])[0], 400),
                             (multipart([("scene.gltf", gltf)])[0], 422),
                             (multipart([("a.bin", b"1"), ("a.bin", b"2")])[0], 422),
                             (b"--8a3b--\r\n", 400), (b"\r\n" * 50000, 400)):
            answer = self.post(body, kind)
            self.assertEqual(answer.status, status, (body[:80], answer.body))
        for name in ("../x.bin", "/etc/x", "a/../../b", "..\\x", "x" * 300, "a/..", "a:b"):
            answer = self.post(*multipart([("scene.gltf", gltf), (name, b"1")]))
            self.assertIn(answer.status, (400, 422), name)
        for count, status in ((4200, 413), (9000, 400)):
            files = [(None if status == 400 else "f%d" % i, b"") for i in range(count)]
            self.assertEqual(self.post(*multipart(files)).status, status)

    def test_images(self):
        data = png(20, 10)
        first = self.post(data, "image/png", "/v1/images")
        self.assertEqual(first.status, 201, first.body)
        image = first.json()
        self.assertEqual((image["width"], image["height"]), (20, 10))
        self.assertEqual(self.post(data, "image/png", "/v1/images").status, 200)
        self.assertEqual(self.d.get("/v1/images/" + image["id"]).json(), image)
        self.assertIn(image["id"], [i["id"] for i in self.d.get("/v1/images").json()["images"]])
        scene = self.d.upload(grid_scene(2))
        lit = lambda texture: self.d.render(scene, dict(
            SMALL, technique={"name": "multisample", "params": {"samples": 16}},
            lights=[{"type": "rect", "position": [0.4, 3, 0.3], "width": 1, "height": 1,
                     "texture": texture}]))
        with_image = lit({"image": image["id"]})
        self.assertEqual(with_image.status, 200, with_image.body)
        self.assertEqual(self.d.call("DELETE", "/v1/images/" + image["id"]).status, 204)
        self.assertEqual(lit({"image": image["id"]}).status, 422)
        self.assertIn(self.post(b"\x89PNG\r\n\x1a\nxx", "image/png", "/v1/images").status, (400, 422))
        self.assertEqual(self.post(data, "image/gif", "/v1/images").status, 415)
        self.assertIn(self.post(data, "image/png").status, (415,))

    def test_too_large_by_chunks(self):
        """Without a declared length the limit is met in the middle of the body."""
        piece = b"100000\r\n" + b"x" * 0x100000 + b"\r\n"
        got, closed = raw(self.d.port, b"POST /v1/scenes HTTP/1.1\r\nHost: x\r\nContent-Type: "
                          b"model/gltf-binary\r\nTransfer-Encoding: chunked\r\n\r\n" + piece * 44, timeout=5)
        self.assertIn(b" 413 ", got[:20])
        self.assertTrue(closed)
        wait(lambda: self.d.leftovers() == [])

    @unittest.skipIf(hostile_files is None, "no hostile files here")
    def test_tolerated_files(self):
        for name, data in hostile_files.files(tolerated=True):
            with self.subTest(name=name):
                answer = self.post(data, "application/octet-stream")
                self.assertEqual(answer.status, 201, answer.body)
                self.assertTrue(answer.json()["warnings"])
                self.assertEqual(self.d.render(answer.json()["id"], SMALL).status, 200)

    @unittest.skipIf(hostile_files is None, "no hostile files here")
    def test_hostile_files(self):
        scene = self.d.upload(grid_scene(2))
        total = self.d.get("/v1/scenes").json()["total"]
        slowest = 0
        kinds = {".png": "image/png", ".jpg": "image/jpeg", ".webp": "image/webp"}
        for name, data in hostile_files.files():
            ending = os.path.splitext(name)[1]
            image = ending in kinds
            start = time.monotonic()
            answer = self.post(data, kinds.get(ending, "application/octet-stream"),
                               "/v1/images" if image else "/v1/scenes")
            slowest = max(slowest, time.monotonic() - start)
            with self.subTest(name=name):
                self.assertIn(answer.status, (400, 413, 415, 422), answer.body)
                document = answer.json()
                self.assertTrue(document["detail"])
                self.assertNotIn("root:", answer.body.decode())
                self.assertNotIn(self.d.store, answer.body.decode())
        self.assertEqual(self.d.leftovers(), [])
        self.assertEqual(self.d.get("/v1/scenes").json()["total"], total)
        self.assertEqual(self.d.get("/v1/images").json()["total"], 0)
        self.assertEqual(self.d.render(scene, SMALL).status, 200)
        print("\n  slowest refusal %.2f s" % slowest)


if __name__ == "__main__":
    harness.main()
