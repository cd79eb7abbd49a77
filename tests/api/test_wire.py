"""Bytes that are no HTTP, or that the next proxy would read otherwise: each is refused once, with a
problem document, and the connection ends; in one piece, byte by byte, and over TLS."""
import json
import re
import socket
import ssl
import subprocess
import time
import unittest
import zlib

import harness
from harness import PATIENCE, SMALL, Daemon, grid_scene, raw

HOST = b"Host: x\r\n"
# What an attacker would want to have run as a request of its own.
SMUGGLED = b"GET /v1/techniques HTTP/1.1\r\nHost: x\r\n\r\n"
GET = b"GET /v1 HTTP/1.1\r\n"
CLOSE = b"Connection: close\r\n"

# Header bytes that are refused, and with what.
HEADERS = {
    "bare LF": (b"GET /v1 HTTP/1.1\nHost: x\n\n", 400),
    "bare LF behind the request line": (b"GET /v1 HTTP/1.1\nHost: x\r\n\r\n", 400),
    "bare LF behind a header": (GET + b"Host: x\nA: b\r\n\r\n", 400),
    "bare LF as the end": (GET + HOST + b"\n", 400),
    "bare CR": (GET + b"Host: x\rA: b\r\n\r\n", 400),
    "CR CR LF": (GET + b"Host: x\r\r\n\r\n", 400),
    "folded": (GET + HOST + b"A: b\r\n c\r\n\r\n", 400),
    "folded by a tab": (GET + HOST + b"A: b\r\n\tc\r\n\r\n", 400),
    "begins folded": (GET + b" " + HOST + b"\r\n", 400),
    "a line of blanks": (GET + HOST + b" \r\n\r\n", 400),
    "NUL in a value": (GET + HOST + b"A: b\0c\r\n\r\n", 400),
    "NUL in a name": (GET + HOST + b"A\0: b\r\n\r\n", 400),
    "NUL in Host": (GET + b"Host: x\0y\r\n\r\n", 400),
    "NUL in the target": (b"GET /v1\0/x HTTP/1.1\r\n" + HOST + b"\r\n", 400),
    "NUL in the method": (b"G\0T /v1 HTTP/1.1\r\n" + HOST + b"\r\n", 400),
    "control character in a value": (GET + HOST + b"A: b\x01c\r\n\r\n", 400),
    "DEL in a value": (GET + HOST + b"A: b\x7fc\r\n\r\n", 400),
    "escape in the target": (b"GET /v1\x1b HTTP/1.1\r\n" + HOST + b"\r\n", 400),
    "8 bit in the target": (b"GET /v1\xe9 HTTP/1.1\r\n" + HOST + b"\r\n", 400),
    "tab in the request line": (b"GET\t/v1\tHTTP/1.1\r\n" + HOST + b"\r\n", 400),
    "two blanks in the request line": (b"GET  /v1 HTTP/1.1\r\n" + HOST + b"\r\n", 400),
    "a blank too many behind": (b"GET /v1  HTTP/1.1\r\n" + HOST + b"\r\n", 400),
    "blank behind the version": (b"GET /v1 HTTP/1.1 \r\n" + HOST + b"\r\n", 400),
    "blank before the method": (b" GET /v1 HTTP/1.1\r\n" + HOST + b"\r\n", 400),
    "blank in the target": (b"GET /v1 /x HTTP/1.1\r\n" + HOST + b"\r\n", 400),
    "fragment": (b"GET /v1#x HTTP/1.1\r\n" + HOST + b"\r\n", 400),
    "no target": (b"GET HTTP/1.1\r\n" + HOST + b"\r\n", 400),
    "HTTP/0.9": (b"GET /v1\r\n\r\n", 400),
    "HTTP/2.0": (b"GET /v1 HTTP/2.0\r\n" + HOST + b"\r\n", 400),
    "HTTP/2's preface": (b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n", 400),
    "HTTP/1.2": (b"GET /v1 HTTP/1.2\r\n" + HOST + b"\r\n", 400),
    "http/1.1": (b"GET /v1 http/1.1\r\n" + HOST + b"\r\n", 400),
    "HTTP/1.10": (b"GET /v1 HTTP/1.10\r\n" + HOST + b"\r\n", 400),
    "HTTP/01.1": (b"GET /v1 HTTP/01.1\r\n" + HOST + b"\r\n", 400),
    "method with a colon": (b"GE:T /v1 HTTP/1.1\r\n" + HOST + b"\r\n", 400),
    "method with a bracket": (b"G[T /v1 HTTP/1.1\r\n" + HOST + b"\r\n", 400),
    "no method": (b"/v1 HTTP/1.1\r\n" + HOST + b"\r\n", 400),
    "CONNECT": (b"CONNECT a:80 HTTP/1.1\r\n" + HOST + b"\r\n", 400),
    "TLS where none is": (b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03\r\n\r\n", 400),
    "method without an end": (b"G" * 200 + b" /v1 HTTP/1.1\r\n" + HOST + b"\r\n", 400),
    "blank before a colon": (GET + HOST + b"A : b\r\n\r\n", 400),
    "tab before a colon": (GET + HOST + b"A\t: b\r\n\r\n", 400),
    "header without a colon": (GET + HOST + b"A\r\n\r\n", 400),
    "header without a name": (GET + HOST + b": b\r\n\r\n", 400),
    "8 bit in a name": (GET + HOST + b"A\xe9: b\r\n\r\n", 400),
    "no Host": (GET + b"\r\n", 400),
    "a whole URI without a host": (b"GET http:///v1 HTTP/1.1\r\n" + HOST + b"\r\n", 400),
    "a whole URI with a password": (b"GET http://a:b@x/v1 HTTP/1.1\r\n" + HOST + b"\r\n", 400),
    "a whole URI of something else": (b"GET ftp://x/v1 HTTP/1.1\r\n" + HOST + b"\r\n", 400),
    "* for one address": (b"GET * HTTP/1.1\r\n" + HOST + b"\r\n", 400),
    "two keys of a request": (GET + HOST + b"Idempotency-Key: a\r\nidempotency-key: b\r\n\r\n", 400),
    "two tokens": (GET + HOST + b"Authorization: Bearer a\r\nAuthorization: Bearer b\r\n\r\n", 400),
    "two types": (GET + HOST + b"Content-Type: a/b\r\nContent-Type: a/b\r\n\r\n", 400),
    "two origins": (GET + HOST + b"Origin: http://x\r\nOrigin: http://y\r\n\r\n", 400),
    "a target of 8,193 bytes": (b"GET /v1?" + b"a" * 8189 + b" HTTP/1.1\r\n" + HOST + b"\r\n", 414),
    "101 headers": (GET + HOST + b"A: b\r\n" * 100 + b"\r\n", 431),
    "two Hosts": (GET + HOST + b"Host: y\r\n\r\n", 400),
    "the same Host twice": (GET + HOST + HOST + b"\r\n", 400),
    "two Hosts in one": (GET + b"Host: x y\r\n\r\n", 400),
    "a list of Hosts": (GET + b"Host: x/y\r\n\r\n", 400),
    "two Hosts in HTTP/1.0": (b"GET /v1 HTTP/1.0\r\n" + HOST + b"Host: y\r\n\r\n", 400),
    "three empty lines before": (b"\r\n\r\n\r\n" + GET + HOST + b"\r\n", 400),
    "a target of 9 kB": (b"GET /" + b"a" * 9000 + b" HTTP/1.1\r\n" + HOST + b"\r\n", 414),
    "a request line without an end": (b"GET /" + b"a" * 100000, 414),
    "a header of 40 kB": (GET + HOST + b"A: " + b"a" * 40000 + b"\r\n\r\n", 431),
    "a header without an end": (GET + HOST + b"A: " + b"a" * 100000, 431),
    "headers of 40 kB": (GET + HOST + b"A: b" * 0 + b"".join(
        b"A%d: %s\r\n" % (i, b"a" * 600) for i in range(70)) + b"\r\n", 431),
    "2,000 headers": (GET + HOST + b"A:b\r\n" * 2000 + b"\r\n", 431),
}
# The lengths of a body.
LENGTHS = {
    "two": b"Content-Length: 2\r\nContent-Length: 40\r\n",
    "the same twice": b"Content-Length: 2\r\nContent-Length: 2\r\n",
    "a list": b"Content-Length: 2, 2\r\n",
    "a plus": b"Content-Length: +2\r\n",
    "a minus": b"Content-Length: -2\r\n",
    "hexadecimal": b"Content-Length: 0x2\r\n",
    "a letter": b"Content-Length: 2a\r\n",
    "a blank within": b"Content-Length: 2 2\r\n",
    "a fraction": b"Content-Length: 2.0\r\n",
    "nothing": b"Content-Length:\r\n",
    "in quotes": b"Content-Length: \"2\"\r\n",
    "beyond 64 bits": b"Content-Length: 18446744073709551618\r\n",
    "2^64 - 1": b"Content-Length: 18446744073709551615\r\n",
    "beyond 63 bits": b"Content-Length: 9223372036854775810\r\n",
    "of many digits": b"Content-Length: " + b"0" * 30 + b"2\r\n",
    "blank before the colon": b"Content-Length : 2\r\n",
    "with chunks": b"Content-Length: 2\r\nTransfer-Encoding: chunked\r\n",
    "behind chunks": b"Transfer-Encoding: chunked\r\nContent-Length: 2\r\n",
    "xchunked": b"Transfer-Encoding: xchunked\r\n",
    "identity": b"Transfer-Encoding: identity\r\nContent-Length: 2\r\n",
    "gzip, chunked": b"Transfer-Encoding: gzip, chunked\r\n",
    "chunked, chunked": b"Transfer-Encoding: chunked, chunked\r\n",
    "chunked twice": b"Transfer-Encoding: chunked\r\nTransfer-Encoding: chunked\r\n",
    "chunked in quotes": b"Transfer-Encoding: \"chunked\"\r\n",
    "chunked by a vertical tab": b"Transfer-Encoding: \x0bchunked\r\n",
    "chunked folded": b"Transfer-Encoding:\r\n chunked\r\n",
}
# What stands where chunks should.
CHUNKS = {
    "16 digits": b"0000000000000002\r\n{}\r\n0\r\n\r\n",
    "17 digits, around 2^64": b"10000000000000002\r\n{}\r\n0\r\n\r\n",
    "16 f": b"ffffffffffffffff\r\n{}\r\n0\r\n\r\n",
    "9 digits": b"000000002\r\n{}\r\n0\r\n\r\n",
    "a minus": b"-2\r\n{}\r\n0\r\n\r\n",
    "a plus": b"+2\r\n{}\r\n0\r\n\r\n",
    "0x": b"0x2\r\n{}\r\n0\r\n\r\n",
    "no number": b"zz\r\n{}\r\n0\r\n\r\n",
    "nothing": b"\r\n{}\r\n0\r\n\r\n",
    "a blank before": b" 2\r\n{}\r\n0\r\n\r\n",
    "bare LF": b"2\n{}\n0\n\n",
    "bare LF behind the data": b"2\r\n{}\n0\r\n\r\n",
    "bare CR": b"2\r{}\r0\r\r",
    "more than it says": b"1\r\n{}\r\n0\r\n\r\n",
    "less than it says": b"3\r\n{}\r\n0\r\n\r\n",
    "NUL in an extension": b"2;a=\0\r\n{}\r\n0\r\n\r\n",
    "LF in an extension": b"2;a=\nb\r\n{}\r\n0\r\n\r\n",
    "an extension without an end": b"2;" + b"a" * 4000,
    "a trailer without a colon": b"2\r\n{}\r\n0\r\nA\r\n\r\n",
    "a folded trailer": b"2\r\n{}\r\n0\r\nA: b\r\n c\r\n\r\n",
    "NUL in a trailer": b"2\r\n{}\r\n0\r\nA: \0\r\n\r\n",
    "bare LF in trailers": b"2\r\n{}\r\n0\r\nA: b\n\r\n",
}


def certificate(folder):
    """A key and a certificate for it, as files."""
    subprocess.run(["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2", "-subj",
                    "/CN=localhost", "-keyout", folder + "/key.pem", "-out", folder + "/cert.pem"],
                   check=True, capture_output=True)
    return folder + "/cert.pem", folder + "/key.pem"


def talk(sock, pieces):
    """Everything that comes until the peer closes."""
    got = b""
    try:
        for piece in pieces:
            sock.sendall(piece)
    except OSError:
        pass  # it may have hung up already, with an answer
    try:
        while piece := sock.recv(65536):
            got += piece
    except socket.timeout:
        return got, False
    except OSError:
        pass
    return got, True


class Wire(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.d = Daemon()
        cls.id = cls.d.upload(grid_scene(2))
        cls.post = b"POST /v1/scenes/%s/render HTTP/1.1\r\n" % cls.id.encode() + HOST

    @classmethod
    def tearDownClass(cls):
        assert cls.d.stop() == 0
        cls.d.kill()

    def tearDown(self):
        self.assertEqual(self.d.get("/v1").status, 200)

    def cases(self):
        for name, (request, status) in HEADERS.items():
            yield name, request, status
        for name, lengths in LENGTHS.items():
            yield "length: " + name, self.post + lengths + b"\r\n{}", 400
        for name, chunks in CHUNKS.items():
            yield "chunk: " + name, self.post + b"Transfer-Encoding: chunked\r\n\r\n" + chunks, 400

    def connect(self, port=None):
        return socket.create_connection(("127.0.0.1", port or self.d.port), timeout=10 * PATIENCE)

    def check_refusal(self, got, closed, status):
        """One answer, a problem document; nothing that followed was run."""
        self.assertTrue(closed, got[:200])
        head, _, body = got.partition(b"\r\n\r\n")
        self.assertTrue(head.startswith(b"HTTP/1.1 %d " % status), got[:300])
        self.assertEqual(len(re.findall(rb"HTTP/1\.\d \d\d\d ", got)), 1, got)
        self.assertIn(b"\r\nContent-Type: application/problem+json", head)
        self.assertIn(b"\r\nConnection: close", head)
        self.assertIn(b"\r\nContent-Length: %d\r\n" % len(body), head + b"\r\n")
        self.assertNotIn(b"<html", got.lower())
        document = json.loads(body)
        self.assertEqual(document["status"], status)
        self.assertRegex(document["request_id"], "^[0-9a-f]{32}$")

    def test_each_is_refused_once(self):
        for name, request, status in self.cases():
            with self.subTest(name):
                with self.connect() as s:
                    self.check_refusal(*talk(s, [request + SMUGGLED]), status)
        self.assertGreater(self.d.metric("penumbra_requests_malformed_total"), 50)

    def test_byte_by_byte(self):
        for name, request, status in self.cases():
            if len(request) > 400:
                continue
            with self.subTest(name):
                with self.connect() as s:
                    s.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                    self.check_refusal(*talk(s, [bytes([c]) for c in request + SMUGGLED]), status)

    def test_behind_a_good_request(self):
        good = b"GET /v1/techniques/none HTTP/1.1\r\n" + HOST + b"\r\n"
        for name, request, status in self.cases():
            with self.subTest(name):
                with self.connect() as s:
                    got, closed = talk(s, [good + request + SMUGGLED])
                    self.assertTrue(got.startswith(b"HTTP/1.1 200 "), got[:200])
                    second = got.index(b"HTTP/1.1 ", 10)
                    self.check_refusal(got[second:], closed, status)

    def test_over_tls(self):
        d = Daemon(start=False)
        cert, key = certificate(d.folder)
        d.flags += ["--tls-cert=" + cert, "--tls-key=" + key]
        d.start()
        context = ssl.create_default_context(cafile=cert)
        try:
            for name, request, status in self.cases():
                if b"render" in request:
                    request = request.replace(self.id.encode(), b"0" * 64)
                with self.subTest(name):
                    with context.wrap_socket(self.connect(d.port), server_hostname="localhost") as s:
                        got, closed = talk(s, [request + SMUGGLED])
                        # A body for a scene that is not there may be answered before it is read.
                        if not (name.startswith("chunk") and got.startswith(b"HTTP/1.1 404")):
                            self.check_refusal(got, closed, status)
            with context.wrap_socket(self.connect(d.port), server_hostname="localhost") as s:
                s.sendall(SMUGGLED + SMUGGLED.replace(b"\r\n\r\n", b"\r\nConnection: close\r\n\r\n"))
                got, closed = talk(s, [])
                self.assertEqual(got.count(b"HTTP/1.1 200 OK"), 2)
                self.assertTrue(closed)
            got, closed = raw(d.port, SMUGGLED)  # plain where TLS is expected
            self.assertTrue(closed)
        finally:
            self.assertEqual(d.stop(), 0)
            d.kill()

    def test_admin_listener(self):
        for name, request, status in self.cases():
            with self.subTest(name):
                with self.connect(self.d.admin_port) as s:
                    got, closed = talk(s, [request + SMUGGLED])
                    self.assertTrue(closed)
                    if not request.startswith(b"POST"):
                        self.check_refusal(got, closed, status)
        self.assertEqual(self.d.admin("/livez").status, 200)

    def test_what_is_right_stays_so(self):
        """Forms that are seldom seen, and allowed."""
        end = b"Connection: close\r\n\r\n"
        size = len(json.dumps(SMALL).encode())
        body = json.dumps(SMALL).encode()
        chunks = b"%X;a=\"b c\"\r\n" % size + body + b"\r\n000\r\nA: b\r\nC:\r\n\r\n"
        for name, request, status in (
                ("an empty line before", b"\r\n" + GET + HOST + end, 200),
                ("blanks around a value", GET + b"Host: \t x \t \r\n" + end, 200),
                ("no blank before a value", GET + b"Host:x\r\n" + end, 200),
                ("an empty value", GET + HOST + b"A:\r\n" + end, 200),
                ("8 bit in a value", GET + HOST + b"A: \xe9\r\n" + end, 200),
                ("a name of odd characters", GET + HOST + b"!#$%&'*+-.^_`|~1a: b\r\n" + end, 200),
                ("HTTP/1.0 without a Host", b"GET /v1 HTTP/1.0\r\n\r\n", 200),
                ("an address as Host", GET + b"Host: [::1]:80\r\n" + end, 200),
                ("a whole URI", b"GET http://x/v1 HTTP/1.1\r\n" + HOST + end, 200),
                ("a target of 8 kB", b"GET /v1?" + b"a" * 8000 + b" HTTP/1.1\r\n" + HOST + end, 200),
                ("a target of 8,192 bytes", b"GET /v1?" + b"a" * 8188 + b" HTTP/1.1\r\n" + HOST + end, 200),
                ("a thousand keys", b"GET /v1?" + b"a=1&" * 1000 + b" HTTP/1.1\r\n" + HOST + end, 200),
                ("8,000 keys", b"GET /v1?" + b"&" * 8000 + b" HTTP/1.1\r\n" + HOST + end, 200),
                ("a cookie of many", GET + HOST + b"Cookie: " + b"a=b;" * 6000 + b"\r\n" + end, 200),
                ("100 headers", GET + HOST + b"A: b\r\n" * 98 + end, 200),
                ("a whole URI without a path", b"GET http://x HTTP/1.1\r\n" + HOST + end, 200),
                ("a whole URI with a query", b"GET http://x?a=b HTTP/1.1\r\n" + HOST + end, 200),
                ("a whole URI for another Host", b"GET http://x/v1 HTTP/1.1\r\nHost: a.example\r\n" + end, 200),
                ("a whole URI of another name", b"GET http://evil.example/v1 HTTP/1.1\r\n" + HOST + end, 421),
                ("the service's options", b"OPTIONS * HTTP/1.1\r\n" + HOST + end, 204),
                ("an upgrade", GET + HOST + b"Upgrade: h2c\r\nConnection: Upgrade, close\r\n\r\n", 200),
                ("odd options of the connection", GET + HOST + b"Connection: , host,, transfer-encoding\r\n" +
                 end, 200),
                ("another expectation", self.post + b"Content-Length: %d\r\nExpect: tea\r\n" % size + end +
                 body, 200),
                ("an expectation in HTTP/1.0", self.post.replace(b"1.1", b"1.0") + b"Content-Length: %d\r\n"
                 % size + b"Expect: 100-continue\r\n" + end + body, 200),
                ("a header of 20 kB", GET + HOST + b"A: " + b"a" * 20000 + b"\r\n" + end, 200),
                ("90 headers", GET + HOST + b"A: b\r\n" * 90 + end, 200),
                ("no such method", b"BREW /v1 HTTP/1.1\r\n" + HOST + end, 405),
                ("OPTIONS", b"OPTIONS /v1 HTTP/1.1\r\n" + HOST + end, 405),
                ("TRACE", b"TRACE /v1 HTTP/1.1\r\n" + HOST + end, 405),
                ("length 0", GET + HOST + b"Content-Length: 0\r\n" + end, 200),
                ("length with zeros", self.post + b"Content-Length: 000%d\r\n" % size + end + body, 200),
                ("chunks, an extension, trailers",
                 self.post + b"Transfer-Encoding: Chunked\r\n" + end + chunks, 200),
                ("100-continue", self.post + b"Content-Length: %d\r\nExpect: 100-continue\r\n" % size +
                 end + body, 100)):
            with self.subTest(name):
                for pieces in ([request], [bytes([c]) for c in request]):
                    with self.connect() as s:
                        s.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                        got, closed = talk(s, pieces if len(request) < 1000 else [request])
                    self.assertTrue(re.match(rb"HTTP/1\.[01] %d " % status, got), got[:300])
                    self.assertTrue(closed)
                    self.assertEqual(got.count(b"HTTP/1.1 100 "), status == 100)
                    if status == 100:
                        self.assertIn(b"\r\n\r\nHTTP/1.1 200 ", got)

    def test_lists_in_several_headers(self):
        """Are one list (RFC 9110, 5.3)."""
        with self.connect() as s:
            got, _ = talk(s, [self.post + b"Accept: text/plain\r\nContent-Length: 2\r\nAccept: image/png\r\n"
                              b"Connection: close\r\n\r\n{}"])
        self.assertTrue(got.startswith(b"HTTP/1.1 200 "), got[:300])
        # What a client says of itself stands before what the proxy adds.
        d = Daemon("--trusted-proxy=127.0.0.1")
        try:
            raw(d.port, GET + HOST + b"X-Forwarded-For: 6.6.6.6\r\nX-Forwarded-For: 203.0.113.9\r\n" + CLOSE +
                b"\r\n")
            harness.wait(lambda: "203.0.113.9 GET /v1 " in d.log())
            self.assertNotIn("6.6.6.6 GET", d.log())
        finally:
            self.assertEqual(d.stop(), 0)
            d.kill()

    def test_http_1_0(self):
        one = b"GET /v1/techniques/none HTTP/1.0\r\n"
        for request, answers in ((one + b"\r\n" + SMUGGLED, 1),
                                 (one + b"Connection: keep-alive\r\n\r\n" + one + b"\r\n" + SMUGGLED, 2),
                                 (one + b"Connection: keep-alive, close\r\n\r\n" + SMUGGLED, 1)):
            with self.connect() as s:
                got, closed = talk(s, [request])
            self.assertEqual(len(re.findall(rb"HTTP/1\.[01] 200 ", got)), answers)
            self.assertTrue(closed)
            self.assertNotIn(b'"techniques"', got)

    def test_head_has_no_body(self):
        head = b"HEAD /v1/techniques HTTP/1.1\r\n" + HOST
        with self.connect() as s:
            got, _ = talk(s, [head + b"\r\n" + SMUGGLED.replace(b"\r\n\r\n", b"\r\nConnection: close\r\n\r\n")])
            self.assertEqual(got.count(b"HTTP/1.1 200 "), 2)
            self.assertEqual(got.split(b"\r\n\r\n")[1][:9], b"HTTP/1.1 ")
        with self.connect() as s:
            got, closed = talk(s, [head + b"A : b\r\n\r\n"])
            self.assertTrue(got.startswith(b"HTTP/1.1 400 ") and got.endswith(b"\r\n\r\n"), got)
            self.assertTrue(closed)

    def test_pipelining_of_many(self):
        one = b"GET /v1/techniques/none HTTP/1.1\r\n" + HOST + b"\r\n"
        post = self.post + b"Content-Length: 2\r\n\r\n{]"
        last = one.replace(b"\r\n\r\n", b"\r\nConnection: close\r\n\r\n")
        with self.connect() as s:
            got, closed = talk(s, [(one + post) * 50 + last + SMUGGLED])
        self.assertEqual(got.count(b"HTTP/1.1 200 "), 51)
        self.assertEqual(got.count(b"HTTP/1.1 400 "), 50)
        self.assertNotIn(b'"techniques"', got)
        self.assertTrue(closed)


class Coding(unittest.TestCase):
    """Content-Encoding of what is sent, and tags of what is known."""
    @classmethod
    def setUpClass(cls):
        cls.d = Daemon("--upload-limit=2M")
        cls.glb = grid_scene(20, "coded")

    @classmethod
    def tearDownClass(cls):
        assert cls.d.stop() == 0
        cls.d.kill()

    def gzip(self, data):
        packer = zlib.compressobj(9, zlib.DEFLATED, 31)
        return packer.compress(data) + packer.flush()

    def send(self, data, coding, path="/v1/scenes", kind="model/gltf-binary"):
        return self.d.call("POST", path, data, {"Content-Type": kind, "Content-Encoding": coding})

    def test_gzip(self):
        plain = self.d.upload(self.glb)
        for coding in ("gzip", "x-gzip", "GZIP"):
            answer = self.send(self.gzip(self.glb), coding)
            self.assertEqual((answer.status, answer.json()["id"]), (200, plain))
        self.assertEqual(self.send(self.glb, "identity").status, 200)
        render = "/v1/scenes/%s/render" % plain
        body = json.dumps(SMALL).encode()
        want = self.d.call("POST", render, body, {"Content-Type": "application/json"})
        got = self.send(self.gzip(body), "gzip", render, "application/json")
        self.assertEqual((got.status, got.body), (200, want.body))

    def test_what_is_none(self):
        render = "/v1/scenes/%s/render" % self.d.upload(self.glb)
        cut = self.gzip(self.glb)[:-20]
        wrong = bytearray(self.gzip(self.glb))
        wrong[-5] ^= 1  # the checksum or the length
        for data in (self.glb, cut, bytes(wrong), self.gzip(self.glb) + b"behind it"):
            self.assertEqual(self.send(data, "gzip").status, 400)
        for data in (b"{}", self.gzip(b"{}")[:-1]):
            self.assertEqual(self.send(data, "gzip", render, "application/json").status, 400)
        for coding in ("br", "deflate", "zstd", "gzip, gzip", "aes128gcm"):
            for path, kind in (("/v1/scenes", "model/gltf-binary"), (render, "application/json")):
                answer = self.send(b"{}", coding, path, kind)
                self.assertEqual(answer.status, 415)
                self.assertIn("gzip", answer.json()["detail"])
                self.assertEqual(answer.headers["Accept-Encoding"], "gzip")

    def test_bombs(self):
        render = "/v1/scenes/%s/render" % self.d.upload(self.glb)
        bomb = self.gzip(b" " * (64 << 20))
        self.assertEqual(self.send(bomb, "gzip", render, "application/json").status, 413)
        self.assertEqual(self.send(bomb, "gzip").status, 413)
        harness.wait(lambda: self.d.leftovers() == [])

    def test_tags(self):
        scene = self.d.upload(self.glb)
        path = "/v1/scenes/%s/render?technique=hard&width=64&height=48" % scene
        tag = self.d.get(path).headers["ETag"].strip('"')
        same = ('"%s"', 'W/"%s"', '"a", "%s"', '"a","%s"', '"%s", "a"', 'W/"a" , W/"%s"', "*", ' "%s" ',
                '"a,b", "%s"')
        # What is not quite the tag is answered in full.
        other = ("%s", '"%s-gzip"', "W/%s", '"%s', '%s"', '"a"', '""', ",", "", '"', "w/\"a\"", "'%s'",
                 '"%s;"', '"x%s"', "a, b, c", '"%s"a', "**", '"a" "%s')
        for where in (path, "/openapi.json", "/v1/results/" + tag):
            own = tag if where != "/openapi.json" else self.d.get(where).headers["ETag"].strip('"')
            for forms, status in ((same, 304), (other, 200)):
                for form in forms:
                    with self.subTest(where=where[:20], form=form):
                        answer = self.d.call("GET", where, headers={"If-None-Match": form.replace("%s", own)})
                        self.assertEqual(answer.status, status)
                        self.assertEqual(answer.headers["ETag"], '"%s"' % own)
            both = raw(self.d.port, b"GET %s HTTP/1.1\r\n" % where.encode() + HOST + b"Connection: close\r\n"
                       b"If-None-Match: \"a\"\r\nIf-None-Match: \"%s\"\r\n\r\n" % own.encode())[0]
            self.assertIn(both.split()[1], (b"304", b"200"))


if __name__ == "__main__":
    harness.main()
