"""Clients that keep a service's places for little: they send headers or bodies, or read answers, a few
bytes at a time, from many addresses of the loopback network, and come again when they are put out."""
import multiprocessing
import socket
import time

KINDS = ("header", "body", "read")
STEP_S = 0.2  # between two of a client's bytes


class Slow:
    """One of them."""
    def __init__(self, port, address, kind, scene):
        self.port, self.address, self.kind, self.scene = port, address, kind, scene
        self.socket = None
        self.put_out = -1  # times that it was

    def begin(self):
        """What it sends at once; the rest comes byte by byte."""
        host = b"Host: x\r\n"
        if self.kind == "header":
            return b"GET /v1 HTTP/1.1\r\n" + host + b"X: "
        if self.kind == "body":
            return (b"POST /v1/scenes/%s/render HTTP/1.1\r\n" % self.scene.encode() + host +
                    b"Content-Length: 60000\r\n\r\n{")
        return (b"GET /openapi.json HTTP/1.1\r\n" + host + b"\r\n") * 8

    def connect(self):
        self.put_out += 1
        self.socket = socket.socket()
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        self.socket.setblocking(False)
        self.socket.bind((self.address, 0))
        self.socket.connect_ex(("127.0.0.1", self.port))
        self.begun = False
        self.due = time.monotonic()

    def step(self):
        """A byte; False: it was put out."""
        try:
            if not self.begun:
                self.socket.send(self.begin())
                self.begun = True
            elif self.kind == "read":
                return self.socket.recv(64) != b""
            else:
                self.socket.send(b" ")
                try:
                    if self.socket.recv(4096) is not None:
                        return False  # an answer: a refusal
                except BlockingIOError:
                    pass
        except BlockingIOError:
            pass
        except OSError as error:
            return error.errno == 107 and not self.begun  # not connected yet
        return True


def run(port, scene, count, addresses, ready, over, put_out):
    clients = [Slow(port, "127.0.0.%d" % (2 + i % addresses), KINDS[i % 3], scene)
               for i in range(count)]
    for client in clients:
        client.connect()
    began = time.monotonic()
    while not over.is_set():
        now = time.monotonic()
        for client in clients:
            if client.due > now:
                continue
            client.due = now + STEP_S
            if not client.step():
                client.socket.close()
                client.connect()
        if now - began > 3 * STEP_S:
            ready.set()
        time.sleep(0.02)
    put_out.value = sum(client.put_out for client in clients)
    for client in clients:
        client.socket.close()


class Swarm:
    """`count` of them, a third of each kind, from `addresses` addresses, in a process of their own."""
    def __init__(self, port, scene, count, addresses=20):
        self.ready, self.over = multiprocessing.Event(), multiprocessing.Event()
        self.put_out = multiprocessing.Value("q", 0)
        self.process = multiprocessing.Process(target=run, daemon=True, args=(
            port, scene, count, addresses, self.ready, self.over, self.put_out))

    def __enter__(self):
        self.process.start()
        self.ready.wait()
        return self

    def __exit__(self, *_):
        self.over.set()
        self.process.join()
