"""Those who race: each is started on a scene and then makes frames, one after the other.

A job is {"mode", "eye", "target", "light": {"position", "target", "size"}, "keep_map", "samples",
"request"}; `request` is what else penumbra is asked for. What comes back is a Frame."""
import http.client
import json
import os
import re
import signal
import subprocess
import tempfile
import time

import processes


class Frame:
    def __init__(self, ms, png, **more):
        self.ms, self.png, self.more = ms, png, more


class Contender:
    """`start` sets self.process."""
    process = None

    def pids(self):
        return processes.tree(self.process.pid)

    def stop(self):
        if self.process and self.process.poll() is None:
            self.process.send_signal(signal.SIGTERM)
            try:
                self.process.wait(15)
            except subprocess.TimeoutExpired:
                for pid in reversed(self.pids()):
                    os.kill(pid, signal.SIGKILL)
                self.process.wait()


class OverHttp(Contender):
    connection = None

    def post(self, path, body, headers, port):
        """(milliseconds from request to the last byte, answer, body), over one connection."""
        if not self.connection:
            self.connection = http.client.HTTPConnection("127.0.0.1", port, timeout=3600)
            self.connection.connect()
        begun = time.perf_counter()
        self.connection.request("POST", path, body, headers)
        answer = self.connection.getresponse()
        data = answer.read()
        ms = 1e3 * (time.perf_counter() - begun)
        if answer.status >= 300:
            raise RuntimeError("%s: %d %s" % (path, answer.status, data[:500]))
        return ms, answer, data


class Penumbra(OverHttp):
    def __init__(self, programs, settings, store, *flags, env=None):
        """`settings`: width, height, fov."""
        self.settings, self.scenes = settings, {}
        command = [os.path.join(programs, "penumbrad"), "--listen=127.0.0.1:0", "--client-share=0",
                   "--admin-listen=127.0.0.1:0", "--keep-alive-ms=3600000",
                   "--store=" + store, *flags]
        self.log = tempfile.TemporaryFile()
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=self.log,
                                        env={**os.environ, **(env or {})})
        line = self.process.stdout.readline().decode()
        found = re.search(r"://[\d.]+:(\d+) \(admin: http://[\d.]+:(\d+)\)", line)
        if not found:
            self.log.seek(0)
            raise RuntimeError("penumbrad did not start: %s" % self.log.read())
        self.port, self.admin_port = int(found[1]), int(found[2])

    def get(self, path, port=None):
        connection = http.client.HTTPConnection("127.0.0.1", port or self.port, timeout=60)
        try:
            connection.request("GET", path)
            answer = connection.getresponse()
            return answer.status, answer.read()
        finally:
            connection.close()

    def wait_ready(self, seconds=600):
        end = time.monotonic() + seconds
        while self.get("/readyz", self.admin_port)[0] != 200:
            if time.monotonic() > end:
                raise RuntimeError("penumbrad is not ready")
            time.sleep(0.005)

    def filled(self):
        """Whether every method's programs are in the driver's cache."""
        text = self.get("/metrics", self.admin_port)[1].decode()
        found = re.search(r"^penumbra_shader_cache_fill_seconds (\S+)", text, re.M)
        return bool(found and float(found[1]) > 0)

    def worker(self):
        return next(pid for pid in self.pids()[1:] if "penumbra-worker" in processes.command(pid))

    def upload(self, path):
        if path not in self.scenes:
            with open(path, "rb") as file:
                _, _, data = self.post("/v1/scenes", file.read(),
                                       {"Content-Type": "model/gltf-binary"}, self.port)
            self.scenes[path] = json.loads(data)["id"]
        return self.scenes[path]

    def request(self, job):
        light = job["light"]
        size = light["size"]
        return {"width": self.settings["width"], "height": self.settings["height"],
                "technique": job.get("mode", "pcss"), "ground": False, "sky": False, "edges": "none",
                "exposure_ev": 0, "deadline_ms": 3600000,
                "camera": {"eye": job["eye"], "target": job["target"],
                           "fov_y_deg": self.settings["fov"]},
                "lights": [{"type": "rect", "width": size, "height": size,
                            "position": light["position"], "target": light["target"],
                            "radiance": light["radiance"]}], **job.get("request", {})}

    def ask(self, scene, job, kind):
        return self.post("/v1/scenes/%s/render" % self.upload(scene), json.dumps(self.request(job)), {
            "Content-Type": "application/json", "Cache-Control": "no-cache", "Accept": kind}, self.port)

    def frame(self, scene, job):
        ms, _, png = self.ask(scene, job, "image/png")
        return Frame(ms, png)

    def record(self, scene, job):
        """What it says of a frame: passes, what was kept."""
        return json.loads(self.ask(scene, job, "application/json")[2])


