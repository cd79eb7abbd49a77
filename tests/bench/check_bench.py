#!/usr/bin/env python3
"""Runs penumbra-bench on a tiny scene and checks what it says: check_bench.py PENUMBRA_BENCH"""
import json
import math
import os
import subprocess
import sys
import tempfile

AXES = ("height", "map_size", "light_size", "lights", "triangles")


def fail(text):
    print(text)
    sys.exit(1)


def slope(points):
    """Of log y over log x, by least squares."""
    xs, ys = [math.log(x) for x, _ in points], [math.log(y) for _, y in points]
    mx, my = sum(xs) / len(xs), sum(ys) / len(ys)
    return sum((x - mx) * (y - my) for x, y in zip(xs, ys)) / sum((x - mx) ** 2 for x in xs)


def main():
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "bench.json")
        run = subprocess.run(
            [sys.argv[1], "--scene", "columns", "--triangles", "9000,20000,40000", "--resolutions", "60,90",
             "--map-sizes", "256,128", "--light-sizes", "0.6,0.2", "--lights", "1,2", "--techniques",
             "none,hard,pcss", "--runs", "3", "--warm-up", "1", "--moving-light", "--json", path],
            capture_output=True, text=True, timeout=120)
        if run.returncode:
            fail(run.stdout + run.stderr)
        with open(path) as file:
            got = json.load(file)
    if not got["complete"] or got["scene"] != "columns":
        fail("not complete")
    names = {s["method"] for s in got["samples"]}
    if names != {"none", "hard", "pcss"}:
        fail("methods: %s" % names)
    for name in names:
        mine = [s for s in got["samples"] if s["method"] == name]
        base = mine[0]
        # The base, one point for each further value of each axis; none has no map.
        if len(mine) != (6 if name == "none" else 7):
            fail("%s: %d points" % (name, len(mine)))
        for sample in mine[1:]:
            moved = [axis for axis in AXES if sample[axis] != base[axis]]
            if len(moved) != 1:
                fail("%s: moved along %s" % (name, moved))
        for sample in mine:
            passes = sum(p["ms"] for p in sample["passes"])
            if not (0 < sample["low_ms"] <= sample["median_ms"] <= sample["high_ms"]) or \
                    not 0.3 < passes / sample["median_ms"] < 3:
                fail("times: %s" % sample)
        shadows = [p for s in mine for p in s["passes"] if p["stage"] == "shadow"]
        if (name == "none") == bool(shadows):
            fail("%s: passes %s" % (name, shadows))
        along = [(s["triangles"], s["median_ms"]) for s in mine
                 if s is base or s["triangles"] != base["triangles"]]
        said = next(g["exponent"] for g in got["growth"]
                    if g["method"] == name and g["axis"] == "triangles")
        if abs(said - slope(along)) > 0.01:
            fail("%s: exponent %g instead of %g" % (name, said, slope(along)))
    if "Growth with triangles" not in run.stdout:
        fail(run.stdout)
    wrong = [["--lights", "9"], ["--resolutions", "x"], ["--runs", "0"], ["more"]]
    for options in wrong:
        if subprocess.run([sys.argv[1]] + options, capture_output=True).returncode != 2:
            fail("taken: %s" % options)


if __name__ == "__main__":
    main()
