#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Measures what the papers behind the renderer claim, and writes tests/reference/papers.md.

    papers.py [PART …]     all parts, or only those named: course lee keller wang cook boulos wald

Each part is a module of tests/bench/paper. It renders by a coordinator of its own with two render
processes, and replaces its section of the page, its rows of the table that the page opens with, and
its pictures in tests/reference/papers. Costs are processor seconds of the render processes, what is
compared is measured in turn: other work on the machine touches the figures little.
"""
import argparse
import importlib
import pathlib
import re
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
    """{part: (its section, its rows of the opening table)}, of a page as this program writes it."""
    rows = re.findall(r"^(\| \[[^]]*\]\(#(\w+)\).*)$", text, re.MULTILINE)
    found = {}
    for piece in text.split('\n<a id="')[1:]:
        name, _, body = piece.partition('"></a>\n\n')
        found[name] = body.strip("\n"), [row for row, part in rows if part == name]
    return found


def page(found):
    parts = [name for name in PARTS if name in found]
    opening = rig.table(["paper", "claim", "theirs", "ours"], [])
    rows = [row for name in parts for row in found[name][1]]
    return "\n".join([HEAD, opening, *rows, "",
                      *(f'<a id="{name}"></a>\n\n{found[name][0]}\n' for name in parts)])


def measure(name):
    """What sections has of a part, by rendering."""
    with farm.Farm(2) as service, tempfile.TemporaryDirectory() as scratch:
        part = importlib.import_module(name)
        text, claims = part.section(rig.Rig(service, scratch))
    link = f"[{part.PAPER}](#{name})"
    return (f"## {text}", [f"| {' | '.join(map(rig.cell, [link, *claim]))} |" for claim in claims])


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
        section = measure(name)
        found = sections(PAGE.read_text()) if PAGE.exists() else {}
        PAGE.write_text(page({**found, name: section}))
        print(f"{name}: {time.monotonic() - start:.0f} s", flush=True)


if __name__ == "__main__":
    main()
