"""The API page in Chromium, and each of its examples run as it stands: in bash, Python and Node.

usage: test_docs.py FOLDER, where the packages of package.json are kept; pictures go to its folder
pictures. Exits 77 (skipped) without Chromium, node, curl or the packages."""
import json
import os
import shutil
import subprocess
import sys
import unittest
import warnings

HERE = os.path.dirname(os.path.abspath(__file__))
for folder in ("../api", "../python"):
    sys.path.insert(0, os.path.join(HERE, folder))
from harness import BIN, PATIENCE, SMALL, Daemon, png  # noqa: E402
from tools import MODULES, has_node, install, run_node  # noqa: E402
import wheel  # noqa: E402,F401  (makes the package importable)

TOKEN = "a-token-of-the-page-itself"
# What its example cannot know: a result's tag, the hash of a file that is put, a frame of what.
UNKNOWN = {"getResult", "putScene", "putImage"}
ENDLESS = {"watchService"}
DESTROYS = ("deleteImage", "deleteJob", "deleteScene")


class Docs(unittest.TestCase):
    def setUp(self):
        self.d = Daemon("--jobs-share=64")
        self.addCleanup(self.d.kill)
        self.folder = self.d.folder
        self.url = "http://127.0.0.1:%d" % self.d.port
        subprocess.run([os.path.join(BIN, "penumbra"), "generate", "square", "-o", self.path("scene.glb")],
                       check=True)
        with open(self.path("light.png"), "wb") as file:
            file.write(png(8, 8))
        self.fill()
        job = self.d.call("POST", "/v1/jobs", json.dumps(
            {"scene": self.scene, **SMALL, "sequence": {"frames": 2}}), {"Content-Type": "application/json"})
        self.d.get(job.json()["links"]["events"])

    def path(self, name):
        return os.path.join(self.folder, name)

    def fill(self):
        """What the examples are of."""
        with open(self.path("scene.glb"), "rb") as file:
            self.scene = self.d.upload(file.read())
        self.d.call("POST", "/v1/images", png(8, 8), {"Content-Type": "image/png"})

    def run_curl(self, name, text):
        with open(self.path(".curlrc"), "w") as file:
            file.write("fail\nsilent\nshow-error\nmax-time = %d\n" % (3 if name in ENDLESS else 60 * PATIENCE))
        ran = subprocess.run(["bash", "-c", text], cwd=self.folder, capture_output=True,
                             env={**os.environ, "CURL_HOME": self.folder})
        allowed = (0, 28) if name in ENDLESS else (0,)
        self.assertIn(ran.returncode, allowed, (text, ran.stderr))
        return ran.stdout

    def run_python(self, name, text):
        if name in ENDLESS:
            text = text.replace("answer.read(200)", "answer.read(20)")
        before = os.getcwd()
        warnings.simplefilter("ignore", ResourceWarning)  # an example is short
        os.chdir(self.folder)
        try:
            exec(compile(text, name, "exec"), {"print": lambda *_: None})
        finally:
            os.chdir(before)

    def run_javascript(self, name, text):
        text = text.replace(self.url + "/penumbra.js", "file://" + os.path.realpath(MODULES) + "/penumbra.js")
        data = "light.png" if name.endswith("Image") else "scene.glb"
        text = ('import { readFileSync } from "node:fs";\nconst file = new Blob([readFileSync("%s")]);\n'
                % data + text + "\nprocess.exit(0);\n")
        with open(self.path("example.mjs"), "w") as file:
            file.write(text)
        ran = subprocess.run(["node", "example.mjs"], cwd=self.folder, capture_output=True)
        self.assertEqual(ran.returncode, 0, (text, ran.stderr.decode()))

    def test_page_and_examples(self):
        locked = Daemon(start=False)
        self.addCleanup(locked.kill)
        tokens = os.path.join(locked.folder, "tokens")
        with open(tokens, "w") as file:
            file.write("page %s\n" % TOKEN)
        os.chmod(tokens, 0o600)
        locked.flags += ["--token-file=" + tokens]
        locked.start()
        pictures = os.path.join(FOLDER, "pictures")
        os.makedirs(pictures, exist_ok=True)
        self.assertEqual(run_node(
            "docs_test.mjs", 120 * PATIENCE, DAEMON=self.url, LOCKED="http://127.0.0.1:%d" % locked.port,
            TOKEN=TOKEN, CHROMIUM=CHROMIUM, PATIENCE_MS=str(int(10000 * PATIENCE)), PACKAGES=FOLDER,
            PICTURES=pictures, GLB=self.path("scene.glb"), EXAMPLES=self.path("examples.json")), 0)
        with open(self.path("examples.json")) as file:
            examples = json.load(file)
        operations = [name for name in examples["curl"] if not name.startswith("method-")]
        last = [name for name in operations if name in DESTROYS]
        for language, run in (("curl", self.run_curl), ("Python", self.run_python),
                              ("JavaScript", self.run_javascript)):
            for name in [n for n in operations if n not in DESTROYS] + last:
                if name in UNKNOWN or (name == "deleteJob" and language != "JavaScript"):
                    continue
                with self.subTest(language=language, operation=name):
                    run(name, examples[language][name])
                if name in DESTROYS:
                    self.fill()
        self.assertEqual(self.d.stop(), 0)


if __name__ == "__main__":
    FOLDER = os.path.abspath(sys.argv.pop(1))
    CHROMIUM = shutil.which("chromium") or shutil.which("google-chrome")
    if not CHROMIUM or not has_node() or not shutil.which("npm") or not shutil.which("curl"):
        print("skipped: no Chromium, no curl, or no node of version 18 or later with npm")
        sys.exit(77)
    if not install(FOLDER):
        print("skipped: the packages cannot be installed")
        sys.exit(77)
    unittest.main(verbosity=2)
