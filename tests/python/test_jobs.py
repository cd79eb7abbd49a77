"""Jobs through the client: what they give, and that no broken connection loses any of it."""
import contextlib
import io
import socket
import threading
import unittest
import unittest.mock
import zipfile

from wheel import TINY, client, harness, penumbra

SMALL = {key: value for key, value in TINY.items() if key != "deadline_ms"}


class Cutter:
    """Passes connections on to a daemon; of the answer to each request for events it passes only as
    many bytes as `lengths` says, one after the other, and then breaks off."""

    def __init__(self, port, lengths):
        self.port, self.lengths, self.cuts, self.asked = port, lengths, 0, []
        self.closed = False
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.threads = [threading.Thread(target=self.accept)]
        self.threads[0].start()

    def accept(self):
        while True:
            near, _ = self.listener.accept()
            if self.closed:
                near.close()
                return
            self.threads.append(threading.Thread(target=self.serve, args=(near,)))
            self.threads[-1].start()

    def serve(self, near):
        with near, socket.create_connection(("127.0.0.1", self.port)) as far:
            left = None
            back = threading.Thread(target=lambda: None)
            while True:
                try:
                    data = near.recv(65536)
                except OSError:
                    data = b""
                if not data:
                    break
                if b"/events " in data.split(b"\r\n")[0]:
                    self.asked.append(data)
                    left = self.lengths.pop(0) if self.lengths else None
                    self.cuts += left is not None
                if not back.is_alive() and back.ident is None:
                    back = threading.Thread(target=self.pass_back, args=(far, near, lambda: left))
                    back.start()
                try:
                    far.sendall(data)
                except OSError:
                    break
            with contextlib.suppress(OSError):
                far.shutdown(socket.SHUT_RDWR)
            if back.ident is not None:
                back.join()

    def pass_back(self, far, near, left):
        passed = 0
        with contextlib.suppress(OSError):
            while True:
                data = far.recv(65536)
                most = left()
                if most is not None:
                    data = data[:most - passed]
                    passed += len(data)
                near.sendall(data)
                if not data or passed == most:
                    break
        with contextlib.suppress(OSError):
            near.shutdown(socket.SHUT_RDWR)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.closed = True
        with contextlib.suppress(OSError):
            socket.create_connection(self.listener.getsockname()).close()
        for thread in self.threads:
            thread.join()
        self.listener.close()


