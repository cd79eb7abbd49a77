"""The viewer and the element penumbra-view in Chromium, against a daemon.

usage: test_browser.py FOLDER TEST: the packages of package.json are kept in FOLDER, pictures of the
pages go to its folder pictures; TEST is a file of this folder. Exits 77 (skipped) without Chromium, node, or the packages."""
import http.server
import glob
import os
import shutil
import subprocess
import sys
import threading
import unittest

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(HERE, "../api"))
from harness import BIN, PATIENCE, Daemon  # noqa: E402
from tools import has_node, install, run_node  # noqa: E402


class Control(http.server.BaseHTTPRequestHandler):
    """Ends the daemon at /kill, and starts it again where it was at /start."""

    def do_GET(self):  # noqa: N802
        daemon = self.server.daemon
        if self.path == "/kill":
            daemon.process.kill()
            daemon.process.wait()
        else:
            daemon.flags.append("--listen=127.0.0.1:%d" % daemon.port)
            daemon.start()
        self.send_response(204)
        self.end_headers()

    def log_message(self, *_):
        pass


class Browser(unittest.TestCase):
    def test_browser(self):
        d = Daemon("--cors-origin=*")
        self.addCleanup(d.kill)
        scene = os.path.join(d.folder, "demo.glb")
        subprocess.run([os.path.join(BIN, "penumbra"), "generate", "demo", "-o", scene], check=True)
        with open(scene, "rb") as file:
            name = d.upload(file.read())
        control = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Control)
        control.daemon = d
        threading.Thread(target=control.serve_forever, daemon=True).start()
        self.addCleanup(control.server_close)
        self.addCleanup(control.shutdown)
        pictures = os.path.join(FOLDER, "pictures")
        os.makedirs(pictures, exist_ok=True)
        self.assertEqual(run_node(
            TEST, 120 * PATIENCE, DAEMON="http://127.0.0.1:%d" % d.port, SCENE=name,
            SCENE_FILE=scene, PYTHON_PACKAGE=":".join(glob.glob(os.path.join(BIN, "../python/*.whl"))),
            CHROMIUM=CHROMIUM, PATIENCE_MS=str(int(10000 * PATIENCE)), PACKAGES=FOLDER,
            CLIENT=os.path.join(BIN, "penumbra"), PICTURES=pictures,
            CONTROL="http://127.0.0.1:%d" % control.server_port), 0)
        self.assertEqual(d.stop(), 0)


if __name__ == "__main__":
    FOLDER = os.path.abspath(sys.argv.pop(1))
    TEST = sys.argv.pop(1)
    CHROMIUM = shutil.which("chromium") or shutil.which("google-chrome")
    if not CHROMIUM or not has_node() or not shutil.which("npm"):
        print("skipped: no Chromium, or no node of version 18 or later with npm")
        sys.exit(77)
    if not install(FOLDER):
        print("skipped: the packages cannot be installed")
        sys.exit(77)
    unittest.main(verbosity=2)
