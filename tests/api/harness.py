"""A daemon of one's own on free ports with a store of its own, and what tests need to talk to it."""
import atexit
import contextlib
import http.client
import json
import os
import re
import shutil
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import time
import unittest
import zlib

import schema

BIN = os.environ.get("PENUMBRA_BIN") or os.path.join(os.path.dirname(__file__), "../../build/dev/bin")
# Sanitizers slow everything down, and so does a busy machine: how long silence is waited for.
SLOW = float(os.environ.get("PENUMBRA_TEST_SLOWNESS", "1"))
# What only tells a hang from slowness is widened much more: a pass does not wait for it.
PATIENCE = 10 * SLOW
SLOW *= min(8, max(1, os.getloadavg()[0] / (os.cpu_count() or 1)))


class Answer:
    def __init__(self, status, headers, body):
        self.status, self.headers, self.body = status, headers, body

    def json(self):
        return json.loads(self.body)

    def timing(self):
        """Server-Timing as a dict of milliseconds."""
        return {k: float(v) for k, v in
                re.findall(r"([\w-]+);dur=([\d.]+)", self.headers.get("Server-Timing", ""))}


class Daemon:
    contract = None  # the OpenAPI document, from the first daemon: all are of one build

    def __init__(self, *flags, store=None, env=None, start=True):
        self.folder = tempfile.mkdtemp(prefix="penumbra-test-")
        self.store = store or os.path.join(self.folder, "store")
        self.flags = list(flags)
        self.env = env or {}
        self.process = None
        atexit.register(self.kill)
        if start:
            self.start()

    def start(self, descriptors=None):
        """`descriptors`: how many the daemon and its children may have each."""
        if self.process:
            self.process.stdout.close()
        self.log_path = os.path.join(self.folder, "log-%f" % time.time())
        flags = {"--listen": "127.0.0.1:0", "--admin-listen": "127.0.0.1:0", "--store": self.store,
                 "--warm-up": "off", "--silence-timeout-ms": "3600000"}
        extra = []
        for flag in self.flags:
            name = flag.split("=")[0]
            flags.pop(name, None)
            extra.append(flag)
        limit = ["prlimit", "--nofile=%d" % descriptors] if descriptors else []
        command = limit + [os.path.join(BIN, "penumbrad")] + ["%s=%s" % f for f in flags.items()] + extra
        with open(self.log_path, "wb") as log:
            self.process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=log,
                                            env={**os.environ, **self.env})
        line = self.process.stdout.readline().decode()
        match = re.search(r"://([\d.]+):(\d+) \(admin: http://([\d.]+):(\d+)\)", line)
        if not match:
            self.process.wait(20 * PATIENCE)
            raise RuntimeError("the daemon did not start: " + self.log())
        self.port, self.admin_port = int(match[2]), int(match[4])
        if not Daemon.contract and line.startswith("penumbrad") and "http://" in line.split()[4]:
            Daemon.contract = schema.Document(self.exchange("GET", "/openapi.json").json())
        return self

    def log(self):
        with open(self.log_path, errors="replace") as log:
            return log.read()

    def call(self, method, path, body=None, headers=None, port=None, timeout=60):
        """The answer, once it is what the OpenAPI document says."""
        answer = self.exchange(method, path, body, headers, port, timeout)
        if (port or self.port) == self.port and Daemon.contract:
            Daemon.contract.check(method, path, answer)
        return answer

    def exchange(self, method, path, body=None, headers=None, port=None, timeout=60):
        connection = http.client.HTTPConnection("127.0.0.1", port or self.port,
                                                timeout=timeout * PATIENCE)
        try:
            connection.request(method, path, body, headers or {})
            response = connection.getresponse()
            return Answer(response.status, response.headers, response.read())
        finally:
            connection.close()

    def get(self, path, **headers):
        return self.call("GET", path, headers={k.replace("_", "-"): v for k, v in headers.items()})

    def admin(self, path):
        return self.call("GET", path, port=self.admin_port)

    def upload(self, data, kind="model/gltf-binary"):
        answer = self.call("POST", "/v1/scenes", data, {"Content-Type": kind})
        if answer.status not in (200, 201):
            raise AssertionError("upload: %d %s" % (answer.status, answer.body))
        return answer.json()["id"]

    def render(self, scene, request=None, fresh=True, timeout=60, **headers):
        """POST with the fields of `request`; `fresh` passes the result cache by."""
        head = {"Content-Type": "application/json"}
        if fresh:
            head["Cache-Control"] = "no-cache"
        request = {"deadline_ms": int(30000 * PATIENCE), **(request or {})}
        head.update({k.replace("_", "-"): v for k, v in headers.items()})
        return self.call("POST", "/v1/scenes/%s/render" % scene, json.dumps(request), head,
                         timeout=timeout)

    def metric(self, name, labels=""):
        match = re.search(r"^%s%s (\S+)$" % (re.escape(name), re.escape(labels)),
                          self.admin("/metrics").body.decode(), re.M)
        return float(match[1]) if match else None

    def processor_s(self):
        """Processor time of the daemon itself."""
        with open("/proc/%d/stat" % self.process.pid) as f:
            after = f.read().rsplit(")", 1)[1].split()
        return (int(after[11]) + int(after[12])) / os.sysconf("SC_CLK_TCK")

    def children(self, name):
        pids = []
        for pid in filter(str.isdigit, os.listdir("/proc")):
            try:
                with open("/proc/%s/stat" % pid) as f:
                    stat = f.read()
                with open("/proc/%s/cmdline" % pid) as f:
                    command = f.read().split("\0")[0]
            except OSError:
                continue
            after = stat.rsplit(")", 1)[1].split()
            if int(after[1]) == self.process.pid and after[0] != "Z" and name in command:
                pids.append(int(pid))
        return pids

    def worker(self):
        """The pid of a worker that takes jobs."""
        return wait(lambda: self.metric("penumbra_workers_up") == 1 and
                    self.children("penumbra-worker"))[0]

    @contextlib.contextmanager
    def paused(self):
        """Within it the worker stands still: what is asked for stays under way or in the queue,
        however fast or slow the machine is."""
        pid = self.worker()
        os.kill(pid, signal.SIGSTOP)
        try:
            yield
        finally:
            os.kill(pid, signal.SIGCONT)

    def leftovers(self):
        return os.listdir(os.path.join(self.store, "tmp"))

    def stop(self, timeout=30):
        """SIGTERM; returns the exit status."""
        self.process.send_signal(signal.SIGTERM)
        return self.process.wait(timeout * PATIENCE)

    def kill(self):
        if self.process and self.process.poll() is None:
            self.process.kill()
            self.process.wait()
        if self.process and self.process.stdout:
            self.process.stdout.close()
        if os.environ.get("PENUMBRA_TEST_KEEP") is None:
            shutil.rmtree(self.folder, ignore_errors=True)


