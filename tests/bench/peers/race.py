#!/usr/bin/env python3
"""The race: penumbra against what else one would take, on one machine, in alternation.

    race.py --programs DIR --out DIR [--modules DIR] [--chromium PATH] [--shared DIR] [--vtk]
            [--blender] [--scene NAME] [--rounds 5] [--frames 5] [--only row,row]

run.sh installs the others and calls this. Each row of the table makes the same picture by two
contenders, turn by turn: `--frames` pictures each in a round, in changing order; a round's ratio is
that of the medians, the row's that of the rounds. Beside wall-clock time, the processor time of all
processes of both, which a busy machine disturbs less. Rows are kept in DIR/race.json: --only makes
some of them anew. Exit 1: an experiment does not measure what it says.
"""
import argparse
import json
import os
import signal
import statistics
import sys
import tempfile
import time

import contenders
import processes
import report
import scenes
import shadows

SETTINGS = {"width": 800, "height": 600, "fov": 45}
CROP_ERROR = 0.007
# What may be taken for a true area light, the cheapest first.
TRUE_AREA = (("denoised", {}), ("raytraced", {"samples": 16}), ("raytraced", {"samples": 32}),
             ("raytraced", {"samples": 64}), ("raytraced", {"samples": 128}))
BUSY_SIZES = ({}, {"width": 1600, "height": 1200})


def method(name, **params):
    return {"technique": {"name": name, "params": params}}


