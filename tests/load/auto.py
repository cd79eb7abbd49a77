"""What "auto" promises: max_rmse holds at the size that was asked for, checked against raytraced, and
budget_ms holds for 95 of 100 requests on a machine that does nothing else. Of few requests a few more
may miss it, as many as chance alone gives once in a hundred times. What something else on the machine
may have disturbed, the measuring above all, is tried again from its beginning.

usage: auto.py [--scenes FOLDER | --generated NAME,...] [--size W,H] [--requests N] [--orbit N]
Exits 77 (skipped) when FOLDER is not there.
"""
import argparse
import json
import math
import os
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "../api"))
import harness  # noqa: E402

MAX_RMSE = 0.02
SHARE = 0.95  # of the requests that stay within the budget, as promised
TRIES = 3
DOUBT = 0.01  # how improbable what is seen may be if that is so


def is_plausible(kept, count):
    """Whether so few of `count` are to be expected when each keeps to it with probability SHARE."""
    return DOUBT <= sum(math.comb(count, k) * SHARE**k * (1 - SHARE)**(count - k)
                        for k in range(kept + 1))


def render(daemon, scene, body):
    answer = daemon.render(scene, body, timeout=300, Accept="application/json")
    assert answer.status == 200, (answer.status, answer.body)
    return answer.json()


def check_error(daemon, scene, body):
    record = render(daemon, scene, {
        **body, "technique": {"name": "auto", "params": {"max_rmse": MAX_RMSE}}})
    reference = {"name": "raytraced", "params": {"samples": 1024}}
    answer = daemon.call("POST", "/v1/scenes/%s/compare" % scene, json.dumps(
        {**body, "techniques": [record["request"]["technique"]], "reference": reference}),
        {"Content-Type": "application/json"}, timeout=300)
    assert answer.status == 200, (answer.status, answer.body)
    rmse = answer.json()["methods"][0]["rmse"]
    print("  max_rmse %g: %.4f; %s" % (MAX_RMSE, rmse, record["choice"]), flush=True)
    return rmse <= MAX_RMSE and not record["warnings"]


def check_budget(daemon, scene, body, requests, name, view):
    """A budget that a method in the middle of the field meets. A request with a warning (nothing
    meets the budget) counts as one that does not keep to it."""
    middle = sorted(render(daemon, scene, {**body, "technique": "pcss"})["total_ms"]
                    for _ in range(5))[2]
    budget = round(3 * middle, 1)
    auto = {"name": "auto", "params": {"budget_ms": budget}}
    times, choice, warned, kept = [], {}, 0, 0
    for i in range(requests):
        record = render(daemon, scene, {**body, **view(i), "technique": auto})
        taken = record["choice"].split(":")[0]
        choice[taken] = choice.get(taken, 0) + 1
        times.append(record["total_ms"])
        warned += bool(record["warnings"])
        kept += not record["warnings"] and record["total_ms"] <= budget
    times.sort()
    print("  budget_ms %g, %s: %d of %d within (%d with a warning), median %.1f, worst %.1f; %s" % (
        budget, name, kept, requests, warned, times[len(times) // 2], times[-1],
        ", ".join("%s (%d)" % c for c in choice.items())), flush=True)
    return is_plausible(kept, requests)


def check_scene(daemon, name, data, options):
    begin = time.monotonic()
    print(name, flush=True)
    width, height = (int(side) for side in options.size.split(","))
    body = {"width": width, "height": height, "ground": True, "deadline_ms": 300000}
    scene = daemon.upload(data)
    ok = check_error(daemon, scene, body)
    ok = check_budget(daemon, scene, body, options.requests, "one view", lambda i: {}) and ok
    if options.orbit:
        ok = check_budget(daemon, scene, body, options.orbit, "around the scene", lambda i: {
            "camera": {"orbit": {"azimuth_deg": i * 360 / options.orbit}}}) and ok
    print("  %.1f s" % (time.monotonic() - begin), flush=True)
    return ok


def check_anew(name, data, options):
    """With a daemon that has measured nothing yet."""
    daemon = harness.Daemon("--warm-up=on")
    harness.wait(lambda: daemon.metric("penumbra_shader_cache_fill_seconds") > 0, seconds=600)
    daemon.worker()
    ok = check_scene(daemon, name, data, options)
    daemon.stop()
    return ok


def scenes_of(options):
    if options.scenes:
        for name in sorted(os.listdir(options.scenes)):
            if name.endswith(".glb"):
                with open(os.path.join(options.scenes, name), "rb") as file:
                    yield name, file.read()
    for name in options.generated.split(",") if options.generated else ():
        path = os.path.join(options.folder, name + ".glb")
        subprocess.run([os.path.join(harness.BIN, "penumbra"), "generate", name, "-o", path],
                       check=True, stdout=subprocess.DEVNULL)
        with open(path, "rb") as file:
            yield name, file.read()


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("--scenes", help="folder of .glb files")
    parser.add_argument("--generated", help="scenes of our own, joined by commas")
    parser.add_argument("--size", default="320,240")
    parser.add_argument("--requests", type=int, default=100, help="with one view")
    parser.add_argument("--orbit", type=int, default=0, help="with a view of their own each")
    options = parser.parse_args()
    if options.scenes and os.environ.get("PENUMBRA_SHARED"):
        options.scenes = os.path.join(os.environ["PENUMBRA_SHARED"], "scenes")
    if options.scenes and not os.path.isdir(options.scenes):
        sys.exit(77)
    with tempfile.TemporaryDirectory() as options.folder:
        results = [any(check_anew(name, data, options) for _ in range(TRIES))
                   for name, data in scenes_of(options)]
    sys.exit(0 if results and all(results) else 1)


if __name__ == "__main__":
    main()
