"""Node, and the packages of package.json, for the tests of this folder."""
import os
import shutil
import subprocess

HERE = os.path.dirname(os.path.abspath(__file__))
MODULES = os.path.join(HERE, "../../clients/js")
INSTALL_S = 900


def has_node(least=18):
    version = shutil.which("node") and subprocess.run(
        ["node", "-p", "process.versions.node"], capture_output=True, text=True, check=False).stdout
    return bool(version) and int(version.split(".")[0]) >= least


def run_node(test, timeout, **env):
    """Runs the tests of a file of this folder and returns node's exit status."""
    return subprocess.run(["node", "--test", "--test-reporter=spec", os.path.join(HERE, test)],
                          env={**os.environ, **env}, timeout=timeout, check=False).returncode


def install(folder):
    """What package.json asks for, once; False when that is not to be had."""
    os.makedirs(folder, exist_ok=True)
    with open(os.path.join(HERE, "package.json"), "rb") as file:
        wanted = file.read()
    stamp = os.path.join(folder, "installed.json")
    if os.path.exists(stamp) and open(stamp, "rb").read() == wanted:
        return True
    shutil.copy(os.path.join(HERE, "package.json"), folder)
    try:
        run = subprocess.run(["npm", "install", "--no-audit", "--no-fund", "--no-package-lock",
                              "--fetch-retries=1", "--fetch-timeout=60000"],
                             cwd=folder, timeout=INSTALL_S, check=False, capture_output=True)
    except subprocess.TimeoutExpired:
        return False
    if run.returncode:
        print(run.stderr.decode()[-1500:])
        return False
    with open(stamp, "wb") as file:
        file.write(wanted)
    return True
