#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Measures how fast Penumbra is, and writes tests/bench/RESULTS.md.

    run.sh [NAME …]      all parts, or only those named, whose sections are replaced

Each part is a command of its own, written above its figures. On a machine with two free cores all
of them take less than an hour.
"""
import os
import pathlib
import platform
import re
import subprocess
import sys
import time

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[1]
PAGE = HERE / "RESULTS.md"

# Of each part: its name, what it shows, its command.
PARTS = [
    ("equal-error", "Time to an error that Cycles has with 64 and with 256 samples",
     ["tests/bench/equal_error.py", "--runs", "3"]),
    ("equal-samples", "Samples a second beside Cycles and POV-Ray",
     ["tests/bench/peers.py", "--runs", "3"]),
    ("limit", "The whole renderer beside the bare traversal of its rays", ["tests/bench/limit.py"]),
    ("many-lights", "A thousand emissive triangles beside one rectangle light",
     ["tests/bench/many_lights.py"]),
    ("packets", "Millions of rays a second by single calls of Embree and by packets",
     ["build/release/tests/packets"]),
    ("load", "A coordinator under polls and posts", ["tests/bench/load.sh"]),
]

INTRODUCTION = """# Results

Written by `tests/bench/run.sh` (`tests/run.sh long run` builds first). Each part can be run alone,
by the command above its figures or by `tests/bench/run.sh NAME`. Ratios are of medians of runs in
turn, with the least and the greatest; on a machine that does other work too, those by processor
time still hold, and seconds by the wall do not.
"""


def output_of(*command):
    try:
        return subprocess.run(command, capture_output=True, text=True, check=False,
                              timeout=60, cwd=ROOT).stdout.strip()
    except OSError:
        return ""


def first_line(*command):
    return (output_of(*command).splitlines() or ["not installed"])[0]


def machine():
    """What the figures depend on, as one paragraph."""
    model = re.search(r"model name\s*: (.*)", pathlib.Path("/proc/cpuinfo").read_text())
    changed = "with changes" if output_of("git", "status", "--porcelain", "-uno") else ""
    facts = [
        time.strftime("%Y-%m-%d", time.gmtime()),
        f"commit {output_of('git', 'rev-parse', '--short', 'HEAD')} {changed}".strip(),
        f"{model.group(1) if model else platform.machine()}, {os.cpu_count()} cores",
        f"load average {os.getloadavg()[0]:.1f} at the start",
        f"Linux {platform.release().split('-')[0]}",
        first_line("gcc", "--version"),
        first_line("blender", "--version"),
        first_line("dpkg-query", "-W", "-f", "libembree ${Version}", "libembree3-3"),
        first_line("dpkg-query", "-W", "-f", "POV-Ray ${Version}", "povray"),
    ]
    return "; ".join(facts)


def measure(title, command):
    """A section's text, and whether what it promises holds."""
    about, start = machine(), time.monotonic()
    program = ["/usr/bin/python3"] if command[0].endswith(".py") else []
    run = subprocess.run([*program, *command], capture_output=True, text=True, check=False,
                         cwd=ROOT)
    minutes = (time.monotonic() - start) / 60
    text = run.stdout.rstrip() or "no output"
    if run.returncode != 0:
        tail = "\n".join(run.stderr.strip().splitlines()[-3:])
        text += f"\n\nexit code {run.returncode}: something promised does not hold\n{tail}".rstrip()
    return (f"## {title}\n\n{about}; {minutes:.0f} min.\n\n```\n$ {' '.join(command)}\n{text}\n"
            "```\n"), run.returncode == 0


def sections():
    """Those of the page as it is, by title."""
    text = PAGE.read_text() if PAGE.exists() else ""
    parts = re.split(r"^## (.*)\n", text, flags=re.M)
    return {title: f"## {title}\n{body.rstrip()}\n"
            for title, body in zip(parts[1::2], parts[2::2])}


def main():
    names = [name for name, _, _ in PARTS]
    wanted = sys.argv[1:] or names
    if not set(wanted) <= set(names):
        sys.exit(f"{__doc__}\nNAME: {', '.join(names)}")
    known, holds = sections(), True
    for name, title, command in PARTS:
        if name not in wanted:
            continue
        known[title], good = measure(title, command)
        holds &= good
        found = [known[title] for _, title, _ in PARTS if title in known]
        kept = [text for title, text in known.items() if title not in {t for _, t, _ in PARTS}]
        PAGE.write_text("\n".join([INTRODUCTION, *found, *kept]))
    return int(not holds)


if __name__ == "__main__":
    sys.exit(main())
