#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""What adaptive sampling saves: error over samples per pixel, against uniform sampling.

    PYTHONPATH=tests/support python3 tests/bench/adaptive.py [DIRECTORY]

Renders two of the reference scenes uniformly with 16 to 2048 samples, adaptively to several errors,
and once with 16384 samples of another seed for comparison. Errors are of v / (1 + v), the largest
of a pixel's channels: their 99th percentile and their root mean square over the image. DIRECTORY
(tests/results) gets adaptive.csv and adaptive.svg. Printed are how many times as many samples
uniform sampling needs for the same 99th percentile, and its RMSE at as many samples over ours.
"""
import csv
import json
import math
import pathlib
import sys

import farm
from sampling_error import Subject, compare

SCENES = farm.ROOT / "tests/reference/scenes"
NAMES = ("five_balls", "depth_of_field")
UNIFORM = [16 << i for i in range(8)]
ERRORS = [0.02, 0.01, 0.007, 0.005, 0.0035]
REFERENCE = 16384
MOST = 4096
COLUMNS = ["scene", "mode", "error", "samples", "p99", "rmse", "beyond", "beyond_4"]


def measure(service, name):
    subject = Subject(service, json.loads((SCENES / f"{name}.json").read_text()), REFERENCE)
    uniform = [subject.uniform(samples) for samples in UNIFORM]
    adaptive = [subject.adaptive(error, MOST) for error in ERRORS]
    for row in adaptive:
        fewer, better = compare(uniform, row)
        print(f"{name}: error {row['error']:g}: {row['samples']:.0f} samples, 1/{fewer:.2f} of "
              f"uniform's for p99 {row['p99']:.4f}; RMSE 1/{better:.2f}; beyond error "
              f"{100 * row['beyond']:.2f} %, beyond 4 times error {row['beyond_4']:.1e}", flush=True)
    return [{"scene": name, **row} for row in uniform + adaptive]


def line(rows, key, place):
    """A curve of a panel at place (x, y), both axes logarithmic."""
    points = [(place[0] + 60 + 70 * math.log2(row["samples"] / 16) / 2,
               place[1] + 20 + 65 * math.log10(0.1 / row[key])) for row in rows]
    color = "#1f6fb4" if rows[0]["mode"] == "uniform" else "#c8501e"
    path = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
    dots = "".join(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="2.5" fill="{color}"/>'
                   for x, y in points)
    return f'<polyline points="{path}" fill="none" stroke="{color}"/>{dots}'


def panel(rows, name, key, place):
    """One scene's curves of p99 or RMSE: blue uniform, red adaptive."""
    x, y = place
    parts = [f'<text x="{x + 60}" y="{y + 12}">{name}: {key} of v/(1+v) over samples</text>']
    for i in range(5):
        left = x + 60 + 70 * i
        parts.append(f'<path d="M{left} {y + 20}v195" stroke="#ddd"/>'
                     f'<text x="{left - 8}" y="{y + 228}">{16 << 2 * i}</text>')
    for i in range(4):
        top = y + 20 + 65 * i
        parts.append(f'<path d="M{x + 60} {top}h280" stroke="#ddd"/>'
                     f'<text x="{x + 15}" y="{top + 4}">{10 ** -(i + 1):g}</text>')
    for mode in ("uniform", "adaptive"):
        parts.append(line([row for row in rows if (row["scene"], row["mode"]) == (name, mode)], key,
                          place))
    return "".join(parts)


def plot(rows):
    panels = [panel(rows, name, key, (360 * column, 240 * line_))
              for column, name in enumerate(NAMES) for line_, key in enumerate(("p99", "rmse"))]
    return ('<svg xmlns="http://www.w3.org/2000/svg" width="720" height="480" font-family='
            '"sans-serif" font-size="11"><rect width="720" height="480" fill="white"/>'
            + "\n".join(panels) + "</svg>\n")


def main(directory):
    with farm.Farm(2) as service:
        rows = [row for name in NAMES for row in measure(service, name)]
    directory.mkdir(parents=True, exist_ok=True)
    with (directory / "adaptive.csv").open("w", newline="") as file:
        writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        writer.writeheader()
        writer.writerows({key: f"{value:.6g}" if isinstance(value, float) else value
                          for key, value in row.items()} for row in rows)
    (directory / "adaptive.svg").write_text(plot(rows))


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else farm.ROOT / "tests/results")
