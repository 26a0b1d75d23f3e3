# SPDX-License-Identifier: Apache-2.0
"""Runs the fuzz targets from their corpora on, and notes how many inputs each has tried.

Appends date, target, processor seconds, executions and findings to tests/results/fuzz.csv. A finding
is left in build/fuzz/findings, and ends its target's run; the exit code is then 1.
"""
import argparse
import csv
import datetime
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
RESULTS = ROOT / "tests/results/fuzz.csv"
COLUMNS = ["date", "target", "seconds", "executions", "findings"]
BUILD = ROOT / "build/fuzz"
# What each target is run with beside the usual. What OpenImageIO leaks is known; it is not ours.
TARGETS = {"gltf": [f"-dict={ROOT}/tests/fuzz/gltf.dict", "-max_len=8192"],
           "picture": ["-max_len=8192", "-detect_leaks=0"], "scene": [], "wire": []}


def build():
    subprocess.run(["cmake", "--preset", "fuzz"], cwd=ROOT, check=True, stdout=subprocess.DEVNULL)
    subprocess.run(["cmake", "--build", "--preset", "fuzz", "--target",
                    *(f"fuzz_{target}" for target in TARGETS)], cwd=ROOT, check=True)


def run(target, seconds):
    """(processor seconds, executions, findings) of a target on its corpus and beyond."""
    findings = BUILD / "findings" / target
    shutil.rmtree(findings, ignore_errors=True)
    findings.mkdir(parents=True)
    corpus = ROOT / "tests/fuzz/corpus" / target
    seeds = [corpus] if corpus.is_dir() else []
    environment = dict(os.environ)
    if "-detect_leaks=0" in TARGETS[target]:
        environment["ASAN_OPTIONS"] = "detect_leaks=0"  # at the end, too
    with tempfile.TemporaryDirectory() as found:
        process = subprocess.Popen(
            [BUILD / f"tests/fuzz_{target}", f"-max_total_time={seconds}", "-print_final_stats=1",
             "-rss_limit_mb=4096", "-timeout=120", "-print_funcs=0",
             f"-artifact_prefix={findings}/", *TARGETS[target], found, *seeds],
            stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, env=environment)
        log = process.stderr.read().decode(errors="replace")
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    (findings / "log").write_text(log)
    executions = re.search(r"stat::number_of_executed_units:\s*(\d+)", log)
    count = len([path for path in findings.iterdir() if path.name != "log"])
    if process.returncode != 0:
        print(log[-4000:], file=sys.stderr)
        count = max(count, 1)
    return usage.ru_utime + usage.ru_stime, int(executions[1]) if executions else 0, count


def note(row):
    is_new = not RESULTS.exists()
    with open(RESULTS, "a", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        if is_new:
            writer.writerow(COLUMNS)
        writer.writerow(row)


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--seconds", type=int, default=600, help="of each target")
    parser.add_argument("--no-record", action="store_true", help="leave tests/results alone")
    parser.add_argument("targets", nargs="*", default=list(TARGETS))
    options = parser.parse_args()
    findings = 0

    build()
    for target in options.targets:
        seconds, executions, found = run(target, options.seconds)
        print(f"{target}: {executions} executions in {seconds:.0f} s, {found} findings", flush=True)
        findings += found + (executions == 0)
        if not options.no_record:
            note([datetime.date.today().isoformat(), target, round(seconds), executions, found])
    return findings > 0


if __name__ == "__main__":
    sys.exit(main())
