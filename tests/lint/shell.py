"""Every shell script parses; shellcheck has no warning about it where shellcheck is installed."""
import os
import shutil
import subprocess

import tree


def main():
    problems = []
    for name in tree.files():
        first = tree.read(name).split("\n", 1)[0] if tree.is_text(name) else ""
        if not first.startswith("#!") or not first.endswith(("sh", "bash")):
            continue
        path = os.path.join(tree.ROOT, name)
        shell = "bash" if first.endswith("bash") else "sh"
        problems += subprocess.run([shell, "-n", path], capture_output=True,
                                   text=True).stderr.splitlines()
        if not os.access(path, os.X_OK):
            problems.append("%s: not executable" % name)
        if shutil.which("shellcheck"):
            problems += subprocess.run(["shellcheck", "-f", "gcc", "-S", "warning", path],
                                       capture_output=True, text=True).stdout.splitlines()
    tree.finish(problems)


if __name__ == "__main__":
    main()
