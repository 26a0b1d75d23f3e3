# SPDX-License-Identifier: Apache-2.0
"""Layers of an image and what its files say of it, from the scene to the file."""
import json
import os
import tempfile

import farm
import image
import numpy as np
import OpenImageIO as oiio
import pytest
import scene

WIDTH, HEIGHT, SAMPLES = 60, 40, 64


@pytest.fixture(scope="module")
def service():
    with farm.Farm(2, "--tile", 16) as running:
        yield running


def subject(aovs, **sampling):
    """A red ball of radius 1 at distance 5, left of the middle, before nothing."""
    body = scene.build(WIDTH, HEIGHT, SAMPLES, [scene.sphere([-0.5, 0, 0], material="red")],
                       camera=scene.look([-0.5, 0, 5], [-0.5, 0, 0]), background=0.5,
                       materials={"red": {"type": "matte", "color": [0.8, 0.2, 0.1]}})
    body["image"]["aovs"] = aovs
    body["sampling"].update(sampling)
    return body


def decode(data, extension="exr"):
    """The channels by name, and the attributes."""
    with tempfile.NamedTemporaryFile(suffix="." + extension) as file:
        file.write(data)
        file.flush()
        source = oiio.ImageInput.open(file.name)
        spec = source.spec()
        pixels = np.asarray(source.read_image("float")).reshape(spec.height, spec.width, -1)
        source.close()
    return ({name: pixels[:, :, i] for i, name in enumerate(spec.channelnames)},
            {a.name: a.value for a in spec.extra_attribs})


def test_layers_of_a_ball(service):
    """Broken by a layer that shows another's values, or that is lost between tile and file."""
    render = service.submit(subject(["albedo", "normal", "depth", "samples"]))
    service.wait(render)
    found, _ = decode(service.image(render))
    middle, corner = (HEIGHT // 2, WIDTH // 2), (1, 1)
    assert [found[f"albedo.{c}"][middle] for c in "RGB"] == pytest.approx([0.8, 0.2, 0.1])
    assert [found[f"normal.{c}"][middle] for c in "XYZ"] == pytest.approx([0, 0, 1], abs=0.05)
    assert found["depth.Z"][middle] == pytest.approx(4, abs=0.01)
    assert [found[f"albedo.{c}"][corner] for c in "RGB"] == [0, 0, 0]
    assert found["depth.Z"][corner] == np.inf
    assert (found["samples.X"] == SAMPLES).all()
    for layer, channel in (("albedo", "albedo.R"), ("depth", "depth.Z"), ("samples", "samples.X"),
                           ("color", "R")):
        path = f"/v1/renders/{render}/image.exr?layer={layer}"
        alone, _ = decode(service.request("GET", path).body)
        assert (alone["R"] == found[channel]).all() and "albedo.R" not in alone or layer == "color"
    tags = {service.request("GET", f"/v1/renders/{render}/image.png{query}").headers["ETag"]
            for query in ("", "?layer=albedo", "?layer=normal", "?layer=depth", "?layer=samples")}
    assert len(tags) == 5


@pytest.mark.parametrize("name", ["albedo", "heat", ""])
def test_a_layer_that_there_is_not(service, name):
    """Broken by an answer that leaves the reader to guess what layers there are."""
    render = service.submit(subject(["depth", "samples"]))
    service.wait(render)
    answer = service.request("GET", f"/v1/renders/{render}/image.png?layer={name}")
    assert answer.status == 404
    assert "color, depth, samples" in json.loads(answer.body)["detail"]


def encoded(linear):
    v = np.clip(linear.astype(np.float64), 0, 1)
    return np.where(v <= 0.0031308, 12.92 * v, 1.055 * v ** (1 / 2.4) - 0.055)


def test_edges_get_their_samples(service):
    """Broken by a pair that is missed or made up, and by a first sample that stays in the sum."""
    first = image.read(service.render(subject([], mode="edge", samples=1, threshold=2)))
    uniform = image.read(service.render(subject([], samples=40)))
    found, _ = decode(service.render(
        subject(["samples"], mode="edge", samples=40, threshold=0.1)))
    colors = encoded(first)
    marked = np.zeros((HEIGHT, WIDTH), bool)
    for axis in (0, 1):
        apart = np.sqrt((np.diff(colors, axis=axis) ** 2).sum(axis=2)) > 0.1
        for end in ((1, 0), (0, 1)):
            widths = [(0, 0), (0, 0)]
            widths[axis] = end
            marked |= np.pad(apart, widths)
    assert 0.05 < marked.mean() < 0.5
    assert (found["samples.X"] == np.where(marked, 40, 1)).all()
    ours = np.stack([found[c] for c in "RGB"], axis=2)
    assert (ours[~marked] == first[~marked]).all()
    assert np.allclose(ours[marked], uniform[marked], rtol=1e-5)


def test_adaptive_spends_where_it_is_noisy(service):
    """Broken by a decision that stops everywhere or nowhere, or counts that are not the truth."""
    body = subject(["samples"], mode="adaptive", samples=512, min_samples=16, error=0.004)
    render = service.submit(body)
    done = service.wait(render)
    found, _ = decode(service.image(render))
    samples = found["samples.X"]
    assert samples[1, 1] == 16 and samples.max() >= 128
    assert done["samples_done"] == samples.sum() and done["progress"] == 1


def test_files_say_the_same_again(service):
    """Broken by metadata of the run: a date, an id, a worker."""
    files = []
    for _ in range(2):
        render = service.submit(subject(["depth"]))
        done = service.wait(render)
        files.append([service.image(render, kind) for kind in ("exr", "png")])
        for data, kind in zip(files[-1], ("exr", "png")):
            _, said = decode(data, kind)
            assert said["penumbra:content"] == done["content"]
            assert said["penumbra:samples"] == str(SAMPLES)
            assert said["Software"].startswith("Penumbra ") \
                and not any(os.uname().nodename in str(value) for value in said.values())
    assert files[0] == files[1]
