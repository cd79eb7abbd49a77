"""The scenes of the claims bench and of the comparison of methods, and how they are looked at."""
import os

# Name: (what to load, settings of the view). A light that is not named is the automatic one, a
# square 0.6 radii of the scene wide.
BUNNY_LIGHT = ("light.type=rect&light.position=1.5,3,1&light.target=0,0,0&light.width=1"
               "&light.height=1")
BUNNY_VIEW = "camera.eye=2.2,1.6,2.6&camera.target=0,0.45,0&camera.fov_y_deg=45"
SHADOW_VIEW = "camera.eye=-1.6,1.1,-1.4&camera.target=-0.2,0.2,-0.1&camera.fov_y_deg=45"
MAIN = "camera.index=0"

SCENES = {
    "bunny": ("file", "stanford-bunny-on-plane", BUNNY_VIEW + "&" + BUNNY_LIGHT),
    "bunny-shadow": ("file", "stanford-bunny-on-plane", SHADOW_VIEW + "&" + BUNNY_LIGHT),
    "hotel-room": ("file", "hotel-room", ""),
    "garden": ("file", "japanese-bridge-garden", ""),
    "shader-ball": ("file", "shader-ball", ""),
    "demo": ("generated", "demo", MAIN),
    "half-plane": ("generated", "half-plane", MAIN),
    "stacked": ("generated", "stacked", MAIN),
    "foliage": ("generated", "foliage", MAIN),
    "hairball": ("generated", "hairball", MAIN),
    "columns": ("generated", "columns", MAIN),
}


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