class Jobs(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.d = harness.Daemon("--jobs-share=64")
        cls.client = client(cls.d)
        cls.scene = cls.client.upload(harness.grid_scene(2, "jobs"))

    @classmethod
    def tearDownClass(cls):
        cls.client.close()
        cls.d.kill()

    def turn(self, scene=None, frames=6, **more):
        return (scene or self.scene).sequence(
            **{**SMALL, "turntable": {"elevation_deg": 20}, "frames": frames, **more})

    def test_render(self):
        job = self.scene.render_job(**SMALL)
        self.assertEqual(job.wait(600).state, "successful")
        self.assertEqual((job.info["kind"], job.progress), ("render", 1))
        picture = self.scene.render(**TINY)
        self.assertEqual(job.result().bytes, picture.bytes)
        self.assertEqual(job.frame(0).bytes, picture.bytes)
        self.assertIn("successful", repr(job))
        self.assertIn(job.id, [j.id for j in self.client.jobs()])
        self.assertIn(job.id, [j.id for j in self.client.jobs("successful")])
        self.assertNotIn(job.id, [j.id for j in self.client.jobs("failed")])
        self.assertEqual(self.client.job(job.id).info, job.info)
        job.delete()
        self.assertRaises(penumbra.NotFound, job.refresh)
        job.delete()
        self.assertRaises(penumbra.NotFound, lambda: list(job.frames()))

    def test_what_is_no_job(self):
        with self.assertRaises(penumbra.PenumbraError):
            self.scene.render_job(**{**SMALL, "technique": "temporal"}, session="x")
        with self.assertRaises(penumbra.Invalid) as caught:
            self.turn(interpolation="round")
        self.assertEqual(caught.exception.pointer, "/sequence/interpolation")

    def test_sequence(self):
        job = self.turn()
        frames = {frame.number: frame for frame in job.frames()}
        self.assertEqual(sorted(frames), list(range(6)))
        self.assertEqual(job.state, "successful")
        self.assertEqual({frame.total for frame in frames.values()}, {6})
        self.assertEqual(max(frame.done for frame in frames.values()), 6)
        alone = self.d.render(self.scene.id, job.frame_request(4))
        self.assertEqual(frames[4].picture.bytes, alone.body)
        with zipfile.ZipFile(io.BytesIO(job.result())) as archive:
            self.assertEqual(len(archive.namelist()), 6)
        self.assertIsNone(self.turn(frames=2, archive="none").result())
        animated = self.turn(frames=2, archive="webp", format="webp").result()
        self.assertEqual(animated.format, "webp")

    def test_events(self):
        job = self.turn(frames=3)
        job.wait(600)
        events = list(job.events())
        self.assertEqual({e.data["frame"] for e in events if e.kind == "frame"}, {0, 1, 2})
        self.assertEqual(events[-1].data["state"], "successful")
        self.assertEqual(list(job.events(events[0].id)), events[1:])
        self.assertEqual(list(job.events(events[-1].id)), [])

    def test_connections_that_break_off(self):
        """At any byte: what was heard is not told again, and nothing is left out."""
        job = self.turn(frames=8)
        job.wait(600)
        whole = list(job.events())
        lengths = [1, 200, 700, 701, 950, 1300, 20, 1600]
        with Cutter(self.d.port, list(lengths)) as cutter, \
                penumbra.Client("http://127.0.0.1:%d" % cutter.listener.getsockname()[1],
                                timeout=600, retries=8) as through:
            again = through.job(job.id)
            with unittest.mock.patch("penumbra._events.time.sleep"):
                self.assertEqual(list(again.events()), whole)
                cutter.lengths[:] = lengths
                pictures = {f.number: f.picture.bytes for f in again.frames()}
        self.assertGreater(cutter.cuts, 4)
        self.assertTrue(any(b"Last-Event-ID: " in request for request in cutter.asked))
        self.assertEqual(pictures, {n: job.frame(n).bytes for n in range(8)})

    def test_no_events_at_all(self):
        """A proxy that does not let them through: then it asks now and then."""
        with Cutter(self.d.port, [0] * 50) as cutter, \
                penumbra.Client("http://127.0.0.1:%d" % cutter.listener.getsockname()[1],
                                timeout=600, retries=2) as through:
            job = self.turn(through.scene(self.scene.id))
            with unittest.mock.patch("penumbra._events.time.sleep"):
                frames = list(job.frames())
        self.assertIn(cutter.cuts, (3, 4))  # one on a kept connection does not count
        self.assertEqual(sorted(f.number for f in frames), list(range(6)))
        self.assertEqual(job.state, "successful")

    def test_cancel(self):
        with self.d.paused():
            job = self.turn(frames=500)
            with self.assertRaises(TimeoutError):
                job.wait(0.1)
            job.cancel()
        with self.assertRaises(penumbra.JobFailed) as caught:
            job.wait(600)
        self.assertEqual((job.state, caught.exception.job, caught.exception.problem),
                         ("dismissed", job, None))
        self.assertEqual(job.cancel().state, "dismissed")
        self.assertRaises(penumbra.JobFailed, lambda: list(job.frames()))
        self.assertRaises(penumbra.JobFailed, job.result)
        with self.d.paused():
            job = self.turn(frames=500)
            job.delete()
        self.assertRaises(penumbra.NotFound, job.refresh)

    def test_failed(self):
        """A job whose scene goes says so, and what it had made before is there."""
        scene = self.client.upload(harness.grid_scene(1, "to go"))
        with self.d.paused():
            job = self.turn(scene, frames=300)
            scene.delete()
        with self.assertRaises(penumbra.JobFailed) as caught:
            for frame in job.frames():
                pass
        self.assertEqual(job.state, "failed")
        self.assertIsInstance(caught.exception.problem, penumbra.Problem)
        self.assertTrue(caught.exception.problem.detail)

    def test_daemon_killed_under_way(self):
        """The job goes on with the next one, and the loop with it."""
        with socket.socket() as s:
            s.bind(("127.0.0.1", 0))
            port = s.getsockname()[1]
        d = harness.Daemon("--listen=127.0.0.1:%d" % port, store=self.d.store + "-2")
        self.addCleanup(d.kill)
        with client(d, retries=10**6, retry_for=1e6) as patient:
            job = self.turn(patient.upload(harness.grid_scene(2, "jobs")), frames=12)
            frames = job.frames()
            got = [next(frames)]
            d.process.kill()
            d.process.wait()
            d.start()
            with unittest.mock.patch("penumbra._events.PAUSE_S", 0.1):
                got += frames
            self.assertEqual(sorted(f.number for f in got), list(range(12)))


if __name__ == "__main__":
    harness.main()
