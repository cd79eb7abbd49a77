#!/usr/bin/env bash
# Builds penumbra, starts the daemon on the built-in scene, renders it with every method and keeps
# serving until Ctrl-C.
#   deploy/demo.sh [--once] [--port N] [--out DIR] [penumbrad options]
# --once stops after rendering and fails if a method did; --port: the public port (8080), the admin
# port is one higher; --out: where the pictures go (demo-out). Everything else is passed to
# penumbrad, e.g. --require-gpu.
set -euo pipefail
cd "$(dirname "$0")/.."

once=false
port=8080
out=demo-out
options=()
while [ $# -gt 0 ]; do
    case $1 in
    --once) once=true ;;
    --port) port=${2:?--port needs a number} && shift ;;
    --port=*) port=${1#*=} ;;
    --out) out=${2:?--out needs a folder} && shift ;;
    --out=*) out=${1#*=} ;;
    -h | --help) sed -n '2,7s/^# \{0,1\}//p' "$0" && exit 0 ;;
    *) options+=("$1") ;;
    esac
    shift
done
case $port in
'' | *[!0-9]*) echo "demo: --port needs a number" >&2 && exit 2 ;;
esac
address=127.0.0.1:$port
admin=127.0.0.1:$((port + 1))
server=http://$address
bin=build/release/bin
deadline_ms=600000 # of each picture: a slow or busy machine may take its time

deploy/install-deps.sh --runtime --build --demo
mkdir -p "$out"
echo "Building (log: $out/build.log) ..."
if ! { cmake --preset release && cmake --build build/release -j "$(nproc)" --target \
    penumbrad penumbra-worker penumbra-import penumbra manual; } >"$out/build.log" 2>&1; then
    tail -n 40 "$out/build.log" >&2
    exit 1
fi

if (exec 3<>"/dev/tcp/127.0.0.1/$port") 2>/dev/null; then
    echo "demo: port $port is taken; choose another with --port" >&2
    exit 1
fi
daemon=
store=$(mktemp -d)
clean_up() {
    trap - EXIT INT TERM HUP
    if [ -n "$daemon" ] && kill -0 "$daemon" 2>/dev/null; then
        kill -TERM "$daemon" 2>/dev/null || true
        for _ in $(seq 100); do
            kill -0 "$daemon" 2>/dev/null || break
            sleep 0.1
        done
        kill -KILL "$daemon" 2>/dev/null || true
        wait "$daemon" 2>/dev/null || true
    fi
    rm -rf "$store"
}
trap clean_up EXIT
trap 'exit 130' INT
trap 'exit 143' TERM HUP

"$bin/penumbrad" --listen "$address" --admin-listen "$admin" --store "$store" \
    ${options[@]+"${options[@]}"} 2>"$out/penumbrad.log" &
daemon=$!
echo "Waiting for penumbrad (log: $out/penumbrad.log) ..."
ready=false
for _ in $(seq 3000); do
    if ! kill -0 "$daemon" 2>/dev/null; then
        break
    fi
    if curl -fs -m 5 -o "$out/readyz" "http://$admin/readyz"; then
        ready=true
        break
    fi
    sleep 0.2
done
rm -f "$out/readyz"
if ! $ready; then
    echo "demo: penumbrad did not become ready:" >&2
    tail -n 20 "$out/penumbrad.log" >&2
    exit 1
fi
curl -fsS -m 60 "$server/v1" | python3 -c '
import json, sys
device = json.load(sys.stdin).get("device") or {}
print("Device:", device.get("renderer", "unknown"),
      "(software)" if device.get("software") else "")'

"$bin/penumbra" generate demo -o "$out/demo.glb"
techniques=$(curl -fsS -m 60 "$server/v1/techniques" |
    python3 -c 'import json, sys; print(*[t["name"] for t in json.load(sys.stdin)["techniques"] if t["name"] != "auto"])')
sheet=()
failed=()
for technique in $techniques; do
    started=$(date +%s%N)
    if "$bin/penumbra" render "$out/demo.glb" -o "$out/$technique.png" \
        --technique "$technique" --deadline-ms "$deadline_ms" --server "$server" >"$out/render.log" 2>&1; then
        printf '  %-20s %6d ms  %s\n' "$technique" $((($(date +%s%N) - started) / 1000000)) \
            "$out/$technique.png"
        sheet+=("$technique=$out/$technique.png")
    else
        printf '  %-20s FAILED: %s\n' "$technique" "$(tail -n 1 "$out/render.log")" >&2
        failed+=("$technique")
    fi
done
rm -f "$out/render.log"
if [ ${#sheet[@]} -gt 0 ]; then
    python3 deploy/contact_sheet.py -o "$out/contact-sheet.png" "${sheet[@]}"
    if [ ${#failed[@]} = 0 ]; then
        echo "All of them: $out/contact-sheet.png"
    else
        echo "Those that succeeded: $out/contact-sheet.png"
    fi
fi
if [ ${#failed[@]} -gt 0 ]; then
    echo "demo: ${#failed[@]} of $((${#failed[@]} + ${#sheet[@]})) methods failed: ${failed[*]}" >&2
fi
if $once; then
    [ ${#failed[@]} = 0 ]
    exit
fi
echo
echo "Viewer: $server/    (Ctrl-C stops)"
wait "$daemon"
