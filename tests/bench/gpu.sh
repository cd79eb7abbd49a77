#!/usr/bin/env bash
# What every method and every pass costs on this machine's GPU, and how that grows: builds the
# renderer and penumbra-bench alone (a C compiler, CMake, EGL and GL headers and cglm) and writes
# DIR/bench.json and DIR/bench.txt within about five minutes.
#   tests/bench/gpu.sh DIR [--tiny] [penumbra-bench options, e.g. --device surfaceless]
# --tiny only shows that it runs, on any device. Without a GPU: says so and exits 77.
set -euo pipefail
if [ $# -lt 1 ] || [ "${1#-}" != "$1" ]; then
    sed -n '2,6s/^# \{0,1\}//p' "$0" >&2
    exit 2
fi
mkdir -p "$1"
out=$(cd "$1" && pwd)
shift
cd "$(dirname "$0")/../.."

device=gpu
sizes=(--triangles "70000,300000,1000000,3000000" --resolutions "1080,540,2160"
    --map-sizes "1024,512,2048,4096" --light-sizes "0.6,0.15,1.5" --lights "1,2,4" --runs 15 --warm-up 3 --seconds 1.5 --limit 200)
if [ "${1:-}" = --tiny ]; then
    shift
    device=auto
    sizes=(--triangles "4000,16000" --resolutions "60,120" --map-sizes "256,128"
        --light-sizes "0.6,0.15" --lights "1,2" --runs 2 --warm-up 1 --seconds 0.2 --limit 60)
fi

build=${PENUMBRA_BENCH_BUILD:-build/bench}
if ! { cmake -S . -B "$build" -DCMAKE_BUILD_TYPE=Release -DPENUMBRA_DAEMON=OFF &&
    cmake --build "$build" -j "$(nproc)" --target penumbra-bench; } >"$out/build.log" 2>&1; then
    tail -n 40 "$out/build.log" >&2
    exit 1
fi
status=0
"$build/bin/penumbra-bench" --device "$device" --scene foliage --moving-light "${sizes[@]}" \
    --json "$out/bench.json" "$@" >"$out/bench.txt" 2>"$out/bench.log" || status=$?
if [ "$status" != 0 ]; then
    cat "$out/bench.log" >&2
    exit "$([ -s "$out/bench.txt" ] && echo 1 || echo 77)"
fi
head -n 1 "$out/bench.txt"
sed -n '/^Growth/,$p' "$out/bench.txt"
echo "$out/bench.txt"
echo "$out/bench.json"
