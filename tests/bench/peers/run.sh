#!/usr/bin/env bash
# The race: penumbra against three.js in headless Chromium, VTK and Blender's Cycles, on this
# machine, in alternation, with a table of ratios and pictures side by side.
#   tests/bench/peers/run.sh [--out DIR] [--shared DIR] [--no-install] [--growth] [race.py options]
# Installs Chromium, Node, VTK and Blender with apt-get and three.js with npm: what cannot be had is
# said and left out (without three.js there is no race). Builds the release preset. Writes
# DIR/index.html and DIR/table.md (default build/race). --growth adds how the cost of every method
# grows (penumbra-bench, some minutes); --shared, or a folder shared beside the checkout, adds scenes
# that are not in the repository. `--only ROW,ROW` makes some rows anew; race.py --help has the rest.
# A full run takes half an hour on two quiet cores, most of it Cycles's.
set -euo pipefail
cd "$(dirname "$0")/../../.."

three=0.187.0
puppeteer=24.43.1
out=build/race
shared=${PENUMBRA_SHARED:-../shared}
install=true
growth=false
rest=()
while [ $# -gt 0 ]; do
    case $1 in
    --out) out=${2:?--out needs a folder} && shift ;;
    --shared) shared=${2:?--shared needs a folder} && shift ;;
    --no-install) install=false ;;
    --growth) growth=true ;;
    -h | --help) sed -n '2,11s/^# \{0,1\}//p' "$0" && exit 0 ;;
    *) rest+=("$1") ;;
    esac
    shift
done
mkdir -p "$out"

as_root() {
    if [ "$(id -u)" = 0 ]; then "$@"; else sudo "$@"; fi
}
# try WHAT COMMAND PACKAGE...: installs the packages where COMMAND says that WHAT is not there.
try() {
    local what=$1 there=$2
    shift 2
    if ! bash -c "$there" >/dev/null 2>&1 && $install; then
        echo "Installing $what ..."
        as_root apt-get install -y --no-install-recommends "$@" >"$out/install.log" 2>&1 || true
    fi
    bash -c "$there" >/dev/null 2>&1 || {
        echo "$what: cannot be had here, left out" >&2
        return 1
    }
}
peers=()
try Chromium "command -v chromium" chromium || exit 77
try Node "command -v node && command -v npm" nodejs npm || exit 77
try VTK "command -v xvfb-run && /usr/bin/python3 -c 'import vtk'" xvfb xauth python3-vtk9 &&
    peers+=(--vtk)
try Blender "command -v blender && /usr/bin/python3 -c 'import numpy'" blender python3-numpy &&
    peers+=(--blender)
modules=$out/modules
if [ ! -d "$modules/node_modules/three" ] || [ ! -d "$modules/node_modules/puppeteer-core" ]; then
    echo "Installing three.js ..."
    mkdir -p "$modules"
    echo '{"name": "peers", "private": true}' >"$modules/package.json"
    (cd "$modules" && npm install --silent --no-save "three@$three" "puppeteer-core@$puppeteer") ||
        { echo "three.js: cannot be had here" >&2 && exit 77; }
fi

deploy/install-deps.sh --runtime --build --demo
if ! { cmake --preset release && cmake --build build/release -j "$(nproc)" --target penumbrad \
    penumbra-worker penumbra-import penumbra penumbra-bench; } >"$out/build.log" 2>&1; then
    tail -n 40 "$out/build.log" >&2
    exit 1
fi
if $growth; then
    build/release/bin/penumbra-bench --scene foliage --moving-light --json "$out/growth.json" \
        --triangles "30000,100000,300000,1000000" --resolutions "300,600,1200" --lights "1,2,4" \
        --map-sizes "1024,512,2048,4096" --light-sizes "0.4,0.1,1.6" --runs 3 --warm-up 1 \
        --seconds 1.5 --limit 1500 >"$out/growth.txt"
fi
[ ! -d "$shared/scenes" ] || peers+=(--shared "$shared")
exec python3 -B tests/bench/peers/race.py --programs build/release/bin --out "$out" \
    --modules "$modules" "${peers[@]}" "${rest[@]}"
