"""A store that may hold so much: what would be more is 507, with the figures, and harms nothing."""
import concurrent.futures
import os
import socket
import unittest

from harness import SMALL, Daemon, grid_scene, main, wait
from hostile_files import png

LIMIT = 400000
ENTRY = 8192  # what is counted for the small files of an entry


class Quota(unittest.TestCase):
    def setUp(self):
        self.d = Daemon("--store-limit=%d" % LIMIT)

    def tearDown(self):
        if self.d.process.poll() is None:
            self.assertEqual(self.d.stop(), 0)
        self.d.kill()

    def post(self, data, kind="model/gltf-binary", path="/v1/scenes"):
        return self.d.call("POST", path, data, {"Content-Type": kind})

    def stored(self):
        """Bytes, by the files that are there."""
        total = 0
        for kind in ("scenes", "images"):
            folder = os.path.join(self.d.store, kind)
            for entry in os.listdir(folder):
                blob = kind[:-1] + ".pscene"
                total += ENTRY + sum(os.path.getsize(os.path.join(folder, entry, name))
                                     for name in ("source", blob))
        return total

    def check_full(self, answer):
        self.assertEqual(answer.status, 507, answer.body)
        self.assertEqual(answer.headers["Content-Type"], "application/problem+json")
        self.assertNotIn("Retry-After", answer.headers)
        self.assertIn("MiB", answer.json()["detail"])
        self.assertEqual(os.listdir(os.path.join(self.d.store, "tmp")), [])

    def fill(self):
        ids = []
        for n in range(100):
            answer = self.post(grid_scene(12, "scene %d" % n))
            if answer.status == 507:
                self.check_full(answer)
                return ids
            self.assertEqual(answer.status, 201, answer.body)
            ids.append(answer.json()["id"])
        self.fail("the store is never full")

    def test_full(self):
        ids = self.fill()
        self.assertGreater(len(ids), 1)
        self.assertEqual(self.d.metric("penumbra_store_bytes"), self.stored())
        self.assertLessEqual(self.stored(), LIMIT)
        self.assertEqual(self.d.render(ids[0], SMALL).status, 200)
        # What is there may come again.
        self.assertEqual(self.post(grid_scene(12, "scene 0")).status, 200)
        self.assertEqual(self.d.call("DELETE", "/v1/scenes/" + ids[1]).status, 204)
        self.assertEqual(self.post(grid_scene(12, "scene again")).status, 201)
        self.assertEqual(self.d.metric("penumbra_store_bytes"), self.stored())
        # As before after a restart, and less than there is already is allowed too.
        self.assertEqual(self.d.stop(), 0)
        self.d.flags.append("--store-limit=1000")
        self.d.start()
        self.assertEqual(self.d.metric("penumbra_store_bytes"), self.stored())
        self.assertEqual(self.d.render(ids[0], SMALL).status, 200)
        self.check_full(self.post(grid_scene(12, "one more")))

    def test_small_upload_of_much(self):
        """A picture of a few kilobytes that takes megabytes when it is decoded."""
        data = png(512, 512)
        self.assertLess(len(data), 20000)
        self.check_full(self.post(data, "image/png", "/v1/images"))
        self.assertEqual(self.d.metric("penumbra_store_bytes"), 0)

    def test_announced(self):
        """Refused before it is sent."""
        with socket.create_connection(("127.0.0.1", self.d.port), timeout=60) as s:
            s.sendall(b"POST /v1/scenes HTTP/1.1\r\nHost: localhost\r\n"
                      b"Content-Type: model/gltf-binary\r\nContent-Length: 100000000\r\n\r\n")
            self.assertIn(b"HTTP/1.1 507 ", s.recv(100))

    def test_parts(self):
        """A form holds the file twice for a while; what is over is given back."""
        body = (b'--x\r\nContent-Disposition: form-data; name="f"; filename="a.glb"\r\n\r\n' +
                grid_scene(4, "form") + b"\r\n--x--\r\n")
        answer = self.post(body, "multipart/form-data; boundary=x")
        self.assertEqual(answer.status, 201, answer.body)
        self.assertEqual(self.d.metric("penumbra_store_bytes"), self.stored())

    def test_many_at_once(self):
        with concurrent.futures.ThreadPoolExecutor(8) as pool:
            answers = list(pool.map(lambda n: self.post(grid_scene(12, "at once %d" % n)),
                                    range(24)))
        kinds = {a.status for a in answers}
        self.assertEqual(kinds, {201, 507})
        wait(lambda: self.d.metric("penumbra_store_bytes") == self.stored())
        self.assertLessEqual(self.stored(), LIMIT)


if __name__ == "__main__":
    main()
