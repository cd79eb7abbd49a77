#!/usr/bin/env python3
"""Whether the daemon is still up on Monday.

    endure.py [--bin DIR] [--minutes 30] [--seed 1] [kills] [stopped] [compares] [restarts] [scenes] [soak]

kills     The worker is killed every two seconds while three clients ask: errors, and how soon the
          next one takes jobs. A sixth of the --minutes. Must hold: no error, 500 ms.
stopped   The worker is stopped (SIGSTOP): how soon /readyz says so, and when pictures come again.
          Must hold: 3 s and 12 s.
compares  32 comparisons at once: what became of them. Must hold: those let in are all done.
restarts  50 restarts (SIGTERM, then a new daemon on the same store and port) while three clients
          ask: accepted requests that got no answer. Must hold: none.
scenes    200 scenes that take twice --gpu-memory (256M), in random order, 600 pictures: whether every
          picture of a scene is the same bytes, and the worker's peak beside the budget. Must hold:
          all of them, budget + 150 MiB.
soak      Everything that changes for --minutes: methods, sizes, scenes that come and go, comparisons,
          clients that leave: memory, descriptors, GPU memory and programs, and their slopes over the
          second half (Theil and Sen's median of slopes). Must hold: within what --slack allows.
Without a name all of them. Exits 1 when something does not hold.
"""
import argparse
import http.client
import json
import os
import random
import signal
import socket
import statistics
import sys
import threading
import time

FOLDER = os.path.dirname(os.path.abspath(__file__))
sys.path[:0] = [FOLDER, os.path.join(FOLDER, ".."), os.path.join(FOLDER, "../../api")]

import memory  # noqa: E402

CLIENTS = 3
BUDGET_MIB = 256
BACK_MS, NOT_READY_S, RECOVERED_S = 500, 3, 12
SAMPLES = 240  # of what is watched in a soak
# How much may come a minute in the second half of a soak: noise of a quarter of an hour, no leak of a
# kilobyte a picture.
SLACK = {"daemon MiB": 0.5, "worker MiB": 4, "descriptors": 0.2, "worker descriptors": 0.2,
         "GPU MiB": 8, "programs": 2}
FINE = (200, 201, 204, 413, 422, 429, 503, 504)


def free_port():
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        return s.getsockname()[1]


def view(dice, side=(160, 120)):
    return {"width": side[0], "height": side[1], "technique": "pcss", "deadline_ms": 30000,
            "camera": {"eye": [dice.uniform(1, 2), dice.uniform(1, 2), dice.uniform(1, 2)],
                       "target": [0, 0.4, 0]}}


class Clients:
    """Ask for pictures until they are told to stop."""

    def __init__(self, daemon, scene, ask_again):
        self.daemon, self.scene, self.ask_again = daemon, scene, ask_again
        self.statuses, self.lost, self.stop = {}, [], threading.Event()
        self.threads = [threading.Thread(target=self.run, args=(n,)) for n in range(CLIENTS)]
        for thread in self.threads:
            thread.start()

    def run(self, seed):
        dice = random.Random(seed)
        while not self.stop.is_set():
            connection = http.client.HTTPConnection("127.0.0.1", self.daemon.port, timeout=60)
            try:
                connection.connect()
            except OSError:
                time.sleep(0.01)  # nobody listens: nothing was accepted
                continue
            sent = False
            try:
                connection.request("POST", "/v1/scenes/%s/render" % self.scene,
                                   json.dumps(view(dice)), {"Content-Type": "application/json"})
                sent = True
                answer = connection.getresponse()
                answer.read()
                self.statuses[answer.status] = self.statuses.get(answer.status, 0) + 1
            except (OSError, http.client.HTTPException) as error:
                # What was closed before anything of an answer came may be asked for again (RFC 9110,
                # 9.2.2); the daemon owes an answer to what it has read.
                never_read = isinstance(error, (ConnectionResetError, BrokenPipeError,
                                                http.client.RemoteDisconnected))
                if not (self.ask_again and never_read):
                    self.lost.append("%s %s" % ("sent" if sent else "sending", error))
            finally:
                connection.close()

    def end(self):
        self.stop.set()
        for thread in self.threads:
            thread.join()
        bad = {s: n for s, n in self.statuses.items() if s != 200}
        return self.statuses.get(200, 0), bad, self.lost


def slope(points):
    """Of (minutes, value), a minute: the median of those between any two."""
    slopes = [(b[1] - a[1]) / (b[0] - a[0]) for i, a in enumerate(points) for b in points[i + 1:]
              if b[0] > a[0]]
    return statistics.median(slopes) if slopes else 0


