"""What is measured for each paper: the groups of the plan, named as claims_table.py names them."""
from scenes import light

TRUTH = "technique=raytraced&seed=7&samples=%d"


class Scale:
    """How much of the papers' conditions a run keeps."""

    def __init__(self, mode):
        self.mode = mode
        self.repetitions = {"full": 9, "quick": 5, "tiny": 1}[mode]
        self.seconds = {"full": 45, "quick": 20, "tiny": 3}[mode]
        # 256 rays are within 0.003 (RMSE) of 1024, and the errors they are to judge are ten times
        # that; large pictures of fine geometry would take minutes with more.
        self.truth = TRUTH % {"full": 1024, "quick": 256, "tiny": 16}[mode]
        self.large_truth = TRUTH % {"full": 256, "quick": 64, "tiny": 16}[mode]

    def samples(self, count):
        """Of a method that draws a map for each: tiny runs take few."""
        return min(count, 16) if self.mode == "tiny" else count

    def size(self, width, height):
        divisor = {"full": 1, "quick": 2, "tiny": 10}[self.mode]
        return "width=%d&height=%d" % (width // divisor, height // divisor)

    def scene(self, name):
        """Quick and tiny runs take fewer triangles; tiny ones two that are made at once."""
        base, _, triangles = name.partition("@")
        if self.mode == "full" or not triangles:
            return name
        return "%s@%d" % (base, min(int(triangles), 150000))

    def scenes(self, plan, names):
        if self.mode == "tiny":
            names = ("half-plane",)
        return [self.scene(name) for name in names if plan.scenes.has(name)]


def add(plan, scale, prefix, scene, variants, settings, pairs=(), truth=None):
    plan.group("%s-%s" % (prefix, scene.partition("@")[0]), scene,
               {"reference": truth or scale.truth, **variants}, settings, scale.repetitions, scale.seconds,
               "p", pairs)


def chun(plan, scale):
    csm = "&map_size=1024&terms=8&taps=1&search_taps=1"
    published = "technique=adaptive&estimator=csm&theta=0.2244&blend=0" + csm + "&mode="
    for scene in scale.scenes(plan, ("bunny-shadow", "columns@270385", "foliage@211609")):
        add(plan, scale, "chun", scene, {
            "cssm": "technique=cssm" + csm,
            "adaptive": published + "adaptive",
            "fixed": published + "fixed2",
            "average": published + "average",
            "ours": "technique=adaptive",
        }, "%s&%s&light.texture.pattern=two-colour" % (scale.size(800, 800), light(scene)))


def cascaded(plan, scale):
    for scene in scale.scenes(plan, ("bunny", "bunny-shadow", "demo", "columns", "foliage")):
        add(plan, scale, "cascaded", scene, {
            "cascaded": "technique=cascaded",
            "cascaded-paper":
                "technique=cascaded&split=paper&weights=uniform&filter=texels",
            "bilateral": "technique=bilateral&samples=25&map_size=1024",
            "fassalss": "technique=adaptive-sampling&levels=2&map_size=1024",
            "fixed25": "technique=multisample&samples=25&map_size=1024",
            "fixed289": "technique=multisample&samples=%d&map_size=1024" % scale.samples(289),
            "pcss16": "technique=pcss&search_taps=16&filter_taps=16&map_size=1024&smooth=off",
        }, "%s&%s" % (scale.size(800, 600), light(scene)),
            pairs=(("cascaded", "bilateral"), ("cascaded", "fassalss"), ("cascaded", "pcss16"),
                   ("fassalss", "fixed289")))


def vssm(plan, scale):
    pcss = "technique=pcss&search_taps=64&filter_taps=256&smooth=off&map_size=1024&"
    sizes = {"narrow": 0.25, "wide": 1.0}
    methods = {"off": "technique=vssm&subdivide=off&map_size=1024&",
               "quadtree": "technique=vssm&subdivide=quadtree&map_size=1024&", "pcss": pcss}
    for scene in scale.scenes(plan, ("bunny-shadow", "demo", "columns")):
        add(plan, scale, "vssm-width", scene, {
            "%s-%s" % (method, size): settings + light(scene, factor)
            for method, settings in methods.items() for size, factor in sizes.items()
        }, "%s&classify=off&%s" % (scale.size(800, 600), light(scene)))
    add(plan, scale, "vssm-stacked", "stacked", {
        "off": "technique=vssm&subdivide=off&map_size=1024",
        "quadtree": "technique=vssm&subdivide=quadtree&map_size=1024",
        "pcss": "technique=pcss&map_size=1024",
    }, "%s&%s" % (scale.size(800, 600), light("stacked")))


def accumulation(plan, scale):
    paper = "technique=accumulation&map_size=512&mode=paper&kernel="
    for scene in scale.scenes(plan, ("bunny", "bunny-shadow", "demo", "columns")):
        for name, factor in (("", 1.0), ("quarter-", 0.25)):
            plan.group("accumulation-" + name + scene, scene, {
                "reference": "technique=multisample&map_size=1024&samples=64",
                "paper5": paper + "5&window=light",
                "paper10": paper + "10&window=light",
                "casters10": paper + "10&window=casters",
                "clipped": "technique=accumulation&map_size=512&mode=clipped",
                "pcss": "technique=pcss&map_size=512&search_taps=25&filter_taps=25&smooth=off",
            }, "%s&classify=off&%s" % (scale.size(800, 600), light(scene, factor, kind="sphere")),
                scale.repetitions, scale.seconds, "p")


def erosion(plan, scale):
    pcss = "technique=pcss&map_size=2048&filter_taps=32&smooth=off&search_taps="
    for scene in scale.scenes(plan, ("foliage@188000", "hairball@2880000", "columns@1080000")):
        for name, factor in (("small", 0.1), ("wide", 1.0)):
            add(plan, scale, "erosion-" + name, scene, {
                "erosion": "technique=erosion&variant=pcf&map_size=2048&filter_taps=32&smooth=off",
                "direct": "technique=erosion&variant=direct&map_size=2048",
                "pcss8": pcss + "8", "pcss32": pcss + "32", "pcss64": pcss + "64",
            }, "%s&classify=off&%s" % (scale.size(1920, 1080), light(scene, factor)),
                truth=scale.large_truth)


def relatives(plan, scale):
    for scene in scale.scenes(plan, ("foliage@50000",)):
        add(plan, scale, "backprojection", scene, {
            "backprojection": "technique=backprojection&map_size=512",
            "fixed1024": "technique=multisample&samples=%d&map_size=512" % scale.samples(1024),
        }, "%s&%s" % (scale.size(512, 512), light(scene)))


EXPERIMENTS = {"chun": chun, "cascaded": cascaded, "vssm": vssm, "accumulation": accumulation,
               "erosion": erosion, "relatives": relatives}
