# SPDX-License-Identifier: Apache-2.0
"""Sizes of blur against closed forms: circles of confusion, streaks of motion.

A small black ball before a white background covers 1 - value of each pixel; what the lens and the
shutter do to it is read off the moments of that coverage. Moments of independent blurs add: those
of the ball's own disk and of the pixel's square are taken away.
"""
import math

import numpy as np
import pytest
import scene

SIDE, FOV, RADIUS = 160, 20.0, 0.02
PIXELS_PER_TANGENT = SIDE / 2 / math.tan(math.radians(FOV / 2))


def coverage(pixels_of, body, samples=512, **camera):
    """What the ball covers, and the pixel centres' x (right) and y (up) from the image's centre."""
    view = {"position": [0, 0, 0], "look_at": [0, 0, -1], "up": [0, 1, 0], "horizontal_fov": FOV,
            **camera}
    pixels = pixels_of(scene.build(SIDE, SIDE, samples, [body], camera=view, background=1.0,
                                   materials={"white": scene.matte(0)}))
    y, x = np.indices((SIDE, SIDE))
    covered = 1 - pixels[:, :, 1].astype(np.float64)
    covered[np.abs(covered) < 1e-6] = 0
    assert covered.sum() > 0 and covered[[0, -1]].sum() == 0 and covered[:, [0, -1]].sum() == 0
    return covered, x + 0.5 - SIDE / 2, SIDE / 2 - 0.5 - y


def moments(covered, x, y):
    """Centre and variances along x and y."""
    total = covered.sum()
    center = (covered * x).sum() / total, (covered * y).sum() / total
    variance = [(covered * (axis - middle) ** 2).sum() / total
                for axis, middle in zip((x, y), center)]
    return center, variance


def own_variance(distance):
    """Per axis, of the ball's disk and of the pixel."""
    return (RADIUS / distance * PIXELS_PER_TANGENT) ** 2 / 4 + 1 / 12


def ball(distance, **more):
    return scene.sphere(center=[0, 0, -distance], radius=RADIUS, **more)


def confusion_radius(pixels_of, distance, samples=512, blades=0, **lens):
    """Of the blurred ball, in pixels; of a polygon the radius of its corners.

    The mean of r^2 is R^2 / 2 in a disk and R^2 (2 + cos(2 pi / n)) / 6 in a regular n-gon.
    """
    _, variance = moments(*coverage(pixels_of, ball(distance), samples, blades=blades, **lens))
    share = (2 + math.cos(2 * math.pi / blades)) / 6 if blades else 1 / 2
    return math.sqrt(max(sum(variance) - 2 * own_variance(distance), 0) / share)


@pytest.mark.parametrize("blades", [0, 3, 6])
@pytest.mark.parametrize("distance", [4.0, 9.0])
@pytest.mark.parametrize("radius", [0.1, 0.2])
def test_circle_of_confusion(pixels_of, radius, distance, blades):
    """Broken by a wrong aperture size or shape, or by focus at the wrong distance.

    A lens of radius a focused at f images a point at z as a disk of radius a |1/z - 1/f|, in
    tangents of the angle from the axis.
    """
    focus = 6.0
    found = confusion_radius(pixels_of, distance, blades=blades, aperture_radius=radius,
                             focus_distance=focus)
    expected = radius * abs(1 / distance - 1 / focus) * PIXELS_PER_TANGENT
    assert found == pytest.approx(expected, rel=0.02)


def off_axis(surface):
    """A ball at distance 5 from the eye, 8 degrees off the axis, and a lens focused at 5."""
    angle = math.radians(8)
    body = scene.sphere(center=[5 * math.sin(angle), 0, -5 * math.cos(angle)], radius=RADIUS)
    return body, {"aperture_radius": 2.0, "focus_distance": 5.0, "focal_surface": surface}


