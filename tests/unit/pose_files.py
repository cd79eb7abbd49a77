"""Small glTF files with skins, morph targets and animations of every kind, made from a seed."""
import json
import math
import random
import struct


class Builder:
    def __init__(self):
        self.data = bytearray()
        self.json = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": []}],
                     "nodes": [], "meshes": [], "accessors": [], "bufferViews": [],
                     "buffers": [{}]}

    def view(self, data):
        self.data += bytes(-len(self.data) % 4)
        self.json["bufferViews"].append(
            {"buffer": 0, "byteOffset": len(self.data), "byteLength": len(data)})
        self.data += data
        return len(self.json["bufferViews"]) - 1

    def accessor(self, kind, component, letter, items, **more):
        flat = [x for item in items for x in item]
        self.json["accessors"].append(dict(
            {"bufferView": self.view(struct.pack("<%d%s" % (len(flat), letter), *flat)),
             "componentType": component, "count": len(items), "type": kind}, **more))
        return len(self.json["accessors"]) - 1

    def floats(self, kind, items):
        return self.accessor(kind, 5126, "f", items)

    def sparse(self, count, indices, values):
        """Zeros but for a few."""
        self.json["accessors"].append({
            "componentType": 5126, "count": count, "type": "VEC3",
            "sparse": {"count": len(indices), "indices": {
                "bufferView": self.view(struct.pack("<%dH" % len(indices), *indices)),
                "componentType": 5123}, "values": {
                    "bufferView": self.view(struct.pack("<%df" % (3 * len(values)),
                                                        *[x for v in values for x in v]))}}})
        return len(self.json["accessors"]) - 1

    def node(self, root=False, **members):
        self.json["nodes"].append(members)
        if root:
            self.json["scenes"][0]["nodes"].append(len(self.json["nodes"]) - 1)
        return len(self.json["nodes"]) - 1

    def animate(self, name, channels):
        """channels: (node, path, times, values, interpolation[, normalised])"""
        a = {"name": name, "channels": [], "samplers": []}
        for node, path, times, values, interpolation, *normalised in channels:
            kind = {"rotation": "VEC4", "weights": "SCALAR"}.get(path, "VEC3")
            if normalised:
                output = self.accessor(kind, 5122, "h", [[round(x * 32767) for x in v]
                                                         for v in values], normalized=True)
            else:
                output = self.floats(kind, values)
            a["samplers"].append({"input": self.floats("SCALAR", [[t] for t in times]),
                                  "output": output, "interpolation": interpolation})
            a["channels"].append({"sampler": len(a["samplers"]) - 1,
                                  "target": {"node": node, "path": path}})
        self.json.setdefault("animations", []).append(a)

    def glb(self):
        self.json["buffers"][0]["byteLength"] = max(len(self.data), 4)
        self.data += bytes(max(4 - len(self.data), -len(self.data) % 4))
        text = json.dumps(self.json).encode()
        text += b" " * (-len(text) % 4)
        return (struct.pack("<4sII", b"glTF", 2, 28 + len(text) + len(self.data)) +
                struct.pack("<I4s", len(text), b"JSON") + text +
                struct.pack("<I4s", len(self.data), b"BIN\0") + bytes(self.data))


def unit(r, n):
    v = [r.gauss(0, 1) for _ in range(n)]
    length = math.sqrt(sum(x * x for x in v))
    return [x / length for x in v]


def tube(r, rings=6, sides=5):
    """Positions, outward normals and triangles of a bent tube along y."""
    positions, normals = [], []
    for i in range(rings):
        for k in range(sides):
            angle = 2 * math.pi * k / sides + 0.1 * i
            normals.append([math.cos(angle), 0, math.sin(angle)])
            positions.append([0.3 * math.cos(angle) + 0.1 * r.random(), i * 0.4,
                              0.3 * math.sin(angle)])
    triangles = []
    for i in range(rings - 1):
        for k in range(sides):
            a, b = i * sides + k, i * sides + (k + 1) % sides
            triangles += [a, a + sides, b, b, a + sides, b + sides]
    return positions, normals, triangles


def keys(r, count):
    times, at = [], 0.1
    for _ in range(count):
        times.append(at)
        at += 0.1 + r.random()
    return times


