"""One scene written in every way that glTF allows: shapes, attributes, nodes and textures. Each must
give the picture of the plainest file."""
import base64
import itertools
import json
import math
import struct
import unittest
import zlib

import pictures
from harness import Daemon, glb, main
from pictures import box, chunk, off_by_more_than, png, read_png, rgb

SIZE = (1, 0.75, 0.5)  # halves and quarters: exact in 16 bits, too
VIEW = {"width": 120, "height": 90, "technique": {"name": "hard"}, "edges": "none"}
# Of a square of two metres that fills the picture.
FLAT = {"width": 32, "height": 32, "technique": {"name": "none"}, "ground": False, "edges": "none",
        "output": {"layer": "albedo"},
        "camera": {"eye": [0, 0, 4], "target": [0, 0, 0], "fov_y_deg": 28.072486935852957}}

# 32 x 32 px: red and green above blue and yellow.
QUADRANTS = ((200, 40, 40), (40, 200, 40), (40, 40, 200), (200, 200, 40))
JPEG = {
    "plain": (
        "/9j/4AAQSkZJRgABAQAAAQABAAD/2wBDAAIBAQEBAQIBAQECAgICAgQDAgICAgUEBAMEBgUGBgYFBgYGBwkIBg"
        "cJBwYGCAsICQoKCgoKBggLDAsKDAkKCgr/2wBDAQICAgICAgUDAwUKBwYHCgoKCgoKCgoKCgoKCgoKCgoKCgoK"
        "CgoKCgoKCgoKCgoKCgoKCgoKCgoKCgoKCgoKCgr/wAARCAAgACADAREAAhEBAxEB/8QAFgABAQEAAAAAAAAAAA"
        "AAAAAAAAgJ/8QAFBABAAAAAAAAAAAAAAAAAAAAAP/EABgBAQEBAQEAAAAAAAAAAAAAAAAHCggJ/8QAFBEBAAAA"
        "AAAAAAAAAAAAAAAAAP/aAAwDAQACEQMRAD8Al9E3qAArhF2bMBI60NJgCuEXZswGZ7Qo7YAb4Mv60AMD2oBFwG"
        "+DL+tAD//Z"),
    "progressive": (
        "/9j/4AAQSkZJRgABAQAAAQABAAD/2wBDAAIBAQEBAQIBAQECAgICAgQDAgICAgUEBAMEBgUGBgYFBgYGBwkIBg"
        "cJBwYGCAsICQoKCgoKBggLDAsKDAkKCgr/2wBDAQICAgICAgUDAwUKBwYHCgoKCgoKCgoKCgoKCgoKCgoKCgoK"
        "CgoKCgoKCgoKCgoKCgoKCgoKCgoKCgoKCgoKCgr/wgARCAAgACADAREAAhEBAxEB/8QAFgABAQEAAAAAAAAAAA"
        "AAAAAAAAcI/8QAGAEBAQEBAQAAAAAAAAAAAAAAAAYJBwj/2gAMAwEAAhADEAAAAZfE+oBXIvNkSO00mFci82Rm"
        "fQrtg3xl/aDA+oEWN8Zf2g//xAAUEAEAAAAAAAAAAAAAAAAAAABA/9oACAEBAAEFAgf/xAAUEQEAAAAAAAAAAA"
        "AAAAAAAABA/9oACAEDAQE/AQf/xAAUEQEAAAAAAAAAAAAAAAAAAABA/9oACAECAQE/AQf/xAAUEAEAAAAAAAAA"
        "AAAAAAAAAABA/9oACAEBAAY/Agf/xAAUEAEAAAAAAAAAAAAAAAAAAABA/9oACAEBAAE/IQf/2gAMAwEAAgADAA"
        "AAEAAAAAAAAP/EABQRAQAAAAAAAAAAAAAAAAAAAED/2gAIAQMBAT8QB//EABQRAQAAAAAAAAAAAAAAAAAAAED/"
        "2gAIAQIBAT8QB//EABQQAQAAAAAAAAAAAAAAAAAAAED/2gAIAQEAAT8QB//Z"),
    "cmyk": (
        "/9j/7gAOQWRvYmUAZAAAAAAC/9sAQwACAQEBAQECAQEBAgICAgIEAwICAgIFBAQDBAYFBgYGBQYGBgcJCAYHCQ"
        "cGBggLCAkKCgoKCgYICwwLCgwJCgoK/9sAQwECAgICAgIFAwMFCgcGBwoKCgoKCgoKCgoKCgoKCgoKCgoKCgoK"
        "CgoKCgoKCgoKCgoKCgoKCgoKCgoKCgoKCgoK/8AAFAgAIAAgBAERAAIRAQMRAQQRAP/EABgAAQADAQAAAAAAAA"
        "AAAAAAAAAICQoG/8QAFBABAAAAAAAAAAAAAAAAAAAAAP/EABcBAQEBAQAAAAAAAAAAAAAAAAAICgn/xAAUEQEA"
        "AAAAAAAAAAAAAAAAAAAA/9oADgQBAAIRAxEEAAA/AO8UQ4zrIABBNRDXYACdid2RMAEE1ENdgALhGVdzvABmHb"
        "ME7gA08MZ6iAAZh2zBO4AP/9k="),
    "grey": (
        "/9j/4AAQSkZJRgABAQAAAQABAAD/2wBDAAIBAQEBAQIBAQECAgICAgQDAgICAgUEBAMEBgUGBgYFBgYGBwkIBg"
        "cJBwYGCAsICQoKCgoKBggLDAsKDAkKCgr/wAALCAAgACABAREA/8QAFwABAQEBAAAAAAAAAAAAAAAAAAkKCP/E"
        "ABQQAQAAAAAAAAAAAAAAAAAAAAD/2gAIAQEAAD8A4nFQBL8VAEZxogGd8aIB/9k="),
    "halved": (
        "/9j/4AAQSkZJRgABAQAAAQABAAD/2wBDAAIBAQEBAQIBAQECAgICAgQDAgICAgUEBAMEBgUGBgYFBgYGBwkIBg"
        "cJBwYGCAsICQoKCgoKBggLDAsKDAkKCgr/2wBDAQICAgICAgUDAwUKBwYHCgoKCgoKCgoKCgoKCgoKCgoKCgoK"
        "CgoKCgoKCgoKCgoKCgoKCgoKCgoKCgoKCgoKCgr/wAARCAAgACADASIAAhEBAxEB/8QAFgABAQEAAAAAAAAAAA"
        "AAAAAAAAgJ/8QAFBABAAAAAAAAAAAAAAAAAAAAAP/EABcBAQEBAQAAAAAAAAAAAAAAAAcKCAn/xAAUEQEAAAAA"
        "AAAAAAAAAAAAAAAA/9oADAMBAAIRAxEAPwCXwAm6gK4AC6bNmeAoUbYb4AJfzQ//2Q=="),
}
WEBP = {
    "lossless": (
        "UklGRkAAAABXRUJQVlA4TDQAAAAvH8AHAB8gECDkyJImWyCQhDP2qAKBJNRxx5r/sC9MAGG20SQnOckjuH9E/2"
        "PbVH8Bqn4B"),
    "lossy": (
        "UklGRnQAAABXRUJQVlA4IGgAAABQBQCdASogACAAPhUGgkEhBvwEAFEtABOmUI4G8A/AD9gP4BzhmgXYD9gP4B"
        "n/YXAViYAA/vquD/9ugaafv/50Q4HfhrNAVHUejnZIjrw5f6jVcncQydp8moN9/27/E+w0yRDVjVAAAA=="),
    "alpha": (
        "UklGRo4AAABXRUJQVlA4WAoAAAAQAAAAHwAAHwAAQUxQSAoAAAABB1DAiAhERP8DVlA4IF4AAAAQBQCdASogAC"
        "AAPnkukkekoqGhN+gAkA8JaACdMoRwN4B+Kv4wc4ZoF3kzPwJVg/0AAP7upj/hCXFN/6uDh4ySruCLDddued/r"
        "t2zGnzkBJfMe/063F+HdMdu3JYAA"),
}


