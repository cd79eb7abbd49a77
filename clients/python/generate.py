"""Writes what of the package comes out of the OpenAPI document, so that it stands nowhere twice:
_types.py, a type for each schema, and _calls.py, the calls that take a request, with every key as a
keyword, its type, unit, range and default.  Usage: generate.py OPENAPI.json FOLDER"""
import json
import keyword
import os
import re
import sys
import textwrap

WIDTH = 96
HEAD = '"""Made by generate.py from the OpenAPI document %s; not to be changed by hand."""\n'
PLAIN = {"string": "str", "number": "float", "integer": "int", "boolean": "bool", "null": "None"}
# Besides the document's: what the query string has for the same thing.
PARAMS = ("params", "Mapping[str, Any]", "Parameters of the method that `technique` names.")


def pascal(name):
    return "".join(word[:1].upper() + word[1:] for word in re.split(r"\W+|_", name) if word)


def union(types):
    types = list(dict.fromkeys(types))
    words = [t for t in types if t.startswith("Literal[")]
    if len(words) > 1:
        merged = "Literal[%s]" % ", ".join(t[len("Literal["):-1] for t in words)
        types = [merged if t == words[0] else t for t in types if t not in words[1:]]
    return types[0] if len(types) == 1 else "Union[%s]" % ", ".join(types)


class Types:
    """Python's types of a document's schemas."""

    def __init__(self, document):
        self.document = document
        self.schemas = document["components"]["schemas"]
        self.lines = []  # of _types.py
        self.names = []
        self.done = set()

    def resolve(self, schema):
        return self.schemas[schema["$ref"].rpartition("/")[2]] if "$ref" in schema else schema

    def of(self, schema, name):
        """The type of a value, in source; `name` is for the objects in it that have none."""
        if "$ref" in schema:
            target = schema["$ref"].rpartition("/")[2]
            self.define(target)
            return pascal(target)
        if "const" in schema:
            return "Literal[%r]" % schema["const"]
        if "enum" in schema:
            return "Literal[%s]" % ", ".join(map(repr, schema["enum"]))
        for several in ("oneOf", "anyOf"):
            if several in schema and "properties" not in schema:
                return union([self.of(s, name) for s in schema[several]])
        kinds = schema.get("type", "object" if "properties" in schema else None)
        if isinstance(kinds, list):
            return union([self.of({**schema, "type": kind}, name) for kind in kinds])
        if kinds == "array":
            return ("Sequence[%s]" if "maxItems" in schema else "List[%s]") % self.of(
                schema.get("items", {}), name + "Item")
        if kinds == "object":
            if schema.get("properties"):
                self.object(name, schema)
                return name
            values = schema.get("additionalProperties") or {}
            return "Dict[str, %s]" % self.of(values, name + "Value")
        return PLAIN.get(kinds, "Any")

    def define(self, target):
        """Puts a schema of the document, after those that it needs."""
        name = pascal(target)
        if name in self.done:
            return
        self.done.add(name)
        schema = self.schemas[target]
        kind = self.of(schema, name)
        if kind != name:
            self.put(name, "%s = %s" % (name, kind), schema)

    def put(self, name, source, schema):
        said = textwrap.wrap(schema.get("description", ""), WIDTH - 2, break_on_hyphens=False)
        self.lines += ["", *("# " + line for line in said), source]
        self.names.append(name)

    def object(self, name, schema):
        if (name, "object") in self.done:
            return
        self.done.add((name, "object"))
        required = set(schema.get("required", []))
        members = {key: (self.of(s, name + pascal(key)), s)
                   for key, s in schema["properties"].items()}
        plain = all(key.isidentifier() and not keyword.iskeyword(key) for key in members)
        parts = [[k for k in members if k in required], [k for k in members if k not in required]]
        if not plain:
            rows = "".join('    "%s": %s,\n' % (k, members[k][0]) for k in members)
            self.put(name, '%s = TypedDict("%s", {\n%s}, total=False)' % (name, name, rows), schema)
            return
        base = "TypedDict"
        if all(parts):
            base = "_%sRequired" % name
            self.put(base, self.body(base, "TypedDict", parts[0], members, {}), {})
            members = {k: members[k] for k in parts[1]}
        self.put(name, self.body(name, base, list(members), members, schema,
                                 "" if parts[0] and not parts[1] else ", total=False"), {})

    def body(self, name, base, keys, members, schema, total=""):
        lines = ["", "class %s(%s%s):" % (name, base, total)]
        said = describe(schema, bounds=False)
        if said:
            lines += textwrap.wrap('"""%s"""' % said, WIDTH, initial_indent="    ",
                                   subsequent_indent="    ", break_on_hyphens=False)
        for key in keys:
            kind, member = members[key]
            help_text = describe(self.resolve({**self.resolve(member), **member}))
            lines += textwrap.wrap(help_text, WIDTH - 2, initial_indent="    # ",
                                   subsequent_indent="    # ", break_on_hyphens=False)
            lines.append("    %s: %s" % (key, kind))
        return "\n".join(lines + [""])


def number(value):
    return "%d" % value if value == int(value) and abs(value) < 1e7 else "%g" % value


