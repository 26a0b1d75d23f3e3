#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Measures how fast Penumbra is, and writes tests/bench/RESULTS.md.

    run.sh [--quick] [NAME …]      all parts, or only those named, whose sections are replaced

Each part is a command of its own, written above its figures; what is told below these stays. On a
machine with two free cores all of them take 35 minutes. --quick runs everything at small size, which
takes a few minutes and shows that it works: the page goes to build/RESULTS.md and tells no truth.
"""
import os
import pathlib
import platform
import re
import shlex
import signal
import subprocess
import sys
import time

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[1]
PAGE, QUICK_PAGE = HERE / "RESULTS.md", ROOT / "build/RESULTS.md"

# Of each part: its name, what it shows, its command, what it has instead of it when in a hurry, and
# the minutes after which it is stopped.
PARTS = [
    ("equal-error", "Time to an error that Cycles has with 64 and with 256 samples",
     "tests/bench/equal_error.py --runs 3 --seeds 2 --scale 0.2 --full 0.5",
     "tests/bench/equal_error.py --runs 1 --seeds 1 --samples 16 --scale 0.1 --full 0.1 gloss mesh", 20),
    ("equal-samples", "Samples a second beside Cycles and POV-Ray",
     "tests/bench/peers.py --runs 3 --scale 0.4",
     "tests/bench/peers.py --runs 1 --scale 0.1 --samples 16 gloss", 8),
    ("limit", "The whole renderer beside the bare traversal of its rays",
     "tests/bench/limit.py", "tests/bench/limit.py --runs 1 --samples 2 gloss mesh", 5),
    ("many-lights", "A thousand emissive triangles beside one rectangle light",
     "tests/bench/many_lights.py", "tests/bench/many_lights.py --runs 1 --samples 2", 5),
    ("farm", "What the farm costs beside the rendering", "tests/bench/farm_cost.py",
     "tests/bench/farm_cost.py --pairs 1 --width 160 --cpu-samples 8", 9),
    ("latency", "How soon an image is there", "tests/bench/latency.py",
     "tests/bench/latency.py --runs 2", 3),
    ("animation", "What a frame costs beside its tiles", "tests/bench/animation.py",
     "tests/bench/animation.py 12 1", 4),
    ("memory", "Large scenes and images: memory, and time to the first ray",
     "tests/bench/memory.py", "tests/bench/memory.py --triangles 60000 --side 500 --runs 1", 8),
    ("isa", "Instruction sets", "tests/bench/isa.py", "tests/bench/isa.py --runs 1 --samples 1 gloss",
     3),
    ("scaling", "Time as work grows ([tables and plots](scaling))", "tests/bench/scaling.py",
     "tests/bench/scaling.py --runs 1 --most 1000 --to build/scaling", 8),
    ("packets", "Millions of rays a second by single calls of Embree and by packets",
     "build/release/tests/packets", "build/release/tests/packets", 3),
    ("load", "A coordinator beside nginx, in a crowd, and with many new renders",
     "tests/bench/load.sh", "tests/bench/load.sh --seconds 2 --rounds 1", 5),
]
# The order in which they are run: the longest last, so that the others are there without it.
LAST = ("scaling", "equal-samples", "equal-error")
INTERRUPTED = "interrupted"

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


def run(command, minutes):
    """What a command printed, and why it did not end well, or "". A stop ends all its processes."""
    words = shlex.split(command)
    program = ["/usr/bin/python3"] if words[0].endswith(".py") else []
    process = subprocess.Popen([*program, *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                               text=True, cwd=ROOT, start_new_session=True)
    try:
        output, errors = process.communicate(timeout=60 * minutes)
        code = process.returncode
        why = f"exit code {code}: something promised does not hold" if code else ""
    except (subprocess.TimeoutExpired, KeyboardInterrupt) as stop:
        os.killpg(process.pid, signal.SIGKILL)
        output, errors = process.communicate()
        why = INTERRUPTED if isinstance(stop, KeyboardInterrupt) else f"stopped after {minutes} min"
    tail = errors.strip().splitlines()[-3:] if why else []
    return output.rstrip() or "no output", "\n".join([why, *tail]).strip()


def measure(title, command, minutes):
    """A section's text without what is told below the figures, what is wrong, and its seconds."""
    about, start = machine(), time.monotonic()
    text, why = run(command, minutes)
    seconds = time.monotonic() - start
    if why:
        text += f"\n\n{why}"
    return (f"## {title}\n\n{about}; {seconds:.0f} s.\n\n```\n$ {command}\n{text}\n```\n", why,
            seconds)


def sections(page):
    """Those of the page as it is, by title."""
    text = page.read_text() if page.exists() else ""
    parts = re.split(r"^## (.*)\n", text, flags=re.M)
    return {title: f"## {title}\n{body.rstrip()}\n"
            for title, body in zip(parts[1::2], parts[2::2])}


def told(section):
    """What somebody wrote below a section's last figures."""
    return section.rpartition("\n```\n")[2].strip() if section else ""


def main():
    words = sys.argv[1:]
    quick = "--quick" in words
    names = [name for name, *_ in PARTS]
    wanted = [word for word in words if word != "--quick"] or names
    if not set(wanted) <= set(names):
        sys.exit(f"{__doc__}\nNAME: {', '.join(names)}")
    page = QUICK_PAGE if quick else PAGE
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    known, holds = sections(page), True
    for name, title, command, small, minutes in sorted(
            PARTS, key=lambda part: LAST.index(part[0]) if part[0] in LAST else -1):
        if name not in wanted:
            continue
        text, why, seconds = measure(title, small if quick else command, minutes)
        print(f"{name:14}{seconds:6.0f} s  {why.partition(chr(10))[0] or 'holds'}", flush=True)
        notes = told(known.get(title))
        known[title] = f"{text}\n{notes}\n" if notes else text
        holds &= not why
        found = [known[title] for _, title, *_ in PARTS if title in known]
        kept = [text for title, text in known.items() if title not in {t for _, t, *_ in PARTS}]
        page.write_text("\n".join([INTRODUCTION, *found, *kept]))
        if why.startswith(INTERRUPTED):
            break
    return int(not holds)


if __name__ == "__main__":
    sys.exit(main())