class Shape(pictures.pose_files.Builder):
    """A box in the making; what is not changed is written plainly."""

    def __init__(self):
        super().__init__()
        self.points, self.normals, self.indices = box(SIZE)
        self.colors = [[(i * 37 + k * 91) % 256 / 255 for k in range(3)] for i in range(24)]
        self.node_members = {"rotation": [0, math.sin(0.3), 0, math.cos(0.3)]}
        self.primitive = {"attributes": {}, "material": 0}
        self.json["materials"] = [{"pbrMetallicRoughness": {"metallicFactor": 0}}]

    def fill(self):
        attributes = self.primitive["attributes"]
        if "POSITION" not in attributes:
            attributes["POSITION"] = self.floats("VEC3", self.points)
        if "NORMAL" not in attributes:
            attributes["NORMAL"] = self.floats("VEC3", self.normals)
        if "COLOR_0" not in attributes:
            attributes["COLOR_0"] = self.floats("VEC3", self.colors)
        if "indices" not in self.primitive:
            indices_of(5125, "I")(self)
        for name in [n for n, a in attributes.items() if a is None]:
            del attributes[name]
        if self.primitive["indices"] is None:
            del self.primitive["indices"]

    def glb(self):
        if not self.json["meshes"]:
            self.fill()
            self.json["meshes"] = [{"primitives": [self.primitive]}]
        if not self.json["nodes"]:
            self.node(True, mesh=0, **self.node_members)
        return super().glb()

    def set(self, name, *accessor, **more):
        self.primitive["attributes"][name] = self.accessor(*accessor, **more)


