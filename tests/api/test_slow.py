"""Slow clients, idle clients, and too few descriptors: who is quick is answered nevertheless."""
import contextlib
import socket
import threading
import time
import unittest

import harness
from harness import PATIENCE, SMALL, Daemon, grid_scene, raw
from swarm import Swarm

HOST = b"Host: x\r\n"
QUICK = b"GET /v1/techniques/none HTTP/1.1\r\n" + HOST + b"Connection: close\r\n\r\n"


class Slow(unittest.TestCase):
    def daemon(self, *flags, **more):
        d = Daemon(*flags, **more)
        self.addCleanup(d.kill)
        return d

    def connect(self, port, address="127.0.0.1"):
        s = socket.create_connection(("127.0.0.1", port), timeout=20 * PATIENCE,
                                     source_address=(address, 0))
        self.addCleanup(s.close)
        return s

    def test_the_quick_are_answered(self):
        """Of far fewer places than slow clients: from an address of its own, and from one of theirs."""
        d = self.daemon("--connections=64", "--connections-per-address=16")
        scene = d.upload(grid_scene(1, "slow"))
        with Swarm(d.port, scene, 300) as swarm:
            for i in range(150):
                with self.connect(d.port, ("127.0.0.1", "127.0.0.2", "127.0.1.1")[i % 3]) as s:
                    s.sendall(QUICK)
                    got = b"".join(iter(lambda: s.recv(65536), b""))
                    self.assertTrue(got.startswith(b"HTTP/1.1 200 "), (i, got[:200]))
            for i in range(5):
                self.assertEqual(d.render(scene, SMALL).status, 200)
                self.assertEqual(d.upload(grid_scene(2, "quick %d" % i)) != scene, True)
            self.assertEqual(d.admin("/livez").status, 200)
        self.assertGreater(swarm.put_out.value, 0)
        self.assertGreater(d.metric("penumbra_connections_displaced_total"), 0)
        self.assertEqual(d.stop(), 0)

    def test_slow_uploads_leave_room(self):
        """Faster than the least rate, so that none would be ended for itself."""
        d = self.daemon("--uploads=4")
        over = threading.Event()

        def send(s):
            with contextlib.suppress(OSError):
                s.sendall(b"POST /v1/scenes HTTP/1.1\r\n" + HOST + b"Content-Length: 50000000\r\n"
                          b"Content-Type: model/gltf-binary\r\n\r\n")
                while not over.wait(0.1):
                    s.sendall(b"x" * 1800)

        slow = [self.connect(d.port, "127.0.0.%d" % (2 + i % 2)) for i in range(8)]
        threads = [threading.Thread(target=send, args=(s,)) for s in slow]
        try:
            for thread in threads[:4]:
                thread.start()
            harness.wait(lambda: len(d.leftovers()) >= 4)
            for i in range(3):
                d.upload(grid_scene(30, "between slow ones %d" % i))
            for thread in threads[4:]:
                thread.start()
            # Beyond the places it is the slow ones that leave, with an answer.
            harness.wait(lambda: d.metric("penumbra_connections_displaced_total") >= 4)
            d.upload(grid_scene(30, "behind slow ones"))
        finally:
            over.set()
            for thread in threads:
                thread.join()
        told = []
        for s in slow:
            s.shutdown(socket.SHUT_WR)
            with contextlib.suppress(OSError):
                told.append(s.recv(4096))
        self.assertTrue(any(b" 408 " in t[:20] for t in told), told)
        self.assertEqual(d.stop(), 0)

    def test_idle_ones_make_room(self):
        d = self.daemon("--connections=8", "--connections-per-address=6")
        idle = [self.connect(d.port) for _ in range(6)]
        harness.wait(lambda: d.metric("penumbra_connections") == 6)
        got, closed = raw(d.port, QUICK)
        self.assertIn(b" 200 ", got[:20])
        self.assertEqual(idle[0].recv(4096), b"")  # the one that idled longest
        idle[5].sendall(QUICK)
        self.assertIn(b" 200 ", idle[5].recv(20))
        self.assertEqual(d.stop(), 0)

    def test_who_waits_for_an_answer_stays(self):
        """When every place is needed, the newcomer is told so."""
        for flags, status, places in ((("--connections=4",), b" 503 ", 4),
                                      (("--connections=8", "--connections-per-address=3"), b" 429 ", 3)):
            d = self.daemon(*flags)
            scene = d.upload(grid_scene(1, "waiting"))
            with d.paused():
                waiting = [self.connect(d.port) for _ in range(places)]
                for i, s in enumerate(waiting):
                    body = b'{"technique":{"name":"hard"},"width":%d,"height":32}' % (32 + i)
                    s.sendall(b"POST /v1/scenes/%s/render HTTP/1.1\r\n" % scene.encode() + HOST +
                              b"Connection: close\r\nContent-Length: %d\r\n\r\n" % len(body) + body)
                harness.wait(lambda: d.metric("penumbra_renders_running") +
                             d.metric("penumbra_queue_depth") == places)
                for _ in range(3):
                    got, closed = raw(d.port, QUICK)
                    self.assertIn(status, got[:20])
                    self.assertIn(b"Retry-After: ", got)
                    self.assertTrue(closed)
                self.assertEqual(d.admin("/livez").status, 200)
            for s in waiting:
                got = b"".join(iter(lambda: s.recv(65536), b""))
                self.assertIn(b" 200 ", got[:20])
            self.assertEqual(d.get("/v1").status, 200)
            self.assertEqual(d.stop(), 0)

    def test_absolute_deadlines(self):
        """A byte now and then does not keep a connection alive."""
        d = self.daemon("--header-timeout-ms=1000", "--body-rate=64K")
        scene = d.upload(grid_scene(1, "deadlines"))
        for beginning in (b"GET /v1 HTTP/1.1\r\n" + HOST + b"X: ",
                          b"POST /v1/scenes/%s/render HTTP/1.1\r\n" % scene.encode() + HOST +
                          b"Content-Length: 60000\r\n\r\n",
                          b"POST /v1/scenes/%s/render HTTP/1.1\r\n" % scene.encode() + HOST +
                          b"Transfer-Encoding: chunked\r\n\r\nea60\r\n"):
            s = self.connect(d.port)
            s.sendall(beginning)
            s.settimeout(0.1)
            got = b""
            end = time.monotonic() + 60 * PATIENCE
            while not got and time.monotonic() < end:
                s.sendall(b" ")
                with contextlib.suppress(socket.timeout):
                    got = s.recv(4096)
            self.assertIn(b" 408 ", got[:20])
            self.assertIn(b"application/problem+json", got)
        self.assertEqual(d.stop(), 0)


