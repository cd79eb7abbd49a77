"""Imports every .glb of a folder into OUT/<name>.pscene, as penumbrad would.

usage: import_scenes.py IMPORTER SCENES OUT; exits 77 (skipped) when SCENES is not there.
"""
import hashlib
import os
import struct
import subprocess
import sys


def import_scene(importer, source, target):
    with open(source, "rb") as file:
        digest = hashlib.sha256(file.read()).hexdigest()
    read_end, write_end = os.pipe()
    files = [os.open(source, os.O_RDONLY), os.open(target, os.O_RDWR | os.O_CREAT | os.O_TRUNC), write_end]
    # The importer expects its descriptors at 3, 4 and 5 (import_process.h): out of the way first.
    high = [os.dup2(fd, 20 + i, True) for i, fd in enumerate(files)]

    def place():
        for i, fd in enumerate(high):
            os.dup2(fd, 3 + i, True)

    child = subprocess.Popen([importer, "--mode", "scene", "--source-id", digest],
                             preexec_fn=place, close_fds=False)
    for fd in files + high:
        os.close(fd)
    report = os.read(read_end, 65536)
    os.close(read_end)
    status = child.wait(timeout=120)
    if status or len(report) < 4 or struct.unpack("<I", report[:4])[0]:
        sys.exit(f"{source}: exit {status}, report {report[:700]!r}")


def main():
    importer, scenes, out = sys.argv[1:4]
    if not os.path.isdir(scenes):
        sys.exit(77)
    os.makedirs(out, exist_ok=True)
    for name in sorted(os.listdir(scenes)):
        if name.endswith(".glb"):
            import_scene(importer, os.path.join(scenes, name), os.path.join(out, name[:-4] + ".pscene"))
            print(name)


main()
