"""Pictures that get better in one answer: what is sent, when, and what happens when it goes wrong."""
import email.parser
import email.policy
import http.client
import json
import os
import re
import signal
import socket
import struct
import subprocess
import threading
import time
import unittest
import zlib

import harness
from harness import Daemon, grid_scene, wait

PARTS = "multipart/x-mixed-replace"
EVENTS = "text/event-stream"
# Long enough on any machine that there is something to see before its end.
REFINED = {"technique": {"name": "multisample", "params": {"samples": 256, "map_size": 128}},
           "width": 64, "height": 48, "deadline_ms": 3600000}
ENDLESS = dict(REFINED, antialias=64, width=640, height=480)


class Reader:
    """An answer read from the socket itself: the header, then the chunks as they come."""

    def __init__(self, daemon, scene, request, accept=PARTS, fresh=True, version="1.1", buffer=0,
                 method="POST", headers=""):
        self.socket = socket.socket()
        if buffer:
            self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, buffer)
        self.socket.settimeout(60 * harness.PATIENCE)
        self.socket.connect(("127.0.0.1", daemon.port))
        body = json.dumps(request).encode() if method == "POST" else b""
        path = "/v1/scenes/%s/render" % scene + ("?" + request if method != "POST" else "")
        self.socket.sendall((
            "%s %s HTTP/%s\r\nHost: x\r\nAccept: %s\r\n%s%sContent-Length: %d\r\n\r\n" % (
                method, path, version, accept, "Cache-Control: no-cache\r\n" if fresh else "",
                headers, len(body))).encode() + body)
        self.file = self.socket.makefile("rb")
        self.ended = False  # as HTTP says it: the last chunk, or the end of the connection in 1.0

    def head(self):
        self.status = int(self.file.readline().split()[1])
        self.headers = {}
        for line in iter(self.file.readline, b"\r\n"):
            name, value = line.decode().rstrip("\r\n").split(": ", 1)
            self.headers[name] = value
        self.chunked = self.headers.get("Transfer-Encoding") == "chunked"
        return self

    def chunks(self):
        while not self.chunked:
            piece = self.file.read1(65536)
            if not piece:
                self.ended = True
                return
            yield piece
        while True:
            line = self.file.readline()
            if not re.fullmatch(rb"[0-9a-fA-F]+\r\n", line):
                return
            size = int(line, 16)
            data = self.file.read(size)
            if self.file.read(2) != b"\r\n":
                return
            if not size:
                self.ended = True
                return
            yield data

    def all(self):
        return b"".join(self.head().chunks())

    def close(self):
        self.file.close()
        self.socket.close()


def split(headers, body):
    """Parts as [(headers, bytes)], and whether the closing boundary is there; by the letter of RFC
    2046, and again by Python's own parser."""
    kind, boundary = re.fullmatch(r"([\w/-]+); boundary=(\w{1,70})",
                                  headers["Content-Type"]).groups()
    assert kind == PARTS, kind
    line = b"\r\n--" + boundary.encode()
    body = b"\r\n" + body
    pieces = body.split(line)
    assert pieces[0] == b"", "something stands before the first boundary"
    closed = pieces[-1] == b"--\r\n"
    parts = []
    for piece in pieces[1:len(pieces) - closed]:
        assert piece.startswith(b"\r\n"), piece[:20]
        head, data = piece[2:].split(b"\r\n\r\n", 1)
        parts.append((dict(line.split(": ", 1) for line in head.decode().split("\r\n")), data))
    if closed:
        message = email.parser.BytesParser(policy=email.policy.HTTP).parsebytes(
            b"Content-Type: " + headers["Content-Type"].encode() + b"\r\n\r\n" + body[2:])
        assert [p.get_content_type() for p in message.iter_parts()] == [
            head["Content-Type"] for head, _ in parts]
    return parts, closed


