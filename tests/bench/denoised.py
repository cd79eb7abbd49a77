#!/usr/bin/env python3
"""What `denoised` is worth beside another method: error in the penumbra, time of whole requests.

    denoised.py [--bin DIR] [--shared DIR] [--scenes a,b] [--rounds N] [--repeat N]
                [--truth SAMPLES] [--against pcss] [--methods "denoised,denoised budget=4"]
                [--keep DIR]

Scenes and views are those of claims/scenes.py. The error is the root of the mean squared difference
of the visibility to that of many rays, over the pixels that these see partly lit. Times are taken
in alternation, maps and hierarchies kept: wall clock, and processor time of the worker, which says
more on a busy machine. Prints both, and the ratios. --keep: the truth is kept there, and pictures
are left.
"""
import argparse
import array
import itertools
import os
import statistics
import struct
import subprocess
import sys
import time
import zlib

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path[:0] = [os.path.join(HERE, "..", "api"), os.path.join(HERE, "claims")]

import scenes as views

SCENES = ("bunny", "bunny-shadow", "hotel-room", "garden", "shader-ball", "demo", "columns",
          "foliage", "hairball@200000")
SIZE = {"width": "800", "height": "600", "deadline_ms": "600000"}
PENUMBRA = (0.02, 0.98)
WIDTH, STRIP_OFFSETS, CHANNELS, STRIP_BYTES = 256, 273, 277, 279  # tags
SIZES = {3: "H", 4: "I"}


def means(tiff):
    """The last channel, from 0 to 1, of a picture of 16 bits as our encoder writes it: deflated
    differences of neighbours."""
    order = "<" if tiff[:2] == b"II" else ">"
    at = struct.unpack_from(order + "I", tiff, 4)[0]
    fields, found = {}, []
    for i in range(struct.unpack_from(order + "H", tiff, at)[0]):
        where = at + 2 + 12 * i
        tag, kind, count = struct.unpack_from(order + "HHI", tiff, where)
        form = "%s%d%s" % (order, count, SIZES.get(kind, "B"))
        where += 8
        if struct.calcsize(form) > 4:
            where = struct.unpack_from(order + "I", tiff, where)[0]
        fields[tag] = struct.unpack_from(form, tiff, where)
    channels, width = fields[CHANNELS][0], fields[WIDTH][0]
    for offset, count in zip(fields[STRIP_OFFSETS], fields[STRIP_BYTES]):
        values = array.array("H", zlib.decompress(tiff[offset:offset + count]))
        if (order == "<") != (sys.byteorder == "little"):
            values.byteswap()
        for row in range(0, len(values), width * channels):
            steps = values[row + channels - 1:row + width * channels:channels]
            found += [v % 65536 / 65535 for v in itertools.accumulate(steps)]
    return found


def error(values, truth):
    squares = [(v - t) ** 2 for v, t in zip(values, truth) if PENUMBRA[0] < t < PENUMBRA[1]]
    return (sum(squares) / len(squares)) ** 0.5, len(squares)


def settings(text):
    words = text.split()
    return {"technique": words[0],
            **dict(w.split("=") for w in words[1:])}


def parameters(text):
    return dict(part.split("=") for part in text.split("&") if part)


