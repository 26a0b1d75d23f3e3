# SPDX-License-Identifier: Apache-2.0
"""What adaptive sampling promises of errors and saves in samples; tests/bench/adaptive.py has the
whole curves."""
import json
import os

import farm
import numpy as np
import pytest
import scene
from sampling_error import Subject, compare

ERROR, CONFIDENCE = 0.02, 0.9
SEEDS = int(os.environ.get("PEN_SEEDS", 100))  # 1000 take a minute or two


def shrunk(name, divisor):
    body = json.loads((farm.ROOT / f"tests/reference/scenes/{name}.json").read_text())
    body["image"].update({side: body["image"][side] // divisor for side in ("width", "height")})
    return body


@pytest.fixture(scope="module")
def service():
    with farm.Farm(2, "--tile", 32) as running:
        yield running


def small():
    """A lens, a soft shadow, edges and gloss on 24x16 pixels."""
    return scene.build(
        24, 16, 1,
        [scene.floor(half=30, material="grey"), scene.sphere([-0.7, 1, 0], material="satin"),
         scene.sphere([1.2, 0.7, 1.5], 0.7, material="grey")],
        camera=scene.look([0, 2, 7], [0, 0.8, 0], aperture_radius=0.15, focus_distance=7),
        materials={"grey": scene.matte(0.6), "satin": scene.glossy(0.4, 0.8)},
        lights=[scene.panel([-2, 5, 0], [2, 0, 0], [0, 0, 2], 8)], background=0.3)


def test_errors_are_as_probable_as_asked(service):
    """Broken by an estimate that is too low on the whole, or that fails badly now and then."""
    subject = Subject(service, small(), 65536)
    errors = np.stack([subject.errors({"mode": "adaptive", "samples": 2048, "error": ERROR,
                                       "confidence": CONFIDENCE, "seed": seed})[0]
                       for seed in range(SEEDS)])
    print(f"beyond: {(errors > ERROR).mean():.2e}, 4 times: {(errors > 4 * ERROR).mean():.1e}")
    assert (errors > ERROR).mean() <= 1.5 * (1 - CONFIDENCE)
    assert (errors > 4 * ERROR).mean() <= 1e-4
    assert (errors > ERROR).mean() > 0, "nothing was there to be estimated"


@pytest.mark.parametrize("name, fewer", [("five_balls", 3.0), ("depth_of_field", 2.1)])
def test_samples_go_where_they_count(service, name, fewer):
    """Broken by samples that are spent where an image is smooth already.

    At a sixth of the size, where there are more edges to a pixel than in the whole image.
    """
    subject = Subject(service, shrunk(name, 6), 8192)
    uniform = [subject.uniform(16 << i) for i in range(7)]
    found, better = compare(uniform, subject.adaptive(0.01, 1024))
    print(f"{name}: 1/{found:.2f} of the samples, RMSE 1/{better:.2f}")
    assert found >= fewer
    assert better >= 1
