"""A second generator that is not ours: Perl's OpenAPI::Client (Debian: libopenapi-client-perl) makes a
client of the document while it runs, which uploads and renders. Exits 77 (skipped) without it."""
import hashlib
import json
import os
import subprocess
import sys
import unittest

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(HERE, "../api"))
import harness  # noqa: E402

# It would fetch this to check the document with, which a linter does in test_openapi.py.
META = "https://spec.openapis.org/oas/3.1/schema/2021-05-20"


class Perl(unittest.TestCase):
    def test_client(self):
        d = harness.Daemon()
        self.addCleanup(d.kill)
        with open(os.path.join(d.folder, hashlib.md5(META.encode()).hexdigest()), "w") as file:
            json.dump({"$id": META, "$schema": "https://json-schema.org/draft/2020-12/schema",
                       "type": "object"}, file)
        scene = os.path.join(d.folder, "scene.glb")
        with open(scene, "wb") as file:
            file.write(harness.grid_scene(4, "perl"))
        ran = subprocess.run(["perl", os.path.join(HERE, "generated_client.pl"),
                              "http://127.0.0.1:%d" % d.port, scene], capture_output=True,
                             env={**os.environ, "JSON_VALIDATOR_CACHE_PATH": d.folder})
        self.assertEqual(ran.returncode, 0, ran.stderr.decode())
        told = json.loads(ran.stdout)
        self.assertEqual(told["techniques"],
                         [t["name"] for t in d.get("/v1/techniques").json()["techniques"]])
        stored = d.get("/v1/scenes/" + told["id"]).json()
        self.assertEqual((stored["triangles"], stored["name"]), (32, "From Perl"))
        self.assertEqual((told["magic"], told["size"], told["type"]),
                         ("89504e470d0a1a0a", [160, 120], "image/png"))
        self.assertEqual(told["refused"], 400)  # by the client, as the document says: no such width
        self.assertEqual(d.stop(), 0)


if __name__ == "__main__":
    if subprocess.run(["perl", "-MOpenAPI::Client", "-e1"], capture_output=True).returncode:
        print("skipped: no OpenAPI::Client")
        sys.exit(77)
    harness.main()
