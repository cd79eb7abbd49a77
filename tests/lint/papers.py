"""What the papers and the code say of each other: every formula and scene that the code cites (F1, T3)
has a heading in docs/, once; every relative link of a paper leads to a file and a heading that are
there; every file or folder that a paper names between backticks, and every paper that code names,
exists."""
import fnmatch
import os
import re

import tree

CITED = re.compile(r"(?<![\w.+-])([FT][1-9])(?![\w.]|-[a-z])")
LINK = re.compile(r"\[[^\]]*\]\(([^)\s]+)\)")
NAMED = re.compile(r"`([^`\s]+)`")
PAPER = re.compile(r"(?<![\w./])(?:docs/)[\w./-]+\.(?:md|svg)")
HEADING = re.compile(r"^#{1,6} +(.*?) *$", re.M)
FENCE = re.compile(r"^```.*?^```", re.M | re.S)
PLACEHOLDER = re.compile(r"\b[A-Z]+\b(?!\.md)")
# Made by a build or a tool, or a name in another place: the store, a library, the system.
ELSEWHERE = (".", "build/", "scenes/", "usr/", "dev/", "microhttpd.h", "methods.md")
EXTENSIONS = (".c", ".h", ".cpp", ".def", ".glsl", ".frag", ".vert", ".comp", ".py", ".sh", ".md",
              ".txt", ".cmake", ".html")


def anchor(heading):
    """As GitHub makes it."""
    return re.sub(r"[^\w\- ]", "", heading.lower().replace("`", "")).replace(" ", "-")


def check_links(name, text, names, folders, anchors, problems):
    for target in LINK.findall(text):
        if re.match(r"[a-z]+:", target):
            continue
        path, _, part = target.partition("#")
        full = os.path.normpath(os.path.join(os.path.dirname(name), path)) if path else name
        if full not in names and full not in folders:
            problems.append("%s: link to %s, which is not there" % (name, target))
        elif part and part not in anchors.get(full, ()):
            problems.append("%s: link to %s, where no heading is called so" % (name, target))


def is_there(word, name, names, folders):
    if "*" in word:
        return any(fnmatch.fnmatch(other, "*" + word) for other in names)
    if "/" not in word:
        return any(other.rpartition("/")[2] == word for other in names)
    word = word.rstrip("/")
    beside = os.path.normpath(os.path.join(os.path.dirname(name), word))
    return word in names or word in folders or beside in names or beside in folders


def check_named(name, text, names, folders, problems):
    for word in NAMED.findall(text):
        word = word.rstrip(".,:;")
        file_like = re.fullmatch(r"[\w.*-]+(?:/[\w.*-]+)*/?", word)
        if not file_like or PLACEHOLDER.search(word) or word.startswith(ELSEWHERE):
            continue
        top = word.partition("/")[0]
        if not (word.endswith(EXTENSIONS) or ("/" in word and top in folders)):
            continue
        if not is_there(word, name, names, folders):
            problems.append("%s: names %s, which is not there" % (name, word))


def main():
    problems, headings, anchors = [], {}, {}
    names = tree.files()
    folders = {"/".join(name.split("/")[:depth]) for name in names
               for depth in range(1, name.count("/") + 1)}
    papers = {name: FENCE.sub("", tree.read(name)) for name in names if name.endswith(".md")}
    for name, text in papers.items():
        found = HEADING.findall(text)
        anchors[name] = {anchor(heading) for heading in found}
        for heading in found:
            if name.startswith("docs/") and re.fullmatch(r"[FT][1-9]", heading):
                headings.setdefault(heading, []).append(name)
    problems += ["%s is a heading of %s" % (heading, " and ".join(where))
                 for heading, where in headings.items() if len(where) > 1]
    for name, text in papers.items():
        check_links(name, text, set(names), folders, anchors, problems)
        check_named(name, text, set(names), folders, problems)
    for name in names:
        if not name.endswith(tree.CODE) and name not in papers:
            continue
        for number, line in enumerate(tree.read(name).splitlines(), 1):
            for cited in CITED.findall(line) if not name.startswith("tests/lint/") else ():
                if cited not in headings:
                    problems.append("%s:%d: %s has no heading in docs/" % (name, number, cited))
            for paper in PAPER.findall(line):
                if paper not in names:
                    problems.append("%s:%d: names %s, which is not there" % (name, number, paper))
    tree.finish(problems)


if __name__ == "__main__":
    main()
