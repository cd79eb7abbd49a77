"""Live figures: /v1/events, and what stands in /metrics."""
import http.client
import json
import re
import unittest

from harness import SMALL, Daemon, grid_scene, main


class Stream:
    def __init__(self, daemon):
        self.connection = http.client.HTTPConnection("127.0.0.1", daemon.port, timeout=120)
        self.connection.request("GET", "/v1/events")
        self.answer = self.connection.getresponse()

    def event(self):
        """The next one's kind and data; None at the end."""
        kind = data = None
        while True:
            line = self.answer.readline().decode()
            if not line:
                return None
            if line == "\n" and data:
                return kind, json.loads(data)
            name, _, value = line.rstrip("\n").partition(": ")
            kind = value if name == "event" else kind
            data = value if name == "data" else data

    def close(self):
        self.connection.close()


class Live(unittest.TestCase):
    def setUp(self):
        self.d = Daemon()

    def tearDown(self):
        if self.d.process.poll() is None:
            self.assertEqual(self.d.stop(), 0)
        self.d.kill()

    def unlabelled(self):
        return dict(re.findall(r"^(penumbra_\w+) (\S+)$", self.d.admin("/metrics").body.decode(),
                               re.M))

    def test_figures(self):
        scene = self.d.upload(grid_scene(2))
        stream = Stream(self.d)
        self.assertEqual(stream.answer.status, 200)
        self.assertEqual(stream.answer.getheader("Content-Type"), "text/event-stream")
        kind, first = stream.event()
        self.assertEqual(kind, "stats")
        self.assertLessEqual(set(first["metrics"]), set(self.unlabelled()))
        self.assertEqual(first["metrics"]["penumbra_scenes"], 1)
        self.assertEqual(first["recent"], {"renders": 0})
        self.assertEqual(self.d.render(scene, SMALL).status, 200)
        self.assertEqual(self.d.render(scene, SMALL).status, 200)
        for _ in range(1000):  # those that were sent while it was drawn come first
            _, later = stream.event()
            self.assertGreater(later["unix_s"], first["unix_s"])
            if later["recent"]["renders"]:
                break
        self.assertIn(later["recent"]["renders"], (1, 2))  # the first may be longer ago
        times = later["recent"]["total"]
        self.assertTrue(0 < times["p50_ms"] <= times["p95_ms"] <= times["max_ms"])
        stream.close()

    def test_listeners_that_do_not_read(self):
        """They are sent the newest when they do; the service waits for none of them, and ends."""
        streams = [Stream(self.d) for _ in range(20)]
        scene = self.d.upload(grid_scene(2))
        for n in range(3):
            self.assertEqual(self.d.render(scene, dict(SMALL, exposure_ev=n)).status, 200)
        kind, data = streams[0].event()
        self.assertEqual(kind, "stats")
        self.assertEqual(self.d.stop(), 0)
        for stream in streams:
            while stream.event():
                pass
            stream.close()

    def test_one_after_the_other(self):
        """Who comes when nobody listened gets figures of now."""
        for count in range(3):
            stream = Stream(self.d)
            seen = stream.event()[1]["metrics"]["penumbra_scenes"]
            if seen != count:  # what was made for the one before, who may not be known to have left
                seen = stream.event()[1]["metrics"]["penumbra_scenes"]
            self.assertEqual(seen, count)
            stream.answer.close()
            stream.close()
            self.d.upload(grid_scene(2, str(count)))

    def test_conventions(self):
        """As Prometheus has them: every sample has its HELP and TYPE before it, counters end in
        _total, units are base units, and no name is there twice."""
        text = self.d.admin("/metrics").body.decode()
        kinds, helps, current = {}, set(), None
        for line in text.splitlines():
            if line.startswith("# HELP "):
                name = line.split()[2]
                self.assertNotIn(name, helps)
                helps.add(name)
                self.assertTrue(line.endswith("."), line)
            elif line.startswith("# TYPE "):
                _, _, current, kind = line.split()
                self.assertNotIn(current, kinds)
                self.assertIn(current, helps)
                kinds[current] = kind
            else:
                name = re.match(r"\w+", line)[0]
                base = re.sub(r"_(bucket|sum|count)$", "", name) if (
                    kinds[current] == "histogram") else name
                self.assertEqual(base, current, line)
                float(line.rsplit(" ", 1)[1])
        for name, kind in kinds.items():
            self.assertEqual(kind == "counter", name.endswith("_total"), name)
            self.assertIsNone(re.search(r"_(ms|millis\w*|percent|kb|mb|mib)(_|$)", name), name)


if __name__ == "__main__":
    main()
