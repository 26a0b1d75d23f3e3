# SPDX-License-Identifier: Apache-2.0
"""Keller, Heidrich 2001: interleaved sampling; a few sample patterns repeated over the image."""
import numpy as np
import rig

COUNTS = [1, 4, 16]
SIZE = {"width": 320, "height": 180}


def blurred(pixels):
    """Means over 3x3 pixels, about what the eye makes of noise as fine as pixels."""
    height, width = pixels.shape[:2]
    return sum(pixels[y:height - 2 + y, x:width - 2 + x]
               for y in range(3) for x in range(3)) / 9


def section(given):
    def wanted(samples, **more):
        return rig.scene("soft_shadow", image=SIZE, sampling={"samples": samples, **more})

    truth = given.render(wanted(4096)).pixels
    rows, panels = [], []
    for samples in COUNTS:
        scenes = {"uniform": wanted(samples),
                  "interleaved": wanted(samples, mode="interleaved", pattern=3)}
        seconds = given.in_turn(scenes, 5)
        for mode, scene in scenes.items():
            pixels = given.render(scene).pixels
            panels.append(pixels[60:150, 90:250])
            rows.append([samples, mode, rig.rmse(pixels, truth),
                         rig.rmse(blurred(pixels), blurred(truth)),
                         float(np.abs(np.diff(pixels, axis=1)).mean()), seconds[mode]])
    shown = rig.picture("keller", panels, 2, 2,
                        caption="Uniform and interleaved at 1, 4 and 16 samples")
    head = ["samples", "mode", "RMSE", "RMSE of 3×3 means", "mean step between neighbours",
            "seconds"]
    return f"""## Keller, Heidrich 2001: interleaved sampling

One sample pattern for each pixel of a 3×3 block, repeated over the image, against patterns of each
pixel's own, on the penumbras of `soft_shadow`, {SIZE['width']}×{SIZE['height']}. Between the two, a pixel
alone is no better. What is gained is that the nine patterns of any 3×3 pixels complete each other:
see the error of their means.

{rig.table(head, rows)}

{shown}"""
