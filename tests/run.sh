#!/usr/bin/env bash
# Builds and tests penumbra; installs what is missing first. Ends with ctest's closing lines.
#   tests/run.sh [--quick] [ctest options]
# Everything runs under ctest in the dev build. Without --quick clang-tidy and cppcheck then read the
# sources (.clang-tidy, tests/lint/cppcheck.txt), clang compiles them too, the unit tests and the API
# smoke test run under the address and undefined-behaviour sanitizers, the server's unit tests under
# the thread sanitizer, and every fuzzer for PENUMBRA_FUZZ_S (10) seconds, as long as
# PENUMBRA_TEST_BUDGET_S (1400) seconds are not used up. What did not run is listed at the end, with
# the reason.
# Exit status: 0 when every stage that ran passed, and none was cut short.
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
not_run=""
status=0
failed_log=""

# stage NAME LIMIT_S COMMAND...: runs it within the limit, keeps the output, notes the time.
stage() {
    local name=$1 limit=$2 started=$SECONDS result=ok
    shift 2
    echo "== $name"
    local code=0
    timeout -k 15 "$limit" "$@" >"$logs/$name.log" 2>&1 || code=$?
    if [ $code != 0 ]; then
        result=FAILED
        if [ $code = 124 ] || [ $code = 137 ]; then
            result="cut short after $limit s"
            not_run+="  $name: not finished when its $limit s were over"$'\n'
        fi
        status=1
        [ -n "$failed_log" ] || failed_log=$logs/$name.log
    fi
    table+=$(printf '  %-16s %5d s  %s' "$name" $((SECONDS - started)) "$result")$'\n'
    [ "$result" = ok ]
}
# later NAME STAGE...: whether there is time for one more; else the stages are noted.
later() {
    local least=240
    [ "$(left)" -le $least ] || return 0
    not_run+="  ${*// /, }: $(left) of $budget s were left, fewer than $least"$'\n'
    return 1
}
# tests_not_run PRESET STAGE [ctest options]: those that were skipped or that the end came before.
tests_not_run() {
    local preset=$1 name=$2
    shift 2
    [ ! -f "$logs/$name.log" ] ||
        not_run+=$(python3 -B tests/not_run.py "build/$preset" "$logs/$name.log" \
            "$logs/$name.xml" "$@" | sed 's/^/  /')$'\n'
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
    if [ -n "${not_run//[[:space:]]/}" ]; then
        echo "-- did not run"
        grep . <<<"$not_run"
    fi
    local last=${failed_log:-$logs/ctest.log}
    if [ -f "$last" ] && [ -n "$(closing "$last")" ]; then
        echo "-- $last"
        closing "$last"
    fi
    exit $status
}
build() {
    cmake --preset "$1" && cmake --build "build/$1" -j "$jobs" --target "${2:-all}"
}
run_ctest() {
    local preset=$1 name=$2
    shift 2
    ctest --test-dir "build/$preset" --output-on-failure --output-junit "$PWD/$logs/$name.xml" \
        -j "$((jobs + 1))" --timeout 1200 "$@" # some only wait
}
export -f build run_ctest
export jobs logs
if command -v ccache >/dev/null; then
    export CMAKE_C_COMPILER_LAUNCHER=ccache CMAKE_CXX_COMPILER_LAUNCHER=ccache
fi

asan=(-L "unit|smoke" --no-tests=error)
tsan=(-R "^unit\.(server|encode)" --no-tests=error)

# What is uninstrumented below us is not ours to fix; tests/*.supp say what and why.
export ASAN_OPTIONS=${ASAN_OPTIONS:-detect_leaks=1:abort_on_error=0}
export LSAN_OPTIONS=${LSAN_OPTIONS:-suppressions=$PWD/tests/lsan.supp:print_suppressions=0}
export TSAN_OPTIONS=${TSAN_OPTIONS:-suppressions=$PWD/tests/tsan.supp}
export UBSAN_OPTIONS=${UBSAN_OPTIONS:-print_stacktrace=1}

rm -f "$logs"/*.log "$logs"/*.xml
deploy/install-deps.sh
stage build 1800 bash -c 'build dev' || finish
stage ctest "$(left)" bash -c 'run_ctest dev ctest "$@"' - "$@" || true
tests_not_run dev ctest "$@"
$quick && finish
for tool in tidy cppcheck; do
    if ! command -v ${tool/#tidy/clang-tidy} >/dev/null; then
        not_run+="  $tool: ${tool/#tidy/clang-tidy} is not installed"$'\n'
    elif later $tool; then
        stage $tool "$(left)" python3 -B tests/lint/$tool.py build/dev || true
    fi
done
if ! command -v clang++ >/dev/null; then
    not_run+="  build-clang: clang is not installed"$'\n'
elif later build-clang; then
    stage build-clang "$(left)" bash -c 'build clang' || true
fi
if later build-asan ctest-asan; then
    stage build-asan "$(left)" bash -c 'build asan unit_and_smoke' &&
        stage ctest-asan "$(left)" bash -c 'run_ctest asan ctest-asan "$@"' - "${asan[@]}" || true
    tests_not_run asan ctest-asan "${asan[@]}"
fi
if later build-tsan ctest-tsan; then
    stage build-tsan "$(left)" bash -c 'build tsan threaded' &&
        stage ctest-tsan "$(left)" bash -c 'run_ctest tsan ctest-tsan "$@"' - "${tsan[@]}" || true
    tests_not_run tsan ctest-tsan "${tsan[@]}"
fi
if ! command -v clang >/dev/null; then
    not_run+="  fuzz: clang is not installed"$'\n'
elif later build-fuzz fuzz; then
    stage build-fuzz "$(left)" bash -c 'build fuzz fuzzers' &&
        stage fuzz "$(left)" python3 -B tests/fuzz/run.py build/fuzz --jobs "$jobs" \
            --seconds "${PENUMBRA_FUZZ_S:-10}" || true
fi
finish
