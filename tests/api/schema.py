"""Answers against the daemon's own OpenAPI document: the part of JSON Schema that it uses."""
import gzip
import json
import re

ANNOTATIONS = {"description", "title", "default", "format", "x-unit", "discriminator"}
NUMBER = (int, float)
TYPES = {"object": dict, "array": list, "string": str, "boolean": bool, "null": type(None)}


def is_type(value, name):
    if name == "number":
        return isinstance(value, NUMBER) and not isinstance(value, bool)
    if name == "integer":
        return is_type(value, "number") and value == int(value)
    return isinstance(value, TYPES[name])


class Document:
    def __init__(self, document):
        self.document = document
        self.patterns = [(re.compile(re.sub(r"\\{(\w+)\\}", r"[^/]+", re.escape(path)) + "$"), path)
                         for path in document["paths"]]
        self.operations = {operation["operationId"] for methods in document["paths"].values()
                           for operation in methods.values()}
        self.seen = set()  # operations that answered without a problem

    # ---- schemas ----

    def resolve(self, pointer):
        node = self.document
        for token in pointer[2:].split("/"):
            token = token.replace("~1", "/").replace("~0", "~")
            node = node[int(token)] if isinstance(node, list) else node[token]
        return node

    def fits(self, value, schema):
        return not self.problems(value, schema, "", False)

    def problems(self, value, schema, where="", strict=True):
        """What is wrong with the value. Strict: members that the schema does not name are, too."""
        if isinstance(schema, bool):
            return [] if schema else [where + " must not be there"]
        found = []
        for keyword, argument in schema.items():
            if keyword in ANNOTATIONS:
                continue
            check = getattr(self, "check_" + keyword.replace("$", ""), None)
            if check is None:
                raise AssertionError("the validator does not know " + keyword)
            found += check(value, argument, schema, where, strict)
        return found

    def check_ref(self, value, pointer, schema, where, strict):
        return self.problems(value, self.resolve(pointer), where, strict)

    def check_type(self, value, names, schema, where, strict):
        names = [names] if isinstance(names, str) else names
        return [] if any(is_type(value, n) for n in names) else [
            "%s is no %s: %.60r" % (where, " or ".join(names), value)]

    def check_enum(self, value, choices, schema, where, strict):
        return [] if value in choices else ["%s: %r is none of %s" % (where, value, choices)]

    def check_const(self, value, wanted, schema, where, strict):
        return [] if value == wanted else ["%s: %r is not %r" % (where, value, wanted)]

    def check_pattern(self, value, pattern, schema, where, strict):
        return [] if not isinstance(value, str) or re.search(pattern, value) else [
            "%s: %r does not match %s" % (where, value, pattern)]

    def bound(self, value, ok, schema, where, text):
        return [] if not is_type(value, "number") or ok(value) else [
            "%s: %r is %s" % (where, value, text)]

    def check_minimum(self, value, least, schema, where, strict):
        return self.bound(value, lambda v: v >= least, schema, where, "below %s" % least)

    def check_exclusiveMinimum(self, value, least, schema, where, strict):
        return self.bound(value, lambda v: v > least, schema, where, "not above %s" % least)

    def check_maximum(self, value, most, schema, where, strict):
        return self.bound(value, lambda v: v <= most, schema, where, "above %s" % most)

    def count(self, kind, value, ok, where):
        return [] if not isinstance(value, kind) or ok(len(value)) else [
            "%s has %d members" % (where, len(value))]

    def check_minItems(self, value, least, schema, where, strict):
        return self.count(list, value, lambda n: n >= least, where)

    def check_maxItems(self, value, most, schema, where, strict):
        return self.count(list, value, lambda n: n <= most, where)

    def check_minProperties(self, value, least, schema, where, strict):
        return self.count(dict, value, lambda n: n >= least, where)

    def check_maxProperties(self, value, most, schema, where, strict):
        return self.count(dict, value, lambda n: n <= most, where)

    def check_items(self, value, item, schema, where, strict):
        return [p for i, v in enumerate(value) for p in
                self.problems(v, item, "%s/%d" % (where, i), strict)] if isinstance(
                    value, list) else []

    def check_required(self, value, keys, schema, where, strict):
        return ["%s has no %s" % (where, k) for k in keys if k not in value] if isinstance(
            value, dict) else []

    def check_properties(self, value, properties, schema, where, strict):
        if not isinstance(value, dict):
            return []
        found = [p for k, s in properties.items() if k in value for p in
                 self.problems(value[k], s, "%s/%s" % (where, k), strict)]
        if strict and "additionalProperties" not in schema:
            found += ["%s/%s is not in the schema" % (where, k) for k in value
                      if k not in properties]
        return found

    def check_additionalProperties(self, value, other, schema, where, strict):
        if not isinstance(value, dict):
            return []
        return [p for k, v in value.items() if k not in schema.get("properties", {}) for p in
                self.problems(v, other, "%s/%s" % (where, k), strict)]

    def check_oneOf(self, value, schemas, schema, where, strict):
        """With one candidate left by its "name" or its type, says what is wrong with that one."""
        wrong = [self.problems(value, s, where, strict) for s in schemas]
        if wrong.count([]) == 1:
            return []
        return ["%s fits %d of oneOf" % (where, wrong.count([]))] + min(wrong, key=len)

    def check_anyOf(self, value, schemas, schema, where, strict):
        return [] if any(self.fits(value, s) for s in schemas) else [where + " fits none of anyOf"]

    def check_allOf(self, value, schemas, schema, where, strict):
        return [p for s in schemas for p in self.problems(value, s, where, False)]

    def check_not(self, value, other, schema, where, strict):
        return [where + " fits what it must not"] if self.fits(value, other) else []

    def check_if(self, value, condition, schema, where, strict):
        return self.problems(value, schema["then"], where, False) if self.fits(
            value, condition) else []

    def check_then(self, value, consequence, schema, where, strict):
        return []  # see check_if

    def check_dependentRequired(self, value, rows, schema, where, strict):
        return [p for k, keys in rows.items() if k in value for p in
                self.check_required(value, keys, schema, where, strict)] if isinstance(
                    value, dict) else []

    def check_dependentSchemas(self, value, rows, schema, where, strict):
        return [p for k, s in rows.items() if k in value for p in
                self.problems(value, s, where, False)] if isinstance(value, dict) else []

    # ---- answers ----

    def check(self, method, target, answer):
        """Raises AssertionError when the answer is not what the document says of the call."""
        said = "%s %.80s: %d" % (method, target, answer.status)
        path = target.split("?")[0]
        fits = [p for pattern, p in self.patterns if pattern.match(path)]
        methods = self.document["paths"][fits[0]] if fits else {}
        operation = methods.get({"HEAD": "get"}.get(method, method.lower()))
        status = str(answer.status)
        kind = answer.headers.get("Content-Type", "").split(";")[0]
        if answer.status >= 400:
            content = self.resolve("#/components/responses/Problem")["content"]
        elif operation is None:
            assert status == "204" and method == "OPTIONS", said + " is not in the document"
            content = {}
        else:
            assert status in operation["responses"], said + " is not in the document"
            content = operation["responses"][status].get("content", {})
            self.seen.add(operation["operationId"])
        if not content:
            assert not answer.body, said + " has a body"
        elif method != "HEAD":
            assert kind in content, "%s: %s is not in the document" % (said, kind)
            schema = content[kind].get("schema")
            coded = answer.headers.get("Content-Encoding") == "gzip"
            body = gzip.decompress(answer.body) if coded else answer.body
            value = json.loads(body) if kind.endswith("json") else body.decode("latin-1")
            wrong = self.problems(value, schema) if schema else []
            assert not wrong, "%s:\n  %s" % (said, "\n  ".join(wrong[:8]))