def indices_of(code, letter):
    def change(s):
        s.primitive["indices"] = s.accessor("SCALAR", code, letter, [[i] for i in s.indices])
    return change


def no_indices(s):
    for name in ("points", "normals", "colors"):
        setattr(s, name, [getattr(s, name)[i] for i in s.indices])
    s.primitive["indices"] = None


def no_normals(s):
    s.primitive["attributes"]["NORMAL"] = None


def modes(mode, order):
    """A primitive per face, of the four corners in this order."""
    def change(s):
        s.fill()
        s.json["meshes"] = [{"primitives": [
            {**s.primitive, "mode": mode, "indices":
             s.accessor("SCALAR", 5123, "H", [[4 * face + i] for i in order])}
            for face in range(6)]}]
    return change


def one_strip(s):
    """All faces in one strip, stitched together by triangles of no extent."""
    order = []
    for face in range(6):
        a, b, c, d = (4 * face + i for i in (1, 2, 0, 3))
        order += ([order[-1], a] if order else []) + [a, b, c, d]
    s.primitive.update(mode=5, indices=s.accessor("SCALAR", 5125, "I", [[i] for i in order]))


def bytes_of_normals(s):
    s.json["extensionsUsed"] = s.json["extensionsRequired"] = ["KHR_mesh_quantization"]
    padded = [[127 * x for x in n] + [0] for n in s.normals]
    s.set("NORMAL", "VEC3", 5120, "b", padded, normalized=True)
    s.json["bufferViews"][-1]["byteStride"] = 4


def shorts_of_positions(s):
    s.json["extensionsUsed"] = s.json["extensionsRequired"] = ["KHR_mesh_quantization"]
    s.set("POSITION", "VEC3", 5122, "h", [[round(1024 * x) for x in p] + [7] for p in s.points])
    s.json["bufferViews"][-1]["byteStride"] = 8
    s.node_members["scale"] = [1 / 1024] * 3


def unsigned_positions(s):
    """Normalised, and moved back by the node."""
    s.json["extensionsUsed"] = s.json["extensionsRequired"] = ["KHR_mesh_quantization"]
    sides = [[0 if x < 0 else 65535 for x in p] + [0] for p in s.points]
    s.set("POSITION", "VEC3", 5123, "H", sides, normalized=True)
    s.json["bufferViews"][-1]["byteStride"] = 8
    inner = s.node(mesh=0, scale=list(SIZE), translation=[-0.5 * x for x in SIZE])
    s.node(True, children=[inner], **s.node_members)


