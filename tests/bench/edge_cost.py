"""What smooth edges cost: processor time of frames with them over that of frames without, which
alternate, while the camera turns by a degree from frame to frame.

usage: edge_cost.py PENUMBRA_SHOT SCENE [key=value ...]; a scene as penumbra-shot takes it. FRAMES=82
"""
import os
import re
import subprocess
import sys
import tempfile


def main():
    shot, scene, settings = sys.argv[1], sys.argv[2], sys.argv[3:]
    frames = os.environ.get("FRAMES", "82")
    with tempfile.NamedTemporaryFile(suffix=".png") as file:
        text = subprocess.run([shot, scene, file.name, "repeat=" + frames, "turn=1", "edges=smooth",
                               "against=edges=none"] + settings, check=True, text=True,
                              stdout=subprocess.PIPE).stdout
    smooth, without = map(float, re.search(r"processor +(\S+) ms, with edges=none (\S+) ms",
                                           text).groups())
    print("%.1f ms without, %.1f ms with: x%.3f, load %.1f" %
          (without, smooth, smooth / without, os.getloadavg()[0]))


if __name__ == "__main__":
    main()
