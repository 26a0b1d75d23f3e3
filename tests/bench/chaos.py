#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Goes on with the chaos run, or (PEN_LONG=power, wire) with the power cuts or the spoiled wires, and
adds a row to the results.

PEN_LONG_SECONDS chooses how long (default 1800); the seed is that of the last row and one.
"""
import csv
import datetime
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
        found = re.search(r"(\d+) power cuts, (\d+) renders", text)
        return (found[2], f"cut {found[1]}") if found else ("", "")
    found = re.search(r"^\{(.*)\} (\d+) renders$", text, flags=re.M)
    return (found[2], found[1].replace("'", "").replace(":", "").replace(",", "")) if found else ("", "")


def main():
    path = ROOT / f"tests/results/{WHAT}.csv"
    rows = list(csv.DictReader(path.open())) if path.exists() else []
    seed = 1 + max((int(row["seed"]) for row in rows), default=0)
    name = f"PEN_{WHAT.upper()}"
    run = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-rP", f"tests/chaos/test_{WHAT}.py"], cwd=ROOT, check=False,
        env={**os.environ, f"{name}_SEED": str(seed), f"{name}_SECONDS": SECONDS},
        stdout=subprocess.PIPE, text=True)
    print(run.stdout, end="")
    head = ["git", "-c", "safe.directory=*", "rev-parse", "--short", "HEAD"]
    commit = subprocess.run(head, cwd=ROOT, stdout=subprocess.PIPE, text=True, check=True).stdout
    renders, fired = figures(run.stdout)
    rows.append(dict(zip(COLUMNS, [commit.strip(), datetime.date.today().isoformat(), seed, SECONDS,
                                   renders, fired, "no" if run.returncode else "yes"])))
    with path.open("w", newline="") as file:
        writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
    return run.returncode


if __name__ == "__main__":
    sys.exit(main())
