#!/usr/bin/env python3
"""What the daemon does with more than it can do.

    run.py [--bin DIR] [--seconds 20] [--mix render,compare,upload,mixed] [--svg FILE] [curve] [fair]

curve  For each mix: what is to be had when eight clients ask one after the other, then goodput
       (answers within their deadline, a second) at shares of that up to three times of it, in an open
       loop; how soon rejects come, whether each has Retry-After, and whether who comes back then is
       served. Must hold: goodput at three times >= .9 of the peak, rejects' p99 <= 20 ms (from when
       they were sent), nothing hangs.
fair   One client asks now and then, alone and beside one that floods: the ratio of its p95. Must
       hold: <= 2.
Without a name both. Exits 1 when something does not hold.
"""
import argparse
import asyncio
import multiprocessing
import os
import random
import sys
import time

FOLDER = os.path.dirname(os.path.abspath(__file__))
sys.path[:0] = [FOLDER, os.path.join(FOLDER, "../claims"), os.path.join(FOLDER, "../../api")]

import mixes  # noqa: E402
import open_loop  # noqa: E402

SHARES = (0.25, 0.5, 0.75, 1, 1.5, 2, 3)
DEADLINE_S = 5
FLOOD = 48  # requests at a time
GOODPUT, REJECT_S, FAIR = 0.9, 0.020, 2


def flood(target, scene, seed):
    """In a process of its own: it takes no time of the one that measures."""
    make = mixes.Mixes(scene, None, 1000 * DEADLINE_S).render
    asyncio.run(open_loop.run_closed(target, make, FLOOD, 3600, DEADLINE_S, seed))


class Bench:
    def __init__(self, options):
        import harness  # reads PENUMBRA_BIN when it is imported
        self.options, self.failed, self.seeds = options, False, 0
        self.daemon = harness.Daemon("--client-share=0", "--quarantine-s=0")
        scene = self.daemon.upload(harness.grid_scene(mixes.SCENE_TRIANGLES))
        self.mixes = mixes.Mixes(
            scene, lambda name: harness.grid_scene(mixes.SCENE_TRIANGLES, name),
            1000 * DEADLINE_S)
        self.target = ("127.0.0.1", self.daemon.port)

    def close(self):
        self.daemon.stop(timeout=120)
        self.daemon.kill()

    def judge(self, text, figure, holds):
        print("  %-58s %s  %s" % (text, figure, "holds" if holds else "DOES NOT HOLD"), flush=True)
        self.failed |= not holds

    def seed(self):
        """Another one for every run: what was asked before is in the cache."""
        self.seeds += 1
        return self.seeds

    def run(self, coroutine):
        return asyncio.run(coroutine)

    def curve(self, name):
        make, seconds = getattr(self.mixes, name), self.options.seconds
        print(name)
        self.run(open_loop.run_closed(self.target, make, 2, 3, DEADLINE_S, self.seed()))  # its cost is learned
        alone = self.run(open_loop.run_closed(self.target, make, 8, seconds / 2, DEADLINE_S, self.seed()))
        capacity = alone.good.total / alone.seconds
        print("  to be had: %.1f/s; %s" % (capacity, alone.told()))
        points = []
        for share in SHARES:
            tally = self.run(open_loop.run(self.target, make, share * capacity, seconds, DEADLINE_S,
                                           self.seed()))
            points.append((share * capacity, tally.good.total / tally.span))
            print("  %.2f of it: goodput %.1f/s; %s" % (share, points[-1][1], tally.told()),
                  flush=True)
        peak = max(goodput for _, goodput in points)
        self.judge("goodput at three times, of the peak", "%.2f" % (points[-1][1] / peak),
                   points[-1][1] >= GOODPUT * peak)
        p99 = tally.hurried.percentile(99)
        self.judge("rejects, p99", "-" if p99 is None else "%.0f ms" % (1e3 * p99),
                   p99 is None or p99 <= REJECT_S)
        self.judge("rejects without Retry-After", tally.without_retry_after,
                   not tally.without_retry_after)
        self.judge("that hang or fail", tally.hung + tally.failed,
                   not tally.hung + tally.failed)
        again = self.run(open_loop.run(self.target, make, SHARES[-1] * capacity, seconds, DEADLINE_S,
                                       self.seed(), retry=True))
        print("  of those who came back after it %d of %d were served" % (
            again.retried_well, again.retried))
        return name, points

    def fair(self):
        render = self.mixes.render
        quick = (*self.target, )

        self.run(open_loop.run_closed(quick, render, 2, 3, DEADLINE_S, self.seed()))
        alone = self.run(self.sparse(quick, render))
        load = multiprocessing.Process(target=flood, daemon=True,
                                       args=(quick, self.mixes.scene, self.seed()))
        load.start()
        time.sleep(2)
        beside = self.run(self.sparse(quick, render))
        load.terminate()
        load.join()
        p = [t.good.percentile(95) for t in (alone, beside)]
        print("fair\n  alone %s\n  beside %s" % (alone.told(), beside.told()))
        self.judge("p95 beside one that floods, of alone", "%.2f" % (p[1] / p[0]),
                   p[1] <= FAIR * p[0])

    async def sparse(self, target, make):
        """Two a second, from an address of its own."""
        tally, dice = open_loop.Tally(), random.Random(self.seed())
        for _ in range(2 * self.options.seconds):
            began = asyncio.get_running_loop().time()
            request = make(dice)
            status, _, _ = await open_loop.exchange(*target, request, source="127.0.0.9")
            tally.sent += 1
            if status == 200:
                tally.good.add(asyncio.get_running_loop().time() - began)
            else:
                tally.failed += 1
            await asyncio.sleep(0.5)
        return tally


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bin", default=os.path.join(FOLDER, "../../../build/dev/bin"))
    parser.add_argument("--seconds", type=int, default=20)
    parser.add_argument("--mix", default=",".join(mixes.NAMES))
    parser.add_argument("--svg")
    parser.add_argument("what", nargs="*", choices=["curve", "fair", []])
    options = parser.parse_args()
    os.environ["PENUMBRA_BIN"] = os.path.abspath(options.bin)
    bench = Bench(options)
    curves = []
    if not options.what or "curve" in options.what:
        curves = [bench.curve(name) for name in options.mix.split(",")]
    if not options.what or "fair" in options.what:
        bench.fair()
    bench.close()
    if options.svg and curves:
        import svg
        with open(options.svg, "w") as file:
            file.write(svg.curves(curves, "requests a second", "answered within their deadline"))
    return 1 if bench.failed else 0


if __name__ == "__main__":
    sys.exit(main())
