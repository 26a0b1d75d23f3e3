# SPDX-License-Identifier: Apache-2.0
"""Rough surfaces against the directional albedo that microfacet.py integrates."""
import numpy as np
import microfacet
import pytest
import scene

ROUGHNESS = [0.2, 0.35, 0.5, 0.7, 1.0]
ANGLES = [0, 45, 75]
IOR = 1.5


def albedo(pixels_of, material, angle, below=False):
    """Mean radiance of a patch seen at angle in a background of 1: all it scatters, once.

    The patch fills the whole narrow view. Seen from below, a patch of glass is left, not entered.
    """
    side = -1 if below else 1
    eye = [10 * np.sin(np.radians(angle)), side * 10 * np.cos(np.radians(angle)), 0]
    camera = scene.look(eye, [0, 0, 0], fov=0.5, up=[0, 0, 1])
    pixels = pixels_of(scene.build(32, 32, 256, [scene.floor(half=5)], camera=camera,
                                   materials={"white": material}, background=1.0, depth=2))
    assert np.ptp(pixels.mean(axis=(0, 1))) < 1e-6
    return pixels.mean()


@pytest.mark.parametrize("angle", ANGLES)
@pytest.mark.parametrize("roughness", ROUGHNESS)
def test_glossy(pixels_of, roughness, angle):
    """Broken by a wrong D, masking or sampling weight, or alpha other than roughness squared."""
    found = albedo(pixels_of, scene.glossy(roughness), angle)
    assert found == pytest.approx(microfacet.glossy(roughness ** 2, angle), rel=0.005)
    assert found <= 1.001


@pytest.mark.parametrize("below", [False, True], ids=["entering", "leaving"])
@pytest.mark.parametrize("angle", ANGLES)
@pytest.mark.parametrize("roughness", ROUGHNESS)
def test_glass(pixels_of, roughness, angle, below):
    """Broken also by Fresnel at the wrong cosine, a wrong jacobian, or eta the wrong way round."""
    found = albedo(pixels_of, scene.glass(roughness, IOR), angle, below)
    expected = microfacet.glass(roughness ** 2, angle, 1 / IOR if below else IOR)
    assert found == pytest.approx(expected, rel=0.005)
    assert found <= 1.001


@pytest.mark.parametrize("angle", ANGLES)
def test_quadrature(angle):
    """Broken by an error in the quadrature: it must agree with the integral over directions."""
    alpha, steps = 0.49, 600
    cosine = (np.arange(steps) + 0.5) / steps
    phi = np.pi * (np.arange(steps) + 0.5) / steps
    cosine, phi = np.meshgrid(cosine, phi, indexing="ij")
    sine = np.sqrt(1 - cosine ** 2)
    o = np.stack([sine * np.cos(phi), sine * np.sin(phi), cosine])
    i = np.array([np.sin(np.radians(angle)), 0, np.cos(np.radians(angle))])
    h = o + i[:, None, None]
    h2 = h[2] ** 2 / (h ** 2).sum(axis=0)
    density = alpha ** 2 / (np.pi * (h2 * (alpha ** 2 - 1) + 1) ** 2)

    def masking(z):
        return 2 * z / (z + np.sqrt(alpha ** 2 + (1 - alpha ** 2) * z ** 2))

    scattered = density * masking(i[2]) * masking(o[2]) / (4 * i[2])
    assert 2 * np.pi * scattered.mean() == pytest.approx(microfacet.glossy(alpha, angle), rel=1e-4)
