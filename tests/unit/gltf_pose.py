"""glTF 2.0 skins, morph targets and animations evaluated from the specification, sharing nothing
with the project: what its poses are compared with. Standard library only; small files."""
import base64
import io
import json
import math
import os
import struct
import zipfile

FORMATS = {5120: ("b", 127), 5121: ("B", 255), 5122: ("h", 32767), 5123: ("H", 65535),
           5125: ("I", 1), 5126: ("f", 1)}
COUNTS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}
IDENTITY = [1.0, 0, 0, 0, 0, 1.0, 0, 0, 0, 0, 1.0, 0, 0, 0, 0, 1.0]  # column-major, as in glTF


def multiply(a, b):
    return [sum(a[4 * k + r] * b[4 * c + k] for k in range(4)) for c in range(4) for r in range(4)]


def compose(t, q, s):
    x, y, z, w = q
    n = math.sqrt(x * x + y * y + z * z + w * w) or 1.0
    x, y, z, w = x / n, y / n, z / n, w / n
    columns = [[1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w)],
               [2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w)],
               [2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y)]]
    out = []
    for c in range(3):
        out += [v * s[c] for v in columns[c]] + [0.0]
    return out + list(t) + [1.0]


def point(m, p):
    return [m[r] * p[0] + m[4 + r] * p[1] + m[8 + r] * p[2] + m[12 + r] for r in range(3)]


def turn_normal(m, n):
    """By the inverse transpose, of unit length."""
    a = [[m[4 * c + r] for c in range(3)] for r in range(3)]
    cofactor = [[a[(r + 1) % 3][(c + 1) % 3] * a[(r + 2) % 3][(c + 2) % 3] -
                 a[(r + 1) % 3][(c + 2) % 3] * a[(r + 2) % 3][(c + 1) % 3] for c in range(3)]
                for r in range(3)]
    determinant = sum(a[0][c] * cofactor[0][c] for c in range(3))
    side = -1 if determinant < 0 else 1
    v = [side * sum(cofactor[r][c] * n[c] for c in range(3)) for r in range(3)]
    length = math.sqrt(sum(x * x for x in v))
    return [x / length for x in v] if length else v


