#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""How time grows with work: tables and plots in tests/bench/scaling.

    scaling.py [--runs 3] [--most 10000000] [--to DIRECTORY] [TABLE …]

The tables are samples, pixels, processes, tile (rendered by a farm, five_balls), triangles and
lights (by render-core, so that building and rendering are told apart). Each is a CSV file of medians,
with the least and the greatest of the runs, and a plot. --most leaves out larger values.
"""
import argparse
import csv
import json
import math
import pathlib
import statistics
import subprocess
import sys
import tempfile
import time

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "support"))
import farm  # noqa: E402
import mesh_scene  # noqa: E402
import scene  # noqa: E402
from plot import plot  # noqa: E402

RESULTS = HERE / "scaling"
FIVE_BALLS = HERE.parent / "reference/scenes/five_balls.json"


def subject(width, samples):
    doc = json.loads(FIVE_BALLS.read_text())
    doc["image"].update(width=width, height=width * 9 // 16)
    doc["sampling"] = {"mode": "uniform", "samples": samples}
    return doc


def by_farm(service, doc, runs):
    """Of each run the seconds of rendering; the first, which makes the scene, does not count."""
    found = []
    for _ in range(runs + 1):
        render = service.submit(doc)
        found.append(max(service.wait(render, 300)["seconds"], 0.001))
    return {"rendering": found[1:]}


def by_core(doc, directory, runs):
    """Of each run the seconds of all before the first ray, and those of rendering."""
    path = directory / "scene.json"
    path.write_text(json.dumps(doc))
    command = [farm.BIN.parent / "tests/render-core", path, "/dev/null", "--assets", directory,
               "--processes", "2", "--time"]
    found = {"rendering": [], "until the first ray": []}
    for _ in range(runs):
        start = time.monotonic()
        told = subprocess.run(command, capture_output=True, text=True, check=True, timeout=600)
        rendering = float(told.stdout.split()[0])
        found["rendering"].append(rendering)
        found["until the first ray"].append(time.monotonic() - start - rendering)
    return found


def samples(values, runs):
    with farm.Farm(2) as service:
        for value in values:
            yield value, by_farm(service, subject(320, value), runs)


def pixels(values, runs):
    with farm.Farm(2) as service:
        for value in values:
            doc = subject(round(math.sqrt(value * 16 / 9)), 4)
            yield doc["image"]["width"] * doc["image"]["height"], by_farm(service, doc, runs)


def processes(values, runs):
    for value in values:
        with farm.Farm(value) as service:
            yield value, by_farm(service, subject(640, 64), runs)


def tile(values, runs):
    for value in values:
        with farm.Farm(2, "--tile", value) as service:
            yield value, by_farm(service, subject(640, 64), runs)


def triangles(values, runs):
    for value in values:
        doc, digest, data = mesh_scene.for_penumbra([mesh_scene.hills_of(value)])
        doc["image"].update(width=320, height=180)
        doc["sampling"]["samples"] = 16
        with tempfile.TemporaryDirectory() as directory:
            (pathlib.Path(directory) / digest).write_bytes(data)
            yield value, by_core(doc, pathlib.Path(directory), runs)


def lights(values, runs):
    """As much power from so many rectangles over a floor and a ball."""
    for value in values:
        columns = math.ceil(math.sqrt(value))
        step = 8 / columns
        panels = [scene.panel([step * (i % columns) - 4, 5, step * (i // columns) - 4],
                              [step / 2, 0, 0], [0, 0, step / 2], 20 * columns ** 2 / value)
                  for i in range(value)]
        doc = scene.build(320, 180, 16, [scene.floor(), scene.sphere([0, 1, 0])], lights=panels,
                          camera=scene.look([0, 2, 6], [0, 1, 0]))
        with tempfile.TemporaryDirectory() as directory:
            yield value, by_core(doc, pathlib.Path(directory), runs)


# Of each table: what makes it, and its values.
TABLES = {
    "samples": (samples, [4 ** i for i in range(6)]),
    "pixels": (pixels, [10 ** i for i in range(3, 8)]),
    "triangles": (triangles, [10 ** i for i in range(3, 8)]),
    "lights": (lights, [10 ** i for i in range(5)]),
    "processes": (processes, [1, 2, 4, 8]),
    "tile": (tile, [16, 32, 64, 128, 256]),
}


def write(directory, name, rows):
    directory.mkdir(exist_ok=True)
    with (directory / f"{name}.csv").open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow([name, "seconds of", "median", "least", "greatest"])
        for value, found in rows:
            for what, times in found.items():
                middle = statistics.median(times)
                writer.writerow([value, what, *(f"{t:.4g}" for t in (middle, min(times), max(times)))])
    curves = {what: [(value, statistics.median(found[what])) for value, found in rows]
              for what in rows[0][1]}
    (directory / f"{name}.svg").write_text(plot(f"seconds over {name}", curves))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--most", type=int, default=10 ** 7)
    parser.add_argument("--to", type=pathlib.Path, default=RESULTS)
    parser.add_argument("tables", nargs="*", default=list(TABLES))
    options = parser.parse_args()
    for name in options.tables:
        make, values = TABLES[name]
        rows = []
        for value, found in make([v for v in values if v <= options.most], options.runs):
            rows.append((value, found))
            print(f"{name:10}{value:10}  " + "  ".join(
                f"{what} {statistics.median(times):.4g} s ({min(times):.4g} to {max(times):.4g})"
                for what, times in found.items()), flush=True)
        write(options.to, name, rows)


if __name__ == "__main__":
    main()
