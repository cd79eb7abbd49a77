"""The JavaScript client, in Node: against a daemon, and against servers that misbehave.
Exits 77 (skipped) when there is no node, or one below 18."""
import os
import shutil
import subprocess
import sys
import unittest

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(HERE, "../api"))
from harness import PATIENCE, Daemon, grid_scene  # noqa: E402

MODULES = os.path.join(HERE, "../../clients/js")


def run_node(test, **env):
    """Runs the tests of a file and returns node's exit status."""
    return subprocess.run(["node", "--test", "--test-reporter=spec", os.path.join(HERE, test)],
                          env={**os.environ, **env}, timeout=100 * PATIENCE, check=False).returncode


class Client(unittest.TestCase):
    def test_client(self):
        d = Daemon()
        self.addCleanup(d.kill)
        scene = os.path.join(d.folder, "scene.glb")
        with open(scene, "wb") as file:
            file.write(grid_scene(4))
        self.assertEqual(run_node(
            "client_test.mjs", DAEMON="http://127.0.0.1:%d" % d.port, SCENE=scene,
            MODULE=os.path.join(MODULES, "penumbra.js")), 0)
        self.assertEqual(d.stop(), 0)

    def test_view(self):
        self.assertEqual(run_node("view_test.mjs", MODULE=os.path.join(MODULES, "penumbra-view.js")), 0)


if __name__ == "__main__":
    version = shutil.which("node") and subprocess.run(
        ["node", "-p", "process.versions.node"], capture_output=True, text=True).stdout
    if not version or int(version.split(".")[0]) < 18:
        print("skipped: no node of version 18 or later")
        sys.exit(77)
    unittest.main(verbosity=2)
