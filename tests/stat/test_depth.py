# SPDX-License-Identifier: Apache-2.0
"""How far max_depth lets light travel."""
import math

import pytest
import scene

GREY = 0.7
INTENSITY = 3.0
RADIUS = 2.0


@pytest.mark.parametrize("depth", [1, 2, 5])
def test_integrating_sphere(pixels_of, depth):
    """Broken by one bounce too few or too many, by roulette that darkens, by lost interreflection.

    A point light in the middle of a matte sphere: every bounce reaches all of it alike, so that
    after the direct light each adds the share GREY of the one before.
    """
    lamp = {"type": "point", "position": [0, 0, 0], "intensity": [INTENSITY] * 3}
    pixels = pixels_of(scene.build(16, 16, 1024, [scene.sphere(radius=RADIUS)], lights=[lamp],
                                   camera=scene.look([0.3, 0.5, 1], [0, -1, -1]), depth=depth,
                                   materials={"white": scene.matte(GREY)}, integrator="path"))
    direct = GREY * INTENSITY / (math.pi * RADIUS ** 2)
    expected = direct * sum(GREY ** k for k in range(depth + 1))
    assert pixels.mean() == pytest.approx(expected, rel=0.005)


@pytest.mark.parametrize("integrator", ["distribution", "path", "whitted"])
@pytest.mark.parametrize("mirrors", [1, 2, 3])
def test_mirrors(pixels_of, mirrors, integrator):
    """Broken by a path that ends before, or gathers nothing at, the surface behind max_depth.

    Light zigzags between two mirrors; a matte wall at their end looks as if it stood there alone.
    """
    slope = 2 * mirrors / 10
    walls = [{"type": "mesh", "material": "mirror", "indices": [0, 1, 2, 0, 2, 3],
              "vertices": [[0, y, 5], [10, y, 5], [10, y, -5], [0, y, -5]]} for y in (-1, 1)]
    end = {"type": "mesh", "material": "white", "indices": [0, 1, 2, 0, 2, 3],
           "vertices": [[10, -1, 5], [10, 1, 5], [10, 1, -5], [10, -1, -5]]}
    sun = {"type": "directional", "direction": [1, 0, 0], "irradiance": [math.pi] * 3, "angle": 0}
    built = {"camera": scene.look([-1, -slope, 0], [0, 0, 0], fov=0.5), "lights": [sun],
             "materials": {"white": scene.matte(1.0), "mirror": scene.glossy(0)},
             "integrator": integrator}
    short = pixels_of(scene.build(8, 8, 16, [*walls, end], depth=max(mirrors - 1, 1), **built))
    enough = pixels_of(scene.build(8, 8, 16, [*walls, end], depth=mirrors, **built))
    assert enough.mean() == pytest.approx(1, rel=1e-3)
    assert mirrors == 1 or short.max() == 0
