"""The README's map of the tree names every folder of the first two levels, and none that is not."""
import os
import re

import tree


def map_of_the_tree(readme):
    """The folders in the code block under the heading that holds "map of the tree"."""
    found = re.search(r"^## .*map of the tree.*?^```\w*\n(.*?)^```", readme, re.I | re.M | re.S)
    if not found:
        return None
    folders, first = set(), ""
    for line in found[1].splitlines():
        entry = re.match(r"( *)([\w.-]+)/(?:\s|$)", line)
        if not entry:
            continue
        if entry[1]:
            folders.add(first + "/" + entry[2])
        else:
            first = entry[2]
            folders.add(first)
    return folders


def main():
    there = set()
    for name in tree.files():
        parts = name.split("/")[:-1]
        there.update("/".join(parts[:depth]) for depth in (1, 2) if len(parts) >= depth)
    said = map_of_the_tree(tree.read("README.md")) if os.path.exists(
        os.path.join(tree.ROOT, "README.md")) else None
    if said is None:
        tree.finish(["README.md has no map of the tree"])
    problems = ["README.md: the map lacks %s/" % name for name in sorted(there - said)]
    problems += ["README.md: the map names %s/, which is not there" % name
                 for name in sorted(said - there)]
    tree.finish(problems)


if __name__ == "__main__":
    main()
