"""pose_compare.py POSE_DUMP: the rest pose of files and five moments of each of their animations,
against an evaluation that shares no code with ours. Every corner of every triangle has to follow the
path of a corner of the file, within 1e-4 of the size."""
import json
import os
import subprocess
import sys
import tempfile

import gltf_pose
import pose_files

TOLERANCE = 1e-4
failures = 0


def check(ok, *text):
    global failures
    if not ok:
        failures += 1
        print("FAILED:", *text)


def bounds(corners):
    return ([min(p[k] for p, _ in corners) for k in range(3)],
            [max(p[k] for p, _ in corners) for k in range(3)])


def key(p, cell):
    return tuple(int(x // cell) for x in p)


def near(a, b, limit):
    return all(abs(x - y) <= limit for x, y in zip(a, b))


def follows(ours, theirs, poses, size):
    """Of the paths of corners: whether each of ours is one of theirs."""
    cell = 4 * TOLERANCE * size
    table = {}
    for i, (p, _) in enumerate(theirs[0]):
        table.setdefault(key(p, cell), []).append(i)
    worst = None
    for i, (p, n) in enumerate(ours[0]):
        a = key(p, cell)
        candidates = [c for dx in (-1, 0, 1) for dy in (-1, 0, 1) for dz in (-1, 0, 1)
                      for c in table.get((a[0] + dx, a[1] + dy, a[2] + dz), [])]
        for c in candidates:
            if all(near(ours[k][i][0], theirs[k][c][0], TOLERANCE * size) and
                   (theirs[k][c][1] is None or near(ours[k][i][1], theirs[k][c][1], 2e-3))
                   for k in range(poses)):
                break
        else:
            worst = i
    return worst is None


def compare(dump, path, name):
    file = gltf_pose.File(path)
    asked, theirs = [], [file.pose()]
    for animation in range(len(file.animations)):
        duration = file.duration(animation)
        for step in (0, 0.21, 0.5, 0.83, 1.1):  # the last one is held at the end
            asked += [str(animation), "%.9g" % (step * duration)]
            theirs.append(file.pose(animation, step * duration))
    run = subprocess.run([dump, path] + asked, capture_output=True, text=True)
    check(run.returncode == 0, name, run.stderr)
    if run.returncode:
        return
    ours = [json.loads(line) for line in run.stdout.splitlines()]
    check(ours[0]["animations"] == len(file.animations), name, "number of animations")
    low, high = bounds(theirs[0])
    size = max(h - l for l, h in zip(low, high)) or 1
    for pose, (mine, other) in enumerate(zip(ours, theirs)):
        low, high = bounds(other)
        check(near(mine["min"] + mine["max"], low + high, TOLERANCE * size), name, "bounds of pose",
              pose, mine["min"], mine["max"], low, high)
        check(len(mine["corners"]) == len(other), name, "corners of pose", pose)
        if pose:
            check(abs(mine["duration_s"] - file.duration((pose - 1) // 5)) < 1e-5, name, "duration")
    ours = [[(c[0], c[1]) for c in o["corners"]] for o in ours]
    check(follows(ours, theirs, len(theirs), size), name, "a corner goes where none should")
    print("%s: %d corners, %d poses" % (name, len(theirs[0]), len(theirs)))


def shared_files():
    """Those beside the checkout that the evaluation can read, which knows nothing compressed."""
    root = os.environ.get("PENUMBRA_SHARED") or os.path.join(
        os.path.dirname(os.path.abspath(__file__)), "../../../shared")
    for folder in ("scenes/real", "cases"):
        folder = os.path.join(root, folder)
        for name in sorted(os.listdir(folder)) if os.path.isdir(folder) else []:
            path = os.path.join(folder, name)
            try:
                document = gltf_pose.File(path).json
            except Exception:  # no glTF, or a broken one
                continue
            moves = document.get("skins") or document.get("animations") or any(
                "targets" in p for m in document.get("meshes", []) for p in m["primitives"])
            if moves and not document.get("extensionsRequired"):
                yield path, name


def main():
    dump = sys.argv[1]
    with tempfile.TemporaryDirectory() as folder:
        for name, data in pose_files.all_files():
            path = os.path.join(folder, name)
            with open(path, "wb") as file:
                file.write(data)
            compare(dump, path, name)
    for path, name in shared_files():
        compare(dump, path, name)
    sys.exit(1 if failures else 0)


if __name__ == "__main__":
    main()
