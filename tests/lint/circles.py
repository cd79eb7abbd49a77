"""No circles. A module is a .c with its .h; two that need each other, also by way of others, are one
module in two files. Seen in two ways: by what a module includes, and by whose functions it calls,
because a header may declare what another module's .c defines."""
import os
import re

import tree

FREE = r"tests/.*"


def module_of(name):
    """The path without its ending."""
    return os.path.splitext(name)[0]


def without_comments(text):
    """Nor strings: what is named there is not used."""
    text = re.sub(r"/\*.*?\*/|//[^\n]*", " ", text, flags=re.S)
    return re.sub(r'"(\\.|[^"\\\n])*"', '""', text)


def reached(name, includes, seen):
    """All headers that a file includes, also by way of others."""
    for header in includes.get(name, ()):
        if header not in seen:
            seen.add(header)
            reached(header, includes, seen)
    return seen


def graph_of_includes(texts):
    includes = {name: re.findall(r'^\s*#\s*include\s*"([^"]+)"', text, re.M)
                for name, text in texts.items()}
    modules = {module_of(name) for name in texts if not name.endswith(".h")}
    return {module_of(name): {module_of(header) for header in reached(name, includes, set())
                              if module_of(header) in modules} - {module_of(name)}
            for name in texts if not name.endswith(".h")}


def graph_of_calls(texts):
    """Functions are known by a prototype in a header and the one definition of it."""
    code = {name: without_comments(text) for name, text in texts.items()}
    head = r"^(?!static\b|typedef\b|return\b|else\b)[a-zA-Z_][\w \t\n*]*?\b(\w+)\s*\([^;{}]*\)"
    declared, defined = set(), {}
    for name, text in code.items():
        if name.endswith(".h"):
            declared.update(re.findall(head + r"[^;{}]*;", text, re.M))
    for name, text in code.items():
        if not name.endswith(".h"):
            for function in re.findall(head + r"\s*\{", text, re.M):
                if function in declared:
                    defined[function] = module_of(name)
    return {module_of(name): {defined[word] for word in set(re.findall(r"\w+", text))
                              if word in defined} - {module_of(name)}
            for name, text in code.items() if not name.endswith(".h")}


def circles_of(graph):
    """The strongly connected components of more than one module (Tarjan 1972)."""
    index, low, stack, on_stack, circles = {}, {}, [], set(), []

    def visit(node):
        index[node] = low[node] = len(index)
        stack.append(node)
        on_stack.add(node)
        for other in sorted(graph.get(node, ())):
            if other not in index:
                visit(other)
                low[node] = min(low[node], low[other])
            elif other in on_stack:
                low[node] = min(low[node], index[other])
        if low[node] == index[node]:
            circle = set()
            while node not in circle:
                circle.add(stack.pop())
            on_stack.difference_update(circle)
            if len(circle) > 1:
                circles.append(sorted(circle))

    for node in sorted(graph):
        if node not in index:
            visit(node)
    return circles


def main():
    texts = {name: tree.read(name) for name in tree.files()
             if name.endswith((".c", ".h", ".cpp")) and not re.fullmatch(FREE, name)}
    problems = ["include each other: %s" % ", ".join(circle)
                for circle in circles_of(graph_of_includes(texts))]
    problems += ["call each other: %s" % ", ".join(circle)
                 for circle in circles_of(graph_of_calls(texts))]
    tree.finish(problems)


if __name__ == "__main__":
    main()
