"""Files that break the letter of glTF but can be meant in one way only: each must give the picture of
the same file without the fault. And what is refused says what to do."""
import io
import json
import struct
import unittest
import zipfile

import harness
from harness import Daemon
from pictures import box, mesh_scene, rgb

SMALL = {"width": 64, "height": 48}


def parts(glb):
    size, = struct.unpack("<I", glb[12:16])
    return json.loads(glb[20:20 + size]), glb[28 + size:]


def append(document, data, more, accessor):
    """The buffer with an accessor to new bytes at its end; returns it and the accessor's number."""
    document["bufferViews"].append(
        {"buffer": 0, "byteOffset": len(data), "byteLength": len(more)})
    document["accessors"].append({"bufferView": len(document["bufferViews"]) - 1, **accessor})
    return data + more, len(document["accessors"]) - 1


def nulls(document, data):
    document.update(extensions=None, animations=None)
    document["nodes"][0].update(camera=None, children=None, extensions=None)
    document["materials"][0].update(alphaCutoff=None, normalTexture=None)


def minus_one(document, data):
    document["nodes"][0].update(camera=-1, skin=-1)
    document["nodes"].append({"mesh": -1})


def modes(document, data):
    document.update(images=[{"uri": "data:image/gif;base64,"}], samplers=[
        {"magFilter": 9987, "wrapS": 0, "minFilter": 1}], textures=[{"sampler": 0, "source": 0}])


def number(document, data):
    document["asset"]["version"] = 2.0


def short_version(document, data):
    document["asset"]["version"] = "2"


def long_buffer(document, data):
    document["buffers"][0]["byteLength"] += 2


def long_view(document, data):
    document["bufferViews"][-1]["byteLength"] += 5


def signed(document, data):
    document["accessors"][2]["componentType"] = 5124


def signed_short(document, data):
    count = document["accessors"][2]["count"]
    size = 4 * count
    indices = struct.unpack("<%dI" % count, data[-size:])
    data, at = append(document, data, struct.pack("<%dh" % count, *indices),
                      {"componentType": 5122, "count": count, "type": "SCALAR"})
    document["meshes"][0]["primitives"][0]["indices"] = at
    return data


def sparse_of_nothing(document, data):
    document["accessors"][0]["sparse"] = {
        "count": 0, "indices": {"bufferView": 0, "componentType": 5123}, "values": {"bufferView": 0}}


def no_indices_beside(document, data):
    document["accessors"].append({"componentType": 5125, "count": 0, "type": "SCALAR"})
    document["meshes"][0]["primitives"].append({"attributes": {"POSITION": 0}, "indices": 3})


def empty_primitive_beside(document, data):
    document["bufferViews"].append({"buffer": 0, "byteLength": 0})
    document["accessors"].append({"bufferView": 3, "componentType": 5126, "count": 0, "type": "VEC3"})
    document["meshes"][0]["primitives"].append({"attributes": {"POSITION": 3}})


def sparse_indices(document, data):
    """Indices without a view of their own: zeros, and all of them replaced."""
    view = document["accessors"][2].pop("bufferView")
    count = document["accessors"][2]["count"]
    data, at = append(document, data, struct.pack("<%dH" % count, *range(count)),
                      {"componentType": 5123, "count": count, "type": "SCALAR"})
    document["accessors"][2]["sparse"] = {
        "count": count, "values": {"bufferView": view},
        "indices": {"bufferView": document["accessors"].pop()["bufferView"], "componentType": 5123}}
    return data


FAULTS = (  # and a word of the warning; None: it is not worth one
    (nulls, None), (minus_one, "is taken for none"), (modes, "no mode of a sampler"),
    (number, "as a number"), (short_version, None), (long_buffer, "less than the glTF says"),
    (long_view, "beyond its buffer"), (signed, "signed integers"), (signed_short, "signed integers"),
    (sparse_of_nothing, None), (no_indices_beside, "without any triangle"),
    (empty_primitive_beside, "is empty"), (sparse_indices, None))

MATERIALS = ("KHR_materials_clearcoat", "KHR_materials_coat_of_tomorrow", "ADOBE_materials_thin",
             "KHR_materials_transmission", "EXT_lights_image_based", "GOOGLE_texture_basis",
             "EXT_texture_jpegxl")
