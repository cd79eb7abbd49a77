"""Where surfaces touch, in closed rooms and on wide grounds, no light goes through what casts."""
import math
import re
import unittest

import harness
from harness import Daemon
from pictures import box, mesh_scene, rgb

WIDTH, HEIGHT = 640, 480


def wall_on_floor(turn):
    """A wall without thickness on a floor, turned about the vertical."""
    c, s = math.cos(turn), math.sin(turn)
    points = [[-4, 0, 4], [4, 0, 4], [4, 0, -4], [-4, 0, -4], [-4, 0, 0], [4, 0, 0], [4, 2, 0],
              [-4, 2, 0]]
    normals = [[0, 1, 0]] * 4 + [[s, 0, c]] * 4
    return mesh_scene([[c * x + s * z, y, c * z - s * x] for x, y, z in points], normals,
                      [0, 1, 2, 0, 2, 3, 4, 5, 6, 4, 6, 7], material={"doubleSided": True})


def solids(*boxes):
    """A scene of boxes of this size about this centre, each turned about the vertical."""
    points, normals, indices = [], [], []
    for size, center, turn in boxes:
        c, s = math.cos(turn), math.sin(turn)
        first = len(points)
        for values, into in zip(box(size, center), (points, normals)):
            into += [[c * x + s * z, y, c * z - s * x] for x, y, z in values]
        indices += [first + i for i in box()[2]]
    return mesh_scene(points, normals, indices, material={"doubleSided": True})


def bumpy_ball(columns, rows):
    """A ball of radius 1 with bumps as large as a few of its triangles."""
    points, indices = [], []
    for j in range(rows + 1):
        for i in range(columns):
            u, v = 2 * math.pi * i / columns, math.pi * j / rows
            r = 1 + 0.05 * math.sin(v) * math.sin(11 * u + 3 * v) * math.sin(17 * v + 2 * u)
            points.append([r * math.sin(v) * math.sin(u), r * math.cos(v), r * math.sin(v) * math.cos(u)])
    for j in range(rows):
        for i in range(columns):
            a, b = j * columns + i, j * columns + (i + 1) % columns
            indices += [a, a + columns, b, b, a + columns, b + columns]
    return mesh_scene(points, points, indices)


def rect(x, y, z):
    return {"type": "rect", "position": [x, y, z], "target": [0, 0, 0], "width": 1, "height": 1}


SUN = {"type": "sun", "target": [0, 0, 0], "angular_diameter_deg": 0.53, "irradiance": 3}
# What is not worth its time here: as many maps as a picture needs.
PARAMS = {"multisample": {"samples": 16}}
# Answers for methods: the reference, and what draws no shadow or is another method.
APART = ("raytraced", "none", "auto")


