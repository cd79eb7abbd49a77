"""Tokens: what each may do, whose scenes are whose, and what is read again on SIGHUP."""
import json
import os
import signal
import socket
import ssl
import threading
import unittest

import harness
from harness import SMALL, Daemon, grid_scene, png, wait
from test_wire import certificate

TOKENS = """
# name token scopes limits
alice alice-alice-alice-alice
bob bob-bob-bob-bob-bob-bob
reader reader-reader-reader read
drawer drawer-drawer-drawer render,read
sender sender-sender-sender upload stored_bytes=%d
admin admin-admin-admin-admin admin
quick quick-quick-quick-quick read requests_per_s=3
single single-single-single render renders=1
"""


def bearer(token):
    return {"Authorization": "Bearer " + token}


ALICE, BOB = bearer("alice-alice-alice-alice"), bearer("bob-bob-bob-bob-bob-bob")
READER, DRAWER = bearer("reader-reader-reader"), bearer("drawer-drawer-drawer")
SENDER, ADMIN = bearer("sender-sender-sender"), bearer("admin-admin-admin-admin")
QUICK, SINGLE = bearer("quick-quick-quick-quick"), bearer("single-single-single")


class Access(unittest.TestCase):
    def daemon(self, *flags, tokens=TOKENS % 300000):
        d = Daemon(start=False)
        self.addCleanup(d.kill)
        self.file = os.path.join(d.folder, "tokens")
        self.write(tokens)
        d.flags += ["--token-file=" + self.file, *flags]
        return d.start()

    def write(self, tokens, mode=0o600):
        with open(self.file, "w") as file:
            file.write(tokens)
        os.chmod(self.file, mode)

    def upload(self, d, who, n, kind="scenes"):
        data = grid_scene(n, "of a token") if kind == "scenes" else png(n, n)
        return d.call("POST", "/v1/" + kind, data, who)

    def test_scopes(self):
        d = self.daemon()
        scene = self.upload(d, ALICE, 2).json()["id"]
        path = "/v1/scenes/" + scene
        render = lambda who: d.call("POST", path + "/render", json.dumps(SMALL), who).status
        for n, (who, read, draw, send) in enumerate(((ALICE, 200, 200, 201), (READER, 200, 403, 403),
                                      (DRAWER, 200, 200, 403), (SENDER, 403, 403, 201),
                                      (ADMIN, 200, 200, 201), ({}, 401, 401, 401))):
            with self.subTest(who=who):
                self.assertEqual(d.call("GET", path, headers=who).status, read)
                self.assertEqual(d.call("GET", "/v1/scenes", headers=who).status, read)
                self.assertEqual(render(who), draw)
                self.assertEqual(d.call("GET", path + "/render?width=32&height=32", headers=who).status, draw)
                self.assertEqual(self.upload(d, who, 3 + n).status, send)
                self.assertEqual(d.call("GET", "/openapi.json", headers=who).status, 200)
        refused = d.call("POST", path + "/render", b"{}", READER).json()
        self.assertIn('"render"', refused["detail"])
        self.assertEqual(d.stop(), 0)

    def test_owners(self):
        d = self.daemon()
        mine = self.upload(d, ALICE, 2).json()["id"]
        both = self.upload(d, ALICE, 3).json()["id"]
        self.assertEqual(self.upload(d, BOB, 3).status, 200)
        image = self.upload(d, ALICE, 9, "images").json()["id"]
        delete = lambda id, who, kind="scenes": d.call("DELETE", "/v1/%s/%s" % (kind, id),
                                                       headers=who).status
        self.assertEqual(d.stop(), 0)
        d.start()  # it is written down
        self.assertEqual(delete(mine, BOB), 403)
        self.assertEqual(delete(image, BOB, "images"), 403)
        self.assertEqual(delete(mine, READER), 403)
        self.assertEqual(delete("0" * 64, BOB), 404)
        self.assertEqual(delete(mine, ALICE), 204)
        self.assertEqual(delete(image, ALICE, "images"), 204)
        self.assertEqual(d.call("GET", "/v1/scenes/" + mine, headers=BOB).status, 404)
        self.assertEqual(delete(both, ALICE), 204)  # she lets go of it
        self.assertEqual(d.call("GET", "/v1/scenes/" + both, headers=BOB).status, 200)
        self.assertEqual(delete(both, ALICE), 403)
        self.assertEqual(delete(both, BOB), 204)
        self.assertEqual(d.call("GET", "/v1/scenes/" + both, headers=BOB).status, 404)
        other = self.upload(d, BOB, 4).json()["id"]
        self.assertEqual(delete(other, ADMIN), 204)
        self.assertEqual(self.upload(d, ALICE, 4).status, 201)
        self.assertEqual(delete(other, BOB), 403)  # what he had is gone
        self.assertEqual(d.stop(), 0)

    def test_log(self):
        """A line names who, the scene, the method and the request, in both forms."""
        d = self.daemon("--log-format=json")
        scene = self.upload(d, ALICE, 2).json()["id"]
        trace = "00-" + "ab" * 16 + "-" + "cd" * 8 + "-01"
        answer = d.call("POST", "/v1/scenes/%s/render" % scene, json.dumps(SMALL),
                        {**ALICE, "traceparent": trace})
        self.assertEqual(answer.headers["traceparent"].split("-")[1], "ab" * 16)
        self.assertNotEqual(answer.headers["traceparent"], trace)
        line = lambda: [l for l in map(json.loads, d.log().splitlines())
                        if l.get("request_id") == answer.headers["X-Request-Id"]]
        found, = wait(line)
        self.assertEqual((found["token"], found["scene"], found["technique"], found["trace_id"]),
                         ("alice", scene, "hard", "ab" * 16))
        sent = [l for l in map(json.loads, d.log().splitlines()) if l.get("method") == "POST"][0]
        self.assertEqual((sent["scene"], sent["target"]), (scene, "/v1/scenes"))
        self.assertEqual(d.stop(), 0)
        plain = self.daemon()
        answer = plain.call("GET", "/v1/scenes/" + scene, headers=BOB)
        wait(lambda: " token bob scene %s" % scene in plain.log())
        self.assertEqual(plain.stop(), 0)

    def test_behind_a_proxy(self):
        """Links lead through the proxy that is trusted, and through no other."""
        said = {"X-Forwarded-Prefix": "/shadows/", "X-Forwarded-Host": "renders.example",
                "X-Forwarded-For": "6.6.6.6, 203.0.113.9", "Host": "10.0.0.1"}
        follow = lambda d, link, **head: d.exchange(
            "GET", link.removeprefix("/shadows"), headers={**said, **head})
        for flags, prefix, allowed in ((["--trusted-proxy=127.0.0.0/8", "--allow-host=renders.example"],
                                        "/shadows", 200),
                                       (["--public-url=https://renders.example/shadows"], "/shadows", 200),
                                       ([], "", 200), (["--trusted-proxy=127.0.0.1"], "/shadows", 421)):
            with self.subTest(flags=flags):
                d = Daemon(*flags)
                self.addCleanup(d.kill)
                page = d.exchange("GET", "/v1", headers=said)
                self.assertEqual(page.status, allowed)
                if allowed == 421:
                    continue
                self.assertEqual(page.json()["links"]["scenes"], prefix + "/v1/scenes")
                self.assertEqual(page.json()["links"]["docs"], prefix + "/docs")
                sent = d.exchange("POST", "/v1/scenes", grid_scene(2), said)
                scene = sent.headers["Location"]
                self.assertTrue(scene.startswith(prefix + "/v1/scenes/"), scene)
                self.assertEqual(follow(d, scene).status, 200)
                drawn = d.exchange("POST", scene.removeprefix("/shadows") + "/render", json.dumps(SMALL), said)
                self.assertTrue(drawn.headers["Content-Location"].startswith(prefix + "/v1/results/"))
                self.assertEqual(follow(d, drawn.headers["Content-Location"]).body, drawn.body)
                record = d.exchange("POST", scene.removeprefix("/shadows") + "/render", json.dumps(SMALL),
                                    {**said, "Accept": "application/json"}).json()
                self.assertIn('"%s/v1/results/' % prefix, json.dumps(record))
                # What only looks like a link stays as it is.
                d.exchange("PATCH", scene.removeprefix("/shadows"), json.dumps({"name": "/v1/name"}),
                           {**said, "Content-Type": "application/merge-patch+json"})
                self.assertIn("/v1/name", [s["name"] for s in d.exchange(
                    "GET", "/v1/scenes", headers=said).json()["scenes"]])
                # A comparison that is kept, and what is told of it.
                asked = d.exchange("POST", scene.removeprefix("/shadows") + "/compare", json.dumps(
                    {"width": 32, "height": 24, "techniques": ["hard"], "reference": {"name": "pcf"}}),
                    {**said, "Prefer": "respond-async"})
                job = asked.headers["Location"]
                told = wait(lambda: (s := follow(d, job).json())["state"] == "successful" and s)
                result = follow(d, told["links"]["result"])
                rows = result.json()
                links = {*told["links"].values(), rows["reference"]["links"]["image"]}
                self.assertEqual([link for link in links if not link.startswith(prefix + "/v1/")], [])
                self.assertEqual(int(result.headers["Content-Length"]), len(result.body))
                self.assertEqual(follow(d, told["links"]["result"], Range="bytes=5-").body, result.body[5:])
                events = d.exchange("GET", job.removeprefix("/shadows") + "/events", headers=said).body
                self.assertEqual(events.count(b'"/v1/'), 0 if prefix else events.count(b'/v1/'))
                if "--public-url" in str(flags):  # a proxy that leaves the path as it is
                    self.assertEqual(d.exchange("GET", "/shadows/v1/scenes").status, 200)
                    named = d.exchange("GET", "/v1", headers={"Host": "renders.example"})
                    self.assertEqual(named.status, 200)
                trusted = "--trusted" in str(flags)
                wait(lambda: ("203.0.113.9 GET /v1 " in d.log()) == trusted)
                for path in ("/", "/docs"):
                    text = d.exchange("GET", path).body.decode()
                    self.assertNotRegex(text, r"""(href=|src=|fetch\(|json\(|call\()["']/""")
                self.assertEqual(d.stop(), 0)

    def test_limits(self):
        d = self.daemon()
        statuses = [d.call("GET", "/v1", headers=QUICK).status for _ in range(12)]
        self.assertEqual(statuses[:3], [200] * 3)
        self.assertIn(429, statuses)
        self.assertEqual(d.call("GET", "/v1", headers=ALICE).status, 200)
        full = [self.upload(d, SENDER, n).status for n in range(30, 60)]
        self.assertEqual(full[0], 201)
        self.assertEqual(full[-1], 507)
        self.assertEqual(self.upload(d, ALICE, 20).status, 201)
        scene = self.upload(d, ALICE, 2).json()["id"]
        ask = lambda who, side: d.exchange("POST", "/v1/scenes/%s/render" % scene,
                                           json.dumps(dict(SMALL, width=side)), who).status
        wait(lambda: ask(ALICE, 32) == 200)
        with d.paused():
            first = []
            thread = threading.Thread(target=lambda: first.append(ask(SINGLE, 40)))
            thread.start()
            wait(lambda: d.metric("penumbra_renders_running") + d.metric("penumbra_queue_depth") == 1)
            self.assertEqual(ask(SINGLE, 41), 429)
        thread.join()
        self.assertEqual(first, [200])
        self.assertEqual(ask(SINGLE, 41), 200)
        self.assertEqual(d.stop(), 0)

    def test_read_again(self):
        d = self.daemon()
        get = lambda who: d.exchange("GET", "/v1", headers=who).status
        new = bearer("new-alice-new-alice-new")
        scene = self.upload(d, ALICE, 2).json()["id"]
        self.assertEqual((get(ALICE), get(new)), (200, 401))
        self.write("alice new-alice-new-alice-new\n")
        os.kill(d.process.pid, signal.SIGHUP)
        wait(lambda: get(new) == 200)
        self.assertEqual(get(ALICE), 401)
        for tokens, mode in (("", 0o600), ("alice short\n", 0o600), (TOKENS % 1, 0o644)):
            before = d.log().count("nothing is changed")
            self.write(tokens, mode)
            os.kill(d.process.pid, signal.SIGHUP)
            wait(lambda: d.log().count("nothing is changed") == before + 1)
            self.assertEqual((get(ALICE), get(new)), (401, 200))
        self.assertIn("chmod o-rwx " + self.file, d.log())
        # The owner is the name, not the token.
        self.assertEqual(d.call("DELETE", "/v1/scenes/" + scene, headers=new).status, 204)
        self.assertEqual(d.stop(), 0)

    def test_certificates_read_again(self):
        d = Daemon(start=False)
        self.addCleanup(d.kill)
        cert, key = certificate(d.folder)
        d.flags += ["--tls-cert=" + cert, "--tls-key=" + key]
        d.start()
        of = lambda: ssl.get_server_certificate(("127.0.0.1", d.port))
        with open(cert) as file:
            self.assertEqual(of().strip(), file.read().strip())
        certificate(d.folder)
        os.kill(d.process.pid, signal.SIGHUP)
        with open(cert) as file:
            new = file.read().strip()
        wait(lambda: of().strip() == new)
        with open(key, "w") as file:
            file.write("no key")
        os.kill(d.process.pid, signal.SIGHUP)
        wait(lambda: "nothing is changed" in d.log())
        self.assertEqual(of().strip(), new)
        self.assertEqual(d.stop(), 0)

    def test_all_is_read_again_or_nothing(self):
        d = Daemon(start=False)
        self.addCleanup(d.kill)
        cert, key = certificate(d.folder)
        self.file = os.path.join(d.folder, "tokens")
        self.write("alice old-alice-old-alice-old\n")
        d.flags += ["--tls-cert=" + cert, "--tls-key=" + key, "--token-file=" + self.file]
        d.start()
        context = ssl._create_unverified_context()

        def get(token):
            with socket.create_connection(("127.0.0.1", d.port), timeout=60) as plain:
                with context.wrap_socket(plain) as s:
                    s.sendall(b"GET /v1 HTTP/1.1\r\nHost: x\r\nConnection: close\r\n"
                              b"Authorization: Bearer %s\r\n\r\n" % token.encode())
                    return int(s.recv(4096).split()[1])
        of = lambda: ssl.get_server_certificate(("127.0.0.1", d.port)).strip()
        first = of()
        old, new = "old-alice-old-alice-old", "new-alice-new-alice-new"
        with open(key) as file:
            good = file.read()
        for what in ("key", "tokens"):
            certificate(d.folder) if what == "tokens" else None
            self.write("alice %s\n" % new if what == "key" else "alice short\n")
            if what == "key":
                with open(key, "w") as file:
                    file.write("no key")
            before = d.log().count("nothing is changed")
            os.kill(d.process.pid, signal.SIGHUP)
            wait(lambda: d.log().count("nothing is changed") == before + 1)
            self.assertEqual((get(old), get(new), of()), (200, 401, first), what)
            with open(key, "w") as file:
                file.write(good)
        self.assertEqual(d.stop(), 0)

    def test_beyond_loopback(self):
        with self.assertRaisesRegex(RuntimeError, "admin listener needs --token-file"):
            Daemon("--admin-listen=0.0.0.0:0")
        d = self.daemon("--admin-listen=0.0.0.0:0")
        ask = lambda path, who={}: d.exchange("GET", path, headers=who, port=d.admin_port).status
        self.assertEqual(ask("/livez"), 200)
        wait(lambda: ask("/readyz") == 200)
        self.assertEqual([ask("/metrics", who) for who in ({}, ALICE, ADMIN)], [401, 401, 200])
        self.assertEqual(d.stop(), 0)

    def test_a_file_for_everybody(self):
        d = Daemon(start=False)
        self.addCleanup(d.kill)
        self.file = os.path.join(d.folder, "tokens")
        self.write(TOKENS % 1, 0o604)
        d.flags.append("--token-file=" + self.file)
        with self.assertRaisesRegex(RuntimeError, "chmod o-rwx"):
            d.start()


if __name__ == "__main__":
    harness.main()
