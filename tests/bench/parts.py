#!/usr/bin/env python3
"""What watching a picture get better costs.

    parts.py [--bin DIR] [--rounds 3] [--method multisample] [--samples 1024] [--size 800x600]

Asks for the same picture plain and in parts, in turn, each made anew: prints when the first part is
there, beside what a pcss picture takes, how many parts come, and how much longer the last of them
takes than the plain picture. The last part is compared with it, byte for byte.
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


def ask(daemon, scene, request, accept):
    """Milliseconds until the first part is whole and until the end, and the parts."""
    start = time.monotonic()
    connection = http.client.HTTPConnection("127.0.0.1", daemon.port)
    connection.request("POST", "/v1/scenes/%s/render" % scene, json.dumps(request), {
        "Content-Type": "application/json", "Cache-Control": "no-cache", "Accept": accept})
    answer = connection.getresponse()
    if answer.status != 200:
        raise SystemExit(answer.read())
    boundary = answer.headers["Content-Type"].partition("boundary=")[2].encode()
    body, first = b"", None
    while piece := answer.read1(1 << 20):
        body += piece
        if boundary and first is None and body.count(boundary) > 1:
            first = 1e3 * (time.monotonic() - start)
    end = 1e3 * (time.monotonic() - start)
    connection.close()
    if not boundary:
        return first, end, [body]
    parts = [p.split(b"\r\n\r\n", 1)[1] for p in body.split(b"--" + boundary)[1:-1]]
    return first, end, [p.removesuffix(b"\r\n") for p in parts]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--bin", default=os.path.join(os.path.dirname(__file__),
                                                      "../../build/dev/bin"))
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--method", default="multisample")
    parser.add_argument("--samples", type=int, default=1024)
    parser.add_argument("--size", default="800x600")
    options = parser.parse_args()
    os.environ["PENUMBRA_BIN"] = options.bin
    import harness  # reads PENUMBRA_BIN when it is imported
    width, height = map(int, options.size.split("x"))
    common = {"width": width, "height": height, "deadline_ms": 3600000}
    request = dict(common, technique={"name": options.method, "params": {"samples": options.samples}})
    quick = dict(common, technique={"name": "pcss"})
    daemon = harness.Daemon("--client-share=0")
    try:
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "demo.glb")
            subprocess.run([os.path.join(options.bin, "penumbra"), "generate", "demo", "-o", path],
                           check=True, stdout=subprocess.DEVNULL)
            with open(path, "rb") as file:
                scene = daemon.upload(file.read())
        picture = "multipart/x-mixed-replace"
        for warm in (quick, dict(request, technique={"name": options.method,
                                                     "params": {"samples": 16}})):
            ask(daemon, scene, warm, picture)
        first, ratios, counts, fast = [], [], [], []
        for _ in range(options.rounds):
            fast.append(ask(daemon, scene, quick, "image/png")[1])
            _, plain, (body,) = ask(daemon, scene, request, "image/png")
            begun, end, parts = ask(daemon, scene, request, picture)
            if parts[-1] != body:
                raise SystemExit("the last part is not the plain answer")
            first.append(begun)
            ratios.append(end / plain)
            counts.append(len(parts))
            print("plain %.0f ms; parts: first %.0f, last %.0f ms, %d of them" % (
                plain, begun, end, len(parts)), flush=True)
        print("first part: %.0f ms, %.2f times a pcss picture" % (
            statistics.median(first), statistics.median(first) / statistics.median(fast)))
        print("parts: %s" % ", ".join(map(str, counts)))
        print("all parts: %.3f times the plain picture (%s)" % (
            statistics.median(ratios), ", ".join("%.3f" % r for r in ratios)))
    finally:
        daemon.kill()


if __name__ == "__main__":
    main()
