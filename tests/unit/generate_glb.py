"""Reads every generated scene as a glTF binary and as a blob, with readers of its own, and checks that
the glTF keeps to the specification and that both describe the same scene.

usage: generate_glb.py path/to/generate_dump
"""
import json
import math
import struct
import subprocess
import sys
import zlib
from array import array

KINDS = ["demo", "half-plane", "square", "stacked", "duplicate", "planar-mask", "plane", "empty-room",
         "hairball", "foliage", "columns"]
SIZES = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
WRAP = {10497: 0, 33071: 1, 33648: 2}


def dump(program, kind, form):
    return subprocess.run([program, kind, "20000", form], check=True, stdout=subprocess.PIPE).stdout


def read_png(data):
    """RGBA rows of an 8-bit PNG without filters; checks every checksum."""
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    at, packed, header, ended = 8, b"", None, False
    while at < len(data):
        size, = struct.unpack(">I", data[at:at + 4])
        kind, body = data[at + 4:at + 8], data[at + 8:at + 8 + size]
        crc, = struct.unpack(">I", data[at + 8 + size:at + 12 + size])
        assert crc == zlib.crc32(kind + body), kind
        if kind == b"IHDR":
            header = struct.unpack(">IIBBBBB", body)
        elif kind == b"IDAT":
            packed += body
        ended = kind == b"IEND"
        at += 12 + size
    width, height, depth, color, compression, filters, interlace = header
    assert ended and (depth, compression, filters, interlace) == (8, 0, 0, 0)
    channels = {2: 3, 6: 4}[color]
    raw = zlib.decompress(packed)  # checks Adler-32
    row = 1 + width * channels
    assert len(raw) == row * height
    out = bytearray()
    for y in range(height):
        assert raw[y * row] == 0
        line = raw[y * row + 1:(y + 1) * row]
        if channels == 4:
            out += line
        else:
            for x in range(width):
                out += line[3 * x:3 * x + 3] + b"\xff"
    return width, height, bytes(out)


class Glb:
    def __init__(self, data):
        magic, version, total = struct.unpack("<4sII", data[:12])
        assert magic == b"glTF" and version == 2 and total == len(data)
        size, kind = struct.unpack("<I4s", data[12:20])
        assert kind == b"JSON" and size % 4 == 0
        self.doc = json.loads(data[20:20 + size].decode("utf-8"))
        at = 20 + size
        size, kind = struct.unpack("<I4s", data[at:at + 8])
        assert kind == b"BIN\0" and size % 4 == 0 and at + 8 + size == total
        self.bin = data[at + 8:]
        assert self.doc["asset"]["version"] == "2.0"
        length, = [b["byteLength"] for b in self.doc["buffers"]]
        assert length <= size <= length + 3
        end = 0
        for view in self.doc["bufferViews"]:
            assert view["buffer"] == 0 and view["byteOffset"] % 4 == 0 and view["byteLength"] > 0
            assert end <= view["byteOffset"] and view["byteOffset"] + view["byteLength"] <= length
            end = view["byteOffset"] + view["byteLength"]

    def view(self, index):
        view = self.doc["bufferViews"][index]
        return self.bin[view["byteOffset"]:view["byteOffset"] + view["byteLength"]]

    def accessor(self, index, kind, component, target):
        a = self.doc["accessors"][index]
        assert a["type"] == kind and a["componentType"] == component
        assert self.doc["bufferViews"][a["bufferView"]]["target"] == target
        out = array("f" if component == 5126 else "I")
        out.frombytes(self.view(a["bufferView"]))
        width = SIZES[kind]
        assert len(out) == a["count"] * width and len(out) > 0
        if "min" in a:
            assert len(a["min"]) == len(a["max"]) == width
            for k in range(width):
                column = out[k::width]
                as_float = array("f", [a["min"][k], a["max"][k]])
                assert min(column) == as_float[0] and max(column) == as_float[1], "min and max"
        return out


