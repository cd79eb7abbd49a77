#!/usr/bin/env python3
"""Checks what the bench concludes from made-up measurements whose answers are known."""
import os
import tempfile
import unittest
import xml.etree.ElementTree as xml

import bench
import claims
import claims_table
import report
import svg


STAND_IN = """#!/usr/bin/env python3
import json, os, sys
print(json.dumps({"device": "d", "gl": "g", "methods": []}), flush=True)
for line in sys.stdin:
    fields = line.split("\\t")
    if fields[0] == "group":
        name = fields[1]
    elif line == "run\\n":
        if name == "dies":
            sys.exit(1)
        with open(os.path.join(os.path.dirname(__file__), "../measured"), "a") as file:
            file.write(name + "\\n")
        print(json.dumps({"group": name, "scene": "demo"}), flush=True)
"""


def times(milliseconds):
    return {"gbuffer": [1] * len(milliseconds), "shadow": [0] * len(milliseconds),
            "technique": milliseconds, "shade": [1] * len(milliseconds),
            "readback": [50] * len(milliseconds), "inputs_kept": 0,
            "passes": [{"stage": "shadow", "name": "shadow map", "count": 1, "ms": 6},
                       {"stage": "technique", "name": "hard shadows", "count": 1, "ms": 2},
                       {"stage": "technique", "name": "edges", "count": 1, "ms": 1},
                       {"stage": "shade", "name": "shade", "count": 1, "ms": 1}]}


def group(name, variants, comparisons=()):
    return {"group": name, "scene": name.rpartition("-")[2], "settings": "", "triangles": 4,
            "width": 100, "height": 10, "comparisons": list(comparisons),
            "variants": [{"name": key, "settings": "", "status": "ok", "warnings": [],
                          "subdivided_pixels": [30, 20], "moving": times(value)}
                         if value else {"name": key, "settings": "", "status": "not built"}
                         for key, value in variants.items()]}


def entry(key):
    return next(e for paper in claims_table.PAPERS for e in paper["claims"] if e["key"] == key)


