"""The penumbra client against a stub of the server on 127.0.0.1: command lines in, the calls that
arrive, what is written and exit codes out. Usage: test_cli.py PATH-OF-PENUMBRA"""

import email
import email.policy
import hashlib
import http.server
import json
import os
import pathlib
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import unittest
import urllib.parse

PROGRAM = ""
PNG = b"\x89PNG\r\n\x1a\nnot really"


class Stub(http.server.ThreadingHTTPServer):
    """Keeps what it was sent; answers from `script` first, then like a small penumbrad."""

    daemon_threads = True

    def __init__(self):
        super().__init__(("127.0.0.1", 0), Handler)
        self.calls = []
        self.stored = {"/v1/scenes": {}, "/v1/images": {}}
        self.names = {}
        self.script = []

    def handle_error(self, *_):
        """Clients that leave are no news."""

    @property
    def url(self):
        return "http://127.0.0.1:%d" % self.server_address[1]


class Handler(http.server.BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"

    def log_message(self, *arguments):
        pass

    def body(self):
        if self.headers.get("Transfer-Encoding") == "chunked":
            data = b""
            while size := int(self.rfile.readline(), 16):
                data += self.rfile.read(size)
                self.rfile.readline()
            self.rfile.readline()
            return data
        return self.rfile.read(int(self.headers.get("Content-Length", 0)))

    def answer(self, status, body=b"", kind="application/json", headers=()):
        if not isinstance(body, bytes):
            body = json.dumps(body).encode()
        self.send_response(status)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(body)))
        for name, value in headers:
            self.send_header(name, value)
        self.end_headers()
        self.wfile.write(body)

    def problem(self, status, title, detail, **more):
        self.answer(status, dict(type="about:blank", title=title, status=status, detail=detail,
                                 retryable=False, **more), "application/problem+json")

    def handle_call(self):
        body = self.body()
        self.server.calls.append((self.command, self.path, dict(self.headers), body))
        if self.server.script:
            answer = self.server.script.pop(0)
            if callable(answer):
                answer(self)
            else:
                self.answer(*answer)
            return
        folder, _, rest = self.path[1:].partition("/")[2].partition("/")
        if "?" in folder:
            folder, _, rest = self.path[4:].partition("?")
            rest = "?" + rest
        folder = "/v1/" + folder
        stored = self.server.stored.get(folder)
        if self.path.endswith("/render"):
            if "json" in self.headers["Accept"]:
                self.answer(200, {"scene": rest[:64], "image": {"href": "/picture"},
                                  "warnings": []})
            else:
                self.answer(200, PNG, self.headers["Accept"], [("Server-Timing", "encode;dur=1")])
        elif self.path == "/picture":
            self.answer(200, PNG + b" again", "image/png")
        elif stored is None:
            self.problem(404, "Not Found", "No such thing.")
        elif self.command == "POST":
            identity = "ab" * 32
            stored[identity] = body
            self.answer(201, {"id": identity, "warnings": ["a warning"]})
        elif self.command == "PUT":
            rest, _, query = rest.partition("?")
            said = dict(urllib.parse.parse_qsl(query))
            entry = said.get("entry", "").encode()
            self.server.names[rest] = said.get("name", "")
            head = b"PENENTR1" + struct.pack("<II", len(entry), 0) + entry if entry else b""
            if hashlib.sha256(head + body).hexdigest() != rest:
                self.problem(422, "Unprocessable Content", "The bytes hash to something else.")
                return
            stored[rest] = body
            self.answer(201, {"id": rest, "warnings": []})
        elif not rest or rest.startswith("?"):
            wanted = dict(urllib.parse.parse_qsl(rest[1:])).get("name", "")
            self.answer(200, {"scenes": [
                {"id": i, "triangles": 7, "name": self.server.names.get(i, ""), "tags": ["a", "b"]}
                for i in stored if wanted.lower() in self.server.names.get(i, "").lower()]})
        elif self.path.startswith("/v1/scenes/") and len(rest) < 64 and (
                len(found := [i for i in stored if i.startswith(rest)]) == 1):
            self.answer(200, {"id": found[0], "warnings": []})
        elif rest not in stored:
            self.problem(404, "Not Found", "There is no scene %s." % rest[:8])
        elif self.command == "DELETE":
            del stored[rest]
            self.send_response(204)
            self.end_headers()
        else:
            self.answer(200, {"id": rest, "warnings": []})

    def do_PATCH(self):
        body = self.body()
        self.server.calls.append((self.command, self.path, dict(self.headers), body))
        self.answer(200, {"id": self.path[11:], "triangles": 7, "tags": [], **json.loads(body)})

    do_GET = do_POST = do_PUT = do_DELETE = handle_call