class Descriptors(unittest.TestCase):
    def test_few(self):
        """The public listener has taken what there is: health still answers, and then all is well."""
        d = Daemon(start=False)
        self.addCleanup(d.kill)
        d.start(descriptors=64)
        self.assertEqual(harness.wait(lambda: d.admin("/readyz").status == 200), True)
        scene = d.upload(grid_scene(1, "few"))
        held = [socket.create_connection(("127.0.0.1", d.port)) for _ in range(150)]
        for i, s in enumerate(held):
            with contextlib.suppress(OSError):
                s.sendall(b"GET /v1 HTTP/1.1\r\nX: " if i % 3 else b"POST /v1/scenes/%s/render HTTP/1.1\r\n"
                          b"Host: x\r\nContent-Length: 100\r\n\r\n" % scene.encode())
        for _ in range(20):
            self.assertEqual(d.admin("/livez").status, 200)
            self.assertEqual(d.admin("/readyz").status, 200)
            self.assertIn(raw(d.port, QUICK)[0][9:12], (b"200", b"503"))
        spent = d.processor_s()
        time.sleep(2)
        self.assertLess(d.processor_s() - spent, 1)  # it does not spin
        for s in held:
            s.close()
        harness.wait(lambda: d.exchange("GET", "/v1").status == 200)
        self.assertEqual(d.render(scene, SMALL).status, 200)
        self.assertEqual(d.stop(), 0)

    def test_admin_connections(self):
        d = Daemon()
        self.addCleanup(d.kill)
        held = [socket.create_connection(("127.0.0.1", d.admin_port)) for _ in range(400)]
        for s in held[::2]:
            with contextlib.suppress(OSError):
                s.sendall(b"GET /livez HTTP/1.1\r\n")
        for _ in range(20):
            self.assertEqual(d.admin("/livez").status, 200)
        self.assertEqual(harness.wait(lambda: d.admin("/readyz").status == 200), True)
        for s in held:
            s.close()
        self.assertEqual(d.stop(), 0)


if __name__ == "__main__":
    harness.main()
