"""Files that showed a fault, each with what must be seen, from a folder beside the checkout; and real
files, whose bounds were computed from the glTF specification alone. Skipped where the folder is not.

    test_cases.py [--without=CASE,CASE]    leaves out cases that are known to fail, and says so
"""
import json
import os
import sys
import unittest

import harness
from harness import Daemon
from pictures import off_by_more_than, rgb

SHARED = os.environ.get("PENUMBRA_SHARED") or os.path.join(
    os.path.dirname(os.path.abspath(__file__)), "../../../shared")
KINDS = {".glb": "model/gltf-binary", ".gltf": "model/gltf+json", ".zip": "application/zip"}
DEFAULT = {"width": 160, "height": 120}
BACKGROUND = (128, 128, 128)  # of the layer "normal"
# What a case may expect. How long a picture takes is a benchmark's matter, and said to be skipped.
EXPECTATIONS = frozenset("""status triangles warnings bounds tolerance same_picture_as request
    pixels_off_by_more_than_8 texture fraction_of_pixels_above_12 mean_of_the_lit_object methods visible
    detail_lists status_with_entry umbra_missing mean_of_picture mean_luminance_of_the_object
    pixels_above_60_inside_the_shadow time_ratio""".split())


def manifest(*folder):
    path = os.path.join(SHARED, *folder, "manifest.json")
    if not os.path.exists(path):
        return []
    with open(path, encoding="utf-8") as file:
        return json.load(file)


def compares(value, expected):
    """True when the value is what ">80", ">=1", "<0.1" or a plain value say."""
    if not isinstance(expected, str):
        return value == expected
    for sign, holds in ((">=", value.__ge__), ("<=", value.__le__), (">", value.__gt__),
                        ("<", value.__lt__)):
        if expected.startswith(sign):
            return holds(type(value)(float(expected[len(sign):].split()[0])))
    raise ValueError(expected)


