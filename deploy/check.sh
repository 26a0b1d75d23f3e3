#!/bin/bash
# SPDX-License-Identifier: Apache-2.0
# Static checks: format, clang-tidy, gcc -fanalyzer, cppcheck, shellcheck, manual pages, and the lint tests.
#
#   deploy/check.sh          all of them; clang-tidy takes some ten minutes the first time: files
#                            that it found clean are read again when they, a header or the checks change
#   deploy/check.sh quick    without clang-tidy, the analyzer and the lint tests, as tests/run.sh calls it
# shellcheck disable=SC2317 # the check_ functions are called through step
set -uo pipefail

cd "$(dirname "$0")/.." || exit 1
build=build/release
cache=build/check
failed=0

mapfile -t c_files < <(git -c 'safe.directory=*' ls-files -- '*.c' '*.cpp' '*.h')
mapfile -t scripts < <(git -c 'safe.directory=*' ls-files -- '*.sh' '*.sbatch' .ci/run)

step() {
    local start=$SECONDS name=$1 status
    shift
    "$@"
    status=$?
    [ $status -eq 0 ] || failed=1
    printf '%s: %s, %d s\n' "$name" "$([ $status -eq 0 ] && echo ok || echo FAILED)" $((SECONDS - start))
}

check_format() {
    clang-format --dry-run -Werror "${c_files[@]}"
}

# One stamp per clean file, named by the digest of all that its result depends on.
tidy_one() {
    local stamp
    stamp=$cache/$(cat "$1" "$cache/shared" | sha256sum | cut -c1-32)
    [ -e "$stamp" ] && return
    clang-tidy --quiet -p "$cache" "$1" 2>/dev/null && touch "$stamp"
}

check_tidy() {
    mkdir -p "$cache"
    git -c 'safe.directory=*' ls-files -z -- '*.h' '*.clang-tidy' | xargs -0 cat >"$cache/shared"
    # clang 14 does not know this one of gcc's.
    sed 's/ -ftrivial-auto-var-init=zero//' "$build/compile_commands.json" >"$cache/compile_commands.json"
    export -f tidy_one
    export build cache
    # Only what this build compiles. The $1 is the inner shell's.
    # shellcheck disable=SC2016
    grep -o '"file": "[^"]*"' "$build/compile_commands.json" | cut -d'"' -f4 |
        grep -v "/$build/" | sort -u | sed "s|^$PWD/||" |
        xargs -P "$(nproc)" -I{} bash -c 'tidy_one "$1"' tidy {}
}

# missingIncludeSystem, checkersReport: about cppcheck's own view of the world, not about the code
# unusedStructMember: it does not see uses in other files
# unmatchedSuppression: one list serves every file
# uninitvar in sobol.c: does not see that the first numbers of a direction start the recurrence
# uninitvar in allowance.c: does not see that TAILQ_FOREACH sets its variable
# invalidFunctionArg in memory.c: of an empty file mmap fails, and that is told
check_cppcheck() {
    cppcheck --quiet --std=c11 --language=c --library=bsd \
        --enable=warning,performance,portability \
        --inline-suppr --error-exitcode=1 -j "$(nproc)" -I . -D_GNU_SOURCE \
        --suppress=missingIncludeSystem --suppress=checkersReport \
        --suppress=unusedStructMember --suppress=unmatchedSuppression \
        --suppress=uninitvar:core/render/sobol.c \
        --suppress=uninitvar:server/allowance.c \
        --suppress=invalidFunctionArg:worker/memory.c \
        --file-filter="*.c" core proto server worker
}

check_scripts() {
    shellcheck "${scripts[@]}"
}

check_manuals() {
    mandoc -Tlint -W warning deploy/man/*.[158]
}

check_lint() {
    PYTHONDONTWRITEBYTECODE=1 /usr/bin/python3 -m pytest -q tests/lint
}

[ -e "$build/compile_commands.json" ] || cmake --preset release >/dev/null || exit 1
step clang-format check_format
step cppcheck check_cppcheck
step shellcheck check_scripts
step mandoc check_manuals
if [ "${1-}" != quick ]; then
    step lint check_lint
    step gcc-analyzer /usr/bin/python3 deploy/analyze.py "$build"
    step clang-tidy check_tidy
fi
exit $failed
