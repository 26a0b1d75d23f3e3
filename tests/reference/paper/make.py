#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Renders the figures of the course paper into deploy/images/paper-NAME.png.

Each figure is one scene of this directory in three variants, side by side. The paper's figures:
one sample against stratified n x n; five equal balls at distances 10, 20, 30, 40 and 50 with the
lens focused at 20 and three apertures; the same with one aperture focused at 20, 30 and 40, on a
sphere about the eye.
"""
import json
import pathlib
import sys

import numpy as np

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[2]
sys.path.insert(0, str(ROOT / "tests/support"))
import farm  # noqa: E402
import image  # noqa: E402

FIGURES = {
    "antialiasing": [{"sampling": {"samples": n * n}} for n in (1, 4, 8)],
    "aperture": [{"camera": {"aperture_radius": radius}} for radius in (1, 2, 3)],
    "focus": [{"camera": {"focus_distance": distance}} for distance in (20, 30, 40)],
}
MAGNIFY = {"antialiasing": 2}
GAP = 8


def envelopes(figure, **more):
    """What to POST for each variant; more is merged into every scene."""
    base = json.loads((HERE / f"{figure}.json").read_text())
    for key, members in more.items():
        base[key].update(members)
    return [{"scene": base, "override": override} for override in FIGURES[figure]]


def panel(data, magnify):
    pixels = image.read(data, "png")
    return pixels.repeat(magnify, axis=0).repeat(magnify, axis=1)


def compose(panels):
    gap = np.ones((panels[0].shape[0], GAP, 3), dtype=np.float32)
    row = [part for each in panels for part in (each, gap)]
    return np.concatenate(row[:-1], axis=1)


def main():
    directory = ROOT / "deploy/images"
    directory.mkdir(parents=True, exist_ok=True)
    with farm.Farm() as service:
        for figure in FIGURES:
            panels = []
            for envelope in envelopes(figure):
                render = service.submit(envelope)
                service.wait(render, 120)
                panels.append(panel(service.image(render, "png"), MAGNIFY.get(figure, 1)))
            path = directory / f"paper-{figure}.png"
            image.write_file(path, compose(panels), "uint8")
            print(path.relative_to(ROOT), path.stat().st_size)


if __name__ == "__main__":
    main()
