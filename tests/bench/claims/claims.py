#!/usr/bin/env python3
"""Puts the claims of the five papers on trial, compares all methods, and writes the report.

claims.py --build DIR --out DIR [--quick | --tiny] [--only claims|methods|report] [--papers a,b]
"""
import argparse
import json
import os
import sys

import bench
import claims_table
import compare_methods
import report
from experiments import EXPERIMENTS, Scale


def try_claim(entry, groups):
    """The claim with what was measured for it: values per scene, verdicts."""
    result = {key: entry[key] for key in ("key", "text", "theirs", "quantity", "pair")}
    result["limits"] = {"reproduced": entry["good"], "partly": entry["fair"]}
    result["scenes"] = []
    missing = set()
    for group in groups.values():
        if not group["group"].startswith(entry["group"] + "-"):
            continue
        states = {v["name"]: v["status"] for v in group["variants"]}
        absent = [name for name in entry["needs"] if states.get(name) != "ok"]
        missing.update("%s: %s" % (name, states.get(name, "not in the plan")) for name in absent)
        values = [] if absent else entry["value"](group)
        if not values:
            continue
        middle, low, high = bench.spread(values)
        result["scenes"].append({"group": group["group"],
                                 "scene": group["group"][len(entry["group"]) + 1:],
                                 "median": middle, "low": low, "high": high,
                                 "rounds": len(values),
                                 "verdict": claims_table.judge(entry, middle)})
    verdicts = [scene["verdict"] for scene in result["scenes"]]
    result["verdict"] = claims_table.overall(verdicts)
    if missing and not verdicts:
        built = [item for item in missing if not item.endswith("not built")]
        result["verdict"] = "not measured" if built else "method not built"
        result["missing"] = sorted(missing)
    return result


def try_papers(groups):
    return [{"key": paper["key"], "title": paper["title"], "conditions": paper["conditions"],
             "claims": [try_claim(entry, groups) for entry in paper["claims"]]}
            for paper in claims_table.PAPERS]


def finite(value):
    """JSON has no infinity: open ends of a range become null."""
    if isinstance(value, dict):
        return {key: finite(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [finite(item) for item in value]
    return None if isinstance(value, float) and abs(value) == claims_table.INFINITE else value


def measure(args, mode):
    folder = args.imported or os.path.join(args.build, "bench-scenes")
    if mode != "tiny":
        bench.import_scenes(args.build, folder)
    plan = bench.Plan(folder)
    scale = Scale(mode)
    scale.seconds = args.seconds or scale.seconds
    for name, experiment in EXPERIMENTS.items():
        if not args.papers or name in args.papers.split(","):
            experiment(plan, scale)
    return plan.run(args.build, args.out, args.device, "claims.jsonl", args.fresh)


def load(out, name):
    path = os.path.join(out, name)
    return bench.read_results(path) if os.path.exists(path) else (None, {})


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    compare_methods.add_arguments(parser)
    parser.add_argument("--only", choices=("claims", "methods", "report"))
    parser.add_argument("--papers", help="keys, joined by commas: " + ", ".join(EXPERIMENTS))
    args = parser.parse_args()
    args.scenes = args.techniques = args.reference = None
    mode = "tiny" if args.tiny else "quick" if args.quick else "full"
    os.makedirs(args.out, exist_ok=True)
    written = os.path.join(args.out, "claims.json")
    if args.only == "report" and os.path.exists(written):
        with open(written) as file:
            mode = json.load(file)["mode"]
    if args.only in (None, "claims"):
        measure(args, mode)
    if args.only in (None, "methods"):
        compare_methods.run(args)
    device, groups = load(args.out, "claims.jsonl")
    methods_device, methods = load(args.out, "methods.jsonl")
    papers = try_papers(groups) if groups else []
    with open(written, "w") as file:
        json.dump({"device": device, "mode": mode, "papers": finite(papers)}, file, indent=1)
    report.write(args.out, device or methods_device, mode, papers, groups, list(methods.values()))
    for paper in papers:
        for entry in paper["claims"]:
            print("%-12s %-18s %s" % (paper["key"], entry["key"], entry["verdict"]))
    print(os.path.join(args.out, "index.html"))
    failed = bench.failures(groups) + bench.failures(methods)
    if failed:
        sys.exit("failed: " + "; ".join(failed))


if __name__ == "__main__":
    main()
