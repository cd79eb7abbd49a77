"""cppcheck has nothing to say about any source but what cppcheck.txt lists. Exit 77 when it is not
installed."""
import os
import shutil
import subprocess
import sys

import tree


def main():
    if not shutil.which("cppcheck"):
        print("cppcheck is not installed")
        sys.exit(77)
    names = [n for n in tree.files() if n.endswith((".c", ".cpp")) and
             n.startswith(("protocol/", "renderer/", "server/", "clients/"))]
    result = subprocess.run(
        ["cppcheck", "--quiet", "-j", str(os.cpu_count()), "--enable=warning,portability",
         "--inline-suppr", "--std=c11", "--std=c++17", "-D_GNU_SOURCE", "-DPENUMBRA_EMBREE=3",
         "-DPENUMBRA_VERSION=\"\"", "-I", ".", "--suppressions-list=tests/lint/cppcheck.txt",
         "--template={file}:{line}: {severity}: {message} [{id}]"] + names,
        cwd=tree.ROOT, capture_output=True, text=True)
    print("%d sources" % len(names))
    tree.finish([line for line in result.stderr.splitlines() if line.strip()])


if __name__ == "__main__":
    main()
