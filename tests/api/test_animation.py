#!/usr/bin/env python3
"""Poses over HTTP: a posed scene against the same triangles standing still in a file of their own,
computed by an evaluation that shares no code with ours; bounds, names, errors, caches."""
import json
import os
import subprocess
import sys
import tempfile
import threading
import unittest

import harness
from pictures import off_by_more_than, rgb

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "../unit"))
import gltf_pose
import pose_files

DUMP = os.path.join(harness.BIN, "pose_dump")
VIEW = {"width": 160, "height": 120, "antialias": 1, "ground": False, "sky": False, "exposure_ev": 0,
        "lights": [{"type": "rect", "position": [3, 7, 4], "target": [1, 1, 0], "width": 1.5,
                    "height": 1.5, "power_w": 900}],
        "camera": {"eye": [4, 4, 7], "target": [1.5, 0.5, -1]}}
BACKGROUND = (128, 128, 128)  # of the layer "normal"


def still(corners):
    """A file of the triangles as they are, with flat normals; the floor is a mesh of its own."""
    b = pose_files.Builder()
    for floor in (False, True):
        points = [p for p, _ in corners if (p[1] == -4) == floor]
        b.json["meshes"].append(
            {"primitives": [{"attributes": {"POSITION": b.floats("VEC3", points)}}]})
        b.node(True, mesh=int(floor))
    return b.glb()


def baked(path, *poses):
    """Such files of the poses that the importer and the renderer make of a file: pose_compare.py
    says whether those are right, these tests whether what is drawn is them."""
    arguments = [str(x) for pose in poses for x in pose]
    lines = subprocess.run([DUMP, path] + arguments, capture_output=True, check=True,
                           text=True).stdout.splitlines()
    return [still(json.loads(line)["corners"]) for line in lines]


