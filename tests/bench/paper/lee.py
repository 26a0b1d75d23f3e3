# SPDX-License-Identifier: Apache-2.0
"""Lee, Redner, Uselton 1985: samples until the estimate is good enough, with some confidence."""
import numpy as np
import rig

SCENES = ["five_balls", "depth_of_field"]
SIZE = {"width": 320, "height": 180}
UNIFORM = [16, 32, 64, 128, 256, 512]
ERRORS = [0.04, 0.02, 0.01]
CONFIDENCES = [0.8, 0.95, 0.99]
TRUTH, MOST = 8192, 2048


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


def section(given):
    saved, missed, panels = [], [], []
    for name in SCENES:
        truth = given.render(rig.scene(name, image=SIZE, sampling={"samples": TRUTH, "seed": 99}))
        saved += savings(given, name, truth.pixels)
        missed += rates(given, name, truth.pixels)
        panels.append(given.render(adaptive(name, 0.02, 0.95)).pixels)
    shown = rig.picture("lee", panels, 2, caption="Adaptive, error 0.02 at confidence 0.95")
    head = ["scene", "error asked", "samples", "RMSE", "uniform samples, equal RMSE", "saved",
            "99th percentile", "saved at equal 99th percentile"]
    rate = ["scene", "confidence", "allowed", "beyond the error", "beyond four times"]
    return f"""## Lee, Redner, Uselton 1985: samples where they are needed

Adaptive sampling, from 16 up to {MOST} samples a pixel, against uniform counts, {SIZE['width']}×\
{SIZE['height']}. Errors are of v / (1 + v), the largest of three channels, against {TRUTH} samples.
"Saved" is how many times as many samples uniform sampling takes for the same error.

{rig.table(head, saved)}

How many pixels are off by more than the error that was asked for, of three seeds at an error of
0.02, and how many may be by the confidence:

{rig.table(rate, missed)}

{shown}"""
