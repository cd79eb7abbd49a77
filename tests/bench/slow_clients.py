#!/usr/bin/env python3
"""What a thousand slow clients cost those who are quick.

    slow_clients.py [--bin DIR] [--clients 1000] [--addresses 20] [--rounds 6] [--requests 300]

Rounds without them, beside them, and beside as many at another service of the same machine (what their
processors cost everybody) alternate. In each, requests of their own connections follow one another:
a method's description, a small picture from the cache, and now and then a new one and an upload. A third
of the slow clients send headers, a third bodies, a third read answers, byte by byte, and come again
when they are put out. Printed: how many of the quick were answered, and their times.
"""
import argparse
import os
import sys
import time

sys.path.insert(0, os.path.join(os.path.dirname(__file__), "..", "api"))


def quick(daemon, scene, requests, name):
    """Milliseconds of the answered, and how many were not."""
    import harness
    times, lost = [], 0
    for i in range(requests):
        begin = time.monotonic()
        try:
            if i % 50 == 49:
                status = daemon.exchange("POST", "/v1/scenes", harness.grid_scene(2, "%s %d" % (name, i)),
                                         {"Content-Type": "model/gltf-binary"}).status
                begin = None  # an import takes as long as it takes
            elif i % 2:
                status = daemon.exchange("GET", "/v1/techniques/none").status
            else:
                status = daemon.exchange("GET", "/v1/scenes/%s/render?technique=hard&width=64&height=48"
                                         % scene).status
        except OSError:
            status = 0
        lost += status not in (200, 201)
        if begin and status == 200:
            times.append((time.monotonic() - begin) * 1e3)
    return times, lost


def percentile(times, share):
    return sorted(times)[min(len(times) - 1, int(len(times) * share))]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--bin")
    parser.add_argument("--clients", type=int, default=1000)
    parser.add_argument("--addresses", type=int, default=20)
    parser.add_argument("--rounds", type=int, default=6)
    parser.add_argument("--requests", type=int, default=300)
    given = parser.parse_args()
    if given.bin:
        os.environ["PENUMBRA_BIN"] = given.bin
    import harness
    import swarm
    daemon, other = harness.Daemon(), harness.Daemon()
    scene, elsewhere = (d.upload(harness.grid_scene(2, "slow clients")) for d in (daemon, other))
    alone, beside, apart, lost = [], [], [], 0
    for n in range(given.rounds):
        times, more = quick(daemon, scene, given.requests, "alone %d" % n)
        alone += times
        with swarm.Swarm(other.port, elsewhere, given.clients, given.addresses):
            apart += quick(daemon, scene, given.requests, "apart %d" % n)[0]
        with swarm.Swarm(daemon.port, scene, given.clients, given.addresses) as slow:
            times, missing = quick(daemon, scene, given.requests, "beside %d" % n)
        beside += times
        lost += more + missing
        print("round %d: %d slow clients were put out %d times" %
              (n, given.clients, slow.put_out.value), flush=True)
    print("answered: %d of %d" % (2 * given.rounds * given.requests - lost,
                                  2 * given.rounds * given.requests))
    for share in (0.5, 0.99):
        a, b, c = (percentile(times, share) for times in (alone, beside, apart))
        print("p%g: alone %.2f ms, beside them %.2f ms: %.2f times; beside those of another service "
              "%.2f ms: %.2f times" % (share * 100, a, b, b / a, c, c / a))
    daemon.stop()
    other.stop()


if __name__ == "__main__":
    main()
