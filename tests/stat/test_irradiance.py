# SPDX-License-Identifier: Apache-2.0
"""Irradiance of a floor under each area light against its closed form.

A white floor shows E / pi. The view is narrow enough (0.01 degrees) that E is constant in it.
"""
import math

import numpy as np
import pytest
import scene

HEIGHT = 1.3
RADIANCE = 2.0


def polygon(vertices, point):
    """Lambert 1760: E = L / 2 * sum of edge angles times the edge planes' normals, dot n = +Y."""
    arms = [np.subtract(v, point) for v in vertices]
    total = 0.0
    for a, b in zip(arms, arms[1:] + arms[:1]):
        normal = np.cross(a, b)
        sine = np.linalg.norm(normal)
        total += math.atan2(sine, np.dot(a, b)) * normal[1] / sine
    return RADIANCE / 2 * abs(total)


def disk(center, radius, point):
    """A disk parallel to the floor (Howell's catalogue of configuration factors, B-13)."""
    aside = math.hypot(center[0] - point[0], center[2] - point[2])
    height = center[1] - point[1]
    squares = aside ** 2 + height ** 2 + radius ** 2
    share = (squares - 2 * radius ** 2) / math.sqrt(squares ** 2 - (2 * radius * aside) ** 2)
    return RADIANCE * math.pi / 2 * (1 - share)


def ball(center, radius, point):
    """A sphere wholly above the floor's horizon: E = pi L (r / d)^2 cos."""
    away = np.subtract(center, point)
    distance = np.linalg.norm(away)
    return RADIANCE * math.pi * (radius / distance) ** 2 * away[1] / distance


RECTANGLE = {"corner": [-0.5, HEIGHT, -0.3], "edge_u": [1.4, 0, 0], "edge_v": [0, 0, 0.8]}
TILTED = {"corner": [1.0, 0.5, -0.5], "edge_u": [0.3, 0.9, 0], "edge_v": [0, 0, 1.1]}
TRIANGLE = [[-0.6, HEIGHT, -0.5], [0.9, HEIGHT, -0.2], [0.1, HEIGHT + 0.4, 0.8]]
CENTER, RADIUS = [0.2, HEIGHT, 0.1], 0.6


def corners(rectangle):
    c, u, v = (np.array(rectangle[key]) for key in ("corner", "edge_u", "edge_v"))
    return [c, c + u, c + u + v, c + v]


CASES = {
    "rectangle": ({"type": "rectangle", **RECTANGLE}, lambda p: polygon(corners(RECTANGLE), p)),
    "triangle": ({"type": "triangle", "vertices": TRIANGLE}, lambda p: polygon(TRIANGLE, p)),
    "disk": ({"type": "disk", "center": CENTER, "normal": [0, -1, 0], "radius": RADIUS},
             lambda p: disk(CENTER, RADIUS, p)),
    "sphere": ({"type": "sphere", "center": CENTER, "radius": RADIUS},
               lambda p: ball(CENTER, RADIUS, p)),
}


def radiance_at(pixels_of, light, point, integrator="distribution"):
    eye = [point[0], 0.3, point[2] + 6]
    body = scene.build(32, 32, 256, [scene.floor(half=20)], integrator=integrator, depth=1,
                       camera=scene.look(eye, point, fov=0.01),
                       lights=[{**light, "radiance": [RADIANCE] * 3}])
    return pixels_of(body).mean()


@pytest.mark.parametrize("integrator", ["distribution", "path"])
@pytest.mark.parametrize("point", [[0, 0, 0], [0.7, 0, -0.4], [-2.5, 0, 1.5]], ids=str)
@pytest.mark.parametrize("name", CASES)
def test_above(pixels_of, name, point, integrator):
    """Broken by a wrong solid-angle pdf, cosine or MIS weight, or by the wrong side that shines."""
    light, closed_form = CASES[name]
    found = radiance_at(pixels_of, light, point, integrator)
    assert found == pytest.approx(closed_form(point) / math.pi, rel=0.003)


@pytest.mark.parametrize("point", [[2.2, 0, 0], [3, 0, -1], [6, 0, 2]], ids=str)
def test_beside(pixels_of, point):
    """Broken by a spherical rectangle whose frame or sign is wrong off the axis."""
    found = radiance_at(pixels_of, {"type": "rectangle", **TILTED}, point)
    assert found == pytest.approx(polygon(corners(TILTED), point) / math.pi, rel=0.003)


def test_behind(pixels_of):
    """Broken by a light that shines from both its sides."""
    assert radiance_at(pixels_of, {"type": "rectangle", **TILTED}, [-1.5, 0, 0]) == 0


def points_on(name, u, v):
    """Points evenly over a light's area, the normals there, the area."""
    if name == "disk":
        r, phi = RADIUS * np.sqrt(u), 2 * np.pi * v
        spots = np.array(CENTER) + np.stack([r * np.cos(phi), 0 * r, r * np.sin(phi)], axis=1)
        return spots, np.array([0, -1, 0]), np.pi * RADIUS ** 2
    if name == "sphere":
        z, phi = 2 * u - 1, 2 * np.pi * v
        s = np.sqrt(1 - z ** 2)
        normals = np.stack([s * np.cos(phi), s * np.sin(phi), z], axis=1)
        return np.array(CENTER) + RADIUS * normals, normals, 4 * np.pi * RADIUS ** 2
    if name == "triangle":
        a, b, c = np.array(TRIANGLE)
        u, v, share = np.where(u + v > 1, 1 - u, u), np.where(u + v > 1, 1 - v, v), 0.5
    else:
        a, b, _, c = corners(RECTANGLE)
        share = 1
    normal = np.cross(b - a, c - a)
    length = np.linalg.norm(normal)
    return a + u[:, None] * (b - a) + v[:, None] * (c - a), normal / length, share * length


@pytest.mark.parametrize("name", CASES)
def test_closed_forms(name):
    """Broken by a slip in a formula: each must agree with an integral over the light's area."""
    spots, normals, area = points_on(name, *np.random.default_rng(1).random((2, 1000000)))
    point = np.array([0.7, 0, -0.4])
    arms = point - spots
    distance2 = (arms ** 2).sum(axis=1)
    emitted = np.maximum((arms * normals).sum(axis=1), 0)
    received = np.maximum(-arms[:, 1], 0)
    irradiance = RADIANCE * area * (emitted * received / distance2 ** 2).mean()
    assert irradiance == pytest.approx(CASES[name][1](point), rel=0.01)
