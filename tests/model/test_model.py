# SPDX-License-Identifier: Apache-2.0
"""Spin searches every state of lease.pml, and finds what was broken on purpose."""
import pathlib
import re
import subprocess

MODEL = pathlib.Path(__file__).with_name("lease.pml")
SECONDS_MAX = 60
MEMORY_MIB_MAX = 2048


def run(folder, *command):
    return subprocess.run(command, cwd=folder, text=True, stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT, timeout=SECONDS_MAX, check=False).stdout


def search(folder, *defines, liveness=False):
    """pan's report; without liveness only assertions and states that nobody leaves are looked at."""
    print(run(folder, "spin", *defines, "-a", str(MODEL)))
    # Spin's own output is not ours to correct, hence -w.
    kind = [] if liveness else ["-DSAFETY", "-DNOCLAIM"]
    print(run(folder, "gcc", "-O1", "-w", f"-DMEMLIM={MEMORY_MIB_MAX}", *kind, "-o", "pan", "pan.c"))
    report = run(folder, "./pan", "-m100000", *(["-a"] if liveness else []))
    found = re.search(r"errors: (\d+)\n +([\d.e+]+) states, stored", report)
    assert found, report
    print(*defines, "liveness:" if liveness else "safety:", found[2], "states")
    return int(found[1]), report


def assert_exhausted(errors, report):
    assert errors == 0, report
    assert "not completed" not in report and "max search depth too small" not in report, report


def test_no_fault_breaks_a_promise(tmp_path):
    """Broken by: a commit without a live lease, twice, or of another round than the next one; a
    render that is done without its pixels on the disk; a state that nobody leaves."""
    assert_exhausted(*search(tmp_path))


def test_what_is_accepted_ends(tmp_path):
    """Broken by: a render that waits for ever, or goes on after its end. One fault a run, because
    the search for cycles costs much more than the one for states."""
    assert_exhausted(*search(tmp_path, "-DFAULTS=1", liveness=True))


def test_a_coordinator_that_takes_any_lease_is_caught(tmp_path):
    """Broken by: a model whose assertions hold whatever the coordinator does."""
    errors, report = search(tmp_path, "-DNO_LEASE_CHECK")
    assert errors and "assertion violated" in report and "epoch" in report, report


def test_a_coordinator_without_expiry_is_caught(tmp_path):
    """Broken by: a model in which rendering ends by itself."""
    errors, report = search(tmp_path, "-DFAULTS=1", "-DNO_EXPIRY", liveness=True)
    assert errors and "acceptance cycle" in report, report