def describe(schema, bounds=True):
    """Description, range and default of a value, in words."""
    said = [schema["description"]] if "description" in schema else []
    if bounds:
        inner = schema.get("items", {}) if schema.get("type") == "array" else schema
        least = inner.get("minimum", inner.get("exclusiveMinimum"))
        if least is not None and "maximum" in inner:
            said.append("Range: %s %s to %s." % ("above" if "exclusiveMinimum" in inner else "from",
                                                 number(least), number(inner["maximum"])))
        elif least is not None:
            said.append("At least %s." % number(least))
        if schema.get("default", "") != "":
            said.append("Default: %s." % json.dumps(schema["default"]))
    return " ".join(said).replace("\\", "\\\\")


def keywords(types, schema):
    """(name, type, description, path in the body) of every keyword that a request is made of. What
    the document has in an object of its own for order only (output, sequence) is not
    nested here."""
    rows = []
    for key, member in schema["properties"].items():
        inner = types.resolve(member)
        if key == "scene":
            continue
        if key in ("output", "sequence"):
            nested = "Output" if key == "output" else "SequenceRequestSequence"
            rows += [(k, types.of(s, nested + pascal(k)), describe({**types.resolve(s), **s}),
                      (key, k)) for k, s in inner["properties"].items()]
        elif key != "progressive":
            rows.append((key, types.of(member, pascal(key)), describe({**inner, **member}), (key,)))
            if key == "technique":
                rows.append((*PARAMS, ("technique", "params")))
    return rows


def call(types, schema, name, gives, hook, summary, more):
    rows = keywords(types, schema)
    lines = ["", "    def %s(self, *," % name]
    lines += ["            %s: Optional[%s] = None," % (k, kind) for k, kind, _, _ in rows]
    lines[-1] = lines[-1][:-1] + ") -> %s:" % gives
    lines.append('        """%s' % summary)
    lines += [""] + textwrap.wrap(more, WIDTH, initial_indent=" " * 8, subsequent_indent=" " * 8)
    lines += ["", "        What is left out is chosen to suit the scene."]
    for key, _, said, _ in rows:
        lines += textwrap.wrap("%s: %s" % (key, said), WIDTH, initial_indent=" " * 8,
                               subsequent_indent=" " * 12, break_on_hyphens=False)
    lines += ['        """', "        return self._%s({" % hook]
    lines += ["            %r: %s," % (path, key) for key, _, _, path in rows]
    lines += ["        })"]
    return lines


FAILS = ("Raises Problem: Invalid for what cannot be, with a pointer to the key, Busy when the "
         "service stays full, DeadlinePassed; and Unreachable.")
CALLS = (
    ("RenderRequest", "render", "Picture", "Renders a picture and waits for it.", FAILS),
    ("RenderRequest", "progressive", "Iterator[Picture]",
     "Renders a picture and gives it whenever it has got better; the last one is `final`.",
     "It is the picture that render() gives. Leaving the loop cancels the rest. " + FAILS),
    ("RenderRequest", "render_job", "Job", "Starts a job that renders a picture.", FAILS),
    ("CompareRequest", "compare", "Comparison",
     "How far methods are from a reference on this view, and what they cost: a row each.", FAILS),
    ("CompareRequest", "compare_job", "Job", "Starts a job that compares methods.", FAILS),
    ("SequenceRequest", "sequence", "Job",
     "Starts a job that renders many views: a turntable, a list, keyframes or an animation.",
     FAILS),
)


def generate(document):
    """{file name: text}"""
    types = Types(document)
    for target in document["components"]["schemas"]:
        types.define(target)
    version = document["info"]["version"]
    methods, hooks = [], []
    for schema, name, gives, summary, more in CALLS:
        methods += call(types, document["components"]["schemas"][schema], name, gives, name,
                        summary, more)
        given = "Mapping[Tuple[str, ...], Any]"
        hooks += ["", "    def _%s(self, values: %s) -> %s:" % (name, given, gives),
                  "        raise NotImplementedError"]
    signatures = set(re.findall(r"\w+", " ".join(
        line.partition(") ->")[0] for line in methods if ": Optional[" in line)))
    used = [name for name in types.names if name in signatures]
    head = HEAD % version
    return {
        "_types.py": head + (
            "from typing import Any, Dict, List, Literal, Sequence, TypedDict, Union\n\n"
            "VERSION = %r\n" % version) + "\n".join(types.lines) + "\n",
        "_calls.py": head + (
            "from __future__ import annotations\n\n"
            "from typing import TYPE_CHECKING, Any, Iterator, List, Literal, Mapping, Optional, "
            "Sequence, Tuple, Union\n\nfrom ._types import (\n%s)\n\nif TYPE_CHECKING:\n"
            "    from .jobs import Job\n    from .pictures import Comparison, Picture\n\n\n"
            "class SceneCalls:\n"
            '    """Calls of a scene that take a request; Scene has what they do."""\n' % "".join(
                "    %s,\n" % n for n in used)) + "\n".join(methods + hooks) + "\n"}


def write(document_path, folder):
    with open(document_path, encoding="utf-8") as file:
        files = generate(json.load(file))
    for name, text in files.items():
        with open(os.path.join(folder, name), "w", encoding="utf-8") as file:
            file.write(text)


if __name__ == "__main__":
    write(*sys.argv[1:])
