"""The same thing far from the origin, or very small: the same picture as near it and in metres."""
import random
import unittest

import harness
from harness import Daemon
from pictures import box, mesh_scene, off_by_more_than, pose_files, rgb

SIZE = {"width": 200, "height": 150}
UTM = (500000.5, 250.0, -4649776.0)
ECEF = (-3178068.5, 6378137.0, 4487348.0)
# Rounding may move an edge across a pixel's centre; what is drawn coarsely loses whole faces.
MOST_OFF = SIZE["width"] * SIZE["height"] // 300


def stairs(offset=(0, 0, 0), scale=1.0):
    """Two boxes on a floor, corners at multiples of 1/2: floats hold them at either place."""
    points, normals, indices = [], [], []
    for size, center in (((6, 0.5, 6), (0, -0.25, 0)), ((2, 3, 1), (0, 1.5, 0)),
                         ((1, 1, 2), (1.5, 0.5, 1))):
        p, n, i = box(size, center)
        indices += [len(points) + k for k in i]
        points += [[scale * x + o for x, o in zip(point, offset)] for point in p]
        normals += n
    return points, normals, indices


def lamp(node, intensity):
    return {"nodes": [{"extensions": {"KHR_lights_punctual": {"light": 0}}, **node}],
            "extensionsUsed": ["KHR_lights_punctual"],
            "extensions": {"KHR_lights_punctual": {"lights": [
                {"type": "point", "intensity": intensity}]}}}


def moved(point, offset):
    return [a + b for a, b in zip(point, offset)]


def view(offset=(0, 0, 0), scale=1.0, kind="rect"):
    size = {"rect": {"width": scale, "height": scale, "power_w": 100 * scale * scale},
            "sphere": {"radius": 0.5 * scale, "power_w": 100 * scale * scale},
            "sun": {}}[kind]
    return {"camera": {"eye": moved([7 * scale, 5 * scale, 8 * scale], offset),
                       "target": moved([0, scale, 0], offset), "fov_y_deg": 40},
            "lights": [{"type": kind, "position": moved([4 * scale, 6 * scale, 3 * scale], offset),
                        "target": moved([0, 0.5 * scale, 0], offset), **size}]}