def texts(png):
    """The text chunks of a PNG, whose other chunks must be whole."""
    assert png[:8] == b"\x89PNG\r\n\x1a\n", png[:8]
    found, at, kind = {}, 8, None
    while at < len(png):
        size, kind = struct.unpack(">I4s", png[at:at + 8])
        data = png[at + 8:at + 8 + size]
        assert zlib.crc32(kind + data) == struct.unpack(">I", png[at + 8 + size:at + 12 + size])[0]
        if kind == b"tEXt":
            key, value = data.split(b"\0", 1)
            found[key.decode()] = value.decode("latin-1")
        at += 12 + size
    assert kind == b"IEND"
    return found


def events(body):
    """[(name, data)] of a stream of events, as the HTML standard reads it; comments left out."""
    found = []
    assert body.endswith(b"\n\n")
    for block in body.decode().split("\n\n")[:-1]:
        fields = dict(line.split(": ", 1) for line in block.split("\n"))
        if "event" in fields:
            assert set(fields) == {"event", "data"}, fields
            found.append((fields["event"], json.loads(fields["data"])))
        else:
            assert set(fields) == {""}, fields
    return found


def kill_workers(daemon, is_over):
    """Until the daemon gives up; each may live longer, to get as far as rendering."""
    delay = 0.5
    while not is_over():
        for worker in daemon.children("penumbra-worker"):
            os.kill(worker, signal.SIGABRT)  # a crash: two are enough
        end = time.monotonic() + delay
        while time.monotonic() < end and not is_over():
            time.sleep(0.05)
        delay *= 2


