#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# Installs what the tests need, builds, and runs them.
#
#   tests/run.sh              every suite
#   tests/run.sh quick        lint, unit tests and one render end to end, within three minutes
#   tests/run.sh long NAME    a measurement of tests/bench, by name
#
# Each suite prints its budget in seconds and is stopped when it is spent. The last line is
# "N passed, N failed"; the exit code is 0 when nothing failed. Logs stay in build/tests.
set -uo pipefail

cd "$(dirname "$0")/.." || exit 1
python=/usr/bin/python3 # Debian's, which has Debian's packages
logs=build/tests
passed=0
failed=0
export PYTHONDONTWRITEBYTECODE=1

usage() {
    sed -n 's/^#  *\(tests\/run\.sh\)/\1/p' tests/run.sh
}

# Prints "PASSED FAILED SKIPPED" of a JUnit file, as ctest and pytest write it.
count() {
    $python - "$1" <<'PYTHON'
import sys
import xml.etree.ElementTree as tree

cases = list(tree.parse(sys.argv[1]).iter("testcase"))
failed = sum(c.find("failure") is not None or c.find("error") is not None for c in cases)
skipped = sum(c.find("skipped") is not None for c in cases)
print(len(cases) - failed - skipped, failed, skipped)
PYTHON
}

# suite NAME BUDGET_S COMMAND...: the command leaves $logs/NAME.xml; without it, it is one test.
suite() {
    local name=$1 budget=$2 start=$SECONDS status good=0 bad=0 skipped=0
    shift 2
    printf '== %s (budget %d s)\n' "$name" "$budget"
    rm -f "$logs/$name.xml"
    timeout --kill-after=10 "$budget" "$@" >"$logs/$name.log" 2>&1 </dev/null
    status=$?
    if [ -s "$logs/$name.xml" ]; then
        read -r good bad skipped < <(count "$logs/$name.xml")
    elif [ $status -eq 0 ]; then
        good=1
    fi
    if [ $status -ne 0 ]; then
        [ "$bad" -gt 0 ] || bad=1
        [ $status -ne 124 ] || echo "$name: stopped after its budget of $budget s"
        tail -n 60 "$logs/$name.log"
    fi
    passed=$((passed + good))
    failed=$((failed + bad))
    printf '   %s: %d passed, %d failed, %d skipped in %d s\n' \
        "$name" "$good" "$bad" "$skipped" $((SECONDS - start))
}

ctest_suite() {
    local name=$1 budget=$2 preset=$3 label=$4 # a regular expression
    suite "$name" "$budget" ctest --test-dir "build/$preset" -L "^($label)\$" --output-on-failure \
        --no-tests=error --output-junit "$PWD/$logs/$name.xml"
}

pytest_suite() {
    local name=$1 budget=$2
    shift 2
    suite "$name" "$budget" $python -m pytest -q --junitxml "$logs/$name.xml" "$@"
}

build() {
    local preset=$1 start=$SECONDS # what follows are targets; none: all
    shift
    printf '== build %s\n' "$preset"
    if cmake --preset "$preset" >"$logs/build-$preset.log" 2>&1 &&
        cmake --build --preset "$preset" -j "$(nproc)" ${1:+--target "$@"} \
            >>"$logs/build-$preset.log" 2>&1; then
        printf '   build %s: %d s\n' "$preset" $((SECONDS - start))
        return
    fi
    tail -n 60 "$logs/build-$preset.log"
    failed=$((failed + 1))
    finish
}

finish() {
    printf '%d passed, %d failed\n' "$passed" "$failed"
    [ "$failed" -eq 0 ]
    exit
}

run_quick() {
    build release
    pytest_suite lint 60 tests/lint
    ctest_suite unit 60 release unit
    pytest_suite render 60 tests/integration/test_render.py
}

run_all() {
    build release
    build asan
    build clang # the second compiler's warnings
    build fuzz fuzz_fields fuzz_gltf fuzz_http fuzz_picture fuzz_recovery fuzz_scene fuzz_sched fuzz_tile \
        fuzz_wire
    build tsan penumbra penumbra-worker penumbra-encoder http-server
    pytest_suite lint 60 tests/lint
    suite check 60 deploy/check.sh quick
    ctest_suite unit 60 release 'unit|integration'
    ctest_suite unit-asan 120 asan 'unit|integration'
    ctest_suite stat 60 release stat
    pytest_suite integration 620 tests/integration
    pytest_suite openapi 120 tests/openapi
    pytest_suite web 90 tests/web
    pytest_suite stat-images 180 tests/stat
    for isa in v2 v3; do # the best there is was above
        PEN_ISA=$isa pytest_suite stat-images-$isa 90 tests/stat/test_furnace.py \
            tests/stat/test_irradiance.py
    done
    pytest_suite gltf 120 tests/gltf
    PEN_BIN=build/asan/bin PEN_SLOW=10 pytest_suite pictures-asan 180 \
        tests/integration/test_hostile_pictures.py
    PEN_BIN=build/asan/bin PEN_SLOW=10 pytest_suite models-asan 90 \
        tests/integration/test_gltf_models.py
    PEN_BIN=build/asan/bin PEN_SLOW=10 pytest_suite hostile-asan 120 \
        tests/integration/test_hostile_assets.py -k within_limits
    PEN_BIN=build/tsan/bin PEN_SLOW=10 TSAN_OPTIONS=suppressions=$PWD/tests/support/threads.supp \
        pytest_suite threads-tsan 150 tests/integration/test_restart.py \
        tests/integration/test_wait.py -k 'not lost_framebuffer and not damaged_tiles'
    PEN_BIN=build/asan/bin PEN_SLOW=5 pytest_suite http-asan 90 \
        tests/integration/test_hostile_http.py -k "answered or never"
    suite fuzz 90 $python tests/bench/fuzz.py --seconds 10 --no-record
    pytest_suite reference 420 tests/reference
    pytest_suite chaos 420 tests/chaos
    suite simulation 90 build/release/tests/simulate --seeds 1000000 --seconds 60
    pytest_suite model 180 -rP tests/model
    pytest_suite packages 180 tests/deploy/test_packages.py
    pytest_suite slurm 90 tests/deploy/test_slurm.py
    pytest_suite deploy 150 tests/deploy/test_sbom.py tests/deploy/test_manifests.py tests/deploy/test_monitoring.py \
        tests/deploy/test_proxies.py
}

run_long() {
    local found
    found=$(find tests/bench -name "$1.py" -o -name "$1.sh" | head -n 1)
    [ -n "$found" ] || { echo "tests/run.sh: no tests/bench/$1.py or .sh" >&2; exit 2; }
    build release
    export PYTHONPATH=$PWD/tests/support
    case $found in
        *.py) exec $python "$found" ;;
        *) exec "$found" ;;
    esac
}

case "${1-}" in
    "" | quick) [ $# -le 1 ] || { usage >&2; exit 2; } ;;
    long) [ $# -eq 2 ] || { usage >&2; exit 2; } ;;
    --help) usage; exit 0 ;;
    *) usage >&2; exit 2 ;;
esac

mkdir -p "$logs"
needs=(--tests)
[ "${1-}" != long ] || needs+=(--bench)
deploy/install-deps.sh "${needs[@]}" || exit 1
case "${1-}" in
    quick) run_quick ;;
    long) run_long "$2" ;;
    *) run_all ;;
esac
finish
