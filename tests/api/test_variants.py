"""KHR_materials_variants: a variant's picture is that of a file with its materials, with every method
and in any order; names, errors, caches."""
import base64
import struct
import unittest
import zlib

import harness
from harness import Daemon
from pictures import off_by_more_than, rgb

NAME = "KHR_materials_variants"
VIEW = {"width": 96, "height": 72, "ground": True,
        "camera": {"eye": [2.5, 2.5, 4], "target": [0, 0.5, 0]},
        "lights": [{"type": "rect", "position": [2, 5, 2], "target": [0, 0, 0], "width": 1,
                    "height": 1, "power_w": 400}]}
# base colour, alpha mode and the rest of each material; 3 cuts holes, 4 is blended, 5 has a normal map
MATERIALS = [
    {"pbrMetallicRoughness": {"baseColorFactor": [0.8, 0.2, 0.1, 1], "metallicFactor": 0}},
    {"pbrMetallicRoughness": {"baseColorFactor": [0.1, 0.3, 0.8, 1]}, "doubleSided": True},
    {"pbrMetallicRoughness": {"baseColorFactor": [0.2, 0.7, 0.2, 1], "metallicFactor": 0},
     "emissiveFactor": [0.2, 0.1, 0]},
    {"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}, "metallicFactor": 0},
     "alphaMode": "MASK", "doubleSided": True},
    {"pbrMetallicRoughness": {"baseColorFactor": [0.9, 0.9, 0.2, 0.4], "metallicFactor": 0},
     "alphaMode": "BLEND"},
    {"pbrMetallicRoughness": {"baseColorFactor": [0.6, 0.6, 0.6, 1], "metallicFactor": 0},
     "normalTexture": {"index": 1}}]
# of wall and card in each variant, None: as the file is
VARIANTS = [("winter", (1, 3)), ("glass", (None, 4)), ("", (5, 2)), ("7", (2, None)),
            ("nothing", (None, None))]
OWN = (0, 1)


def image(pixel):
    """A PNG of 8 x 8 RGBA pixels, as a data URI."""
    rows = b"".join(b"\0" + b"".join(bytes(pixel(x, y)) for x in range(8)) for y in range(8))
    chunk = lambda kind, data: (struct.pack(">I", len(data)) + kind + data +
                                struct.pack(">I", zlib.crc32(kind + data)))
    data = (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", 8, 8, 8, 6, 0, 0, 0)) +
            chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b""))
    return "data:image/png;base64," + base64.b64encode(data).decode()


def card(points):
    """A quad with normals and coordinates."""
    a, b, d = ([q - p for p, q in zip(points[0], points[i])] for i in (1, 3, 3))
    normal = [a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3] for k in range(3)]
    length = sum(n * n for n in normal) ** 0.5
    return [(*p, *(n / length for n in normal), *uv)
            for p, uv in zip(points, ((0, 1), (1, 1), (1, 0), (0, 0)))]


