#!/usr/bin/env python3
"""Every method on every scene against a reference: errors and times as JSON and Markdown.

compare_methods.py --build DIR --out DIR [--quick | --tiny] [--scenes a,b] [--techniques a,b]
                   [--reference SETTINGS]
"""
import argparse
import json
import os
import sys

import bench
import scenes as scenes_module

SCENES = ("bunny", "bunny-shadow", "hotel-room", "garden", "shader-ball", "demo", "foliage",
          "hairball@200000", "columns")
# Settings beside a method's own defaults, to see error against time along one method.
LADDERS = {
    "pcss (8+8)": "technique=pcss&search_taps=8&filter_taps=8",
    "pcss (64+256)": "technique=pcss&search_taps=64&filter_taps=256",
    "multisample (16)": "technique=multisample&samples=16",
    "multisample (64)": "technique=multisample&samples=64",
}
COLUMNS = (("rmse", "RMSE", 4), ("penumbra_rmse", "RMSE penumbra", 4), ("ssim", "SSIM", 4),
           ("flip", "FLIP", 4))


def plan_methods(plan, scenes, techniques, size, reference, repetitions, seconds, ladders=True):
    for scene in scenes:
        if not plan.scenes.has(scene):
            continue
        width, height = size(scene)
        variants = {"reference": reference}
        variants.update((name, "technique=" + name) for name in techniques)
        if ladders:
            variants.update((name, text) for name, text in LADDERS.items()
                            if name.split(" ")[0] in techniques)
        # The bunny has the light of its published timings, the others the automatic one.
        light = "&" + scenes_module.light(scene) if scene.startswith("bunny") else ""
        plan.group("methods-" + scene.replace("@", "-"), scene, variants,
                   "width=%d&height=%d%s" % (width, height, light), repetitions, seconds, "fp" if repetitions == 1 else "fkp")


def table_rows(group):
    """One dictionary per variant: errors and median times in ms."""
    rows = []
    for entry in group["variants"]:
        name = entry["name"]
        if name == "reference":
            continue
        row = {"method": name, "status": entry["status"]}
        errors = bench.comparison(group, name) or {}
        row.update((key, errors.get(key)) for key, _, _ in COLUMNS)
        row["mean_error"] = errors.get("mean_error")
        for how in ("moving", "kept"):
            times = bench.spread(bench.rounds(group, name, how=how))
            row[how + "_ms"] = times and times[0]
            row[how + "_quartiles_ms"] = times and times[1:]
            row[how + "_rounds"] = len(bench.rounds(group, name, how=how))
        times = entry.get("moving")
        for stage in bench.FRAME:
            values = times and bench.spread(times[stage])
            row[stage + "_ms"] = values and values[0]
        row["passes"] = times["passes"] if times else []
        rows.append(row)
    return rows


def number(value, digits):
    return "-" if value is None else "%.*f" % (digits, value)


def markdown(device, groups, reference):
    lines = ["# Every method against a reference", "",
             "Device: %s, OpenGL %s. Reference: %s. RMSE: of mean visibility, all "
             "pixels, and where the reference is between 0.02 and 0.98. SSIM and FLIP: of the "
             "finished picture. ms: median of an image, G-buffer to shading, with the shadow inputs "
             "made anew (moving) and kept; the methods took turns, so compare within a table only.%s"
             % (device["device"], device["gl"], reference, " %d processors, load average %.1f." % (
                 device["processors"], device["load"]) if "load" in device else "")]
    for group in groups:
        lines += ["", "## %s, %d x %d, %d triangles" % (
            group["scene"], group["width"], group["height"], group["triangles"]), "",
            "| method | RMSE | penumbra | SSIM | FLIP | ms moving | ms kept | map | method | shade |",
            "| --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |"]
        for row in sorted(table_rows(group), key=lambda row: row["rmse"] or 9):
            if row["status"] != "ok":
                lines.append("| %s | %s |" % (row["method"], row["status"]))
                continue
            cells = [number(row[key], digits) for key, _, digits in COLUMNS]
            cells += [number(row[key], 1) for key in ("moving_ms", "kept_ms", "shadow_ms",
                                                      "technique_ms", "shade_ms")]
            lines.append("| %s | %s |" % (row["method"], " | ".join(cells)))
    return "\n".join(lines) + "\n"


def write_tables(out, device, groups, reference):
    with open(os.path.join(out, "methods.md"), "w") as file:
        file.write(markdown(device, groups, reference))
    with open(os.path.join(out, "methods.json"), "w") as file:
        json.dump({"device": device["device"], "gl": device["gl"], "reference": reference,
                   "scenes": [{"scene": group["scene"], "width": group["width"],
                               "height": group["height"], "triangles": group["triangles"],
                               "methods": table_rows(group)} for group in groups]}, file, indent=1)


def registered(build, device):
    """Names of the methods, the reference's own left out."""
    plan = bench.Plan("")
    info, _ = plan.run(build, os.path.join(build, "bench-probe"), device)
    return [method["name"] for method in info["methods"]]


def settings(args):
    """Size per scene, samples of the reference, repetitions, seconds per group."""
    if args.tiny:
        return (lambda scene: (64, 48)), 16, 1, 5
    if args.quick:
        return (lambda scene: (200, 150)), 256, 3, 20
    return (lambda scene: (800, 600) if scene.startswith("bunny") else (400, 300)), 1024, 5, 60


def add_arguments(parser):
    parser.add_argument("--build", required=True, help="build folder")
    parser.add_argument("--out", required=True)
    parser.add_argument("--device", default="auto")
    parser.add_argument("--imported", help="folder for imported scenes; default in the build folder")
    parser.add_argument("--quick", action="store_true", help="smaller pictures, fewer rounds")
    parser.add_argument("--seconds", type=float, help="time for the rounds of one group")
    parser.add_argument("--repetitions", type=int, help="timed rounds; 0: errors only")
    parser.add_argument("--fresh", action="store_true",
                        help="measure again what an earlier run into the same folder measured")
    parser.add_argument("--tiny", action="store_true", help="only shows that everything runs")


def run(args):
    os.makedirs(args.out, exist_ok=True)
    folder = args.imported or os.path.join(args.build, "bench-scenes")
    if not args.tiny:
        bench.import_scenes(args.build, folder)
    scenes = args.scenes.split(",") if args.scenes else SCENES
    if args.tiny:
        scenes = ("half-plane",)
    names = registered(args.build, args.device)
    if args.techniques:
        names = [name for name in names if name in args.techniques.split(",")]
    plan = bench.Plan(folder)
    size, samples, repetitions, seconds = settings(args)
    seconds = args.seconds or seconds
    repetitions = repetitions if args.repetitions is None else args.repetitions
    reference = args.reference or "technique=raytraced&samples=%d&seed=7" % samples
    plan_methods(plan, scenes, names, size, reference, repetitions, seconds, ladders=not args.tiny)
    device, groups = plan.run(args.build, args.out, args.device, "methods.jsonl", args.fresh)
    write_tables(args.out, device, list(groups.values()), reference)
    return device, groups


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    add_arguments(parser)
    parser.add_argument("--scenes", help="names, joined by commas")
    parser.add_argument("--techniques", help="names, joined by commas")
    parser.add_argument("--reference", help="settings of what all methods are compared with, as in "
                        "a query string; default: ray traced")
    args = parser.parse_args()
    _, groups = run(args)
    print(os.path.join(args.out, "methods.md"))
    failed = bench.failures(groups)
    if failed:
        sys.exit("failed: " + "; ".join(failed))


if __name__ == "__main__":
    main()
