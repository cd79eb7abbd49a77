"""cmake --install into a folder that is then moved: what lies there works, is documented and says the
one version. Usage: test_install.py BUILD_FOLDER VERSION"""
import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

import harness

BUILD, VERSION = sys.argv.pop(1), sys.argv.pop(1)


def output(*command):
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


class Install(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.mkdtemp(prefix="penumbra-install-")
        there = os.path.join(cls.folder, "first")
        cls.said = output("cmake", "--install", BUILD, "--prefix", there)
        cls.prefix = os.path.join(cls.folder, "moved")
        os.rename(there, cls.prefix)
        harness.BIN = os.path.join(cls.prefix, "bin")

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.folder)

    def path(self, *parts):
        return os.path.join(self.prefix, *parts)

    def test_renders(self):
        """A scene made, uploaded, imported and drawn by installed programs alone."""
        self.assertEqual(sorted(os.listdir(self.path("bin"))), ["penumbra", "penumbrad"])
        d = harness.Daemon()
        self.addCleanup(d.kill)
        worker = d.worker()
        self.assertEqual(os.readlink("/proc/%d/exe" % worker),
                         os.path.realpath(self.path("libexec", "penumbra", "penumbra-worker")))
        scene, picture = self.path("demo.glb"), self.path("demo.png")
        penumbra = self.path("bin", "penumbra")
        output(penumbra, "generate", "demo", "-o", scene)
        output(penumbra, "render", scene, "-o", picture, "--width", "64", "--height", "48",
               "--technique", "hard", "--server", "http://127.0.0.1:%d" % d.port,
               "--deadline-ms", "600000")
        with open(picture, "rb") as file:
            self.assertEqual(file.read(4), b"\x89PNG")
        self.assertEqual(d.get("/v1").json()["version"], VERSION)
        self.assertEqual(d.get("/openapi.json").json()["info"]["version"], VERSION)
        self.assertEqual(d.stop(), 0)

    def test_shaders(self):
        """The first start is to be as quick as the next ones."""
        self.assertIn("Shaders are in the driver's cache", self.said)

    def test_versions(self):
        self.assertEqual(output(self.path("bin", "penumbra"), "version"), "penumbra %s\n" % VERSION)
        self.assertEqual(output(self.path("bin", "penumbrad"), "--version"),
                         "penumbrad %s\n" % VERSION)

    def test_manual(self):
        """Each page names its program and the version; it has what the program says of itself."""
        for name, section, says in (("penumbrad", 8, "--help"), ("penumbra", 1, "manual")):
            with open(self.path("share", "man", "man%d" % section, "%s.%d" % (name, section)),
                      encoding="utf-8") as file:
                page = file.read()
            self.assertRegex(page, r'^\.TH %s %d "" "penumbra %s"\n' % (
                name, section, re.escape(VERSION)))
            said = output(self.path("bin", name), says)
            plain = page.replace("\n\\&", "\n").replace("\\-", "-").replace("\\e", "\\")
            self.assertIn(said, page if says == "manual" else plain)
            if shutil.which("man"):
                shown = subprocess.run(["man", "--warnings", "-l", "-P", "cat", self.path(
                    "share", "man", "man%d" % section, "%s.%d" % (name, section))],
                    capture_output=True, text=True)
                self.assertEqual((shown.returncode, shown.stderr), (0, ""))

    def test_completion(self):
        for shell, path in (("bash", "bash-completion/completions/penumbra"),
                            ("zsh", "zsh/site-functions/_penumbra"),
                            ("fish", "fish/vendor_completions.d/penumbra.fish")):
            with open(self.path("share", *path.split("/")), encoding="utf-8") as file:
                self.assertEqual(file.read(), output(self.path("bin", "penumbra"), "completion", shell))

    def test_papers_and_unit(self):
        self.assertTrue(os.path.isfile(self.path("share", "doc", "penumbra", "README.md")))
        with open(self.path("lib", "systemd", "system", "penumbrad.service")) as file:
            start = re.search(r"^ExecStart=(\S+)", file.read(), re.M)[1]
        self.assertTrue(start.endswith("/bin/penumbrad"), start)


if __name__ == "__main__":
    harness.main()
