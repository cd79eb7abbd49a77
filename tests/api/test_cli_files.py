"""The penumbra client and files: which scene a word means, why a file cannot be had, what an interrupt
leaves, and scenes that change while they are watched."""
import json
import os
import pathlib
import signal
import subprocess
import threading
import time

import test_cli


class Files(test_cli.Command):
    def fails(self, *arguments, status=1):
        return self.run_cli(*arguments, status=status).stderr.decode()

    # ---- scenes by their names ----

    def test_a_scene_by_name_or_digits(self):
        ids = {name: (digit * 64) for name, digit in (("Tea pot", "1"), ("tea", "2"), ("twin", "3"))}
        for name, scene in ids.items():
            self.stub.stored["/v1/scenes"][scene] = b""
            self.stub.names[scene] = name
        for word, name in (("Tea pot", "Tea pot"), ("tea", "tea"), ("111111", "Tea pot"),
                           ("3" * 40, "twin")):
            self.run_cli("render", word, "-o", "out.png")
            self.assertEqual(self.seen()[-1], ("POST", "/v1/scenes/%s/render" % ids[name]))
        self.assertIn("no file here, and no scene", self.fails("render", "pot", "-o", "a.png", status=2))
        self.assertIn("no scene", self.fails("scenes", "delete", "444444", status=2))
        self.stub.names[ids["twin"]] = "tea"
        told = self.fails("scenes", "show", "tea", status=2)
        self.assertIn("222222222222, 333333333333", told)
        self.run_cli("scenes", "change", "Tea pot", "--name", "Pot", "--tags", "a b,c")
        self.assertEqual(self.stub.calls[-1][:2], ("PATCH", "/v1/scenes/" + ids["Tea pot"]))
        self.assertEqual(json.loads(self.stub.calls[-1][3]), {"name": "Pot", "tags": ["a b", "c"]})
        self.assertIn(b"[a, b]", self.run_cli("scenes").stdout)
        self.run_cli("scenes", "--name", "ü&", "--tag", "x y")
        self.assertEqual(self.seen()[-1], ("GET", "/v1/scenes?name=%C3%BC%26&tag=x%20y"))
        self.run_cli("jobs", "cancel", "abcdef", status=3)
        self.assertEqual(self.seen()[-1], ("DELETE", "/v1/jobs/abcdef"))

    def test_a_file_comes_before_a_name(self):
        (self.folder / "deadbeef").write_bytes(self.scene.read_bytes())
        self.run_cli("scenes", "upload", "deadbeef")
        self.assertEqual(self.stub.stored["/v1/scenes"][self.id], self.scene.read_bytes())
        self.assertEqual(self.stub.names[self.id], "deadbeef")

    # ---- reasons ----

    def test_why_a_file_cannot_be_had(self):
        (self.folder / "folder.glb").mkdir()
        (self.folder / "out.png").mkdir()
        (self.folder / "a.gltf").mkdir()
        for arguments, reason in (
                (("render", "no.glb", "-o", "a.png"), "No such file"),
                (("render", "folder.glb", "-o", "a.png"), "it is a folder"),
                (("render", "a.gltf", "-o", "a.png"), "it is a folder"),
                (("render", "scene.glb/x.glb", "-o", "a.png"), "is a file"),
                (("render", "scene.glb", "-o", "out.png"), "it is a folder"),
                (("render", "scene.glb", "-o", "there/is/none.png"), "its folder is not there"),
                (("render", "scene.glb", "-o", "scene.glb/a.png"), "is a file"),
                (("compare", "scene.glb", "--out", "scene.glb"), "a file of this name"),
                (("generate", "demo", "-o", "out.png"), "it is a folder")):
            self.assertIn(reason, self.fails(*arguments), arguments)
        if os.geteuid():  # nothing is forbidden to root
            secret = self.folder / "secret.glb"
            secret.write_bytes(b"glTF")
            secret.chmod(0)
            self.assertIn("Permission denied", self.fails("scenes", "upload", "secret.glb"))
        self.assertEqual([p for p in self.files() if p.endswith(".part")], [])

    # ---- interrupts ----

    def start(self, *arguments):
        program = subprocess.Popen(
            [test_cli.PROGRAM, *map(str, arguments)], cwd=self.folder, stderr=subprocess.PIPE,
            stdout=subprocess.PIPE, env=dict(os.environ, PENUMBRA_SERVER=self.stub.url))
        self.addCleanup(program.stdout.close)
        self.addCleanup(program.stderr.close)
        self.addCleanup(program.wait)
        self.addCleanup(program.kill)
        return program

    def wait(self, condition):
        end = time.monotonic() + 120
        while not condition():
            self.assertLess(time.monotonic(), end)
            time.sleep(0.01)

    def test_an_interrupt_leaves_nothing(self):
        half, end = threading.Event(), threading.Event()

        def slow(handler):
            handler.send_response(200)
            handler.send_header("Content-Type", "image/png")
            handler.send_header("Content-Length", "1000000")
            handler.end_headers()
            handler.wfile.write(b"x" * 500000)
            half.set()
            end.wait(120)
        self.stub.script = [slow]
        (self.folder / "out.png").write_bytes(b"before")
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            half.clear()
            end.clear()
            self.stub.script = [slow]
            program = self.start("render", self.id, "-o", "out.png")
            self.assertTrue(half.wait(120))
            self.wait(lambda: "out.png.part" in self.files())
            program.send_signal(number)
            self.assertEqual(program.wait(120), -number)
            end.set()
            self.assertEqual(self.files(), ["out.png", "scene.glb"])
            self.assertEqual((self.folder / "out.png").read_bytes(), b"before")

    # ---- watching ----

    def renders(self):
        return [path[11:75] for method, path in self.seen() if path.endswith("/render")]

    def test_watch(self):
        program = self.start("watch", "scene.glb", "-o", "out.png", "--width", "64")
        self.wait(lambda: len(self.renders()) == 1)
        self.assertEqual(self.renders(), [self.id])

        def write(text):  # in place, in pieces: only the whole is rendered
            with open(self.scene, "wb", buffering=0) as file:
                for piece in text:
                    file.write(piece)

        def replace(text):  # as editors do
            part = self.folder / "scene.glb~"
            part.write_bytes(b"".join(text))
            os.replace(part, self.scene)

        def remove(text):
            self.scene.unlink()
            self.scene.write_bytes(b"".join(text))

        def elsewhere(text):  # a file beside it changes nothing
            (self.folder / "notes.txt").write_bytes(b"".join(text))
        for number, change in enumerate((write, replace, remove, write)):
            seen = len(self.renders())
            elsewhere([b"note %d" % number])
            change([b"glTF", b"version %d" % number, bytes(1000)])
            whole = test_cli.hashlib.sha256(self.scene.read_bytes()).hexdigest()
            self.wait(lambda: self.renders()[-1] == whole and len(self.renders()) > seen)
            self.assertEqual(set(self.renders()[seen:]), {whole})
        # Of what it brought only the last is left.
        self.wait(lambda: list(self.stub.stored["/v1/scenes"]) == [whole])
        self.assertEqual(self.request_of(-1)["width"], 64)
        self.wait(lambda: (self.folder / "out.png").exists())
        program.send_signal(signal.SIGINT)
        self.assertEqual(program.wait(120), -signal.SIGINT)

    def request_of(self, nth):
        bodies = [body for _, path, _, body in self.stub.calls if path.endswith("/render")]
        return json.loads(bodies[nth])

    def test_watch_goes_on_after_what_cannot_be_drawn(self):
        problem = (422, dict(title="No", detail="It is damaged.", status=422), "application/problem+json")
        program = self.start("watch", "scene.glb", "-o", "out.png")
        self.wait(lambda: len(self.renders()) == 1)
        self.wait(lambda: (self.folder / "out.png").exists())
        self.stub.script = [problem]
        self.scene.write_bytes(b"glTF damaged")
        self.wait(lambda: not self.stub.script)
        self.assertIn(b"damaged", program.stderr.readline() + program.stderr.readline())
        self.scene.write_bytes(b"glTF mended")
        mended = test_cli.hashlib.sha256(b"glTF mended").hexdigest()
        self.wait(lambda: self.renders()[-1] == mended)
        self.assertIsNone(program.poll())

    def test_watch_of_a_gltf_and_its_files(self):
        gltf = self.folder / "model.gltf"
        (self.folder / "parts").mkdir()
        buffer = self.folder / "parts" / "data.bin"
        buffer.write_bytes(b"1234")
        gltf.write_text(json.dumps({"buffers": [{"uri": "parts/data.bin", "byteLength": 4}]}))
        self.start("watch", gltf, "-o", "out.png")
        posts = lambda: [call for call in self.stub.calls if call[:2] == ("POST", "/v1/scenes")]
        self.wait(lambda: len(posts()) == 1)
        self.wait(lambda: (self.folder / "out.png").exists())
        self.stub.stored["/v1/scenes"].clear()
        os.replace(self.new("5678"), buffer)
        self.wait(lambda: len(posts()) == 2)
        self.assertIn(b"5678", posts()[1][3])

    def new(self, text):
        path = pathlib.Path(self.folder, "new")
        path.write_text(text)
        return path

    def test_watch_of_nothing(self):
        self.assertIn("No such file", self.fails("watch", "none.glb", "-o", "a.png"))


if __name__ == "__main__":
    test_cli.main()
