"""The README's map of the tree names every folder of the first two levels, and none that is not.
Where it names a folder of a deeper level it names all beside it."""
import os
import re

import tree


def map_of_the_tree(readme):
    """The folders in the code block under the heading that holds "map of the tree"."""
    found = re.search(r"^## .*map of the tree.*?^```\w*\n(.*?)^```", readme, re.I | re.M | re.S)
    if not found:
        return None
    folders, path = set(), []
    for line in found[1].splitlines():
        entry = re.match(r"( *)([\w.-]+)/(?:\s|$)", line)
        if not entry:
            continue
        path[len(entry[1]) // 2:] = [entry[2]]
        folders.add("/".join(path))
    return folders


def main():
    there = set()
    for name in tree.files():
        parts = name.split("/")[:-1]
        there.update("/".join(parts[:depth]) for depth in range(1, len(parts) + 1))
    said = map_of_the_tree(tree.read("README.md")) if os.path.exists(
        os.path.join(tree.ROOT, "README.md")) else None
    if said is None:
        tree.finish(["README.md has no map of the tree"])
    opened = {name.rpartition("/")[0] for name in said}
    wanted = {name for name in there if name.count("/") < 2 or name.rpartition("/")[0] in opened}
    problems = ["README.md: the map lacks %s/" % name for name in sorted(wanted - said)]
    problems += ["README.md: the map names %s/, which is not there" % name
                 for name in sorted(said - there)]
    tree.finish(problems)


if __name__ == "__main__":
    main()
