"""What the claims bench and the comparison of methods share: running the plan, statistics."""
import hashlib
import json
import os
import statistics
import subprocess
import sys

from scenes import Scenes

FRAME = ("gbuffer", "shadow", "technique", "shade")  # of one image, without reading it back
METHOD = ("shadow", "technique")

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.dirname(os.path.dirname(os.path.dirname(HERE)))


def import_scenes(build, folder):
    """Imports the shared scenes once; without them the bench runs on generated scenes alone."""
    shared = os.environ.get("PENUMBRA_SHARED") or os.path.join(ROOT, "..", "shared")
    source = os.path.join(shared, "scenes")
    if not os.path.isdir(source):
        return
    names = [name[:-4] for name in os.listdir(source) if name.endswith(".glb")]
    if all(os.path.exists(os.path.join(folder, name + ".pscene")) for name in names):
        return
    subprocess.run([sys.executable, "-B", os.path.join(ROOT, "tests/accuracy/import_scenes.py"),
                    os.path.join(build, "bin/penumbra-import"), source, folder], check=True,
                   stdout=subprocess.DEVNULL)


class Plan:
    """Lines for penumbra-claims (plan.h)."""

    def __init__(self, scene_folder):
        self.scenes = Scenes(scene_folder)
        self.groups = []

    def group(self, name, scene, variants, settings="", repetitions=5, seconds=60, flags="p",
              pairs=()):
        """variants: {name: settings}; "reference" comes first."""
        shared = "&".join(part for part in (self.scenes.use(scene), settings) if part)
        lines = ["\t".join(["group", name, scene, str(repetitions), str(seconds), flags, shared])]
        for key in sorted(variants, key=lambda key: key != "reference"):
            lines.append("\t".join(["variant", key, variants[key]]))
        lines += ["\t".join(["compare", *pair]) for pair in pairs]
        self.groups.append("\n".join(lines + ["run"]))

    def run(self, build, out, device="auto", log="results.jsonl", fresh=False):
        """Measures; answers (device, {group: result}). Every group is on disk once it is done, and
        is not measured again by the same program on the same device with the same settings, unless
        `fresh`: a run that was broken off goes on."""
        pictures = os.path.join(out, "pictures")
        os.makedirs(pictures, exist_ok=True)
        program, path = os.path.join(build, "bin/penumbra-claims"), os.path.join(out, log)
        child = subprocess.Popen([program, "--device", device, "--out", pictures],
                                 stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        first = child.stdout.readline()
        if not first:
            status = child.wait()
            sys.exit(77 if status == 77 else "penumbra-claims ended with status %d" % status)
        info = json.loads(first)
        known = {} if fresh else known_groups(path, info)
        keys = {text: key_of(program, self.scenes.lines, text) for text in self.groups}
        kept = {key: known[key] for key in keys.values() if key in known}
        # What else the machine does belongs to the device.
        info.update(processors=os.cpu_count(), load=os.getloadavg()[0])
        wanted = [text for text in self.groups if keys[text] not in kept]
        if kept:
            print("%d of %d groups were measured before and are kept (--fresh measures them again)"
                  % (len(kept), len(self.groups)), file=sys.stderr)
        results = list(kept.values())
        with open(path + ".part", "w") as file:
            for entry in [info] + results:
                file.write(json.dumps(entry) + "\n")
        os.replace(path + ".part", path)
        child.stdin.write("\n".join(list(self.scenes.lines.values()) + wanted) + "\n")
        child.stdin.close()
        with open(path, "a") as file:
            for text, line in zip(wanted, child.stdout):
                results.append({**json.loads(line), "key": keys[text]})
                file.write(json.dumps(results[-1]) + "\n")
                file.flush()
        status = child.wait()
        if status:
            sys.exit("penumbra-claims ended with status %d" % status)
        found = {result["key"]: result for result in results}
        return info, {found[keys[text]]["group"]: found[keys[text]] for text in self.groups}


def key_of(program, scene_lines, text):
    """What a group's result depends on besides the device: program, scene and settings."""
    digest = hashlib.sha256(text.encode())
    with open(program, "rb") as file:
        digest.update(hashlib.sha256(file.read()).digest())
    scene = scene_lines[text.split("\t")[2]]
    digest.update(scene.encode())
    kind, path = scene.split("\t")[2:4]
    if kind == "file":
        status = os.stat(path)
        digest.update(b"%d %d" % (status.st_size, status.st_mtime_ns))
    return digest.hexdigest()


def known_groups(path, info):
    """{key: result} of an earlier run on this device, as far as it came."""
    known = {}
    if not os.path.exists(path):
        return known
    with open(path) as file:
        for number, line in enumerate(file):
            try:
                result = json.loads(line)
            except ValueError:  # broken off while it was written
                break
            if number == 0:
                if any(result.get(key) != info[key] for key in ("device", "gl")):
                    break
            elif "key" in result:
                known[result["key"]] = result
    return known


# What a variant's set-up promises: maps drawn for the light at most.
MOST_MAPS = {"bilateral": 25, "fassalss": 25, "fixed25": 25}


def failures(groups):
    """Variants whose method exists but which did not render, or not what the experiment is about: the
    plan or the method is broken."""
    variants = [(group["group"], v) for group in groups.values() for v in group["variants"]]
    return (["%s, %s: %s" % (group, v["name"], v.get("message", ""))
             for group, v in variants if v["status"] == "failed"] +
            ["%s, %s: %d maps of %d" % (group, v["name"], v["shadow_maps"], MOST_MAPS[v["name"]])
             for group, v in variants
             if v.get("shadow_maps", 0) > MOST_MAPS.get(v["name"], float("inf"))])


def read_results(path):
    with open(path) as file:
        results = [json.loads(line) for line in file]
    return results[0], {group["group"]: group for group in results[1:]}


def variant(group, name):
    return next((v for v in group["variants"] if v["name"] == name), None)


def comparison(group, test, reference="reference"):
    return next((c for c in group["comparisons"]
                 if c["test"] == test and c["reference"] == reference), None)


def rounds(group, name, stages=FRAME, how="moving"):
    """Milliseconds of each round; empty when it was not timed."""
    found = variant(group, name)
    times = found and found.get(how)
    return [sum(values) for values in zip(*(times[stage] for stage in stages))] if times else []


def spread(values):
    """Median, lower and upper quartile."""
    values = sorted(values)
    if len(values) < 2:
        return (values[0],) * 3 if values else None
    low, middle, high = statistics.quantiles(values, n=4, method="inclusive")
    return middle, low, high


def ratios(group, numerator, denominator, stages=FRAME, how="moving"):
    """Per round, so that what else the machine does falls on both."""
    a, b = rounds(group, numerator, stages, how), rounds(group, denominator, stages, how)
    return [x / y for x, y in zip(a, b) if y > 0]
