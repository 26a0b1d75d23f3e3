#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Compares a render with the same scene from another renderer.

    compare.py IMAGE.exr REFERENCE.exr [--block 10] [--mean 0.005] [--p99 0.03] [--max 0.15]

Noise must fade and bias must stay: values are compressed by v / (1 + v), so that a few bright
pixels do not decide, and averaged over square blocks. Of the absolute differences of the blocks,
relative to the mean of the reference, the mean, the 99th percentile and the largest are printed;
the exit code is 1 when one is over its limit.
"""
import argparse
import pathlib
import sys

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
import image  # noqa: E402

LIMITS = {"mean": 0.005, "p99": 0.03, "max": 0.15}


def block_means(pixels, side):
    """Means over side x side blocks; what is left over at the right and below does not count."""
    rows, columns = pixels.shape[0] // side, pixels.shape[1] // side
    whole = pixels[:rows * side, :columns * side]
    return whole.reshape(rows, side, columns, side, 3).mean(axis=(1, 3), dtype=np.float64)


def difference(pixels, reference, side=10):
    """The three figures, and the worst block as (x, y) in blocks."""
    if pixels.shape != reference.shape:
        raise ValueError(f"sizes differ: {pixels.shape} and {reference.shape}")
    if not np.isfinite(pixels).all():
        raise ValueError("the image has values that are not finite")
    found, wanted = (block_means(p / (1 + np.maximum(p, 0)), side) for p in (pixels, reference))
    blocks = np.abs(found - wanted).mean(axis=2) / wanted.mean()
    y, x = np.unravel_index(blocks.argmax(), blocks.shape)
    figures = {"mean": blocks.mean(), "p99": np.percentile(blocks, 99), "max": blocks.max()}
    return figures, (int(x), int(y))


def main():
    parser = argparse.ArgumentParser(description="Compares two renders of one scene.")
    parser.add_argument("image")
    parser.add_argument("reference")
    parser.add_argument("--block", type=int, default=10)
    for name, limit in LIMITS.items():
        parser.add_argument(f"--{name}", type=float, default=limit)
    arguments = parser.parse_args()
    try:
        figures, worst = difference(image.read_file(arguments.image),
                                    image.read_file(arguments.reference), arguments.block)
    except ValueError as error:
        sys.exit(str(error))
    print("  ".join(f"{name} {value:.4f}" for name, value in figures.items()),
          f" worst block x={worst[0]} y={worst[1]}")
    return int(any(figures[name] > getattr(arguments, name) for name in LIMITS))


if __name__ == "__main__":
    sys.exit(main())
