"""What smooth edges cost: processor time of a frame with them over that without, in alternation.

The camera turns by a degree from frame to frame.

usage: edge_cost.py PENUMBRA_SHOT SCENE [key=value ...]; a scene as penumbra-shot takes it. The load
of the machine changes both times and their ratio less: give it several rounds (ROUNDS=9).
"""
import os
import resource
import subprocess
import sys
import tempfile

FEW, MANY = 2, 10  # frames; the difference has no start in it


def seconds(shot, scene, settings, frames):
    def spent():
        usage = resource.getrusage(resource.RUSAGE_CHILDREN)
        return usage.ru_utime + usage.ru_stime
    before = spent()
    with tempfile.NamedTemporaryFile(suffix=".png") as file:
        subprocess.run([shot, scene, file.name, "repeat=%d" % frames, "turn=1"] + settings, check=True,
                       stdout=subprocess.DEVNULL)
    return spent() - before


def main():
    shot, scene, settings = sys.argv[1], sys.argv[2], sys.argv[3:]
    ratios = []
    for _ in range(int(os.environ.get("ROUNDS", "5"))):
        without, smooth = (seconds(shot, scene, settings + ["edges=" + word], MANY) -
                           seconds(shot, scene, settings + ["edges=" + word], FEW)
                           for word in ("none", "smooth"))
        ratios.append(smooth / without)
        print("%.1f ms without, %.1f ms with: x%.3f" % (without * 1e3 / (MANY - FEW),
                                                       smooth * 1e3 / (MANY - FEW), ratios[-1]))
    print("median x%.3f of %d rounds, load %.1f" % (sorted(ratios)[len(ratios) // 2], len(ratios),
                                                    os.getloadavg()[0]))


if __name__ == "__main__":
    main()
