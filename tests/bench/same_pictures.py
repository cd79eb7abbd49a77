#!/usr/bin/env python3
"""Renders a fixed set of requests and prints the SHA-256 of each answer's bytes.

    same_pictures.py [--bin DIR] [--jobs N] [--only SUBSTRING] > before.txt
    same_pictures.py [--bin DIR] --against before.txt [--keep DIR]

The set: every method at its defaults and with every parameter moved off its default, every layer in
every format that takes it, every light type under every method, cameras, antialiasing, tone maps,
textured lights and alpha-masked casters. It holds only what GET /v1/techniques and /openapi.json of
the daemon list, so it grows with them. With --against: prints what differs and exits 1 when a
request known to both gives other bytes; requests that only one of them has are counted, not judged.
"""
import argparse
import hashlib
import json
import os
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor

sys.path.insert(0, os.path.join(os.path.dirname(__file__), "..", "api"))

SIZE = {"width": 160, "height": 120}
LIGHTS = {
    "rect": {"type": "rect", "width": 1.2, "height": 0.6},
    "disk": {"type": "disk", "radius": 0.6},
    "sphere": {"type": "sphere", "radius": 0.5},
    "sun": {"type": "sun", "angular_diameter_deg": 6},
    "point": {"type": "point"},
    "spot": {"type": "spot", "inner_cone_deg": 10, "outer_cone_deg": 40},
}
PLACED = {"position": [2, 4, 1.5], "target": [0, 0, 0]}


def light(kind, **more):
    return {**LIGHTS[kind], **PLACED, **more}


def moved(row):
    """A value of a parameter row that is not its default, or None."""
    default, choices = row.get("default"), row.get("choices")
    if choices:
        return next((c for c in choices if c != default), None)
    if row["type"] == "flag":
        return not default
    if row["components"] != 1:
        return None
    for factor in (0.5, 2, 0.75):
        value = default * factor
        if row["type"] != "float":
            value = int(value)
        if row["min"] <= value <= row["max"] and value != default:
            return value
    return row["min"] if default != row["min"] else None


def requests(techniques, openapi):
    """(name, scene, request) for the whole set."""
    schemas = openapi["components"]["schemas"]
    output = schemas["Output"]["properties"]
    layers, formats = output["layer"]["enum"], output["format"]["enum"]
    for t in techniques:
        name = t["name"]
        yield "method/" + name, "demo", {"technique": name}
        yield "masked/" + name, "foliage", {"technique": name}
        for row in t["params"]:
            value = moved(row)
            if value is not None:
                yield "param/%s/%s=%s" % (name, row["name"], value), "demo", {
                    "technique": {"name": name, "params": {row["name"]: value}}}
        for kind in LIGHTS:
            yield "light/%s/%s" % (kind, name), "columns", {
                "technique": name, "lights": [light(kind)]}
    for layer in layers:
        for form in formats:
            if layer == "all" and form != "exr":
                continue
            for bits in ((8, 16) if form in ("png", "tiff") else (16, 32) if form == "exr" else (0,)):
                for aa in (1, 2):
                    yield "layer/%s/%s/%d/aa%d" % (layer, form, bits, aa), "demo", {
                        "technique": "raytraced" if layer == "error" else "pcss", "antialias": aa,
                        "output": {"layer": layer, "format": form, "bit_depth": bits}}
    for tone in ("none", "reinhard", "aces"):
        yield "tone/" + tone, "demo", {"tone_map": tone, "exposure_ev": 0.5}
    for kind in ("candle-flame", "two-colour"):
        for name in ("pcss", "adaptive", "raytraced", "multisample"):
            yield "textured/%s/%s" % (kind, name), "demo", {
                "technique": name, "lights": [light("rect", texture={"pattern": kind})]}
    for name in ("pcss", "vssm", "erosion", "raytraced", "stochastic"):
        yield "lights/two/" + name, "demo", {"technique": name, "lights": [
            light("rect"), {**light("point"), "position": [-2, 3, 2], "color": [1, 0.4, 0.2]}]}
        yield "unclassified/" + name, "demo", {"technique": name, "classify": False}
        yield "antialias/" + name, "demo", {"technique": name, "antialias": 3}
    yield "camera/orbit", "demo", {"camera": {"orbit": {"azimuth_deg": 80, "elevation_deg": 10}}}
    yield "camera/near", "demo", {"camera": {"eye": [1, 0.6, 1.5], "target": [0, 0.3, 0]}}
    yield "noground", "demo", {"ground": False}
    yield "ambient", "demo", {"ambient": [0.2, 0.1, 0.3], "background": [0.3, 0.3, 0.5]}


def run(options):
    os.environ["PENUMBRA_BIN"] = options.bin
    import harness  # reads PENUMBRA_BIN when it is imported
    daemon = harness.Daemon("--queue-limit=256")
    techniques = daemon.get("/v1/techniques").json()["techniques"]
    openapi = daemon.get("/openapi.json").json()
    scenes = {}
    with tempfile.TemporaryDirectory() as folder:
        for kind in ("demo", "foliage", "columns"):
            path = os.path.join(folder, kind + ".glb")
            subprocess.run([os.path.join(options.bin, "penumbra"), "generate", kind, "-o", path],
                           check=True, stdout=subprocess.DEVNULL)
            with open(path, "rb") as file:
                scenes[kind] = daemon.upload(file.read())

    def one(item):
        name, scene, request = item
        answer = daemon.render(scenes[scene], {**SIZE, **request, "deadline_ms": 3600000},
                               timeout=3600)
        if answer.status != 200:
            return name, "%d %s" % (answer.status, answer.json().get("detail"))
        if options.keep:
            path = os.path.join(options.keep, name.replace("/", "_"))
            with open(path + "." + answer.headers["Content-Type"].split("/")[1], "wb") as file:
                file.write(answer.body)
        return name, hashlib.sha256(answer.body).hexdigest()

    wanted = [item for item in requests(techniques, openapi)
              if not options.only or options.only in item[0]]
    with ThreadPoolExecutor(options.jobs) as pool:
        found = dict(pool.map(one, wanted))
    daemon.kill()
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--bin", default=os.path.join(os.path.dirname(__file__),
                                                      "../../build/dev/bin"))
    parser.add_argument("--jobs", type=int, default=2, help="requests at a time")
    parser.add_argument("--only", help="requests whose name holds this")
    parser.add_argument("--against", help="a list that this tool printed before")
    parser.add_argument("--keep", help="folder for the pictures")
    options = parser.parse_args()
    if options.keep:
        os.makedirs(options.keep, exist_ok=True)
    found = run(options)
    if not options.against:
        for name in sorted(found):
            print(found[name], name, sep="\t")
        return 0
    with open(options.against, encoding="utf-8") as file:
        before = dict(reversed(line.rstrip("\n").split("\t")) for line in file)
    both = [name for name in found if name in before]
    differ = [name for name in both if found[name] != before[name]]
    for name in differ:
        print("differs: %s: %s, was %s" % (name, found[name][:60], before[name][:60]))
    print("%d requests: %d the same, %d differ; %d only now, %d only before" % (
        len(set(found) | set(before)), len(both) - len(differ), len(differ),
        len(found) - len(both), 0 if options.only else len(before) - len(both)))
    return 1 if differ or not both else 0


if __name__ == "__main__":
    sys.exit(main())