def colors_of(kind, code, letter, most):
    def change(s):
        fourth = most if kind == "VEC4" else 0  # alpha, or padding
        s.set("COLOR_0", kind, code, letter,
              [[x if most == 1 else round(x * most) for x in c] + [fourth] for c in s.colors],
              normalized=most > 1)
        s.json["bufferViews"][-1]["byteStride"] = 4 * struct.calcsize(letter)
    return change


def interleaved(s):
    data = b"".join(struct.pack("<9f", *p, *n, *c)
                    for p, n, c in zip(s.points, s.normals, s.colors))
    view = s.view(data)
    s.json["bufferViews"][view]["byteStride"] = 36
    for k, name in enumerate(("POSITION", "NORMAL", "COLOR_0")):
        s.json["accessors"].append({"bufferView": view, "byteOffset": 12 * k, "componentType": 5126,
                                    "count": 24, "type": "VEC3"})
        s.primitive["attributes"][name] = len(s.json["accessors"]) - 1


def sparse_positions(s):
    """Zeros, and every one replaced."""
    s.primitive["attributes"]["POSITION"] = s.sparse(24, range(24), s.points)


def sparse_over_wrong(s):
    wrong = [[9, 9, 9] if i % 3 == 1 else p for i, p in enumerate(s.points)]
    s.set("POSITION", "VEC3", 5126, "f", wrong)
    right = [p for i, p in enumerate(s.points) if i % 3 == 1]
    s.json["accessors"][-1]["sparse"] = {
        "count": 8,
        "indices": {"bufferView": s.view(bytes(range(1, 24, 3))), "componentType": 5121},
        "values": {"bufferView": s.view(struct.pack("<24f", *itertools.chain(*right)))}}


def sparse_colors(s):
    bright = [[1, 1, 1]] * 24
    s.set("COLOR_0", "VEC3", 5126, "f", bright)
    s.json["accessors"][-1]["sparse"] = {
        "count": 24, "indices": {"bufferView": s.view(struct.pack("<24I", *range(24))),
                                 "componentType": 5125},
        "values": {"bufferView": s.view(struct.pack("<72f", *itertools.chain(*s.colors)))}}


def matrix(s):
    a, b = math.cos(0.6), math.sin(0.6)
    s.node_members = {"matrix": [a, 0, -b, 0, 0, 1, 0, 0, b, 0, a, 0, 0, 0, 0, 1]}


def long_quaternion(s):
    s.node_members["rotation"] = [3 * x for x in s.node_members["rotation"]]


def negative_quaternion(s):
    s.node_members["rotation"] = [-x for x in s.node_members["rotation"]]


def mirrored(signs):
    """Negative scales, undone in the vertices, the winding with them where there are oddly many."""
    def change(s):
        s.points = [[p[k] * signs[k] for k in range(3)] for p in s.points]
        s.normals = [[n[k] * signs[k] for k in range(3)] for n in s.normals]
        if math.prod(signs) < 0:
            s.indices = [i for t in zip(*[iter(s.indices)] * 3) for i in (t[0], t[2], t[1])]
        s.node_members["scale"] = list(signs)
    return change


def nested_mirrors(s):
    """Mirrored twice, by a parent and by the child of its child."""
    s.node(mesh=0, scale=[-1, 1, 1], **s.node_members)
    s.node(children=[0], scale=[1, 1, 1])
    s.node(True, children=[1], scale=[-1, 1, 1])
    mirrored_angle = s.json["nodes"][0]["rotation"]
    mirrored_angle[1] = -mirrored_angle[1]


def instanced(s):
    s.json["extensionsUsed"] = s.json["extensionsRequired"] = ["EXT_mesh_gpu_instancing"]
    rotation = s.node_members.pop("rotation")
    s.node_members["extensions"] = {"EXT_mesh_gpu_instancing": {"attributes": {
        "TRANSLATION": s.floats("VEC3", [[0, 0, 0]]), "SCALE": s.floats("VEC3", [[1, 1, 1]]),
        "ROTATION": s.floats("VEC4", [rotation]), "_ID": s.floats("SCALAR", [[7]])}}}


