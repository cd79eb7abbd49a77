"""clang-tidy has nothing to say about any source, by the checks of .clang-tidy. Exit 77 when it is not
installed. Usage: tidy.py BUILD_FOLDER [part of a path...]"""
import json
import os
import shutil
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

import tree


def sources(build):
    """What the build compiles of ours."""
    with open(os.path.join(build, "compile_commands.json")) as file:
        found = {os.path.relpath(os.path.realpath(os.path.join(c["directory"], c["file"])), tree.ROOT)
                 for c in json.load(file)}
    return sorted(found & set(tree.files()))


def main():
    build, parts = sys.argv[1], sys.argv[2:]
    if not shutil.which("clang-tidy"):
        print("clang-tidy is not installed")
        sys.exit(77)

    def check(name):
        result = subprocess.run(
            ["clang-tidy", "--quiet", "-p", build, "--extra-arg=-Wno-unknown-warning-option",
             os.path.join(tree.ROOT, name)], capture_output=True, text=True)
        lines = [line for line in result.stdout.splitlines() if ": error: " in line or
                 ": warning: " in line]
        return lines or ([name + ": " + result.stderr] if result.returncode else [])

    names = [n for n in sources(build) if not parts or any(p in n for p in parts)]
    if not names:
        tree.finish(["%s builds none of these sources" % build])
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        found = sorted({line for lines in pool.map(check, names) for line in lines})
    print("%d sources" % len(names))
    tree.finish(found)


if __name__ == "__main__":
    main()
