"""The wheel: installable, true to the OpenAPI document, and the README's example runs."""
import ast
import base64
import csv
import hashlib
import inspect
import io
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import textwrap
import typing
import unittest
import zipfile

import wheel
from wheel import demo, harness, penumbra

sys.path.insert(0, wheel.SOURCE)
import backend  # noqa: E402
import generate  # noqa: E402

README = os.path.join(wheel.SOURCE, "..", "..", "README.md")
# What a request has in an object of its own, and the keywords have beside the others.
NESTED = ("output", "sequence")


class Wheel(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.d = harness.Daemon()
        cls.document = cls.d.get("/openapi.json").json()
        cls.schemas = cls.document["components"]["schemas"]
        cls.folder = tempfile.mkdtemp(prefix="penumbra-test-")

    @classmethod
    def tearDownClass(cls):
        cls.d.kill()
        shutil.rmtree(cls.folder)

    # ---- what comes out of the document ----

    def test_is_what_the_daemon_says(self):
        for name, text in generate.generate(self.document).items():
            with open(os.path.join(wheel.FOLDER, "penumbra", name), encoding="utf-8") as file:
                self.assertEqual(file.read(), text, name)
        printed = subprocess.run([os.path.join(harness.BIN, "penumbrad"), "--print-openapi"],
                                 check=True, capture_output=True, text=True).stdout
        self.assertEqual(json.loads(printed), self.document)
        self.assertEqual(penumbra.__version__, self.document["info"]["version"])

    def test_keywords(self):
        """Every key of a request, with what the document says of it, and no other."""
        for call, schema in (("render", "RenderRequest"), ("progressive", "RenderRequest"),
                             ("render_job", "RenderRequest"), ("compare", "CompareRequest"),
                             ("compare_job", "CompareRequest"), ("sequence", "SequenceRequest")):
            wanted = {"params"} if "technique" in self.schemas[schema]["properties"] else set()
            said = []
            for key, member in self.schemas[schema]["properties"].items():
                if "$ref" in member:
                    member = {**self.schemas[member["$ref"].rpartition("/")[2]], **member}
                inner = member.get("properties", {}) if key in NESTED else {key: member}
                wanted |= set(inner) - {"scene", "progressive"}
                said += [(k, m) for k, m in inner.items() if k not in ("scene", "progressive")]
            method = getattr(penumbra.Scene, call)
            self.assertEqual(set(inspect.signature(method).parameters) - {"self"}, wanted, call)
            text = " ".join(inspect.getdoc(method).split())
            for key, member in said:
                row = re.search(r"(?<!\w)%s: (.*?)(?= \w+: [A-Z0-9]|$)" % key, text)
                self.assertTrue(row, key)
                self.assertIn(member.get("description", ""), text, key)
                if "x-unit" in member:
                    self.assertIn("Unit: %s." % member["x-unit"], text)

    def test_types(self):
        types = penumbra.types
        self.assertEqual(list(typing.get_args(types.TechniqueName)),
                         self.schemas["TechniqueName"]["enum"])
        self.assertEqual(list(typing.get_args(types.JobState)), self.schemas["JobState"]["enum"])
        for name in self.schemas["TechniqueName"]["enum"]:
            schema = self.schemas["Technique-" + name]
            kind = getattr(types, "Technique" + "".join(w.title() for w in name.split("-")))
            self.assertEqual(set(kind.__annotations__), set(schema["properties"]), name)
            self.assertEqual(typing.get_args(kind.__annotations__["name"]), (name,))
            params = schema["properties"]["params"]["properties"]
            hints = kind.__annotations__["params"]
            self.assertEqual(set(getattr(hints, "__annotations__", {})), set(params), name)
            for key, param in params.items():
                hint = hints.__annotations__[key]
                if "enum" in param:
                    self.assertEqual(list(typing.get_args(hint)), param["enum"])
                elif param.get("type") in ("integer", "number", "boolean"):
                    self.assertIs(hint, {"integer": int, "number": float, "boolean": bool}[
                        param["type"]], (name, key))
        scene = self.schemas["Scene"]
        self.assertEqual(types.Scene.__required_keys__ | types.Scene.__optional_keys__,
                         set(scene["properties"]))
        self.assertEqual(set(types._SceneRequired.__annotations__), set(scene["required"]))

    def test_defaults(self):
        from penumbra import scene
        self.assertEqual(scene.DEADLINE_MS,
                         self.schemas["RenderRequest"]["properties"]["deadline_ms"]["default"])

    def test_docstrings(self):
        for thing in map(penumbra.__dict__.get, penumbra.__all__):
            if inspect.isclass(thing):
                self.assertTrue(thing.__doc__, thing)
                for name, member in vars(thing).items():
                    if not name.startswith("_") and callable(member):
                        self.assertTrue(member.__doc__, (thing, name))

    def test_type_checker(self):
        """What a checker of types finds in a user's program is what is wrong in it."""
        program = textwrap.dedent("""\
            from penumbra import Client, types
            camera: types.Camera = {"orbit": {"azimuth_deg": 3.0}}
            with Client("http://x") as client:
                scene = client.upload("x.glb")
                picture = scene.render(technique="pcss", width=3, camera=camera, format="exr",
                                       lights=[{"type": "sun", "position": [0, 1, 0]}])
                scene.render(technique={"name": "pcss", "params": {"filter_taps": 3}})
                scene.render(technique="pcsss")  # wrong
                scene.render(width="3")  # wrong
                scene.render(lights=[{"type": "lamp"}])  # wrong
                scene.render(widht=3)  # wrong
                text: str = picture.bytes  # wrong
                for frame in scene.sequence(frames=3).frames():
                    number: int = frame.number
                rmse: float = scene.compare(techniques="all")["pcss"]["rmse"]
                scene.info["triangels"]  # wrong
            """)
        mypy = shutil.which("mypy")
        if not mypy:
            self.skipTest("no mypy")
        path = os.path.join(self.folder, "program.py")
        with open(path, "w", encoding="utf-8") as file:
            file.write(program)
        ran = subprocess.run([mypy, "--cache-dir", os.path.join(self.folder, "mypy"), path],
                             capture_output=True, text=True,
                             env={**os.environ, "MYPYPATH": wheel.FOLDER})
        found = {int(n) for n in re.findall(r"program\.py:(\d+): error", ran.stdout)}
        wanted = {n for n, line in enumerate(program.splitlines(), 1) if line.endswith("# wrong")}
        self.assertEqual(found, wanted, ran.stdout + ran.stderr)
        self.assertNotRegex(ran.stdout, r"penumbra/\w+\.py:\d+: error")

    # ---- the file ----

    def test_form(self):
        """PEP 427: every file stands in RECORD with its hash and size; made again, it is equal."""
        with zipfile.ZipFile(wheel.PATH) as archive:
            self.assertIsNone(archive.testzip())
            names = archive.namelist()
            info = os.path.basename(wheel.PATH).rsplit("-py3", 1)[0] + ".dist-info/"
            rows = list(csv.reader(io.StringIO(archive.read(info + "RECORD").decode())))
            self.assertEqual([row[0] for row in rows], names)
            for name, digest, size in rows[:-1]:
                data = archive.read(name)
                kind, value = digest.split("=")
                self.assertEqual(base64.urlsafe_b64encode(hashlib.new(kind, data).digest()).rstrip(
                    b"=").decode(), value)
                self.assertEqual(len(data), int(size))
            self.assertEqual(rows[-1], [info + "RECORD", "", ""])
            self.assertIn("penumbra/py.typed", names)
            self.assertEqual({name.split("/")[0] for name in names}, {"penumbra", info[:-1]})
        path = os.path.join(self.folder, "openapi.json")
        with open(path, "w", encoding="utf-8") as file:
            json.dump(self.document, file)
        again = os.path.join(self.folder, backend.make(path, self.folder))
        with open(again, "rb") as one, open(wheel.PATH, "rb") as two:
            self.assertTrue(one.read() == two.read())

    def test_install(self):
        """pip installs it where there is no network, for the oldest Python here too."""
        others = map(shutil.which, ("python3.9", "python3.10"))
        pythons = [sys.executable] + [python for python in others if python]
        done = 0
        for i, python in enumerate(pythons):
            room = os.path.join(self.folder, "venv-%d" % i)
            made = subprocess.run([python, "-m", "venv", room], capture_output=True, text=True)
            if made.returncode:
                continue  # Debian has venv in a package of its own, and a shim may be of nothing
            inside = os.path.join(room, "bin", "python")
            subprocess.run([inside, "-m", "pip", "--disable-pip-version-check", "install",
                            "--no-index", wheel.PATH], check=True, capture_output=True)
            shown = subprocess.run(
                [inside, "-W", "error", "-c", "import penumbra; print(penumbra.__version__)\n"
                 "with penumbra.Client(%r) as c: print(len(c.techniques()))" % (
                     "http://127.0.0.1:%d" % self.d.port)],
                check=True, capture_output=True, text=True, cwd=self.folder).stdout.split()
            self.assertEqual(shown[0], penumbra.__version__)
            self.assertEqual(int(shown[1]), len(self.schemas["TechniqueName"]["enum"]))
            done += 1
        if not done:
            self.skipTest("no Python here makes virtual environments")

    def test_syntax_of_the_oldest(self):
        for name in os.listdir(os.path.join(wheel.FOLDER, "penumbra")):
            if name.endswith(".py"):
                with open(os.path.join(wheel.FOLDER, "penumbra", name), encoding="utf-8") as file:
                    ast.parse(file.read(), name, feature_version=(3, 9))

    # ---- the README ----

    def test_example(self):
        with open(README, encoding="utf-8") as file:
            found = re.findall(r"^```python\n(.*?)^```", file.read(), re.M | re.S)
        self.assertTrue(found)
        demo(self.folder)
        for example in found:
            self.assertIn("http://127.0.0.1:8080", example)
            patient = textwrap.dedent("""\
                import penumbra.scene  # no deadline, on whatever machine this is
                body_of = penumbra.scene.body_of
                penumbra.scene.body_of = lambda v: {
                    **body_of(v),
                    **({} if ("sequence", "frames") in v else {"deadline_ms": 3600000})}
                """)
            program = patient + example.replace("http://127.0.0.1:8080",
                                                "http://127.0.0.1:%d" % self.d.port)
            ran = subprocess.run([sys.executable, "-W", "error", "-c", program], cwd=self.folder,
                                 capture_output=True, text=True,
                                 env={**os.environ, "PYTHONPATH": wheel.FOLDER})
            self.assertEqual((ran.returncode, ran.stderr), (0, ""))
            for name in re.findall(r'save\("([\w.-]+)"', example):
                with open(os.path.join(self.folder, name), "rb") as file:
                    self.assertEqual(file.read(4), b"\x89PNG", name)
            self.assertGreater(len(ran.stdout.splitlines()), 2)


if __name__ == "__main__":
    harness.main()
