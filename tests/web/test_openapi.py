"""The contract, as others read it: a linter finds nothing, and a generator that is not ours makes a
client of it that type-checks, uploads and renders.

usage: test_openapi.py FOLDER, where the packages of package.json are kept. Exits 77 (skipped) when
there is no npm, or when it cannot install them."""
import json
import os
import shutil
import subprocess
import sys
import tempfile
import unittest

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(HERE, "../api"))
from harness import Daemon, grid_scene  # noqa: E402
from tools import MODULES, install  # noqa: E402


class OpenApi(unittest.TestCase):
    def setUp(self):
        self.d = Daemon()
        self.work = tempfile.mkdtemp(dir=FOLDER)
        with open(os.path.join(self.work, "openapi.json"), "wb") as file:
            file.write(self.d.exchange("GET", "/openapi.json").body)

    def tearDown(self):
        shutil.rmtree(self.work)
        self.assertEqual(self.d.stop(), 0)
        self.d.kill()

    def run_tool(self, name, *arguments):
        return subprocess.run([os.path.join(FOLDER, "node_modules/.bin", name), *arguments],
                              cwd=self.work, check=False, capture_output=True, timeout=900)

    def test_lint(self):
        # Our schemas are closed themselves; the linter's own closing does not see through if and then.
        with open(os.path.join(self.work, "redocly.yaml"), "w") as file:
            file.write("extends: [recommended]\nrules:\n  no-invalid-media-type-examples:\n"
                       "    severity: error\n    allowAdditionalProperties: true\n")
        run = self.run_tool("redocly", "lint", "openapi.json", "--format=json")
        text = run.stdout.decode()
        problems = json.loads(text[text.index("{"):])["problems"]
        # The project has no licence to name.
        self.assertEqual([(p["ruleId"], p["message"], p["location"][0]["pointer"])
                          for p in problems if p["ruleId"] != "info-license"], [])

    def test_types_of_the_javascript_client(self):
        """Its comments are types that hold, and they are those of the document."""
        for name in ("penumbra.js", "schema_types.py"):
            shutil.copy(os.path.join(MODULES, name), self.work)
        shutil.copy(os.path.join(HERE, "typed_use.ts"), self.work)
        subprocess.run([sys.executable, "-B", "schema_types.py", "openapi.json", "schemas.d.ts"],
                       cwd=self.work, check=True)
        strict = ("--strict", "--target", "es2022", "--module", "esnext", "--moduleResolution",
                  "bundler", "--lib", "es2023,dom,dom.iterable,dom.asynciterable")
        for arguments in (("--allowJs", "--checkJs", "--declaration", "--emitDeclarationOnly",
                           "--outDir", "declared", "penumbra.js"),
                          ("--noEmit", os.path.join("declared", "typed_use.ts"))):
            run = self.run_tool("tsc", *strict, *arguments)
            self.assertEqual(run.returncode, 0, run.stdout.decode()[-3000:])
            for name in ("typed_use.ts", "schemas.d.ts"):
                shutil.copy(os.path.join(self.work, name), os.path.join(self.work, "declared"))

    def test_generated_client(self):
        run = self.run_tool("openapi-ts", "-i", "openapi.json", "-o", "client", "-c",
                            "@hey-api/client-fetch")
        self.assertEqual(run.returncode, 0, run.stderr.decode()[-3000:] + run.stdout.decode()[-3000:])
        run = self.run_tool("tsc", "--noEmit", "--strict", "--target", "es2022", "--module", "esnext",
                            "--moduleResolution", "bundler", "--skipLibCheck",
                            os.path.join("client", "index.ts"))
        self.assertEqual(run.returncode, 0, run.stdout.decode()[-3000:])
        shutil.copy(os.path.join(HERE, "generated_client.ts"), self.work)
        run = self.run_tool("esbuild", "generated_client.ts", "--bundle", "--platform=node",
                            "--format=esm", "--outfile=used.mjs")
        self.assertEqual(run.returncode, 0, run.stderr.decode()[-3000:])
        scene = os.path.join(self.work, "scene.glb")
        with open(scene, "wb") as file:
            file.write(grid_scene(4))
        run = subprocess.run(["node", "used.mjs", "http://127.0.0.1:%d" % self.d.port, scene],
                             cwd=self.work, check=False, capture_output=True, timeout=300)
        self.assertEqual(run.returncode, 0, run.stderr.decode()[-3000:])
        told = json.loads(run.stdout)
        self.assertEqual(told["techniques"], [
            t["name"] for t in self.d.get("/v1/techniques").json()["techniques"]])
        self.assertIn(told["id"], [s["id"] for s in self.d.get("/v1/scenes").json()["scenes"]])
        self.assertEqual((told["magic"], told["width"], told["height"]),
                         ("\x89PNG\r\n\x1a\n", 160, 120))
        self.assertEqual(told["problem"]["pointer"], "/width")


if __name__ == "__main__":
    FOLDER = os.path.abspath(sys.argv.pop(1))
    if not shutil.which("npm") or not shutil.which("node"):
        print("skipped: npm is not installed")
        sys.exit(77)
    if not install(FOLDER):
        print("skipped: the packages cannot be installed")
        sys.exit(77)
    unittest.main(verbosity=2)