class Parts(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.d = Daemon("--client-share=0", "--connections-per-address=1000")
        cls.scene = cls.d.upload(grid_scene(4))

    @classmethod
    def tearDownClass(cls):
        cls.d.kill()

    def open(self, request, *given, **options):
        reader = Reader(self.d, self.scene, request, *given, **options)
        self.addCleanup(reader.close)
        return reader

    def running(self):
        return self.d.metric("penumbra_renders_running")

    def samples(self, parts):
        """Of each picture but the last, which says nothing of its own making."""
        told = [texts(data) for _, data in parts]
        self.assertNotIn("penumbra:samples", told[-1])
        counts = [int(t["penumbra:samples"]) for t in told[:-1]]
        for t in told[:-1]:
            self.assertGreater(float(t["penumbra:elapsed_ms"]), 0)
        self.assertEqual(counts, sorted(set(counts)), "they do not get better")
        return counts

    def test_pictures_get_better(self):
        reader = self.open(REFINED)
        parts, closed = split(reader.head().headers, b"".join(reader.chunks()))
        self.assertEqual(reader.status, 200)
        self.assertTrue(closed and reader.ended)
        self.assertGreaterEqual(len(parts), 2)
        self.assertEqual({tuple(head.items()) for head, _ in parts}, {(("Content-Type", "image/png"),)})
        self.assertGreaterEqual(len(self.samples(parts)), 1)
        self.assertNotIn("ETag", reader.headers)
        self.assertIn("no-store", reader.headers["Cache-Control"])
        plain = self.d.render(self.scene, REFINED, fresh=False)  # from the cache
        self.assertEqual(parts[-1][1], plain.body)
        self.assertEqual(parts[-1][1], self.d.render(self.scene, REFINED).body)

    def test_next_header_comes_with_each_picture(self):
        """What a browser needs to show it (Chromium waits for the header of the next part)."""
        reader = self.open(REFINED).head()
        boundary = reader.headers["Content-Type"].split("=")[1].encode()
        header = b"--" + boundary + b"\r\nContent-Type: image/png\r\n\r\n"
        got = b""
        with self.d.paused():  # whatever has come by now is all that comes
            for piece in reader.chunks():
                got += piece
                if got.count(header) == 2 and got.endswith(header):
                    break
        self.assertTrue(got.startswith(header) and got.endswith(header), got[-80:])
        for _ in reader.chunks():
            pass

    def test_events(self):
        reader = self.open(REFINED, EVENTS, headers="Last-Event-ID: 7\r\n")
        told = events(reader.all())
        self.assertTrue(reader.ended)
        self.assertEqual(reader.headers["Content-Type"], EVENTS)
        self.assertEqual([name for name, _ in told],
                         ["picture"] * (len(told) - 1) + ["done"])
        self.assertGreaterEqual(len(told), 2)
        record = self.d.contract.resolve("#/components/schemas/Record")
        done = [r["progress"]["samples"] for _, r in told]
        self.assertEqual(done, sorted(set(done)))
        for name, data in told:
            self.assertEqual(self.d.contract.problems(data, record), [])
            picture = self.d.get(data["image"]["href"])
            self.assertEqual(picture.status, 200)
            self.assertEqual(len(picture.body), data["image"]["bytes"])
            self.assertEqual(data["progress"]["samples"] == data["progress"]["of"], name == "done")
        self.assertEqual(picture.body, self.d.render(self.scene, REFINED, fresh=False).body)

    def test_as_an_image_element_asks(self):
        """The query alone, with what browsers accept; HEAD of it; who has the picture already."""
        query = "technique=multisample&samples=256&map_size=128&width=64&height=48&progressive=true"
        accept = "image/avif,image/webp,image/apng,image/svg+xml,image/*,*/*;q=0.8"
        reader = self.open(query, accept, method="GET")
        parts, closed = split(reader.head().headers, b"".join(reader.chunks()))
        self.assertTrue(closed)
        self.assertGreaterEqual(len(self.samples(parts)), 1)
        plain = self.d.get("/v1/scenes/%s/render?%s" % (self.scene, query.rsplit("&", 1)[0]))
        self.assertEqual(parts[-1][1], plain.body)
        head = self.open(query, accept, method="HEAD").head()
        self.assertEqual((head.status, head.headers["Content-Type"].split(";")[0]), (200, PARTS))
        known = self.d.get("/v1/scenes/%s/render?%s" % (self.scene, query),
                           If_None_Match=plain.headers["ETag"])
        self.assertEqual((known.status, known.body), (304, b""))
        record = self.d.get("/v1/scenes/%s/render?%s" % (self.scene, query),
                            Accept="application/json")
        self.assertEqual(record.headers["Content-Type"], "application/json")

    def test_one_part(self):
        """What is kept, and what has no samples, is there at once."""
        for request in (dict(REFINED, technique="hard"), dict(REFINED, technique="none")):
            for accept, fresh in ((PARTS, True), (PARTS, False), (EVENTS, False)):
                reader = self.open(request, accept, fresh=fresh)
                body = reader.all()
                plain = self.d.render(self.scene, request, fresh=False)
                if accept == EVENTS:
                    (name, data), = events(body)
                    self.assertEqual(name, "done")
                    self.assertEqual(self.d.get(data["image"]["href"]).body, plain.body)
                else:
                    parts, closed = split(reader.headers, body)
                    self.assertTrue(closed)
                    self.assertEqual([data for _, data in parts], [plain.body])

    def test_formats(self):
        for format, kind in (("png", "image/png"), ("exr", "image/x-exr"), ("jpeg", "image/jpeg"),
                             ("webp", "image/webp"), ("tiff", "image/tiff")):
            request = dict(REFINED, output={"format": format})
            reader = self.open(request)
            parts, closed = split(reader.head().headers, b"".join(reader.chunks()))
            self.assertTrue(closed)
            self.assertEqual({head["Content-Type"] for head, _ in parts}, {kind})
            self.assertEqual(parts[-1][1], self.d.render(self.scene, request, fresh=False).body)
        # Accept may name the format of the parts beside their being parts.
        reader = self.open(dict(REFINED, technique="hard"), PARTS + ", image/webp;q=0.9")
        parts, _ = split(reader.head().headers, b"".join(reader.chunks()))
        self.assertEqual(parts[0][0]["Content-Type"], "image/webp")

    def test_old_http(self):
        """Without chunks the end of the connection is the end."""
        reader = self.open(REFINED, version="1.0")
        parts, closed = split(reader.head().headers, b"".join(reader.chunks()))
        self.assertFalse(reader.chunked)
        self.assertTrue(closed and reader.ended)
        self.assertEqual(parts[-1][1], self.d.render(self.scene, REFINED, fresh=False).body)

    def test_errors_before_the_first_picture(self):
        for accept in (PARTS, EVENTS):
            lost = self.d.call("POST", "/v1/scenes/%s/render" % ("0" * 64), "{}", {"Accept": accept})
            self.assertEqual(lost.status, 404)
            with self.d.paused():
                late = self.d.render(self.scene, dict(REFINED, deadline_ms=50), Accept=accept)
            self.assertIn(late.status, (503, 504))  # the former when that can be known at once
            self.assertEqual(late.headers["Content-Type"], "application/problem+json")

    def test_errors_behind_the_first_picture(self):
        """A worker that dies is replaced, and the pictures go on getting better; when the next one
        dies too, the answer says so and is broken off."""
        for accept in (PARTS, EVENTS):
            daemon = Daemon("--client-share=0")
            self.addCleanup(daemon.kill)
            scene = daemon.upload(grid_scene(4))
            reader = Reader(daemon, scene, ENDLESS, accept)
            self.addCleanup(reader.close)
            chunks = reader.head().chunks()
            got = next(chunks)
            rest = []
            reading = threading.Thread(target=lambda: rest.append(b"".join(chunks)))
            reading.start()
            kill_workers(daemon, lambda: not reading.is_alive())
            reading.join()
            got += rest[0]
            if accept == EVENTS:
                told = events(got)
                self.assertTrue(reader.ended)
                self.assertEqual({name for name, _ in told[:-1]}, {"picture"})
                name, problem = told[-1]
                self.assertEqual(name, "problem")
            else:
                parts, closed = split(reader.headers, got)
                self.assertFalse(closed or reader.ended)
                head, data = parts[-1]
                self.assertEqual(head["Content-Type"], "application/problem+json")
                problem = json.loads(data)
                self.assertEqual(parts[-2][1], b"")  # its header had gone out
                counts = [int(texts(data)["penumbra:samples"]) for _, data in parts[:-2]]
                self.assertEqual(counts, sorted(set(counts)))
            self.assertEqual((problem["status"], problem["title"]), (500, "Internal Server Error"))
            daemon.kill()

    def test_clients_that_leave(self):
        wait(lambda: self.running() == 0)
        before = self.d.metric("penumbra_renders_cancelled_total")
        for n, accept in enumerate((PARTS, EVENTS, PARTS)):
            reader = self.open(ENDLESS, accept)
            next(reader.head().chunks())
            self.assertEqual(self.running(), 1)
            reader.close()
            wait(lambda: self.running() == 0)
            self.assertEqual(self.d.metric("penumbra_renders_cancelled_total"), before + n + 1)

    def test_twenty_watch_one_picture(self):
        """One render for all, each sees it getting better, all see the same end."""
        shared = self.d.metric("penumbra_renders_shared_total")
        request = dict(REFINED, exposure_ev=1)
        with self.d.paused():
            readers = [self.open(request, EVENTS if n % 4 == 3 else PARTS, fresh=False)
                       for n in range(20)]
            wait(lambda: self.d.metric("penumbra_renders_shared_total") == shared + 19)
        bodies = [None] * 20
        threads = [threading.Thread(target=lambda n=n: bodies.__setitem__(n, readers[n].all()))
                   for n in range(20)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        plain = self.d.render(self.scene, request, fresh=False).body
        for n, body in enumerate(bodies):
            if n % 4 == 3:
                self.assertEqual(events(body)[-1][0], "done")
                continue
            parts, closed = split(readers[n].headers, body)
            self.assertTrue(closed)
            self.assertGreaterEqual(len(self.samples(parts)), 1)
            self.assertEqual(parts[-1][1], plain)

    def test_command_line(self):
        """The file is a whole picture at any time, and the plain answer at the end."""
        path = os.path.join(self.d.folder, "better.png")
        command = [os.path.join(harness.BIN, "penumbra"), "render", self.scene, "--server",
                   "http://127.0.0.1:%d" % self.d.port, "--technique", "multisample", "--set",
                   "samples=256", "--set", "map_size=128", "--width", "64", "--height", "48",
                   "--deadline-ms", "3600000", "--exposure-ev", "3", "--progressive", "-v", "-o"]
        with self.d.paused():
            client = subprocess.Popen(command + [path], stderr=subprocess.PIPE)
            wait(lambda: self.running() == 1)
        seen = set()
        while client.poll() is None:
            if os.path.exists(path):
                with open(path, "rb") as file:
                    seen.add(file.read())
            time.sleep(0.002)
        said = client.stderr.read()
        client.stderr.close()
        self.assertEqual(client.returncode, 0, said)
        pictures = int(re.search(rb"^(\d+) pictures$", said, re.M)[1])
        self.assertGreaterEqual(pictures, 2)
        for picture in seen:
            texts(picture)
        plain = self.d.render(self.scene, dict(REFINED, exposure_ev=3), fresh=False).body
        with open(path, "rb") as file:
            self.assertEqual(file.read(), plain)
        self.assertFalse(os.path.exists(path + ".part"))
        piped = subprocess.run(command + ["-"], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
                               check=True)
        self.assertEqual(piped.stdout, plain)

    def test_command_line_and_errors(self):
        """The best picture stays, and what went wrong is said."""
        daemon = Daemon("--client-share=0")
        self.addCleanup(daemon.kill)
        scene = daemon.upload(grid_scene(4))
        path = os.path.join(daemon.folder, "better.png")
        client = subprocess.Popen(
            [os.path.join(harness.BIN, "penumbra"), "render", scene, "--server",
             "http://127.0.0.1:%d" % daemon.port, "--json", "-", "-o", path],
            stdin=subprocess.PIPE, stderr=subprocess.PIPE)
        client.stdin.write(json.dumps(dict(ENDLESS, progressive=True)).encode())
        client.stdin.close()
        wait(lambda: os.path.exists(path))
        kill_workers(daemon, lambda: client.poll() is not None)
        said = client.stderr.read()
        client.stderr.close()
        self.assertEqual(client.returncode, 4, said)
        self.assertIn(b"ends the renderer", said)
        with open(path, "rb") as file:
            texts(file.read())

    def test_slow_readers(self):
        """One that reads next to nothing gets next to no pictures, and nothing piles up for it."""
        request = dict(REFINED, width=320, height=240)
        fast = self.open(request)
        parts, _ = split(fast.head().headers, b"".join(fast.chunks()))
        few = self.open(request, buffer=4096)
        other = 0
        while self.running() != 0 or other < 3:
            few.socket.recv(1, socket.MSG_PEEK)
            other += self.running() == 0
            time.sleep(0.1)
        # Its render has ended. What was begun for it is sent whole, and then the end.
        slow, closed = split(few.head().headers, b"".join(few.chunks()))
        self.assertTrue(closed)
        self.assertLessEqual(len(slow), 3)
        self.assertLessEqual(len(slow), len(parts))
        self.assertEqual(slow[-1][1], parts[-1][1])

    def test_many_that_never_read(self):
        """They hold what any connection holds; others are served; all is free when they leave."""
        request = dict(REFINED, width=320, height=240, exposure_ev=2)
        self.d.render(self.scene, request)
        descriptors = lambda: len(os.listdir("/proc/%d/fd" % self.d.process.pid))
        held = []
        for _ in range(6):
            readers = [self.open(request, buffer=4096, fresh=False) for _ in range(150)]
            wait(lambda: descriptors() >= 150)
            answer = self.d.render(self.scene, dict(REFINED, technique="hard"))
            self.assertEqual(answer.status, 200)
            held.append(self.memory())
            for reader in readers:
                reader.close()
            wait(lambda: descriptors() < 120)
        self.assertLess(held[-1], held[2] * 1.3)  # the allocator's share is in the first rounds

    def memory(self):
        with open("/proc/%d/status" % self.d.process.pid) as status:
            return int(re.search(r"RssAnon:\s+(\d+)", status.read())[1])


if __name__ == "__main__":
    harness.main()
