"""The JavaScript client, in Node: against a daemon, and against servers that misbehave.
Exits 77 (skipped) when there is no node, or one below 18."""
import os
import sys
import unittest

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(HERE, "../api"))
from harness import PATIENCE, Daemon, grid_scene  # noqa: E402
from tools import MODULES, has_node, run_node  # noqa: E402

NODE_S = 100 * PATIENCE


class Client(unittest.TestCase):
    def test_client(self):
        d = Daemon()
        self.addCleanup(d.kill)
        scene = os.path.join(d.folder, "scene.glb")
        with open(scene, "wb") as file:
            file.write(grid_scene(4))
        self.assertEqual(run_node(
            "client_test.mjs", NODE_S, DAEMON="http://127.0.0.1:%d" % d.port, SCENE=scene,
            MODULE=os.path.join(MODULES, "penumbra.js")), 0)
        self.assertEqual(d.stop(), 0)

    def test_view(self):
        self.assertEqual(run_node("view_test.mjs", NODE_S,
                                  MODULE=os.path.join(MODULES, "penumbra-view.js")), 0)


if __name__ == "__main__":
    if not has_node():
        print("skipped: no node of version 18 or later")
        sys.exit(77)
    unittest.main(verbosity=2)