class File:
    def __init__(self, path):
        with open(path, "rb") as file:
            data = file.read()
        self.binary, fetch = None, None
        if data[:2] == b"PK":
            archive = zipfile.ZipFile(io.BytesIO(data))
            name = [n for n in archive.namelist() if n.endswith(".gltf")][0]
            folder = os.path.dirname(name)
            data = archive.read(name)
            fetch = lambda uri: archive.read(os.path.normpath(os.path.join(folder, uri)))
        if data[:4] == b"glTF":
            length = struct.unpack_from("<I", data, 12)[0]
            self.json = json.loads(data[20:20 + length])
            at = 20 + length
            if at + 8 <= len(data):
                self.binary = data[at + 8:at + 8 + struct.unpack_from("<I", data, at)[0]]
        else:
            self.json = json.loads(data)
        self.buffers = [self.load(b.get("uri"), fetch) for b in self.json.get("buffers", [])]
        self.nodes = self.json.get("nodes", [])
        self.animations = self.json.get("animations", [])
        self.cache = {}

    def load(self, uri, fetch):
        if uri is None:
            return self.binary
        if uri.startswith("data:"):
            return base64.b64decode(uri.split(",", 1)[1])
        return fetch(uri)

    def elements(self, view, offset, component, components, count):
        view = self.json["bufferViews"][view]
        letter = FORMATS[component][0]
        size = struct.calcsize("<" + letter) * components
        stride = view.get("byteStride") or size
        at = view.get("byteOffset", 0) + offset
        return [list(struct.unpack_from("<%d%s" % (components, letter), self.buffers[view["buffer"]],
                                        at + i * stride)) for i in range(count)]

    def accessor(self, number):
        """A list of lists of numbers."""
        if number in self.cache:
            return self.cache[number]
        a = self.json["accessors"][number]
        n, component = COUNTS[a["type"]], a["componentType"]
        if "bufferView" in a:
            out = self.elements(a["bufferView"], a.get("byteOffset", 0), component, n, a["count"])
        else:
            out = [[0] * n for _ in range(a["count"])]
        if "sparse" in a:
            s = a["sparse"]
            indices = self.elements(s["indices"]["bufferView"], s["indices"].get("byteOffset", 0),
                                    s["indices"]["componentType"], 1, s["count"])
            values = self.elements(s["values"]["bufferView"], s["values"].get("byteOffset", 0),
                                   component, n, s["count"])
            for (i,), value in zip(indices, values):
                out[i] = value
        if a.get("normalized"):
            scale = FORMATS[component][1]
            out = [[max(x / scale, -1.0) for x in e] for e in out]
        self.cache[number] = out
        return out

    def duration(self, animation):
        samplers = self.animations[animation]["samplers"]
        return max(self.accessor(samplers[c["sampler"]]["input"])[-1][0]
                   for c in self.animations[animation]["channels"])

    def sample(self, sampler, time, path):
        """The value of a sampler (glTF 2.0, appendix C)."""
        times = [t[0] for t in self.accessor(sampler["input"])]
        values = self.accessor(sampler["output"])
        kind = sampler.get("interpolation", "LINEAR")
        factor = 3 if kind == "CUBICSPLINE" else 1
        if path == "weights":
            n = len(values) // (len(times) * factor)
            flat = [v[0] for v in values]
            values = [flat[i * n:(i + 1) * n] for i in range(len(times) * factor)]
        middle = 1 if factor == 3 else 0
        unit = lambda q: [x / (math.sqrt(sum(y * y for y in q)) or 1) for x in q]
        finish = unit if path == "rotation" else (lambda v: v)
        if time <= times[0]:
            return finish(values[middle])
        if time >= times[-1]:
            return finish(values[(len(times) - 1) * factor + middle])
        k = max(i for i in range(len(times)) if times[i] <= time)
        span = times[k + 1] - times[k]
        t = (time - times[k]) / span
        if kind == "STEP":
            return finish(values[k])
        if kind == "CUBICSPLINE":
            v0, b0 = values[3 * k + 1], values[3 * k + 2]
            a1, v1 = values[3 * k + 3], values[3 * k + 4]
            h = [2 * t ** 3 - 3 * t ** 2 + 1, span * (t ** 3 - 2 * t ** 2 + t),
                 -2 * t ** 3 + 3 * t ** 2, span * (t ** 3 - t ** 2)]
            return finish([h[0] * p + h[1] * q + h[2] * r + h[3] * s
                           for p, q, r, s in zip(v0, b0, v1, a1)])
        a, b = values[k], values[k + 1]
        if path != "rotation":
            return [(1 - t) * x + t * y for x, y in zip(a, b)]
        a, b = unit(a), unit(b)
        dot = sum(x * y for x, y in zip(a, b))
        if dot < 0:
            b, dot = [-x for x in b], -dot
        angle = math.acos(min(dot, 1))
        if math.sin(angle) < 1e-5:
            return unit([(1 - t) * x + t * y for x, y in zip(a, b)])
        return [(math.sin((1 - t) * angle) * x + math.sin(t * angle) * y) / math.sin(angle)
                for x, y in zip(a, b)]

    def pose(self, animation=None, time=0):
        """Corners of every triangle: (position, normal or None) in the world."""
        state = [dict(node) for node in self.nodes]
        if animation is not None:
            a = self.animations[animation]
            for channel in a["channels"]:
                target = channel["target"]
                if "node" in target:
                    state[target["node"]][target["path"]] = self.sample(
                        a["samplers"][channel["sampler"]], time, target["path"])
        parent = {c: i for i, n in enumerate(self.nodes) for c in n.get("children", [])}
        worlds = {}

        def world(i):
            if i not in worlds:
                n = state[i]
                local = n.get("matrix") or compose(n.get("translation", [0, 0, 0]),
                                                   n.get("rotation", [0, 0, 0, 1]),
                                                   n.get("scale", [1, 1, 1]))
                worlds[i] = multiply(world(parent[i]), local) if i in parent else local
            return worlds[i]

        corners = []
        scene = self.json["scenes"][self.json.get("scene", 0)]
        stack = list(scene.get("nodes", []))
        while stack:
            i = stack.pop()
            stack += self.nodes[i].get("children", [])
            if "mesh" in state[i]:
                mesh = self.json["meshes"][state[i]["mesh"]]
                weights = state[i].get("weights") or mesh.get("weights") or []
                for primitive in mesh["primitives"]:
                    corners += self.primitive(primitive, weights, state[i].get("skin"), world, i)
        return corners

    def primitive(self, primitive, weights, skin, world, node):
        attributes = primitive["attributes"]
        positions = [list(p) for p in self.accessor(attributes["POSITION"])]
        normals = None
        if "NORMAL" in attributes:
            normals = [list(n) for n in self.accessor(attributes["NORMAL"])]
        for weight, target in zip(weights, primitive.get("targets", [])):
            for name, to in (("POSITION", positions), ("NORMAL", normals)):
                if name in target and to is not None:
                    for vertex, delta in zip(to, self.accessor(target[name])):
                        for k in range(3):
                            vertex[k] += weight * delta[k]
        matrices = [world(node)] * len(positions)
        if skin is not None and "JOINTS_0" in attributes:
            matrices = self.skin_matrices(attributes, skin, world, len(positions))
        positions = [point(m, p) for m, p in zip(matrices, positions)]
        if normals is not None:
            normals = [turn_normal(m, n) for m, n in zip(matrices, normals)]
        indices = range(len(positions))
        if "indices" in primitive:
            indices = [i[0] for i in self.accessor(primitive["indices"])]
        return [(positions[i], normals[i] if normals else None) for i in indices]

    def skin_matrices(self, attributes, skin, world, count):
        skin = self.json["skins"][skin]
        inverse = [IDENTITY] * len(skin["joints"])
        if "inverseBindMatrices" in skin:
            inverse = self.accessor(skin["inverseBindMatrices"])
        joints = [multiply(world(j), m) for j, m in zip(skin["joints"], inverse)]
        out = []
        for v in range(count):
            pairs = []
            for s in range(2):
                if "JOINTS_%d" % s in attributes:
                    pairs += zip(self.accessor(attributes["JOINTS_%d" % s])[v],
                                 self.accessor(attributes["WEIGHTS_%d" % s])[v])
            total = sum(w for _, w in pairs)
            m = [0.0] * 16
            for j, w in pairs:
                if w:
                    m = [a + w / total * b for a, b in zip(m, joints[j])]
            out.append(m)
        return out