def skinned(seed, sets, mirrored=False, normals=True, floor=False, at=(2, 0, -1)):
    """A tube on a chain of joints under a scaled node; the mesh's own node is moved away, which must
    not show. All three interpolations."""
    r, b = random.Random(seed), Builder()
    positions, given, triangles = tube(r)
    mesh = {"attributes": {"POSITION": b.floats("VEC3", positions)},
            "indices": b.accessor("SCALAR", 5123, "H", [[i] for i in triangles])}
    if normals:
        mesh["attributes"]["NORMAL"] = b.floats("VEC3", given)
    root = b.node(True, children=[], scale=[-1.3 if mirrored else 1.3, 1.3, 1.3],
                  translation=list(at), rotation=unit(r, 4))
    chain, parent = [], root
    for i in range(5):
        joint = b.node(translation=[0, 0.4 if i else 0, 0], rotation=[0, 0, 0.05 * i, 1])
        b.json["nodes"][parent].setdefault("children", []).append(joint)
        chain.append(joint)
        parent = joint
    for s in range(sets):
        joints, weights = [], []
        for _ in positions:
            joints.append([r.randrange(5) for _ in range(4)])
            w = [r.random() for _ in range(4)]
            weights.append([x / sum(w) / sets for x in w])
        mesh["attributes"]["JOINTS_%d" % s] = b.accessor(
            "VEC4", 5121 if s else 5123, "B" if s else "H", joints)
        mesh["attributes"]["WEIGHTS_%d" % s] = b.floats("VEC4", weights)
    b.json["meshes"].append({"primitives": [mesh]})
    inverse = [[1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0.01 * i, -0.4 * i, 0, 1] for i in range(5)]
    b.json["skins"] = [{"joints": chain, "inverseBindMatrices": b.floats("MAT4", inverse)}]
    b.node(True, mesh=0, skin=0, translation=[50, 60, 70], scale=[9, 9, 9])
    if floor:
        corners = [[-9, -4, -9], [-9, -4, 9], [9, -4, 9], [-9, -4, -9], [9, -4, 9], [9, -4, -9]]
        b.json["meshes"].append(
            {"primitives": [{"attributes": {"POSITION": b.floats("VEC3", corners)}}]})
        b.node(True, mesh=1)
    times = keys(r, 4)
    b.animate("bend", [
        (chain[1], "rotation", times, [unit(r, 4) for _ in times], "LINEAR"),
        (chain[2], "rotation", times, [unit(r, 4) for _ in range(12)], "CUBICSPLINE"),
        (chain[3], "rotation", times, [unit(r, 4) for _ in times], "STEP"),
        (chain[4], "rotation", times, [unit(r, 4) for _ in times], "LINEAR", True),
        (root, "translation", times, [[a - b + r.random() for a, b in zip(at, (2, 0, -1))]
                                      for _ in times], "LINEAR")])
    times = keys(r, 3)
    b.animate("grow", [
        (chain[1], "scale", times, [[1 + r.random() for _ in range(3)] for _ in range(9)],
         "CUBICSPLINE"),
        (chain[0], "translation", times[:1], [[0, 1, 0]], "LINEAR")])
    return b.glb()


def morphed(seed):
    """Two nodes with one mesh: one with weights of its own, one with the mesh's; dense and sparse
    targets; a third node of the same mesh is skinned as well."""
    r, b = random.Random(seed), Builder()
    positions, given, triangles = tube(r)
    n = len(positions)
    shift = lambda: [[0.3 * r.gauss(0, 1) for _ in range(3)] for _ in range(n)]
    some = sorted(r.sample(range(n), 7))
    targets = [{"POSITION": b.floats("VEC3", shift()), "NORMAL": b.floats("VEC3", shift())},
               {"POSITION": b.sparse(n, some, shift()[:7])},
               {"POSITION": b.floats("VEC3", shift())}]
    b.json["meshes"].append({"weights": [0.5, -0.25, 0], "primitives": [{
        "attributes": {"POSITION": b.floats("VEC3", positions), "NORMAL": b.floats("VEC3", given)},
        "indices": b.accessor("SCALAR", 5125, "I", [[i] for i in triangles]),
        "targets": targets}]})
    first = b.node(True, mesh=0, translation=[1, 2, 3], rotation=unit(r, 4), scale=[1, -2, 0.5])
    second = b.node(True, mesh=0, weights=[0, 1, 0.3])
    b.node(True, mesh=0, translation=[-4, 0, 0])
    times = keys(r, 5)
    values = lambda count: [[r.random()] for _ in range(3 * count)]
    b.animate("", [(first, "weights", times, values(5), "LINEAR"),
                   (second, "weights", times, values(15), "CUBICSPLINE"),
                   (second, "rotation", times, [unit(r, 4) for _ in times], "LINEAR")])
    b.animate("jump", [(first, "weights", times, values(5), "STEP")])
    return b.glb()