class Race:
    def __init__(self, options):
        self.o = options
        self.folder = tempfile.TemporaryDirectory(prefix="penumbra-race-")
        self.daemon = self.three = None
        self.paths = {}
        self.checks = []
        self.cache = os.path.join(options.out, "shader-cache")

    def path(self, scene):
        if scene not in self.paths:
            self.paths[scene] = scenes.prepare(scene, self.o.programs, self.folder.name,
                                               self.o.shared)
        return self.paths[scene]

    def start_ours(self, *flags, cache=None):
        return contenders.Penumbra(self.o.programs, SETTINGS,
                                   os.path.join(self.folder.name, "store"), *flags,
                                   env={"XDG_CACHE_HOME": cache or self.cache})

    def start_three(self):
        return contenders.Three(self.o.modules, self.folder.name, self.o.chromium, SETTINGS)

    def wait_filled(self, daemon, seconds=1800):
        """Until nothing is compiled in idle time any more."""
        daemon.wait_ready()
        end = time.monotonic() + seconds
        while not daemon.filled() and time.monotonic() < end:
            time.sleep(0.5)
        self.check("the shader cache is filled", daemon.filled())

    def ours(self):
        if not self.daemon:
            self.daemon = self.start_ours()
            self.wait_filled(self.daemon)
        return self.daemon

    def theirs(self):
        self.three = self.three or self.start_three()
        return self.three

    def stop(self):
        for contender in (self.daemon, self.three):
            if contender:
                contender.stop()
        self.daemon = self.three = None

    def check(self, what, holds):
        self.checks.append({"what": what, "holds": bool(holds)})
        if not holds:
            print("  does not hold: " + what, flush=True)

    def keep(self, name, png):
        with open(os.path.join(self.o.out, name), "wb") as file:
            file.write(png)
        return name

    def alternate(self, who, rounds=None, frames=None):
        """who: {name: (contender, scene, step -> job)}. {name: {"ms": per round, "processor_ms"}}"""
        found = {name: {"ms": [], "processor_ms": []} for name in who}
        for name, (contender, scene, job_at) in who.items():
            for n in range(2):
                contender.frame(self.path(scene), job_at(n))
        step = 2
        for turn in range(rounds or self.o.rounds):
            for name in (list(who) if turn % 2 else list(who)[::-1]):
                contender, scene, job_at = who[name]
                pids, times = contender.pids(), []
                begun = processes.processor_ms(pids)
                for n in range(frames or self.o.frames):
                    times.append(contender.frame(self.path(scene), job_at(step + n)).ms)
                found[name]["ms"].append(statistics.median(times))
                found[name]["processor_ms"].append(
                    (processes.processor_ms(pids) - begun) / len(times))
            step += frames or self.o.frames
        return found

    def row(self, ours_at, theirs_at, scene, kept, goal, title, more=None):
        """One row against three.js. kept: whether shadow maps are kept; None where there are none."""
        ours, three = self.ours(), self.theirs()
        found = self.alternate({"ours": (ours, scene, ours_at), "three.js": (three, scene, theirs_at),
                                **(more or {})})
        path = self.path(scene)
        records = [ours.record(path, ours_at(1000 + n)) for n in range(3)]
        frames = [three.frame(path, theirs_at(1000 + n)) for n in range(2)]
        mine = [ours.frame(path, ours_at(0)), ours.frame(path, ours_at(1))]
        sizes = {shadows.read(f.png)[:2] for f in mine + frames}
        self.check(title + ": all pictures are PNG of the same size",
                   sizes == {(SETTINGS["width"], SETTINGS["height"])})
        self.check(title + ": no two frames are the same", mine[0].png != mine[1].png and
                   frames[0].png != frames[1].png)
        if kept is not None:
            self.check("%s: we %s our shadow map" % (title, "keep" if kept else "redraw"),
                       all(r["cache"]["shadow_inputs_reused"] == kept for r in records))
            anew, again = (three.frame(path, dict(theirs_at(0), keep_map=kept_map))
                           for kept_map in (False, True))
            self.check(title + ": three.js shows the same with the map that it kept",
                       anew.png == again.png)
            one = again.more["triangles"]
            self.check("%s: three.js %s its shadow map" % (title, "keeps" if kept else "redraws"),
                       all((f.more["triangles"] == one) == kept for f in frames))
        passes = {}
        for record in records:
            for p in record["passes"]:
                passes.setdefault(p["name"], []).append(p["ms"])
        return {"title": title, "goal": goal, "scene": scene, "times": found,
                "passes": {name: sum(times) / len(records) for name, times in passes.items()},
                "stages": {stage: statistics.median(r["stages_ms"][stage] for r in records)
                           for stage in records[0]["stages_ms"]},
                "draw_ms": statistics.median(f.more["draw_ms"] for f in frames),
                "about": {"ours": records[0]["device"]["renderer"],
                          "three.js": "r%(revision)s, %(device)s" % frames[0].more["about"]}}

    # The rows. Names are those of --only.

    def no_shadow(self):
        s = self.o.scene
        return self.row(lambda n: scenes.job(s, "none", n),
                        lambda n: scenes.job(s, "none", n, keep_map=True), s, None, 0.18,
                        "no shadow")

    def camera(self):
        s = self.o.scene
        return self.row(lambda n: scenes.job(s, "pcss", n),
                        lambda n: scenes.job(s, "pcss", n, keep_map=True), s, True, 0.22,
                        "`pcss`, camera moves, map kept")

    def light(self):
        s = self.o.scene
        return self.row(lambda n: scenes.job(s, "pcss", 0, n),
                        lambda n: scenes.job(s, "pcss", 0, n, keep_map=False), s, False, 0.35,
                        "`pcss`, light moves")

    def same_size(self):
        s = self.o.scene

        def at(n, **more):
            return scenes.job(s, "pcss", size=0.7 + 0.004 * (n % 100), **more)
        return self.row(at, lambda n: at(n, keep_map=True), s, True, 0.12,
                        "same view again, another light size")

    def same_method(self):
        s = self.o.scene

        def ours(n):
            return scenes.job(s, ("pcf", "pcss", "hard")[n % 3])
        row = self.row(ours, lambda n: scenes.job(s, "pcss", size=0.7 + 0.004 * (n % 100),
                                                  keep_map=True),
                       s, True, 0.12, "same view again, another method (three.js: its PCSS)")
        return row

    def as_it_comes(self):
        s = self.o.scene
        usual = {"sky": True, "edges": "smooth"}
        return self.row(lambda n: scenes.job(s, "pcss", n, request=usual),
                        lambda n: scenes.job(s, "pcss", n, keep_map=True), s, True, None,
                        "the same with our sky and smooth edges, which three.js has not")

    def hairball(self):
        return self.row(lambda n: scenes.job("hairball", "pcss", n),
                        lambda n: scenes.job("hairball", "pcss", n, keep_map=True), "hairball", True,
                        0.15, "`pcss`, camera moves, hairball of 1.1 M triangles")

    def true_area(self):
        s, ours, three = self.o.scene, self.ours(), self.theirs()
        path = self.path(s)

        def ours_by(name, params, n=0, **more):
            return scenes.job(s, name, n, request=method(name, **params), **more)
        truth = ours.frame(path, ours_by("raytraced", {"samples": 1024})).png
        plain = ours.frame(path, scenes.job(s, "none")).png
        box = scenes.SCENES[s].get("crop") or shadows.penumbra_box(
            shadows.visible(truth, plain), SETTINGS["width"])
        errors, chosen = {}, None
        for name, params in (("pcss", {}),) + TRUE_AREA:
            label = name + "".join(" %s" % v for v in params.values())
            errors[label] = shadows.error(ours.frame(path, ours_by(name, params)).png, truth, box)
            if errors[label] <= CROP_ERROR and (not chosen) and name != "pcss":
                chosen = (name, params, label)
        name, params, label = chosen or TRUE_AREA[-1] + ("raytraced 128",)
        many = three.frame(path, scenes.job(s, "accumulate", samples=256)).png
        errors["three.js PCSS"] = shadows.error(
            three.frame(path, scenes.job(s, "pcss", keep_map=False)).png, many, box)
        errors["three.js 16 lights"] = shadows.error(
            three.frame(path, scenes.job(s, "accumulate", samples=16)).png, many, box)
        row = self.row(lambda n: ours_by(name, params, n),
                       lambda n: scenes.job(s, "pcss", n, keep_map=True), s, None, 0.35,
                       "true area light (`%s`) against three.js's PCSS" % label)
        three_none = three.frame(path, scenes.job(s, "none")).png
        same = shadows.agreement(shadows.visible(truth, plain), shadows.visible(many, three_none))
        self.check("our rays and three.js's 256 lights show the same shadow (%.2f of it in both)" % same,
                   same > 0.9)
        row.update(errors=errors, box=box, pictures=[
            [self.keep("area-ours.png", ours.frame(path, ours_by(name, params)).png), "penumbra, " + label],
            [self.keep("area-truth.png", truth), "penumbra, rays 1024"],
            [self.keep("area-three.png", many), "three.js, 256 lights"]])
        return row

    def pictures(self):
        """Every contender's picture of the scene, and whether all show the same shadow."""
        s, path = self.o.scene, self.path(self.o.scene)
        ours, three = self.ours(), self.theirs()
        made = {"penumbra": (ours, "pcss"), "three.js": (three, "pcss"), "three.js pcf": (three, "pcf")}
        peers = self.peers(path)
        found, lit = [], {}
        try:
            made.update({name: (peer, "pcss") for name, peer in peers.items()})
            for name, (contender, mode) in made.items():
                more = {"samples": 64} if name == "Cycles" else {}
                shadowed = contender.frame(path, scenes.job(s, mode, keep_map=False, **more)).png
                found.append([self.keep("all-%s.png" % name.replace(" ", "-"), shadowed), name])
                if name == "VTK":  # its light is another with shadows than without
                    continue
                plain = contender.frame(path, scenes.job(s, "none", samples=1)).png
                lit[name] = shadows.visible(shadowed, plain)
        finally:
            for peer in peers.values():
                peer.stop()
        for name in lit:
            if name != "penumbra":
                same = shadows.agreement(lit["penumbra"], lit[name])
                self.check("penumbra and %s show the same shadow (%.2f of it in both)" % (name, same),
                           same > 0.75)
        return {"title": "pictures", "pictures": found}

    def peers(self, path):
        found = {}
        if self.o.vtk:
            found["VTK"] = contenders.Vtk(path, "shadow", SETTINGS, self.folder.name)
        if self.o.blender:
            found["Cycles"] = contenders.Cycles(path, SETTINGS, self.folder.name)
        return found

    def vtk(self):
        if not self.o.vtk:
            return None
        s, path = self.o.scene, self.path(self.o.scene)
        peer = contenders.Vtk(path, "shadow", SETTINGS, self.folder.name)
        try:
            return self.row(lambda n: scenes.job(s, "hard", n, n),
                            lambda n: scenes.job(s, "pcf", n, n, keep_map=False), s, False, None,
                            "hard shadow, camera and light move", {
                                "VTK": (peer, s, lambda n: scenes.job(s, "hard", n, n))})
        finally:
            peer.stop()

    def cycles(self):
        if not self.o.blender:
            return None
        s, path = self.o.scene, self.path(self.o.scene)
        peer = contenders.Cycles(path, SETTINGS, self.folder.name)
        samples = self.o.cycles_samples
        try:
            ours = self.ours()
            found = self.alternate({
                "ours": (ours, s, lambda n: scenes.job(s, "raytraced", n,
                                                       request=method("raytraced", samples=samples))),
                "Cycles": (peer, s, lambda n: scenes.job(s, "area", n, samples=samples))}, frames=1)
            return {"title": "`raytraced` %d against Cycles %d" % (samples, samples),
                    "goal": 1 / 220, "scene": s, "times": found}
        finally:
            peer.stop()

    def start(self):
        """From nothing to ready, and to the first picture."""
        self.stop()
        s, path = self.o.scene, self.path(self.o.scene)
        fresh = tempfile.mkdtemp(dir=self.folder.name)

        def ours(cache):
            begun = time.perf_counter()
            daemon = self.start_ours(cache=cache)
            try:
                daemon.scenes.update(self.known)
                daemon.wait_ready()
                ready = time.perf_counter() - begun
                daemon.frame(path, scenes.job(s, "pcss"))
                return ready, time.perf_counter() - begun
            finally:
                daemon.stop()

        def three():
            begun = time.perf_counter()
            other = self.start_three()
            try:
                other.frame(path, scenes.job(s, "pcss", keep_map=False))
                return time.perf_counter() - begun
            finally:
                other.stop()
        daemon = self.start_ours()
        try:
            self.wait_filled(daemon)
            daemon.upload(path)
            self.known = dict(daemon.scenes)
        finally:
            daemon.stop()
        empty = ours(fresh)
        found = {"ready": [], "ours": [], "three.js": []}
        for _ in range(self.o.rounds):
            ready, first = ours(self.cache)
            found["ready"].append(1e3 * ready)
            found["ours"].append(1e3 * first)
            found["three.js"].append(1e3 * three())
        return {"title": "start to ready, full shader cache", "empty_s": empty, "starts": found}

    def memory(self):
        """What an idle and a busy worker hold."""
        self.stop()
        s, path = self.o.scene, self.path(self.o.scene)
        daemon, three = self.start_ours("--gpu-memory=1G"), None
        try:
            self.wait_filled(daemon)
            worker = daemon.worker()
            idle = processes.status_mib(worker, "VmRSS")
            all_idle = processes.held_mib(daemon.pids())
            names = [t["name"] for t in json.loads(daemon.get("/v1/techniques")[1])["techniques"]
                     if t["name"] != "auto"]
            for size in BUSY_SIZES:
                for name in names:
                    try:
                        daemon.frame(path, scenes.job(s, name, request=size))
                    except RuntimeError as error:
                        self.check("%s within 1G: %s" % (name, error), "413" in str(error))
            busy = processes.status_mib(worker, "VmHWM")
            self.check("one worker did all methods", daemon.worker() == worker)
            three = self.start_three()
            three.frame(path, scenes.job(s, "pcss", keep_map=False))
            theirs = processes.held_mib(three.pids())
        finally:
            daemon.stop()
            if three:
                three.stop()
        return {"title": "memory", "idle_mib": idle, "idle_all_mib": all_idle, "busy_mib": busy,
                "three_mib": theirs}


