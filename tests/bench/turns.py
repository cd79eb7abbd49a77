#!/usr/bin/env python3
"""What renders that take turns cost each other.

    turns.py [--bin DIR] [--tries 100]

While a multisample picture of 256 maps, 16 jittered frames, 1600 x 1200 is being made, another client
asks for pcss pictures of 480 x 360: prints their times beside those of an idle daemon. Then long
renders of all sampled methods are begun and left: prints how long after each leaving the worker has
nothing to do any more, beside what a small render takes, which asking costs too.
"""
import argparse
import http.client
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, os.path.join(os.path.dirname(__file__), "..", "api"))

LONG = {"technique": {"name": "multisample", "params": {"samples": 256}}, "antialias": 16,
        "width": 1600, "height": 1200, "deadline_ms": 3600000}
SHORT = {"technique": {"name": "pcss"}, "width": 480, "height": 360}
SAMPLED = ("multisample", "raytraced", "stochastic", "adaptive-sampling", "accumulation", "cascaded",
           "bilateral", "screen-space")


def begin(daemon, scene, request):
    connection = http.client.HTTPConnection("127.0.0.1", daemon.port)
    connection.request("POST", "/v1/scenes/%s/render" % scene, json.dumps(request),
                       {"Content-Type": "application/json", "Cache-Control": "no-cache"})
    return connection


def timed(daemon, scene, request):
    start = time.monotonic()
    answer = daemon.render(scene, request)
    if answer.status != 200:
        raise SystemExit(answer.body)
    return 1e3 * (time.monotonic() - start)


def describe(times):
    times = sorted(times)
    return "median %.0f, p99 %.0f, worst %.0f ms" % (
        statistics.median(times), times[max(0, round(0.99 * len(times)) - 1)], times[-1])


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--bin", default=os.path.join(os.path.dirname(__file__),
                                                      "../../build/dev/bin"))
    parser.add_argument("--tries", type=int, default=100)
    options = parser.parse_args()
    os.environ["PENUMBRA_BIN"] = options.bin
    import harness  # reads PENUMBRA_BIN when it is imported
    daemon = harness.Daemon("--client-share=0")
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "demo.glb")
        subprocess.run([os.path.join(options.bin, "penumbra"), "generate", "demo", "-o", path],
                       check=True, stdout=subprocess.DEVNULL)
        with open(path, "rb") as file:
            scene = daemon.upload(file.read())
    try:
        timed(daemon, scene, SHORT)
        alone = [timed(daemon, scene, SHORT) for _ in range(20)]
        print("pcss alone:           " + describe(alone), flush=True)
        long = begin(daemon, scene, LONG)
        harness.wait(lambda: daemon.metric("penumbra_renders_running") == 1)
        beside = []
        for _ in range(options.tries):
            time.sleep(0.5)
            beside.append(timed(daemon, scene, SHORT))
        if daemon.metric("penumbra_renders_running") != 1:
            print("the long render has ended too early to tell")
        print("beside the long one:  " + describe(beside), flush=True)
        long.close()
        harness.wait(lambda: daemon.metric("penumbra_renders_running") == 0)
        small = dict(SHORT, width=64, height=48, technique={"name": "none"})
        timed(daemon, scene, small)
        idle = [timed(daemon, scene, small) for _ in range(20)]
        after = []
        for n in range(options.tries):
            name = SAMPLED[n % len(SAMPLED)]
            left = begin(daemon, scene, dict(LONG, technique=name, width=800, height=600))
            harness.wait(lambda: daemon.metric("penumbra_renders_running") == 1)
            time.sleep(0.3 + 0.01 * (n % 10))
            left.close()
            start = time.monotonic()
            harness.wait(lambda: daemon.metric("penumbra_renders_running") == 0, step=0.002)
            after.append(1e3 * (time.monotonic() - start))
        print("small render, idle:   " + describe(idle))
        print("worker free after:    " + describe(after))
    finally:
        daemon.kill()


if __name__ == "__main__":
    main()