SILENT = ("KHR_xmp", "KHR_xmp_json_ld", "EXT_mesh_features", "EXT_structural_metadata", "VRMC_vrm",
          "GODOT_single_root", "KHR_physics_rigid_bodies", "MSFT_packing_occlusionRoughnessMetallic")


class Tolerant(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.d = Daemon()
        cls.good = mesh_scene(*box(), color=(0.8, 0.3, 0.2, 1))
        cls.picture = rgb(cls.d.render(cls.d.upload(cls.good), SMALL))

    @classmethod
    def tearDownClass(cls):
        assert cls.d.stop() == 0

    def post(self, body, kind="application/octet-stream"):
        return self.d.call("POST", "/v1/scenes", body, {"Content-Type": kind})

    def check(self, document, data, word):
        answer = self.post(harness.glb(document, data))
        self.assertEqual(answer.status, 201, answer.body)
        info = answer.json()
        self.assertEqual(info["triangles"], 12)
        if word:
            self.assertTrue(any(word in w for w in info["warnings"]), info["warnings"])
        else:
            self.assertEqual(info["warnings"], [])
        return info["id"]

    def test_faults(self):
        for fault, word in FAULTS:
            document, data = parts(self.good)
            with self.subTest(fault=fault.__name__):
                data = fault(document, data) or data
                if fault not in (long_buffer, long_view):
                    document["buffers"][0]["byteLength"] = len(data)
                scene = self.check(document, data, word)
                self.assertTrue(rgb(self.d.render(scene, SMALL)) == self.picture)

    def test_required_extensions(self):
        """The shape is the same; what the shading lacks is told, whichever list names it."""
        for names, word in ((MATERIALS, "%s is"), (SILENT, None)):
            for name in names:
                for both in (True, False):
                    document, data = parts(self.good)
                    document["extensionsRequired"] = [name]
                    document["asset"]["generator"] = str(both)
                    if both:
                        document["extensionsUsed"] = [name]
                    with self.subTest(name=name, both=both):
                        self.check(document, data, word and word % name)

    def test_names_are_told_as_they_are(self):
        """In every script; only what cannot be seen on a page is left out."""
        for name, told in (("\u6728\u7eb9.bin", None), ("stra\u00dfe/h\u00f6lzer.bin", None),
                           ("a\u202eb\u0085c.bin", "a?b?c.bin"), ("\u6728" * 40, "\u6728" * 33)):
            document, _ = parts(self.good)
            document["buffers"][0]["uri"] = name
            answer = self.post(json.dumps(document).encode())
            self.assertEqual(answer.status, 422)
            self.assertIn('"%s"' % (told or name), answer.json()["detail"])

    def test_refusals_say_what_to_do(self):
        packed = io.BytesIO()
        with zipfile.ZipFile(packed, "w") as z:
            z.writestr("__MACOSX/._model.fbx", b"x")
            z.writestr("model.obj", b"v 0 0 0\n")
        document, data = parts(self.good)
        unknown = harness.glb({**document, "extensionsRequired": ["ACME_teleport"]}, data)
        old = json.dumps({"scenes": {"a": {}}, "nodes": {"n": {}}, "meshes": {"m": {}}}).encode()
        for body, status, words in (
                (b"Kaydara FBX Binary  \0\x1a\0" + bytes(40), 415, ("FBX", "Blender")),
                (b"# made by hand\nmtllib a.mtl\nv 0 0 0\n", 415, ("OBJ", ".glb")),
                (bytes(80) + struct.pack("<I", 2) + bytes(100), 415, ("STL", ".glb")),
                (b"version https://git-lfs.github.com/spec/v1\noid", 415, ("git lfs pull",)),
                (b"<!DOCTYPE html><html>", 415, ("web page",)),
                (b"\x1f\x8b\x08" + bytes(30), 415, ("gzip", "zip")),
                (packed.getvalue(), 422, ("model.obj", "OBJ", "Blender")),
                (unknown, 422, ("ACME_teleport", "gltf-transform")),
                (old, 422, ("1.0", "gltf-pipeline"))):
            answer = self.post(body)
            self.assertEqual(answer.status, status, answer.body)
            for word in words:
                self.assertIn(word, answer.json()["detail"])


if __name__ == "__main__":
    harness.main()
