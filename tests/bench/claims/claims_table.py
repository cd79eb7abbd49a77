"""The claims on trial: what each paper says, what we measure instead, and which values count as
reproduced or partly so. Thresholds were set from the papers' figures alone, before any of our own
figures was seen, with room for what a different machine changes in a ratio.

A verdict is given per scene from the median over rounds. The claim is "reproduced" when it is on
every scene, "refuted" when on none it is at least partly, else "partly".
"""
from bench import FRAME, METHOD, comparison, ratios, variant

INFINITE = float("inf")
TECHNIQUE = ("technique",)


def at_least(good, fair):
    return (good, INFINITE), (fair, INFINITE)


def at_most(good, fair):
    return (-INFINITE, good), (-INFINITE, fair)


def within(good, fair):
    return good, fair


def slower(numerator, denominator, stages=FRAME):
    """Time of one over that of the other, per round."""
    return lambda group: ratios(group, numerator, denominator, stages)


def saved(ours, theirs):
    return lambda group: [1 - ratio for ratio in ratios(group, ours, theirs)]


def error(key, test, reference="reference"):
    def value(group):
        found = comparison(group, test, reference)
        return [found[key]] if found and found.get(key) is not None else []
    return value


def error_ratio(key, numerator, denominator):
    def value(group):
        a, b = comparison(group, numerator), comparison(group, denominator)
        return [a[key] / b[key]] if a and b and b[key] else []
    return value


def distance_ratio(numerator, denominator):
    """Of what the SSIM lacks of 1."""
    def value(group):
        a, b = comparison(group, numerator), comparison(group, denominator)
        return [(1 - a["ssim"]) / (1 - b["ssim"])] if a and b and b["ssim"] < 1 else []
    return value


def between(key, first, second):
    """Ratio of the errors of two comparisons: pairs of variants."""
    def value(group):
        a, b = comparison(group, *first), comparison(group, *second)
        return [a[key] / b[key]] if a and b and b[key] else []
    return value


def subdivided(name):
    def value(group):
        found = variant(group, name)
        counts = found and found.get("subdivided_pixels")
        return [sum(counts) / (group["width"] * group["height"])] if counts else []
    return value


def pass_share(name, wanted):
    """Share of the passes that hold one of `wanted` ("stage:pass") in the whole shadow and its
    shading."""
    def value(group):
        found = variant(group, name)
        passes = found["moving"]["passes"] if found and found.get("moving") else []
        times = [(entry["stage"] + ":" + entry["name"], entry["ms"]) for entry in passes
                 if entry["stage"] in METHOD + ("shade",)]
        total = sum(ms for _, ms in times)
        return [sum(ms for label, ms in times if any(part in label for part in wanted)) / total] \
            if total else []
    return value


def claim(key, group, text, theirs, quantity, value, limits, needs, unit="", pair=()):
    """group: prefix of the measured groups; needs: variants that must exist; pair: two variants
    whose pictures show it best."""
    good, fair = limits
    return {"key": key, "group": group, "text": text, "theirs": theirs, "quantity": quantity,
            "value": value, "good": good, "fair": fair, "needs": needs, "unit": unit,
            "pair": pair}


