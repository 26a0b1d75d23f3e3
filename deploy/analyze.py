# SPDX-License-Identifier: Apache-2.0
"""gcc's static analysis of every C file of the programs, as the release build compiles them: analyze.py BUILD

Prints what it finds; the exit code is 1 if there is anything. Kernels of the renderer are read once, for v3.
"""
import concurrent.futures
import json
import os
import pathlib
import shlex
import subprocess
import sys

# The analyzer of gcc 12 looks into one file at a time, and so takes pen_error_memory() for a function that may
# return 0: it goes on with what was not allocated. ASan, valgrind and failing allocations (tests/chaos) look after
# these. Everything else it knows is asked: double frees, uses after them, leaks of files, wrong pairs of functions,
# shifts, handlers of signals, frames left behind.
OPAQUE = ("use-of-uninitialized-value", "null-dereference", "null-argument", "possible-null-dereference",
          "possible-null-argument", "malloc-leak")
SECONDS_MAX = 300


def chosen(build):
    """One compilation of each file, not of tests and not of what the build writes."""
    root = pathlib.Path(__file__).resolve().parents[1]
    found = {}
    for command in json.loads((build / "compile_commands.json").read_text()):
        place = pathlib.Path(command["file"]).relative_to(root)
        if place.suffix == ".c" and place.parts[0] not in ("tests", "build") and (
                place not in found or "x86-64-v3" in command["command"]):
            found[place] = command
    return found


def without_outputs(words):
    kept, words = [], iter(words)
    for word in words:
        if word in ("-o", "-MF", "-MT"):
            next(words)
        elif word not in ("ccache", "-MD"):
            kept.append(word)
    return kept


def analyze(command):
    words = without_outputs(shlex.split(command["command"]))
    run = subprocess.run([*words, "-Wno-error", "-fanalyzer", *(f"-Wno-analyzer-{name}" for name in OPAQUE),
                          "-o", os.devnull], cwd=command["directory"], capture_output=True, text=True,
                         timeout=SECONDS_MAX)
    return run.stderr if run.returncode or "warning:" in run.stderr else ""


def main():
    commands = chosen(pathlib.Path(sys.argv[1]))
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        found = [text for text in pool.map(analyze, commands.values()) if text]
    sys.stdout.write("".join(found))
    sys.exit(1 if found or not commands else 0)


main()
