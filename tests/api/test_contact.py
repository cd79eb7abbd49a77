"""Where surfaces touch, rays leave no lit seams."""
import math
import unittest

import harness
from harness import Daemon
from pictures import mesh_scene, rgb

WIDTH, HEIGHT = 640, 480


def wall_on_floor(turn):
    """A wall without thickness on a floor, turned about the vertical."""
    c, s = math.cos(turn), math.sin(turn)
    points = [[-4, 0, 4], [4, 0, 4], [4, 0, -4], [-4, 0, -4], [-4, 0, 0], [4, 0, 0], [4, 2, 0],
              [-4, 2, 0]]
    normals = [[0, 1, 0]] * 4 + [[s, 0, c]] * 4
    return mesh_scene([[c * x + s * z, y, c * z - s * x] for x, y, z in points], normals,
                      [0, 1, 2, 0, 2, 3, 4, 5, 6, 4, 6, 7], material={"doubleSided": True})


class Contact(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.d = Daemon()

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


if __name__ == "__main__":
    harness.main()
