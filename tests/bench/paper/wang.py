# SPDX-License-Identifier: Apache-2.0
"""Wang 1992: physically correct direct lighting; sampling a luminaire as it is seen.

A luminaire's points are not chosen evenly over its area but so that the estimate varies little:
a sphere by the cone that it is seen in, a triangle by its solid angle.
"""
import numpy as np
import rig

PAPER = "Wang 1992"
SIDE = 128
DISTANCES = [1.2, 2.0, 5.0, 20.0]
RADIANCE = 10.0
TRIANGLE = np.array([[-1.0, 0.0, 0.6], [1.0, 0.0, 0.6], [0.0, 0.0, -1.2]])


def spot(light):
    """A matte point that fills the image, one random sample a pixel: pixels are estimates."""
    return {
        "version": 1,
        "image": {"width": SIDE, "height": SIDE, "filter": {"type": "box", "width": 1}},
        "camera": {"position": [0.9, 0.2, 0], "look_at": [0, 0, 0], "horizontal_fov": 0.01},
        "integrator": {"type": "distribution", "max_depth": 1},
        "sampling": {"samples": 1, "sequence": "random"},
        "materials": {"white": {"type": "matte", "color": [1, 1, 1]}},
        "objects": [{"type": "mesh", "material": "white", "indices": [0, 1, 2, 0, 2, 3],
                     "vertices": [[-1, 0, 1], [1, 0, 1], [1, 0, -1], [-1, 0, -1]]}],
        "lights": [{**light, "radiance": [RADIANCE] * 3}],
    }


def sphere_light(distance):
    return {"type": "sphere", "center": [0, distance, 0], "radius": 1}


def triangle_light(distance):
    # Turned so that it emits downwards.
    corners = TRIANGLE[[0, 2, 1]] + [0, distance, 0]
    return {"type": "triangle", "vertices": corners.tolist()}


def estimate(points, normals, area):
    """Radiance of the matte point for points spread evenly over an area."""
    square = (points ** 2).sum(axis=1)
    direction = points / np.sqrt(square)[:, None]
    facing = np.maximum(-(direction * normals).sum(axis=1), 0)
    return RADIANCE / np.pi * np.maximum(direction[:, 1], 0) * facing * area / square


def sphere_by_area(distance, draw, count):
    normals = draw.normal(size=(count, 3))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    return estimate(normals + [0, distance, 0], normals, 4 * np.pi)


def triangle_by_area(distance, draw, count):
    u, v = draw.random((2, count, 1))
    root = np.sqrt(u)
    a, b, c = TRIANGLE + [0, distance, 0]
    points = (1 - root) * a + root * (1 - v) * b + root * v * c
    area = np.linalg.norm(np.cross(b - a, c - a)) / 2
    return estimate(points, np.broadcast_to([0.0, -1.0, 0.0], points.shape), area)


KINDS = [("sphere", sphere_light, sphere_by_area), ("triangle", triangle_light, triangle_by_area)]


def section(given):
    draw = np.random.default_rng(1)
    rows = []
    for name, light, by_area in KINDS:
        for distance in DISTANCES:
            ours = given.render(spot(light(distance))).pixels[:, :, 0].astype(np.float64).ravel()
            area = by_area(distance, draw, 2_000_000)
            relative = [float(v.var() / v.mean() ** 2) for v in (ours, area)]
            rows.append([name, distance, float(ours.mean()), float(area.mean()), *relative,
                         relative[1] / max(relative[0], 1e-12)])
    head = ["luminaire", "distance", "mean", "mean by area", "variance", "variance by area",
            "ratio"]
    text = f"""Wang 1992: luminaires sampled as they are seen

A matte point below a sphere of radius 1, and below a triangle of about its size, at several
distances of their middles: {SIDE * SIDE} independent estimates of one sample each by the renderer
(sphere: the cone it is seen in; triangle: its solid angle, Arvo 1995, with a cosine warp), and two
million with points spread evenly over the whole surface. Means agree; variances are divided by the
square of the mean.

{rig.table(head, rows)}

Near a luminaire points by area vary most, as the paper says. Far away an even choice from a
triangle is good too and what is left is small either way; but half of a sphere's points face away
at any distance, which the cone avoids."""
    gain = [row[-1] for row in rows]
    return text, [["variance near a luminaire, points spread over its area against points as it is "
                   "seen", "greater", f"{gain[0]:.0f}× (sphere), {gain[len(DISTANCES)]:.0f}× "
                   "(triangle)"]]