class Endurance:
    def __init__(self, options):
        import harness  # reads PENUMBRA_BIN when it is imported
        self.harness, self.options, self.failed = harness, options, False

    def judge(self, text, figure, holds):
        print("  %-52s %s  %s" % (text, figure, "holds" if holds else "DOES NOT HOLD"), flush=True)
        self.failed |= not holds

    def daemon(self, *flags):
        daemon = self.harness.Daemon("--client-share=0", *flags)
        return daemon, daemon.upload(self.harness.grid_scene(8))

    def close(self, daemon):
        if daemon.process.poll() is None:
            daemon.stop(timeout=120)
        daemon.kill()

    def kills(self):
        print("kills")
        daemon, scene = self.daemon()
        daemon.worker()
        clients, backs = Clients(daemon, scene, False), []
        end = time.monotonic() + 60 * self.options.minutes / 6
        while time.monotonic() < end:
            pid = daemon.worker()
            os.kill(pid, signal.SIGKILL)
            killed = time.monotonic()
            self.harness.wait(lambda: pid not in daemon.children("penumbra-worker"))
            daemon.worker()
            backs.append(1e3 * daemon.metric("penumbra_worker_back_seconds"))
            time.sleep(max(0, killed + 2 - time.monotonic()))
        good, bad, lost = clients.end()
        self.judge("errors of %d pictures" % good, "%s %s" % (bad, lost[:3]), not bad and not lost)
        self.judge("back, p50 and most of %d" % len(backs), "%.0f %.0f ms" % (
            statistics.median(backs), max(backs)), max(backs) <= BACK_MS)
        self.close(daemon)

    def stopped(self):
        print("stopped")
        daemon, scene = self.daemon("--silence-timeout-ms=8000")
        self.harness.wait(lambda: daemon.admin("/readyz").status == 200)
        os.kill(daemon.worker(), signal.SIGSTOP)
        start = time.monotonic()
        self.harness.wait(lambda: daemon.admin("/readyz").status == 503)
        unready = time.monotonic() - start
        answer = daemon.render(scene, view(random.Random(1)))
        recovered = time.monotonic() - start
        self.judge("not ready", "%.1f s" % unready, unready <= NOT_READY_S)
        self.judge("pictures again (%d)" % answer.status, "%.1f s" % recovered,
                   answer.status == 200 and recovered <= RECOVERED_S)
        self.close(daemon)

    def compares(self):
        print("compares")
        daemon, scene = self.daemon()
        statuses = []

        def ask(n):
            body = {"width": 160, "height": 120, "exposure_ev": n / 100, "deadline_ms": 30000,
                    "techniques": ["hard", "pcss", "vssm"],
                    "reference": {"name": "raytraced", "params": {"samples": 64}}}
            answer = daemon.call("POST", "/v1/scenes/%s/compare" % scene, json.dumps(body),
                                 {"Content-Type": "application/json"}, timeout=120)
            statuses.append((answer.status, int(answer.headers.get("Retry-After", 0))))
        ask(99)  # its cost is learned
        statuses.clear()
        threads = [threading.Thread(target=ask, args=(n,)) for n in range(32)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        counts = {s: sum(t[0] == s for t in statuses) for s in {t[0] for t in statuses}}
        self.judge("of 32", counts, set(counts) <= {200, 429, 503} and counts.get(200, 0) > 0)
        self.judge("refused without Retry-After",
                   sum(s in (429, 503) and not r for s, r in statuses),
                   all(s == 200 or r for s, r in statuses))
        self.close(daemon)

    def restarts(self):
        print("restarts")
        ports = free_port(), free_port()
        daemon, scene = self.daemon("--listen=127.0.0.1:%d" % ports[0],
                                    "--admin-listen=127.0.0.1:%d" % ports[1])
        clients, status = Clients(daemon, scene, True), []
        for _ in range(50):
            time.sleep(0.3)
            status.append(daemon.stop(timeout=120))
            daemon.start()
        time.sleep(0.5)
        good, bad, lost = clients.end()
        bad.pop(503, None)  # told that it is shutting down
        self.judge("lost of %d pictures" % good, "%s %s" % (bad, lost[:3]), not bad and not lost)
        self.judge("exits", set(status), set(status) == {0})
        self.close(daemon)

    def scenes(self):
        print("scenes")
        daemon, _ = self.daemon("--gpu-memory=%dM" % BUDGET_MIB, "--store-limit=0")
        dice, ids, first, bad = random.Random(self.options.seed), [], {}, 0
        for n in range(200):  # about 2 n^2 triangles: 2.6 MiB each in GPU memory
            ids.append(daemon.upload(self.harness.grid_scene(dice.randrange(100, 220), "of 200: %d" % n)))
        total = sum(daemon.get("/v1/scenes/" + i).json()["gpu_bytes"] for i in ids) / 2**20
        order = ids * 3
        dice.shuffle(order)
        for scene in order:
            answer = daemon.render(scene, {"width": 64, "height": 48, "technique": "pcss"})
            same = first.setdefault(scene, answer.body) == answer.body
            bad += answer.status != 200 or not same
        peak = memory.resident(daemon.worker(), "VmHWM")
        self.judge("wrong of %d pictures of %.0f MiB of scenes" % (len(order), total), bad,
                   not bad and total >= 2 * BUDGET_MIB)
        self.judge("peak of the worker", "%.0f MiB" % peak, peak <= BUDGET_MIB + 150)
        self.close(daemon)

    def watched(self, daemon):
        worker = daemon.worker()
        return {"daemon MiB": memory.resident(daemon.process.pid, "VmRSS"),
                "worker MiB": memory.resident(worker, "VmRSS"),
                "descriptors": len(os.listdir("/proc/%d/fd" % daemon.process.pid)),
                "worker descriptors": len(os.listdir("/proc/%d/fd" % worker)),
                "GPU MiB": daemon.metric("penumbra_gpu_bytes") / 2**20,
                "programs": daemon.metric("penumbra_programs")}

    def change(self, daemon, scenes, techniques, dice):
        """One thing that a client may do; its status, or None when it left."""
        what = dice.random()
        if what < 0.05 or not scenes:
            answer = daemon.call("POST", "/v1/scenes", self.harness.grid_scene(
                dice.randrange(2, 60), "soak %d" % dice.getrandbits(60)),
                {"Content-Type": "model/gltf-binary"})
            if answer.status == 201:
                scenes.append(answer.json()["id"])
            return answer.status
        if what < 0.10 and len(scenes) > 12:
            return daemon.call("DELETE", "/v1/scenes/" + scenes.pop(
                dice.randrange(len(scenes)))).status
        scene = dice.choice(scenes)
        body = memory.request(dice.choice(techniques), 0.25, dice)
        body["width"], body["height"] = min(body["width"], 200), min(body["height"], 150)
        if what < 0.15:
            asked = {"width": 64, "height": 48, "techniques": [body["technique"]],
                     "reference": {"name": "raytraced", "params": {"samples": 16}},
                     "deadline_ms": 8000}
            return daemon.call("POST", "/v1/scenes/%s/compare" % scene, json.dumps(asked),
                               {"Content-Type": "application/json"}, timeout=120).status
        if what < 0.25:
            text = json.dumps(body)
            with socket.create_connection(("127.0.0.1", daemon.port)) as s:
                s.sendall(("POST /v1/scenes/%s/render HTTP/1.1\r\nHost: localhost\r\nContent-Type: "
                           "application/json\r\nContent-Length: %d\r\n\r\n%s" % (
                               scene, len(text), text)).encode())
                time.sleep(dice.uniform(0, 0.2))
            return None
        return daemon.render(scene, body, timeout=120).status

    def soak(self):
        print("soak")
        daemon, _ = self.daemon("--gpu-memory=512M", "--store-limit=200M", "--result-cache=4M")
        dice, scenes, counts, worker = random.Random(self.options.seed), [], {}, daemon.worker()
        techniques = [t for t in daemon.get("/v1/techniques").json()["techniques"]
                      if t["name"] != "auto"]
        start, points = time.monotonic(), []
        seconds = 60 * self.options.minutes
        while time.monotonic() - start < seconds:
            status = self.change(daemon, scenes, techniques, dice)
            counts[status] = counts.get(status, 0) + 1
            at = time.monotonic() - start
            if at >= len(points) * seconds / SAMPLES:
                points.append((at / 60, self.watched(daemon)))
                if len(points) % (SAMPLES // 12) == 1:
                    print("  %5.1f min %s" % (points[-1][0], {
                        k: round(v) for k, v in points[-1][1].items()}), flush=True)
        self.judge("answers %s" % counts, "", set(counts) <= {*FINE, None})
        self.judge("workers", 1 if daemon.worker() == worker else "several",
                   daemon.worker() == worker)
        half = points[len(points) // 2:]
        for name, slack in SLACK.items():
            rate = slope([(at, values[name]) for at, values in half])
            values = [v[name] for _, v in half]
            self.judge("%s, a minute (from %.0f to %.0f)" % (name, min(values), max(values)),
                       "%+.2f" % rate, rate <= slack)
        self.close(daemon)


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bin", default=os.path.join(FOLDER, "../../../build/dev/bin"))
    parser.add_argument("--minutes", type=float, default=30)
    parser.add_argument("--seed", type=int, default=1)
    names = ("kills", "stopped", "compares", "restarts", "scenes", "soak")
    parser.add_argument("what", nargs="*", help=", ".join(names))
    options = parser.parse_args()
    if not set(options.what) <= set(names):
        parser.error("one of " + ", ".join(names))
    os.environ["PENUMBRA_BIN"] = os.path.abspath(options.bin)
    endurance = Endurance(options)
    for name in options.what or names:
        getattr(endurance, name)()
    return 1 if endurance.failed else 0


if __name__ == "__main__":
    sys.exit(main())
