"""The scenes of the claims bench and of the comparison of methods, and how they are looked at."""
import os

BUNNY_VIEW = "camera.eye=2.2,1.6,2.6&camera.target=0,0.45,0&camera.fov_y_deg=45"
SHADOW_VIEW = "camera.eye=-1.6,1.1,-1.4&camera.target=-0.2,0.2,-0.1&camera.fov_y_deg=45"
MAIN = "camera.index=0"

# Straight down on the receiver, from below both casters.
BELOW = ("ground=off&camera.eye=0,0.5,0&camera.target=0,0,0&camera.up=0,0,-1&camera.fov_y_deg=110")

# Name: (what to load, settings of the view).
SCENES = {
    "bunny": ("file", "stanford-bunny-on-plane", BUNNY_VIEW),
    "bunny-shadow": ("file", "stanford-bunny-on-plane", SHADOW_VIEW),
    "hotel-room": ("file", "hotel-room", ""),
    "garden": ("file", "japanese-bridge-garden", ""),
    "shader-ball": ("file", "shader-ball", ""),
    "demo": ("generated", "demo", MAIN),
    "half-plane": ("generated", "half-plane", BELOW),
    "stacked": ("generated", "stacked", BELOW),
    "foliage": ("generated", "foliage", MAIN),
    "hairball": ("generated", "hairball", MAIN),
    "columns": ("generated", "columns", MAIN),
}

# Lights whose size an experiment sets: position, target, side (m) and power (W). The power keeps
# pictures equally bright.
LIGHTS = {
    "bunny": ("1.5,3,1", "0,0,0", 1.0, 100),
    "bunny-shadow": ("1.5,3,1", "0,0,0", 1.0, 100),
    "demo": ("7.3,10.2,-2.7", "0,1.4,0", 2.9, 1300),
    "foliage": ("6.4,8.4,-2.4", "0,0.66,0", 2.6, 900),
    "hairball": ("2.7,4.3,-1.0", "0,1,0", 1.1, 180),
    "columns": ("6.6,9.2,-2.5", "0,1.2,0", 2.7, 1000),
    "stacked": ("0,3,0", "0,0,0", 1.0, 60),
    "half-plane": ("0,3,0", "0,0,0", 1.0, 60),
}


def light(scene, scale=1.0, kind="rect"):
    """Settings of the scene's light, `scale` times its usual size; a sphere has half the side."""
    position, target, side, power = LIGHTS[scene.split("@")[0]]
    size = ("&light.radius=%g" % (side / 2 * scale) if kind == "sphere"
            else "&light.width=%g&light.height=%g" % (side * scale, side * scale))
    up = "&light.up=0,0,-1" if position.startswith("0,") else ""
    return "light.type=%s&light.position=%s&light.target=%s&light.power_w=%g%s%s" % (
        kind, position, target, power, size, up)


class Scenes:
    """Writes the scene lines of a plan, each once. A name may carry a number of triangles:
    "hairball@2880000"."""

    def __init__(self, folder):
        self.folder = folder  # of imported .pscene files
        self.lines = {}

    def has(self, name):
        kind, source, _ = SCENES[name.split("@")[0]]
        return kind == "generated" or os.path.exists(self.path(source))

    def path(self, source):
        return os.path.join(self.folder, source + ".pscene")

    def use(self, name):
        """Registers the scene; the settings of its view."""
        base, _, triangles = name.partition("@")
        kind, source, view = SCENES[base]
        what = [self.path(source)] if kind == "file" else [source, triangles or "0"]
        self.lines[name] = "\t".join(["scene", name, kind] + what)
        return view
