# SPDX-License-Identifier: Apache-2.0
"""Loops over lanes that are marked to be vectorised are, in the build for x86-64-v3.

Breaks when a change (a flag that is read in a loop, a call that is not inlined) makes the compiler
take the lanes of a packet one by one: nothing but the time of a render would tell.
"""
import json
import os
import re
import shlex
import subprocess

import pytest
from farm import BIN

COMMANDS = BIN.parent / "compile_commands.json"
NOTE = re.compile(r"^(\S+?):(\d+):\d+: (missed|optimized): +(couldn't vectorize loop|loop vectorized)")


def commands():
    """Of the hot files with such loops: the file and how it is compiled."""
    if not COMMANDS.exists():
        return
    for entry in json.loads(COMMANDS.read_text()):
        if "pen_kernel_v3" in entry["command"] and "#pragma omp simd" in open(entry["file"]).read():
            yield pytest.param(entry, id=os.path.basename(entry["file"]))


def loops(path):
    """The lines of marked loops, and those beside them: what they declare is told there too."""
    with open(path) as source:
        lines = source.read().split("\n")
    return {number + 2 + step for number, line in enumerate(lines) if "#pragma omp simd" in line
            for step in (-1, 0, 1)}


def notes(entry):
    """What the compiler says of loops in the file itself: (line, whether it vectorised)."""
    words = [word for word in shlex.split(entry["command"]) if not word.endswith("ccache")]
    words[words.index("-o") + 1] = os.devnull
    if "-MF" in words:
        words[words.index("-MF") + 1] = os.devnull
    text = subprocess.run([*words, "-fopt-info-vec-all"], cwd=entry["directory"],
                          capture_output=True, text=True, check=True, timeout=60).stderr
    for line in text.splitlines():
        match = NOTE.match(line)
        if match and os.path.basename(match[1]) == os.path.basename(entry["file"]):
            yield int(match[2]), match[3] == "optimized"


def test_there_are_hot_files():
    """Breaks when the kernels are renamed and nothing would be looked at any more."""
    assert len(list(commands())) >= 10


@pytest.mark.parametrize("entry", commands())
def test_marked_loops_are_vectorised(entry):
    marked = loops(entry["file"])
    found = [note for note in notes(entry) if note[0] in marked]
    assert any(good for _, good in found)
    scalar = sorted({line for line, good in found if not good})
    assert not scalar, f"taken lane by lane: lines {scalar}"
