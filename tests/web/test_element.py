"""penumbra-view and the HTML and JavaScript examples of the papers, in Chromium: in pages of another
origin, with a token, by touch and keys, and with a daemon that goes away and comes back.

usage: test_element.py FOLDER TEST, where the packages of package.json are kept, and the file here that
tests. Exits 77 (skipped) without Chromium, node, or the packages."""
import http.server
import json
import os
import shutil
import socket
import subprocess
import sys
import threading
import unittest

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(HERE, "../api"))
import examples  # noqa: E402
from harness import BIN, PATIENCE, Daemon  # noqa: E402
from tools import has_node, install, run_node  # noqa: E402

TOKENS = {"viewer": ("a-token-for-pages-that-look", "read,render"),
          "sender": ("a-token-for-those-who-send", "read,render,upload")}


def free_port():
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        return s.getsockname()[1]


class Switch(http.server.ThreadingHTTPServer):
    """GET /stop kills the daemon, /start starts it again at its address."""
    daemon_threads = True

    def __init__(self, daemon):
        class Handler(http.server.BaseHTTPRequestHandler):
            def do_GET(self):
                if self.path == "/stop":
                    daemon.process.kill()
                    daemon.process.wait()
                else:
                    daemon.start()
                self.send_response(204)
                self.end_headers()

            def log_message(self, *_):
                pass
        super().__init__(("127.0.0.1", 0), Handler)
        threading.Thread(target=self.serve_forever, args=[0.02], daemon=True).start()

    @property
    def url(self):
        return "http://127.0.0.1:%d" % self.server_address[1]


class Element(unittest.TestCase):
    def daemon(self, *flags):
        d = Daemon(*flags)
        self.addCleanup(d.kill)
        return d, "http://127.0.0.1:%d" % d.port

    def test_element(self):
        origin = "http://127.0.0.1:%d" % free_port()
        allowed = "--cors-origin=" + origin
        d, url = self.daemon(allowed)
        glb = os.path.join(d.folder, "demo.glb")
        subprocess.run([os.path.join(BIN, "penumbra"), "generate", "demo", "-o", glb], check=True)
        with open(glb, "rb") as file:
            data = file.read()
        tokens = os.path.join(d.folder, "tokens")
        with open(tokens, "w") as file:
            file.writelines("%s %s %s\n" % (name, *row) for name, row in TOKENS.items())
        os.chmod(tokens, 0o600)
        _, locked = self.daemon(allowed, "--token-file=" + tokens)
        leaving, away = self.daemon(allowed, "--listen=127.0.0.1:%d" % free_port())
        switch = Switch(leaving)
        self.addCleanup(switch.server_close)
        self.addCleanup(switch.shutdown)
        scene = d.upload(data)
        leaving.upload(data)
        texts = [(paper, kind, text.replace(examples.ADDRESS, url)) for paper, kind, text in
                 examples.all_of("html", "js")]
        pictures = os.path.join(FOLDER, "pictures")
        os.makedirs(pictures, exist_ok=True)
        self.assertEqual(run_node(
            TEST, 120 * PATIENCE, DAEMON=url, LOCKED=locked, AWAY=away, SWITCH=switch.url, ORIGIN=origin,
            SCENE=scene, GLB=glb, CHROMIUM=CHROMIUM, PACKAGES=FOLDER, PICTURES=pictures,
            PATIENCE_MS=str(int(10000 * PATIENCE)), EXAMPLES=json.dumps(texts),
            VIEWER=TOKENS["viewer"][0], SENDER=TOKENS["sender"][0]), 0)
        self.assertEqual(d.stop(), 0)


if __name__ == "__main__":
    TEST, FOLDER = sys.argv.pop(2), os.path.abspath(sys.argv.pop(1))
    CHROMIUM = shutil.which("chromium") or shutil.which("google-chrome")
    if not CHROMIUM or not has_node() or not shutil.which("npm"):
        print("skipped: no Chromium, or no node of version 18 or later with npm")
        sys.exit(77)
    if not install(FOLDER):
        print("skipped: the packages cannot be installed")
        sys.exit(77)
    unittest.main(verbosity=2)
