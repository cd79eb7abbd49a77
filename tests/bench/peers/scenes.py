"""What is raced on: scenes, lights and the way of the camera."""
import json
import math
import os
import struct
import subprocess

# The camera turns by this for every frame, so that none is like the one before.
TURN = 0.02
# Directions from which a light of the given radiance makes white just not white.
SCENES = {
    "columns": {
        "title": "columns, 70,000 triangles", "make": ("columns", "--triangles", "70000"),
        "eye": (5.2, 3.4, 6.0), "target": (0, 0.9, 0),
        "light": {"position": (2.5, 6, 3), "target": (0, 0, 0), "size": 1, "near": 3, "far": 16,
                  "half_angle": 0.62, "radiance": 150}},
    "hairball": {
        "title": "hairball, 1.1 million triangles", "make": ("hairball", "--triangles", "1100000"),
        "floor": 4, "eye": (3.4, 2.4, 3.6), "target": (0, 0.8, 0),
        "light": {"position": (1.8, 5, 1.5), "target": (0, 0, 0), "size": 1, "near": 2, "far": 14,
                  "half_angle": 0.7, "radiance": 90}},
    "bunny": {
        "title": "Stanford bunny, 69,453 triangles", "file": "stanford-bunny-on-plane.glb",
        "eye": (2.2, 1.6, 2.6), "target": (0, 0.45, 0), "crop": (240, 310, 490, 420),
        "light": {"position": (1.5, 3, 1), "target": (0, 0, 0), "size": 1, "near": 1.5, "far": 14,
                  "half_angle": 0.8, "radiance": 30}},
    "tiny": {  # to see that everything runs
        "title": "columns, 5,000 triangles", "make": ("columns", "--triangles", "5000"),
        "eye": (5.2, 3.4, 6.0), "target": (0, 0.9, 0),
        "light": {"position": (2.5, 6, 3), "target": (0, 0, 0), "size": 1, "near": 3, "far": 16,
                  "half_angle": 0.62, "radiance": 150}},
}


def with_floor(data, half):
    """The .glb with a grey square at height 0."""
    size, = struct.unpack_from("<I", data, 12)
    document, binary = json.loads(data[20:20 + size]), data[28 + size:]
    corners = [(-half, 0, -half), (-half, 0, half), (half, 0, half), (half, 0, -half)]
    pieces = [b"".join(struct.pack("<3f", *c) for c in corners), struct.pack("<3f", 0, 1, 0) * 4,
              struct.pack("<6I", 0, 1, 2, 0, 2, 3)]
    first = len(document["accessors"])
    for piece, kind, code, count in zip(pieces, ("VEC3", "VEC3", "SCALAR"), (5126, 5126, 5125),
                                        (4, 4, 6)):
        document["accessors"].append({"bufferView": len(document["bufferViews"]), "type": kind,
                                      "componentType": code, "count": count})
        document["bufferViews"].append({"buffer": 0, "byteOffset": len(binary),
                                        "byteLength": len(piece)})
        binary += piece
    document["accessors"][first].update(min=list(corners[0]), max=list(corners[2]))
    document["materials"].append({"pbrMetallicRoughness": {
        "baseColorFactor": [0.6, 0.6, 0.6, 1], "metallicFactor": 0, "roughnessFactor": 1}})
    document["meshes"].append({"primitives": [{
        "attributes": {"POSITION": first, "NORMAL": first + 1}, "indices": first + 2,
        "material": len(document["materials"]) - 1}]})
    document["nodes"].append({"mesh": len(document["meshes"]) - 1})
    document["scenes"][document.get("scene", 0)]["nodes"].append(len(document["nodes"]) - 1)
    document["buffers"][0]["byteLength"] = len(binary)
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    binary += b"\0" * (-len(binary) % 4)
    return (struct.pack("<III", 0x46546C67, 2, 28 + len(text) + len(binary)) +
            struct.pack("<II", len(text), 0x4E4F534A) + text +
            struct.pack("<II", len(binary), 0x004E4942) + binary)


def find(name, shared):
    """Where a scene's file is, None when it is not there."""
    wanted = SCENES[name].get("file")
    path = wanted and shared and os.path.join(shared, "scenes", wanted)
    return path if path and os.path.exists(path) else None


def prepare(name, programs, folder, shared):
    """The scene as a .glb in `folder`."""
    row, path = SCENES[name], os.path.join(folder, name + ".glb")
    if "file" in row:
        with open(find(name, shared), "rb") as file:
            data = file.read()
    else:
        subprocess.run([os.path.join(programs, "penumbra"), "generate", row["make"][0], "-o", path,
                        *row["make"][1:]], check=True, stdout=subprocess.DEVNULL)
        with open(path, "rb") as file:
            data = file.read()
    if "floor" in row:
        data = with_floor(data, row["floor"])
    with open(path, "wb") as file:
        file.write(data)
    return path


def turned(point, centre, angle):
    x, z = point[0] - centre[0], point[2] - centre[2]
    return (centre[0] + x * math.cos(angle) + z * math.sin(angle), point[1],
            centre[2] + z * math.cos(angle) - x * math.sin(angle))


def job(name, mode, camera=0, light=0, size=None, **more):
    """A frame of a scene: `camera` and `light` steps along their ways, `size` of the light."""
    row = SCENES[name]
    lamp = dict(row["light"], position=turned(row["light"]["position"], row["light"]["target"],
                                              TURN * light))
    base = lamp["size"]
    lamp["size"] = size or base
    return dict(mode=mode, eye=turned(row["eye"], row["target"], TURN * camera),
                target=row["target"], light=lamp, base_size=base, **more)
