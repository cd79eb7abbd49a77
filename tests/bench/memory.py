#!/usr/bin/env python3
"""What a worker holds while it draws everything there is with a small budget.

    memory.py [--bin DIR] [--budget 512] [--minutes 10] [--limit 700] [--scenes DIR] [--seed 1]
              [--share 0.25]

Every method in random order on 24 scenes (the .glb files of --scenes, else made by `penumbra
generate`), with random sizes and with random values of a --share of its parameters, one after the
other. Prints every new peak of the worker's resident memory with the request that made it, counts
the answers by status, and exits 1 when the peak is above --limit (MiB), or when an answer is neither
a picture nor a refusal that says why (413, 422, 504).
"""
import argparse
import collections
import glob
import os
import random
import re
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, os.path.join(os.path.dirname(__file__), "..", "api"))

SCENES = 24
MOST_BYTES = 20e6  # of a file: one that is larger than the budget is refused, which shows nothing
GENERATED = ("demo", "foliage", "columns", "hairball")
SIZES = ((64, 64), (200, 150), (400, 300), (800, 600), (64, 600), (800, 64))
FINE = (200, 413, 422, 504)


def some(row, rnd):
    """Any value that a parameter may have, small ones as often as large ones."""
    if row.get("choices"):
        return rnd.choice(row["choices"])
    if row["type"] == "flag":
        return rnd.random() < 0.5
    low, high = row["min"], row["max"]
    value = low + (high - low) * rnd.random() ** 4
    return value if row["type"] == "float" else int(value)


def request(technique, share, rnd):
    width, height = rnd.choice(SIZES)
    params = {row["name"]: some(row, rnd) for row in technique["params"]
              if row["components"] == 1 and rnd.random() < share}
    return {"width": width, "height": height, "deadline_ms": 8000,
            "technique": {"name": technique["name"], "params": params}}


def generated(folder, programs):
    for n in range(SCENES):
        path = os.path.join(folder, "%d.glb" % n)
        kind = GENERATED[n % len(GENERATED)]
        subprocess.run([os.path.join(programs, "penumbra"), "generate", kind, "-o", path,
                        "--triangles", str(20000 * (n + 1)), "--seed", str(n + 1)],
                       check=True, stdout=subprocess.DEVNULL)
        yield path


def resident(pid, field):
    with open("/proc/%d/status" % pid, encoding="ascii") as status:
        return int(re.search(field + r":\s*(\d+) kB", status.read())[1]) / 1024


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--bin", default=os.path.join(os.path.dirname(__file__),
                                                      "../../build/dev/bin"))
    parser.add_argument("--budget", type=int, default=512, help="--gpu-memory, MiB")
    parser.add_argument("--minutes", type=float, default=10)
    parser.add_argument("--limit", type=float, default=700, help="most of resident memory, MiB")
    parser.add_argument("--scenes", help="a folder of .glb files")
    parser.add_argument("--share", type=float, default=0.25, help="of parameters off their default")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    os.environ["PENUMBRA_BIN"] = options.bin
    import harness  # reads PENUMBRA_BIN when it is imported
    rnd = random.Random(options.seed)
    daemon = harness.Daemon("--gpu-memory=%dM" % options.budget)
    with tempfile.TemporaryDirectory() as folder:
        if options.scenes:
            paths = sorted(p for p in glob.glob(os.path.join(options.scenes, "**/*.glb"),
                                                recursive=True) if os.path.getsize(p) < MOST_BYTES)
        else:
            paths = list(generated(folder, options.bin))
        scenes = []
        for path in paths[:SCENES]:
            with open(path, "rb") as file:
                scenes.append((os.path.basename(path), daemon.upload(file.read())))
    techniques = [t for t in daemon.get("/v1/techniques").json()["techniques"]
                  if t["name"] != "auto"]
    end, peak, statuses, pids = time.monotonic() + 60 * options.minutes, 0, {}, set()
    counts = collections.Counter()
    while time.monotonic() < end:
        name, scene = rnd.choice(scenes)
        body = request(rnd.choice(techniques), options.share, rnd)
        answer = daemon.render(scene, body, timeout=120)
        counts[answer.status] += 1
        if answer.status not in FINE:
            statuses[answer.status] = (name, body, answer.body[:300])
        pid = daemon.worker()
        pids.add(pid)
        held = resident(pid, "VmHWM")
        if held > peak:
            peak = held
            print("%5d: peak %4.0f MiB, now %4.0f, counted %4.0f; %s %s" % (
                sum(counts.values()), held, resident(pid, "VmRSS"),
                daemon.metric("penumbra_gpu_bytes") / 2**20, name, body), flush=True)
    daemon.kill()
    print("%d answers %s, %d workers, peak %.0f MiB of a budget of %d" % (
        sum(counts.values()), dict(counts), len(pids), peak, options.budget))
    for status, what in statuses.items():
        print("%d: %s" % (status, what))
    return 1 if statuses or peak > options.limit or len(pids) > 1 else 0


if __name__ == "__main__":
    sys.exit(main())
