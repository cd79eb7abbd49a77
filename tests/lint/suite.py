"""Every test that ctest knows has a time limit and a label, and those that measure or that hold the
GPU, a port or the whole machine do not run beside others. Usage: suite.py CTEST BUILD_FOLDER"""
import json
import subprocess
import sys

import tree

LABELS = {"unit", "gl", "accuracy", "api", "fuzz", "load", "lint", "bench", "web", "smoke", "browser"}
ALONE = {"gl", "accuracy", "api", "load", "bench", "web", "browser"}


def main():
    ctest, build = sys.argv[1:]
    listing = subprocess.run([ctest, "--test-dir", build, "--show-only=json-v1"], check=True,
                             capture_output=True, text=True).stdout
    problems = []
    for test in json.loads(listing)["tests"]:
        properties = {p["name"]: p["value"] for p in test.get("properties", [])}
        labels = set(properties.get("LABELS", []))
        if not labels & LABELS or labels - LABELS:
            problems.append("%s: labels %s" % (test["name"], sorted(labels)))
        if not properties.get("TIMEOUT"):
            problems.append("%s: no TIMEOUT" % test["name"])
        if labels & ALONE and not properties.get("RUN_SERIAL") and \
                not properties.get("RESOURCE_LOCK"):
            problems.append("%s: neither RUN_SERIAL nor RESOURCE_LOCK" % test["name"])
    tree.finish(problems)


if __name__ == "__main__":
    main()
