"""schemas.d.ts: the documents of /openapi.json as TypeScript.

usage: schema_types.py OPENAPI_JSON OUTPUT"""
import json
import re
import sys

HEAD = "// Made by clients/js/schema_types.py from /openapi.json.\n"
PLAIN = {"string": "string", "number": "number", "integer": "number", "boolean": "boolean",
         "null": "null"}


def name_of(schema):
    """Technique.pcss is no name in TypeScript."""
    return re.sub(r"\W", "_", schema)


def union(types):
    return " | ".join(dict.fromkeys(types)) or "unknown"


def literals(values):
    return union(json.dumps(value) for value in values)


def list_of(schema, indent):
    item = type_of(schema.get("items", {}), indent)
    least, most = schema.get("minItems"), schema.get("maxItems")
    if least is not None and least == most and least <= 4:
        return "[%s]" % ", ".join([item] * least)
    return "(%s)[]" % item if "|" in item or "&" in item else item + "[]"


def comment(schema, indent):
    """What a reader of the type sees: help, unit, range and default."""
    said = [schema.get("description", "")]
    for key, word in (("minimum", "least"), ("maximum", "most"), ("default", "default")):
        if key in schema:
            said.append("%s: %s." % (word.capitalize(), json.dumps(schema[key])))
    text = " ".join(part for part in said if part).replace("*/", "* /")
    return "%s/** %s */\n" % (indent, text) if text else ""


def object_of(schema, indent):
    inner, required = indent + "  ", schema.get("required", [])
    rows = ["%s%s%s%s: %s;\n" % (comment(value, inner), inner, json.dumps(name),
                                 "" if name in required else "?", type_of(value, inner))
            for name, value in schema.get("properties", {}).items()]
    other = schema.get("additionalProperties")
    if isinstance(other, dict) and not rows:
        return "{ [key: string]: %s }" % type_of(other, inner)
    if not rows:
        return "{ [key: string]: unknown }"
    return "{\n%s%s}" % ("".join(rows), indent)


def type_of(schema, indent=""):
    if not isinstance(schema, dict):
        return "unknown"
    if "$ref" in schema:
        return name_of(schema["$ref"].rpartition("/")[2])
    if "const" in schema:
        return literals([schema["const"]])
    if "enum" in schema:
        return literals(schema["enum"])
    kinds = schema.get("type", [])
    kinds = [kinds] if isinstance(kinds, str) else kinds
    if not kinds and "properties" in schema:
        kinds = ["object"]
    own = union(list_of(schema, indent) if kind == "array" else
                object_of(schema, indent) if kind == "object" else PLAIN[kind] for kind in kinds)
    for key in ("oneOf", "anyOf"):
        choices = [type_of(choice, indent) for choice in schema.get(key, [])]
        # What only says which members must be there together has no type of its own.
        if choices and "properties" not in schema and "unknown" not in choices:
            return union(choices)
    return own


def main():
    with open(sys.argv[1], encoding="utf-8") as file:
        schemas = json.load(file)["components"]["schemas"]
    with open(sys.argv[2], "w", encoding="utf-8") as file:
        file.write(HEAD)
        for name, schema in schemas.items():
            file.write("\n%sexport type %s = %s;\n" % (
                comment(schema, ""), name_of(name), type_of(schema)))


if __name__ == "__main__":
    main()
