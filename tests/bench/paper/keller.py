# SPDX-License-Identifier: Apache-2.0
"""Keller, Heidrich 2001: interleaved sampling; a few sample patterns repeated over the image."""
import rig

PAPER = "Keller, Heidrich 2001"
COUNTS = [1, 4, 16]
SIDES = [3, 4]
SIZE = {"width": 320, "height": 180}


def blurred(pixels, side):
    """Means over side x side pixels, about what the eye makes of noise as fine as pixels."""
    height, width = (n - side + 1 for n in pixels.shape[:2])
    return sum(pixels[y:height + y, x:width + x]
               for y in range(side) for x in range(side)) / side ** 2


def errors(pixels, truth):
    """Of the pixels, and of their means over each block's size."""
    return [rig.rmse(pixels, truth),
            *(rig.rmse(blurred(pixels, side), blurred(truth, side)) for side in SIDES)]


def section(given):
    def wanted(samples, **more):
        return rig.scene("soft_shadow", image=SIZE, sampling={"samples": samples, **more})

    modes = {"uniform": {}, **{f"interleaved, {side}×{side}": {"mode": "interleaved",
                                                               "pattern": side} for side in SIDES}}
    truth = given.render(wanted(1024, seed=1)).pixels
    rows, panels, found = [], [], {}
    for samples in COUNTS:
        scenes = {mode: wanted(samples, **more) for mode, more in modes.items()}
        seconds = given.in_turn(scenes, 5)
        for mode, scene in scenes.items():
            pixels = given.render(scene).pixels
            panels.append(pixels[60:150, 90:250])
            found[samples, mode] = errors(pixels, truth)
            rows.append([samples, mode, *found[samples, mode], seconds[mode]])
    shown = rig.picture("keller", panels, 3, 2,
                        "Uniform, 3×3 and 4×4 patterns; 1, 4 and 16 samples a pixel")
    claims = []
    for k, side in enumerate(SIDES, 1):
        gains = [found[samples, "uniform"][k] / found[samples, f"interleaved, {side}×{side}"][k]
                 for samples in COUNTS]
        claims.append([f"error of {side}×{side} means, uniform over interleaved, 1, 4, 16 samples a "
                       "pixel", "more than 1", ", ".join(f"{gain:.2f}" for gain in gains)])
    head = ["samples", "mode", "RMSE", "of 3×3 means", "of 4×4 means", "seconds"]
    return f"""Keller, Heidrich 2001: interleaved sampling

A sample pattern for each pixel of a block, the block repeated over the image, against patterns of
each pixel's own, on the penumbras of `soft_shadow`, {SIZE['width']}×{SIZE['height']}. A pixel alone is no
better. What is gained is that the patterns of a block complete each other: see the error of means
over blocks.

{rig.table(head, rows)}

{shown}""", claims
