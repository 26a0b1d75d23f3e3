#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Every allocation, write and sync of the coordinator's main paths fails in turn; see
tests/chaos/test_torture.py. Adds a row for each path and kind to the results.

PEN_TORTURE_PATHS chooses some, as pytest's -k does.
"""
import csv
import datetime
import os
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
RESULTS = ROOT / "tests/results/torture.csv"
COLUMNS = ["commit", "date", "path", "kind", "calls", "rounds", "fates", "seconds"]
LINE = re.compile(r"^(\w+) (\w+): (\d+) calls, (\d+) rounds, \{(.*)\}, (\d+) s$", flags=re.M)


def main():
    head = ["git", "-c", "safe.directory=*", "rev-parse", "--short", "HEAD"]
    commit = subprocess.run(head, cwd=ROOT, stdout=subprocess.PIPE, text=True, check=True).stdout
    chosen = os.environ.get("PEN_TORTURE_PATHS")
    run = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-rP", "tests/chaos/test_torture.py",
         *(["-k", chosen] if chosen else [])], cwd=ROOT, check=False,
        env={**os.environ, "PEN_TORTURE_WHOLE": "1"}, stdout=subprocess.PIPE, text=True)
    print(run.stdout, end="")
    rows = list(csv.DictReader(RESULTS.open())) if RESULTS.exists() else []
    for path, kind, calls, rounds, fates, seconds in LINE.findall(run.stdout):
        text = fates.replace("'", "").replace(":", "").replace(",", "")
        rows.append(dict(zip(COLUMNS, [commit.strip(), datetime.date.today().isoformat(), path, kind,
                                       calls, rounds, text, seconds])))
    with RESULTS.open("w", newline="") as file:
        writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
    return run.returncode


if __name__ == "__main__":
    sys.exit(main())
