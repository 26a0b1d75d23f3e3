# SPDX-License-Identifier: Apache-2.0
"""Images made to harm their reader: each is refused in words or decoded, within limits."""
import os
import pathlib
import subprocess

import farm
import hostile_pictures

READER = farm.BIN.parent / "tests" / "picture-read"
SECONDS_MAX = 20  # of processor time
# The most pixels as floats with their averages, and what reading them takes beside.
MEBIBYTES_MAX = 2048
HAS_SANITIZER = "PEN_SLOW" in os.environ


def verdicts(paths):
    run = subprocess.run([READER, *paths], capture_output=True, text=True, errors="replace",
                         timeout=600 * farm.SLOW)
    assert run.returncode == 0, run.stderr
    return [line.split(" ", 3) for line in run.stdout.splitlines()]


def is_within_limits(kind, rest):
    """Sizes, time and memory of what was decoded; time, memory and reason of what was refused."""
    if kind == "decoded":
        width, height = map(int, rest[0].split("x"))
        if not (1 <= width <= 16384 and 1 <= height <= 16384 and width * height <= 1 << 26):
            return False
        rest = rest[1:]
    elif kind != "refused" or not rest[2].isprintable() or len(rest[2]) < 10:
        return False
    return (int(rest[0]) <= 1000 * SECONDS_MAX * farm.SLOW
            and (HAS_SANITIZER or int(rest[1]) <= MEBIBYTES_MAX))


def test_pictures_are_refused_or_decoded_within_limits(tmp_path):
    """Broken by a picture that crashes its reader, hangs it, or makes it take memory without bound;
    by one that is refused though it is good, or decoded though nothing of it can be."""
    made = list(hostile_pictures.all_pictures(tmp_path))
    paths = [tmp_path / f"{i}.picture" for i in range(len(made))]
    wrong = []

    for path, (_, content, _) in zip(paths, made, strict=True):
        path.write_bytes(content)
    found = verdicts(paths)
    for (name, _, verdict), (kind, *rest) in zip(made, found, strict=True):
        print(name, kind, rest)
        if not is_within_limits(kind, rest) or verdict not in (None, kind):
            wrong.append((name, kind, rest))
    assert not wrong
    assert len(made) >= 300
    assert sum(kind == "refused" for kind, *_ in found) >= 100
