#!/usr/bin/env python3
"""Runs every fuzzer of a build for so long, from its corpus.

    run.py BUILD [--seconds 60] [--jobs 2] [--only NAME] [--seed 1] [--grow]

BUILD is a tree of the preset `fuzz`; corpus/NAME.zip holds what a fuzzer begins from, and importers
begin from the files of tests/api/hostile_files.py, too. A run's inputs follow from its seed (1, or
--seed N; 0 takes another each time). What ends one stays in BUILD/fuzz-faults, and
the command that repeats it is printed; the exit status is then 1. --grow writes what was found back
into the corpora, as few inputs as cover the same.
"""
import argparse
import concurrent.futures
import os
import re
import subprocess
import sys
import tempfile
import zipfile

FOLDER = os.path.dirname(os.path.abspath(__file__))
SEED_FILES = os.path.join(FOLDER, "../api/hostile_files.py")
WRITERS = {"import": SEED_FILES}
MOST_BYTES = {"import": 32768, "pscene": 8192}
MOST_CORPUS = 250000  # bytes of a zip


def environment():
    """The suppressions of the sanitizers' own run."""
    folder = os.path.join(FOLDER, "..")
    return {**os.environ,
            "LSAN_OPTIONS": "suppressions=%s:print_suppressions=0" % os.path.join(folder, "lsan.supp")}


def fuzz(name, options, faults):
    """Returns what to say of it and whether it held."""
    program = os.path.join(options.build, "bin", "fuzz_" + name)
    corpus = os.path.join(FOLDER, "corpus", name + ".zip")
    dictionary = os.path.join(FOLDER, "fuzz_%s.dict" % name)
    with tempfile.TemporaryDirectory() as work:
        start, found = os.path.join(work, "start"), os.path.join(work, "found")
        os.mkdir(start)
        os.mkdir(found)
        if os.path.exists(corpus):
            with zipfile.ZipFile(corpus) as archive:
                archive.extractall(start)
        if name in WRITERS:
            subprocess.run([sys.executable, "-B", WRITERS[name], "--seeds", start], check=True,
                           stdout=subprocess.DEVNULL)
        common = [program, "-max_len=%d" % MOST_BYTES.get(name, 2048), "-rss_limit_mb=4096",
                  "-seed=%d" % options.seed]
        command = common + ["-max_total_time=%d" % options.seconds, "-timeout=60", "-print_final_stats=1",
                            "-artifact_prefix=" + os.path.join(faults, name + "-")]
        if os.path.exists(dictionary):
            command.append("-dict=" + dictionary)
        run = subprocess.run(command + [found, start], stdout=subprocess.DEVNULL,
                             stderr=subprocess.PIPE, env=environment(), check=False)
        log = run.stderr.decode("utf-8", "replace")
        count = re.search(r"stat::number_of_executed_units:\s*(\d+)", log)
        begun = len(os.listdir(start))
        if run.returncode:
            artefact = re.search(r"Test unit written to (\S+)", log)
            return "%s: FAILED\n%s\n  repeat: %s %s" % (
                name, log[-6000:], program, artefact[1] if artefact else ""), False
        if options.grow:
            grow(common, corpus, start, found, work)
        return "%s: %s inputs from %d, %d new ones kept" % (
            name, count[1] if count else "?", begun, len(os.listdir(found))), True


def grow(common, corpus, start, found, work):
    merged = os.path.join(work, "merged")
    os.mkdir(merged)
    subprocess.run(common + ["-merge=1", merged, start, found], check=True,
                   stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env=environment())
    os.makedirs(os.path.dirname(corpus), exist_ok=True)
    total = 0
    with zipfile.ZipFile(corpus, "w", zipfile.ZIP_DEFLATED) as archive:
        for name in sorted(os.listdir(merged), key=lambda n: os.path.getsize(os.path.join(merged, n))):
            path = os.path.join(merged, name)
            total += os.path.getsize(path) + 100
            if total > MOST_CORPUS:
                break
            # The same inputs give the same archive.
            with open(path, "rb") as file:
                archive.writestr(zipfile.ZipInfo(name), file.read(), zipfile.ZIP_DEFLATED)


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("build")
    parser.add_argument("--seconds", type=int, default=60)
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--only")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--grow", action="store_true")
    options = parser.parse_args()
    names = sorted(n[len("fuzz_"):] for n in os.listdir(os.path.join(options.build, "bin"))
                   if n.startswith("fuzz_") and options.only in (None, n[len("fuzz_"):]))
    faults = os.path.join(options.build, "fuzz-faults")
    os.makedirs(faults, exist_ok=True)
    held = bool(names)
    with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
        for told, ok in pool.map(lambda name: fuzz(name, options, faults), names):
            print(told, flush=True)
            held &= ok
    print("%d fuzzers, %d s each: %s" % (len(names), options.seconds, "held" if held else "FAILED"))
    return 0 if held else 1


if __name__ == "__main__":
    sys.exit(main())
