"""What is asked of the daemon. Each request is one that nothing kept can answer."""
import itertools
import json

from open_loop import http_request

SCENE_TRIANGLES = 8
numbers = itertools.count()


def view(dice):
    return {"width": 160, "height": 120,
            "camera": {"eye": [dice.uniform(1, 2), dice.uniform(1, 2), dice.uniform(1, 2)],
                       "target": [0, 0.4, 0]}}


class Mixes:
    def __init__(self, scene, make_scene, deadline_ms):
        """`make_scene(name)`: the bytes of a scene that is called so."""
        self.scene, self.make_scene, self.deadline_ms = scene, make_scene, deadline_ms

    def post(self, path, document):
        return http_request("POST", "/v1/scenes/%s/%s" % (self.scene, path),
                            json.dumps({**document, "deadline_ms": self.deadline_ms}).encode(),
                            Content_Type="application/json")

    def render(self, dice):
        return self.post("render", {**view(dice), "technique": "pcss"})

    def compare(self, dice):
        return self.post("compare", {**view(dice), "techniques": ["hard", "pcss"],
                                     "reference": {"name": "raytraced", "params": {"samples": 16}}})

    def upload(self, dice):
        body = self.make_scene("load %d %d" % (next(numbers), dice.getrandbits(60)))
        return http_request("POST", "/v1/scenes", body, Content_Type="model/gltf-binary")

    def mixed(self, dice):
        return dice.choices((self.render, self.compare, self.upload), (90, 5, 5))[0](dice)


NAMES = ("render", "compare", "upload", "mixed")
