"""Calls against a server of our own: what is tried again, when, how often, and what an error is."""
import datetime
import email.utils
import http.server
import json
import pickle
import socket
import threading
import unittest
from unittest import mock

from wheel import harness, penumbra

PROBLEM = "application/problem+json"


class Server:
    """Answers with what a list says, one after the other, and keeps what it was asked. None: breaks
    the connection off without an answer."""

    def __init__(self, *answers, keep=True):
        self.answers, self.asked, self.lock = list(answers), [], threading.Lock()
        outer = self

        class Handler(http.server.BaseHTTPRequestHandler):
            protocol_version = "HTTP/1.1" if keep else "HTTP/1.0"

            def reply(self):
                size = int(self.headers.get("Content-Length") or 0)
                body = self.rfile.read(size)
                with outer.lock:
                    outer.asked.append((self.command, self.path, dict(self.headers), body))
                    answer = outer.answers.pop(0) if len(outer.answers) > 1 else outer.answers[0]
                if answer is None:
                    self.close_connection = True
                    return
                status, headers, body = answer
                body = body if isinstance(body, bytes) else json.dumps(body).encode()
                self.send_response(status)
                for name, value in {"Content-Type": "application/json", "Content-Length": len(body),
                                    **headers}.items():
                    self.send_header(name, str(value))
                self.end_headers()
                self.wfile.write(body)

            do_GET = do_POST = do_PUT = do_DELETE = reply

            def log_message(self, *_):
                pass

        self.server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self.server.daemon_threads = True
        self.port = self.server.server_port
        self.thread = threading.Thread(target=self.server.serve_forever, args=(0.02,))
        self.thread.start()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.server.shutdown()
        self.thread.join()
        self.server.server_close()

    def client(self, path="", **settings):
        return penumbra.Client("http://127.0.0.1:%d%s" % (self.port, path),
                               **{"timeout": 60 * harness.PATIENCE, **settings})


def problem(status, retryable, **headers):
    headers = {k.replace("_", "-"): v for k, v in headers.items()}
    return status, {"Content-Type": PROBLEM, **headers}, {
        "type": "about:blank", "title": "Not now", "status": status, "detail": "It is full.",
        "pointer": "/width", "retryable": retryable, "request_id": "abc"}


