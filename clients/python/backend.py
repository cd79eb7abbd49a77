"""Makes the wheel, with nothing but Python: `backend.py OPENAPI.json FOLDER` prints its path.

What of the package comes out of the OpenAPI document is generated on the way (generate.py). It is
also the build backend that pyproject.toml names: PENUMBRA_OPENAPI says where the document is.
"""
import ast
import base64
import hashlib
import json
import os
import re
import sys
import zipfile

import generate

HERE = os.path.dirname(os.path.abspath(__file__))
EPOCH = (1980, 1, 1, 0, 0, 0)  # the same sources make the same bytes


def settings():
    """{key: value} of pyproject.toml; tomllib is Python 3.11's; this is all that is there."""
    with open(os.path.join(HERE, "pyproject.toml"), encoding="utf-8") as file:
        rows = re.findall(r'^([\w-]+) = (["\[].*)$', file.read(), re.M)
    return {key: ast.literal_eval(value) for key, value in rows}


def metadata(version):
    said = settings()
    lines = ["Metadata-Version: 2.1", "Name: " + said["name"], "Version: " + version,
             "Summary: " + said["description"], "Requires-Python: " + said["requires-python"],
             "Provides-Extra: numpy"]
    lines += ['Requires-Dist: %s ; extra == "numpy"' % name for name in said["numpy"]]
    return "\n".join(lines) + "\n"


def digest(data):
    return base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()


def sources():
    folder = os.path.join(HERE, "penumbra")
    for name in sorted(os.listdir(folder)):
        if name.endswith(".py") or name == "py.typed":
            with open(os.path.join(folder, name), "rb") as file:
                yield "penumbra/" + name, file.read()


def make(document_path, folder):
    """Writes the wheel into the folder and returns its name."""
    with open(document_path, encoding="utf-8") as file:
        document = json.load(file)
    version = document["info"]["version"]
    files = dict(sources())
    files.update(("penumbra/" + name, text.encode()) for name, text in
                 generate.generate(document).items())
    label = "%s-%s" % (settings()["name"].replace("-", "_"), version)
    info = label + ".dist-info/"
    files[info + "METADATA"] = metadata(version).encode()
    files[info + "WHEEL"] = (b"Wheel-Version: 1.0\nGenerator: penumbra\nRoot-Is-Purelib: true\n"
                             b"Tag: py3-none-any\n")
    rows = ["%s,sha256=%s,%d" % (name, digest(data), len(data)) for name, data in files.items()]
    files[info + "RECORD"] = "\n".join(rows + [info + "RECORD,,", ""]).encode()
    wheel = label + "-py3-none-any.whl"
    os.makedirs(folder, exist_ok=True)
    with zipfile.ZipFile(os.path.join(folder, wheel), "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in files.items():
            entry = zipfile.ZipInfo(name, EPOCH)
            entry.external_attr = 0o100644 << 16
            entry.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(entry, data)
    return wheel


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    document = os.environ.get("PENUMBRA_OPENAPI")
    if not document:
        sys.exit("PENUMBRA_OPENAPI names the document: penumbrad --print-openapi > openapi.json")
    return make(document, wheel_directory)


if __name__ == "__main__":
    print(os.path.join(sys.argv[2], make(*sys.argv[1:])))
