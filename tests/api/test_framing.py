"""Requests that are wrong below HTTP's surface: ambiguous lengths, slow senders, broken uploads."""
import json
import re
import socket
import threading
import time
import unittest

import harness
from harness import PATIENCE, SMALL, Daemon, grid_scene, raw

HOST = b"Host: x\r\n"
# What an attacker would want to have run as a request of its own.
SMUGGLED = b"GET /v1/techniques HTTP/1.1\r\nHost: x\r\n\r\n"


class Framing(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.d = Daemon("--header-timeout-ms=1500", "--keep-alive-ms=3000", "--body-rate=64K")
        cls.id = cls.d.upload(grid_scene(2))

    @classmethod
    def tearDownClass(cls):
        assert cls.d.stop() == 0
        cls.d.kill()

    def tearDown(self):
        self.assertEqual(self.d.get("/v1").status, 200)

    def one_refusal(self, request, status=400):
        """Exactly one answer, then the connection ends: nothing behind it was run."""
        got, closed = raw(self.d.port, request, timeout=3)
        self.assertTrue(got.startswith(b"HTTP/1.1 %d " % status), got[:200])
        self.assertEqual(len(re.findall(rb"HTTP/1\.1 \d\d\d ", got)), 1, got)
        self.assertNotIn(b'"techniques"', got)
        self.assertTrue(closed)
        if b"problem+json" in got and not request.startswith(b"HEAD"):
            document = json.loads(got.split(b"\r\n\r\n", 1)[1])
            self.assertEqual(document["status"], status)
        return got

    def test_body_where_none_belongs(self):
        for method in (b"GET", b"HEAD", b"DELETE"):
            with self.subTest(method=method):
                self.one_refusal(method + b" /v1 HTTP/1.1\r\n" + HOST + b"Content-Length: %d\r\n\r\n"
                                 % len(SMUGGLED) + SMUGGLED)

    def test_names_of_others(self):
        """A name that leads here though nobody here has it: somebody's page asks (DNS rebinding)."""
        for host, status in (("evil.example:%d" % self.d.port, 421), ("a:b", 400), ("", 400),
                             ("localhost:%d" % self.d.port, 200), ("[::1]", 200)):
            with self.subTest(host=host):
                answer = self.d.call("GET", "/v1", headers={"Host": host})
                self.assertEqual(answer.status, status, answer.body)
                if status != 200:
                    self.assertEqual(answer.headers["Content-Type"], "application/problem+json")

    def test_pages_of_others(self):
        """What a foreign page can send without being asked: forms and bodies without a type."""
        render = "/v1/scenes/%s/render" % self.id
        form = {"Content-Type": "multipart/form-data; boundary=x"}
        body = b'--x\r\nContent-Disposition: form-data; name="a"; filename="a.glb"\r\n\r\nx\r\n--x--\r\n'
        foreign = ({"Origin": "http://evil.example"}, {"Origin": "null"},
                   {"Origin": "http://evil.example", "Sec-Fetch-Site": "cross-site"},
                   {"Sec-Fetch-Site": "cross-site"},
                   {"Origin": "http://127.0.0.1:%d" % (self.d.port + 1), "Sec-Fetch-Site": "same-site"})
        for head in foreign:
            with self.subTest(head=head):
                self.assertEqual(self.d.call("POST", "/v1/scenes", body, {**form, **head}).status, 403)
                self.assertEqual(self.d.call("POST", render, b"{}", head).status, 403)
                self.assertEqual(self.d.call("DELETE", "/v1/scenes/" + self.id, headers=head).status,
                                 403)
                shown = self.d.call("GET", render + "?technique=none&width=32&height=32", headers=head)
                self.assertEqual(shown.status, 200)  # pictures may be embedded
        own = {"Origin": "http://127.0.0.1:%d" % self.d.port}
        for head in (own, {**own, "Sec-Fetch-Site": "same-origin"}, {}):
            answer = self.d.call("POST", render, b'{"technique":{"name":"none"},"width":32,"height":32}',
                                 {"Content-Type": "application/json", **head})
            self.assertEqual(answer.status, 200, answer.body)

    def test_hosts_and_versions(self):
        self.one_refusal(b"GET /v1 HTTP/1.1\r\n\r\n" + SMUGGLED)
        self.one_refusal(b"GET /v1 HTTP/1.1\r\nHost: a\r\nHost: b\r\n\r\n" + SMUGGLED)
        got, closed = raw(self.d.port, b"GET /v1 HTTP/1.0\r\n\r\n", timeout=3)
        self.assertTrue(got.startswith(b"HTTP/1."), got)
        self.assertIn(b" 200 ", got[:20])
        self.assertTrue(closed)
        self.one_refusal(b"POST /v1/scenes HTTP/1.0\r\nTransfer-Encoding: chunked\r\n\r\n" + SMUGGLED)

    def test_targets(self):
        for target in (b"/v1#x", b"v1", b"/v1\x7f", b"*"):
            got, _ = raw(self.d.port, b"GET " + target + b" HTTP/1.1\r\n" + HOST + b"\r\n", timeout=1)
            self.assertIn(b" 400 ", got[:20], target)
        got, _ = raw(self.d.port, b"GET http://x/v1/techniques/pcss HTTP/1.1\r\n" + HOST +
                     b"Connection: close\r\n\r\n", timeout=3)
        self.assertIn(b" 200 ", got[:20])

    def test_keep_alive_and_pipelining(self):
        two = b"GET /v1/techniques/none HTTP/1.1\r\n" + HOST + b"\r\n"
        two += b"GET /v1/techniques/hard HTTP/1.1\r\n" + HOST + b"Connection: close\r\n\r\n"
        got, closed = raw(self.d.port, two, timeout=3)
        self.assertEqual(got.count(b"HTTP/1.1 200 "), 2)
        self.assertTrue(closed)
        # A refused small body is read: the connection serves the next request.
        body = b"POST /v1/nothing HTTP/1.1\r\n" + HOST + b"Content-Length: 5\r\n\r\nhello"
        got, _ = raw(self.d.port, body + two, timeout=3)
        self.assertEqual(got.count(b"HTTP/1.1 404 "), 1)
        self.assertEqual(got.count(b"HTTP/1.1 200 "), 2)

    def test_chunked_bodies(self):
        request = json.dumps(SMALL).encode()
        pieces = b"".join(b"%x\r\n%c\r\n" % (1, c) for c in request) + b"0\r\n\r\n"
        got, _ = raw(self.d.port, b"POST /v1/scenes/%s/render HTTP/1.1\r\n" % self.id.encode() + HOST +
                     b"Transfer-Encoding: chunked\r\nConnection: close\r\n\r\n" + pieces, timeout=10)
        self.assertIn(b" 200 ", got[:20])
        self.assertIn(b"\x89PNG", got)
        # Without an end, and beyond the limit in the middle of the body.
        big = b"".join(b"8000\r\n" + b" " * 0x8000 + b"\r\n" for _ in range(8))
        got, closed = raw(self.d.port, b"POST /v1/scenes/%s/render HTTP/1.1\r\n" % self.id.encode() +
                          HOST + b"Transfer-Encoding: chunked\r\n\r\n" + big, timeout=3)
        self.assertIn(b" 413 ", got[:20])
        self.assertTrue(closed)

    def test_early_refusal_reaches_a_client_that_goes_on_sending(self):
        head = (b"POST /v1/scenes HTTP/1.1\r\n" + HOST + b"Content-Type: model/gltf-binary\r\n"
                b"Content-Length: %d\r\n\r\n" % (2 << 30))
        got, closed = raw(self.d.port, head + b"x" * (8 << 20), timeout=5)
        self.assertIn(b" 413 ", got[:20])
        self.assertIn(b"Connection: close", got)
        self.assertTrue(closed)

    def test_slow_header(self):
        start = time.monotonic()
        with socket.create_connection(("127.0.0.1", self.d.port), timeout=10 * PATIENCE) as s:
            with self.assertRaises(OSError):  # broken off long before all is sent
                for c in b"GET /v1 HTTP/1.1\r\n" + HOST + b"X: " + b"y" * 1000:
                    s.sendall(bytes([c]))
                    time.sleep(0.1)
            took = time.monotonic() - start
        self.assertGreater(took, 1.0)

    def test_silent_connection(self):
        got, closed = raw(self.d.port, b"", timeout=6)
        self.assertTrue(closed)
        self.assertIn(b" 408 ", got[:20])

    def test_slow_body(self):
        with socket.create_connection(("127.0.0.1", self.d.port), timeout=20 * PATIENCE) as s:
            s.sendall(b"POST /v1/scenes HTTP/1.1\r\n" + HOST + b"Content-Type: model/gltf-binary\r\n"
                      b"Content-Length: 1000000\r\n\r\n")
            with self.assertRaises(OSError):
                for _ in range(3000):
                    s.sendall(b"z")
                    time.sleep(0.1)
        harness.wait(lambda: self.d.leftovers() == [])

    def test_truncated_uploads(self):
        glb = grid_scene(30, "truncated")
        before = self.d.get("/v1/scenes").json()["total"]
        for cut in (0, 1, 100, len(glb) - 1):
            with socket.create_connection(("127.0.0.1", self.d.port)) as s:
                s.sendall(b"POST /v1/scenes HTTP/1.1\r\n" + HOST +
                          b"Content-Type: model/gltf-binary\r\nContent-Length: %d\r\n\r\n" % len(glb) +
                          glb[:cut])
                time.sleep(0.05)
        harness.wait(lambda: self.d.leftovers() == [])
        self.assertEqual(self.d.get("/v1/scenes").json()["total"], before)

    def test_client_that_leaves(self):
        """A queued render whose client has gone is not started."""
        scene = self.d.upload(grid_scene(1, "left behind"))
        gone = self.d.metric("penumbra_renders_abandoned_total")
        blockers = [threading.Thread(target=self.d.render, args=(scene, {**SMALL, "exposure_ev": n}))
                    for n in range(harness.IN_TURNS)]
        body = json.dumps({**SMALL, "exposure_ev": 9}).encode()
        with self.d.paused():
            for blocker in blockers:
                blocker.start()
            harness.wait(lambda: self.d.metric("penumbra_renders_running") == harness.IN_TURNS)
            with socket.create_connection(("127.0.0.1", self.d.port)) as s:
                s.sendall(b"POST /v1/scenes/%s/render HTTP/1.1\r\n" % scene.encode() + HOST +
                          b"Content-Length: %d\r\n\r\n" % len(body) + body)
                harness.wait(lambda: self.d.metric("penumbra_queue_depth") >= 1)
        for blocker in blockers:
            blocker.join()
        harness.wait(lambda: self.d.metric("penumbra_renders_abandoned_total") == gone + 1)


if __name__ == "__main__":
    harness.main()
