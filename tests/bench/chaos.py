#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Goes on with the chaos run, or (PEN_LONG=power, wire) with the power cuts or the spoiled wires, and
adds a row to the results.

PEN_LONG_SECONDS chooses how long (default 1800). The seed is that of the last row and one, or
PEN_LONG_SEED, with which several can go on side by side.
"""
import csv
import datetime
import fcntl
import os
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
COLUMNS = ["commit", "date", "seed", "seconds", "renders", "fired", "passed"]
WHAT = os.environ.get("PEN_LONG", "chaos")
SECONDS = os.environ.get("PEN_LONG_SECONDS", "1800")


def figures(text):
    """How many renders were accepted, and what struck how often."""
    if WHAT == "power":
        found = re.search(r"(\d+) power cuts, (\d+) renders.*\n(rounds .*)", text)
        return (found[2], f"cut {found[1]}, {found[3]}") if found else ("", "")
    found = re.search(r"^\{(.*)\} (\d+) renders$", text, flags=re.M)
    return (found[2], found[1].replace("'", "").replace(":", "").replace(",", "")) if found else ("", "")


def first_round(rows):
    """Of the power cuts, after the last one that passed."""
    for row in reversed(rows):
        found = re.search(r"rounds \d+-(\d+) of (\d+)", row["fired"])
        if found and row["passed"] == "yes":
            return 1 + int(found[1]) % int(found[2])
    return 1


def add(path, row):
    """To what others may have added in the meantime."""
    with path.open("a+", newline="") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        file.seek(0, os.SEEK_END)
        if not file.tell():
            csv.writer(file, lineterminator="\n").writerow(COLUMNS)
        csv.writer(file, lineterminator="\n").writerow(row)


def main():
    path = ROOT / f"tests/results/{WHAT}.csv"
    rows = list(csv.DictReader(path.open())) if path.exists() else []
    seed = int(os.environ.get("PEN_LONG_SEED") or
               1 + max((int(row["seed"]) for row in rows), default=0))
    name = f"PEN_{WHAT.upper()}"
    head = ["git", "-c", "safe.directory=*", "rev-parse", "--short", "HEAD"]
    commit = subprocess.run(head, cwd=ROOT, stdout=subprocess.PIPE, text=True, check=True).stdout
    run = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-rP", f"tests/chaos/test_{WHAT}.py"], cwd=ROOT, check=False,
        env={"PEN_POWER_FIRST": str(first_round(rows)), **os.environ, f"{name}_SEED": str(seed),
             f"{name}_SECONDS": SECONDS},
        stdout=subprocess.PIPE, text=True)
    print(run.stdout, end="")
    renders, fired = figures(run.stdout)
    add(path, [commit.strip(), datetime.date.today().isoformat(), seed, SECONDS, renders, fired,
               "no" if run.returncode else "yes"])
    return run.returncode


if __name__ == "__main__":
    sys.exit(main())
