# SPDX-License-Identifier: Apache-2.0
"""Node animation, skins and morph targets of glTF files, against closed forms."""
import math

import numpy as np
import pytest
from glb import Asset
from measure import BLUE, GREEN, HALF, QUAD, RED, close, moments, polygon, square, viewed


def turned(degrees, axis=(0, 0, 1)):
    half = math.radians(degrees) / 2
    return [*(math.sin(half) * np.array(axis)), math.cos(half)]


def rotated(points, degrees, about=(0, 0)):
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    return (np.asarray(points)[:, :2] - about) @ [[c, s], [-s, c]] + about


def three_movers():
    """Squares that move up by the three interpolations, from 0 at 1 s to 1 at 3 s."""
    asset = Asset()
    viewed(asset)
    for x, color, kind in ((-1, RED, "STEP"), (0, GREEN, "LINEAR"), (1, BLUE, "CUBICSPLINE")):
        node = asset.node(mesh=asset.mesh(square(), QUAD, asset.unlit(color)))
        values = np.array([[x, 0, 0], [x, 1, 0]], float)
        if kind == "CUBICSPLINE":
            flat, rising = np.zeros(3), np.array([0, 0.5, 0])
            values = np.array([flat, values[0], rising, -rising, values[1], flat])
        asset.animate(node, "translation", [1, 3], values, kind)
    return asset


@pytest.mark.parametrize("time", [0.0, 1.0, 1.5, 2.5, 2.999, 3.0, 4.0])
def test_interpolations(drawing, time):
    """Broken by an interpolation taken for another, by tangents not scaled by the keys' distance,
    by a step that comes too early, and by a track that goes on beyond its keys."""
    pixels = drawing.show(three_movers(), time=time)
    s = min(max((time - 1) / 2, 0), 1)
    step = float(time >= 3)
    cubic = (s ** 3 - 2 * s ** 2 + s) * 2 * 0.5 + (3 * s ** 2 - 2 * s ** 3) \
        + (s ** 3 - s ** 2) * 2 * -0.5
    for channel, (x, y) in enumerate(((-1, step), (0, s), (1, cubic))):
        assert close(moments(pixels, channel), (0.25, [x, y]))


def test_rotation_goes_by_the_shorter_arc(drawing):
    """Broken by quaternions blended without regard to their sign, or along a chord."""
    asset = Asset()
    viewed(asset)
    node = asset.node(mesh=asset.mesh(square((1, 0)), QUAD, asset.unlit(RED)))
    asset.animate(node, "rotation", [0, 1], [turned(0), [-v for v in turned(120)]])
    for time in (0.25, 0.75):
        found = moments(drawing.show(asset, time=time))
        assert close(found, polygon(rotated(square((1, 0)), 120 * time)))


def test_scale_under_a_turned_parent(drawing):
    """Broken by the order of a node's channels, or of nodes: the product must shear."""
    asset = Asset()
    viewed(asset)
    outer = asset.node(scale=[2, 0.5, 1])
    inner = asset.node(outer, rotation=turned(45), translation=[0.25, 0.5, 0])
    asset.node(inner, scale=[1, 2, 1], mesh=asset.mesh(square(), QUAD, asset.unlit(RED)))
    points = rotated(square()[:, :2] * [1, 2], 45) + [0.25, 0.5]
    assert close(moments(drawing.show(asset)), polygon(points * [2, 0.5]))


BENT = np.array([[x, y, 0] for y in (-1.0, 0.0, 1.0) for x in (-0.25, 0.25)])
STRIP = [0, 1, 3, 0, 3, 2, 2, 3, 5, 2, 5, 4]


def strip(asset, weights=(0, 0.5, 1), **more):
    """A strip of two parts, its lower bone at (0, -1), its upper one at (0, 0)."""
    root = asset.node(translation=[0, -1, 0])
    upper = asset.node(root, translation=[0, 1, 0])
    inverse = np.tile(np.eye(4), (2, 1, 1))
    inverse[0, 3, :3] = [0, 1, 0]  # by columns: minus the place of the bone
    skin = asset.add("skins", {"joints": [root, upper], "inverseBindMatrices":
                               asset.accessor(inverse.reshape(2, 16))})
    upper_weights = np.repeat(weights, 2)
    zero = np.zeros(6)
    mesh = asset.mesh(
        BENT, STRIP, asset.unlit(RED),
        JOINTS_0=asset.accessor(np.tile([0, 1, 0, 0], (6, 1)), "uint8"),
        WEIGHTS_0=np.array([1 - upper_weights, upper_weights, zero, zero]).T, **more)
    asset.node(mesh=mesh, skin=skin, translation=[7, 7, 7])  # which a skin makes void
    return root, upper


