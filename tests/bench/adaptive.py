#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""What adaptive sampling saves against uniform sampling, and how often its estimate is wrong.

    adaptive.py [curves] [seeds]     both parts, or one of them

curves: two of the reference scenes uniformly with 16 to 1024 samples, adaptively to several errors,
and once with 4096 samples of another seed for comparison. Errors are of v / (1 + v), the largest of
a pixel's channels: their 99th percentile and their root mean square over the image. Written to
tests/results are adaptive.csv and adaptive.svg. In the former "fewer" is how many times as many
samples uniform sampling needs for the same 99th percentile, "better" its RMSE at as many samples
over adaptive's. Images are kept in build/adaptive: a run that was stopped goes on where it was, and
after a change of server/decide.c only adaptive ones are rendered again.

seeds: how many pixels of a small scene are beyond the error, and beyond four times as much, in 1,000
seeds; a row is added to tests/results/adaptive-seeds.csv.
"""
import argparse
import csv
import hashlib
import json
import pathlib
import subprocess
import sys

import numpy as np

HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(HERE.parent / "support"), str(HERE / "paper")]
import farm  # noqa: E402
from curves import plot  # noqa: E402
from sampling_error import Subject, compare, seeds_beyond, small_scene  # noqa: E402

SCENES = farm.ROOT / "tests/reference/scenes"
RESULTS = farm.ROOT / "tests/results"
KEPT = farm.ROOT / "build/adaptive"
NAMES = ("five_balls", "depth_of_field")
UNIFORM = [16 << i for i in range(7)]
ERRORS = [0.03, 0.02, 0.014, 0.01, 0.007]
REFERENCE = 4096
MOST = 4096
SEEDS = 1000
COLUMNS = ["scene", "mode", "error", "samples", "p99", "rmse", "fewer", "better", "beyond",
           "beyond_4"]


class Kept(Subject):
    """Keeps images, by what was asked for and by what would change them."""

    def render(self, sampling, seconds=3600):
        sources = ["core/render/render.h"]  # with PEN_RENDER_ABI
        if sampling.get("mode") == "adaptive":
            sources.append("server/decide.c")
        digest = hashlib.sha256(json.dumps([self.scene, sampling], sort_keys=True).encode())
        for source in sources:
            digest.update((farm.ROOT / source).read_bytes())
        path = KEPT / f"{digest.hexdigest()[:16]}.npz"
        if not path.exists():
            KEPT.mkdir(parents=True, exist_ok=True)
            pixels, samples = super().render(sampling, seconds)
            np.savez(path, pixels=pixels, samples=samples)
        kept = np.load(path)
        return kept["pixels"], float(kept["samples"])


def measure(service, name):
    subject = Kept(service, json.loads((SCENES / f"{name}.json").read_text()), REFERENCE)
    uniform = [subject.uniform(samples) for samples in UNIFORM]
    rows = [{"scene": name, **row} for row in uniform]
    for error in ERRORS:
        row = subject.adaptive(error, MOST)
        fewer, better = compare(uniform, row)
        rows.append({"scene": name, **row, "fewer": fewer, "better": better})
        print(f"{name}: error {error:g}: {row['samples']:.0f} samples, 1/{fewer:.2f} of uniform's for "
              f"p99 {row['p99']:.4f}; RMSE 1/{better:.2f}; beyond error {100 * row['beyond']:.2f} %, "
              f"beyond 4 times error {row['beyond_4']:.1e}", flush=True)
    return rows


def write_rows(path, columns, rows):
    with path.open("w", newline="") as file:
        writer = csv.DictWriter(file, columns, lineterminator="\n")
        writer.writeheader()
        writer.writerows({key: f"{value:.6g}" if isinstance(value, float) else value
                          for key, value in row.items()} for row in rows)


def curves():
    with farm.Farm(2) as service:
        rows = [row for name in NAMES for row in measure(service, name)]
    write_rows(RESULTS / "adaptive.csv", COLUMNS, rows)
    (RESULTS / "adaptive.svg").write_text(plot(rows, NAMES))


def seeds():
    error, confidence = 0.02, 0.9
    with farm.Farm(2, "--tile", 32) as service:
        subject = Subject(service, small_scene(), 65536)
        beyond, beyond_4 = seeds_beyond(subject, error, confidence, SEEDS)
    head = ["git", "-c", "safe.directory=*", "rev-parse", "--short", "HEAD"]
    commit = subprocess.run(head, capture_output=True, text=True, check=False, cwd=farm.ROOT)
    path = RESULTS / "adaptive-seeds.csv"
    row = {"commit": commit.stdout.strip(), "seeds": SEEDS, "error": error,
           "confidence": confidence, "allowed": 1.5 * (1 - confidence), "beyond": beyond,
           "beyond_4": beyond_4}
    print(row)
    rows = list(csv.DictReader(path.open())) if path.exists() else []
    write_rows(path, list(row), [*rows, row])


def main():
    parts = {"curves": curves, "seeds": seeds}
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("parts", nargs="*", metavar="PART")
    wanted = parser.parse_args().parts or list(parts)
    unknown = set(wanted) - set(parts)
    if unknown:
        parser.error(f"no such part: {', '.join(sorted(unknown))}")
    RESULTS.mkdir(exist_ok=True)
    for part in wanted:
        parts[part]()


if __name__ == "__main__":
    main()
