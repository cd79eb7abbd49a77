#!/usr/bin/env python3
"""What renders that take turns cost each other.

    turns.py [--bin DIR] [--tries 100] [--cuts 1000] [beside] [leave] [cut] [largest]

beside   While one client keeps a multisample picture of 256 maps, 16 jittered frames, 1600 x 1200
         going, another asks for pcss pictures of 480 x 360: their times beside those of an idle
         daemon, what share of the renderer they took, and how many samples the long one got done in
         what was left, compared with one that is alone.
leave    Long renders of all sampled methods are begun and left, or their deadline passes: how long
         after that the worker has nothing to do any more.
cut      Requests that are cut off at random moments: memory, descriptors, what is in GPU memory and
         programs after each quarter, and whether anybody else's picture came out different.
largest  Each method begins the largest picture there can be, with 64 jittered frames, and is left:
         whether others were served, and what became of the worker.
Without a name all four.
"""
import argparse
import http.client
import json
import os
import random
import statistics
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, os.path.join(os.path.dirname(__file__), "..", "api"))

LONG = {"technique": {"name": "multisample", "params": {"samples": 256}}, "antialias": 16,
        "width": 1600, "height": 1200, "deadline_ms": 3600000}
SHORT = {"technique": {"name": "pcss"}, "width": 480, "height": 360}
TINY = {"technique": {"name": "none"}, "width": 64, "height": 48}
SAMPLED = ("multisample", "raytraced", "stochastic", "adaptive-sampling", "accumulation", "cascaded",
           "bilateral", "screen-space")
PATIENT, QUICK = "patient-patient-patient", "quick-quick-quick-quick"