class Report(unittest.TestCase):
    def test_ratios_pair_rounds(self):
        # The machine slows down tenfold in the second round; each round still says 2.
        measured = group("a-x", {"slow": [18, 198, 18], "fast": [8, 98, 8]})
        self.assertEqual(bench.ratios(measured, "slow", "fast"), [2, 2, 2])
        self.assertEqual(bench.ratios(measured, "slow", "missing"), [])
        self.assertEqual(bench.spread([4, 1, 2, 3, 5]), (3, 2, 4))

    def test_verdicts(self):
        limits = {"good": (0.45, 0.8), "fair": (0.3, 0.95)}
        self.assertEqual([claims_table.judge(limits, v) for v in (0.45, 0.3, 0.9, 0.2, 1)],
                         ["reproduced", "partly", "partly", "refuted", "refuted"])
        self.assertEqual(claims_table.overall(["reproduced", "refuted"]), "partly")
        self.assertEqual(claims_table.overall(["refuted", "refuted"]), "refuted")
        self.assertEqual(claims_table.overall([]), "not measured")

    def test_claims(self):
        # Frames of 10 and 12.5 ms: 0.8 of the frame rate, as published.
        groups = {"chun-x": group("chun-x", {"cssm": [8.0], "adaptive": [10.5], "fixed": [14.6]})}
        result = claims.try_claim(entry("adaptive-cost"), groups)
        self.assertAlmostEqual(result["scenes"][0]["median"], 0.8)
        self.assertEqual(result["verdict"], "reproduced")
        share = claims.try_claim(entry("share"), groups)
        self.assertAlmostEqual(share["scenes"][0]["median"], 0.05)
        groups["chun-y"] = group("chun-y", {"cssm": [2.0], "adaptive": [10.0], "fixed": None})
        self.assertEqual(claims.try_claim(entry("adaptive-cost"), groups)["verdict"], "partly")
        self.assertEqual(claims.try_claim(entry("time-saved"), {
            "cascaded-x": group("cascaded-x", {"cascaded": None, "bilateral": [1.0]})})["verdict"],
            "method not built")
        steps = claims.try_claim(entry("steps-map"), {
            "erosion-small-x": group("erosion-small-x", {"erosion": [1.0]})})
        self.assertAlmostEqual(steps["scenes"][0]["median"], 0.8)

    def test_errors(self):
        errors = [{"test": name, "reference": "reference", "rmse": value}
                  for name, value in (("pcss", 0.02), ("paper10", 0.04))]
        result = claims.try_claim(entry("nearer-10"), {
            "accumulation-x": group("accumulation-x", {"pcss": [1.0], "paper10": [1.0]}, errors)})
        self.assertEqual((result["scenes"][0]["median"], result["verdict"]), (0.5, "refuted"))

    def test_every_claim_is_written_out(self):
        for paper in claims_table.PAPERS:
            for claim in paper["claims"]:
                for good, fair in zip(claim["good"], claim["fair"]):
                    self.assertTrue(abs(fair) == abs(good) or fair != good)
                self.assertTrue(claim["fair"][0] <= claim["good"][0] <= claim["good"][1] <=
                                claim["fair"][1], claim["key"])

    def test_a_broken_run_goes_on(self):
        """The measuring program is a stand-in that dies at a group called "dies"."""
        with tempfile.TemporaryDirectory() as folder:
            os.mkdir(os.path.join(folder, "bin"))
            program = os.path.join(folder, "bin/penumbra-claims")
            with open(program, "w") as file:
                file.write(STAND_IN)
            os.chmod(program, 0o755)
            counts = os.path.join(folder, "measured")

            def run(names, **more):
                plan = bench.Plan(folder)
                for name in names:
                    plan.group(name, "demo", {"reference": "a=1", "test": "b=%d" % len(name)})
                return plan.run(folder, folder, **more)[1]

            def measured():
                with open(counts) as file:
                    return file.read().split()
            with self.assertRaises(SystemExit):
                run(("a", "bb", "dies", "c"))
            self.assertEqual(measured(), ["a", "bb"])
            self.assertEqual(list(run(("a", "bb", "c"))), ["a", "bb", "c"])
            self.assertEqual(measured(), ["a", "bb", "c"])
            with open(os.path.join(folder, "results.jsonl"), "a") as file:
                file.write('{"group": "half a li')
            self.assertEqual(list(run(("c", "a"))), ["c", "a"])
            self.assertEqual(measured(), ["a", "bb", "c"])
            run(("a",), fresh=True)
            self.assertEqual(measured()[3:], ["a"])
            with open(program, "a") as file:
                file.write("# another build\n")
            run(("a",))
            self.assertEqual(measured()[4:], ["a"])

    def test_plots_are_xml(self):
        points = [(0.5, 0.001, "a & b", "reference"), (300, 0.2, "<c>", "shadowmap")]
        tree = xml.fromstring(svg.scatter(points, "ms", "error"))
        circles = list(tree.iter("circle"))
        self.assertEqual(len(circles), 2)
        by_x = sorted(circles, key=lambda c: float(c.get("cx")))
        self.assertGreater(float(by_x[0].get("cy")), float(by_x[1].get("cy")))
        xml.fromstring(svg.strip([(0.9, 0.8, 1.1, "partly")], (1, float("inf")),
                                 (0.5, float("inf"))))

    def test_labels_are_readable(self):
        """Thirty labels in a corner: none covers another or a point."""
        points = [(200 + 37 * i % 90, 200 + 23 * i % 60, "method %d" % i) for i in range(30)]
        boxes = [box for _, _, box, _ in svg.place_labels(points)]
        self.assertEqual(len(boxes), len(points))
        for i, box in enumerate(boxes):
            self.assertFalse([other for other in boxes[:i] if svg.covers(box, other)])
            self.assertFalse([p for p in points if svg.covers(box, (p[0] - 4, p[1] - 4, p[0] + 4,
                                                                    p[1] + 4))])

    def test_page(self):
        groups = {"chun-x": group("chun-x", {"cssm": [8.0], "adaptive": [10.5], "fixed": [14.6]})}
        device = {"device": "a <b>", "gl": "4.5", "software": True, "methods": []}
        with tempfile.TemporaryDirectory() as out:
            report.write(out, device, "full", claims.try_papers(groups), groups, [])
            with open(os.path.join(out, "index.html"), encoding="utf-8") as file:
                page = file.read()
        self.assertIn("a &lt;b&gt;", page)
        self.assertNotIn("<script", page)
        for paper in claims_table.PAPERS:
            for claim in paper["claims"]:
                self.assertIn(claim["text"].split("'")[0].split('"')[0][:30].split("&")[0], page)


if __name__ == "__main__":
    unittest.main()
