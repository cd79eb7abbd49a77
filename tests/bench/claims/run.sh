#!/usr/bin/env bash
# Puts the claims of the papers on trial and compares all methods; builds what it needs first.
#   tests/bench/claims/run.sh [--quick | --tiny] [--out DIR] [--only claims|methods|report] ...
# The report is DIR/index.html (default: build/claims). Further options: claims.py --help. Shared
# scenes are used when they lie beside the checkout or in $PENUMBRA_SHARED.
set -euo pipefail
cd "$(dirname "$0")/../../.."

preset=release
out=build/claims
rest=()
while [ $# -gt 0 ]; do
    case $1 in
        --out)
            out=$2
            shift 2
            ;;
        --preset)
            preset=$2
            shift 2
            ;;
        *)
            rest+=("$1")
            shift
            ;;
    esac
done
mkdir -p "$out"
if ! { cmake --preset "$preset" &&
    cmake --build "build/$preset" -j "$(nproc)" --target penumbra-claims penumbra-import; } \
    >"$out/build.log" 2>&1; then
    tail -n 40 "$out/build.log" >&2
    exit 1
fi
exec python3 -B tests/bench/claims/claims.py --build "build/$preset" --out "$out" "${rest[@]}"
