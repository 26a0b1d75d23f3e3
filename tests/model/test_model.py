# SPDX-License-Identifier: Apache-2.0
"""Spin searches every state of lease.pml and audit.pml, and finds what was broken on purpose."""
import pathlib
import re
import subprocess

import pytest

HERE = pathlib.Path(__file__).parent
SECONDS_MAX = 120
MEMORY_MIB_MAX = 2048


def run(folder, *command):
    return subprocess.run(command, cwd=folder, text=True, stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT, timeout=SECONDS_MAX, check=False).stdout


def search(folder, *defines, model="lease", liveness=False, level="-O0"):
    """pan's report; without liveness only assertions and states that nobody leaves are looked at."""
    print(run(folder, "spin", *defines, "-a", str(HERE / f"{model}.pml")))
    # Spin's own output is not ours to correct, hence -w.
    kind = [] if liveness else ["-DSAFETY", "-DNOCLAIM"]
    print(run(folder, "gcc", level, "-w", f"-DMEMLIM={MEMORY_MIB_MAX}", *kind, "-o", "pan", "pan.c"))
    report = run(folder, "./pan", "-m100000", *(["-a"] if liveness else []))
    found = re.search(r"errors: (\d+)\n +([\d.e+]+) states, stored", report)
    assert found, report
    print(model, *defines, "liveness:" if liveness else "safety:", found[2], "states")
    return int(found[1]), report


def assert_exhausted(errors, report):
    assert errors == 0, report
    assert "not completed" not in report and "max search depth too small" not in report, report


def test_no_fault_breaks_a_promise(tmp_path):
    """Broken by: a commit without a live lease, twice, or of another round than the next one; a
    render that is done without its pixels on the disk; a state that nobody leaves."""
    assert_exhausted(*search(tmp_path, level="-O2"))


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


def test_no_wrong_pixel_of_a_convicted_worker_stays(tmp_path):
    """Broken by: a second opinion that the same worker gives, one that counts after it has left, an
    honest worker that is convicted, or pixels of a liar that nobody makes again."""
    assert_exhausted(*search(tmp_path, "-DLIES=2", model="audit", level="-O2"))


def test_an_audited_render_ends(tmp_path):
    """Broken by: opinions that are asked for for ever, or two that nobody decides between."""
    assert_exhausted(*search(tmp_path, "-DFAULTS=1", "-DLIES=1", model="audit", liveness=True))


@pytest.mark.parametrize("mutation, broken", [
    ("NO_LEASE_CHECK", "holder"), ("NO_REDO", "convicted"), ("SAME_WORKER", ""),
    ("SELF_IS_ANOTHER", "convicted"), ("OPINIONS_STAY", ""), ("RESTART_FORGETS", "convicted")])
def test_an_audit_with_a_hole_is_caught(tmp_path, mutation, broken):
    """Broken by: a model whose assertions hold whatever is audited."""
    errors, report = search(tmp_path, f"-D{mutation}", model="audit")
    violated = re.search(r"assertion violated (.*)", report)
    assert errors and violated and broken in violated[1], report
