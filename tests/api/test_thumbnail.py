"""Pictures to be laid over something else: transparent backgrounds and shadow catchers."""
import os
import subprocess
import tempfile
import unittest

import harness
import pictures

CAMERA = {"eye": [1.6, 1.9, 2.6], "target": [0, -0.1, 0], "fov_y_deg": 45}
SUN = [{"type": "sun", "position": [-2, 2.5, 0.5], "target": [0, 0, 0], "irradiance": 3}]
REQUEST = {"width": 96, "height": 72, "camera": CAMERA, "lights": SUN, "technique": "hard",
           "exposure_ev": 0, "sky_level": 1}
LUMINANCE = (0.2126, 0.7152, 0.0722)


def linear(value):
    """IEC 61966-2-1."""
    return value / 12.92 if value <= 0.04045 else ((value + 0.055) / 1.055) ** 2.4


def encoded(value):
    return 12.92 * value if value <= 0.0031308 else 1.055 * value ** (1 / 2.4) - 0.055


class Thumbnail(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.d = harness.Daemon()
        cls.scene = cls.d.upload(pictures.mesh_scene(*pictures.box(), color=(0.7, 0.4, 0.2, 1)))

    @classmethod
    def tearDownClass(cls):
        assert cls.d.stop() == 0
        cls.d.kill()

    def picture(self, bits=8, **more):
        answer = self.d.render(self.scene, {**REQUEST, "output": {"bit_depth": bits}, **more})
        self.assertEqual(answer.status, 200, answer.body)
        top = 2.0 ** bits - 1
        return [tuple(v / top for v in pixel)
                for row in pictures.read_png(answer.body)[2] for pixel in row]

    def over(self, picture, background):
        """The picture laid over a colour, in linear light, as display values."""
        return [tuple(encoded(p[3] * linear(p[k]) + (1 - p[3]) * background[k]) for k in range(3))
                for p in picture]

    def same(self, a, b):
        self.assertEqual(len(a), len(b))
        worst = max(abs(p[k] - q[k]) for p, q in zip(a, b) for k in range(3))
        self.assertLessEqual(worst, 1 / 255)

    def test_over_any_colour(self):
        for more in ({}, {"antialias": 5}, {"ground": False, "antialias": 3},
                     {"ground": "shadow", "antialias": 4}, {"sky": False, "ambient": [0.1, 0.2, 0.3]}):
            clear = self.picture(16, background="transparent", **more)
            small = self.picture(8, background="transparent", **more)
            self.assertLessEqual(max(abs(p[3] - q[3]) for p, q in zip(clear, small)), 0.51 / 255)
            self.assertEqual((max(p[3] for p in clear), min(p[3] for p in clear)), (1, 0))
            for background in ([0.6, 0.2, 0.4], [0.02, 0.9, 0.3]):
                with self.subTest(more=more, background=background):
                    opaque = self.picture(background=background, **more)
                    self.assertEqual(len(opaque[0]), 3)
                    self.same(self.over(clear, background), opaque)

    def test_coverage_is_what_surfaces_cover(self):
        alpha = [p[3] for p in self.picture(background="transparent", ground=False, edges="none")]
        depth = self.picture(ground=False, output={"layer": "depth"})
        self.assertEqual([a == 1 for a in alpha], [d[0] < 1 for d in depth])
        fractions = {p[3] for p in self.picture(background="transparent", ground=False, antialias=4)}
        self.assertEqual({round(4 * a) / 4 for a in fractions}, {0, 0.25, 0.5, 0.75, 1})
        self.assertLess(max(abs(a - round(4 * a) / 4) for a in fractions), 0.51 / 255)

    def test_smooth_edges(self):
        """Alpha at the default is the covered share, colours those of the surface alone."""
        for more in ({"ground": False}, {"ground": "shadow"}):
            truth = self.picture(background="transparent", antialias=64, **more)
            stairs = self.picture(background="transparent", edges="none", **more)
            smooth = self.picture(background="transparent", **more)
            edge = [i for i, p in enumerate(truth) if more["ground"] is False and 0 < p[3] < 1]

            def error(picture, pixels):
                return (sum((picture[i][3] - truth[i][3]) ** 2 for i in pixels) / len(pixels)) ** 0.5
            if edge:
                self.assertGreater(len(edge), 50)
                self.assertLess(error(smooth, edge), 0.4 * error(stairs, edge))
            everywhere = range(len(truth))
            self.assertLess(error(smooth, everywhere), 0.6 * error(stairs, everywhere))
            for p in smooth:
                if p[3] > 0.1 and more["ground"] is False:
                    self.assertGreater(p[0], p[2])  # the box is brown, whatever is behind it

    def test_smooth_edges_leave_other_layers_alone(self):
        for layer in ("depth", "normal", "albedo", "visibility"):
            output = {"layer": layer}
            self.assertEqual(self.picture(output=output), self.picture(output=output, edges="none"))

    def test_smooth_edges_of_any_size(self):
        for width, height in ((1, 1), (1, 7), (3, 2), (97, 5)):
            for bits in (8, 16):
                self.assertEqual(
                    len(self.picture(bits, width=width, height=height)), width * height)

    def test_shadow_catcher(self):
        """Alpha is one minus what the shadow leaves of a white ground's light."""
        for lights in (SUN, [{"type": "rect", "position": [-2, 3, 0.5], "target": [0, 0, 0],
                              "power_w": 60, "texture": {"pattern": "checker"}}]):
            base = {"sky": False, "ambient": [0.2, 0.2, 0.2], "lights": lights, "bits": 16,
                    "edges": "none",
                    "technique": "multisample" if lights is not SUN else "hard"}
            white = {**base, "ground_albedo": [1, 1, 1], "exposure_ev": -2}
            caught = self.picture(**base, ground="shadow", background="transparent")
            shadow, clear = self.picture(**white), self.picture(**{**white, "technique": "none"})
            box = self.picture(background="transparent", ground=False, edges="none")
            compared = dark = 0
            for got, with_shadow, without, solid in zip(caught, shadow, clear, box):
                if solid[3] == 1:
                    self.assertEqual(got[3], 1)
                    continue
                self.assertEqual(got[:3], (0, 0, 0))
                a, b = (sum(w * linear(v) for w, v in zip(LUMINANCE, p)) for p in (with_shadow, without))
                if b > 0:
                    compared += 1
                    dark += got[3] > 0.1
                    # Far away it fades, and the white ground into black.
                    self.assertLess(abs(got[3] - (b - a) / max(b, 1e-6)), 0.01 if got[3] > 0 else 1)
            self.assertGreater(compared, 1000)
            self.assertGreater(dark, 50)

    def test_refusals_and_spellings(self):
        answer = self.d.render(self.scene, {"background": "transparent", "output": {"format": "jpeg"}})
        self.assertEqual((answer.status, answer.json()["pointer"]), (422, "/output/format"))
        self.assertIn("transparency", answer.json()["detail"])
        for wrong in ({"background": "clear"}, {"ground": "catcher"}, {"sky": "shadow"}):
            self.assertEqual(self.d.render(self.scene, wrong).status, 422)
        answer = self.d.get("/v1/scenes/%s/render?background=transparent&ground=shadow&width=64"
                            "&height=48&technique=hard" % self.scene)
        self.assertEqual(len(pictures.read_png(answer.body)[2][0][0]), 4)
        record = self.d.render(self.scene, {"background": "transparent", "ground": "shadow",
                                            "width": 64, "height": 48}, Accept="application/json")
        request = record.json()["request"]
        self.assertEqual((request["background"], request["ground"]), ("transparent", "shadow"))
        self.assertEqual(self.d.render(self.scene, request).status, 200)
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "x.png")
            subprocess.run([os.path.join(harness.BIN, "penumbra"), "render", self.scene, "-o", path,
                            "--server", "http://127.0.0.1:%d" % self.d.port, "--width", "64",
                            "--height", "48", "--background", "transparent", "--ground=shadow"],
                           check=True, stdout=subprocess.DEVNULL)
            with open(path, "rb") as file:
                self.assertEqual(len(pictures.read_png(file.read())[2][0][0]), 4)


if __name__ == "__main__":
    harness.main()