class Blob:
    def __init__(self, data):
        assert data[:8] == b"PSCENE\r\n"
        self.bounds = struct.unpack("<6f", data[80:104])
        self.triangles, = struct.unpack("<Q", data[128:136])
        sections = struct.unpack("<26Q", data[144:144 + 208])
        cut = [data[sections[2 * i]:sections[2 * i] + sections[2 * i + 1]] for i in range(13)]
        self.positions = array("f")
        self.positions.frombytes(cut[0])
        self.normals, self.uv = [], array("f")
        for at in range(0, len(cut[1]), 36):
            self.normals.append(struct.unpack("<3h", cut[1][at:at + 6]))
            self.uv.frombytes(cut[1][at + 16:at + 24])
        self.tangents = [cut[1][at + 8:at + 16] != bytes(8) for at in range(0, len(cut[1]), 36)]
        self.indices = array("I")
        self.indices.frombytes(cut[2])
        self.primitives = [struct.unpack("<8I", cut[4][at:at + 32]) for at in range(0, len(cut[4]), 68)]
        self.instances = [struct.unpack("<12fII", cut[5][at:at + 56]) for at in range(0, len(cut[5]), 56)]
        self.materials = [cut[6][at:at + 232] for at in range(0, len(cut[6]), 232)]
        self.textures = [struct.unpack("<4I", cut[7][at:at + 16]) for at in range(0, len(cut[7]), 16)]
        self.images = [struct.unpack("<4IQ", cut[8][at:at + 24]) for at in range(0, len(cut[8]), 24)]
        self.texels = cut[9]
        self.cameras = [struct.unpack("<6d4f", cut[11][at:at + 64]) for at in range(0, len(cut[11]), 128)]


def near(a, b, tolerance=1e-6):
    return abs(a - b) <= tolerance * max(1, abs(a), abs(b))


def check_material(glb, blob, index):
    m, raw = glb.doc["materials"][index], blob.materials[index]
    factors = struct.unpack("<9f", raw[:36])
    alpha_cutoff, alpha_mode, flags = struct.unpack("<fII", raw[60:72])
    base, = struct.unpack("<i", raw[72:76])
    normal, = struct.unpack("<i", raw[72 + 64:72 + 68])
    pbr = m["pbrMetallicRoughness"]
    for k in range(4):
        assert near(pbr["baseColorFactor"][k], factors[k])
    assert near(pbr["metallicFactor"], factors[7]) and near(pbr["roughnessFactor"], factors[8])
    assert pbr.get("baseColorTexture", {"index": -1})["index"] == base
    assert m.get("normalTexture", {"index": -1})["index"] == normal
    assert (m.get("alphaMode", "OPAQUE") == "MASK") == (alpha_mode == 1)
    assert alpha_mode != 1 or near(m["alphaCutoff"], alpha_cutoff)
    assert m.get("doubleSided", False) == bool(flags & 1)
    return base, normal


def check_textures(glb, blob, srgb):
    doc = glb.doc
    assert len(doc.get("textures", [])) == len(blob.textures)
    for index, (image, wrap_s, wrap_t, nearest) in enumerate(blob.textures):
        texture = doc["textures"][index]
        sampler = doc["samplers"][texture["sampler"]]
        assert WRAP[sampler["wrapS"]] == wrap_s and WRAP[sampler["wrapT"]] == wrap_t
        assert (sampler["magFilter"] == 9728) == bool(nearest & 1)
        expected = {0: 9987, 2: 9986, 4: 9985, 6: 9984, 8: 9729, 10: 9728}[nearest & 14]
        assert sampler["minFilter"] == expected
        entry = doc["images"][texture["source"]]
        assert entry["mimeType"] == "image/png"
        width, height, pixels = read_png(glb.view(entry["bufferView"]))
        w, h, _, is_srgb, first = blob.images[image]
        assert (width, height) == (w, h) and pixels == blob.texels[first:first + 4 * w * h]
        assert bool(is_srgb) == (index in srgb)


