"""Says which tests of a ctest run were skipped, and why, and which never ended.
not_run.py BUILD LOG JUNIT [ctest options]: LOG is what ctest has printed, JUNIT its report if it lived
to write one; the options are those that it was given."""
import json
import re
import subprocess
import sys
import xml.etree.ElementTree


def reasons(path):
    """The last line that each skipped test has printed."""
    try:
        cases = xml.etree.ElementTree.parse(path).getroot().iter("testcase")
    except (OSError, xml.etree.ElementTree.ParseError):
        return {}
    return {case.get("name"): ([line.strip() for line in (case.findtext("system-out") or "").split("\n")
                                if line.strip()] or [""])[-1] for case in cases}


def main():
    build, log, junit = sys.argv[1:4]
    listing = subprocess.run(["ctest", "--test-dir", build, "--show-only=json-v1"] + sys.argv[4:],
                             capture_output=True, text=True).stdout
    with open(log, encoding="utf-8", errors="replace") as file:
        ended = dict(re.findall(r"^ *\d+/\d+ Test +#\d+: (\S+) \.*(.*?) +[\d.]+ sec *$", file.read(), re.M))
    why = reasons(junit)
    for test in json.loads(listing or '{"tests": []}')["tests"]:
        name = test["name"]
        if name not in ended:
            print("%s: the time was over before it ended" % name)
        elif "Skipped" in ended[name] or "Not Run" in ended[name]:
            print("%s: skipped: %s" % (name, why.get(name) or "no reason given"))


if __name__ == "__main__":
    main()