class Far(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.d = Daemon()
        cls.near = cls.d.upload(mesh_scene(*stairs()))

    @classmethod
    def tearDownClass(cls):
        assert cls.d.stop(timeout=120) == 0

    def picture(self, scene, **request):
        answer = self.d.render(scene, {**SIZE, "deadline_ms": 600000, **request}, timeout=600)
        self.assertEqual(answer.status, 200, answer.body[:300])
        return rgb(answer)

    def same(self, scene, offset=(0, 0, 0), scale=1.0, names=("pcss", "raytraced"), **pose):
        """Default request, then each light with a camera that moved along."""
        expected = self.picture(self.near)
        self.assertGreater(len(set(expected)), 100)
        self.assertLessEqual(off_by_more_than(expected, self.picture(scene, **pose), 8), MOST_OFF)
        for name in names:
            for kind in ("rect", "sphere", "sun") if name == "pcss" else ("rect",):
                with self.subTest(method=name, light=kind):
                    more = {"technique": {"name": name}, "output": {"layer": "visibility"}}
                    expected = self.picture(self.near, **view(kind=kind), **more)
                    seen = self.picture(scene, **view(offset, scale, kind), **more, **pose)
                    self.assertLessEqual(off_by_more_than(expected, seen, 16), MOST_OFF)

    def check_bounds(self, scene, offset, scale=1.0):
        bounds = self.d.get("/v1/scenes/" + scene).json()["bounds"]
        for end, corner in (("min", (-3, -0.5, -3)), ("max", (3, 3, 3))):
            for value, at, by in zip(bounds[end], corner, offset):
                self.assertAlmostEqual(value, scale * at + by, delta=1e-6 * scale + 1e-9)

    def test_node_far_away(self):
        for offset in (UTM, ECEF, (500000.3, 0.7, 4649776.9)):
            with self.subTest(offset=offset):
                scene = self.d.upload(mesh_scene(*stairs(), node={"translation": list(offset)}))
                self.check_bounds(scene, offset)
                self.same(scene, offset)

    def test_vertices_far_away(self):
        for offset in (UTM, ECEF):
            with self.subTest(offset=offset):
                scene = self.d.upload(mesh_scene(*stairs(offset)))
                self.check_bounds(scene, offset)
                self.same(scene, offset)

    def test_points_and_lines_far_away(self):
        """A scan in coordinates of a map: each point is smaller than a float resolves there."""
        def scan(offset, mode):
            rng, b = random.Random(4), pose_files.Builder()
            places = [moved([rng.randint(-12, 12) / 2 for _ in range(3)], offset) for _ in range(60)]
            b.json["meshes"] = [{"primitives": [
                {"mode": mode, "attributes": {"POSITION": b.floats("VEC3", places)}}]}]
            b.node(True, mesh=0)
            return self.d.upload(b.glb())
        for mode in (0, 1, 2, 3):
            near = self.picture(scan((0, 0, 0), mode))
            for offset in (UTM, ECEF):
                with self.subTest(mode=mode, offset=offset):
                    far = self.picture(scan(offset, mode))
                    self.assertLessEqual(off_by_more_than(near, far, 8), MOST_OFF)

    def test_morphed_far_away(self):
        """Vertices at the origin, and a morph target that takes all of them away: at rest, with
        time, and back again from a node that is there."""
        def scene(shift, weight, node=(0, 0, 0)):
            points, normals, indices = stairs()
            b = pose_files.Builder()
            b.json["meshes"].append({"weights": [weight], "primitives": [{
                "attributes": {"POSITION": b.floats("VEC3", points),
                               "NORMAL": b.floats("VEC3", normals)},
                "indices": b.accessor("SCALAR", 5123, "H", [[i] for i in indices]),
                "targets": [{"POSITION": b.floats("VEC3", [shift] * len(points))}]}]})
            b.node(True, mesh=0, translation=list(node))
            if not weight:
                b.animate("go", [(0, "weights", [0.5], [[1]], "STEP")])
            return self.d.upload(b.glb())
        for offset in (UTM, (1e6, 0, 0)):
            with self.subTest(offset=offset):
                rests = scene(offset, 1)
                self.check_bounds(rests, offset)
                self.same(rests, offset)
                self.same(scene(offset, 0), offset, animation="go", names=("raytraced",))
        back = scene([-x for x in UTM], 1, UTM)
        self.check_bounds(back, (0, 0, 0))
        self.same(back)

    def test_animated_far_away(self):
        """Nodes that time takes away, all of them or a character's joints."""
        points, normals, indices = stairs()
        for skinned in (False, True):
            b = pose_files.Builder()
            attributes = {"POSITION": b.floats("VEC3", points), "NORMAL": b.floats("VEC3", normals)}
            if skinned:
                ones = [[0, 0, 0, 0]] * len(points)
                attributes["JOINTS_0"] = b.accessor("VEC4", 5121, "B", ones)
                attributes["WEIGHTS_0"] = b.floats("VEC4", [[1, 0, 0, 0]] * len(points))
            b.json["meshes"].append({"primitives": [{
                "attributes": attributes,
                "indices": b.accessor("SCALAR", 5123, "H", [[i] for i in indices])}]})
            top = b.node(True, **({} if skinned else {"mesh": 0}))
            if skinned:
                b.json["skins"] = [{"joints": [top]}]
                b.node(True, mesh=0, skin=0)
            b.animate("go", [(top, "translation", [0.5], [ECEF], "STEP")])
            scene = self.d.upload(b.glb())
            with self.subTest(skinned=skinned):
                self.same(scene)
                self.same(scene, ECEF, animation="go")
                self.same(scene, names=())

    def test_far_vertices_brought_back_by_the_node(self):
        scene = self.d.upload(mesh_scene(*stairs(UTM), node={"translation": [-x for x in UTM]}))
        self.check_bounds(scene, (0, 0, 0))
        self.same(scene)

    def test_two_nodes_far_away_meet(self):
        """Their places differ by less than a float resolves there."""
        def pair(offset):
            other = {"nodes": [{"mesh": 0, "translation": moved((0.3, 0.1, 6.2), offset)}]}
            return self.d.upload(mesh_scene(*stairs(), node={"translation": list(offset)}, **other))
        near, far = pair((0, 0, 0)), pair(UTM)
        self.assertLessEqual(off_by_more_than(self.picture(near), self.picture(far), 8), MOST_OFF)

    def test_lights_and_cameras_of_the_file(self):
        def scene(offset):
            nodes = lamp({"translation": moved((3, 4, 2), offset)}, 3000)
            nodes["nodes"].append({"camera": 0, "translation": moved((0, 1, 9), offset)})
            return self.d.upload(mesh_scene(
                *stairs(), node={"translation": list(offset)}, **nodes,
                cameras=[{"type": "perspective", "perspective": {"yfov": 0.7, "znear": 0.1}}]))
        near, far = scene((0, 0, 0)), scene(ECEF)
        info = self.d.get("/v1/scenes/" + far).json()
        self.assertEqual(info["lights"][0]["light"]["position"], moved((3, 4, 2), ECEF))
        self.assertEqual(info["cameras"][0]["eye"], moved((0, 1, 9), ECEF))
        for request in ({}, {"camera": {"index": 0}}):
            self.assertLessEqual(off_by_more_than(
                self.picture(near, **request), self.picture(far, **request), 8), MOST_OFF)

    def test_record_speaks_of_the_file(self):
        """What was chosen, asked for as it is told, gives the picture again."""
        scene = self.d.upload(mesh_scene(*stairs(), node={"translation": list(UTM)}))
        record = self.d.render(scene, SIZE, Accept="application/json").json()["request"]
        for value, at in zip(record["camera"]["target"], UTM):
            self.assertLess(abs(value - at), 5)
        again = {key: record[key] for key in ("camera", "lights")}
        self.assertLessEqual(
            off_by_more_than(self.picture(scene), self.picture(scene, **again), 8), 20)

    def test_very_small(self):
        for scale in (1e-4, 1e-6):
            with self.subTest(scale=scale):
                scene = self.d.upload(mesh_scene(*stairs(), node={"scale": [scale] * 3}))
                self.check_bounds(scene, (0, 0, 0), scale)
                self.same(scene, scale=scale)
        scene = self.d.upload(mesh_scene(*stairs(scale=1e-5)))
        self.same(scene, scale=1e-5, names=("pcss", "raytraced", "vsm", "cascaded"))

    def test_very_large(self):
        scene = self.d.upload(mesh_scene(*stairs(), node={"scale": [1e5] * 3}))
        self.same(scene, scale=1e5)

    def test_small_things_in_a_wide_scene(self):
        """Nothing that is near the camera is cut off, however far the rest of its mesh reaches."""
        for scale in (1, 0.1, 0.02):
            camera = {"eye": [3 * scale, 5 * scale, 3 * scale], "target": [0, scale, 0]}
            pictures = []
            for half in (50 * scale, 1000, 10000):
                points, normals, indices = stairs(scale=scale)
                n = len(points)
                points += [[x * half, -0.5 * scale, z * half]
                           for x, z in ((-1, 1), (1, 1), (1, -1), (-1, -1))]
                scene = self.d.upload(mesh_scene(points, normals + [[0, 1, 0]] * 4,
                                                 indices + [n + i for i in (0, 1, 2, 0, 2, 3)]))
                pictures.append(self.picture(scene, camera=camera, ground=False, technique="none",
                                             output={"layer": "normal"}))
            self.assertGreater(len(set(pictures[0])), 2)
            for half, wide in zip((1000, 10000), pictures[1:]):
                with self.subTest(scale=scale, half=half):
                    self.assertLessEqual(off_by_more_than(pictures[0], wide, 8), 10)

    def test_a_row_of_things_far_apart(self):
        """Each with its own shadow, of maps that suit it: as if it were alone."""
        scene = self.d.upload(mesh_scene(*stairs(), node={"translation": [0, 0, 0]}, nodes=[
            {"mesh": 0, "translation": [400 * i, 0, 0]} for i in range(1, 5)]))
        for x in (0, 1600):
            for name in ("hard", "pcss", "vsm", "cssm"):
                for kind in ("rect", "sun"):
                    with self.subTest(x=x, method=name, light=kind):
                        more = {"technique": {"name": name}, "output": {"layer": "visibility"},
                                "ground": False}
                        expected = self.picture(self.near, **view(kind=kind), **more)
                        seen = self.picture(scene, **view((x, 0, 0), kind=kind), **more)
                        self.assertLessEqual(off_by_more_than(expected, seen, 24), 1.5 * MOST_OFF)
        plain = self.d.render(scene, {**SIZE, "technique": "pcss"})
        self.assertNotIn("Texels", plain.headers.get("X-Penumbra-Warning", ""))

    def test_ranges(self):
        for point, status in ([1e9, 0, 0], 200), ([1.1e9, 0, 0], 422):
            answer = self.d.render(self.near, {**SIZE, "camera": {"eye": point}})
            self.assertIn(answer.status, (status, 400 if status == 422 else status))


if __name__ == "__main__":
    harness.main()
