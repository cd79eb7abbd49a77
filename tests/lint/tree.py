"""The files of the repository, as every lint sees them."""
import os
import subprocess
import sys

ROOT = os.path.realpath(os.path.join(os.path.dirname(__file__), "..", ".."))
GLSL = (".glsl", ".vert", ".frag", ".comp")
CODE = GLSL + (".c", ".h", ".cpp", ".def", ".py", ".sh", ".js", ".html", ".css", ".cmake")
IGNORED_FOLDERS = {".git", "build", "out", "demo-out", "node_modules", "__pycache__",
                   "penumbra-store"}


def files():
    """Paths relative to the root: what git tracks, added files too. What a program leaves in the
    folder is nobody's source."""
    listing = subprocess.run(["git", "-C", ROOT, "ls-files", "-z"],
                             capture_output=True, text=True)
    if listing.returncode == 0:
        found = [name for name in listing.stdout.split("\0") if name]
    else:  # an exported tree
        found = []
        for folder, folders, names in os.walk(ROOT):
            folders[:] = [name for name in folders if name not in IGNORED_FOLDERS]
            found += [os.path.relpath(os.path.join(folder, name), ROOT) for name in names]
    return sorted(name for name in set(found) if os.path.isfile(os.path.join(ROOT, name)))


def read(name):
    with open(os.path.join(ROOT, name), encoding="utf-8", errors="surrogateescape") as file:
        return file.read()


def is_text(name):
    with open(os.path.join(ROOT, name), "rb") as file:
        return b"\0" not in file.read(8192)


def finish(problems):
    for problem in problems:
        print(problem)
    print("%d problem%s" % (len(problems), "" if len(problems) == 1 else "s"))
    sys.exit(1 if problems else 0)
