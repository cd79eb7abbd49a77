"""An open loop: requests arrive as a Poisson process does, whatever has become of those before, and
their latency counts from when they were meant to begin, so that a service that stands still is seen
to (what is called coordinated omission hides it)."""
import asyncio
import random

from histogram import Histogram

PATIENCE = 30  # s beyond its deadline after which a request counts as hanging


class Tally:
    """What became of a run's requests."""

    def __init__(self):
        self.good, self.rejected, self.hurried = Histogram(), Histogram(), Histogram()
        self.late = self.failed = self.hung = self.without_retry_after = self.sent = 0
        self.retried = self.retried_well = 0
        self.reasons = {}

    def told(self):
        def ms(seconds):
            return "-" if seconds is None else "%.0f" % (1e3 * seconds)
        return ("%d sent, %d good (p50 %s, p99 %s ms), %d rejected (p99 %s ms), %d at their deadline, "
                "%d failed, %d hung" % (
                    self.sent, self.good.total, ms(self.good.percentile(50)),
                    ms(self.good.percentile(99)), self.rejected.total,
                    ms(self.rejected.percentile(99)), self.late, self.failed, self.hung) +
                "".join("; %d x %s" % (n, r) for r, n in sorted(self.reasons.items())))


async def exchange(address, port, request, source=None):
    """Sends one request on a connection of its own: (status, headers, body)."""
    reader, writer = await asyncio.open_connection(
        address, port, local_addr=(source, 0) if source else None)
    try:
        writer.write(request)
        await writer.drain()
        head = (await reader.readuntil(b"\r\n\r\n")).decode("latin-1").split("\r\n")
        headers = {k.lower(): v.strip() for k, v in (line.split(":", 1) for line in head[1:] if line)}
        if "content-length" in headers:
            body = await reader.readexactly(int(headers["content-length"]))
        else:
            body = await reader.read()
        return int(head[0].split()[1]), headers, body
    finally:
        writer.close()


def http_request(method, path, body=b"", **headers):
    lines = ["%s %s HTTP/1.1" % (method, path), "Host: localhost", "Connection: close"]
    lines += ["%s: %s" % (k.replace("_", "-"), v) for k, v in headers.items()]
    if body:
        lines.append("Content-Length: %d" % len(body))
    return "\r\n".join(lines).encode() + b"\r\n\r\n" + body


async def send(tally, target, request, deadline_s, meant, retry):
    loop = asyncio.get_running_loop()
    tally.sent += 1
    began = loop.time()
    try:
        status, headers, body = await asyncio.wait_for(
            exchange(*target, request), deadline_s + PATIENCE)
    except asyncio.TimeoutError:
        tally.hung += 1
        return
    except (OSError, asyncio.IncompleteReadError) as error:
        tally.failed += 1
        reason = type(error).__name__
        tally.reasons[reason] = tally.reasons.get(reason, 0) + 1
        return
    now = loop.time()
    if status in (200, 201):
        tally.good.add(now - meant)
    elif status in (429, 503):
        tally.rejected.add(now - meant)
        tally.hurried.add(now - began)
        if "retry-after" not in headers:
            tally.without_retry_after += 1
        elif retry:
            await asyncio.sleep(int(headers["retry-after"]))
            again = Tally()
            await send(again, target, request, deadline_s, loop.time(), False)
            tally.retried += 1
            tally.retried_well += again.good.total
    elif status == 504:
        tally.late += 1
    else:
        tally.failed += 1
        reason = "%d %s" % (status, body[:160].decode("latin-1"))
        tally.reasons[reason] = tally.reasons.get(reason, 0) + 1


async def run(target, make, rate, seconds, deadline_s, seed, retry=False):
    """`rate` requests a second for so long, then waits for all of them: a Tally."""
    loop = asyncio.get_running_loop()
    dice, tally, tasks = random.Random(seed), Tally(), []
    start = loop.time()
    due = start + dice.expovariate(rate)
    while due < start + seconds:
        delay = due - loop.time()
        if delay > 0:
            await asyncio.sleep(delay)
        tasks.append(asyncio.ensure_future(
            send(tally, target, make(dice), deadline_s, due, retry)))
        due += dice.expovariate(rate)
    await asyncio.gather(*tasks)
    tally.seconds = loop.time() - start
    tally.span = seconds
    return tally


async def run_closed(target, make, clients, seconds, deadline_s, seed):
    """So many at a time, each sending when it has its answer: what floods, and what there is to be had."""
    loop = asyncio.get_running_loop()
    dice, tally = random.Random(seed), Tally()
    start = loop.time()

    async def client():
        while loop.time() < start + seconds:
            before = tally.good.total
            await send(tally, target, make(dice), deadline_s, loop.time(), False)
            if tally.good.total == before:
                await asyncio.sleep(0.05)
    await asyncio.gather(*[client() for _ in range(clients)])
    tally.seconds = loop.time() - start
    return tally
