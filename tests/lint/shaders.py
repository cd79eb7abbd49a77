"""What C and GLSL share stands in rows (.def, see renderer/shared/rows_c.h) and nowhere else: no
binding by its number, no block written by hand, no row's name defined again. Shaders keep to 100
columns, and their vocabulary (renderer/shaders/README.md) names what is there."""
import os
import re

import tree

COLUMNS = 100
MAX_FILES = 20
ROW = re.compile(r"^(U?ITEM(?:_AT)?|KNOWN|STRUCT|STORAGE_STRUCT|UNIFORM_BLOCK|STORAGE_BLOCK|"
                 r"STORAGE_ARRAY)\(([^)]*)")
# Where blocks are made from rows: of files, and of a method's parameters.
MAKERS = ("renderer/shared/rows_glsl.h", "renderer/gl/program.c")
BY_NUMBER = re.compile(
    r"\bbinding\s*=\s*\d|\blocation\s*=\s*\d+\s*\)\s*(?:uniform|in vec|in float)|"
    r"\bBindBuffer(?:Base|Range)\(\s*GL_\w+,\s*\d|"
    r"\b(?:BindTextureUnit|BindImageTexture|BindSampler)\(\s*\d")
TIED = re.compile(r"\bmirrors? (?:of )?struct\b|\b[Aa]s (?:the )?(?:uniform block|[A-Z]\w*Block)\b")


def code_of(line, glsl):
    return line.split("//")[0] if glsl else line


def row_names(files):
    """Name in C or GLSL: the file whose row defines it."""
    found = {}
    for name in files:
        for line in tree.read(name).splitlines():
            row = ROW.match(line)
            if not row:
                continue
            words = [word.strip() for word in row[2].split(",")]
            if row[1] == "KNOWN":
                continue
            for word in words[:2] if "STRUCT" in row[1] or "BLOCK" in row[1] else words[:1]:
                found.setdefault(word, name)
    return found


def check_names(name, number, line, rows, problems):
    for defined in re.findall(r"^\s*#\s*define (\w+) |\bconst \w+ (\w+) =|\bstruct (\w+) \{|"
                              r"\buniform (\w+) \{|\bbuffer (\w+) \{", line):
        word = next(word for word in defined if word)
        if word in rows:
            problems.append("%s:%d: %s is a row of %s" % (name, number, word, rows[word]))


def check_vocabulary(problems):
    """Every `name(` that the list has under a file's heading is a function of that file."""
    there = {os.path.basename(name): name for name in tree.files() if name.endswith(tree.GLSL)}
    text = ""
    for number, line in enumerate(tree.read("renderer/shaders/README.md").splitlines(), 1):
        for word in re.findall(r"`(\w+\.(?:glsl|vert|frag|comp))`", line):
            if word not in there:
                problems.append("renderer/shaders/README.md:%d: no file %s" % (number, word))
        if line.startswith("| `"):
            file = re.match(r"\| `(\w+\.glsl)`", line)
            text = tree.read(there[file[1]]) if file and file[1] in there else ""
            for word in re.findall(r"`(\w+)\(", line):
                if not re.search(r"^\w+ %s\(" % word, text, re.M):
                    problems.append("renderer/shaders/README.md:%d: no function %s in %s" %
                                    (number, word, file[1] if file else "?"))
            for word in re.findall(r"`([A-Z]\w+)`", line):
                if not re.search(r"^struct %s\b" % word, text, re.M):
                    problems.append("renderer/shaders/README.md:%d: no struct %s in %s" %
                                    (number, word, file[1] if file else "?"))


def main():
    problems, folders = [], {}
    files = [name for name in tree.files() if name.startswith(("renderer/", "protocol/"))]
    rows = row_names(name for name in files if name.endswith(".def"))
    for name in files:
        glsl = name.endswith(tree.GLSL)
        if name.startswith("renderer/shaders/"):
            folders.setdefault(os.path.dirname(name), []).append(name)
        if not glsl and not name.endswith((".c", ".h")):
            continue
        for number, line in enumerate(tree.read(name).splitlines(), 1):
            if glsl and len(line) > COLUMNS:
                problems.append("%s:%d: %d columns" % (name, number, len(line)))
            if TIED.search(line):
                problems.append("%s:%d: a comment ties what rows should: %s" %
                                (name, number, line.strip()))
            code = code_of(line, glsl)
            if BY_NUMBER.search(code):
                problems.append("%s:%d: a binding by its number: %s" % (name, number, code.strip()))
            if re.search(r"\blayout\(std\d+", code) and name not in MAKERS:
                problems.append("%s:%d: a block by hand: %s" % (name, number, code.strip()))
            check_names(name, number, code, rows, problems)
    for folder, names in folders.items():
        if len(names) > MAX_FILES:
            problems.append("%s: %d files, more than %d" % (folder, len(names), MAX_FILES))
    check_vocabulary(problems)
    tree.finish(problems)


if __name__ == "__main__":
    main()
