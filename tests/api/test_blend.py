"""Surfaces that mean harm: values that no alpha can have, thousands of layers, a material for each
of thousands of surfaces, textures looked up in thousands of ways. What is drawn is right, and a
picture's work stays bounded."""
import base64
import itertools
import math
import random
import struct
import threading
import unittest

import harness
import pictures
from harness import SLOW, Daemon
from pictures import off_by_more_than, read_png, rgb

SIDE = 48
VIEW = {"width": SIDE, "height": SIDE, "edges": "none", "sky": False, "ground": False,
        "exposure_ev": 0}
ABOVE = {"lights": [{"type": "rect", "position": [0, 9, 0], "target": [0, 0, 0], "width": 1,
                     "height": 1}],
         "camera": {"eye": [0, 0.8, 0.4], "target": [0, 0, 0], "fov_y_deg": 50}}
NAN, INF = math.nan, math.inf


class Sheets(pictures.pose_files.Builder):
    """Horizontal squares over a floor, each with a material of its own or all with one."""

    def __init__(self):
        super().__init__()
        self.json["materials"] = []
        self.normals = self.floats("VEC3", [[0, 1, 0]] * 4)
        self.order = self.accessor("SCALAR", 5123, "H", [[i] for i in (0, 1, 2, 0, 2, 3)])
        self.sheet(4, 0, self.material([1, 1, 1, 1], "OPAQUE"))

    def material(self, color, mode="BLEND", **more):
        self.json["materials"].append({"alphaMode": mode, "doubleSided": True, **more,
                                       "pbrMetallicRoughness": {"baseColorFactor": color,
                                                                "metallicFactor": 0}})
        return len(self.json["materials"]) - 1

    def sheet(self, half, y, material, vertex_alpha=None):
        attributes = {"NORMAL": self.normals, "POSITION": self.floats("VEC3", [
            [-half, y, -half], [-half, y, half], [half, y, half], [half, y, -half]])}
        if vertex_alpha is not None:
            attributes["COLOR_0"] = self.floats("VEC4", [[1, 1, 1, vertex_alpha]] * 4)
        self.json["meshes"].append({"primitives": [
            {"attributes": attributes, "indices": self.order, "material": material}]})
        self.node(True, mesh=len(self.json["meshes"]) - 1)


