"""Every public function of the client against a real daemon: scenes, pictures, errors."""
import io
import json
import os
import shutil
import ssl
import struct
import tempfile
import threading
import unittest
import zipfile
from unittest import mock

from wheel import TINY, client, demo, harness, penumbra

import test_wire  # beside the harness
from pictures import read_png

# Of many samples, in a picture of which none is there already.
BETTER = {"technique": "multisample", "params": {"samples": 64}, "width": 160, "height": 120,
          "deadline_ms": 3600000}


def parted(name, folder="", uri="scene.bin"):
    """The files of a scene whose numbers lie in a file of their own."""
    data = harness.grid_scene(1, name)
    length, = struct.unpack_from("<I", data, 12)
    document = json.loads(data[20:20 + length])
    document["buffers"][0]["uri"] = uri
    binary = data[28 + length:][:document["buffers"][0]["byteLength"]]
    return {folder + "scene.gltf": json.dumps(document).encode(), folder + "scene.bin": binary}


class Client(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.d = harness.Daemon("--jobs-share=64")
        cls.client = client(cls.d)
        cls.folder = tempfile.mkdtemp(prefix="penumbra-test-")
        cls.scene = cls.client.upload(harness.grid_scene(2, "shared"))

    @classmethod
    def tearDownClass(cls):
        cls.client.close()
        cls.d.kill()
        shutil.rmtree(cls.folder)

    def path(self, name, data):
        path = os.path.join(self.folder, name)
        os.makedirs(os.path.dirname(path), exist_ok=True)
        with open(path, "wb") as file:
            file.write(data)
        return path

    # ---- uploads ----

    def sent(self, thing, **more):
        """(scene, how many bytes went)"""
        told = []
        scene = self.client.upload(thing, progress=lambda sent, size: told.append((sent, size)),
                                   **more)
        if told:
            self.assertEqual(told[-1][0], told[-1][1])
            self.assertEqual(sorted(told), told)
        return scene, told[-1][0] if told else 0

    def test_what_scenes_are_called(self):
        glb = lambda n: harness.grid_scene(1, "called %d" % n)
        parts = {"hall/" + name: data for name, data in parted("called").items()}
        path = self.path("called/Tea pot.glb", glb(1))
        folder = os.path.dirname(self.path("inside/Only.glb", glb(2)))
        for thing, name in ((glb(0), ""), (path, "Tea pot"), (folder, "Only"), (parts, "scene"),
                            ({"a/Named.glb": glb(3)}, "Named")):
            self.assertEqual(self.client.upload(thing).name, name, thing)
        self.assertEqual(self.client.upload(glb(4), name="Given").name, "Given")
        scene = self.client.upload(path)
        self.assertIn("'Tea pot'", repr(scene))
        scene.change(tags=["kitchen", "small"])
        self.assertEqual((scene.name, scene.tags), ("Tea pot", ["kitchen", "small"]))
        self.assertEqual(list(self.client.scenes(tag="kitchen")), [scene])
        self.assertEqual(list(self.client.scenes(name="TEA", tag="small")), [scene])
        self.assertEqual(self.client.scene(scene.id[:10]), scene)
        scene.change(name=None, tags=None)
        self.assertEqual((scene.refresh().name, scene.tags), ("", []))
        with self.assertRaises(penumbra.Invalid):
            scene.change(name="x" * 200)
        small = scene.thumbnail()
        self.assertEqual((small.format, small.bytes[:2]), ("jpeg", b"\xff\xd8"))

    def test_a_file_in_every_form(self):
        data = harness.grid_scene(1, "forms")
        path = self.path("forms/any.glb", data)
        scene, sent = self.sent(path)
        self.assertEqual((sent, scene.info["triangles"]), (len(data), 2))
        later = io.BytesIO(b"before" + data)
        later.seek(6)
        pipe = io.BufferedReader(io.BytesIO(data))
        pipe.seekable = lambda: False
        for thing in (data, bytearray(data), later, pipe, os.path.dirname(path), {"x.glb": data},
                      {"x.glb": path}):
            again, sent = self.sent(thing)
            self.assertEqual((again, sent), (scene, 0), thing)  # it is there: nothing is sent
        with open(path, "rb") as file:
            self.assertEqual(self.sent(file), (scene, 0))

    def test_many_files(self):
        """As one scene, whose id is known before."""
        for name, folder, uri in (("plain", "", "scene.bin"), ("escaped", "", "%73cene.bin"),
                                  ("case", "", "SCENE.BIN"), ("backslash", "", ".\\scene.bin"),
                                  ("deeper", "models/", "./scene.bin")):
            files = parted(name, folder, uri)
            for file, data in files.items():
                path = self.path("many-%s/%s" % (name, file), data)
            root = os.path.join(self.folder, "many-" + name)
            scene, sent = self.sent(root)
            self.assertEqual(scene.info["triangles"], 2, name)
            self.assertGreater(sent, sum(map(len, files.values())))
            self.assertEqual(self.sent(root), (scene, 0), name)
            self.assertEqual(self.sent(files), (scene, 0), name)
            if not folder:
                self.assertEqual(self.sent(os.path.join(root, "scene.gltf")), (scene, 0), name)

    def test_zip(self):
        box = io.BytesIO()
        with zipfile.ZipFile(box, "w") as archive:
            archive.writestr("one.glb", harness.grid_scene(1, "one"))
            archive.writestr("two.glb", harness.grid_scene(2, "two"))
        with self.assertRaises(penumbra.Invalid) as caught:
            self.client.upload(box.getvalue())
        self.assertIn("two.glb", caught.exception.detail)
        path = self.path("both.zip", box.getvalue())
        for entry, triangles in (("one.glb", 2), ("two.glb", 8)):
            scene, sent = self.sent(path, entry=entry)
            self.assertEqual((scene.info["triangles"], sent), (triangles, len(box.getvalue())))
            self.assertEqual(self.sent(box.getvalue(), entry=entry), (scene, 0))

    def test_folders_with_a_choice(self):
        for name in ("x.glb", "deep/y.glb"):
            self.path("choice/" + name, harness.grid_scene(1, name))
        folder = os.path.join(self.folder, "choice")
        with self.assertRaisesRegex(ValueError, "deep/y.glb"):
            self.client.upload(folder)
        self.assertEqual(self.client.upload(folder, entry="x.glb"),
                         self.client.upload(os.path.join(folder, "x.glb")))
        self.assertRaises(ValueError, self.client.upload, folder, entry="z.glb")

    def test_what_cannot_be_uploaded(self):
        self.path("nothing/readme.txt", b"x")
        gltf = self.path("lacks/a.gltf", b'{"buffers": [{"uri": "b.bin", "byteLength": 1}]}')
        outside = self.path("lacks/o.gltf", b'{"images": [{"uri": "../../etc/passwd"}]}')
        for thing, kind in ((os.path.join(self.folder, "nothing"), ValueError),
                            (os.path.join(self.folder, "is-not-there.glb"), FileNotFoundError),
                            (gltf, FileNotFoundError), (outside, FileNotFoundError),
                            ({}, ValueError), (io.StringIO("x"), TypeError), (7, TypeError)):
            self.assertRaises(kind, self.client.upload, thing)
        for data in (b"ISO-10303-21;", b"", b"glTF" + bytes(30), b'{"asset": '):
            with self.assertRaises(penumbra.Invalid) as caught:
                self.client.upload(data)
            self.assertTrue(caught.exception.detail, data)
            self.assertTrue(caught.exception.request_id, data)

    def test_images(self):
        info = self.client.upload_image(harness.png(8, 4))
        self.assertEqual((info["width"], info["height"]), (8, 4))
        self.assertEqual(self.client.upload_image(io.BytesIO(harness.png(8, 4)),
                                                  progress=self.fail)["id"], info["id"])
        self.assertEqual(self.client.image(info["id"])["width"], 8)
        self.assertIn(info["id"], [i["id"] for i in self.client.images()])
        light = {"type": "rect", "position": [0, 3, 0], "texture": {"image": info["id"]}}
        picture = self.scene.render(**TINY, lights=[light])
        self.assertEqual(picture.request["lights"][0]["texture"], {"image": info["id"]})
        self.client.delete_image(info["id"])
        self.assertRaises(penumbra.NotFound, self.client.image, info["id"])

    # ---- scenes ----

    def test_scenes(self):
        scene = self.client.upload(harness.grid_scene(1, "to be listed"))
        self.assertIn(scene, list(self.client.scenes()))
        found = self.client.scene(scene.id)
        self.assertEqual((found, found.info["bounds"]["min"], found.warnings),
                         (scene, [-0.5, 0.5, -0.5], []))
        self.assertIn("2 triangles", repr(scene))
        scene.delete()
        self.assertNotIn(scene, set(self.client.scenes()))
        for gone in (scene.refresh, lambda: self.client.scene(scene.id),
                     lambda: scene.render(**TINY)):
            self.assertRaises(penumbra.NotFound, gone)
        scene.delete()  # which it is already

    # ---- pictures ----

    def test_render(self):
        camera = {"orbit": {"azimuth_deg": 20, "elevation_deg": 30}}
        picture = self.scene.render(technique="pcss", params={"filter_taps": 8}, width=32,
                                    height=24, camera=camera, deadline_ms=3600000)
        self.assertEqual(picture.bytes, self.d.render(self.scene.id, {
            "technique": {"name": "pcss", "params": {"filter_taps": 8}}, "width": 32, "height": 24,
            "camera": camera}).body)
        self.assertEqual((picture.format, picture.final, picture._repr_png_(),
                          picture._repr_jpeg_()),
                         ("png", True, picture.bytes, None))
        self.assertEqual((picture.record["image"]["bytes"], picture.request["width"]),
                         (len(picture.bytes), 32))
        self.assertEqual(picture.record["scene"], self.scene.id)
        self.assertGreaterEqual(picture.timings["technique"], 0)
        self.assertIn("32 x 24", repr(picture))

    def test_formats(self):
        heads = {"png": b"\x89PNG", "exr": b"v/1\x01", "jpeg": b"\xff\xd8", "webp": b"RIFF",
                 "tiff": b"II*\0"}
        for kind, head in heads.items():
            picture = self.scene.render(**TINY, format=kind)
            self.assertEqual((picture.format, picture.bytes[:4][:len(head)]), (kind, head))
            self.assertEqual(picture._repr_jpeg_() is not None, kind == "jpeg")
        path = os.path.join(self.folder, "saved.tif")
        self.assertEqual(picture.save(path), path)
        with open(path, "rb") as file:
            self.assertEqual(file.read(), picture.bytes)
        self.assertRaises(ValueError, picture.save, os.path.join(self.folder, "saved.png"))
        with self.assertRaises(OSError):
            picture.save(os.path.join(self.folder, "no", "such", "folder.tif"))
        self.assertEqual([n for n in os.listdir(self.folder) if n.startswith(".penumbra")], [])

    def test_warnings(self):
        """What a method cannot do is said."""
        image = self.client.upload_image(harness.png(6, 6))
        picture = self.scene.render(**TINY, lights=[{
            "position": [0, 3, 0], "texture": {"image": image["id"]}}])
        self.assertEqual(picture.warnings, picture.record["warnings"])
        self.assertTrue(picture.warnings)

    def test_what_cannot_be_rendered(self):
        for request, pointer in (({"width": 0}, "/width"), ({"technique": "pcsss"}, "/technique"),
                                 ({"technique": "pcss", "params": {"taps": 3}},
                                  "/technique/params"),
                                 ({"lights": [{"type": "lamp"}]}, "/lights/0"),
                                 ({"format": "exr", "bit_depth": 8}, "/output")):
            with self.assertRaises(penumbra.Invalid) as caught:
                self.scene.render(**request)
            self.assertTrue(caught.exception.pointer.startswith(pointer), caught.exception)
            with self.assertRaises(penumbra.Invalid):
                list(self.scene.progressive(**request))
        self.assertRaises(TypeError, self.scene.render, widht=3)
        self.assertRaises(TypeError, self.scene.render, width={3})
        self.assertRaises(ValueError, self.scene.render, params={"taps": 3})
        with self.d.paused(), client(self.d, retries=0) as hasty:
            scene = hasty.scene(self.scene.id)  # too late, or known to become so
            self.assertRaises((penumbra.DeadlinePassed, penumbra.Busy), scene.render,
                              technique="hard", width=25, deadline_ms=300)

    def test_pictures_of_nobody_else(self):
        """Sessions and limited renders: no cache has them, and their record is theirs."""
        frames = [self.scene.render(**{**TINY, "technique": "temporal"}, session="mine")
                  for _ in range(3)]
        self.assertEqual([f.record["history"]["frames"] for f in frames], [0, 1, 2])
        picture = self.scene.render(**{**BETTER, "width": 161}, budget_ms=1)
        self.assertEqual(picture.record["request"]["budget_ms"], 1)
        self.assertGreaterEqual(picture.record["progress"]["samples"], 1)
        self.assertEqual(picture.bytes[:4], b"\x89PNG")

    def test_progressive(self):
        pictures = list(self.scene.progressive(**BETTER))
        self.assertEqual([p.final for p in pictures], [False] * (len(pictures) - 1) + [True])
        self.assertEqual(pictures[-1].bytes, self.scene.render(**BETTER).bytes)
        samples = [p.record["progress"]["samples"] for p in pictures]
        self.assertEqual((sorted(set(samples)), samples[-1]), (samples, 64))
        again = self.scene.progressive(**{**BETTER, "width": 162})
        self.assertGreater(next(again).record["progress"]["of"], 0)
        again.close()

    def test_without_a_cache(self):
        """Where the service keeps nothing the picture comes all the same."""
        d = harness.Daemon("--result-cache=0", store=self.d.store + "-2")
        self.addCleanup(d.kill)
        with client(d) as other:
            picture = other.upload(harness.grid_scene(2, "shared")).render(**TINY)
        self.assertEqual(picture.bytes, self.scene.render(**TINY).bytes)

    def test_numpy(self):
        picture = self.scene.render(**TINY)
        with mock.patch.dict("sys.modules", {"numpy": None}):
            self.assertRaisesRegex(ImportError, "numpy", picture.numpy)
        try:
            import numpy
        except ImportError:
            return
        none = dict.fromkeys(("OpenImageIO", "OpenEXR", "imageio", "imageio.v3"))
        with mock.patch.dict("sys.modules", none):
            self.assertRaisesRegex(ImportError, "pip install imageio", picture.numpy)
        ground = [0.25, 0.5, 0.75]
        albedo = self.scene.render(**TINY, layer="albedo", format="exr", ground_albedo=ground)
        width, height, rows = read_png(picture.bytes)
        for what in (picture, albedo):
            try:
                pixels = what.numpy()
            except ImportError as error:
                self.assertIn("pip install", str(error))
                continue
            self.assertEqual(pixels.shape[:2], (height, width))
            if what is picture:
                self.assertEqual(pixels.dtype, numpy.uint8)
                self.assertEqual(pixels.tolist(), [[list(p) for p in row] for row in rows])
            else:
                self.assertTrue(numpy.issubdtype(pixels.dtype, numpy.floating), pixels.dtype)
                self.assertLess(abs(pixels[:, :, :3] - ground).max(axis=2).min(), 1 / 255)

    # ---- comparisons ----

    def test_compare(self):
        reference = {"name": "multisample", "params": {"samples": 16}}
        view = {"techniques": ["hard", "pcss"], "reference": reference, "width": 80, "height": 60}
        scene = self.client.upload(demo(self.folder))
        compared = scene.compare(**view, deadline_ms=3600000)
        self.assertEqual([row.name for row in compared], ["hard", "pcss"])
        self.assertEqual(len(compared), 2)
        self.assertEqual((compared["pcss"], compared[0].name), (compared[1], "hard"))
        self.assertRaises(KeyError, lambda: compared["vsm"])
        self.assertEqual(compared.reference.name, "multisample")
        self.assertGreater(compared["hard"]["rmse"], compared["pcss"]["rmse"])
        self.assertEqual((compared["hard"].error, compared.reference.get("rmse"),
                          compared.warnings),
                         (None, None, []))
        for link in ("image", "difference", "ssim_map", "flip_map"):
            self.assertEqual(compared["hard"].picture(link).format, "png")
        self.assertRaises(KeyError, compared["hard"].picture, "nothing")
        self.assertIn("pcss", str(compared))
        job = scene.compare_job(**view)
        self.assertEqual([row["rmse"] for row in job.result()], [row["rmse"] for row in compared])

    # ---- the service ----

    def test_service(self):
        self.assertEqual(self.client.service()["version"], penumbra.__version__)
        techniques = self.client.techniques()
        self.assertEqual(techniques, self.d.get("/v1/techniques").json()["techniques"])
        self.assertEqual(self.client.technique("pcss"), [
            t for t in techniques if t["name"] == "pcss"][0])
        for name in ("no such", "../scenes", "a/b?c"):
            self.assertRaises(penumbra.NotFound, self.client.technique, name)
        self.scene.render(**TINY)
        self.assertGreater(self.client.stats()["renders"], 0)
        self.assertEqual(self.client.openapi(), self.d.exchange("GET", "/openapi.json").json())
        events = self.client.events()
        first, second = next(events), next(events)
        self.assertGreaterEqual(second["unix_s"], first["unix_s"])
        self.assertIn("metrics", first)
        events.close()

    def test_tokens(self):
        path = self.path("tokens", b"0123456789abcdef0123456789abcdef\n")
        os.chmod(path, 0o600)
        d = harness.Daemon("--token-file=" + path)
        self.addCleanup(d.kill)
        with client(d, token="0123456789abcdef0123456789abcdef") as good:
            good.stats()
        for token in ("", "wrong"):
            with client(d, token=token) as bad:
                for call in (bad.stats, lambda: list(bad.scenes()),
                             lambda: bad.upload(harness.grid_scene()), lambda: next(bad.events())):
                    with self.assertRaises(penumbra.Denied) as caught:
                        call()
                    self.assertEqual(caught.exception.status, 401)

    def test_tls(self):
        certificate, key = test_wire.certificate(self.folder)
        d = harness.Daemon("--tls-cert=" + certificate, "--tls-key=" + key)
        self.addCleanup(d.kill)
        context = ssl.create_default_context(cafile=certificate)
        context.check_hostname = False  # it is of "localhost"
        url = "https://127.0.0.1:%d" % d.port
        with penumbra.Client(url, timeout=600, ssl_context=context) as trusting:
            scene = trusting.upload(harness.grid_scene(2, "shared"))
            self.assertEqual(scene.render(**TINY).bytes, self.scene.render(**TINY).bytes)
        with penumbra.Client(url, timeout=600, retries=0) as careful:
            self.assertRaisesRegex(penumbra.Unreachable, "(?i)certificate", careful.stats)

    def test_gone_and_back(self):
        with harness.socket.socket() as s:
            s.bind(("127.0.0.1", 0))
            port = s.getsockname()[1]
        d = harness.Daemon("--listen=127.0.0.1:%d" % port, store=self.d.store + "-3")
        self.addCleanup(d.kill)
        with client(d, retries=0) as one, client(d, retries=10**6, retry_for=1e6) as patient:
            scene = patient.upload(harness.grid_scene())
            one.stats()
            picture = scene.render(**TINY)
            self.assertEqual(d.stop(), 0)
            self.assertRaises(penumbra.Unreachable, one.stats)
            got = []
            with mock.patch("penumbra._http.MOST_PAUSE_S", 0.1):
                waiting = threading.Thread(target=lambda: got.append(scene.render(**TINY).bytes))
                waiting.start()
                d.start()
                waiting.join()
            self.assertEqual(got, [picture.bytes])
            one.stats()


if __name__ == "__main__":
    harness.main()
