#!/bin/sh
# Installs the Debian 12 packages that penumbra needs; quick and silent when they are all there.
#   deploy/install-deps.sh [--runtime] [--build] [--test] [--fuzz] [--list]
# Without a set: --runtime --build --test. --list prints the packages and installs nothing.
set -eu

# Libraries and drivers of the finished programs.
runtime="
ca-certificates
libcjson1
libcurl4
libegl-mesa0
libegl1
libembree3-3
libgl1
libgl1-mesa-dri
libisal2
libmeshoptimizer2d
libmicrohttpd12
libopenimageio2.4
libosmesa6
libseccomp2
libspng0
libssl3
libtinygltf2d
libturbojpeg0
libwebp7
libzip4
zlib1g
"
# Compilers and headers.
build="
cmake
g++
gcc
libcglm-dev
libcjson-dev
libcurl4-openssl-dev
libegl-dev
libembree-dev
libgl-dev
libisal-dev
libmeshoptimizer-dev
libmicrohttpd-dev
libopenimageio-dev
libosmesa6-dev
libseccomp-dev
libspng-dev
libssl-dev
libtinygltf-dev
libturbojpeg0-dev
libwebp-dev
libzip-dev
ninja-build
nlohmann-json3-dev
pkgconf
zlib1g-dev
"
# What the tests and the demo run.
test="
clang-format
curl
git
openssl
procps
python3
"
# libFuzzer comes with clang.
fuzz="
clang
llvm
"

sets=""
list=false
for argument in "$@"; do
    case $argument in
    --runtime) sets="$sets $runtime" ;;
    --build) sets="$sets $build" ;;
    --test) sets="$sets $test" ;;
    --fuzz) sets="$sets $fuzz" ;;
    --list) list=true ;;
    *)
        sed -n '2,4s/^# \{0,1\}//p' "$0" >&2
        exit 2
        ;;
    esac
done
[ -n "$sets" ] || sets="$runtime $build $test"

if $list; then
    # shellcheck disable=SC2086  # one word, one package
    printf '%s\n' $sets | sort -u
    exit 0
fi
if ! command -v apt-get >/dev/null || ! command -v dpkg-query >/dev/null; then
    echo "install-deps: this is not Debian; install the equivalents of these yourself:" >&2
    "$0" "$@" --list >&2
    exit 1
fi

# shellcheck disable=SC2086
installed=" $(dpkg-query -W -f '${Package}:${db:Status-Status} ' $sets 2>/dev/null || true)"
missing=""
for package in $sets; do
    case $installed in
    *" $package:installed "*) ;;
    *) missing="$missing $package" ;;
    esac
done
[ -n "$missing" ] || exit 0

as_root=""
if [ "$(id -u)" != 0 ]; then
    if ! command -v sudo >/dev/null; then
        echo "install-deps: not root and no sudo; as root run: apt-get install$missing" >&2
        exit 1
    fi
    as_root="sudo"
fi
echo "install-deps: installing$missing"
log=$(mktemp)
trap 'rm -f "$log"' EXIT
# shellcheck disable=SC2086
if ! { $as_root apt-get update -qq &&
    $as_root env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends \
        -o DPkg::Lock::Timeout=120 $missing; } >"$log" 2>&1; then
    cat "$log" >&2
    exit 1
fi
