"""Each command and each Python example of the README, run as it stands against a daemon. What is HTML
or JavaScript there is run in a browser: tests/web/test_examples.py."""
import hashlib
import os
import re
import subprocess
import sys
import unittest

import examples
import harness
from harness import BIN, Daemon

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "../python"))
import wheel  # noqa: E402,F401  (makes the package importable)

RUN_HERE, RUN_IN_A_BROWSER = ("sh", "python"), ("html", "js")


class Readme(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.d = Daemon()
        cls.url = "http://127.0.0.1:%d" % cls.d.port

    @classmethod
    def tearDownClass(cls):
        assert cls.d.stop() == 0
        cls.d.kill()

    def text(self, text):
        """With this daemon's address, and these programs."""
        return text.replace(examples.ADDRESS, self.url).replace("build/release/bin", os.path.abspath(BIN))

    def files(self):
        return {name for name in os.listdir(self.d.folder) if not name.startswith(("store", "log"))}

    def test_every_block_is_run_by_something(self):
        for paper, language, text in examples.blocks():
            self.assertIn(language, RUN_HERE + RUN_IN_A_BROWSER, (paper, text))
        self.assertGreaterEqual(len(examples.all_of("sh")), 2)
        self.assertGreaterEqual(len(examples.all_of("html")), 3)

    def test_commands_and_python(self):
        """In their order: later ones use files of earlier ones."""
        for paper, language, text in examples.all_of(*RUN_HERE):
            with self.subTest(paper=paper, text=text):
                self.run_in_order(language, self.text(text))
        with open(os.path.join(self.d.folder, "demo.glb"), "rb") as file:
            scene = hashlib.sha256(file.read()).hexdigest()
        self.assertEqual([s["id"] for s in self.d.get("/v1/scenes").json()["scenes"]], [scene])
        self.assertTrue({"out.png", "picture.png", "turn-00.png", "turn-07.png"} <= self.files())
        for name in ("out.png", "picture.png", "turn-07.png"):
            with open(os.path.join(self.d.folder, name), "rb") as file:
                self.assertEqual(file.read(8), b"\x89PNG\r\n\x1a\n", name)

    def run_in_order(self, language, text):
        if language == "sh":
            ran = subprocess.run(["bash", "-euc", text], cwd=self.d.folder, capture_output=True,
                                 env={**os.environ, "PENUMBRA_SERVER": self.url})
            self.assertEqual(ran.returncode, 0, ran.stderr)
            return
        said, before = [], os.getcwd()
        os.chdir(self.d.folder)
        try:
            exec(compile(text, "README.md", "exec"), {"print": lambda *words: said.append(words)})
        finally:
            os.chdir(before)
        self.assertTrue(said)

    def test_the_commands_that_the_readme_names_are_there(self):
        with open(os.path.join(examples.ROOT, "README.md"), encoding="utf-8") as file:
            named = set(re.findall(r"`penumbra ([a-z]+)", file.read()))
        self.assertGreater(len(named), 5)
        for command in named:
            subprocess.run([os.path.join(BIN, "penumbra"), command, "--help"], check=True,
                           stdout=subprocess.DEVNULL)


if __name__ == "__main__":
    harness.main()
