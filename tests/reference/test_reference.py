# SPDX-License-Identifier: Apache-2.0
"""The six reference scenes against images that Blender Cycles made of them.

The images in tests/reference/images (half floats) come from Blender 3.4.1, by the way of
tests/bench/cycles_scene.py.
"""
import json
import pathlib
import subprocess

import compare
import farm
import image
import numpy as np
import pytest

HERE = pathlib.Path(__file__).resolve().parent
SCENES = sorted(path.stem for path in (HERE / "scenes").glob("*.json"))


@pytest.mark.parametrize("name", SCENES)
def test_agrees_with_cycles(name, tmp_path):
    """Broken by a bias in any effect the scene shows: BSDF, light, lens, shutter, filter."""
    output = tmp_path / f"{name}.exr"
    subprocess.run([farm.program("penumbra"), "render", HERE / "scenes" / f"{name}.json",
                    "-o", output, "--quiet"], check=True, timeout=120 * farm.SLOW)
    figures, worst = compare.difference(image.read_file(output),
                                        image.read_file(HERE / "images" / f"{name}.exr"))
    print(name, figures, worst)
    for figure, limit in compare.LIMITS.items():
        assert figures[figure] <= limit, f"{figure} {figures[figure]:.4f} > {limit}, worst {worst}"


def test_there_are_six():
    """Broken by a scene or an image that was lost, which would make the test above pass by less."""
    assert len(SCENES) == 6
    assert [path.stem for path in sorted((HERE / "images").glob("*.exr"))] == SCENES
    for name in SCENES:
        scene = json.loads((HERE / "scenes" / f"{name}.json").read_text())
        assert scene["sampling"]["samples"] >= 256


@pytest.mark.parametrize("change, broken", [
    (lambda p: p * 1.02, "mean"),
    (lambda p: np.roll(p, 3, axis=1), "p99"),
    (lambda p: np.where((np.indices(p.shape[:2]) // 20 == 5).all(axis=0)[..., None], 9, p), "max"),
])
def test_compare_sees_what_is_wrong(change, broken):
    """Broken by limits too wide to notice 2 % of brightness, 3 pixels of shift, one wrong spot."""
    reference = image.read_file(HERE / "images" / "five_balls.exr")
    figures, _ = compare.difference(change(reference).astype(np.float32), reference)
    assert figures[broken] > compare.LIMITS[broken]