class Again(unittest.TestCase):
    def setUp(self):
        self.slept = []
        patch = mock.patch("penumbra._http.time.sleep", self.slept.append)
        patch.start()
        self.addCleanup(patch.stop)

    def test_retry_after(self):
        """Not before it says, and not all at the same moment."""
        with Server(problem(503, True, Retry_After=7), problem(429, True, Retry_After=3),
                    (200, {}, {"renders": 1})) as server, server.client() as client:
            self.assertEqual(client.stats(), {"renders": 1})
        self.assertEqual(len(server.asked), 3)
        self.assertEqual([int(s // 1) for s in self.slept], [7, 3])
        self.assertTrue(all(s != int(s) for s in self.slept))

    def test_retry_after_is_a_date(self):
        then = datetime.datetime.now(datetime.timezone.utc) + datetime.timedelta(seconds=3000)
        with Server(problem(503, True, Retry_After=email.utils.format_datetime(then, True)),
                    (200, {}, {})) as server, server.client(retry_for=1e6) as client:
            client.stats()
        self.assertTrue(1000 < self.slept[0] < 3010, self.slept)

    def test_without_retry_after_pauses_double(self):
        with Server(problem(503, True)) as server, server.client() as client:
            with self.assertRaises(penumbra.Busy) as caught:
                client.stats()
        self.assertEqual(len(server.asked), 5)
        for i, pause in enumerate(self.slept):
            self.assertTrue(0.5 <= pause / (0.25 * 2 ** i) <= 1, self.slept)
        error = caught.exception
        self.assertEqual((error.status, error.title, error.detail, error.pointer, error.retryable,
                          error.request_id, error.retry_after),
                         (503, "Not now", "It is full.", "/width", True, "abc", None))
        copy = pickle.loads(pickle.dumps(error))
        self.assertEqual((type(copy), str(copy)), (penumbra.Busy, str(error)))

    def test_no_longer_than_allowed(self):
        with Server(problem(503, True, Retry_After=61)) as server, server.client() as client:
            with self.assertRaises(penumbra.Busy) as caught:
                client.stats()
        self.assertEqual((len(server.asked), self.slept, caught.exception.retry_after), (1, [], 61))

    def test_only_what_may_succeed(self):
        for answer, kind in ((problem(422, False), penumbra.Invalid),
                             (problem(404, False), penumbra.NotFound),
                             (problem(403, False), penumbra.Denied),
                             (problem(503, False), penumbra.Busy),
                             (problem(504, True), penumbra.DeadlinePassed),
                             (problem(500, False), penumbra.Problem)):
            with Server(answer) as server, server.client() as client:
                self.assertRaises(kind, client.stats)
            self.assertEqual((len(server.asked), self.slept), (1, []))

    def test_what_proxies_say(self):
        """HTML, without anything that we know."""
        with Server((502, {"Content-Type": "text/html"}, b"<h1>Bad gateway</h1>"),
                    (200, {}, {"a": 1})) as server, server.client() as client:
            self.assertEqual(client.stats(), {"a": 1})
        with Server((418, {"Content-Type": "text/html"}, b"<h1>no</h1>")) as server, \
                server.client() as client:
            with self.assertRaises(penumbra.Problem) as caught:
                client.stats()
        self.assertEqual((caught.exception.status, caught.exception.detail), (418, "<h1>no</h1>"))
        with Server((200, {"Content-Type": "text/html"}, b"<h1>hello</h1>")) as server, \
                server.client() as client:
            self.assertRaises(penumbra.PenumbraError, client.stats)

    def test_kept_connection_that_has_ended(self):
        """It is no failure: nobody waits, and nothing counts."""
        with Server((200, {}, {}), None, (200, {}, {"b": 2})) as server, \
                server.client(retries=0) as client:
            client.stats()
            self.assertEqual(client.stats(), {"b": 2})
        self.assertEqual(self.slept, [])

    def test_broken_connection(self):
        with Server(None, None, (200, {}, {"c": 3})) as server, server.client() as client:
            self.assertEqual(client.stats(), {"c": 3})
        self.assertEqual(len(self.slept), 2)

    def test_nobody_there(self):
        with socket.socket() as s:
            s.bind(("127.0.0.1", 0))
            with penumbra.Client("http://127.0.0.1:%d" % s.getsockname()[1], retries=2) as client:
                with self.assertRaises(penumbra.Unreachable) as caught:
                    client.stats()
        self.assertIsInstance(caught.exception, ConnectionError)
        self.assertEqual(len(self.slept), 2)

    def test_silence(self):
        with socket.create_server(("127.0.0.1", 0)) as s:
            with penumbra.Client("http://127.0.0.1:%d" % s.getsockname()[1], retries=0,
                                 timeout=0.2) as client:
                self.assertRaises(penumbra.Unreachable, client.stats)

    def test_a_job_is_started_once(self):
        scene = {"id": "a" * 64, "triangles": 1}
        job = (202, {}, {"id": "b" * 64, "state": "accepted", "kind": "render", "progress": 0})
        with Server((200, {}, scene), None, None, job) as server, server.client() as client:
            client.scene("a" * 64).render_job(width=3)
        keys = {headers["Idempotency-Key"] for _, _, headers, _ in server.asked[1:]}
        self.assertEqual((len(server.asked), len(keys)), (4, 1))

    def test_upload_that_is_refused_unread(self):
        """The server says why and closes, while the client still sends."""
        body = json.dumps({"title": "Too big", "status": 413, "detail": "", "retryable": False})
        missing = "HTTP/1.1 404 x\r\nContent-Length: 2\r\nConnection: close\r\n\r\n{}"
        refused = "HTTP/1.1 413 x\r\nContent-Length: %d\r\nConnection: close\r\n\r\n%s" % (
            len(body), body)

        def serve(listener):
            for answer in (missing, refused):
                connection, _ = listener.accept()
                with connection:
                    connection.recv(4096)
                    connection.sendall(answer.encode())
                    connection.shutdown(socket.SHUT_WR)
                    while connection.recv(1 << 20):
                        pass

        with socket.create_server(("127.0.0.1", 0)) as s:
            thread = threading.Thread(target=serve, args=(s,))
            thread.start()
            with penumbra.Client("http://127.0.0.1:%d" % s.getsockname()[1], retries=0) as client:
                with self.assertRaises(penumbra.Invalid) as caught:
                    client.upload(b"glTF" + bytes(3 << 20))
            thread.join()
        self.assertEqual(caught.exception.status, 413)


class Broken(unittest.TestCase):
    """Pictures that get better, from a server that breaks off or fails under way."""

    def progressive(self, events, whole=True):
        scene = (200, {}, {"id": "a" * 64, "triangles": 1})
        picture = (200, {"Content-Type": "image/png"}, b"\x89PNG")
        record = json.dumps({"image": {"href": "/v1/results/x"}})
        text = "".join("event: %s\ndata: %s\n\n" % (kind, data or record)
                       for kind, data in events).encode()
        stream = (200, {"Content-Type": "text/event-stream", **(
            {} if whole else {"Content-Length": len(text) + 100})}, text)
        with Server(scene, stream, picture, keep=whole) as server, \
                server.client(retries=0) as client:
            got = []
            try:
                for picture in client.scene("a" * 64).progressive(width=3):
                    got.append(picture.final)
            except penumbra.PenumbraError as error:
                return got, error
            return got, None

    def test_breaks_off(self):
        for whole in (True, False):
            got, error = self.progressive([("picture", ""), ("picture", "")], whole)
            self.assertEqual((got, type(error)), ([False, False], penumbra.Unreachable))

    def test_done(self):
        self.assertEqual(self.progressive([("picture", ""), ("done", "")]), ([False, True], None))

    def test_fails(self):
        problem = json.dumps({"title": "Late", "status": 504, "detail": "", "retryable": True})
        got, error = self.progressive([("picture", ""), ("problem", problem)])
        self.assertEqual((got, type(error)), ([False], penumbra.DeadlinePassed))


class Calls(unittest.TestCase):
    def test_pages(self):
        pages = [(200, {}, {"scenes": [{"id": c * 64} for c in page], "total": 3, **more})
                 for page, more in (("ab", {"next": "/v1/scenes?after=x&limit=2"}), ("c", {}))]
        with Server(*pages) as server, server.client() as client:
            scenes = client.scenes()
            self.assertEqual(next(scenes).id, "a" * 64)
            self.assertEqual(len(server.asked), 1)  # the next page when it is needed
            self.assertEqual([s.id[0] for s in scenes], ["b", "c"])
        self.assertEqual([path for _, path, _, _ in server.asked],
                         ["/v1/scenes", "/v1/scenes?after=x&limit=2"])

    def test_below_a_path(self):
        """Links are followed through the proxy, whether they know of it or not."""
        for link in ("/tools/p/v1/jobs?after=x", "/v1/jobs?after=x",
                     "https://elsewhere.example/tools/p/v1/jobs?after=x"):
            with Server((200, {}, {"jobs": [], "next": link}), (200, {}, {"jobs": []})) as server, \
                    server.client("/tools/p/") as client:
                self.assertEqual(list(client.jobs("failed")), [])
            self.assertEqual([path for _, path, _, _ in server.asked],
                             ["/tools/p/v1/jobs?state=failed", "/tools/p/v1/jobs?after=x"])

    def test_token_and_server_from_the_environment(self):
        with Server((200, {}, {})) as server:
            with mock.patch.dict("os.environ", {
                    "PENUMBRA_SERVER": "127.0.0.1:%d" % server.port, "PENUMBRA_TOKEN": "secret"}):
                for settings in ({}, {"token": "other"}, {"token": ""}):
                    with penumbra.Client(**settings) as client:
                        client.stats()
        self.assertEqual([h.get("Authorization") for _, _, h, _ in server.asked],
                         ["Bearer secret", "Bearer other", None])

    def test_addresses_that_are_none(self):
        for url in ("ftp://x", "http://", "http://x/?a=b"):
            self.assertRaises(ValueError, penumbra.Client, url)
        self.assertRaises(ValueError, penumbra.Client, "http://x", "two words\r\nX: y")

    def test_threads(self):
        with Server((200, {}, {"d": 4})) as server, server.client() as client:
            right = []
            threads = [threading.Thread(target=lambda: right.extend(
                client.stats() == {"d": 4} for _ in range(25))) for _ in range(8)]
            for thread in threads:
                thread.start()
            for thread in threads:
                thread.join()
        self.assertEqual((len(right), all(right), len(server.asked)), (200, True, 200))

    def test_closed(self):
        with Server((200, {}, {})) as server:
            client = server.client()
            client.stats()
            client.close()
            self.assertRaises(penumbra.PenumbraError, client.stats)

    def test_events_are_parsed(self):
        text = (b": hello\nretry: 40\n\nid: 1\nevent: state\ndata: {\"a\":\ndata: 1}\n\n"
                b"data: 2\r\n\r\nevent: nothing\n\nid:3\nevent:x\ndata:[]\n\ndata: {}")
        from penumbra._events import parse
        self.assertEqual(list(parse(text.splitlines(True))), [
            0.04, ("1", "state", {"a": 1}), ("1", "message", 2), ("3", "x", [])])


if __name__ == "__main__":
    harness.main()
