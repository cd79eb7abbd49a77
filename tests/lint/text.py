"""Things no file of ours holds: tabs, trailing blanks, paths of one machine, notes to self, memory
that is asked for without protocol/memory.h and must be there; and how long a file of code may be."""
import re

import tree

MAX_LINES = 600
UNFINISHED = re.compile(r"\b(%s)\b" % "|".join(("TO" + "DO", "FIX" + "ME", "X" + "XX", "HA" + "CK")))
MACHINE_PATH = re.compile(r"(?<![\w.$}:>])/(work|home|root|Users)/\w")
ALLOCATION = re.compile(r"\b(?:m|c|re)alloc\([^;]*;\s*if \(![^;{}]*\)\s*abort\(\)|"
                        r"if \(!\([^;]*\b(?:m|c|re)alloc\([^;]*\)\s*abort\(\)")
TABS_ALLOWED = ("Makefile", ".mk", ".tsv")
GENERATED = ("package-lock.json",)


def main():
    problems = []
    for name in tree.files():
        if not tree.is_text(name) or name.endswith(GENERATED):
            continue
        text = tree.read(name)
        lines = text.split("\n")
        if text and not text.endswith("\n"):
            problems.append("%s: no newline at the end" % name)
        if "\r" in text:
            problems.append("%s: carriage returns" % name)
        if name.endswith(tree.CODE) and len(lines) - 1 > MAX_LINES:
            problems.append("%s: %d lines, more than %d" % (name, len(lines) - 1, MAX_LINES))
        found = name.endswith((".c", ".h")) and not name.startswith(("protocol/memory", "tests/"))
        for asked in ALLOCATION.finditer(text) if found else ():
            problems.append("%s:%d: memory that must be there: pen_alloc (protocol/memory.h)" % (
                name, text.count("\n", 0, asked.start()) + 1))
        for number, line in enumerate(lines, 1):
            if "\t" in line and not name.endswith(TABS_ALLOWED):
                problems.append("%s:%d: tab" % (name, number))
            if line != line.rstrip():
                problems.append("%s:%d: blanks at the end of the line" % (name, number))
            if UNFINISHED.search(line):
                problems.append("%s:%d: unfinished: %s" % (name, number, line.strip()))
            if MACHINE_PATH.search(line):
                problems.append("%s:%d: path of one machine: %s" % (name, number, line.strip()))
    tree.finish(problems)


if __name__ == "__main__":
    main()
