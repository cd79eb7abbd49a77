"""Examples of the papers, as they stand there: fenced blocks with their language, and code in a line
that looks like a command or markup."""
import os
import re

ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "../..")
PAPERS = ("README.md", "docs/howto/view.md")
ADDRESS = "http://127.0.0.1:8080"
# What would install packages, build and test everything, or serve for ever: demo.sh and run.sh are what
# these tests are run by, and try-empty-root.sh runs both.
NOT_RUN = ("deploy/demo.sh     # installs",)


def blocks():
    """(paper, language, text) of every fenced block that is to be run."""
    found = []
    for paper in PAPERS:
        with open(os.path.join(ROOT, paper), encoding="utf-8") as file:
            text = file.read()
        found += [(paper, language, body) for language, body in
                  re.findall(r"^```(\w*)\n(.*?)^```$", text, re.M | re.S)
                  if language and not body.startswith(NOT_RUN)]
    return found


def lines():
    """(paper, kind, code) of what stands in a line: a command of ours, markup, an import."""
    found = []
    for paper in PAPERS:
        with open(os.path.join(ROOT, paper), encoding="utf-8") as file:
            text = re.sub(r"^```.*?^```$", "", file.read(), flags=re.M | re.S)
        for code in re.findall(r"`([^`\n]+)`", text):
            kind = ("sh" if code.startswith("build/release/bin/") else
                    "html" if re.match(r"<\w+ .*=", code) else
                    "js" if code.startswith("import ") else None)
            if kind:
                found.append((paper, kind, code))
    return found


def all_of(*languages):
    return [(paper, language, text) for paper, language, text in blocks() + lines()
            if language in languages]
