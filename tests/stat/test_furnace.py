# SPDX-License-Identifier: Apache-2.0
"""White furnace: what absorbs nothing is invisible in a constant background of 1."""
import numpy as np
import pytest
import scene

SEQUENCES = ["sobol", "jittered", "random"]
BODIES = {
    "sphere": scene.sphere(),
    "mesh": scene.box(0.7),
    "turned": scene.box(0.7, transform={"rotate": [0.1, 0.3, 0.2, 0.927], "scale": [1, 1.2, 0.8]}),
    "moving": scene.sphere(keyframes=scene.motion([-0.3, 0, 0], [0.3, 0.2, 0])),
}


def furnace(body, material, samples=64, **settings):
    camera = scene.look([0.4, 0.3, 3.4], [0, 0, 0], shutter={"open": 0, "close": 1})
    return scene.build(64, 64, samples, [body], camera=camera, materials={"white": material},
                       background=1.0, **settings)


@pytest.mark.parametrize("sequence", SEQUENCES)
@pytest.mark.parametrize("integrator", ["distribution", "path"])
@pytest.mark.parametrize("body", BODIES)
def test_convex_matte_body(pixels_of, body, integrator, sequence):
    """Broken by self-shadowing, a wrong cosine or pdf, a background counted twice or lost.

    Every ray that leaves a convex body meets the background, so each pixel is 1, not only the mean.
    """
    pixels = pixels_of(furnace(BODIES[body], scene.matte(1.0), integrator=integrator,
                               sequence=sequence))
    assert np.abs(pixels - 1).max() <= 0.005


@pytest.mark.parametrize("integrator", ["distribution", "path", "whitted"])
@pytest.mark.parametrize("body", ["sphere", "mesh", "turned"])
def test_mirror(pixels_of, body, integrator):
    """Broken by a reflection below the surface or by a lobe's weight other than its colour."""
    pixels = pixels_of(furnace(BODIES[body], scene.glossy(0), integrator=integrator))
    assert np.abs(pixels - 1).max() <= 0.002


@pytest.mark.parametrize("integrator", ["distribution", "path", "whitted"])
@pytest.mark.parametrize("body", ["sphere", "mesh", "turned"])
def test_clear_glass(pixels_of, body, integrator):
    """Broken by a Fresnel term that does not sum to 1, by eta^2, by rays that stick in the surface.

    Light that is still inside after max_depth events is lost: with 40 events (12 for whitted, whose
    rays branch) far less than 0.002 of it, but more in a pixel that looks along the surface.
    """
    depth = 12 if integrator == "whitted" else 40
    pixels = pixels_of(furnace(BODIES[body], scene.glass(0), integrator=integrator, depth=depth))
    assert pixels.max() <= 1.0001
    assert pixels.mean() >= 0.998


def test_absorbs_what_it_should(pixels_of):
    """Broken by a furnace that ignores the body: a body of 0.5 must look like 0.5."""
    pixels = pixels_of(furnace(BODIES["sphere"], scene.matte(0.5)))
    assert np.abs(pixels[28:36, 28:36] - 0.5).max() <= 0.005
    assert np.abs(pixels[:2] - 1).max() == 0
