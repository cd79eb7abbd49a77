#!/usr/bin/env python3
"""What history is worth to `temporal`, along an orbit and behind a caster that moves.

    temporal.py [--bin DIR] [--frames 60] [--samples 4] [--size 320x240] [--out DIR]

Sixty frames of the built-in scene from cameras that go round it once: prints how far the visibility
of each is from 256 rays per pixel, with a session and without, and from what 256 samples of the
method's own maps give: what their texels hide no history can tell. Then a plate slides over a floor under
a camera that stands still and one that goes round: the same, over the whole picture and where the
shadow has been a few frames ago. --out keeps the pictures.
"""
import argparse
import json
import math
import os
import subprocess
import sys
import tempfile

sys.path.insert(0, os.path.join(os.path.dirname(__file__), "..", "api"))

LIGHT = {"type": "rect", "position": [0, 4, 0], "target": [0, 0, 0], "up": [0, 0, 1], "width": 0.8,
         "height": 0.8}


class Pictures:
    def __init__(self, daemon, out):
        self.daemon, self.out = daemon, out

    def ask(self, scene, request, name):
        """Visibility of the pixels, row after row, and what the answer says of its history."""
        import pictures
        request = dict(request, edges="none", output={"layer": "visibility", "bit_depth": 16})
        answer = self.daemon.render(scene, request, timeout=600)
        if answer.status != 200:
            raise SystemExit(answer.body)
        if self.out:
            with open(os.path.join(self.out, name + ".png"), "wb") as file:
                file.write(answer.body)
        rows = pictures.read_png(answer.body)[2]
        return [p[0] / 65535 for row in rows for p in row], answer.headers.get("X-Penumbra-History")


def rms(values):
    return math.sqrt(sum(v * v for v in values) / max(len(values), 1))


def penumbra(truth):
    return [i for i, v in enumerate(truth) if 0.02 < v < 0.98]


def sequence(pictures, scene, name, base, frames, samples):
    """Per frame: the truth, with history, without."""
    method = {"name": "temporal", "params": {"samples": samples}}
    for n, more in enumerate(frames):
        request = dict(base, **more)
        with_history, said = pictures.ask(
            scene, dict(request, technique=method, session=name), "%s-%02d-history" % (name, n))
        alone, _ = pictures.ask(scene, dict(request, technique=method), "%s-%02d-alone" % (name, n))
        truth, _ = pictures.ask(scene, dict(request, technique={
            "name": "raytraced", "params": {"samples": 256}}), "%s-%02d-truth" % (name, n))
        yield n, truth, with_history, alone, said


def orbit(count):
    return [{"camera": {"orbit": {"azimuth_deg": 35 + 360 * n / count, "elevation_deg": 30}}}
            for n in range(count)]


def compare_orbit(pictures, scene, base, options):
    worst = worst_rays = 0
    cameras = orbit(options.frames)
    for n, truth, ours, alone, said in sequence(
            pictures, scene, "orbit", base, cameras, options.samples):
        where = penumbra(truth)
        a = rms([ours[i] - truth[i] for i in where])
        b = rms([alone[i] - truth[i] for i in where])
        a_all, b_all = (rms([x - t for x, t in zip(v, truth)]) for v in (ours, alone))
        limit, _ = pictures.ask(scene, dict(base, **cameras[n], technique={
            "name": "multisample", "params": {"samples": 256}}), "orbit-%02d-limit" % n)
        share = rms([x - t for x, t in zip(ours, limit)]) / rms([x - t for x, t in zip(alone, limit)])
        if n >= 16:
            worst, worst_rays = max(worst, share), max(worst_rays, a / b, a_all / b_all)
        print("orbit %2d: penumbra %.4f of %.4f (%.2f), all %.4f of %.4f (%.2f), from the maps' limit "
              "%.2f; %s" % (n, a, b, a / b, a_all, b_all, a_all / b_all, share, said), flush=True)
    print("orbit: from frame 16 on at most %.2f of the error without history (0.6 is promised), with "
          "what the maps' texels hide %.2f" % (worst, worst_rays), flush=True)
    return worst


def compare_moving(pictures, scene, base, cameras, name, options):
    truths, trails = [], []
    for n, truth, ours, alone, said in sequence(pictures, scene, name, base, [
            dict(camera, animation="slide", time_s=1 + 0.05 * n)
            for n, camera in enumerate(cameras)], options.samples):
        truths.append(truth)
        ago = truths[max(0, n - 4)]
        trail = [i for i, v in enumerate(truth) if v > 0.99 and ago[i] < 0.5]
        dark = sum(1 - ours[i] for i in trail) / len(trail) if trail else 0
        trails.append(dark)
        where = penumbra(truth)
        print("%s %2d: penumbra %.4f of %.4f, all %.4f of %.4f, darkness where the shadow was four "
              "frames ago %.3f; %s" % (
                  name, n, rms([ours[i] - truth[i] for i in where]),
                  rms([alone[i] - truth[i] for i in where]),
                  rms([a - b for a, b in zip(ours, truth)]),
                  rms([a - b for a, b in zip(alone, truth)]), dark, said), flush=True)
    return max(trails)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--bin", default=os.path.join(os.path.dirname(__file__),
                                                      "../../build/dev/bin"))
    parser.add_argument("--frames", type=int, default=60)
    parser.add_argument("--samples", type=int, default=4)
    parser.add_argument("--size", default="320x240")
    parser.add_argument("--out")
    parser.add_argument("--only", choices=("orbit", "moving"))
    options = parser.parse_args()
    os.environ["PENUMBRA_BIN"] = options.bin
    import harness  # reads PENUMBRA_BIN when it is imported
    import pictures
    width, height = map(int, options.size.split("x"))
    base = {"width": width, "height": height, "sky": False, "deadline_ms": 600000}
    if options.out:
        os.makedirs(options.out, exist_ok=True)
    daemon = harness.Daemon("--client-share=0")
    try:
        asked = Pictures(daemon, options.out)
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "demo.glb")
            subprocess.run([os.path.join(options.bin, "penumbra"), "generate", "demo", "-o", path],
                           check=True, stdout=subprocess.DEVNULL)
            with open(path, "rb") as file:
                demo = daemon.upload(file.read())
        if options.only != "moving":
            # The light as it is chosen for the first camera, or it would turn with the camera.
            record = daemon.render(demo, dict(base, **orbit(1)[0]), Accept="application/json").json()
            compare_orbit(asked, demo, dict(base, lights=record["request"]["lights"]), options)
        if options.only != "orbit":
            plate = daemon.upload(pictures.sliding_box())
            base.update(ground=False, lights=[LIGHT])
            still = [{"camera": {"eye": [0, 2.6, 3.6], "target": [0, 0.2, 0]}}] * 24
            turning = [{"camera": {"eye": [3.6 * math.sin(0.03 * n), 2.6, 3.6 * math.cos(0.03 * n)],
                                   "target": [0, 0.2, 0]}} for n in range(24)]
            for name, cameras in (("still", still), ("turning", turning)):
                print("%s: darkness at most %.3f" % (
                    name, compare_moving(asked, plate, base, cameras, name, options)))
    finally:
        daemon.kill()


if __name__ == "__main__":
    main()
