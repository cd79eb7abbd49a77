#!/usr/bin/env python3
"""What hundreds of tap counts cost a worker: renders that differ in nothing but numbers.

    program_memory.py [--bin DIR] [--renders 500]

Prints compiles, kept programs and the worker's resident memory, after the first render and after
all of them; exits 1 when another than the first compiles, or memory grows by 30 MB or more.
"""
import argparse
import os
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, os.path.join(os.path.dirname(__file__), "..", "api"))


def look(daemon):
    names = ("compiles_total", "evictions_total")
    values = [int(daemon.metric("penumbra_program_" + name)) for name in names]
    values += [int(daemon.metric("penumbra_programs")), daemon.metric("penumbra_program_bytes")]
    with open("/proc/%d/statm" % daemon.worker(), encoding="ascii") as file:
        resident = int(file.read().split()[1]) * os.sysconf("SC_PAGESIZE")
    return values, resident


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--bin", default=os.path.join(os.path.dirname(__file__),
                                                      "../../build/dev/bin"))
    parser.add_argument("--renders", type=int, default=500)
    options = parser.parse_args()
    os.environ["PENUMBRA_BIN"] = options.bin
    import harness  # reads PENUMBRA_BIN when it is imported
    daemon = harness.Daemon()
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "demo.glb")
        subprocess.run([os.path.join(options.bin, "penumbra"), "generate", "demo", "-o", path],
                       check=True, stdout=subprocess.DEVNULL)
        with open(path, "rb") as file:
            scene = daemon.upload(file.read())

    def render(search, taps):
        answer = daemon.render(scene, {
            "width": 96, "height": 72, "deadline_ms": 600000, "technique": {
                "name": "pcss", "params": {"search_taps": search, "filter_taps": taps}}})
        assert answer.status == 200, answer.body

    begin = time.monotonic()
    render(16, 32)
    first, before = look(daemon)
    middle = time.monotonic()
    for i in range(options.renders):
        render(1 + i % 20, 1 + i // 20 % 256)
    counts, after = look(daemon)
    end = time.monotonic()
    daemon.kill()
    print("first render: %.2f s; %d others: %.3f s each" % (
        middle - begin, options.renders, (end - middle) / options.renders))
    print("compiled %d, then %d more; kept %d, an estimated %.1f MB; evicted %d" % (
        first[0], counts[0] - first[0], counts[2], counts[3] / 1e6, counts[1]))
    print("resident %.1f MB, then %.1f MB more" % (before / 1e6, (after - before) / 1e6))
    return 1 if counts[0] != first[0] or after - before >= 30e6 else 0


if __name__ == "__main__":
    sys.exit(main())
