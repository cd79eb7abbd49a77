"""What a default picture shows of files of every kind: a subject that fills the frame, neither dark nor
burnt out, and metals that look like it. Neighbours of files that showed something else."""
import math
import unittest

import harness
from harness import Daemon
from pictures import box, mesh_scene, off_by_more_than, pose_files, rgb

SIZE = {"width": 160, "height": 120}
RED = (1, 0.05, 0.05, 1)
UNLIT = {"extensions": {"KHR_materials_unlit": {}}}
BACK, FRONT = ((1, -1), (-1, -1), (-1, 1), (1, 1)), ((-1, -1), (1, -1), (1, 1), (-1, 1))


def card(corners, axis=2):
    """A sheet across an axis, seen from the side that its corners run round."""
    points = [[0, 0, 0] for _ in range(4)]
    for point, corner in zip(points, corners):
        point[(axis + 1) % 3], point[(axis + 2) % 3] = corner
    side = 1 if corners is FRONT else -1
    return points, [[side * (k == axis) for k in range(3)]] * 4, [0, 1, 2, 0, 2, 3]


def ball(radius=1, inwards=False, steps=24):
    points, normals, indices = [], [], []
    for i in range(steps + 1):
        for k in range(2 * steps + 1):
            a, b = math.pi * i / steps, math.pi * k / steps
            n = [math.sin(a) * math.cos(b), math.cos(a), math.sin(a) * math.sin(b)]
            points.append([radius * x for x in n])
            normals.append([-x for x in n] if inwards else n)
    row = 2 * steps + 1
    for i in range(steps):
        for k in range(2 * steps):
            a = i * row + k
            for t in ((a, a + 1, a + row), (a + 1, a + row + 1, a + row)):
                indices += t[::-1] if inwards else t
    return points, normals, indices


def scene(*parts):
    """parts: (mesh, colour, further members of the material)."""
    b = pose_files.Builder()
    b.json["extensionsUsed"] = ["KHR_materials_unlit", "KHR_materials_emissive_strength",
                                "KHR_materials_transmission"]
    b.json["materials"] = []
    for (points, normals, indices), color, material in parts:
        b.json["materials"].append({"pbrMetallicRoughness": {
            "baseColorFactor": list(color), "metallicFactor": 0, "roughnessFactor": 1}, **material})
        b.json["meshes"].append({"primitives": [{
            "attributes": {"POSITION": b.floats("VEC3", points), "NORMAL": b.floats("VEC3", normals)},
            "indices": b.accessor("SCALAR", 5125, "I", [[i] for i in indices]),
            "material": len(b.json["materials"]) - 1}]})
        b.node(True, mesh=len(b.json["meshes"]) - 1)
    return b.glb()


def sheet(rise):
    """It faces down; one side is higher."""
    points = [[-1, 0, -1], [1, rise, -1], [1, rise, 1], [-1, 0, 1]]
    length = (4 + rise * rise) ** 0.5
    return points, [[rise / length, -2 / length, 0]] * 4, [0, 1, 2, 0, 2, 3]