def morphed(weights_in, sparse):
    """The box is what two targets make of a smaller one."""
    def change(s):
        half = [[0.5 * x for x in p] for p in s.points]
        quarter = [[0.25 * x for x in p] for p in s.points]
        s.set("POSITION", "VEC3", 5126, "f", half)
        more = s.sparse(24, range(24), s.points) if sparse else s.floats("VEC3", s.points)
        s.primitive["targets"] = [{"POSITION": s.floats("VEC3", quarter)}, {"POSITION": more}]
        s.fill()
        s.json["meshes"] = [{"primitives": [s.primitive], "weights": [1, 0.25]}]
        if weights_in == "node":
            s.json["meshes"][0]["weights"] = [7, 7]
            s.node_members["weights"] = [1, 0.25]
    return change


def skinned(code, letter, most, total, inverse=True):
    """Half of each joint's weight; the node's own transform does not count, nor what weights add up
    to."""
    def change(s):
        share = total / 2 if most == 1 else round(total / 2 * most)
        s.set("JOINTS_0", "VEC4", 5123 if code == 5123 else 5121, "H" if code == 5123 else "B",
              [[0, 1, 0, 0]] * 24)
        s.set("WEIGHTS_0", "VEC4", code, letter, [[share, share, 0, 0]] * 24,
              **({"normalized": True} if most > 1 else {}))
        s.fill()
        s.json["meshes"] = [{"primitives": [s.primitive]}]
        turn = s.node_members["rotation"]
        still = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]
        s.json["skins"] = [{"joints": [1, 2], "skeleton": 1}]
        if inverse:
            s.json["skins"][0]["inverseBindMatrices"] = s.floats("MAT4", [still, still])
        s.node(True, mesh=0, skin=0, translation=[5, 6, 7], scale=[3, 3, 3])
        s.node(True, rotation=turn, children=[2])
        s.node()
    return change


def eight_weights(s):
    """Seven joints do nothing of their own; the eighth turns like the others."""
    s.set("JOINTS_0", "VEC4", 5121, "B", [[0, 1, 2, 3]] * 24)
    s.set("JOINTS_1", "VEC4", 5121, "B", [[4, 5, 6, 7]] * 24)
    s.set("WEIGHTS_0", "VEC4", 5126, "f", [[0.1, 0.1, 0.1, 0.1]] * 24)
    s.set("WEIGHTS_1", "VEC4", 5126, "f", [[0.1, 0.1, 0.1, 0.3]] * 24)
    s.fill()
    s.json["meshes"] = [{"primitives": [s.primitive]}]
    s.json["skins"] = [{"joints": list(range(1, 9))}]
    s.node(True, mesh=0, skin=0)
    for _ in range(8):
        s.node(True, **s.node_members)


SHAPES = {
    "8-bit indices": indices_of(5121, "B"), "16-bit indices": indices_of(5123, "H"),
    "no indices": no_indices, "no normals": no_normals, "fans": modes(6, (0, 1, 2, 3)),
    "strips": modes(5, (1, 2, 0, 3)), "one strip": one_strip, "bytes of normals": bytes_of_normals,
    "shorts of positions": shorts_of_positions, "unsigned positions": unsigned_positions,
    "float colours with alpha": colors_of("VEC4", 5126, "f", 1),
    "bytes of colours": colors_of("VEC3", 5121, "B", 255),
    "bytes of colours with alpha": colors_of("VEC4", 5121, "B", 255),
    "shorts of colours": colors_of("VEC3", 5123, "H", 65535),
    "shorts of colours with alpha": colors_of("VEC4", 5123, "H", 65535),
    "interleaved": interleaved, "sparse positions": sparse_positions,
    "sparse over wrong ones": sparse_over_wrong, "sparse colours": sparse_colors, "matrix": matrix,
    "long quaternion": long_quaternion, "negative quaternion": negative_quaternion,
    "nested mirrors": nested_mirrors, "instanced": instanced,
    "morphed": morphed("mesh", False), "morphed by the node": morphed("node", False),
    "morphed sparsely": morphed("mesh", True), "skinned": skinned(5126, "f", 1, 1),
    "weights of two": skinned(5126, "f", 1, 2), "weights of a half": skinned(5126, "f", 1, 0.5),
    "bytes of weights": skinned(5121, "B", 255, 1),
    "shorts of weights": skinned(5123, "H", 65535, 1),
    "no inverse bind matrices": skinned(5126, "f", 1, 1, False), "eight weights": eight_weights,
    **{"mirrored %+d %+d %+d" % signs: mirrored(signs)
       for signs in itertools.product((1, -1), repeat=3) if min(signs) < 0}}