class Command(unittest.TestCase):
    """A stub, a folder with a scene in it, and the program."""

    def setUp(self):
        self.stub = Stub()
        threading.Thread(target=self.stub.serve_forever, args=[0.02], daemon=True).start()
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.addCleanup(self.stub.server_close)
        self.addCleanup(self.stub.shutdown)
        self.folder = pathlib.Path(folder.name)
        self.scene = self.folder / "scene.glb"
        self.scene.write_bytes(b"glTF" + bytes(range(256)) * 400)
        self.id = hashlib.sha256(self.scene.read_bytes()).hexdigest()

    def run_cli(self, *arguments, status=0, server=True, stdin=b"", env=()):
        environment = dict(os.environ, http_proxy="http://127.0.0.1:1", **dict(env))
        if server:
            environment["PENUMBRA_SERVER"] = self.stub.url
        done = subprocess.run([PROGRAM, *map(str, arguments)], cwd=self.folder, timeout=30,
                              capture_output=True, env=environment, input=stdin)
        self.assertEqual(done.returncode, status, done)
        self.assertEqual(done.stderr != b"", status != 0 or "-v" in arguments or
                         b"warning" in done.stderr, done)
        return done

    def seen(self):
        return [(method, path) for method, path, _, _ in self.stub.calls]

    def request(self):
        """The render request that arrived last."""
        method, path, headers, body = self.stub.calls[-1]
        self.assertEqual(method, "POST")
        self.assertEqual(headers["Content-Type"], "application/json")
        return json.loads(body)

    def files(self):
        return sorted(p.name for p in self.folder.iterdir())


