#!/bin/sh
# Installs the Debian packages that penumbra needs; quick and silent when they are all there.
#   deploy/install-deps.sh [--runtime] [--build] [--demo] [--test] [--fuzz] [--list]
# Without a set: all but --fuzz. --list prints the packages and installs nothing.
set -eu

# Libraries of ours whose run-time package is called otherwise in every release: it is what the
# package for building depends on.
libraries="
libcjson-dev
libcurl4-openssl-dev
libdraco-dev
libembree-dev
libisal-dev
libmeshoptimizer-dev
libmicrohttpd-dev
libopenexr-dev
libseccomp-dev
libspng-dev
libsqlite3-dev
libssl-dev
libtiff-dev
libtinygltf-dev
libturbojpeg0-dev
libutf8proc-dev
libwebp-dev
libzip-dev
zlib1g-dev
"
# What else the finished programs need.
runtime="
ca-certificates
libegl-mesa0
libegl1
libgl1
libgl1-mesa-dri
libwebpmux3
"
# Compilers and headers.
build="
cmake
g++
gcc
libcglm-dev
libegl-dev
libgl-dev
ninja-build
nlohmann-json3-dev
pkgconf
"
# What the demo runs.
demo="
curl
python3
"
# What the tests run.
test="
clang-format
curl
git
openssl
procps
python3
"
# Taken where the machine offers them; what they are for is left out without them.
runtime_extra="libosmesa6"
test_extra="clang clang-tidy cppcheck mypy python3-imageio python3-venv libopenapi-client-perl mandoc zsh fish"
# libFuzzer comes with clang.
fuzz="
clang
llvm
"

say() { echo "install-deps: $*" >&2; }

wanted="" extra="" halves="" list=false
choose() {
    case $1 in
    --runtime) wanted="$wanted $runtime" extra="$extra $runtime_extra" halves=$libraries ;;
    --build) wanted="$wanted $build $libraries" ;;
    --demo) wanted="$wanted $demo" ;;
    --test) wanted="$wanted $test" extra="$extra $test_extra" ;;
    --fuzz) wanted="$wanted $fuzz" ;;
    --list) list=true ;;
    *)
        sed -n '2,4s/^# \{0,1\}//p' "$0" >&2
        exit 2
        ;;
    esac
}
for argument in "$@"; do
    choose "$argument"
done
if [ -z "$wanted" ]; then
    for argument in --runtime --build --demo --test; do
        choose $argument
    done
fi
# With a library's package for building comes its run-time half.
case $wanted in *libcjson-dev*) halves="" ;; esac

# The run-time packages of $halves: as apt knows them, else as they are installed, else "?NAME-dev".
# Both say "<NAME", then what may belong to it; it begins as NAME does, and a number follows.
run_time_halves() {
    [ -n "$halves" ] || return 0
    # shellcheck disable=SC2086  # one word, one package
    {
        apt-cache depends $halves 2>/dev/null | sed -n 's/^\([a-z].*\)/<\1/p; s/^ *Depends: //p'
        for package in $halves; do
            echo "<$package"
            dpkg-query -W -f '${db:Status-Status} ${Package}\n' \
                "$(echo "$package" | sed 's/-dev$//; s/[0-9].*//')[0-9]*" 2>/dev/null |
                sed -n 's/^installed //p'
        done
    } | awk -v wanted="$(echo $halves)" '
        /^</ { package = substr($0, 2); stem = package; sub(/-dev$/, "", stem); sub(/[0-9].*/, "", stem) }
        $0 ~ "^" stem "[0-9]" && !/-dev$/ && !(package in half) { half[package] = $0 }
        END {
            count = split(wanted, name, " ")
            for (i = 1; i <= count; i++)
                print name[i] in half ? half[name[i]] : "?" name[i]
        }'
}
# Those of the given packages that are not installed.
missing_of() {
    installed=" $(dpkg-query -W -f '${Package}:${db:Status-Status} ' "$@" 2>/dev/null || true)"
    for package in "$@"; do
        case $installed in
        *" $package:installed "*) ;;
        *) printf ' %s' "$package" ;;
        esac
    done
}
# Those that apt could install.
offered_of() {
    [ $# = 0 ] || apt-cache policy "$@" 2>/dev/null |
        awk '/^[a-z]/ { sub(/:$/, ""); package = $0 } /Candidate: [^(]/ { printf " %s", package }'
}

if ! command -v apt-get >/dev/null || ! command -v dpkg-query >/dev/null; then
    $list || say "this is not Debian; install the equivalents of these yourself:"
    # shellcheck disable=SC2086
    printf '%s\n' $wanted $halves | sort -u
    $list || exit 1
    exit 0
fi
# shellcheck disable=SC2046,SC2086
if $list; then
    printf '%s\n' $wanted $(run_time_halves) $(offered_of $extra) | sort -u
    exit 0
fi

# shellcheck disable=SC2046,SC2086
look() {
    required=$(missing_of $wanted $(run_time_halves))
    optional=$(missing_of $extra)
}
look
[ -n "$required$optional" ] || exit 0

# Without what is optional all goes on; without the rest it ends here.
give_up() {
    [ -n "$required" ] || {
        say "going on without$optional: $*"
        exit 0
    }
    say "$*"
    exit 1
}

as_root=""
if [ "$(id -u)" != 0 ]; then
    command -v sudo >/dev/null ||
        give_up "not root, and there is no sudo; as root run: apt-get install$required$optional"
    as_root="sudo"
    if ! [ -t 0 ]; then
        as_root="sudo -n"
        sudo -n true 2>/dev/null ||
            give_up "sudo wants a password; in a terminal run: sudo apt-get install$required$optional"
    fi
fi
log=$(mktemp)
trap 'rm -f "$log"' EXIT
explain() {
    if grep -q -i 'could not get lock\|unable to \(lock\|acquire\)' "$log"; then
        give_up "another apt or dpkg is at work here; try again when it has ended."
    elif grep -q -i 'failed to fetch\|temporary failure\|could not \(connect\|resolve\)\|unable to locate\|no installation candidate' "$log"; then
        give_up "no network, or no mirror of /etc/apt that has these:$required$optional"
    fi
    cat "$log" >&2
    give_up "apt-get fails, as shown above."
}
# Waits for another apt: the first lock is not one that DPkg::Lock::Timeout is about.
update() {
    end=$(($(date +%s) + 120))
    while [ "$(date +%s)" -lt $end ]; do
        $as_root apt-get update -qq >"$log" 2>&1 && return 0
        grep -q -i 'could not get lock\|unable to lock' "$log" || return 1
        sleep 5
    done
    return 1
}
install() {
    # shellcheck disable=SC2086
    $as_root env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends \
        -o DPkg::Lock::Timeout=120 "$@" >>"$log" 2>&1
}

echo "install-deps: installing$required$optional"
update || true
look
case $required in
*\?*) explain ;;
esac
# shellcheck disable=SC2086
optional=$(offered_of $optional)
# shellcheck disable=SC2086
install $required $optional && exit 0
# shellcheck disable=SC2086
if [ -n "$required" ]; then
    optional=""
    install $required && exit 0
fi
explain