class Bench:
    def __init__(self, options):
        import harness  # reads PENUMBRA_BIN when it is imported
        self.wait = harness.wait
        self.tries, self.cuts = options.tries, options.cuts
        self.folder = tempfile.TemporaryDirectory()
        tokens = os.path.join(self.folder.name, "tokens")
        with open(tokens, "w") as file:
            file.write("%s\n%s\n" % (PATIENT, QUICK))
        os.chmod(tokens, 0o600)
        self.daemon = harness.Daemon("--client-share=0", "--token-file=" + tokens)
        path = os.path.join(self.folder.name, "demo.glb")
        subprocess.run([os.path.join(options.bin, "penumbra"), "generate", "demo", "-o", path],
                       check=True, stdout=subprocess.DEVNULL)
        with open(path, "rb") as file:
            answer = self.daemon.call("POST", "/v1/scenes", file.read(), {
                "Content-Type": "model/gltf-binary", "Authorization": "Bearer " + QUICK})
        self.scene = answer.json()["id"]

    def begin(self, request, **headers):
        connection = http.client.HTTPConnection("127.0.0.1", self.daemon.port)
        connection.request("POST", "/v1/scenes/%s/render" % self.scene, json.dumps(request),
                           {"Content-Type": "application/json", "Cache-Control": "no-cache",
                            "Authorization": "Bearer " + PATIENT, **headers})
        return connection

    def begin_best(self, ms):
        """The long one, which ends after so many ms with what it has."""
        return self.begin(dict(LONG, deadline_ms=ms, on_deadline="best"),
                          Accept="application/json")

    @staticmethod
    def samples(connection):
        """How many there are, and how many ms that took."""
        progress = json.loads(connection.getresponse().read())["progress"]
        if progress["samples"] == progress["of"]:
            raise SystemExit("the long one has ended too early to tell")
        return progress["samples"], progress["elapsed_ms"]

    def ask(self, request, **headers):
        return self.daemon.render(self.scene, request, timeout=600,
                                  Authorization="Bearer " + QUICK, **headers)

    def timed(self, request):
        start = time.monotonic()
        answer = self.ask(request)
        if answer.status != 200:
            raise SystemExit(answer.body)
        return 1e3 * (time.monotonic() - start)

    def running(self):
        return self.daemon.metric("penumbra_renders_running")

    def until(self, running, **how):
        self.wait(lambda: self.running() == running, seconds=600, **how)

    def beside(self):
        self.timed(SHORT)
        alone = [self.timed(SHORT) for _ in range(20)]
        print("pcss alone:            " + describe(alone), flush=True)
        self.samples(self.begin_best(5000))  # compiles
        alone_samples, alone_ms = self.samples(self.begin_best(300 * self.tries))
        used, beside, ms = [], [], 750 * self.tries
        end = time.monotonic() + 1e-3 * ms
        long = self.begin_best(ms)
        self.until(1)
        while time.monotonic() < end - 2 and len(beside) < self.tries:
            time.sleep(0.5)
            record = self.ask(SHORT, Accept="application/json").json()
            used.append(record["renderer"]["used_ms"])
            beside.append(self.timed(SHORT))
        samples, long_ms = self.samples(long)
        taken = 2 * sum(used)  # of two requests each that is told once
        print("beside the long one:   " + describe(beside), flush=True)
        print("added at p99:          %.0f ms" % (percentile(beside, 0.99) - percentile(alone, 0.99)))
        print("the others took:       %.1f %% of the renderer" % (1e2 * taken / long_ms))
        lost = 1 - samples / (long_ms - taken) / (alone_samples / alone_ms)
        print("the long one lost:     %.1f %% of the rest" % (1e2 * lost), flush=True)

    def leave(self):
        self.timed(TINY)
        asking = [1e3 * measure(lambda: self.running()) for _ in range(50)]
        after = {}
        for n in range(self.tries):
            name = SAMPLED[n % len(SAMPLED)]
            late = n // len(SAMPLED) % 2 == 1
            request = dict(LONG, technique=name, width=800, height=600)
            if late:
                request["deadline_ms"] = 400 + 10 * (n % 10)
            left = self.begin(request)
            if late:
                left.getresponse().read()
            else:
                self.until(1)
                time.sleep(0.3 + 0.01 * (n % 10))
                left.close()
            after.setdefault(name, []).append(
                1e3 * measure(lambda: self.until(0, step=0.001)))
        everything = [ms for times in after.values() for ms in times]
        print("asking alone:          " + describe(asking))
        print("worker free after:     " + describe(everything))
        for name, times in after.items():
            print("  %-20s " % name + describe(times))
        sys.stdout.flush()

    def state(self):
        pid = self.daemon.worker()
        with open("/proc/%d/status" % pid) as file:
            memory = next(int(line.split()[1]) for line in file if line.startswith("VmRSS"))
        return {"worker": pid, "MiB": memory >> 10, "descriptors": len(os.listdir("/proc/%d/fd" % pid)),
                "GPU MiB": int(self.daemon.metric("penumbra_gpu_bytes")) >> 20,
                "programs": int(self.daemon.metric("penumbra_programs"))}

    def cut(self):
        choose = random.Random(1)
        small = self.ask(SHORT).body
        different = 0
        print("cut off at random:     %s" % self.state(), flush=True)
        for n in range(self.cuts):
            left = self.begin(dict(LONG, technique=choose.choice(SAMPLED), width=320, height=240,
                                   antialias=choose.choice((1, 16))))
            time.sleep(choose.random() * 0.15)
            left.close()
            if n % 10 == 0:
                different += self.ask(SHORT).body != small
            if (n + 1) % max(1, self.cuts // 4) == 0:
                self.until(0)
                print("  after %-16d %s" % (n + 1, self.state()), flush=True)
        print("others' pictures:      %d of %d different" % (different, (self.cuts + 9) // 10))

    def largest(self):
        names = [t["name"] for t in self.daemon.call(
            "GET", "/v1/techniques", headers={"Authorization": "Bearer " + QUICK}
        ).json()["techniques"]]
        served = []
        for name in names:
            left = self.begin(dict(LONG, technique=name, width=8192, height=2048, antialias=64))
            self.until(1)
            time.sleep(1)
            served.append(self.timed(TINY))
            left.close()
            self.until(0)
        print("beside the largest:    " + describe(served))
        print("afterwards:            " + ", ".join("%s %d" % (name, self.daemon.metric(
            "penumbra_" + name)) for name in ("worker_restarts_total", "worker_hangs_total",
                                              "render_retries_total", "quarantined_scenes")))


def measure(call):
    start = time.monotonic()
    call()
    return time.monotonic() - start


def percentile(times, share):
    times = sorted(times)
    return times[max(0, round(share * len(times)) - 1)]


def describe(times):
    return "median %.0f, p99 %.0f, worst %.0f ms" % (
        statistics.median(times), percentile(times, 0.99), max(times))


def main():
    names = ("beside", "leave", "cut", "largest")
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bin", default=os.path.join(os.path.dirname(__file__),
                                                      "../../build/dev/bin"))
    parser.add_argument("--tries", type=int, default=100)
    parser.add_argument("--cuts", type=int, default=1000)
    parser.add_argument("what", nargs="*", help=", ".join(names))
    options = parser.parse_args()
    unknown = set(options.what) - set(names)
    if unknown:
        parser.error("there is no " + ", ".join(sorted(unknown)))
    os.environ["PENUMBRA_BIN"] = os.path.abspath(options.bin)
    bench = Bench(options)
    try:
        for name in options.what or names:
            getattr(bench, name)()
    finally:
        bench.daemon.kill()


if __name__ == "__main__":
    main()