def wait(condition, seconds=20, step=0.02):
    """Waits until the condition holds and returns its value; fails when it never does."""
    end = time.monotonic() + seconds * PATIENCE
    while True:
        value = condition()
        if value:
            return value
        if time.monotonic() > end:
            raise AssertionError("waited in vain")
        time.sleep(step)


def raw(port, data, timeout=10, half_close=False):
    """Sends bytes and returns everything that comes until the peer closes or is silent."""
    with socket.create_connection(("127.0.0.1", port), timeout=timeout * SLOW) as s:
        try:
            s.sendall(data)
            if half_close:
                s.shutdown(socket.SHUT_WR)
        except OSError:
            pass
        got = b""
        try:
            while True:
                piece = s.recv(65536)
                if not piece:
                    return got, True
                got += piece
        except socket.timeout:
            return got, False
        except ConnectionResetError:
            return got, True


def glb(document, binary=b""):
    """A glTF binary file."""
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    binary += b"\0" * (-len(binary) % 4)
    chunks = struct.pack("<II", len(text), 0x4E4F534A) + text
    if binary:
        chunks += struct.pack("<II", len(binary), 0x004E4942) + binary
    return struct.pack("<III", 0x46546C67, 2, 12 + len(chunks)) + chunks


def grid_scene(n=1, name="grid"):
    """A square of 2 n^2 triangles half a metre above the origin; the name makes the bytes unique."""
    points, indices = [], []
    for j in range(n + 1):
        for i in range(n + 1):
            points.append((i / n - 0.5, 0.5, j / n - 0.5))
    for j in range(n):
        for i in range(n):
            a = j * (n + 1) + i
            indices += [a, a + n + 1, a + 1, a + 1, a + n + 1, a + n + 2]
    vertex = b"".join(struct.pack("<3f", *p) for p in points)
    index = struct.pack("<%dI" % len(indices), *indices)
    return glb({
        "asset": {"version": "2.0", "generator": name}, "scene": 0, "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": len(points), "type": "VEC3",
             "min": [-0.5, 0.5, -0.5], "max": [0.5, 0.5, 0.5]},
            {"bufferView": 1, "componentType": 5125, "count": len(indices), "type": "SCALAR"}],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": len(vertex)},
            {"buffer": 0, "byteOffset": len(vertex), "byteLength": len(index)}],
        "buffers": [{"byteLength": len(vertex) + len(index)}]}, vertex + index)


def png(width, height):
    rows = b"".join(b"\0" + bytes(v for x in range(width) for v in (x % 256, y % 256, 90))
                    for y in range(height))
    chunk = lambda kind, data: (struct.pack(">I", len(data)) + kind + data +
                                struct.pack(">I", zlib.crc32(kind + data)))
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)) +
            chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b""))


SMALL = {"technique": {"name": "hard"}, "width": 64, "height": 48}
IN_TURNS = 4  # renders of one client that a worker takes at a time
# Takes a worker a good while: for tests that need one under way.
HEAVY = {"technique": {"name": "multisample", "params": {"samples": 64}}, "width": 800, "height": 600}


def main():
    unittest.main(verbosity=1, failfast=bool(os.environ.get("PENUMBRA_TEST_FAILFAST")))