PAPERS = [
    {
        "key": "chun",
        "title": "Chun & Oh 2016, An efficient soft shadow mapping for area lights in various "
                 "shapes and colors",
        "conditions": "Paper: 800 x 800, bunny of 69,451 triangles on a plane, reading room of "
                      "270,385, chariot and trees of 211,609; GeForce GTX 460. Map size, number of "
                      "terms, light size and depth range are not stated. Here: the same picture "
                      "size and triangles (columns and foliage of ours for the last two), 1024 x "
                      "1024 maps, 8 terms, one lookup per filter, theta 0.2244, a light of two "
                      "colours, shadow inputs made anew for every image as in an animated scene.",
        "claims": [
            claim("adaptive-cost", "chun", "Adaptive subdivision runs at 40 fps where convolution "
                  "soft shadow maps run at 50.", "0.80", "frame rate, adaptive over CSSM",
                  slower("cssm", "adaptive"), at_least(0.7, 0.5), ("cssm", "adaptive"),
                  pair=("cssm", "adaptive")),
            claim("fixed-cost", "chun", "Fixed subdivision into 16 runs at 30 fps where convolution "
                  "soft shadow maps run at 50.", "0.60", "frame rate, fixed over CSSM",
                  slower("cssm", "fixed"), within((0.45, 0.8), (0.3, 0.95)), ("cssm", "fixed")),
            claim("adaptive-fixed", "chun", "Adaptive subdivision is a third faster than the fixed "
                  "one (40 against 30 fps; 46 against 36 in the reading room).", "1.28 to 1.33",
                  "frame rate, adaptive over fixed", slower("fixed", "adaptive"),
                  at_least(1.15, 1.02), ("adaptive", "fixed"), pair=("fixed", "adaptive")),
            claim("share", "chun", "Few pixels need it: 4.59 % of all are subdivided (1.73 % once, "
                  "2.86 % twice).", "0.046; 0.03 to 0.08", "share of pixels subdivided",
                  subdivided("adaptive"), within((0.03, 0.08), (0.01, 0.15)), ("adaptive",)),
            claim("colours", "chun", "Subdivision gives the penumbra of a coloured light its "
                  "colours, where one average over the filter fails.", "visual",
                  "colour error in the penumbra, average over fixed subdivision",
                  error_ratio("colour_penumbra_rmse", "average", "fixed"), at_least(2, 1.2),
                  ("average", "fixed"), pair=("average", "fixed")),
            claim("colours-adaptive", "chun", "The adaptive choice keeps that quality.", "visual",
                  "colour error in the penumbra, average over adaptive",
                  error_ratio("colour_penumbra_rmse", "average", "adaptive"), at_least(2, 1.2),
                  ("average", "adaptive"), pair=("average", "adaptive")),
            claim("colours-ours", "chun", "Extension: the same subdivision with depth comparisons "
                  "in the cells and a threshold made for coloured lights.", "-",
                  "colour error in the penumbra, average over ours",
                  error_ratio("colour_penumbra_rmse", "average", "ours"), at_least(2, 1.2),
                  ("average", "ours"), pair=("ours", "reference")),
        ],
    },
    {
        "key": "cascaded",
        "title": "Cascaded soft shadow maps, 2023",
        "conditions": "Paper: 800 x 600, 16, 9 and 4 light samples in three cascades against SBFS "
                      "(bilateral filtering of 25 maps) and FASSALSS (adaptive light sampling) at 25 "
                      "maps; truth of 256 maps; GeForce GTX 1070. Map sizes, light sizes and the "
                      "scale of the RMSE are not stated; here 1024, 512 and 128 (the author's "
                      "thesis) against 1024, and display values in [0, 1]. \"44 to 51 % faster\" is "
                      "read as time saved. Truth: ray traced. Shadow inputs are made anew for every "
                      "image.",
        "claims": [
            claim("time-saved", "cascaded", "A gain of 44 to 51 % for each frame over filtering 25 "
                  "maps.", "0.44 to 0.51", "time saved against bilateral",
                  saved("cascaded", "bilateral"), at_least(0.4, 0.2), ("cascaded", "bilateral"),
                  pair=("cascaded", "bilateral")),
            claim("rmse", "cascaded", "Its pictures differ from those of SBFS by an RMSE below "
                  "0.01.", "< 0.01", "image RMSE, cascaded from bilateral",
                  error("image_rmse", "cascaded", "bilateral"), at_most(0.01, 0.02),
                  ("cascaded", "bilateral")),
            claim("twice-sbfs", "cascaded", "Approximately twice as fast as SBFS at 25 maps.", "2",
                  "time of bilateral over cascaded", slower("bilateral", "cascaded"),
                  at_least(1.7, 1.2), ("cascaded", "bilateral")),
            claim("twice-fassalss", "cascaded", "Approximately twice as fast as FASSALSS at 25 "
                  "maps.", "2", "time of adaptive-sampling over cascaded",
                  slower("fassalss", "cascaded"), at_least(1.7, 1.2), ("cascaded", "fassalss"),
                  pair=("cascaded", "fassalss")),
            claim("ssim", "cascaded", "SSIM near 1 against the truth of 256 maps.", "about 1",
                  "SSIM of cascaded", error("ssim", "cascaded"), at_least(0.98, 0.95),
                  ("cascaded",), pair=("cascaded", "reference")),
            claim("better-sbfs", "cascaded", "Smoothing makes SBFS err more against the truth.",
                  "> 1", "image RMSE against the truth, bilateral over cascaded",
                  error_ratio("image_rmse", "bilateral", "cascaded"), at_least(1, 0.8),
                  ("cascaded", "bilateral")),
            claim("better-pcss", "cascaded", "PCSS with 16 samples errs more against the truth.",
                  "> 1", "image RMSE against the truth, PCSS over cascaded",
                  error_ratio("image_rmse", "pcss16", "cascaded"), at_least(1, 0.8),
                  ("cascaded", "pcss16"), pair=("cascaded", "pcss16")),
            claim("ssim-sbfs", "cascaded", "Its pictures have an SSIM close to 1 with those of SBFS.",
                  "about 1", "SSIM of cascaded with bilateral",
                  error("ssim", "cascaded", "bilateral"), at_least(0.98, 0.95),
                  ("cascaded", "bilateral")),
            claim("ssim-better-sbfs", "cascaded", "Its SSIM with the truth is nearer to 1 than that "
                  "of SBFS.", "> 1", "1 - SSIM with the truth, bilateral over cascaded",
                  distance_ratio("bilateral", "cascaded"), at_least(1, 0.8),
                  ("cascaded", "bilateral")),
            claim("ssim-better-pcss", "cascaded", "Its SSIM with the truth is nearer to 1 than that "
                  "of PCSS with 16 samples.", "> 1", "1 - SSIM with the truth, PCSS over cascaded",
                  distance_ratio("pcss16", "cascaded"), at_least(1, 0.8), ("cascaded", "pcss16")),
            claim("fassalss-quality", "cascaded", "RMSE and SSIM comparable to those of FASSALSS.",
                  "about 1", "image RMSE against the truth, cascaded over adaptive-sampling",
                  error_ratio("image_rmse", "cascaded", "fassalss"), at_most(1.25, 2),
                  ("cascaded", "fassalss")),
            claim("pcss-farther", "cascaded", "Its pictures are more like those of SBFS than like "
                  "those of PCSS.", "> 1", "image RMSE from cascaded, PCSS over bilateral",
                  between("image_rmse", ("cascaded", "pcss16"), ("cascaded", "bilateral")),
                  at_least(1, 0.8), ("cascaded", "bilateral", "pcss16")),
            claim("paper-splits", "cascaded", "The same with split planes as the paper prints them, "
                  "corner samples and filters in texels.", "about 1", "SSIM of cascaded as printed",
                  error("ssim", "cascaded-paper"), at_least(0.98, 0.95), ("cascaded-paper",),
                  pair=("cascaded-paper", "cascaded")),
        ],
    },
    {
        "key": "vssm",
        "title": "Variance soft shadow mapping (Yang et al. 2010; the 2022 report)",
        "conditions": "Paper: more than 100 fps, at least ten times faster than PCSS for large "
                      "penumbrae; its PCSS compares every texel of the window or takes hundreds of "
                      "samples (the number is not stated). Here: 800 x 600, 1024 x 1024 map, a light "
                      "of a quarter of its usual size and four times that against PCSS with 64 "
                      "search and 256 filter taps, without averaging between pixels. Both skip "
                      "receivers that a min-max pyramid proves lit, which helps PCSS more. The time "
                      "is that of the shadow inputs and the method's passes.",
        "claims": [
            claim("width", "vssm-width", "The cost does not depend on the width of the penumbra "
                  "(one window, without subdivision).", "1", "time of the lookup, light of 1 over "
                  "0.25", slower("off-wide", "off-narrow", TECHNIQUE), at_most(1.15, 1.5),
                  ("off-wide", "off-narrow"), pair=("off-narrow", "off-wide")),
            claim("width-quadtree", "vssm-width", "The same with windows subdivided where they are "
                  "not planar.", "about 1", "time of the lookup, light of 1 over 0.25",
                  slower("quadtree-wide", "quadtree-narrow", TECHNIQUE), at_most(1.15, 1.5),
                  ("quadtree-wide", "quadtree-narrow"), pair=("quadtree-wide", "reference")),
            claim("ten", "vssm-width", "At least ten times faster than PCSS at wide penumbrae.",
                  ">= 10", "time of PCSS over VSSM, light of 1",
                  slower("pcss-wide", "off-wide", METHOD), at_least(8, 3), ("pcss-wide", "off-wide"),
                  pair=("off-wide", "pcss-wide")),
            claim("ten-quadtree", "vssm-width", "The same with subdivision.", ">= 10",
                  "time of PCSS over VSSM, light of 1",
                  slower("pcss-wide", "quadtree-wide", METHOD), at_least(8, 3),
                  ("pcss-wide", "quadtree-wide")),
            claim("ten-lookup", "vssm-width", "The same for the lookups alone (a still scene: map "
                  "and table are kept).", ">= 10", "time of the passes of PCSS over VSSM, light of "
                  "1", slower("pcss-wide", "off-wide", TECHNIQUE), at_least(8, 3),
                  ("pcss-wide", "off-wide")),
            claim("leaks", "vssm-stacked", "Light leaks where casters lie behind one another.",
                  "visible", "mean visibility where there is none",
                  error("umbra_mean", "off"), at_least(0.02, 0.005), ("off",),
                  pair=("off", "reference")),
            claim("leaks-quadtree", "vssm-stacked", "Subdivision takes the leaks away.",
                  "few", "mean visibility where there is none",
                  error("umbra_mean", "quadtree"), at_most(0.005, 0.02), ("quadtree",),
                  pair=("quadtree", "off")),
        ],
    },
    {
        "key": "accumulation",
        "title": "Aszodi & Szirmay-Kalos 2006, Real-time soft shadows with shadow accumulation",
        "conditions": "Paper: 512 x 512 map, kernels of 5 and 10 lexels, spherical light, reference "
                      "of 64 light samples, GeForce 7800 GT. Picture size, scene and the taps of its "
                      "PCSS are not stated. Here: 800 x 600, the same map and kernels, a sphere, "
                      "PCSS with 25 + 25 taps (twice the lookups of kernel 5), a light of the usual "
                      "size and one of a quarter of it. Both skip receivers that a min-max pyramid "
                      "proves lit.",
        "claims": [
            claim("nearer-10", "accumulation", "Nearer to the 64-sample reference than PCSS, as "
                  "published (kernel 10).", "> 1", "visibility RMSE, PCSS over accumulation",
                  error_ratio("rmse", "pcss", "paper10"), at_least(1.1, 0.9), ("pcss", "paper10"),
                  pair=("paper10", "pcss")),
            claim("nearer-5", "accumulation", "The same with kernel 5.", "> 1",
                  "visibility RMSE, PCSS over accumulation",
                  error_ratio("rmse", "pcss", "paper5"), at_least(1.1, 0.9), ("pcss", "paper5"),
                  pair=("paper5", "reference")),
            claim("nearer-casters", "accumulation", "The same with the kernel laid over the part of "
                  "the light that casters can hide.", "> 1",
                  "visibility RMSE, PCSS over accumulation",
                  error_ratio("rmse", "pcss", "casters10"), at_least(1.1, 0.9),
                  ("pcss", "casters10"), pair=("casters10", "pcss")),
            claim("nearer-clipped", "accumulation", "Extension: every texel clipped against the "
                  "light instead of a kernel.", "-", "visibility RMSE, PCSS over accumulation",
                  error_ratio("rmse", "pcss", "clipped"), at_least(1.1, 0.9), ("pcss", "clipped"),
                  pair=("clipped", "reference")),
            claim("any-size", "accumulation", "A kernel of 10 is good for every light size.", "good",
                  "visibility RMSE in the penumbra, kernel 10", error("penumbra_rmse", "paper10"),
                  at_most(0.05, 0.1), ("paper10",), pair=("paper10", "reference")),
            claim("faster-5", "accumulation", "Faster than PCSS (kernel 5).", "> 1",
                  "time of the passes, PCSS over accumulation", slower("pcss", "paper5", TECHNIQUE),
                  at_least(1.1, 0.9), ("pcss", "paper5")),
            claim("faster-10", "accumulation", "Faster than PCSS (kernel 10).", "> 1",
                  "time of the passes, PCSS over accumulation",
                  slower("pcss", "paper10", TECHNIQUE), at_least(1.1, 0.9), ("pcss", "paper10")),
        ],
    },
    {
        "key": "erosion",
        "title": "Klein et al. 2014, Contact hardening soft shadows using erosion",
        "conditions": "Paper: 1920 x 1080, 2048 x 2048 map, 32 filter taps for both, PCSS with 8, 32 "
                      "and 64 search taps, cactus of 188 K triangles, hairball of 2.88 M, buddha of "
                      "1.08 M; GeForce GTX 680. Light sizes are not stated. Here: the same sizes, "
                      "taps and triangles with our foliage, hairball and columns, a light of a tenth "
                      "of the usual size (small penumbrae) and the usual one. PCSS does not "
                      "average between pixels; it skips receivers that a min-max pyramid proves lit, "
                      "which the paper's did not. Truth: 256 rays.",
        "claims": [
            claim("wins-small", "erosion-small", "Where penumbrae are small, erosion beats PCSS "
                  "with 64 search taps.", "0.98, 1.01, 1.01",
                  "frame time, erosion over PCSS 64, small light", slower("erosion", "pcss64"),
                  at_most(1.0, 1.1), ("erosion", "pcss64"), pair=("erosion", "pcss64")),
            claim("wins-only-small", "erosion-wide", "It does not where they are large.", "> 1",
                  "frame time, erosion over PCSS 64, usual light",
                  slower("erosion", "pcss64"), at_least(1.0, 0.95), ("erosion", "pcss64"),
                  pair=("erosion", "pcss64")),
            claim("loses-8", "erosion-small", "PCSS with 8 search taps is faster.",
                  "1.03, 1.09, 1.23", "frame time, erosion over PCSS 8, small light",
                  slower("erosion", "pcss8"), at_least(1.0, 0.95), ("erosion", "pcss8")),
            claim("close-32", "erosion-small", "The two cost about the same: against 32 search "
                  "taps.", "1.01, 1.06, 1.13", "frame time, erosion over PCSS 32, small light",
                  slower("erosion", "pcss32"), within((0.9, 1.25), (0.75, 1.5)),
                  ("erosion", "pcss32")),
            claim("steps-map", "erosion-small", "Shadow map and hard shadows are most of the "
                  "cost: 2.20 and 2.52 of 5.77 ms.", "0.82", "share of map and hard shadows in the steps",
                  pass_share("erosion", ("shadow:", "hard")), at_least(0.6, 0.4),
                  ("erosion",)),
            claim("steps-erosion", "erosion-small", "Edges and erosion are little: 0.31 and 0.30 ms.",
                  "0.11", "share of edges and erosion in the steps",
                  pass_share("erosion", ("edge", "erosion", "line fit", "flood")),
                  at_most(0.2, 0.35), ("erosion",)),
            claim("quality", "erosion-small", "Its pictures are comparable to those of PCSS.", "visual",
                  "visibility RMSE, PCSS 32 over erosion, small light",
                  error_ratio("rmse", "pcss32", "erosion"), at_least(0.9, 0.6),
                  ("erosion", "pcss32")),
            claim("direct-worse", "erosion-small", "The shadow factor taken from the erosion itself "
                  "still has artefacts; with depth comparisons it has fewer.", "visual",
                  "visibility RMSE, direct factor over comparisons, small light",
                  error_ratio("rmse", "direct", "erosion"), at_least(1.05, 0.95),
                  ("erosion", "direct"), pair=("direct", "erosion")),
            claim("thin", "erosion-wide", "No artefacts of missed blockers, which PCSS with 8 search "
                  "taps has on fine geometry.", "visual",
                  "visibility RMSE, PCSS 8 over erosion, usual light",
                  error_ratio("rmse", "pcss8", "erosion"), at_least(1.0, 0.9),
                  ("erosion", "pcss8"), pair=("erosion", "pcss8")),
        ],
    },
    {
        "key": "relatives",
        "title": "Methods that the five papers build on or compare with",
        "conditions": "Schwarzler et al. 2012: 289 fixed light samples at 10 fps, 25 adaptive ones at "
                      "67 fps (a far view). Guennebaud et al. 2006: 25 fps where 1024 averaged hard "
                      "shadows take 2.5 s. Resolutions and scenes are not known to us; here 800 x "
                      "600 and 1024 x 1024 maps for the first, 512 x 512 pixels and maps and foliage "
                      "of 50,000 triangles for the second. Shadow inputs are made anew for every "
                      "image.",
        "claims": [
            claim("sampling-time", "cascaded", "Adaptive light sampling (FASSALSS) with 25 samples "
                  "is 6.7 times as fast as 289 fixed samples.", "6.7",
                  "time of 289 samples over adaptive sampling", slower("fixed289", "fassalss"),
                  at_least(5, 3), ("fixed289", "fassalss")),
            claim("sampling-error", "cascaded", "Its pictures are those of 289 fixed samples.",
                  "visual", "image RMSE, adaptive sampling from 289 samples",
                  error("image_rmse", "fassalss", "fixed289"), at_most(0.01, 0.02),
                  ("fixed289", "fassalss"), pair=("fassalss", "fixed289")),
            claim("backprojection-time", "backprojection", "Backprojection takes a 60th of the time "
                  "of 1024 averaged hard shadows.", "62",
                  "time of 1024 samples over backprojection", slower("fixed1024", "backprojection"),
                  at_least(40, 15), ("fixed1024", "backprojection"),
                  pair=("backprojection", "fixed1024")),
        ],
    },
]


def judge(entry, value):
    """Verdict on one number."""
    for verdict, (low, high) in (("reproduced", entry["good"]), ("partly", entry["fair"])):
        if low <= value <= high:
            return verdict
    return "refuted"


def overall(verdicts):
    if not verdicts:
        return "not measured"
    if all(verdict == "reproduced" for verdict in verdicts):
        return "reproduced"
    return "refuted" if all(verdict == "refuted" for verdict in verdicts) else "partly"
