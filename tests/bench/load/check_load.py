"""The load generator against a service whose behaviour is known."""
import asyncio
import os
import random
import sys
import unittest

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import histogram  # noqa: E402
import open_loop  # noqa: E402

STALL_S = 1.0


class Percentiles(unittest.TestCase):
    def test_buckets(self):
        before = -1
        for value in list(range(5000)) + [1 << k for k in range(13, 40)]:
            bucket = histogram.bucket_of(value)
            self.assertGreaterEqual(bucket, before)
            before = bucket
            self.assertGreaterEqual(histogram.most_in(bucket), value)
            self.assertLess(histogram.most_in(bucket), value * (1 + 2 / histogram.SUB_BUCKETS) + 1)
            self.assertEqual(histogram.bucket_of(histogram.most_in(bucket)), bucket)

    def test_against_sorted(self):
        dice, h = random.Random(3), histogram.Histogram()
        values = sorted(dice.lognormvariate(-3, 2) for _ in range(2000))
        for value in values:
            h.add(value)
        for percent in (1, 50, 90, 99, 100):
            exact = values[-(-len(values) * percent // 100) - 1]
            self.assertAlmostEqual(h.percentile(percent) / exact, 1, delta=0.04)
        self.assertIsNone(histogram.Histogram().percentile(50))


class OpenLoop(unittest.TestCase):
    def test_counts(self):
        """Of every five: 200, 503 with and without Retry-After, 504, and one that is cut off."""
        async def serve(reader, writer):
            number = int((await reader.readuntil(b"\r\n\r\n")).split()[1][1:])
            answers = [b"200 OK\r\n", b"503 Busy\r\nRetry-After: 1\r\n", b"429 Busy\r\n",
                       b"504 Late\r\n", None]
            if answers[number % 5]:
                writer.write(b"HTTP/1.1 " + answers[number % 5] + b"Content-Length: 2\r\n\r\nok")
            writer.close()

        async def run():
            server = await asyncio.start_server(serve, "127.0.0.1", 0)
            numbers = iter(range(10 ** 6))
            tally = await open_loop.run(
                server.sockets[0].getsockname()[:2],
                lambda dice: open_loop.http_request("GET", "/%d" % next(numbers)), 100, 1, 1, 4)
            server.close()
            return tally
        t = asyncio.run(run())
        self.assertGreater(t.sent, 50)
        kinds = [t.good.total, t.rejected.total, t.late, t.failed]
        for kind, share in zip(kinds, (1, 2, 1, 1)):
            self.assertLessEqual(abs(kind - share * t.sent / 5), share)
        self.assertEqual(sum(kinds), t.sent)
        self.assertEqual(t.hung, 0)
        self.assertLessEqual(abs(t.without_retry_after - t.sent / 5), 1)

    def test_from_the_intended_start(self):
        """A service that does nothing for a second, then answers at once: those that should have been
        sent meanwhile waited half of it in the mean, though each took no time once it was sent."""
        async def run():
            loop = asyncio.get_running_loop()
            free = loop.time() + STALL_S

            async def serve(reader, writer):
                await reader.readuntil(b"\r\n\r\n")
                await asyncio.sleep(max(0, free - loop.time()))
                writer.write(b"HTTP/1.1 200 OK\r\nContent-Length: 0\r\n\r\n")
                writer.close()
            server = await asyncio.start_server(serve, "127.0.0.1", 0)
            tally = await open_loop.run(
                server.sockets[0].getsockname()[:2],
                lambda dice: open_loop.http_request("GET", "/"), 100, STALL_S, 5, 4)
            server.close()
            return tally
        t = asyncio.run(run())
        self.assertEqual(t.good.total, t.sent)
        self.assertGreater(t.good.percentile(50), 0.3 * STALL_S)
        self.assertGreater(t.good.percentile(99), 0.9 * STALL_S)


if __name__ == "__main__":
    unittest.main(verbosity=2)