class Cli(Command):
    def test_render_uploads_once(self):
        self.run_cli("render", "scene.glb", "-o", "out.png", "--technique", "pcss", "--set",
                     "search_taps=32")
        scene, render = "/v1/scenes/" + self.id, "/v1/scenes/%s/render" % self.id
        self.assertEqual(self.seen(), [
            ("GET", scene), ("PUT", scene + "?name=" + "".join("%%%02x" % b for b in b"scene.glb")),
            ("POST", render)])
        self.assertEqual(self.stub.stored["/v1/scenes"][self.id], self.scene.read_bytes())
        self.assertEqual(self.stub.calls[1][2]["Content-Type"], "model/gltf-binary")
        self.assertEqual(self.stub.calls[2][2]["Accept"], "image/png")
        self.assertEqual(self.request(), {
            "technique": {"name": "pcss", "params": {"search_taps": 32}},
            "output": {"format": "png"}})
        self.assertEqual((self.folder / "out.png").read_bytes(), PNG)
        self.assertEqual(self.files(), ["out.png", "scene.glb"])
        self.stub.calls.clear()
        self.run_cli("render", "scene.glb", "-o", "out.png")
        self.assertEqual(self.seen(), [("GET", scene), ("POST", render)])

    def test_render_of_stored_scene(self):
        self.run_cli("render", self.id, "-o", "out")
        self.assertEqual(self.seen(), [("POST", "/v1/scenes/%s/render" % self.id)])
        self.assertEqual(self.request(), {})

    def test_flags_become_the_request(self):
        self.run_cli(
            "render", self.id, "--output", "x", "-o", "out.JPG", "--width", "320", "--height=200",
            "--no-ground", "--classify", "--ambient", "0.1,0.2,0.3", "--exposure-ev", "-1.5",
            "--tone-map", "aces", "--camera-eye", "-2.2,1.6,2.6", "--camera-fov-y-deg", "40",
            "--layer", "depth", "--quality", "80", "--deadline-ms", "5000", "--set", "a=true",
            "--set", "b=text", "--set", "c=1,2,3", "--set", "d=-0.02", "--set", "e=1e400",
            "--light", "type=rect,position=1.5,3,1,target=0,0,0,width=2,texture=checker",
            "--light", "type=sun,irradiance=2", status=2)
        self.run_cli(
            "render", self.id, "-o", "out.JPG", "--width", "320", "--height=200",
            "--no-ground", "--classify", "--ambient", "0.1,0.2,0.3", "--exposure-ev", "-1.5",
            "--tone-map", "aces", "--camera-eye", "-2.2,1.6,2.6", "--camera-fov-y-deg", "40",
            "--layer", "depth", "--quality", "80", "--deadline-ms", "5000", "--set", "a=true",
            "--set", "b=text", "--set", "c=1,2,3", "--set", "d=-0.02", "--set", "e=1e400",
            "--light", "type=rect,position=1.5,3,1,target=0,0,0,width=2,texture=checker",
            "--light", "type=sun,irradiance=2")
        self.assertEqual(self.request(), {
            "width": 320, "height": 200, "ground": False, "classify": True,
            "ambient": [0.1, 0.2, 0.3], "exposure_ev": -1.5, "tone_map": "aces",
            "camera": {"eye": [-2.2, 1.6, 2.6], "fov_y_deg": 40},
            "output": {"layer": "depth", "quality": 80, "format": "jpeg"}, "deadline_ms": 5000,
            "technique": {"params": {"a": True, "b": "text", "c": [1, 2, 3], "d": -0.02,
                                     "e": "1e400"}},
            "lights": [{"type": "rect", "position": [1.5, 3, 1], "target": [0, 0, 0], "width": 2,
                        "texture": {"pattern": "checker"}},
                       {"type": "sun", "irradiance": 2}]})
        self.assertEqual(self.stub.calls[-1][2]["Accept"], "image/jpeg")
        self.run_cli("render", self.id, "-o", "o.exr", "--orbit-azimuth-deg", "30", "--light",
                     "none", "--ground=off", "--ground=on")
        self.assertEqual(self.request(), {
            "camera": {"orbit": {"azimuth_deg": 30}}, "lights": [], "ground": True,
            "output": {"format": "exr"}})

    def test_json_file_and_flags_after_it(self):
        body = {"technique": "hard", "width": 100, "lights": [{"type": "disk"}],
                "output": {"format": "png", "layer": "normal"}}
        (self.folder / "request.json").write_text(json.dumps(body))
        self.run_cli("render", self.id, "-o", "a.webp", "--json", "request.json", "--width", "64",
                     "--set", "bias=0.5", "--format", "webp", "--light", "type=point")
        self.assertEqual(self.request(), {
            "technique": {"name": "hard", "params": {"bias": 0.5}}, "width": 64,
            "lights": [{"type": "disk"}, {"type": "point"}],
            "output": {"format": "webp", "layer": "normal"}})
        self.run_cli("render", self.id, "-o", "a.png", "--json", "-", stdin=b'{"height": 3}')
        self.assertEqual(self.request(), {"height": 3, "output": {"format": "png"}})
        for text in (b"", b"[]", b"{", b'"x"', b" " * 70000):
            self.run_cli("render", self.id, "-o", "a.png", "--json", "-", stdin=text, status=1)
        self.run_cli("render", self.id, "-o", "a.png", "--json", "nowhere", status=1)

    def test_texture_file_is_uploaded(self):
        (self.folder / "glass.jpg").write_bytes(b"a jpeg")
        image = hashlib.sha256(b"a jpeg").hexdigest()
        for _ in range(2):
            self.run_cli("render", self.id, "-o", "a.png", "--light", "texture=glass.jpg")
            self.assertEqual(self.request()["lights"], [{"texture": {"image": image}}])
        puts = [call for call in self.seen() if call[0] == "PUT"]
        self.assertEqual(puts, [("PUT", "/v1/images/" + image)])
        self.run_cli("render", self.id, "-o", "a.png", "--light", "texture=" + image)
        self.assertEqual(self.request()["lights"], [{"texture": {"image": image}}])
        self.run_cli("render", self.id, "-o", "a.png", "--light", "texture=missing.png", status=1)

    def test_record(self):
        done = self.run_cli("render", self.id, "--json-record")
        self.assertEqual(json.loads(done.stdout)["scene"], self.id)
        self.assertEqual(self.stub.calls[-1][2]["Accept"], "application/json")
        self.run_cli("render", self.id, "--json-record", "-o", "a.png")
        self.assertEqual((self.folder / "a.png").read_bytes(), PNG + b" again")
        self.assertEqual(self.seen()[-1], ("GET", "/picture"))

    def test_standard_output(self):
        done = self.run_cli("render", self.id, "-o", "-")
        self.assertEqual(done.stdout, PNG)
        self.run_cli("render", self.id, "-o", "-", "--json-record", status=2)

    def test_gltf_with_files(self):
        (self.folder / "parts").mkdir()
        (self.folder / "parts/a b.bin").write_bytes(b"\1\2\3")
        (self.folder / "t.png").write_bytes(b"\4")
        gltf = {"asset": {"version": "2.0"},
                "buffers": [{"uri": "parts/a%20b.bin"}, {"uri": "data:;base64,AA=="},
                            {"byteLength": 1}],
                "images": [{"uri": "./t.png"}, {"uri": "t.png"}, {"bufferView": 0}]}
        (self.folder / "m.gltf").write_text(json.dumps(gltf))
        files = {"m.gltf": (self.folder / "m.gltf").read_bytes(), "parts/a b.bin": b"\1\2\3",
                 "t.png": b"\4"}
        bundle = b"PENBNDL1" + struct.pack("<II", len(files), 0)
        for name in sorted(files):
            bundle += struct.pack("<IIQ", len(name), 0, len(files[name]))
            bundle += name.encode() + files[name]
        identity = hashlib.sha256(bundle).hexdigest()
        done = self.run_cli("scenes", "upload", "m.gltf")
        self.assertEqual(done.stdout.decode().strip(), "ab" * 32)
        self.assertEqual(done.stderr, b"warning: a warning\n")
        self.assertEqual(self.seen(), [("GET", "/v1/scenes/" + identity), ("POST", "/v1/scenes")])
        headers, body = self.stub.calls[-1][2:]
        self.assertTrue(headers["Content-Type"].startswith("multipart/form-data"))
        parts = email.message_from_bytes(
            b"Content-Type: " + headers["Content-Type"].encode() + b"\r\n\r\n" + body,
            policy=email.policy.HTTP)
        sent = {p.get_param("filename", header="Content-Disposition"): p.get_payload(decode=True)
                for p in parts.iter_parts()}
        self.assertEqual(sent, files)
        types = {p.get_param("filename", header="Content-Disposition"): p.get_content_type()
                 for p in parts.iter_parts()}
        self.assertEqual(types["m.gltf"], "model/gltf+json")
        # The server's id is the one that is rendered; what it has is not sent again.
        self.run_cli("render", self.folder / "m.gltf", "-o", "a.png")
        self.assertEqual(self.seen()[-1], ("POST", "/v1/scenes/%s/render" % ("ab" * 32)))
        self.stub.stored["/v1/scenes"][identity] = b""
        self.stub.calls.clear()
        self.run_cli("render", "m.gltf", "-o", "a.png")
        self.assertEqual(self.seen(), [("GET", "/v1/scenes/" + identity),
                                       ("POST", "/v1/scenes/%s/render" % identity)])

    def test_gltf_that_spells_otherwise(self):
        """What goes up has the names on disk; the server takes the URIs as the client does."""
        (self.folder / "Tex").mkdir()
        for name in ("Tex/Wood.PNG", "Scho\u0308n.png", "a#b.png", "q.bin"):
            (self.folder / name).write_bytes(name.encode())
        for uri, name in (("tex\\wood.png", "Tex/Wood.PNG"), ("Tex/Wood.PNG?v=3", "Tex/Wood.PNG"),
                          ("Sch\u00f6n.png", "Scho\u0308n.png"), ("Sch%C3%B6n.png", "Scho\u0308n.png"),
                          ("a#b.png", "a#b.png"), ("./Tex//../q.bin#1", "q.bin")):
            (self.folder / "m.gltf").write_text(json.dumps(
                {"asset": {"version": "2.0"}, "buffers": [{"uri": "DATA:;base64,AA=="}],
                 "images": [{"uri": uri}]}))
            files = {"m.gltf": (self.folder / "m.gltf").read_bytes(), name: name.encode()}
            bundle = b"PENBNDL1" + struct.pack("<II", len(files), 0)
            for n in sorted(files, key=str.encode):
                bundle += struct.pack("<IIQ", len(n.encode()), 0, len(files[n])) + n.encode()
                bundle += files[n]
            self.stub.calls.clear()
            self.run_cli("scenes", "upload", "m.gltf")
            self.assertEqual(self.seen()[0],
                             ("GET", "/v1/scenes/" + hashlib.sha256(bundle).hexdigest()), uri)

    def test_entry_of_a_zip(self):
        data = b"PK\3\4 whatever"
        (self.folder / "s.zip").write_bytes(data)
        entry = "glTF/m \u00e9.gltf".encode()
        identity = hashlib.sha256(b"PENENTR1" + struct.pack("<II", len(entry), 0) + entry + data)
        self.run_cli("scenes", "upload", "s.zip#glTF\\m \u00e9.gltf")
        self.assertEqual(self.seen()[0], ("GET", "/v1/scenes/" + identity.hexdigest()))
        method, path = self.seen()[1]
        self.assertEqual(urllib.parse.unquote(path), "/v1/scenes/%s?entry=%s" % (
            identity.hexdigest(), entry.decode()))
        self.assertEqual((method, self.stub.calls[-1][3]), ("PUT", data))
        self.run_cli("scenes", "upload", "s.zip#../m.gltf", status=2)

    def test_gltf_that_reaches_outside(self):
        (self.folder / "in/a").mkdir(parents=True)
        for name in ("x", "in/x", "in/a/b", "in/a\\b"):
            (self.folder / name).write_bytes(b"data")
        gltf = self.folder / "in/m.gltf"
        for uri in ("../x", self.folder / "x", "a/../../x", "%2e%2e/x", "http://a/b", "", "a/", ".",
                    "https://127.0.0.1/x", "..\\x", "x%00b", "x" * 256):
            gltf.write_text(json.dumps({"buffers": [{"uri": str(uri)}]}))
            done = self.run_cli("scenes", "upload", gltf, status=1)
            self.assertIn(b"outside", done.stderr)
        for uri in ("a/.", "b"):
            gltf.write_text(json.dumps({"buffers": [{"uri": uri}]}))
            self.assertIn(b"not in its folder", self.run_cli("scenes", "upload", gltf, status=1).stderr)
        for text in ("", "[]", "{", '{"images": [{"uri": "missing.png"}]}',
                     '{"images": [{"uri": "a"}]}'):
            gltf.write_text(text)
            self.run_cli("scenes", "upload", gltf, status=1)
        self.assertEqual(self.stub.calls, [])

    def test_scenes(self):
        done = self.run_cli("scenes", "upload", "scene.glb")
        self.assertEqual(done.stdout.decode(), self.id + "\n")
        self.assertIn(self.id, self.run_cli("scenes").stdout.decode())
        shown = self.run_cli("scenes", "show", self.id).stdout
        self.assertEqual(json.loads(shown)["id"], self.id)
        self.assertEqual(self.run_cli("scenes", "delete", self.id).stdout, b"")
        self.assertEqual(self.seen()[-1], ("DELETE", "/v1/scenes/" + self.id))
        done = self.run_cli("scenes", "show", self.id, status=3)
        self.assertIn(b"There is no scene", done.stderr)
        self.stub.script = [(200, {"scenes": [{"id": "11" * 32}], "next": "/v1/scenes?after=x"}),
                            (200, {"scenes": [{"id": "22" * 32}]})]
        text = self.run_cli("scenes", "list").stdout.decode()
        self.assertTrue("11" * 32 in text and "22" * 32 in text)
        self.assertEqual(self.seen()[-1], ("GET", "/v1/scenes?after=x"))

    def test_techniques(self):
        row = {"name": "taps", "default": 16, "min": 1, "max": 64, "help": "Samples."}
        pcss = {"name": "pcss", "title": "Soft", "cost_class": "medium", "params": [row]}
        self.stub.script = [(200, {"techniques": [pcss]}), (200, pcss)]
        self.assertIn(b"pcss", self.run_cli("techniques").stdout)
        self.assertIn(b"--set taps=16", self.run_cli("techniques", "pcss").stdout)
        self.assertEqual(self.seen(), [("GET", "/v1/techniques"), ("GET", "/v1/techniques/pcss")])

    def test_problems_and_exit_codes(self):
        def problem(status, **more):
            return (status, dict(title="Title", detail="What is wrong.", status=status, **more),
                    "application/problem+json")
        self.stub.script = [problem(422, pointer="/technique/params/x")]
        done = self.run_cli("render", self.id, "-o", "a.png", status=3)
        for word in (b"Title", b"What is wrong.", b"/technique/params/x", b"422"):
            self.assertIn(word, done.stderr)
        self.stub.script = [problem(500)]
        self.run_cli("render", self.id, "-o", "a.png", status=4)
        self.stub.script = [(502, b"<html>", "text/html")]
        done = self.run_cli("render", self.id, "-o", "a.png", status=4)
        self.assertIn(b"502", done.stderr)
        self.stub.script = [(200, b"{}", "application/json")]
        self.run_cli("render", self.id, "-o", "a.png", status=4)
        self.stub.script = [(200, b"no json", "application/json")]
        self.run_cli("scenes", "show", self.id, status=4)
        self.stub.script = [(404, b"", "text/plain"), problem(413)]
        self.run_cli("render", "scene.glb", "-o", "a.png", status=3)
        self.assertEqual(self.files(), ["scene.glb"])
        self.run_cli("render", "missing.glb", "-o", "a.png", status=1)
        self.run_cli("render", self.id, "-o", "no/such/folder.png", status=1)

    def test_an_old_image_survives_a_failure(self):
        (self.folder / "a.png").write_bytes(b"old")
        self.stub.script = [(500, b"")]
        self.run_cli("render", self.id, "-o", "a.png", status=4)
        self.assertEqual((self.folder / "a.png").read_bytes(), b"old")

    def test_no_connection(self):
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            nobody = "http://127.0.0.1:%d" % free.getsockname()[1]
            self.run_cli("scenes", "--server", nobody, status=5)
            self.run_cli("render", "scene.glb", "-o", "a.png", "--server=" + nobody, status=5)

    def test_truncated_answer(self):
        with socket.create_server(("127.0.0.1", 0)) as listener:
            def serve():
                connection, _ = listener.accept()
                connection.recv(65536)
                connection.sendall(b"HTTP/1.1 200 OK\r\nContent-Type: image/png\r\n"
                                   b"Content-Length: 100\r\n\r\nhalf")
                connection.close()
            threading.Thread(target=serve, daemon=True).start()
            url = "http://127.0.0.1:%d" % listener.getsockname()[1]
            self.run_cli("render", self.id, "-o", "a.png", "--server", url, status=5)
        self.assertEqual(self.files(), ["scene.glb"])

    def test_retries(self):
        busy = (503, {"title": "Service Unavailable", "detail": "Full."},
                "application/problem+json", [("Retry-After", "0")])
        self.stub.script = [busy, busy]
        self.run_cli("render", self.id, "-o", "a.png")
        self.assertEqual(len(self.stub.calls), 3)
        self.stub.script = [busy] * 3
        done = self.run_cli("scenes", "--retry", "2", status=4)
        self.assertIn(b"Full.", done.stderr)
        self.assertEqual(self.stub.script, [])
        self.stub.script = [busy]
        self.run_cli("scenes", "--retry", "0", status=4)
        # The body of an upload is sent again in full.
        self.stub.script = [(404, b"", "text/plain"), busy]
        self.run_cli("scenes", "upload", "scene.glb")
        self.assertEqual(self.stub.calls[-1][3], self.scene.read_bytes())

    def test_warnings(self):
        self.stub.script = [(200, PNG, "image/png", [("X-Penumbra-Warning", "no colour"),
                                                     ("X-Penumbra-Warning", "no texture")])]
        done = self.run_cli("render", self.id, "-o", "a.png")
        self.assertEqual(done.stderr, b"warning: no colour\nwarning: no texture\n")

    def test_token(self):
        self.run_cli("scenes", env=[("PENUMBRA_TOKEN", "secret")])
        self.assertEqual(self.stub.calls[-1][2]["Authorization"], "Bearer secret")

    def test_verbose(self):
        done = self.run_cli("render", self.id, "-o", "a.png", "-v")
        self.assertIn(b"encode;dur=1", done.stderr)

    def test_usage(self):
        for line in ("", "nonsense", "render", "render x.glb", "render -o a.png",
                     "render a b -o c.png", "render a -o a.bmp", "render a -o a.png --width",
                     "render a -o a.png --width 0",
                     "render a -o a.png --width 1.5", "render a -o a.png --tone-map x",
                     "render a -o a.png --camera-eye 1,2", "render a -o a.png --nonsense 1",
                     "render a -o a.png --set x", "render a -o a.png --set =1",
                     "render a -o a.png --light x", "render a -o a.png --light width=0",
                     "render a -o a.png --retry -1", "scenes show", "jobs show abc", "jobs wait ../x",
                     "scenes nonsense", "scenes change", "watch", "watch x.glb", "watch x.glb -o -",
                     "completion", "completion csh", "scenes list x", "techniques a b",
                     "techniques ../x", "version x", "generate", "generate nonsense -o x.glb",
                     "generate demo", "generate hairball -o x.glb --triangles -1",
                     "generate hairball -o x.glb --triangles 1e9"):
            self.run_cli(*line.split(), status=2)
        self.assertEqual(self.stub.calls, [])
        for line in ("help", "--help", "render --help", "scenes -h", "techniques --help",
                     "generate --help", "version", "--version"):
            self.assertNotEqual(self.run_cli(*line.split(), server=False).stdout, b"")

    def test_generate(self):
        self.run_cli("generate", "half-plane", "-o", "h.glb", "--caster-height", "0.8")
        data = (self.folder / "h.glb").read_bytes()
        magic, version, size = struct.unpack_from("<4sII", data)
        self.assertEqual((magic, version, size), (b"glTF", 2, len(data)))
        self.run_cli("generate", "half-plane", "-o", "h.pscene", "--caster-height", "0.8")
        self.assertEqual((self.folder / "h.pscene").read_bytes()[:8], b"PSCENE\r\n")
        self.run_cli("generate", "half-plane", "-o", "no/h.glb", status=1)


def main():
    """Usage: ... PATH-OF-PENUMBRA"""
    global PROGRAM
    PROGRAM = os.path.abspath(sys.argv.pop(1))
    unittest.main()


if __name__ == "__main__":
    main()