def skinned(lower, upper, weights=(0, 0.5, 1)):
    """The strip's outline with its bones turned: each vertex the weighted mean of its places."""
    low = rotated(BENT, lower, (0, -1))
    high = rotated(rotated(BENT, upper), lower, (0, -1))
    share = np.repeat(weights, 2)[:, None]
    points = (1 - share) * low + share * high
    return points[[0, 1, 3, 5, 4, 2]]


@pytest.mark.parametrize("lower, upper", [(0, 0), (0, 60), (-30, 75)])
def test_a_bent_strip(drawing, lower, upper):
    """Broken by joints without their parents, a bind matrix read by rows or from the wrong side,
    the mesh node's own transform, or weights given to the wrong joint."""
    asset = Asset()
    viewed(asset)
    root, bone = strip(asset)
    asset.tree["nodes"][root]["rotation"] = turned(lower)
    asset.tree["nodes"][bone]["rotation"] = turned(upper)
    assert close(moments(drawing.show(asset)), polygon(skinned(lower, upper)))


@pytest.mark.parametrize("kind, most", [("uint8", 255), ("uint16", 65535)])
def test_integer_weights_that_do_not_add_up(drawing, kind, most):
    """Broken by weights taken for fractions of their sum's rounding: they are normalised."""
    asset = Asset()
    viewed(asset)
    root, bone = strip(asset)
    asset.tree["nodes"][bone]["rotation"] = turned(60)
    rows = [[most, 0, 0, 0]] * 2 + [[most // 3, most // 3, 0, 0]] * 2 + [[0, most // 2, 0, 0]] * 2
    attributes = asset.tree["meshes"][0]["primitives"][0]["attributes"]
    attributes["WEIGHTS_0"] = asset.accessor(rows, kind, normalized=True)
    assert close(moments(drawing.show(asset)), polygon(skinned(0, 60)))


def morphed(asset, usual, **more):
    """A square that its targets stretch upwards and to the right."""
    up, right = np.zeros((2, 4, 3))
    up[2:, 1] = 1
    right[1:3, 0] = 0.5
    mesh = asset.mesh(square(), QUAD, asset.unlit(RED), targets=[up, right])
    asset.tree["meshes"][mesh]["weights"] = usual
    return asset.node(mesh=mesh, **more)


def stretched(up, right):
    points = square()
    points[2:, 1] += up
    points[1:3, 0] += 0.5 * right
    return polygon(points)


def test_weights_of_morph_targets(drawing):
    """Broken by the mesh's weights going before the node's, or a target counted twice."""
    for more, expected in (({}, (0.5, 1)), ({"weights": [1, -0.25]}, (1, -0.25))):
        asset = Asset()
        viewed(asset)
        morphed(asset, [0.5, 1], **more)
        assert close(moments(drawing.show(asset)), stretched(*expected))


@pytest.mark.parametrize("kind", ["STEP", "LINEAR", "CUBICSPLINE"])
def test_animated_weights(drawing, kind):
    """Broken by keys of several numbers read with the stride of one, or tangents in their place."""
    asset = Asset()
    viewed(asset)
    node = morphed(asset, [9, 9])
    values = np.array([[0, 1], [1, 0.5]], float)
    if kind == "CUBICSPLINE":
        values = np.array([[0, 0], values[0], [1, 0], [0, 0], values[1], [0, 0]], float)
    asset.animate(node, "weights", [0, 1], values.reshape(-1, 1), kind)
    expected = {"STEP": (0, 1), "LINEAR": (0.5, 0.75),
                "CUBICSPLINE": (0.125 + 0.5, 0.75)}[kind]
    assert close(moments(drawing.show(asset, time=0.5)), stretched(*expected))


def test_a_morph_target_of_a_skinned_mesh(drawing):
    """Broken by a skin that goes before the targets."""
    asset = Asset()
    viewed(asset)
    wide = np.zeros((6, 3))
    wide[5, 0] = 0.75
    _, bone = strip(asset, weights=(0, 0, 1), targets=[wide])
    asset.tree["nodes"][bone]["rotation"] = turned(90)
    asset.tree["meshes"][0]["weights"] = [1]
    outline = skinned(0, 90, (0, 0, 1))
    outline[3] += rotated([[0.75, 0]], 90)[0]  # the corner that the target moves
    assert close(moments(drawing.show(asset)), polygon(outline))


def chain():
    """Arms on arms, each turning and the outer one growing."""
    asset = Asset()
    viewed(asset)
    inner = asset.node(rotation=turned(0))
    outer = asset.node(inner, translation=[0.75, 0, 0])
    mesh = asset.mesh(square((0.5, 0)), QUAD, asset.unlit(RED))
    asset.node(outer, mesh=mesh)
    asset.animate(inner, "rotation", [0, 0.5, 1], [turned(0), turned(80), turned(110)])
    asset.animate(outer, "rotation", [0, 1], [turned(0), turned(-150)])
    asset.animate(outer, "scale", [0.2, 1], [[1, 1, 1], [0.5, 2, 1]])
    return asset


def bending():
    asset = Asset()
    viewed(asset)
    root, bone = strip(asset)
    asset.animate(root, "rotation", [0, 1], [turned(-20), turned(30)])
    asset.animate(bone, "rotation", [0, 0.3, 1], [turned(0), turned(70), turned(-80)])
    return asset


def swelling():
    asset = Asset()
    viewed(asset)
    node = morphed(asset, [0, 0])
    asset.animate(node, "weights", [0, 1],
                  [[0], [0], [3], [2], [0], [0], [0], [0], [1], [-1], [0], [0]], "CUBICSPLINE")
    asset.animate(node, "translation", [0, 1], [[-0.5, 0, 0], [0.5, 0, 0]])
    return asset


def flying_camera():
    asset = Asset()
    camera = viewed(asset)
    asset.node(mesh=asset.mesh(square((0.5, 0.25)), QUAD, asset.unlit(RED)))
    asset.animate(camera, "translation", [0, 1], [[-0.5, 0, 10], [0.75, 0, 10]])
    asset.animate(camera, "rotation", [0, 1], [turned(0), turned(100)])
    return asset


@pytest.mark.parametrize("make", [chain, bending, swelling, flying_camera])
def test_blur_is_the_mean_of_many_instants(drawing, make):
    """Broken by steps too few for the way that corners go, times that are not uniform over the
    shutter, or keys that a step passes by."""
    asset = make()
    blurred = drawing.show(asset, side=32, samples=1024, time=0, close=1)
    instants = np.mean([drawing.show(asset, side=32, samples=16, time=(i + 0.5) / 20)
                        for i in range(20)], 0)
    area, center = moments(blurred)
    wanted, place = moments(instants)
    assert abs(area / wanted - 1) <= 0.01 and np.abs(center - place).max() <= 0.01
    # 20 instants of an edge are steps of 1/20, which 16 samples round again.
    assert np.abs(blurred - instants).mean() <= 0.008
    assert np.abs(blurred - instants).max() <= 0.12


def test_an_animated_camera(drawing):
    """Broken by a camera that stays where its node stands at rest, or goes the other way."""
    asset = Asset()
    camera = viewed(asset)
    asset.node(mesh=asset.mesh(square(), QUAD, asset.unlit(RED)))
    asset.animate(camera, "translation", [0, 2], [[0, 0, 10], [1, -0.5, 10]])
    assert close(moments(drawing.show(asset, time=1)), (0.25, [-0.5, 0.25]))


def test_clips_of_several_nodes(drawing):
    """Broken by an animation beyond the first that is forgotten: clips that do not collide all
    play."""
    asset = Asset()
    viewed(asset)
    for clip, (x, color) in enumerate(((-1, RED), (1, GREEN))):
        node = asset.node(mesh=asset.mesh(square(), QUAD, asset.unlit(color)))
        asset.animate(node, "translation", [0, 1], [[x, 0, 0], [x, 1, 0]], clip=clip)
    pixels = drawing.show(asset, time=0.5)
    assert close(moments(pixels, 0), (0.25, [-1, 0.5]))
    assert close(moments(pixels, 1), (0.25, [1, 0.5]))


def test_the_view_shows_what_it_says(drawing):
    """Broken by an orthographic camera whose ymag is its whole height, or its width."""
    asset = Asset()
    viewed(asset)
    asset.node(mesh=asset.mesh(square(half=HALF * 0.75), QUAD, asset.unlit(RED)))
    pixels = drawing.show(asset)
    assert np.abs(pixels[8:-8, 8:-8, 0] - 1).max() == 0
    assert pixels.sum() == pixels[8:-8, 8:-8, 0].sum()
