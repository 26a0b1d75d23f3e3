# SPDX-License-Identifier: Apache-2.0
"""Lee, Redner, Uselton 1985: samples until the estimate is good enough, with some confidence."""
import csv

import numpy as np
import rig

PAPER = "Lee, Redner, Uselton 1985"
SCENES = ["five_balls", "depth_of_field"]
SIZE = {"width": 240, "height": 135}
UNIFORM = [16, 32, 64, 128, 256, 512]
ERRORS = [0.04, 0.02, 0.01]
CONFIDENCES = [0.8, 0.95, 0.99]
RESULTS = rig.ROOT / "tests/results"
TRUTH, MOST = 4096, 2048


def adaptive(name, error, confidence, seed=0):
    return rig.scene(name, image=SIZE, sampling={
        "mode": "adaptive", "samples": MOST, "error": error, "confidence": confidence,
        "seed": seed})


def errors(pixels, truth):
    """Of v / (1 + v): root mean square and 99th percentile over pixels."""
    off = np.abs(rig.squeezed(pixels) - rig.squeezed(truth)).max(axis=2)
    return float(np.sqrt((off ** 2).mean())), float(np.percentile(off, 99)), off


def savings(given, name, truth):
    found = [(samples, *errors(given.render(rig.scene(
        name, image=SIZE, sampling={"samples": samples})).pixels, truth)[:2])
        for samples in UNIFORM]
    samples, rms, p99 = (list(column) for column in zip(*found))
    rows = []
    for error in ERRORS:
        render = given.render(adaptive(name, error, 0.95))
        mean, worst, _ = errors(render.pixels, truth)
        rows.append([name, error, render.samples, mean, rig.at_error(mean, rms, samples),
                     rig.at_error(mean, rms, samples) / render.samples, worst,
                     rig.at_error(worst, p99, samples) / render.samples])
    return rows


def rates(given, name, truth):
    rows = []
    for confidence in CONFIDENCES:
        off = np.stack([errors(given.render(adaptive(name, 0.02, confidence, seed)).pixels,
                               truth)[2] for seed in range(3)])
        rows.append([name, confidence, 1 - confidence, float((off > 0.02).mean()),
                     float((off > 0.08).mean())])
    return rows


def full_curves():
    """What tests/bench/adaptive.py has found of both scenes at their own size, as a table; and how
    many times as many samples uniform sampling takes for the 99th percentile at error 0.01."""
    with (RESULTS / "adaptive.csv").open() as file:
        found = [row for row in csv.DictReader(file) if row["mode"] == "adaptive"]
    head = ["scene", "error asked", "samples", "99th percentile",
            "uniform's samples for the same, over ours", "RMSE", "uniform's at as many samples, "
            "over ours", "beyond the error", "beyond four times"]
    keys = ["scene", "error", "samples", "p99", "fewer", "rmse", "better", "beyond", "beyond_4"]
    fewer = {row["scene"]: float(row["fewer"]) for row in found if row["error"] == "0.01"}
    return rig.table(head, [[row[keys[0]], *(float(row[key]) for key in keys[1:])]
                            for row in found]), fewer


def many_seeds():
    with (RESULTS / "adaptive-seeds.csv").open() as file:
        return list(csv.DictReader(file))[-1]


def section(given):
    saved, missed, panels = [], [], []
    for name in SCENES:
        truth = given.render(rig.scene(name, image=SIZE, sampling={"samples": TRUTH, "seed": 99}))
        saved += savings(given, name, truth.pixels)
        missed += rates(given, name, truth.pixels)
        panels += [given.render(adaptive(name, 0.02, 0.95)).pixels,
                   given.counts(adaptive(name, 0.02, 0.95))]
    (full, fewer), seeds = full_curves(), many_seeds()
    shown = rig.picture("lee", panels, 2, caption="Error 0.02 at confidence 0.95, and where the "
                        "samples went")
    head = ["scene", "error asked", "samples", "RMSE", "uniform samples, equal RMSE", "saved",
            "99th percentile", "saved at equal 99th percentile"]
    rate = ["scene", "confidence", "allowed", "beyond the error", "beyond four times"]
    text = f"""Lee, Redner, Uselton 1985: samples where they are needed

Adaptive sampling, from 16 up to {MOST} samples a pixel, against uniform counts, {SIZE['width']}×\
{SIZE['height']}. Errors are of v / (1 + v), the largest of three channels, against {TRUTH} samples.
"Saved" is how many times as many samples uniform sampling takes for the same error. Where it
takes {UNIFORM[-1]}, it would take more, which were not rendered.

{rig.table(head, saved)}

The whole curves, at the scenes' own size with up to 4096 samples, by `tests/run.sh long adaptive`
([figures](../results/adaptive.csv)):

![99th percentile and RMSE over samples, uniform and adaptive](../results/adaptive.svg)

{full}

How many pixels are off by more than the error that was asked for, of three seeds at an error of
0.02, and how many may be by the confidence:

{rig.table(rate, missed)}

Of a small scene with {seeds['seeds']} seeds at an error of {seeds['error']} and a confidence of \
{seeds['confidence']}, {float(seeds['beyond']):.2e} of all pixels are beyond the error and \
{float(seeds['beyond_4']):.1e} beyond four times as much ([figures](../results/adaptive-seeds.csv)).

{shown}"""
    return text, [
        ["samples of uniform over adaptive, equal RMSE, errors asked from "
         f"{ERRORS[0]} to {ERRORS[-1]}", "more than 1",
         "; ".join(f"{name} " + ", ".join(f"{row[5]:.2g}" for row in saved if row[0] == name)
                   for name in SCENES)],
        ["the same, equal 99th percentile of the error, at error 0.01 and the scenes' own size",
         "more than 1", "; ".join(f"{name} {fewer[name]:.2f}" for name in SCENES)],
        ["pixels beyond the error at confidence " + ", ".join(map(rig.cell, CONFIDENCES)),
         ", ".join(f"{1 - confidence:.2g}" for confidence in CONFIDENCES),
         "; ".join(f"{name} " + ", ".join(f"{row[3]:.2g}" for row in missed if row[0] == name)
                   for name in SCENES)]]
