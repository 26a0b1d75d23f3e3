#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Goes on with the simulation where the last run ended, and adds a row to the results.

PEN_SIMULATION_SECONDS chooses how long (default 600), PEN_SIMULATE another program to run: a copy,
when the tree is built anew meanwhile. The row names the commit that was there at the start.
"""
import csv
import os
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
RESULTS = ROOT / "tests/results/simulation.csv"
SIMULATE = os.environ.get("PEN_SIMULATE", ROOT / "build/release/tests/simulate")
SECONDS = os.environ.get("PEN_SIMULATION_SECONDS", "600")
COLUMNS = ["commit", "first", "seeds", "failed", "steps", "commits", "faults"]


def main():
    rows = list(csv.DictReader(RESULTS.open())) if RESULTS.exists() else []
    first = max((int(row["first"]) + int(row["seeds"]) for row in rows), default=1)
    head = ["git", "-c", "safe.directory=*", "rev-parse", "--short", "HEAD"]
    commit = subprocess.run(head, cwd=ROOT, stdout=subprocess.PIPE, text=True, check=True).stdout
    command = [SIMULATE, "--first", str(first), "--seeds", "1000000000", "--seconds", SECONDS]
    text = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=False).stdout
    print(text, end="")
    seeds, failed = map(int, re.search(r"(\d+) seeds from \d+: (\d+) failed", text).groups())
    steps, commits = map(int, re.search(r"steps: (\d+), commits: (\d+)", text).groups())
    faults = sum(map(int, re.findall(r" (\d+)", text[text.index("faults:"):].splitlines()[0])))
    rows.append(dict(zip(COLUMNS, [commit.strip(), first, seeds, failed, steps, commits, faults])))
    with RESULTS.open("w", newline="") as file:
        writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
    print(f"{sum(int(row['seeds']) for row in rows)} seeds in all, {sum(int(row['failed']) for row in rows)} failed")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
