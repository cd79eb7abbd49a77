"""clang-format has nothing to change in any C, C++ or GLSL file. Exit 77 when it is not installed, or
in another version than the one that the sources were formatted with: they differ in small things.
format.py --fix rewrites the files instead."""
import shutil
import subprocess
import sys

import tree

VERSION = "14."  # of Debian 12


def main():
    if not shutil.which("clang-format"):
        print("skipped: clang-format is not installed")
        sys.exit(77)
    found = subprocess.run(["clang-format", "--version"], capture_output=True, text=True).stdout
    if " version " + VERSION not in found:
        print("skipped: the sources are formatted by clang-format " + VERSION + "x, this is " + found)
        sys.exit(77)
    names = [name for name in tree.files() if name.endswith((".c", ".h", ".cpp") + tree.GLSL)]
    if sys.argv[1:] == ["--fix"]:
        subprocess.run(["clang-format", "-i", "-style=file"] + names, cwd=tree.ROOT, check=True)
        return
    result = subprocess.run(["clang-format", "--dry-run", "-Werror", "-style=file"] + names,
                            cwd=tree.ROOT, capture_output=True, text=True)
    problems = [line for line in result.stderr.splitlines() if "error:" in line]
    if result.returncode and not problems:
        problems = [result.stderr]
    tree.finish(problems)


if __name__ == "__main__":
    main()
