# SPDX-License-Identifier: Apache-2.0
"""What adaptive sampling promises of errors and saves in samples; tests/bench/adaptive.py has the
whole curves."""
import json
import os

import farm
import pytest
from sampling_error import Subject, compare, seeds_beyond, small_scene

ERROR, CONFIDENCE = 0.02, 0.9
SEEDS = int(os.environ.get("PEN_SEEDS", 100))  # tests/bench/adaptive.py takes 1,000


def shrunk(name, divisor):
    body = json.loads((farm.ROOT / f"tests/reference/scenes/{name}.json").read_text())
    body["image"].update({side: body["image"][side] // divisor for side in ("width", "height")})
    return body


@pytest.fixture(scope="module")
def service():
    with farm.Farm(2, "--tile", 32) as running:
        yield running


def test_errors_are_as_probable_as_asked(service):
    """Broken by an estimate that is too low on the whole, or that fails badly now and then."""
    subject = Subject(service, small_scene(), 65536)
    beyond, beyond_4 = seeds_beyond(subject, ERROR, CONFIDENCE, SEEDS)
    print(f"beyond: {beyond:.2e}, 4 times: {beyond_4:.1e}")
    assert beyond <= 1.5 * (1 - CONFIDENCE)
    assert beyond_4 <= 1e-4
    assert beyond > 0, "nothing was there to be estimated"


@pytest.mark.parametrize("name, divisor, error, fewer", [("five_balls", 6, 0.01, 3.0),
                                                         ("depth_of_field", 3, 0.007, 2.5)])
def test_samples_go_where_they_count(service, name, divisor, error, fewer):
    """Broken by samples that are spent where an image is smooth already.

    At a part of the size, where there are more edges to a pixel than in the whole image.
    """
    subject = Subject(service, shrunk(name, divisor), 4096)
    uniform = [subject.uniform(16 << i) for i in range(7)]
    found, better = compare(uniform, subject.adaptive(error, 1024))
    print(f"{name}: 1/{found:.2f} of the samples, RMSE 1/{better:.2f}")
    assert found >= fewer
    assert better >= 1
