"""Pictures as tests see them: decoded PNG, and glTF files made of a few lines."""
import os
import struct
import sys
import zlib

import harness

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "../unit"))
import pose_files


def read_png(data):
    """Width, height and rows of the pixels of a PNG without interlace, of 8 or 16 bits."""
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    at, packed = 8, b""
    while at < len(data):
        size, = struct.unpack(">I", data[at:at + 4])
        kind, body = data[at + 4:at + 8], data[at + 8:at + 8 + size]
        if kind == b"IHDR":
            width, height, depth, colour = struct.unpack(">IIBB", body[:10])
            assert depth in (8, 16) and colour in (0, 2, 6)
        elif kind == b"IDAT":
            packed += body
        at += size + 12
    n = {0: 1, 2: 3, 6: 4}[colour] * depth // 8
    raw, rows, before = zlib.decompress(packed), [], bytearray(width * n)
    for y in range(height):
        mode, line = raw[y * (width * n + 1)], bytearray(
            raw[y * (width * n + 1) + 1:(y + 1) * (width * n + 1)])
        for i in range(width * n):
            left = line[i - n] if i >= n else 0
            up, corner = before[i], before[i - n] if i >= n else 0
            p = left + up - corner
            paeth = min((abs(p - left), 0, left), (abs(p - up), 1, up),
                        (abs(p - corner), 2, corner))[2]
            line[i] = (line[i] + (0, left, up, (left + up) // 2, paeth)[mode]) & 255
        samples = struct.unpack(">%d%s" % (width * n * 8 // depth, "B" if depth == 8 else "H"), line)
        rows.append(list(zip(*[iter(samples)] * (n * 8 // depth))))
        before = line
    return width, height, rows


def chunk(kind, data):
    return (struct.pack(">I", len(data)) + kind + data +
            struct.pack(">I", zlib.crc32(kind + data)))


def pack_row(values, depth):
    if depth == 16:
        return b"".join(struct.pack(">H", v) for v in values)
    if depth == 8:
        return bytes(values)
    per = 8 // depth
    values = list(values) + [0] * (-len(values) % per)
    return bytes(sum(v << (8 - depth * (k + 1)) for k, v in enumerate(values[i:i + per]))
                 for i in range(0, len(values), per))


def png(rows, colour, depth, interlaced=False, *chunks):
    """`rows` of pixels, each a tuple of samples. `chunks` stand before the data."""
    height, width = len(rows), len(rows[0])
    passes = ((0, 0, 8, 8), (4, 0, 8, 8), (0, 4, 4, 8), (2, 0, 4, 4), (0, 2, 2, 4), (1, 0, 2, 2),
              (0, 1, 1, 2)) if interlaced else ((0, 0, 1, 1),)
    data = b""
    for x, y, dx, dy in passes:
        for row in rows[y::dy]:
            line = [s for pixel in row[x::dx] for s in pixel]
            data += b"\0" + pack_row(line, depth) if line else b""
    head = struct.pack(">IIBBBBB", width, height, depth, colour, 0, 0, interlaced)
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + b"".join(chunks) +
            chunk(b"IDAT", zlib.compress(data)) + chunk(b"IEND", b""))


def rgb(answer):
    """Pixels of a PNG answer, row after row, as RGB triples."""
    return [pixel[:3] for row in read_png(answer.body)[2] for pixel in row]


def off_by_more_than(a, b, most):
    """How many pixels of two pictures of one size differ by more than this in some channel."""
    assert len(a) == len(b)
    return sum(max(abs(p - q) for p, q in zip(x, y)) > most for x, y in zip(a, b))


def box(size=(1, 1, 1), center=(0, 0, 0)):
    """Corners, normals and indices of a box whose faces share no vertex."""
    points, normals, indices = [], [], []
    for axis in range(3):
        for side in (1, -1):
            normal = [side * (k == axis) for k in range(3)]
            first = len(points)
            for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1)):
                corner = [0, 0, 0]
                corner[axis], corner[(axis + 1) % 3], corner[(axis + 2) % 3] = side, a, side * b
                points.append([center[k] + 0.5 * size[k] * corner[k] for k in range(3)])
                normals.append(normal)
            indices += [first, first + 1, first + 2, first, first + 2, first + 3]
    return points, normals, indices


def mesh_scene(points, normals, indices, color=(1, 1, 1, 1), node=None, material=None, **more):
    """A .glb of one mesh under one node; `more` goes into the document, lists at the end of those
    that are there. All nodes are roots."""
    vertex = b"".join(struct.pack("<3f", *p) for p in points)
    normal = b"".join(struct.pack("<3f", *n) for n in normals)
    index = struct.pack("<%dI" % len(indices), *indices)
    low, high = ([pick(axis) for axis in zip(*points)] for pick in (min, max))
    document = {
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, **(node or {})}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "NORMAL": 1}, "indices": 2,
                                    "material": 0}]}],
        "materials": [{"pbrMetallicRoughness": {
            "baseColorFactor": list(color), "metallicFactor": 0, "roughnessFactor": 1},
            **(material or {})}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": len(points), "type": "VEC3",
             "min": low, "max": high},
            {"bufferView": 1, "componentType": 5126, "count": len(normals), "type": "VEC3"},
            {"bufferView": 2, "componentType": 5125, "count": len(indices), "type": "SCALAR"}],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": len(vertex)},
            {"buffer": 0, "byteOffset": len(vertex), "byteLength": len(normal)},
            {"buffer": 0, "byteOffset": len(vertex) + len(normal), "byteLength": len(index)}],
        "buffers": [{"byteLength": len(vertex) + len(normal) + len(index)}]}
    for key, value in more.items():
        document[key] = document.get(key, []) + value if isinstance(value, list) else value
    document["scenes"][0]["nodes"] = list(range(len(document["nodes"])))
    return harness.glb(document, vertex + normal + index)


def sliding_box():
    """A plate one metre above a floor that moves along x from -2 to 2 within 4 s."""
    def corners(half, y):
        return [[-half, y, -half], [-half, y, half], [half, y, half],
                [-half, y, -half], [half, y, half], [half, y, -half]]
    b = pose_files.Builder()
    for half, y in ((6, 0), (0.6, 1)):
        b.json["meshes"].append({"primitives": [
            {"attributes": {"POSITION": b.floats("VEC3", corners(half, y))}, "material": 0}]})
    b.json["materials"] = [{"doubleSided": True}]
    b.node(True, mesh=0)
    plate = b.node(True, mesh=1)
    b.animate("slide", [(plate, "translation", [0, 4], [[-2, 0, 0], [2, 0, 0]], "LINEAR")])
    return b.glb()
