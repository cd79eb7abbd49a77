"""The package as it is installed: the wheel that the build made, unpacked, to be imported from."""
import atexit
import glob
import os
import shutil
import subprocess
import sys
import tempfile
import zipfile

HERE = os.path.dirname(os.path.abspath(__file__))
SOURCE = os.path.join(HERE, "..", "..", "clients", "python")
sys.path.insert(0, os.path.join(HERE, "..", "api"))
import harness  # noqa: E402

# Builds of other versions may have left theirs.
PATH = max(glob.glob(os.path.join(harness.BIN, "..", "python", "*.whl")), key=os.path.getmtime)
FOLDER = tempfile.mkdtemp(prefix="penumbra-test-")
atexit.register(shutil.rmtree, FOLDER, True)
with zipfile.ZipFile(PATH) as archive:
    archive.extractall(FOLDER)
sys.path.insert(0, FOLDER)
import penumbra  # noqa: E402

TINY = {"technique": "hard", "width": 24, "height": 16, "deadline_ms": 3600000}


def client(d, **settings):
    """A client of a harness's daemon, that waits long."""
    return penumbra.Client("http://127.0.0.1:%d" % d.port, **{"timeout": 600, **settings})


def demo(folder):
    """The path of the built-in scene, which has shadows."""
    path = os.path.join(folder, "demo.glb")
    subprocess.run([os.path.join(harness.BIN, "penumbra"), "generate", "demo", "-o", path],
                   check=True, stdout=subprocess.DEVNULL)
    return path