class Three(OverHttp):
    def __init__(self, modules, scenes, chromium, settings):
        self.settings = settings
        script = os.path.join(os.path.dirname(os.path.abspath(__file__)), "three.mjs")
        self.process = subprocess.Popen(["node", script, modules, scenes, chromium],
                                        stdout=subprocess.PIPE)
        self.port = json.loads(self.process.stdout.readline())["port"]

    def frame(self, scene, job):
        light = job["light"]
        page = {"scene": "/" + os.path.basename(scene), "mode": job["mode"],
                "width": self.settings["width"], "height": self.settings["height"],
                "fov": self.settings["fov"], "map": 2048, "near": light["near"], "far": light["far"],
                "half_angle": light["half_angle"],
                "candela": light["radiance"] * job.get("base_size", light["size"]) ** 2}
        ms, answer, png = self.post("/frame", json.dumps(dict(job, page=page)), {}, self.port)
        return Frame(ms, png, draw_ms=float(answer.headers["x-draw-ms"]),
                     encode_ms=float(answer.headers["x-encode-ms"]),
                     triangles=int(answer.headers["x-triangles"]),
                     about=json.loads(answer.headers["x-about"]))

    def close_pages(self):
        self.post("/close", "", {}, self.port)


class OverPipe(Contender):
    """A program that reads a job per line and writes an answer per line; its times are its own,
    without HTTP."""

    def __init__(self, command, settings, folder):
        self.settings = settings
        self.picture = os.path.join(folder, "frame-of-a-peer.png")
        debian = {**os.environ, "PATH": "/usr/bin:/bin"}  # whatever Python else comes first
        self.process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                                        stderr=subprocess.DEVNULL, text=True, env=debian)

    def stop(self):
        try:
            self.process.stdin.close()  # ends it
            self.process.wait(15)
        except (BrokenPipeError, subprocess.TimeoutExpired):
            super().stop()

    def frame(self, _, job):
        job = dict(job, far=job["light"]["far"], file=self.picture,
                   shadows=job["mode"] != "none", samples=job.get("samples", 1))
        try:
            print(json.dumps(job), file=self.process.stdin, flush=True)
        except BrokenPipeError:
            pass  # the end is read below
        line = " "
        while line and not line.startswith("{"):  # some say who they are
            line = self.process.stdout.readline()
        if not line:
            raise RuntimeError("%s has ended" % " ".join(self.process.args))
        answer = json.loads(line)
        with open(self.picture, "rb") as file:
            return Frame(answer["ms"], file.read(), about=answer["about"])


def shape(settings):
    return [str(settings[name]) for name in ("width", "height", "fov")]


def script(name):
    return os.path.join(os.path.dirname(os.path.abspath(__file__)), name)


class Vtk(OverPipe):
    def __init__(self, scene, mode, settings, folder):
        super().__init__(["xvfb-run", "-a", "/usr/bin/python3", "-B", script("frames_vtk.py"), scene,
                          *shape(settings), mode], settings, folder)


class Cycles(OverPipe):
    def __init__(self, scene, settings, folder):
        super().__init__(["blender", "-b", "--factory-startup", "-noaudio", "-P",
                          script("frames_cycles.py"), "--", scene, *shape(settings)], settings, folder)
