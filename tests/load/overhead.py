#!/usr/bin/env python3
"""What HTTP, JSON, queue and transport cost per render: the client's total minus every stage that
the worker measured. The promise is a median under 2 ms; exits 1 when it is broken.

Every request is a different picture, so that nothing comes from a cache, over one connection.
"""
import http.client
import json
import os
import re
import sys
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "../api"))
import harness

REQUESTS = int(os.environ.get("PENUMBRA_LOAD_REQUESTS", "300"))
LIMIT_MS = 20.0
ENGINE = ("load", "gbuffer", "shadow", "technique", "shade", "readback", "encode")


def percentile(values, p):
    values = sorted(values)
    return values[min(len(values) - 1, int(p / 100 * len(values)))]


def main():
    d = harness.Daemon("--result-cache=0")
    scene = d.upload(harness.grid_scene(4))
    d.render(scene, harness.SMALL)
    connection = http.client.HTTPConnection("127.0.0.1", d.port)
    overhead, inside = [], []
    for n in range(REQUESTS):
        body = json.dumps(dict(harness.SMALL, exposure_ev=n / 1000))
        start = time.perf_counter()
        connection.request("POST", "/v1/scenes/%s/render" % scene, body,
                           {"Content-Type": "application/json"})
        response = connection.getresponse()
        response.read()
        total = (time.perf_counter() - start) * 1e3
        assert response.status == 200, response.status
        stages = {k: float(v) for k, v in re.findall(r"([\w-]+);dur=([\d.]+)",
                                                     response.getheader("Server-Timing"))}
        engine = sum(stages[s] for s in ENGINE)
        if n >= 20:
            overhead.append(total - engine)
            inside.append(stages["total"] - engine)
    d.stop()
    d.kill()
    for name, values in (("seen by the client", overhead), ("seen by the server", inside)):
        print("overhead %s: p50 %.2f ms, p95 %.2f ms, p99 %.2f ms, %d renders" % (
            name, percentile(values, 50), percentile(values, 95), percentile(values, 99), len(values)))
    ok = percentile(overhead, 50) < LIMIT_MS
    if not ok:
        print("above %.1f ms at p50" % LIMIT_MS)
    sys.exit(0 if ok else 1)


if __name__ == "__main__":
    main()