class Cases(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.d = Daemon()
        cls.methods = [t["name"] for t in cls.d.get("/v1/techniques").json()["techniques"]]

    @classmethod
    def tearDownClass(cls):
        assert cls.d.stop(timeout=120) == 0

    def post(self, folder, name, query=""):
        with open(os.path.join(SHARED, *folder, name), "rb") as file:
            return self.d.call("POST", "/v1/scenes" + query, file.read(),
                               {"Content-Type": KINDS[os.path.splitext(name)[1]]}, timeout=300)

    def picture(self, scene, request, **more):
        answer = self.d.render(scene, {**request, **more, "deadline_ms": 3600000}, timeout=3600)
        self.assertEqual(answer.status, 200, answer.body[:300])
        return rgb(answer)

    def check_bounds(self, info, bounds, tolerance):
        for end in ("min", "max"):
            for got, expected in zip(info["bounds"][end], bounds[end]):
                self.assertAlmostEqual(got, expected, delta=tolerance, msg=str(info["bounds"]))

    def check_answer(self, folder, name, expect):
        answer = self.post(folder, name)
        self.assertIn(answer.status, (expect.get("status", 201), 200 if "status" not in expect or
                                      expect["status"] == 201 else None), answer.body[:400])
        info = answer.json()
        for word in expect.get("detail_lists", []):
            self.assertIn(word, info["detail"])
        if "status_with_entry" in expect:
            for entry in expect["detail_lists"]:
                again = self.post(folder, name, "?entry=" + entry)
                self.assertIn(again.status, (expect["status_with_entry"], 200), again.body[:300])
        if answer.status >= 400:
            return None
        if "triangles" in expect:
            self.assertTrue(compares(info["triangles"], expect["triangles"]), info["triangles"])
        if "warnings" in expect:
            self.assertTrue(compares(len(info["warnings"]), expect["warnings"]), info["warnings"])
        if "bounds" in expect:
            self.check_bounds(info, expect["bounds"], expect["tolerance"])
        return info["id"]

    def surface(self, scene, request):
        return [n != BACKGROUND for n in self.picture(scene, {
            **request, "ground": False, "output": {"layer": "normal"}})]

    def check_default_picture(self, scene, expect):
        object_pixels = self.surface(scene, DEFAULT)
        beauty = self.picture(scene, DEFAULT, ground=False)
        shown = [p for p, on in zip(beauty, object_pixels) if on]
        if expect.get("texture") == "red":
            # Of the faces; along the silhouette smooth edges show what is behind, too.
            w = DEFAULT["width"]
            faces = [p for i, p in enumerate(beauty)
                     if all(object_pixels[k] for k in (i - w - 1, i - w, i - w + 1, i - 1, i, i + 1,
                                                       i + w - 1, i + w, i + w + 1)
                            if 0 <= k < len(beauty))]
            self.assertTrue(len(faces) > len(shown) / 2)
            self.assertTrue(all(r > 60 and r > 3 * g and r > 3 * b for r, g, b in faces))
        if expect.get("visible"):
            self.assertGreater(len(shown), 10)
        if "mean_luminance_of_the_object" in expect:
            mean = sum(0.2126 * r + 0.7152 * g + 0.0722 * b for r, g, b in shown) / len(shown)
            self.assertTrue(compares(mean, expect["mean_luminance_of_the_object"]), mean)
        if "mean_of_the_lit_object" in expect:
            lit = self.picture(scene, DEFAULT, ground=False, output={"layer": "visibility"})
            reached = [sum(p) / 3 for p, v, on in zip(beauty, lit, object_pixels)
                       if on and v[0] > 128]
            low, high = expect["mean_of_the_lit_object"]
            mean = sum(reached) / len(reached)
            self.assertTrue(low <= mean <= high, mean)

    def check_visibility(self, scene, expect):
        request = expect["request"]
        listed = expect["methods"] if isinstance(expect["methods"], list) else self.methods
        methods = [m for m in listed if m in self.methods]
        if methods != listed:
            print("\n  not among the methods: " + ", ".join(set(listed) - set(methods)))
        truth = self.picture(scene, request, technique={"name": "raytraced"})
        # What a published method cannot do it says; the baseline draws no shadow by definition.
        for method in methods:
            if method == "none":
                continue
            with self.subTest(method=method):
                answer = self.d.render(scene, {**request, "technique": {"name": method},
                                               "deadline_ms": 3600000}, timeout=3600)
                seen = [p[0] for p in rgb(answer)]
                warned = "leak" in (answer.headers.get("X-Penumbra-Warning") or "")
                if "fraction_of_pixels_above_12" in expect and not warned:
                    share = sum(v > 12 for v in seen) / len(seen)
                    self.assertLessEqual(share, expect["fraction_of_pixels_above_12"])
                if "umbra_missing" in expect and not warned:
                    umbra = [v for v, t in zip(seen, truth) if t[0] < 20]
                    lost = sum(v >= 128 for v in umbra) / max(len(umbra), 1)
                    self.assertGreater(len(umbra), 100)
                    self.assertLessEqual(lost, expect["umbra_missing"])
                if "mean_of_picture" in expect:
                    mean = sum(seen) / len(seen) / 255
                    self.assertTrue(compares(mean, expect["mean_of_picture"]), mean)
                if "pixels_above_60_inside_the_shadow" in expect:
                    self.assertLessEqual(self.lit_inside(seen, truth, request["width"]),
                                         expect["pixels_above_60_inside_the_shadow"])

    @staticmethod
    def lit_inside(seen, truth, width):
        """Lit pixels whose whole neighbourhood of 7 x 7 is dark in the truth, but for lines in it: at
        least nine tenths of it."""
        dark = [t[0] < 20 for t in truth]
        height, found = len(seen) // width, 0
        for at, value in enumerate(seen):
            y, x = divmod(at, width)
            if value <= 60 or not (3 <= x < width - 3 and 3 <= y < height - 3):
                continue
            near = sum(dark[(y + j) * width + x - 3 + i] for j in range(-3, 4) for i in range(7))
            found += near >= 44
        return found

    def check_case(self, case):
        expect = case["expect"]
        self.assertLessEqual(set(expect), EXPECTATIONS)
        scene = self.check_answer(("cases",), case["file"], expect)
        if "same_picture_as" in expect:
            other = self.check_answer(("cases",), expect["same_picture_as"], {})
            pictures = [self.picture(s, expect["request"]) for s in (scene, other)]
            self.assertLessEqual(off_by_more_than(*pictures, 8), expect["pixels_off_by_more_than_8"])
        elif "methods" in expect:
            self.check_visibility(scene, expect)
        elif scene and any(key in expect for key in (
                "texture", "visible", "mean_of_the_lit_object", "mean_luminance_of_the_object")):
            self.check_default_picture(scene, expect)
        if "time_ratio" in expect:
            self.skipTest("drawn; its time is not measured here")

    def check_real(self, file):
        answer = self.post(("scenes", "real"), file["file"])
        self.assertIn(answer.status, (200, 201), answer.body[:400])
        info = answer.json()
        if "bounds_at_rest" in file:
            self.check_bounds(info, file["bounds_at_rest"], file["tolerance"])
        self.assertTrue(any(self.surface(info["id"], DEFAULT)))
        self.picture(info["id"], DEFAULT)


def add(prefix, entry, check):
    name = "test_%s_%s" % (prefix, entry["file"].replace("-", "_").replace(".", "_"))
    setattr(Cases, name, lambda self: check(self, entry))


left_out = [name for flag in sys.argv[1:] if flag.startswith("--without=")
            for name in flag.split("=")[1].split(",")]
sys.argv = [flag for flag in sys.argv if not flag.startswith("--without=")]
for one in manifest("cases"):
    if os.path.splitext(one["file"])[0] not in left_out:
        add("case", one, Cases.check_case)
for one in manifest("scenes", "real"):
    add("real", one, Cases.check_real)

if __name__ == "__main__":
    if not manifest("cases"):
        print("skipped: there is no folder shared beside the checkout, nor at PENUMBRA_SHARED")
        sys.exit(77)
    if left_out:
        print("left out, known to fail: " + ", ".join(left_out))
    harness.main()