class Bench:
    def __init__(self, options):
        os.environ["PENUMBRA_BIN"] = options.bin
        import harness  # reads PENUMBRA_BIN when it is imported
        self.options = options
        self.daemon = harness.Daemon("--gpu-memory=2G")

    def upload(self, name):
        base, _, triangles = name.partition("@")
        kind, source, _ = views.SCENES[base]
        path = os.path.join(self.options.shared, "scenes", source + ".glb")
        if kind == "generated":
            path = os.path.join(self.daemon.folder, "scene.glb")
            more = ["--triangles", triangles] if triangles else []
            program = os.path.join(self.options.bin, "penumbra")
            subprocess.run([program, "generate", source, "-o", path] + more, check=True,
                           stdout=subprocess.DEVNULL)
        with open(path, "rb") as file:
            return self.daemon.upload(file.read())

    def get(self, scene, query):
        text = "&".join("%s=%s" % item for item in query.items())
        answer = self.daemon.exchange("GET", "/v1/scenes/%s/render?%s" % (scene, text), timeout=700,
                                      headers={"Cache-Control": "no-cache"})
        if answer.status != 200:
            sys.exit("%s: %d %s" % (text, answer.status, answer.body[:500]))
        return answer.body

    def processor(self):
        with open("/proc/%d/stat" % self.daemon.worker(), encoding="ascii") as file:
            words = file.read().rsplit(")", 1)[1].split()
        return (int(words[11]) + int(words[12])) / os.sysconf("SC_CLK_TCK")

    def truth(self, name, scene, query):
        path = self.options.keep and os.path.join(self.options.keep, "%s.truth.tiff" % name)
        if path and os.path.exists(path):
            with open(path, "rb") as file:
                return means(file.read())
        body = self.get(scene, {**query, **settings("raytraced adaptive=false seed=9 samples=%d"
                                                    % self.options.truth)})
        if path:
            with open(path, "wb") as file:
                file.write(body)
        return means(body)

    def times(self, scene, query, methods):
        """For each method (wall clock, processor) of a request in ms, a list of rounds."""
        times = {method: [] for method in methods}
        for _ in range(self.options.rounds):
            for method in methods:
                wall, used = time.monotonic(), self.processor()
                for _ in range(self.options.repeat):
                    self.get(scene, {**query, **settings(method)})
                times[method].append([1e3 * ms / self.options.repeat for ms in (
                    time.monotonic() - wall, self.processor() - used)])
        return times

    def scene(self, name):
        base = name.split("@")[0]
        scene = self.upload(name)
        query = {**SIZE, **parameters(views.SCENES[base][2])}
        if base.startswith("bunny"):
            query.update(parameters(views.light(base)))
        exact = {**query, "layer": "visibility", "format": "tiff", "bit_depth": "16"}
        methods = [self.options.against] + self.options.methods.split(",")
        truth, errors = self.truth(name, scene, exact), {}
        for method in methods:
            values = means(self.get(scene, {**exact, **settings(method)}))
            errors[method], pixels = error(values, truth)
            picture = self.get(scene, {**query, **settings(method)})  # warms up, too
            if self.options.keep:
                path = os.path.join(self.options.keep,
                                    "%s.%s.png" % (name, method.replace(" ", ".")))
                with open(path, "wb") as file:
                    file.write(picture)
        times = self.times(scene, query, methods) if self.options.rounds else None
        first = methods[0]
        print("%s: %.1f %% of the picture; %s error %.4f" % (
            name, 100 * pixels / len(truth), first, errors[first]), flush=True)
        for method in methods[1:]:
            line = "  %s: error %.4f = %.2f" % (method, errors[method],
                                                errors[method] / errors[first])
            for i, what in enumerate(("time", "processor") if times else ()):
                line += "; %s %.0f / %.0f ms = %.2f" % (
                    what, *(statistics.median(t[i] for t in times[m]) for m in (method, first)),
                    statistics.median(b[i] / a[i] for a, b in zip(times[first], times[method])))
            print(line, flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--bin", default=os.path.join(HERE, "../../build/dev/bin"))
    parser.add_argument("--shared", default=os.environ.get("PENUMBRA_SHARED") or
                        os.path.join(HERE, "../../../shared"))
    parser.add_argument("--scenes", default=",".join(SCENES))
    parser.add_argument("--rounds", type=int, default=5, help="0: errors alone")
    parser.add_argument("--repeat", type=int, default=5, help="requests of a round")
    parser.add_argument("--truth", type=int, default=1024, help="rays per pixel")
    parser.add_argument("--against", default="pcss")
    parser.add_argument("--methods", default="denoised")
    parser.add_argument("--keep", help="a folder")
    options = parser.parse_args()
    bench = Bench(options)
    for name in options.scenes.split(","):
        bench.scene(name)
    bench.daemon.kill()
    print("load %.1f on %d processors" % (os.getloadavg()[0], os.cpu_count()))


if __name__ == "__main__":
    main()
