#!/usr/bin/env bash
# Builds and tests penumbra; installs what is missing first. Ends with ctest's closing lines.
#   tests/run.sh [--quick] [ctest options]
# Everything runs under ctest in the dev build; without --quick the unit tests and the API smoke test
# then run under the address and undefined-behaviour sanitizers, and the server's unit tests under the
# thread sanitizer, as long as PENUMBRA_TEST_BUDGET_S (1400) seconds are not used up.
# Exit status: 0 when every stage that ran passed.
set -euo pipefail
cd "$(dirname "$0")/.."

quick=false
if [ "${1:-}" = --quick ]; then
    quick=true
    shift
fi
budget=${PENUMBRA_TEST_BUDGET_S:-1400}
jobs=$(nproc)
logs=build/test-logs
mkdir -p "$logs"
table=""
status=0
failed_log=""

# stage NAME LIMIT_S COMMAND...: runs it within the limit, keeps the output, notes the time.
stage() {
    local name=$1 limit=$2 started=$SECONDS result=ok
    shift 2
    echo "== $name"
    if ! timeout -k 15 "$limit" "$@" >"$logs/$name.log" 2>&1; then
        result=FAILED
        status=1
        [ -n "$failed_log" ] || failed_log=$logs/$name.log
    fi
    table+=$(printf '  %-16s %5d s  %s' "$name" $((SECONDS - started)) "$result")$'\n'
    [ $result = ok ]
}
closing() { sed -n '/tests passed, .* tests failed out of/,$p' "$1"; }
left() { echo $((budget - SECONDS)); }
finish() {
    if [ -n "$failed_log" ]; then
        echo "-- the end of $failed_log"
        tail -n 150 "$failed_log"
    fi
    echo "-- times"
    printf '%s' "$table"
    local last=${failed_log:-$logs/ctest.log}
    if [ -f "$last" ] && [ -n "$(closing "$last")" ]; then
        echo "-- $last"
        closing "$last"
    fi
    exit $status
}
build() {
    cmake --preset "$1" && cmake --build "build/$1" -j "$jobs"
}
run_ctest() {
    local preset=$1
    shift
    ctest --test-dir "build/$preset" --output-on-failure -j "$jobs" --timeout 300 "$@"
}
export -f build run_ctest
export jobs

# What is uninstrumented below us is not ours to fix; tests/*.supp say what and why.
export ASAN_OPTIONS=${ASAN_OPTIONS:-detect_leaks=1:abort_on_error=0}
export LSAN_OPTIONS=${LSAN_OPTIONS:-suppressions=$PWD/tests/lsan.supp:print_suppressions=0}
export TSAN_OPTIONS=${TSAN_OPTIONS:-suppressions=$PWD/tests/tsan.supp}
export UBSAN_OPTIONS=${UBSAN_OPTIONS:-print_stacktrace=1}

rm -f "$logs"/*.log
deploy/install-deps.sh
stage build 900 bash -c 'build dev' || finish
stage ctest "$(left)" bash -c 'run_ctest dev "$@"' - "$@" || true
if ! $quick && [ "$(left)" -gt 240 ]; then
    stage build-asan "$(left)" bash -c 'build asan' &&
        stage ctest-asan "$(left)" bash -c 'run_ctest asan -L "unit|smoke" --no-tests=error' || true
fi
if ! $quick && [ "$(left)" -gt 240 ]; then
    stage build-tsan "$(left)" bash -c 'build tsan' &&
        stage ctest-tsan "$(left)" bash -c 'run_ctest tsan -R "^unit\.(server|encode)" --no-tests=error' ||
        true
fi
finish