class Contact(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.d = Daemon()
        cls.methods = [t["name"] for t in cls.d.get("/v1/techniques").json()["techniques"]
                       if t["name"] not in APART]

    @classmethod
    def tearDownClass(cls):
        assert cls.d.stop() == 0

    def test_wall_hides_the_light_down_to_the_floor(self):
        for turn, aside in ((0, 0.3), (0, 0.5), (2.59, 0.65), (4.44, 0.9)):
            c, s = math.cos(turn), math.sin(turn)
            scene = self.d.upload(wall_on_floor(turn))
            request = {
                "width": WIDTH, "height": HEIGHT, "ground": False, "output": {"layer": "visibility"},
                "camera": {"eye": [s * 3 + aside * c, 1.2, c * 3 - aside * s],
                           "target": [0, 0.4, 0], "fov_y_deg": 45},
                "lights": [{"type": "rect", "position": [-s * 4, 4, -c * 4], "target": [0, 0, 0],
                            "width": 1, "height": 1}]}
            for backend in ("cpu", "gpu"):
                answer = self.d.render(scene, {**request, "technique": {
                    "name": "raytraced", "params": {"backend": backend, "samples": 1}}}, timeout=300)
                if backend == "cpu" and answer.status == 422:
                    continue  # built without it
                self.assertEqual(answer.status, 200, answer.body[:300])
                lit = [(i % WIDTH, i // WIDTH) for i, p in enumerate(rgb(answer)) if p[0] > 0]
                self.assertEqual(lit, [], "turned by %.2f, %s" % (turn, backend))

    def visibility(self, scene, request, method):
        answer = self.d.render(scene, {
            "width": 320, "height": 240, "ground": False, "output": {"layer": "visibility"},
            **request, "technique": {"name": method, "params": PARAMS.get(method, {})}}, timeout=300)
        self.assertEqual(answer.status, 200, answer.body[:300])
        return [p[0] for p in rgb(answer)]

    def check_dark(self, scene, request, methods, most=0, grey=60):
        """Everything in view lies in umbra."""
        for method in methods:
            with self.subTest(method=method, lights=request["lights"]):
                lit = sum(v > grey for v in self.visibility(scene, request, method))
                self.assertLessEqual(lit, most)

    def test_no_method_lights_the_seam_of_wall_and_floor(self):
        for turn, thick in ((0.7, 0), (2.59, 0), (0.3, 0.05), (1.3, 0.002)):
            c, s = math.cos(turn), math.sin(turn)
            scene = self.d.upload(wall_on_floor(turn) if not thick else solids(
                ((8, 2, thick), (0, 1, -thick / 2), turn), ((8, 0.1, 8), (0, -0.05, 0), turn)))

            def turned(x, y, z):
                return [c * x + s * z, y, c * z - s * x]

            request = {"camera": {"eye": turned(0.4, 1.2, 3), "target": [0, 0.4, 0],
                                  "fov_y_deg": 45}}
            some = ["hard", "pcf", "pcss", "vsm"]
            lights = [(rect(*turned(1, 4, -4)), self.methods if turn == 0.7 else some),
                      ({**SUN, "position": turned(1, 3, -4)}, some),
                      ({"type": "sphere", "position": turned(0.5, 4, -3), "radius": 0.4}, ["pcss"])]
            for light, methods in lights:
                # A sphere's light has six maps, which meet in the picture.
                self.check_dark(scene, {**request, "lights": [light]}, methods,
                                most=2 if light["type"] == "sphere" else 0)

    def test_what_a_wall_hides_is_dark_however_far_it_reaches(self):
        """A wall that reaches from the floor up to the light, the receiver behind it at its foot: the
        one of a closed room that is lit within, and a thin one before a large light."""
        walls = [((4.2, 0.1, 4.2), (0, 3.05, 0), 0), ((8, 0.1, 8), (0, -0.05, 0), 0)]
        for side in (-2.05, 2.05):
            walls += [((0.1, 3, 4.2), (side, 1.5, 0), 0), ((4, 3, 0.1), (0, 1.5, side), 0)]
        lamp = {**rect(0, 2.5, 0), "target": [0.3, 0, 0.2]}
        room = {"camera": {"eye": [7, 3, 7], "target": [1.5, 0, 1.5], "fov_y_deg": 45},
                "lights": [lamp]}
        thin = {"camera": {"eye": [0.3, 1.2, 3], "target": [0, 0.4, 0], "fov_y_deg": 45},
                "lights": [rect(1, 4, -4)], "width": 640, "height": 480}
        for scene, request, methods in (
                (solids(*walls), room, ("vssm", "mssm", "cssm", "pcss", "adaptive", "bitmask")),
                (wall_on_floor(0), thin, ("cssm", "mssm"))):
            scene = self.d.upload(scene)
            truth = self.visibility(scene, request, "raytraced")
            for method in methods:
                with self.subTest(method=method, camera=request["camera"]):
                    seen = self.visibility(scene, request, method)
                    lit = sum(v > 60 and t == 0 for v, t in zip(seen, truth))
                    self.assertLessEqual(lit, 10 if request is room else 0)
                    grey = sum(v > 12 and t == 0 for v, t in zip(seen, truth))
                    self.assertLessEqual(grey, 60 if request is room else 0)

    def test_the_background_sees_every_light(self):
        """Also in tiles that are filled as a whole."""
        scene = self.d.upload(solids(((2, 2, 2), (0, 1, 0), 0)))
        request = {"camera": {"eye": [1, 1, -6], "target": [0, 1, 0]}, "lights": [
            {**SUN, "position": [0, 2, 5]}]}
        answer = self.d.render(scene, {"width": 320, "height": 240, "ground": False, **request,
                                       "technique": "none", "output": {"layer": "normal"}})
        behind = [p == (128, 128, 128) for p in rgb(answer)]
        for method in ("hard", "pcf", "pcss"):
            with self.subTest(method=method):
                seen = self.visibility(scene, request, method)
                self.assertEqual({v for v, away in zip(seen, behind) if away}, {255})

    def test_closed_room_is_dark(self):
        """Also where a light is so large that only its walls and its roof together hide it."""
        scene = self.d.upload(solids(((4, 3, 4), (0, 1.5, 0), 0)))
        view = {"camera": {"eye": [1.5, 1.5, 1.5], "target": [-1.5, 0.8, -1.5], "fov_y_deg": 75}}
        self.check_dark(scene, {**view, "lights": [{**SUN, "position": [5, 7, 3]}]}, self.methods)
        self.check_dark(scene, {**view, "lights": [rect(4, 5, 3)]},
                        ("pcss", "accumulation", "backprojection", "bitmask"), 10, 12)

    def test_box_keeps_its_shadow_on_a_wide_ground(self):
        points, normals, indices = box((1, 1, 1), (0, 0.5, 0))
        ground = [[-1000, 0, 1000], [1000, 0, 1000], [1000, 0, -1000], [-1000, 0, -1000]]
        parts = [{"primitives": [{"attributes": {"POSITION": 0, "NORMAL": 1}, "indices": 3 + i,
                                  "material": 0}]} for i in range(2)]
        ranges = [{"bufferView": 2, "byteOffset": 144 * i, "componentType": 5125,
                   "count": 6 if i else 36, "type": "SCALAR"} for i in range(2)]
        scene = self.d.upload(mesh_scene(
            points + ground, normals + [[0, 1, 0]] * 4, indices + [24, 25, 26, 24, 26, 27],
            node={"mesh": 1}, nodes=[{"mesh": 2}], meshes=parts, accessors=ranges))
        # And with the ground in the same mesh.
        one = self.d.upload(mesh_scene(
            points + ground, normals + [[0, 1, 0]] * 4, indices + [24, 25, 26, 24, 26, 27]))
        # The umbra in closed form: of the ground before the box, away from a light at (4, 5, -2),
        # what lies 0.1 inside the shadow of the box's top, 0.8 to the side and 0.4 to the front.
        camera = {"eye": [-0.6, 6, 0.3], "target": [-0.6, 0, 0.3], "up": [0, 0, -1],
                  "fov_y_deg": 30}
        scale = 240 / (2 * 6 * math.tan(math.radians(15)))
        inside = []
        for y in range(240):
            for x in range(320):
                at_x, at_z = (x + 0.5 - 160) / scale - 0.6, (y + 0.5 - 120) / scale + 0.3
                if -1.2 < at_x < -0.6 and -0.1 < at_z + 0.5 * (at_x + 0.5) < 0.4:
                    inside.append(y * 320 + x)
        self.assertGreater(len(inside), 500)
        request = {"camera": camera, "lights": [{**SUN, "position": [4, 5, -2]}]}
        for method in self.methods:
            for which in (scene, one) if method in ("hard", "pcf", "pcss", "multisample") else (scene,):
                seen = self.visibility(which, request, method)
                with self.subTest(method=method, one_mesh=which == one):
                    self.assertLessEqual(sum(seen[i] >= 128 for i in inside), 0.1 * len(inside))

    def test_ground_at_the_foot_of_a_slab_is_lit(self):
        """The light comes from behind the camera: nothing before the slab's middle lies in shadow."""
        for turn in (0.3, 0.6, 0.9):
            scene = self.d.upload(solids(((2, 0.1, 2), (0, 0.05, 0), turn)))
            request = {"ground": True, "width": 640, "height": 480,
                       "camera": {"eye": [0, 2, 4], "target": [0, 0.1, 0], "fov_y_deg": 35},
                       "lights": [{**SUN, "position": [0, 4, 4]}]}
            for method, most in (("raytraced", 0), ("hard", 3), ("pcss", 3)):
                with self.subTest(turn=turn, method=method):
                    seen = self.visibility(scene, request, method)
                    self.assertLessEqual(sum(v < 100 for v in seen[640 * 250:]), most)

    def test_bumps_have_no_specks(self):
        """Triangles of a rough surface are no casters that touch their neighbours."""
        scene = self.d.upload(bumpy_ball(120, 60))
        request = {"camera": {"eye": [0.6, 1.2, 2.6], "target": [0, 0, 0]},
                   "lights": [rect(-3, 4, 4)]}
        truth = self.visibility(scene, request, "raytraced")
        # A map that is blurred has none; pcss has grain of its own at creases.
        for method, most in (("vsm", 3), ("pcss", 60)):
            got = self.visibility(scene, request, method)
            specks = 0
            for y in range(1, 239):
                for x in range(1, 319):
                    i = 320 * y + x
                    if got[i] < truth[i] - 60:
                        around = sorted(got[i + 320 * a + b] for a in (-1, 0, 1) for b in (-1, 0, 1))
                        specks += got[i] < around[4] - 60
            self.assertLessEqual(specks, most, method)

    def test_grazing_light_still_arrives(self):
        scene = self.d.upload(solids(((2, 2, 4), (-1, 1, 0), 0), ((10, 0.1, 10), (0, -0.05, 0), 0)))
        for x in (0.2, 0.3, 0.6):
            request = {"camera": {"eye": [3, 1, 0.5], "target": [0, 0.9, 0], "fov_y_deg": 30},
                       "lights": [rect(x, 4, 0)]}
            truth = self.visibility(scene, request, "raytraced")
            for method in ("hard", "pcf", "pcss", "erosion", "vsm"):
                seen = self.visibility(scene, request, method)
                with self.subTest(method=method, x=x):
                    lit = [v for v, t in zip(seen, truth) if t > 235]
                    self.assertGreater(len(lit), 10000)
                    self.assertLess(sum(v < 120 for v in lit), 0.01 * len(lit))

    def test_what_a_map_is_too_coarse_for_is_said(self):
        """A map over 2 km, of which the picture shows 2 m; and one over what is shown."""
        ask = {"width": 160, "height": 120, "ground": False,
               "camera": {"eye": [0, 2, 3], "target": [0, 0.5, 0], "fov_y_deg": 40},
               "lights": [{"type": "sun", "position": [0, 10, 0], "target": [0, 0, 0]}]}
        near = ((1, 1, 1), (0, 0.5, 0), 0)
        far = [((1, 1, 1), (x, 0.5, z), 0) for x in (-1000, 1000) for z in (-1000, 1000)]
        floor = ((2002, 0.1, 2002), (0, -0.05, 0), 0)
        for boxes, size in (([near, floor] + far, 1024), ([near, floor] + far, 256), ([near], 1024)):
            scene = self.d.upload(solids(*boxes))
            for method in ("hard", "pcss", "csm"):
                with self.subTest(boxes=len(boxes), size=size, method=method):
                    answer = self.d.render(scene, {
                        **ask, "technique": {"name": method, "params": {"map_size": size}}}, timeout=600)
                    self.assertEqual(answer.status, 200, answer.body[:300])
                    said = re.search(r"Texels of the shadow map are (\d+) pixels \(([\d.]+) m\)",
                                     answer.headers.get("X-Penumbra-Warning", ""))
                    self.assertEqual(said is not None, len(boxes) > 1)
                    if said:
                        self.assertLess(abs(float(said[2]) * size / 2001 - 1), 0.1)
                        # the camera's axis meets the boxes' tops 1 m below the eye
                        pixel = 2 * math.hypot(1.5, 3) / 1.5 * math.tan(math.radians(20)) / 120
                        self.assertLess(abs(int(said[1]) * pixel / float(said[2]) - 1), 0.1)


if __name__ == "__main__":
    harness.main()