class Animation(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.d = harness.Daemon()
        cls.folder = tempfile.TemporaryDirectory()
        cls.glb = pose_files.skinned(11, 1, normals=False, floor=True)
        cls.path = os.path.join(cls.folder.name, "tube.glb")
        with open(cls.path, "wb") as file:
            file.write(cls.glb)
        cls.file = gltf_pose.File(cls.path)
        cls.id = cls.d.upload(cls.glb)

    @classmethod
    def tearDownClass(cls):
        cls.d.kill()
        cls.folder.cleanup()

    def picture(self, scene, request, **more):
        answer = self.d.render(scene, {**VIEW, **request}, **more)
        self.assertEqual(answer.status, 200, answer.body[:300])
        return answer

    def same(self, a, b, *what):
        self.assertEqual(off_by_more_than(rgb(a), rgb(b), 8), 0, what)

    def poses(self):
        ends = [self.file.duration(0), self.file.duration(1)]
        asked = [("", 0), ("bend", 0.4 * ends[0]), (1, 0.7 * ends[1]), ("0", 100000)]
        stills = [self.d.upload(data) for data in baked(self.path, *asked[1:])]
        return [{"animation": a, "time_s": t} for a, t in asked], stills

    def test_a_posed_scene_is_a_scene(self):
        """Rest, and moments of two animations, there and back, by maps and by both kinds of rays:
        nothing of an earlier pose may show."""
        poses, stills = self.poses()
        for technique in ({"name": "hard"}, {"name": "pcss"},
                          {"name": "raytraced", "params": {"backend": "cpu"}},
                          {"name": "raytraced", "params": {"backend": "gpu"}}):
            pictures = [self.picture(one, {"technique": technique}) for one in stills]
            for k in (0, 1, 2, 3, 1, 0):
                mine = self.picture(self.id, {"technique": technique, **poses[k]})
                self.same(mine, pictures[k], technique, k)
            self.assertGreater(off_by_more_than(rgb(pictures[0]), rgb(pictures[1]), 8), 400)

    def test_no_method_keeps_an_earlier_pose(self):
        poses, stills = self.poses()
        size = {"width": 96, "height": 72}
        names = [t["name"] for t in self.d.get("/v1/techniques").json()["techniques"]]
        for name in names:
            if name == "auto":  # what it takes is not the same for two files
                continue
            technique = {"technique": {"name": name}, **size}
            pictures = [rgb(self.picture(stills[k], technique)) for k in (1, 2)]
            for k in (1, 2, 1):
                mine = rgb(self.picture(self.id, {**technique, **poses[k]}))
                # Filters round otherwise where triangles come in another order.
                self.assertLessEqual(off_by_more_than(mine, pictures[k - 1], 8), 12, (name, k))
            self.assertGreater(off_by_more_than(*pictures, 8), 120)

    def test_the_independent_evaluation_gives_the_picture(self):
        for animation, share in ((0, 0.4), (1, 0.7)):
            time = share * self.file.duration(animation)
            corners = [(list(p), n) for p, n in self.file.pose(animation, time)]
            mine = self.picture(self.id, {"technique": "hard", "animation": animation,
                                          "time_s": time})
            other = self.picture(self.d.upload(still(corners)), {"technique": "hard"})
            self.assertLessEqual(off_by_more_than(rgb(mine), rgb(other), 8), 2)

    def record(self, scene, request):
        answer = self.d.render(scene, {"width": 96, "height": 72, **request},
                               Accept="application/json")
        self.assertEqual(answer.status, 200, answer.body[:300])
        return answer.json()["request"]

    def test_a_sequence_is_steady(self):
        """Camera, key light and exposure suit the whole animation: they do not follow the time."""
        end = self.file.duration(1)
        times = [end * k / 7 for k in range(8)]
        for camera in ({}, {"orbit": {"azimuth_deg": 40}}):
            seen = [self.record(self.id, {"animation": "grow", "time_s": t, "camera": camera,
                                          "technique": "none"}) for t in times]
            for one in seen[1:]:
                for key in ("camera", "lights", "exposure_ev", "sky_level"):
                    self.assertEqual(one[key], seen[0][key], key)
        lamp = [self.record(self.id, {"animation": "grow", "time_s": t, "lights": VIEW["lights"],
                                      "technique": "none"})["exposure_ev"] for t in times]
        self.assertEqual(len(set(lamp)), 1)

    def test_the_camera_frames_the_whole_animation(self):
        scene = self.d.upload(pose_files.skinned(11, 1, normals=False))
        end = self.file.duration(0)
        covered = set()
        for k in range(12):
            pixels = rgb(self.picture(scene, {
                "animation": "bend", "time_s": end * k / 11, "camera": {}, "lights": [],
                "technique": "none", "output": {"layer": "normal"}}))
            on = {i for i, p in enumerate(pixels) if p != BACKGROUND}
            self.assertTrue(on)
            border = [i for i in on if i % 160 in (0, 159) or i // 160 in (0, 119)]
            self.assertEqual(border, [], k)
            covered |= on
        rows, columns = {i // 160 for i in covered}, {i % 160 for i in covered}
        self.assertTrue(max(rows) - min(rows) > 95 or max(columns) - min(columns) > 128)

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
        self.assertEqual(self.picture(scene, {"technique": "hard"}).body, rest.body)

    def test_cameras_and_lights_move(self):
        """A camera and lights on animated nodes, with animated angles, colours and intensities, and
        what is hidden for a time, against a file in which they stand where they are then."""
        times = [0.0, 0.7, 2.0]
        keys = {("camera", "translation"): [[0, 2, 7], [3, 2, 6], [6, 3, 2]],
                ("lamp", "rotation"): [[0, 0, 0, 1], [0.3, 0, 0, 1], [-0.5, 0.2, 0, 1]],
                ("lamp", "translation"): [[0, 4, 2], [1, 4, 2], [0, 5, 0]],
                ("sun", "rotation"): [[-0.5, 0, 0, 1], [-0.5, 0.5, 0, 1], [-0.5, -0.5, 0, 1]]}
        pointers = {"/extensions/KHR_lights_punctual/lights/0/intensity": [2000, 5000, 800],
                    "/extensions/KHR_lights_punctual/lights/0/color":
                        [[1, 1, 1], [1, 0.2, 0.1], [0.1, 0.2, 1]],
                    "/extensions/KHR_lights_punctual/lights/0/spot/outerConeAngle": [0.9, 0.5, 1.2],
                    "/cameras/0/perspective/yfov": [0.8, 0.6, 1.0],
                    "/materials/0/pbrMetallicRoughness/baseColorFactor":
                        [[1, 1, 1, 1], [1, 0, 0, 1], [0, 1, 0, 1]],
                    "/materials/0/pbrMetallicRoughness/roughnessFactor": [0.3, 0.6, 0.2],
                    "/materials/0/extensions/KHR_materials_ior/ior": [1.5, 2.5, 1.2],
                    "/materials/0/extensions/KHR_materials_specular/specularColorFactor":
                        [[1, 1, 1], [0, 1, 0.5], [1, 0, 1]]}

        def lerp(values, time):
            k = 0 if time < times[1] else 1
            u = min((time - times[k]) / (times[k + 1] - times[k]), 1)
            if not isinstance(values[0], list):
                return (1 - u) * values[k] + u * values[k + 1]
            return [(1 - u) * a + u * b for a, b in zip(values[k], values[k + 1])]

        def scene(time=None):
            b = pose_files.Builder()
            box = [[x, y, z] for x in (-1, 1) for y in (0, 2) for z in (-1, 1)]
            faces = [0, 1, 3, 0, 3, 2, 4, 6, 7, 4, 7, 5, 0, 4, 5, 0, 5, 1, 2, 3, 7, 2, 7, 6,
                     0, 2, 6, 0, 6, 4, 1, 5, 7, 1, 7, 3]
            floor = [[-9, 0, -9], [-9, 0, 9], [9, 0, 9], [-9, 0, -9], [9, 0, 9], [9, 0, -9]]
            still = time is not None
            get = lambda pointer, rest: lerp(pointers[pointer], time) if still else rest
            light = "/extensions/KHR_lights_punctual/lights/0/"
            b.json["extensionsUsed"] = ["KHR_lights_punctual", "KHR_animation_pointer",
                                        "KHR_node_visibility", "KHR_materials_ior",
                                        "KHR_materials_specular"]
            b.json["materials"] = [{"pbrMetallicRoughness": {
                "metallicFactor": 0,
                "roughnessFactor": get("/materials/0/pbrMetallicRoughness/roughnessFactor", 1),
                "baseColorFactor": get("/materials/0/pbrMetallicRoughness/baseColorFactor",
                                       [1, 1, 1, 1])}, "extensions": {
                "KHR_materials_ior": {"ior": get("/materials/0/extensions/KHR_materials_ior/ior",
                                                 1.5)},
                "KHR_materials_specular": {"specularColorFactor": get(
                    "/materials/0/extensions/KHR_materials_specular/specularColorFactor",
                    [1, 1, 1])}}}]
            b.json["extensions"] = {"KHR_lights_punctual": {"lights": [
                {"type": "spot", "intensity": get(light + "intensity", 100),
                 "color": get(light + "color", [1, 1, 1]), "spot": {
                     "innerConeAngle": 0.1,
                     "outerConeAngle": get(light + "spot/outerConeAngle", 0.7)}},
                {"type": "directional", "intensity": 300}]}}
            b.json["cameras"] = [{"type": "perspective", "perspective": {
                "yfov": get("/cameras/0/perspective/yfov", 0.7), "znear": 0.1}}]
            for points in ([box[i] for i in faces], floor):
                b.json["meshes"].append({"primitives": [{"material": 0, "attributes": {
                    "POSITION": b.floats("VEC3", points)}}]})
            names = {}
            for name, node in (("box", {"mesh": 0}), ("floor", {"mesh": 1}), ("other", {"mesh": 0}),
                               ("camera", {"camera": 0, "rotation": [-0.1, 0.2, 0, 0.97]}),
                               ("lamp", {"extensions": {"KHR_lights_punctual": {"light": 0}}}),
                               ("sun", {"extensions": {"KHR_lights_punctual": {"light": 1}}})):
                for (owner, path), values in keys.items():
                    if owner == name and still:
                        if path == "rotation":
                            b.animate("", [(0, "rotation", times, values, "LINEAR")])
                            values = evaluate(b, time)
                        else:
                            values = lerp(values, time)
                        node[path] = values
                if name == "other":
                    node["translation"] = [-3, 0, 0]
                    visible = not still or time < times[1]
                    node.setdefault("extensions", {})["KHR_node_visibility"] = {"visible": visible}
                names[name] = b.node(True, **node)
            b.json.pop("animations", None)
            if still:
                return b.glb()
            b.animate("fly", [(names[owner], path, times, values, "LINEAR")
                              for (owner, path), values in keys.items()])
            a = b.json["animations"][0]
            visible = b.accessor("SCALAR", 5121, "B", [[1], [0], [0]])
            for pointer, output in [(p, None) for p in pointers] + [
                    ("/nodes/%d/extensions/KHR_node_visibility/visible" % names["other"], visible)]:
                if output is None:
                    values = pointers[pointer]
                    rows = [v if isinstance(v, list) else [v] for v in values]
                    output = b.floats({1: "SCALAR", 3: "VEC3", 4: "VEC4"}[len(rows[0])], rows)
                a["samplers"].append({"input": b.floats("SCALAR", [[t] for t in times]),
                                      "output": output, "interpolation":
                                      "STEP" if output == visible else "LINEAR"})
                a["channels"].append({"sampler": len(a["samplers"]) - 1, "target": {
                    "path": "pointer", "extensions": {"KHR_animation_pointer": {
                        "pointer": pointer}}}})
            return b.glb()

        def evaluate(b, time):
            """The rotation of the one channel of a file in the making."""
            data = b.glb()
            b.json["animations"] = []
            path = os.path.join(self.folder.name, "part.glb")
            with open(path, "wb") as file:
                file.write(data)
            file = gltf_pose.File(path)
            return file.sample(file.animations[0]["samplers"][0], time, "rotation")

        moving = self.d.upload(scene())
        self.assertEqual(self.d.get("/v1/scenes/" + moving).json()["warnings"], [])
        exposures = set()
        for time in (0.3, 1.1, 2.0, 0.3):
            other = self.d.upload(scene(time))
            view = {"camera": {"index": 0}, "technique": "hard"}
            view = {**{k: v for k, v in VIEW.items() if k != "lights"}, **view}
            mine = self.d.render(moving, {**view, "animation": "fly", "time_s": time})
            theirs = self.d.render(other, view)
            self.assertEqual((mine.status, theirs.status), (200, 200), mine.body[:300])
            self.assertLessEqual(off_by_more_than(rgb(mine), rgb(theirs), 8), 2, time)
            exposures.add(self.record(moving, {"animation": "fly", "time_s": time,
                                               "technique": "none"})["exposure_ev"])
        self.assertEqual(len(exposures), 1)

    def test_poses_do_not_mix(self):
        """Asked for at the same time, poses of one scene are what they are alone."""
        end = self.file.duration(0)
        asked = [{"animation": "bend", "time_s": end * k / 5, "technique": t} for k in range(6)
                 for t in ("pcss", "raytraced")]
        alone = [self.picture(self.id, one).body for one in asked]
        found = {}

        def ask(first):
            for k in range(first, len(asked), 4):
                found[k] = self.picture(self.id, asked[k]).body

        threads = [threading.Thread(target=ask, args=(i,)) for i in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        for k, body in enumerate(alone):
            self.assertEqual(found[k], body, asked[k])

    def test_times(self):
        """Held at both ends; no time is infinite, negative or not a number."""
        end = self.file.duration(0)
        last = self.picture(self.id, {"animation": "bend", "time_s": end, "technique": "hard"})
        for later in (end + 0.5, 2 * end, 1e6):
            self.assertEqual(self.picture(self.id, {"animation": "bend", "time_s": later,
                                                    "technique": "hard"}).body, last.body)
        path = "/v1/scenes/%s/render" % self.id
        for wrong in ("-1", "nan", "inf", "1e999", "soon"):
            answer = self.d.call("GET", path + "?animation=bend&time_s=" + wrong)
            self.assertIn(answer.status, (400, 422), wrong)
            self.assertIn("time_s", answer.json()["detail"])
        for wrong in ("NaN", "Infinity", "-1", "1e999", '"soon"', "null"):
            answer = self.d.call("POST", path, '{"animation": "bend", "time_s": %s}' % wrong,
                                 {"Content-Type": "application/json"})
            self.assertIn(answer.status, (400, 422), wrong)


if __name__ == "__main__":
    harness.main()