def scene(own=OWN, variants=None, generator="a"):
    """A wall and two instances of a card; each primitive lists what it is in which variant."""
    quads = [card([(-2, 0, -1), (2, 0, -1), (2, 2, -1), (-2, 2, -1)]),
             card([(-0.5, 0.1, 0), (0.5, 0.1, 0.3), (0.5, 1.2, 0.3), (-0.5, 1.2, 0)])]
    data = b"".join(struct.pack("<8f", *v) for quad in quads for v in quad)
    data += struct.pack("<6H", 0, 1, 2, 0, 2, 3)
    holes = image(lambda x, y: (255, 255, 255, 255 * ((x // 2 + y // 2) % 2)))
    bumps = image(lambda x, y: (128 + 60 * (-1) ** x, 128 + 60 * (-1) ** (y // 2), 220, 255))
    accessors, views = [], [{"buffer": 0, "byteLength": 256, "byteStride": 32},
                            {"buffer": 0, "byteOffset": 256, "byteLength": 12}]
    primitives = []
    for i, quad in enumerate(quads):
        for offset, kind in ((0, "VEC3"), (12, "VEC3"), (24, "VEC2")):
            accessors.append({"bufferView": 0, "byteOffset": 128 * i + offset, "componentType": 5126,
                              "count": 4, "type": kind})
        primitive = {"attributes": {"POSITION": 3 * i, "NORMAL": 3 * i + 1, "TEXCOORD_0": 3 * i + 2},
                     "indices": 6, "material": own[i]}
        if variants:
            mappings = {}
            for number, (_, materials) in enumerate(variants):
                if materials[i] is not None:
                    mappings.setdefault(materials[i], []).append(number)
            primitive["extensions"] = {NAME: {"mappings": [
                {"material": m, "variants": v} for m, v in mappings.items()]}}
        primitives.append(primitive)
    accessors.append({"bufferView": 1, "componentType": 5123, "count": 6, "type": "SCALAR"})
    document = {
        "asset": {"version": "2.0", "generator": generator}, "scene": 0,
        "scenes": [{"nodes": [0, 1, 2]}],
        "nodes": [{"mesh": 0}, {"mesh": 1}, {"mesh": 1, "translation": [1.2, 0.2, 0.4],
                                            "rotation": [0, 0.3826834, 0, 0.9238795]}],
        "meshes": [{"primitives": [p]} for p in primitives], "materials": MATERIALS,
        "textures": [{"source": 0, "sampler": 0}, {"source": 1, "sampler": 0}],
        "samplers": [{"magFilter": 9728, "minFilter": 9728}],
        "images": [{"uri": holes}, {"uri": bumps}],
        "accessors": accessors, "bufferViews": views, "buffers": [{"byteLength": len(data)}]}
    if variants:
        document["extensionsUsed"] = document["extensionsRequired"] = [NAME]
        document["extensions"] = {NAME: {"variants": [{"name": n} for n, _ in variants]}}
    return harness.glb(document, data)


class Variants(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.d = Daemon()
        cls.id = cls.d.upload(scene(variants=VARIANTS))

    @classmethod
    def tearDownClass(cls):
        assert cls.d.stop() == 0

    def picture(self, scene_id, **request):
        answer = self.d.render(scene_id, {**VIEW, **request}, timeout=600)
        self.assertEqual(answer.status, 200, answer.body[:300])
        return rgb(answer)

    def test_description(self):
        info = self.d.get("/v1/scenes/" + self.id).json()
        self.assertEqual(info["variants"], [
            {"index": i, "name": name} for i, (name, _) in enumerate(VARIANTS)])
        self.assertEqual(info["warnings"], [])
        plain = self.d.upload(scene())
        self.assertEqual(self.d.get("/v1/scenes/" + plain).json()["variants"], [])
        refused = self.d.render(plain, {**VIEW, "variant": "winter"})
        self.assertEqual(refused.json()["pointer"], "/variant")

    def test_pictures(self):
        """Every method is asked for some variant, raster and rays for all, back and forth."""
        methods = [t["name"] for t in self.d.get("/v1/techniques").json()["techniques"]]
        # what "auto" takes follows measured times and is not the same for two scenes
        some = [m for m in methods if m not in ("raytraced", "pcss", "auto")]
        shown = {}
        for number, (name, materials) in enumerate(VARIANTS):
            own = tuple(o if m is None else m for o, m in zip(OWN, materials))
            alone = self.d.upload(scene(own=own, generator=name))
            for method in ["pcss", "raytraced"] + some[number::len(VARIANTS)]:
                request = {"technique": {"name": method}}
                with self.subTest(variant=name, method=method):
                    a = self.picture(self.id, variant=name or number, **request)
                    self.assertEqual(off_by_more_than(a, self.picture(alone, **request), 0), 0)
                    shown.setdefault(method, []).append(a)
        for method in ("pcss", "raytraced"):  # and they do differ
            own = self.picture(self.id, technique={"name": method})
            self.assertEqual(off_by_more_than(own, shown[method][4], 0), 0)
            for a in shown[method][:4]:
                self.assertGreater(off_by_more_than(own, a, 8), 100)

    def test_what_the_camera_saw_is_not_kept_for_another(self):
        """In one view, one straight after the other."""
        one = self.d.upload(scene(variants=VARIANTS))
        away = {**VIEW, "camera": {"eye": [-2.5, 2.5, 4], "target": [0, 0.5, 0]}}
        count = len(VARIANTS)
        anew = []
        for k in range(count):
            self.d.render(one, {**away, "variant": k})
            anew.append(self.d.render(one, {**VIEW, "variant": k}).body)
        self.assertGreater(len(set(anew)), 3)
        for k in list(range(count)) + list(range(0, count, 2)) + list(range(1, count, 2)):
            self.assertEqual(self.d.render(one, {**VIEW, "variant": k}).body, anew[k], k)

    def test_shadows_follow(self):
        """The light through the holes, and past what is half clear, in both back ends of rays."""
        for backend in ("auto", "gpu"):
            means = [sum(p[0] for p in self.picture(
                self.id, variant=name, output={"layer": "visibility"},
                technique={"name": "raytraced", "params": {"backend": backend}}))
                for name in ("", "winter", "glass", "")]
            self.assertEqual(means[0], means[3])
            self.assertGreater(means[1], means[0])
            self.assertGreater(means[2], means[0])

    def test_names_and_caches(self):
        ask = lambda **more: self.d.call(
            "GET", "/v1/scenes/%s/render?width=32&height=24&%s" % (self.id, "&".join(
                "%s=%s" % pair for pair in more.items())))
        tags = {}
        for variant in ("", "winter", "0", "2", "7", "3"):
            answer = ask(variant=variant)
            self.assertEqual(answer.status, 200, answer.body)
            tags[variant] = (answer.headers["ETag"], rgb(answer))
        self.assertEqual(len({tag for tag, _ in tags.values()}), len(tags))
        for same in (("winter", "0"), ("7", "3")):  # a name that is a number is first of all a name
            self.assertEqual(tags[same[0]][1], tags[same[1]][1])
        self.assertNotEqual(tags[""][1], tags["winter"][1])
        again = ask(variant="winter")
        self.assertEqual((again.headers["ETag"], rgb(again)), tags["winter"])
        for wrong in ("Winter", "5", "99", "-1"):
            answer = ask(variant=wrong)
            self.assertIn(answer.status, (400, 422))
            problem = answer.json()
            self.assertEqual(problem["pointer"], "/variant")
            for name in ("winter", "glass", "2", "7", "nothing"):
                self.assertIn(name, problem["detail"])

    def test_hostile(self):
        document = scene(variants=VARIANTS)
        for old, new in ((b'"variants": [0]', b'"variants": [9]'),
                         (b'"variants": [0]', b'"variants": [0.5]'),
                         (b'"material": 3,', b'"material": 9,')):
            self.assertIn(old, document)
            answer = self.d.call("POST", "/v1/scenes", document.replace(old, new.ljust(len(old))),
                                 {"Content-Type": "model/gltf-binary"})
            self.assertIn(answer.status, (413, 422), answer.body)


if __name__ == "__main__":
    harness.main()