class Subjects(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.d = Daemon()

    @classmethod
    def tearDownClass(cls):
        assert cls.d.stop() == 0

    def picture(self, file, **request):
        scene_id = self.d.upload(file)
        answer = self.d.render(scene_id, {**SIZE, "deadline_ms": 600000, **request}, timeout=600)
        self.assertEqual(answer.status, 200, answer.body[:300])
        return rgb(answer)

    def test_subject_is_seen_in_its_setting(self):
        """A floor that is a slab, a sky seen from inside, something lost far away, and sheets whose
        fronts do not face the usual camera."""
        thing = (box((1, 1, 1), (0, 0.5, 0)), RED, {})
        gray = (0.5, 0.5, 0.5, 1)
        for name, parts in (
                ("slab", [thing, (box((200, 0.2, 200), (0, -0.1, 0)), gray, {})]),
                ("sky", [thing, (ball(60, True), (0.2, 0.3, 0.9, 1), UNLIT)]),
                ("sky of both sides", [thing, (ball(60), (0.2, 0.3, 0.9, 1),
                                               {"doubleSided": True, **UNLIT})]),
                ("slab and sky", [thing, (box((100, 0.5, 100), (0, -0.25, 0)), gray, {}),
                                  (ball(80, True), (0.2, 0.3, 0.9, 1), UNLIT)]),
                ("lost", [thing, (box((0.5, 0.5, 0.5), (4000, 0, 0)), gray, {})]),
                ("apart", [thing, (box((1, 1, 1), (100, 0.5, 0)), RED, {})]),
                ("front", [(card(FRONT), RED, {})]), ("back", [(card(BACK), RED, {})]),
                ("right", [(card(FRONT, 0), RED, {})]), ("left", [(card(BACK, 0), RED, {})]),
                ("down", [(sheet(0), RED, {})]), ("down, tilted", [(sheet(0.3), RED, {})])):
            with self.subTest(name=name):
                seen = [p for p in self.picture(scene(*parts)) if p[0] > 2 * max(p[1:])]
                self.assertGreater(len(seen), 0.1 * SIZE["width"] * SIZE["height"])
                self.assertTrue(60 < sum(p[0] for p in seen) / len(seen) < 250)

    def test_part_of_a_whole_is_no_subject(self):
        """What is small beside a thing is not what a picture is about."""
        body = (box((0.6, 2, 0.4)), RED, {})
        button = (box((0.02, 0.02, 0.02), (0, 0.2, 0.21)), (0.9, 0.9, 0.9, 1), {})
        seen = self.picture(scene(body, button))
        alone = self.picture(scene(body))
        red = lambda picture: sum(p[0] > 2 * max(p[1:]) for p in picture)
        self.assertLess(abs(red(seen) - red(alone)), 0.1 * red(alone))

    def test_what_glows_keeps_its_colour(self):
        """All of it, far brighter than white: exposure is for it; a lamp in a scene changes nothing."""
        glow = {"emissiveFactor": [1, 0.5, 0.2], "extensions": {
            "KHR_materials_emissive_strength": {"emissiveStrength": 50}}}
        seen = self.picture(scene((ball(), (0, 0, 0, 1), glow)))
        middle = seen[SIZE["height"] // 2 * SIZE["width"] + SIZE["width"] // 2]
        linear = [((x / 255 + 0.055) / 1.055) ** 2.4 for x in middle]
        self.assertAlmostEqual(linear[1] / linear[0], 0.5, delta=0.05)
        self.assertAlmostEqual(linear[2] / linear[0], 0.2, delta=0.05)
        self.assertGreater(middle[0], 180)
        seen = self.picture(scene((ball(), (1, 1, 1, 1), {"emissiveFactor": [0.6, 0.6, 0.6]})))
        middle = seen[SIZE["height"] // 2 * SIZE["width"] + SIZE["width"] // 2]
        self.assertTrue(150 < middle[1] < 250, middle)
        wall = (box((2, 2, 2)), RED, {})
        lamp = (ball(0.2), (0, 0, 0, 1), glow)
        answers = [self.d.render(self.d.upload(scene(*parts)), SIZE, Accept="application/json").json()
                   for parts in ((wall,), (wall, lamp))]
        self.assertEqual(*[a["request"]["exposure_ev"] for a in answers])

    def test_own_lights_that_hardly_shine(self):
        """None at all: as without any. Very little: exposure is for it."""
        def lit(intensity, place):
            return mesh_scene(*ball(), color=(0.5, 0.5, 0.5, 1), nodes=[
                {"translation": place, "extensions": {"KHR_lights_punctual": {"light": 0}}}],
                extensionsUsed=["KHR_lights_punctual"], extensions={"KHR_lights_punctual": {
                    "lights": [{"type": "point", "intensity": intensity}]}})
        plain = self.picture(mesh_scene(*ball(), color=(0.5, 0.5, 0.5, 1)))
        self.assertEqual(off_by_more_than(plain, self.picture(lit(0, [0, 3, 0])), 0), 0)
        seen = self.picture(lit(5, [400, 300, 600]), ground=False, background=[0, 0, 1])
        middle = [sum(p) / 3 for p in seen if p[2] < 250 and p != (0, 0, 255)]
        self.assertTrue(80 < sum(middle) / len(middle) < 200, sum(middle) / len(middle))

    def test_glass_is_seen_through(self):
        """KHR_materials_transmission without a texture; metal lets nothing through."""
        for metallic, through, mode in ((0, True, "OPAQUE"), (0, True, "BLEND"), (1, False, "OPAQUE")):
            glass = {"alphaMode": mode, "pbrMetallicRoughness": {"metallicFactor": metallic, "roughnessFactor": 0.1},
                     "extensions": {"KHR_materials_transmission": {"transmissionFactor": 1}}}
            wall = (box((6, 6, 0.2), (0, 0, -3)), RED, {})
            seen = self.picture(scene((ball(), (1, 1, 1, 1), glass), wall), ground=False,
                                camera={"eye": [0, 0, 6], "target": [0, 0, 0], "fov_y_deg": 30})
            middle = seen[SIZE["height"] // 2 * SIZE["width"] + SIZE["width"] // 2]
            self.assertEqual(middle[0] > 1.3 * middle[1], through, middle)

    def test_a_highlight_is_one(self):
        """Of the key light in something black and smooth: no grid of the points it is sampled at."""
        file = mesh_scene(*ball(), color=(0, 0, 0, 1), material={"pbrMetallicRoughness": {
            "baseColorFactor": [0, 0, 0, 1], "metallicFactor": 0, "roughnessFactor": 0.02}})
        width, height = 600, 450
        seen = [sum(p) / 3 for p in self.picture(
            file, ground=False, sky=False, exposure_ev=-6, width=width, height=height)]
        limit = 0.85 * max(seen)
        bright = {i for i, value in enumerate(seen) if value > limit}
        groups = 0
        while bright:
            groups += 1
            todo = [bright.pop()]
            while todo:
                at = todo.pop()
                near = {at + dx + dy * width for dx in (-1, 0, 1) for dy in (-1, 0, 1)} & bright
                bright -= near
                todo += near
        self.assertEqual(groups, 1)

    def test_metals_mirror_a_studio(self):
        """Flat faces show a gradient, round ones light and dark; neither is black."""
        for name, mesh, color, contrast in (
                ("chrome box", box(), (1, 1, 1, 1), 1.25), ("gold box", box(), (1, 0.77, 0.34, 1), 1.25),
                ("chrome ball", ball(), (1, 1, 1, 1), 1.5), ("iron ball", ball(), (0.56, 0.57, 0.58, 1), 1.5)):
            metal = {"pbrMetallicRoughness": {
                "baseColorFactor": list(color), "metallicFactor": 1, "roughnessFactor": 0.1}}
            file = mesh_scene(*mesh, material=metal)
            with self.subTest(name=name):
                beauty = self.picture(file, ground=False)
                faces, normals = {}, self.picture(file, ground=False, output={"layer": "normal"})
                for pixel, normal in zip(beauty, normals):
                    if normal != (128, 128, 128):
                        key = normal if "box" in name else "all"
                        faces.setdefault(key, []).append(sum(pixel) / 3)
                values = sorted(max(faces.values(), key=len))
                self.assertTrue(60 < sum(values) / len(values) < 200)
                dark, light = values[len(values) // 20], values[-len(values) // 20]
                self.assertGreater(light, contrast * dark)
                self.assertGreater(dark, 30)


if __name__ == "__main__":
    harness.main()