@pytest.mark.parametrize("surface, sharp", [("sphere", True), ("plane", False)])
def test_focal_surface(pixels_of, surface, sharp):
    """Broken by a spherical focal surface that is a plane, or the other way round.

    At 8 degrees the plane lies 5 (1 / cos - 1) = 0.049 behind the ball: with a = 2 a disk of radius
    1.8 pixels, where the ball's own has 1.8 and the pixel's square is 1 wide.
    """
    body, lens = off_axis(surface)
    _, variance = moments(*coverage(pixels_of, body, **lens))
    blur = variance[1] - own_variance(5 * math.cos(math.radians(8)))
    depth = 5 * math.cos(math.radians(8))
    plane = (2.0 * (1 / depth - 1 / 5) * PIXELS_PER_TANGENT) ** 2 / 4
    assert blur == pytest.approx(0 if sharp else plane, abs=0.1 * plane)


def streak(pixels_of, body, **camera):
    """Its middle is known to about a thousandth of a unit."""
    covered = coverage(pixels_of, body, 1024, **{"shutter": {"open": 0, "close": 1}, **camera})
    return (*moments(*covered), covered)


@pytest.mark.parametrize("shutter, length, middle", [
    ({"open": 0, "close": 1}, 0.8, 0.0),
    ({"open": 0.25, "close": 0.5}, 0.2, -0.1),
    ({"open": -1, "close": 0.5}, None, None),
], ids=["whole", "part", "held"])
def test_streak_of_a_moving_ball(pixels_of, shutter, length, middle):
    """Broken by times that are not uniform over the shutter, a wrong shutter, or a pose not held.

    A uniform streak of length L has the variance L^2 / 12. The ball that is held still until 0
    spends 2/3 of its time at the start, the rest on a streak of half the way.
    """
    body = ball(5, keyframes=scene.motion([-0.4, 0, 0], [0.4, 0, 0]))
    center, variance, _ = streak(pixels_of, body, shutter=shutter)
    scale = PIXELS_PER_TANGENT / 5
    along = (variance[0] - own_variance(5)) / scale ** 2
    if length is None:
        mean = 2 / 3 * -0.4 + 1 / 3 * -0.2
        second = 2 / 3 * 0.16 + 1 / 3 * (0.2 ** 2 + 0.4 ** 2 / 12)
        assert center[0] / scale == pytest.approx(mean, abs=0.004)
        assert along == pytest.approx(second - mean ** 2, rel=0.02)
    else:
        assert center[0] / scale == pytest.approx(middle, abs=0.004)
        assert math.sqrt(12 * along) == pytest.approx(length, rel=0.01)
    assert variance[1] == pytest.approx(own_variance(5), rel=0.05)


def test_streak_of_a_moving_camera(pixels_of):
    """Broken by a camera whose keys do not move it, or move it the wrong way."""
    keys = [{"time": 0, "position": [-0.4, 0, 0], "look_at": [-0.4, 0, -1]},
            {"time": 1, "position": [0.2, 0, 0], "look_at": [0.2, 0, -1]}]
    center, variance, _ = streak(pixels_of, ball(5), keyframes=keys)
    scale = PIXELS_PER_TANGENT / 5
    assert center[0] / scale == pytest.approx(0.1, abs=0.004)
    assert math.sqrt(12 * (variance[0] - own_variance(5))) / scale == pytest.approx(0.6, rel=0.01)


def test_spin_sweeps_an_arc(pixels_of):
    """Broken by interpolating positions instead of rotations: a chord lies nearer the pivot."""
    turn = math.radians(120)
    turned = [0, 0, math.sin(turn / 2), math.cos(turn / 2)]
    body = scene.sphere(center=[0.5, 0, 0], radius=RADIUS, transform={"translate": [0, 0, -5]},
                        keyframes=scene.motion({"rotate": [0, 0, 0, 1]}, {"rotate": turned}))
    _, _, (covered, x, y) = streak(pixels_of, body)
    scale = PIXELS_PER_TANGENT / 5
    radius = np.hypot(x, y) / scale
    mean = (covered * radius).sum() / covered.sum()
    spread = math.sqrt((covered * (radius - mean) ** 2).sum() / covered.sum())
    assert mean == pytest.approx(0.5, rel=0.005)
    assert spread == pytest.approx(math.sqrt(own_variance(5)) / scale, rel=0.1)
    swept = (covered * np.arctan2(y, x)).sum() / covered.sum()
    assert swept == pytest.approx(turn / 2, abs=0.01)
