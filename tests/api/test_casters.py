"""Which sides of a surface cast: `casters`, in maps and in both kinds of rays."""
import unittest

import harness
from harness import Daemon
from pictures import box, mesh_scene, rgb

METHODS = ({"name": "hard"}, {"name": "pcss"}, {"name": "multisample"},
           {"name": "raytraced", "params": {"backend": "gpu"}}, {"name": "raytraced"})
# Straight down on the middle of a floor.
REQUEST = {"width": 33, "height": 33, "ground": False, "output": {"layer": "visibility"},
           "camera": {"eye": [0, 3, 0], "target": [0, 0, 0], "up": [0, 0, -1], "fov_y_deg": 12}}
FLOOR = [[-2, 0, 2], [2, 0, 2], [2, 0, -2], [-2, 0, -2]]
UP = [[0, 1, 0]] * 4
QUAD = [0, 1, 2, 0, 2, 3]


def over_floor(points, normals, indices):
    return mesh_scene(FLOOR + points, UP + normals, QUAD + [i + 4 for i in indices])


class Casters(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.d = Daemon()

    @classmethod
    def tearDownClass(cls):
        assert cls.d.stop() == 0

    def mean(self, scene, technique, light, **more):
        answer = self.d.render(scene, {**REQUEST, "technique": technique, "lights": [light], **more},
                               timeout=300)
        self.assertEqual(answer.status, 200, answer.body[:300])
        pixels = rgb(answer)
        return sum(p[0] for p in pixels) / len(pixels)

    def test_card(self):
        sun = {"type": "sun", "position": [0, 10, 0], "target": [0, 0, 0]}
        card = [[x / 2, 0.5, z / 2] for x, _, z in FLOOR]
        away = QUAD[::-1]  # seen from below: the camera looks through its back
        scene = self.d.upload(over_floor(card, [[0, -1, 0]] * 4, away))
        for technique in METHODS:
            with self.subTest(technique=technique):
                self.assertLess(self.mean(scene, technique, sun), 1)
                self.assertGreater(self.mean(scene, technique, sun, casters="front"), 254)
                self.assertLess(self.mean(scene, technique, sun, casters="both"), 1)

    def test_light_in_a_closed_box(self):
        """Its faces turn outwards: to the light within they show their backs."""
        points, normals, indices = box((1, 0.5, 1), (0, 0.75, 0))
        light = {"type": "rect", "position": [0, 0.8, 0], "target": [0, 0, 0], "up": [0, 0, 1],
                 "width": 0.1, "height": 0.1}
        camera = {**REQUEST["camera"], "eye": [0, 0.4, 0]}
        boxed = self.d.upload(over_floor(points, normals, indices))
        alone = self.d.upload(mesh_scene(FLOOR, UP, QUAD))
        for technique in METHODS:
            with self.subTest(technique=technique):
                self.assertGreater(self.mean(alone, technique, light, camera=camera), 254)
                self.assertLess(self.mean(boxed, technique, light, camera=camera), 1)


if __name__ == "__main__":
    harness.main()