def morphed_far(seed, shift, back=(0, 0, 0)):
    """A mesh that a target takes far away at rest, as a whole, while another one bends it; beside it
    the same mesh that goes there with time."""
    r, b = random.Random(seed), Builder()
    positions, given, triangles = tube(r)
    n = len(positions)
    bend = [[0.2 * r.gauss(0, 1) for _ in range(3)] for _ in range(n)]
    b.json["meshes"].append({"weights": [1, 0.5], "primitives": [{
        "attributes": {"POSITION": b.floats("VEC3", positions), "NORMAL": b.floats("VEC3", given)},
        "indices": b.accessor("SCALAR", 5125, "I", [[i] for i in triangles]),
        "targets": [{"POSITION": b.floats("VEC3", [shift] * n)},
                    {"POSITION": b.floats("VEC3", bend)}]}]})
    b.node(True, mesh=0, translation=list(back))
    moving = b.node(True, mesh=0, translation=[x + 1 for x in back], weights=[1, 0])
    b.animate("go", [(moving, "weights", [0, 1, 2], [[1], [0], [1], [1], [1], [0.3]], "LINEAR")])
    return b.glb()


def nodes_far(seed, to):
    """All that there is goes far away."""
    r, b = random.Random(seed), Builder()
    positions, given, triangles = tube(r)
    b.json["meshes"].append({"primitives": [{
        "attributes": {"POSITION": b.floats("VEC3", positions), "NORMAL": b.floats("VEC3", given)},
        "indices": b.accessor("SCALAR", 5125, "I", [[i] for i in triangles])}]})
    top = b.node(True, children=[1, 2])
    b.node(mesh=0, rotation=unit(r, 4))
    b.node(mesh=0, translation=[1, 2, 3])
    b.animate("go", [(top, "translation", [0, 0.1, 1], [[0, 0, 0], to, to], "LINEAR"),
                     (top, "rotation", [0, 1], [unit(r, 4), unit(r, 4)], "LINEAR")])
    return b.glb()


def skinned_and_morphed(seed):
    r, b = random.Random(seed), Builder()
    positions, _, triangles = tube(r)
    n = len(positions)
    shift = [[0.2 * r.gauss(0, 1) for _ in range(3)] for _ in range(n)]
    attributes = {"POSITION": b.floats("VEC3", positions),
                  "JOINTS_0": b.accessor("VEC4", 5121, "B", [[i % 2, 1 - i % 2, 0, 0]
                                                             for i in range(n)]),
                  "WEIGHTS_0": b.accessor("VEC4", 5121, "B", [[200, 55, 0, 0]] * n,
                                          normalized=True)}
    b.json["meshes"].append({"primitives": [{
        "attributes": attributes, "targets": [{"POSITION": b.floats("VEC3", shift)}],
        "indices": b.accessor("SCALAR", 5123, "H", [[i] for i in triangles])}]})
    joints = [b.node(True, rotation=unit(r, 4)), b.node(True, translation=[0.5, 0, 0])]
    b.json["skins"] = [{"joints": joints}]
    for weight in (0.25, 0.75):  # two characters of one mesh
        b.node(True, mesh=0, skin=0, weights=[weight])
    times = keys(r, 3)
    b.animate("both", [
        (2, "weights", times, [[r.random()] for _ in times], "LINEAR"),
        (joints[1], "translation", times, [unit(r, 3) for _ in times], "LINEAR")])
    return b.glb()


def all_files():
    yield "skin-4.glb", skinned(1, 1)
    yield "skin-8.glb", skinned(2, 2)
    yield "skin-mirrored.glb", skinned(3, 1, mirrored=True)
    yield "skin-flat.glb", skinned(4, 1, normals=False)
    yield "skin-far.glb", skinned(7, 1, at=(500000, 30, -4000000))
    yield "morph.glb", morphed(5)
    yield "morph-far.glb", morphed_far(8, (1e6, 0, 0))
    yield "morph-utm.glb", morphed_far(9, (500000.5, 250, -4649776))
    yield "morph-back.glb", morphed_far(10, (-500000.5, -250, 4649776),
                                        back=(500000.5, 250, -4649776))
    yield "nodes-far.glb", nodes_far(11, (-3178068.5, 6378137, 4487348))
    yield "skin-morph.glb", skinned_and_morphed(6)