def quadrant(x, y):
    return (x >= 16) + 2 * (y >= 16)


def pixels(of):
    return [[of(quadrant(x, y)) for x in range(32)] for y in range(32)]


GREYS = (0, 85, 170, 255)  # in 2 bits and more
ENDS = (0, 255, 255, 0)
PALETTE = chunk(b"PLTE", b"".join(bytes(c) for c in QUADRANTS))
GAMMA = chunk(b"gAMA", struct.pack(">I", 100000)), chunk(b"cHRM", struct.pack(
    ">8I", 31270, 32900, 73470, 26530, 11500, 82600, 15700, 1800))
EXIF = b"Exif\0\0MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0\x06\0\0\0\0\0\0"


def grey(values):
    return [(v, v, v) for v in values]


def exif(jpeg):
    """Said to be turned by a right angle, which loaders of glTF do not look at."""
    return jpeg[:2] + b"\xff\xe1" + struct.pack(">H", len(EXIF) + 2) + EXIF + jpeg[2:]


def textures():
    """Name, bytes, type, what the quadrants show, and how far a channel may be off."""
    rgb8 = pixels(lambda q: QUADRANTS[q])
    wide = pixels(lambda q: tuple(257 * v for v in QUADRANTS[q]))
    for interlaced in (False, True):
        for name, rows, colour, depth, want, *chunks in (
                ("RGB 8", rgb8, 2, 8, QUADRANTS), ("RGB 16", wide, 2, 16, QUADRANTS),
                ("RGBA 8", pixels(lambda q: QUADRANTS[q] + (9,)), 6, 8, QUADRANTS),
                ("RGBA 16", pixels(lambda q: (*(257 * v for v in QUADRANTS[q]), 99)), 6, 16,
                 QUADRANTS),
                ("grey 1", pixels(lambda q: (ENDS[q] & 1,)), 0, 1, grey(ENDS)),
                ("grey 2", pixels(lambda q: (q,)), 0, 2, grey(GREYS)),
                ("grey 4", pixels(lambda q: (5 * q,)), 0, 4, grey(GREYS)),
                ("grey 8", pixels(lambda q: (GREYS[q],)), 0, 8, grey(GREYS)),
                ("grey 16", pixels(lambda q: (257 * GREYS[q],)), 0, 16, grey(GREYS)),
                ("grey and alpha 8", pixels(lambda q: (GREYS[q], 50)), 4, 8, grey(GREYS)),
                ("grey and alpha 16", pixels(lambda q: (257 * GREYS[q], 50)), 4, 16, grey(GREYS)),
                ("palette 1", pixels(lambda q: (q & 1,)), 3, 1,
                 [QUADRANTS[q & 1] for q in range(4)],
                 chunk(b"PLTE", bytes(QUADRANTS[0] + QUADRANTS[1]))),
                ("palette 2", pixels(lambda q: (q,)), 3, 2, QUADRANTS, PALETTE),
                ("palette 4", pixels(lambda q: (q,)), 3, 4, QUADRANTS, PALETTE),
                ("palette 8", pixels(lambda q: (q,)), 3, 8, QUADRANTS, PALETTE),
                ("palette of more than 2 bits can say", pixels(lambda q: (q,)), 3, 2, QUADRANTS,
                 chunk(b"PLTE", (b"".join(bytes(c) for c in QUADRANTS) * 64)[:768])),
                ("palette with alpha", pixels(lambda q: (q,)), 3, 8, QUADRANTS, PALETTE,
                 chunk(b"tRNS", b"\0\x80")),
                ("a transparent colour", rgb8, 2, 8, QUADRANTS,
                 chunk(b"tRNS", struct.pack(">3H", *QUADRANTS[1]))),
                ("gamma and primaries", rgb8, 2, 8, QUADRANTS, *GAMMA)):
            yield (name + (", interlaced" if interlaced else ""),
                   png(rows, colour, depth, interlaced, *chunks), "image/png", want, 1)
    for name, text in JPEG.items():
        data, greys = base64.b64decode(text), name == "grey"
        want = [(round(0.2126 * r + 0.7152 * g + 0.0722 * b),) * 3 for r, g, b in QUADRANTS]
        yield "JPEG " + name, data, "image/jpeg", want if greys else QUADRANTS, 6
        yield "turned JPEG " + name, exif(data), "image/jpeg", want if greys else QUADRANTS, 6
        yield "mislabelled JPEG " + name, data, "image/png", want if greys else QUADRANTS, 6
    for name, text in WEBP.items():
        yield "WebP " + name, base64.b64decode(text), "image/webp", QUADRANTS, 6