class Blend(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.d = Daemon()

    @classmethod
    def tearDownClass(cls):
        assert cls.d.stop() == 0

    def post(self, data):
        return self.d.call("POST", "/v1/scenes", data, {"Content-Type": "model/gltf-binary"})

    def draw(self, scene, technique, **more):
        params = {"params": {"map_size": 256}} if technique == "hard" else {}
        answer = self.d.render(scene, {**VIEW, **more, "technique": {"name": technique, **params}},
                               timeout=600)
        self.assertEqual(answer.status, 200, answer.body)
        return answer

    @staticmethod
    def values(factor, vertex):
        s = Sheets()
        s.sheet(2, 1, s.material([0.2, 0.4, 0.9, factor]), vertex)
        return s.glb()

    def test_values(self):
        """A factor beyond 0 to 1 is the nearest that is not, and what is no number is 0."""
        look = {}
        for factor, vertex, like in ((7, 1, (1, 1)), (-1, 1, (0, 1)), (1e30, 0.5, (1, 0.5)),
                                     (0.5, 2, (0.5, 1)), (0.5, -3, (0.5, 0)), (0.5, NAN, (0.5, 0)),
                                     (0.5, INF, (0.5, 1)), (0.5, -INF, (0.5, 0))):
            got = []
            for values in ((factor, vertex), like):
                answer = self.post(self.values(*values))
                self.assertIn(answer.status, (200, 201), answer.body)
                for technique in ("hard", "raytraced"):
                    key = (*map(str, values), technique)
                    if key not in look:
                        look[key] = rgb(self.draw(answer.json()["id"], technique))
                    got.append(look[key])
            for a, b in ((0, 2), (1, 3)):
                self.assertEqual(off_by_more_than(got[a], got[b], 0), 0, (factor, vertex))

    def test_no_numbers(self):
        """JSON knows neither: refused, and with words."""
        good = self.values(0.5, 1)
        size, = struct.unpack("<I", good[12:16])
        text, rest = good[20:20 + size], good[20 + size:]
        for word in (b"NaN", b"Infinity", b"1e999", b'"1"', b"[1]"):
            changed = text.replace(b"0.9, 0.5]", b"0.9, %s]" % word)
            self.assertNotEqual(changed, text)
            changed += b" " * (-len(changed) % 4)
            answer = self.post(struct.pack("<4sIII4s", b"glTF", 2, 20 + len(changed + rest),
                                           len(changed), b"JSON") + changed + rest)
            self.assertEqual(answer.status, 422, answer.body)
            self.assertTrue(answer.json()["detail"])

    def stack(self, count, alpha, materials, **more):
        s = Sheets()
        numbers = [s.material([0.25, 0.5, 0.75, alpha], **more) for _ in range(materials)]
        for i in range(count):
            s.sheet(2, 1 + i / count, numbers[i % materials])
        answer = self.post(s.glb())
        self.assertEqual(answer.status, 201, answer.body)
        self.assertEqual(answer.json()["triangles"], 2 * count + 2)
        return answer.json()["id"]

    def below(self, scene, technique, want, off):
        """Visibility on the floor below the sheets."""
        answer = self.draw(scene, technique, output={"layer": "visibility"}, **ABOVE)
        seen = [p[0] / 255 for row in read_png(answer.body)[2] for p in row]
        self.assertLess(abs(sum(seen) / len(seen) - want), off)

    def test_many_layers(self):
        """What each sheet leaves of the light comes through a hundred; nothing through 400."""
        for count, alpha in ((100, 0.01), (400, 0.04)):
            scene = self.stack(count, alpha, 1, extensions={"KHR_materials_unlit": {}})
            left = (1 - alpha) ** count
            for technique in ("raytraced", "hard"):
                self.below(scene, technique, left, 0.05)
            if count == 400:  # from above nothing else is seen: all are of one colour
                top = {"camera": {"eye": [0, 6, 0.01], "target": [0, 1, 0], "fov_y_deg": 30}}
                solid = self.stack(1, 1, 1, extensions={"KHR_materials_unlit": {}})
                for a, b in zip(*(list(zip(*rgb(self.draw(which, "none", **top))))
                                  for which in (scene, solid))):
                    self.assertLess(abs(sum(a) - sum(b)) / SIDE / SIDE, 3)

    def test_many_materials(self):
        scene = self.stack(2000, 0.5, 2000)
        self.below(scene, "hard", 0, 0.01)


class Pile(unittest.TestCase):
    """Layers that take minutes to draw, in a method's maps and before the camera: whoever asks for
    them is told that they were not ready in time, and nobody else comes to harm."""
    HANG_MS = int(5000 * SLOW)

    def setUp(self):
        self.d = Daemon("--hang-timeout-ms=%d" % self.HANG_MS)

    def tearDown(self):
        assert self.d.stop() == 0

    def few(self, materials):
        s = Sheets()
        for i in range(materials):
            s.sheet(2, 1, s.material([0.25, 0.5, 0.75, 0.5]))
        return s

    def survives(self, scene, view):
        small = self.d.upload(self.few(1).glb())
        request = {**VIEW, "technique": {"name": "hard"}, **ABOVE, **view}
        # What it takes to compile is nobody's fault here.
        self.assertEqual(self.d.render(small, request, timeout=600).status, 200)
        pid = self.d.worker()
        late = []
        thread = threading.Thread(target=lambda: late.append(self.d.render(
            scene, {**request, "deadline_ms": int(1.5 * self.HANG_MS)}, timeout=600)))
        thread.start()
        others = 0
        while thread.is_alive():
            answer = self.d.render(small, {**VIEW, "width": 16 + others % 8,
                                           "technique": {"name": "none"}}, timeout=600)
            self.assertEqual(answer.status, 200, answer.body)
            others += 1
            thread.join(0.5)
        self.assertIn(late[0].status, (200, 504), late[0].body)  # some machine may be quick enough
        self.assertGreater(others, 1)
        self.assertEqual(self.d.worker(), pid)
        for name in ("penumbra_worker_restarts_total", "penumbra_quarantined_scenes"):
            self.assertEqual(self.d.metric(name), 0, self.d.log())

    def test_map(self):
        """A material each, over one another in a shadow map."""
        s = self.few(0)
        for i in range(2000):
            s.sheet(2, 1 + i / 2000, s.material([0.25, 0.5, 0.75, 0.5]))
        self.survives(self.d.upload(s.glb()), {})

    def test_view(self):
        """All in one piece of geometry, before the camera."""
        count = 20000
        s = self.few(0)
        corners = [[x, 1 + i / count, z] for i in range(count)
                   for x, z in ((-2, -2), (-2, 2), (2, 2), (2, -2))]
        order = [[4 * i + k] for i in range(count) for k in (0, 1, 2, 0, 2, 3)]
        s.json["meshes"].append({"primitives": [{
            "attributes": {"POSITION": s.floats("VEC3", corners)},
            "indices": s.accessor("SCALAR", 5125, "I", order),
            "material": s.material([0.25, 0.5, 0.75, 0.5])}]})
        s.node(True, mesh=len(s.json["meshes"]) - 1)
        self.survives(self.d.upload(s.glb()), {
            "width": 900, "height": 700, "technique": {"name": "none"},
            "camera": {"eye": [0, 6, 0.01], "target": [0, 1, 0], "fov_y_deg": 30}})

    def test_states(self):
        """Each surface has its textures looked up in another way, for which drivers compile."""
        s = self.few(0)
        s.json["images"] = [{"uri": "data:image/png;base64," +
                             base64.b64encode(harness.png(4, 4)).decode()}]
        wraps = 33071, 33648, 10497
        s.json["samplers"] = [
            {"wrapS": u, "wrapT": v, "minFilter": low, "magFilter": high}
            for u, v, low, high in itertools.product(wraps, wraps, range(9984, 9988), (9728, 9729))]
        s.json["textures"] = [{"source": 0, "sampler": i} for i in range(len(s.json["samplers"]))]
        uv = s.floats("VEC2", [[0, 0], [0, 1], [1, 1], [1, 0]])
        for i, (a, b) in enumerate(itertools.product(range(len(s.json["textures"])), repeat=2)):
            if i % 3:
                continue
            number = s.material([1, 1, 1, 1], "MASK", emissiveTexture={"index": b},
                                emissiveFactor=[1, 1, 1])
            s.json["materials"][number]["pbrMetallicRoughness"]["baseColorTexture"] = {"index": a}
            s.sheet(2 - i / 5184, 1 + i / 5184, number)
            s.json["meshes"][-1]["primitives"][0]["attributes"]["TEXCOORD_0"] = uv
        self.survives(self.d.upload(s.glb()), {
            "technique": {"name": "none"},
            "camera": {"eye": [0, 6, 0.01], "target": [0, 1, 0], "fov_y_deg": 50}})

    def test_instances(self):
        """A tangle that stands 50,000 times: 300 million triangles in a small file."""
        pick = random.Random(1)
        s = self.few(0)
        corners = [[pick.gauss(0, 1) for _ in range(3)] for _ in range(18000)]
        s.json["meshes"].append({"primitives": [
            {"attributes": {"POSITION": s.floats("VEC3", corners)}, "material": 0}]})
        for _ in range(50000):
            s.node(True, mesh=len(s.json["meshes"]) - 1,
                   translation=[round(pick.gauss(0, 1), 3) for _ in range(3)])
        self.survives(self.d.upload(s.glb()), {})


if __name__ == "__main__":
    harness.main()
