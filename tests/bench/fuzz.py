# SPDX-License-Identifier: Apache-2.0
"""Runs the fuzz targets from their corpora on, and notes how many inputs each has tried.

Appends date, target, processor seconds, executions and findings to tests/results/fuzz.csv, after each
run of a target, until it has an hour in all; who is stopped goes on from there the next time, with
the inputs that were found (build/fuzz/found). A finding is left in build/fuzz/findings, and ends its
target's run; the exit code is then 1.
"""
import argparse
import collections
import concurrent.futures
import csv
import datetime
import os
import pathlib
import re
import shutil
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
RESULTS = ROOT / "tests/results/fuzz.csv"
COLUMNS = ["date", "target", "seconds", "executions", "findings"]
BUILD = ROOT / "build/fuzz"
# What each target is run with beside the usual. What OpenImageIO leaks is known; it is not ours.
TARGETS = {"gltf": [f"-dict={ROOT}/tests/fuzz/gltf.dict", "-max_len=8192"],
           "picture": ["-max_len=8192", "-detect_leaks=0"], "scene": [], "wire": [],
           "fields": [], "http": ["-max_len=4096"], "recovery": ["-max_len=4096"],
           "sched": ["-max_len=4096"], "tile": ["-max_len=4096"]}
AT_ONCE = 2


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
    found = BUILD / "found" / target
    found.mkdir(parents=True, exist_ok=True)
    process = subprocess.Popen(
        [BUILD / f"tests/fuzz_{target}", f"-max_total_time={seconds}", "-print_final_stats=1",
         "-rss_limit_mb=4096", "-timeout=120", "-report_slow_units=120", "-print_funcs=0",
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


def spent():
    """Processor seconds of each target until now."""
    seconds = collections.Counter()
    if RESULTS.exists():
        with open(RESULTS, newline="") as file:
            for row in csv.DictReader(file):
                seconds[row["target"]] += int(row["seconds"])
    return seconds


def run_all(targets, seconds, record):
    """Runs each once, two at a time; the number of findings."""
    findings = 0
    with concurrent.futures.ThreadPoolExecutor(AT_ONCE) as pool:
        asked = {pool.submit(run, target, seconds): target for target in targets}
        for future in concurrent.futures.as_completed(asked):
            target = asked[future]
            spent_s, executions, found = future.result()
            print(f"{target}: {executions} executions in {spent_s:.0f} s, {found} findings",
                  flush=True)
            findings += found + (executions == 0)
            if record:
                note([datetime.date.today().isoformat(), target, round(spent_s), executions, found])
    return findings


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--seconds", type=int, default=300, help="of each target's run")
    parser.add_argument("--hours", type=float, default=1, help="of each target in all")
    parser.add_argument("--no-record", action="store_true",
                        help="run each once, and leave tests/results alone")
    parser.add_argument("targets", nargs="*", default=list(TARGETS))
    options = parser.parse_args()

    build()
    if options.no_record:
        return run_all(options.targets, options.seconds, False) > 0
    while True:
        before = spent()
        short = [t for t in options.targets if before[t] < 3600 * options.hours]
        if not short:
            return 0
        if run_all(sorted(short, key=lambda t: before[t]), options.seconds, True) > 0:
            return 1


if __name__ == "__main__":
    sys.exit(main())
