#!/usr/bin/env python3
"""Poses over HTTP: a posed scene against the same triangles standing still in a file of their own,
computed by an evaluation that shares no code with ours; bounds, names, errors, caches."""
import os
import sys
import tempfile
import unittest

import harness
from test_compare import read_png

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "../unit"))
import gltf_pose
import pose_files

VIEW = {"width": 160, "height": 120, "antialias": 1, "ground": True,
        "lights": [{"type": "rect", "position": [3, 7, 4], "target": [1, 1, 0], "width": 1.5,
                    "height": 1.5, "power_w": 900}],
        "camera": {"eye": [4, 4, 7], "target": [1.5, 0.5, -1]}}


def still(corners):
    """A file of the triangles as they are, with flat normals; the floor is a mesh of its own."""
    b = pose_files.Builder()
    for floor in (False, True):
        points = [list(p) for p, _ in corners if (p[1] == -4) == floor]
        b.json["meshes"].append(
            {"primitives": [{"attributes": {"POSITION": b.floats("VEC3", points)}}]})
        b.node(True, mesh=int(floor))
    return b.glb()


def differing(a, b):
    """Fraction of the pixels that differ by more than 8 in some channel."""
    pixels = [sum(read_png(data)[2], []) for data in (a, b)]
    off = sum(any(abs(x - y) > 8 for x, y in zip(p, q)) for p, q in zip(*pixels))
    return off / len(pixels[0])


class Animation(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.d = harness.Daemon()
        cls.folder = tempfile.TemporaryDirectory()
        cls.glb = pose_files.skinned(11, 1, normals=False, floor=True)
        path = os.path.join(cls.folder.name, "tube.glb")
        with open(path, "wb") as file:
            file.write(cls.glb)
        cls.file = gltf_pose.File(path)
        cls.id = cls.d.upload(cls.glb)

    @classmethod
    def tearDownClass(cls):
        cls.d.kill()
        cls.folder.cleanup()

    def picture(self, scene, request, **more):
        answer = self.d.render(scene, {**VIEW, **request}, **more)
        self.assertEqual(answer.status, 200, answer.body[:300])
        return answer.body

    def test_a_posed_scene_is_a_scene(self):
        """Rest, and two moments of each animation, there and back, by maps and by both kinds of
        rays: nothing of an earlier pose may show."""
        ends = [self.file.duration(0), self.file.duration(1)]
        poses = [({}, self.file.pose()),
                 ({"animation": "bend", "time_s": 0.4 * ends[0]}, self.file.pose(0, 0.4 * ends[0])),
                 ({"animation": 1, "time_s": 0.7 * ends[1]}, self.file.pose(1, 0.7 * ends[1])),
                 ({"animation": "0", "time_s": 1e5}, self.file.pose(0, 1e5))]
        stills = [self.d.upload(still(corners)) for _, corners in poses]
        for technique in ({"name": "pcss"}, {"name": "raytraced", "params": {"backend": "cpu"}},
                          {"name": "raytraced", "params": {"backend": "gpu"}}):
            for k in (0, 1, 2, 3, 1, 0):
                mine = self.picture(self.id, {"technique": technique, **poses[k][0]})
                other = self.picture(stills[k], {"technique": technique})
                self.assertLess(differing(mine, other), 0.004, (technique, k))
            self.assertGreater(differing(self.picture(self.id, {"technique": technique}),
                                         self.picture(stills[1], {"technique": technique})), 0.02)

    def test_the_camera_frames_the_pose(self):
        view = {"camera": {}, "lights": [], "technique": "hard", "animation": "grow",
                "time_s": self.file.duration(1), "ground": False}
        other = self.d.upload(still(self.file.pose(1, self.file.duration(1))))
        mine = self.picture(self.id, view)
        del view["animation"], view["time_s"]
        self.assertLess(differing(mine, self.picture(other, view)), 0.004)

    def test_description(self):
        scene = self.d.get("/v1/scenes/" + self.id).json()
        self.assertEqual([(a["index"], a["name"]) for a in scene["animations"]],
                         [(0, "bend"), (1, "grow")])
        for a in scene["animations"]:
            self.assertAlmostEqual(a["duration_s"], self.file.duration(a["index"]), 5)
        self.assertEqual(scene["warnings"], [])
        corners = [p for p, _ in self.file.pose()]
        for k in range(3):
            self.assertAlmostEqual(scene["bounds"]["min"][k], min(p[k] for p in corners), 4)
            self.assertAlmostEqual(scene["bounds"]["max"][k], max(p[k] for p in corners), 4)

    def test_names_and_errors(self):
        answer = self.d.render(self.id, {**VIEW, "animation": "fly"})
        self.assertEqual(answer.status, 422)
        self.assertEqual(answer.json()["pointer"], "/animation")
        self.assertIn("bend, grow", answer.json()["detail"])
        for wrong in (-1, 0.5, True, None, ["bend"], "a\nb"):
            answer = self.d.render(self.id, {**VIEW, "animation": wrong})
            self.assertEqual(answer.status, 422, wrong)
            self.assertEqual(answer.json()["pointer"], "/animation")
        self.assertEqual(self.d.render(self.id, {**VIEW, "animation": 2}).status, 422)
        answer = self.d.render(self.d.upload(harness.grid_scene()), {**VIEW, "animation": 0})
        self.assertEqual(answer.status, 422)
        self.assertIn("no animations", answer.json()["detail"])

    def test_caches_follow_the_pose(self):
        path = ("/v1/scenes/%s/render?technique=hard&width=64&height=48&deadline_ms=300000"
                "&animation=bend&time_s=" % self.id)
        first = self.d.get(path + "0.5")
        again = self.d.get(path + "0.5", If_None_Match=first.headers["ETag"])
        later = self.d.get(path + "1.0", If_None_Match=first.headers["ETag"])
        self.assertEqual((first.status, again.status, later.status), (200, 304, 200))
        self.assertNotEqual(first.body, later.body)
        self.assertEqual(self.d.get(path + "0.5").body, first.body)

    def test_a_pose_out_of_range(self):
        b = pose_files.Builder()
        b.json["meshes"].append({"primitives": [{"attributes": {"POSITION": b.floats(
            "VEC3", [[0, 0, 0], [1, 0, 0], [0, 1, 0]])}}]})
        node = b.node(True, mesh=0)
        b.animate("far", [(node, "translation", [0, 1], [[0, 0, 0], [3e38, 0, 0]], "LINEAR")])
        scene = self.d.upload(b.glb())
        rest = self.picture(scene, {"technique": "hard"})
        answer = self.d.render(scene, {**VIEW, "animation": "far", "time_s": 1})
        self.assertEqual(answer.status, 422)
        self.assertIn("1e12", answer.json()["detail"])
        self.assertEqual(self.picture(scene, {"technique": "hard"}), rest)


if __name__ == "__main__":
    harness.main()