def check_mesh(glb, blob, index):
    primitive, = glb.doc["meshes"][index]["primitives"]
    attributes = primitive["attributes"]
    positions = glb.accessor(attributes["POSITION"], "VEC3", 5126, 34962)
    normals = glb.accessor(attributes["NORMAL"], "VEC3", 5126, 34962)
    uv = glb.accessor(attributes["TEXCOORD_0"], "VEC2", 5126, 34962)
    indices = glb.accessor(primitive["indices"], "SCALAR", 5125, 34963)
    assert "min" in glb.doc["accessors"][attributes["POSITION"]]
    assert len(indices) % 3 == 0 and max(indices) < len(positions) // 3
    first, count, first_vertex, vertices, _, _, material, _ = blob.primitives[index]
    assert material == primitive["material"] and count == len(indices)
    needs_tangents = "normalTexture" in glb.doc["materials"][material]
    # The builder may leave out unused vertices and split others: corners are what must agree.
    for i in range(0, count, max(1, count // 20000)):
        a, b = indices[i], blob.indices[first + i]
        assert first_vertex <= b < first_vertex + vertices
        assert positions[3 * a:3 * a + 3] == blob.positions[3 * b:3 * b + 3]
        assert uv[2 * a:2 * a + 2] == blob.uv[2 * b:2 * b + 2]
        n = normals[3 * a:3 * a + 3]
        assert near(math.sqrt(sum(x * x for x in n)), 1, 1e-5)
        assert all(abs(n[k] - blob.normals[b][k] / 32767) < 1e-4 for k in range(3))
        assert blob.tangents[b] == needs_tangents


def check_nodes(glb, blob):
    doc = glb.doc
    nodes = [doc["nodes"][i] for i in doc["scenes"][doc["scene"]]["nodes"]]
    assert len(nodes) == len(doc["nodes"])
    meshes = [n for n in nodes if "mesh" in n]
    assert len(meshes) == len(blob.instances)
    triangles, low, high = 0, [math.inf] * 3, [-math.inf] * 3
    for node, instance in zip(meshes, blob.instances):
        m = node.get("matrix", [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1])
        assert [m[3], m[7], m[11], m[15]] == [0, 0, 0, 1]
        for row in range(3):
            for column in range(4):
                assert near(m[4 * column + row], instance[4 * row + column])
        assert node["mesh"] == instance[12]
        triangles += blob.primitives[instance[12]][1] // 3
    assert triangles == blob.triangles
    camera, = [n for n in nodes if "camera" in n]
    view, = doc["cameras"]
    eye, target, fov = blob.cameras[0][:3], blob.cameras[0][3:6], blob.cameras[0][9]
    m = camera["matrix"]
    forward = [target[k] - eye[k] for k in range(3)]
    length = math.sqrt(sum(x * x for x in forward))
    for k in range(3):
        assert near(m[12 + k], eye[k], 1e-5) and near(-m[8 + k], forward[k] / length, 1e-5)
    right, up, back = m[0:3], m[4:7], m[8:11]
    cross = [right[1] * up[2] - right[2] * up[1], right[2] * up[0] - right[0] * up[2],
             right[0] * up[1] - right[1] * up[0]]
    assert all(near(cross[k], back[k], 1e-5) for k in range(3)) and up[1] > 0 and abs(right[1]) < 1e-6
    assert view["type"] == "perspective" and near(math.degrees(view["perspective"]["yfov"]), fov, 1e-5)


def check(program, kind):
    glb, blob = Glb(dump(program, kind, "glb")), Blob(dump(program, kind, "blob"))
    assert "extensionsRequired" not in glb.doc
    assert len(glb.doc["materials"]) == len(blob.materials)
    assert len(glb.doc["meshes"]) == len(blob.primitives)
    bases = {check_material(glb, blob, i)[0] for i in range(len(blob.materials))}
    check_textures(glb, blob, bases)
    for i in range(len(blob.primitives)):
        check_mesh(glb, blob, i)
    check_nodes(glb, blob)
    print(f"{kind}: {blob.triangles} triangles, {len(glb.bin)} bytes agree")


def main():
    for kind in KINDS:
        check(sys.argv[1], kind)


if __name__ == "__main__":
    main()
