#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Measures what the papers behind the renderer claim, and writes tests/reference/papers.md.

    papers.py [PART …]     all parts, or only those named: course lee keller wang cook boulos wald

Each part is a module of tests/bench/paper. It renders by a coordinator of its own with two render
processes, and replaces its section of the page and its pictures in tests/reference/papers. Costs
are processor seconds of the render processes, what is compared is measured in turn: other work on
the machine touches the figures little.
"""
import argparse
import importlib
import pathlib
import sys
import tempfile
import time

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[1]
sys.path[:0] = [str(HERE.parent / "support"), str(HERE / "paper")]
import farm  # noqa: E402
import rig  # noqa: E402

PARTS = ["course", "lee", "keller", "wang", "cook", "boulos", "wald"]
PAGE = ROOT / "tests/reference/papers.md"
HEAD = """# The papers, reproduced

`tests/bench/papers.py` renders, measures and writes this page; `tests/bench/papers.py PART` one
part of it. Costs are processor seconds of the render processes on two cores; a range in brackets
is the least and the greatest of the runs. Errors are of linear values against a reference of many
more samples, unless said otherwise.
"""


def sections(text):
    """{part: its section}, of a page as this program writes it."""
    found = {}
    for piece in text.split("\n<!-- ")[1:]:
        name, _, body = piece.partition(" -->\n")
        found[name] = body.strip("\n")
    return found


def page(found):
    parts = [f"<!-- {name} -->\n{found[name]}\n" for name in PARTS if name in found]
    return "\n".join([HEAD, *parts])


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("parts", nargs="*", metavar="PART")
    wanted = parser.parse_args().parts or PARTS
    unknown = set(wanted) - set(PARTS)
    if unknown:
        parser.error(f"no such part: {', '.join(sorted(unknown))}")
    rig.PICTURES.mkdir(exist_ok=True)
    for name in wanted:
        start = time.monotonic()
        with farm.Farm(2) as service, tempfile.TemporaryDirectory() as scratch:
            section = importlib.import_module(name).section(rig.Rig(service, scratch))
        found = sections(PAGE.read_text()) if PAGE.exists() else {}
        PAGE.write_text(page({**found, name: section}))
        print(f"{name}: {time.monotonic() - start:.0f} s", flush=True)


if __name__ == "__main__":
    main()