ROWS = ("no_shadow", "camera", "light", "same_size", "same_method", "hairball", "true_area",
        "as_it_comes", "vtk", "cycles", "start", "memory", "pictures")


def arguments():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--programs", required=True, help="build/release/bin")
    parser.add_argument("--out", required=True)
    parser.add_argument("--modules", help="folder whose node_modules holds three, puppeteer-core")
    parser.add_argument("--chromium", default="/usr/bin/chromium")
    parser.add_argument("--shared", help="folder that holds scenes/")
    parser.add_argument("--vtk", action="store_true")
    parser.add_argument("--blender", action="store_true")
    parser.add_argument("--scene", choices=sorted(scenes.SCENES))
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--frames", type=int, default=5)
    parser.add_argument("--cycles-samples", type=int, default=256)
    parser.add_argument("--only", help="rows, by commas: " + ", ".join(ROWS))
    options = parser.parse_args()
    options.scene = options.scene or ("bunny" if scenes.find("bunny", options.shared) else "columns")
    return options


def main():
    options = arguments()
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))  # stops those it has started
    os.makedirs(options.out, exist_ok=True)
    kept = os.path.join(options.out, "race.json")
    rows = {}
    if os.path.exists(kept):
        with open(kept, encoding="utf-8") as file:
            rows = json.load(file)
    race = Race(options)
    holds = True
    for name in options.only.split(",") if options.only else ROWS:
        race.checks = []
        print(name, flush=True)
        load = os.getloadavg()[0]
        try:
            row = getattr(race, name)()
        except BaseException:
            race.stop()
            raise
        if not row:
            print("  left out: not installed")
            continue
        row.update(name=name, checks=race.checks, scene_title=scenes.SCENES[options.scene]["title"],
                   load=[load, os.getloadavg()[0]], when=time.strftime("%Y-%m-%d"))
        holds = holds and all(c["holds"] for c in race.checks)
        rows[name] = row
        with open(kept + ".new", "w", encoding="utf-8") as file:
            json.dump(rows, file, indent=1)
        os.replace(kept + ".new", kept)
        for line in report.lines(row):
            print("  " + line, flush=True)
    race.stop()
    report.write(options.out, [rows[name] for name in ROWS if name in rows])
    print(os.path.join(options.out, "index.html"))
    return 0 if holds else 1


if __name__ == "__main__":
    sys.exit(main())