def square(image, kind, texture=None, info=None, right=0, sets=2, maps=None, **more):
    """A square with this picture on it. Of its sets of coordinates one is right. maps: of the material."""
    b = pictures.pose_files.Builder()
    corners = [[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]
    uv, wrong = [[0, 1], [1, 1], [1, 0], [0, 0]], [[0.3, 0.3]] * 4
    attributes = {"POSITION": b.floats("VEC3", corners),
                  **{"TEXCOORD_%d" % i: b.floats("VEC2", uv if i == right else wrong)
                     for i in range(sets)}}
    b.json["meshes"] = [{"primitives": [
        {"attributes": attributes, "material": 0,
         "indices": b.accessor("SCALAR", 5123, "H", [[i] for i in (0, 1, 2, 0, 2, 3)])}]}]
    b.json["images"] = [{"bufferView": b.view(image), "mimeType": kind}]
    b.json["samplers"] = [{"magFilter": 9728, "minFilter": 9728}]
    b.json["textures"] = [{"source": 0, "sampler": 0, **(texture or {})}]
    b.json["materials"] = [{**(maps or {}), "pbrMetallicRoughness": {
        "metallicFactor": 0, "baseColorTexture": {"index": 0, **(info or {})}}}]
    b.json.update(more)
    b.node(True, mesh=0)
    return b.glb()


class Encodings(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.d = Daemon()

    @classmethod
    def tearDownClass(cls):
        assert cls.d.stop() == 0

    def post(self, data):
        answer = self.d.call("POST", "/v1/scenes", data, {"Content-Type": "model/gltf-binary"})
        self.assertEqual(answer.status, 201, answer.body)
        return answer.json()

    def test_shapes(self):
        plain = rgb(self.d.render(self.post(Shape().glb())["id"], VIEW))
        for name, change in SHAPES.items():
            with self.subTest(name=name):
                shape = Shape()
                change(shape)
                info = self.post(shape.glb())
                self.assertEqual(info["warnings"], [])
                got = rgb(self.d.render(info["id"], VIEW))
                self.assertEqual(off_by_more_than(plain, got, 2), 0)

    def look(self, data, want, off, warned=False):
        """The middles of the quadrants."""
        info = self.post(data)
        self.assertEqual(bool(info["warnings"]), warned, info["warnings"])
        answer = self.d.render(info["id"], FLAT)
        self.assertEqual(answer.status, 200, answer.body)
        rows = read_png(answer.body)[2]
        for q, color in enumerate(want):
            got = rows[8 + 16 * (q // 2)][8 + 16 * (q % 2)][:3]
            self.assertLessEqual(max(abs(a - b) for a, b in zip(got, color)), off, (q, got, color))

    def test_textures(self):
        for name, data, kind, want, off in textures():
            with self.subTest(name=name):
                self.look(square(data, kind), want, off, "mislabelled" in name)

    def test_damaged_texture(self):
        """What there is of it is shown, with a warning; a picture without a row is plain."""
        whole = png(pixels(lambda q: QUADRANTS[q]), 2, 8)
        at = whole.index(b"IDAT")
        data = zlib.decompress(whole[at + 4:-16])
        for name, rows, checksum, want in (
                ("a wrong checksum", 32, b"\0\0\0\0", QUADRANTS),
                ("the lower half is missing", 16, b"", QUADRANTS[:2]), ("nothing", 0, b"", ())):
            packer = zlib.compressobj()
            packed = packer.compress(data[:97 * rows])
            packed += packer.flush(zlib.Z_FINISH if checksum else zlib.Z_SYNC_FLUSH)
            packed = packed[:-4] + checksum if checksum else packed
            with self.subTest(name=name):
                image = whole[:at - 4] + chunk(b"IDAT", packed) + chunk(b"IEND", b"")
                self.look(square(image, "image/png"), want, 1, True)

    def test_places_of_textures(self):
        plain = png(pixels(lambda q: QUADRANTS[q]), 2, 8)
        transform = ["KHR_texture_transform"]
        turned = {"rotation": math.pi / 2, "offset": [0, 1]}
        swapped = [QUADRANTS[q] for q in (2, 0, 3, 1)]  # shows its point (v, 1 - u) at (u, v)
        for name, info, right, want in (
                ("second set", {"texCoord": 1}, 1, QUADRANTS),
                ("second set by the transform",
                 {"texCoord": 0, "extensions": {"KHR_texture_transform": {"texCoord": 1}}}, 1,
                 QUADRANTS),
                ("flipped", {"extensions": {"KHR_texture_transform": {
                    "scale": [-1, 1], "offset": [1, 0]}}}, 0,
                 [QUADRANTS[q] for q in (1, 0, 3, 2)]),
                ("turned", {"extensions": {"KHR_texture_transform": turned}}, 0, swapped),
                ("turned, second set", {"extensions": {"KHR_texture_transform": {
                    **turned, "texCoord": 1}}}, 1, swapped),
                ("wrapped", {"extensions": {"KHR_texture_transform": {
                    "offset": [7.5, -3.5]}}}, 0, QUADRANTS[::-1])):
            with self.subTest(name=name):
                self.look(square(plain, "image/png", info=info, right=right,
                                 extensionsUsed=transform), want, 1)

    def test_many_sets_of_coordinates(self):
        """Any two of them may be used by a material, and others by another."""
        plain = png(pixels(lambda q: QUADRANTS[q]), 2, 8)
        other = {"occlusionTexture": {"index": 0, "strength": 0, "texCoord": 4}}
        for right in range(2, 8):
            for maps in ({}, other):
                with self.subTest(set=right, maps=maps):
                    self.look(square(plain, "image/png", info={"texCoord": right}, right=right,
                                     sets=8, maps=maps), QUADRANTS, 1)
        third = {**other, "emissiveTexture": {"index": 0, "texCoord": 3}}
        self.look(square(plain, "image/png", info={"texCoord": 2}, right=2, sets=8, maps=third),
                  QUADRANTS, 1, True)

    def test_webp_beside_png(self):
        """A decoder for WebP is here: its picture is the one that is meant."""
        wrong = png(pixels(lambda q: (1, 2, 3)), 2, 8)
        texture = {"source": 0, "extensions": {"EXT_texture_webp": {"source": 1}}}
        used = ["EXT_texture_webp"]
        data = square(wrong, "image/png", texture, extensionsUsed=used)
        webp = "data:image/webp;base64," + WEBP["lossless"]
        size, = struct.unpack("<I", data[12:16])
        document = json.loads(data[20:20 + size])
        document["images"].append({"uri": webp})
        self.look(glb(document, data[28 + size:]), QUADRANTS, 1)


if __name__ == "__main__":
    main()
