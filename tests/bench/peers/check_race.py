#!/usr/bin/env python3
"""What of the race needs none of the others: scenes, pictures and the table.

    check_race.py PROGRAMS
"""
import json
import os
import struct
import subprocess
import sys
import tempfile
import unittest

import processes
import report
import scenes
import shadows

sys.path.append(os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../api"))
import pictures  # noqa: E402

PROGRAMS = sys.argv.pop(1)


def grey(rows):
    return pictures.png([[(v, v, v) for v in row] for row in rows], 2, 8)


class Scenes(unittest.TestCase):
    def test_floor(self):
        """The importer takes what the floor was put under, with two triangles more."""
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "x.glb")
            subprocess.run([os.path.join(PROGRAMS, "penumbra"), "generate", "square", "-o", path],
                           check=True, stdout=subprocess.DEVNULL)
            with open(path, "rb") as file:
                before = file.read()
            after = scenes.with_floor(before, 3)
            self.assertEqual(struct.unpack_from("<I", after, 8)[0], len(after))
            documents = [json.loads(data[20:20 + struct.unpack_from("<I", data, 12)[0]])
                         for data in (before, after)]
            self.assertEqual([len(d["meshes"]) for d in documents],
                             [len(documents[0]["meshes"]) + n for n in (0, 1)])
            last = documents[1]["accessors"][-1]
            view = documents[1]["bufferViews"][last["bufferView"]]
            binary = after[len(after) - struct.unpack_from(
                "<I", after, 20 + struct.unpack_from("<I", after, 12)[0])[0]:]
            self.assertEqual(struct.unpack_from("<6I", binary, view["byteOffset"]), (0, 1, 2, 0, 2, 3))

    def test_ways(self):
        """The camera keeps its distance and its height, and is never twice in one place."""
        jobs = [scenes.job("bunny", "pcss", n) for n in range(5)]
        eyes = [j["eye"] for j in jobs]
        self.assertEqual(len(set(eyes)), 5)
        self.assertEqual({round(x * x + z * z, 9) for x, _, z in eyes}, {round(2.2**2 + 2.6**2, 9)})
        self.assertEqual({y for _, y, _ in eyes}, {1.6})
        self.assertEqual(scenes.job("bunny", "pcss", size=2)["light"]["size"], 2)
        self.assertEqual(scenes.job("bunny", "pcss", size=2)["base_size"], 1)


class Pictures(unittest.TestCase):
    def test_shadow(self):
        plain = grey([[200, 200, 200, 0]])
        dark = grey([[200, 10, 10, 0]])
        half = grey([[10, 10, 200, 0]])
        a, b = shadows.visible(dark, plain), shadows.visible(half, plain)
        self.assertEqual(a[3], None)
        self.assertEqual([round(v) for v in a[:3]], [1, 0, 0])
        self.assertEqual(shadows.agreement(a, a), 1)
        self.assertAlmostEqual(shadows.agreement(a, b), 1 / 3)
        pale = shadows.visible(grey([[200, 160, 160, 0]]), plain)
        self.assertEqual(shadows.agreement(a, pale), 1)

    def test_error(self):
        a, b = grey([[10, 10], [10, 10]]), grey([[10, 61], [10, 10]])
        self.assertAlmostEqual(shadows.error(a, b, (0, 0, 2, 2)), 0.1)
        self.assertAlmostEqual(shadows.error(a, b, (1, 0, 2, 1)), 0.2)
        self.assertEqual(shadows.error(a, b, (0, 0, 1, 2)), 0)

    def test_penumbra(self):
        fractions = [1] * 100
        fractions[34] = fractions[45] = 0.5
        self.assertEqual(shadows.penumbra_box(fractions, 10, margin=1), (3, 2, 7, 6))


class Processes(unittest.TestCase):
    def test_self(self):
        child = subprocess.Popen(["sleep", "60"])
        try:
            pids = processes.tree(os.getpid())
            self.assertIn(child.pid, pids)
            self.assertIn("sleep", processes.command(child.pid))
            self.assertGreater(processes.held_mib(pids), 1)
            self.assertGreater(processes.status_mib(os.getpid(), "VmRSS"), 1)
        finally:
            child.kill()
            child.wait()


class Table(unittest.TestCase):
    TIMES = {"ours": {"ms": [10, 20, 60], "processor_ms": [5, 5, 5]},
             "three.js": {"ms": [100, 100, 100], "processor_ms": [50, 100, 25]}}

    def row(self, **more):
        return {"title": "`pcss`", "scene_title": "bunny", "checks": [], "goal": 0.2, "name": "camera",
                "times": self.TIMES, **more}

    def test_ratio(self):
        found, = report.entries(self.row())
        self.assertEqual((found["ratio"], found["processors"], found["met"]),
                         ("0.20 (0.10 to 0.60)", "0.10 (0.05 to 0.20)", True))
        found, = report.entries(self.row(goal=0.19))
        self.assertFalse(found["met"])
        found, = report.entries(self.row(goal=None))
        self.assertEqual((found["met"], found["goal"]), (None, "-"))

    def test_small_ratio(self):
        times = {"ours": {"ms": [1, 1], "processor_ms": [1, 1]},
                 "Cycles": {"ms": [100, 300], "processor_ms": [200, 200]}}
        found, = report.entries(self.row(times=times, goal=1 / 220))
        self.assertEqual((found["ratio"], found["goal"], found["met"]),
                         ("1 / 150 (1 / 100 to 1 / 300)", "1 / 220", False))

    def test_page(self):
        """A failed check is said, as is a missed goal, and nothing of a title becomes markup."""
        row = self.row(title="a <b> `c`", checks=[{"what": "maps are kept", "holds": False}],
                       goal=0.1)
        with tempfile.TemporaryDirectory() as out:
            report.write(out, [row])
            with open(os.path.join(out, "index.html"), encoding="utf-8") as file:
                page = file.read()
            with open(os.path.join(out, "table.md"), encoding="utf-8") as file:
                table = file.read()
        self.assertIn("<strong>does not hold:</strong> maps are kept", page)
        self.assertIn("a &lt;b&gt; <code>c</code>", page)
        self.assertIn('class="missed"', page)
        self.assertIn("| 0.10, missed |", table)


if __name__ == "__main__":
    unittest.main()
