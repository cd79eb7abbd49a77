#!/usr/bin/env bash
# Runs the README's two commands on a machine that has nothing: makes an empty root of a Debian
# release, clones this checkout's HEAD into it, and runs deploy/demo.sh and tests/run.sh there.
#   deploy/try-empty-root.sh bookworm|trixie [--keep DIR] [--log FILE] [tests/run.sh options]
# Wants root, debootstrap, a network and 6 GB in $TMPDIR (/var/tmp). Packages come from where this
# machine's apt takes its own; PENUMBRA_TEST_BUDGET_S is passed on. --keep: the root goes to DIR and
# stays; --log: where all output goes.
# Exit status: 0 when both commands succeeded.
set -euo pipefail
here=$(cd "$(dirname "$0")/.." && pwd)

release=${1:-}
case $release in
bookworm | trixie) shift ;;
*) sed -n '2,8s/^# \{0,1\}//p' "$0" >&2 && exit 2 ;;
esac
root="" log=""
while :; do
    case ${1:-} in
    --keep) root=${2:?--keep needs a folder} ;;
    --log) log=${2:?--log needs a file} ;;
    *) break ;;
    esac
    shift 2
done
say() { echo "try-empty-root: $*" >&2; }
[ "$(id -u)" = 0 ] || { say "only root can make another root" && exit 1; }
command -v debootstrap >/dev/null || { say "install debootstrap first" && exit 1; }

# Mounts and processes of the other root end with this script.
if [ -z "${PENUMBRA_OWN_NAMESPACE:-}" ]; then
    kept=${root:-$(mktemp -d "${TMPDIR:-/var/tmp}/penumbra-root.XXXXXX")}
    mkdir -p "$kept"
    status=0
    PENUMBRA_OWN_NAMESPACE=1 unshare --mount --pid --fork --kill-child "$0" "$release" \
        --keep "$kept" ${log:+--log "$log"} "$@" || status=$?
    [ -n "$root" ] || rm -rf --one-file-system "$kept"
    exit $status
fi
log=${log:-/dev/null}
: >"$log"

# What apt here is told about reaching its mirror, it is told there.
# shellcheck disable=SC2016  # names of apt's
mirror=$(apt-get indextargets --format '$(ORIGIN) $(LABEL) $(REPO_URI)' |
    awk '$2 == "Debian" && !found { found = $3 } { last = $NF } END { print found ? found : last }')
[ -n "$mirror" ] || { say "apt here knows no mirror of Debian" && exit 1; }
started=$SECONDS
if [ ! -e "$root/etc/debian_version" ]; then
    debootstrap --variant=minbase "$release" "$root" "$mirror" >>"$log" 2>&1 ||
        { say "debootstrap failed:" && tail -n 5 "$log" >&2 && exit 1; }
fi
apt-config dump | grep '^Acquire::' | grep -v -e '^Acquire::\(Changelogs\|IndexTargets\)' \
    >"$root/etc/apt/apt.conf.d/99as-outside" || true
for file in /etc/apt/auth.conf /etc/apt/auth.conf.d /etc/resolv.conf /etc/hosts \
    $(sed -n 's/.*::Ca\(Info\|Path\) "\(.*\)";/\2/p' "$root/etc/apt/apt.conf.d/99as-outside"); do
    [ ! -e "$file" ] || { mkdir -p "$root$(dirname "$file")" && cp -rL "$file" "$root$(dirname "$file")"; }
done
mount --make-rprivate /
mount --rbind /dev "$root/dev"
mount -t proc proc "$root/proc"
mount -t sysfs -o ro sysfs "$root/sys" 2>/dev/null || true
rm -rf "$root/penumbra"
git clone -q --no-hardlinks "$here" "$root/penumbra"
git -C "$root/penumbra" checkout -q --detach "$(git -C "$here" rev-parse HEAD)"
say "$release $(cat "$root/etc/debian_version"): an empty root after $((SECONDS - started)) s"

status=0
inside() { # inside TITLE COMMAND...
    local title=$1 started=$SECONDS result=ok
    shift
    env -i PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin HOME=/root LANG=C.UTF-8 \
        ${http_proxy:+http_proxy="$http_proxy"} ${https_proxy:+https_proxy="$https_proxy"} \
        ${no_proxy:+no_proxy="$no_proxy"} \
        ${PENUMBRA_TEST_BUDGET_S:+PENUMBRA_TEST_BUDGET_S="$PENUMBRA_TEST_BUDGET_S"} \
        chroot "$root" sh -c 'cd /penumbra && exec "$@"' sh "$@" </dev/null 2>&1 |
        tee -a "$log" || result=FAILED
    [ $result = ok ] || status=1
    say "$release: $title: $result, $((SECONDS - started)) s"
}
inside deploy/demo.sh deploy/demo.sh --once
inside tests/run.sh tests/run.sh "$@"
exit $status
