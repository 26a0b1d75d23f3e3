# SPDX-License-Identifier: Apache-2.0
"""KHR_lights_punctual against the scene format's own lights, and against closed forms."""
import math

import numpy as np
import pytest
import scene
from conftest import frame
from glb import Asset

LUMENS_PER_WATT = 683.0  # of Blender's exporter
DOWN = [-math.sqrt(0.5), 0, 0, math.sqrt(0.5)]  # turns -Z to -Y
SIDE = 24


def body(objects, lights=(), samples=4, **more):
    """A white floor seen from above, 1 unit a quarter of the image's side."""
    view = scene.look([0, 100, 0], [0, 0, 0], fov=2 * math.degrees(math.atan(2 / 100)),
                      up=[0, 0, -1], shutter=more.pop("shutter", {"open": 0, "close": 0}))
    return frame([scene.floor(half=4), *objects], side=SIDE, samples=samples, camera=view,
                 lights=list(lights), materials={"white": scene.matte(0.5)}, **more)


def lit_by(asset, drawing, **more):
    return drawing.pixels(body([drawing.object(asset)], **more))


def carrying(node=None, **light):
    """A light on a node that, unless it is said, stands at height 2 and looks down."""
    asset = Asset()
    light = {"color": [1, 0.5, 0.25], **light}
    asset.node(**(node or {"translation": [0.5, 2, 0], "rotation": DOWN}), **asset.light(**light))
    return asset


def same(found, expected):
    return expected.max() > 0 and np.abs(found - expected).max() <= 1e-5 * expected.max()


def test_a_point_light(drawing):
    """Broken by candela taken for watts, and by another falloff than that of the square."""
    found = lit_by(carrying(type="point", intensity=3 * LUMENS_PER_WATT), drawing)
    own = {"type": "point", "position": [0.5, 2, 0], "intensity": [3, 1.5, 0.75]}
    assert same(found, drawing.pixels(body([], [own])))
    y, x = np.indices((SIDE, SIDE))
    away = np.hypot((x + 0.5) / SIDE * 4 - 2 - 0.5, (y + 0.5) / SIDE * 4 - 2)
    expected = 0.5 / math.pi * 3 * 2 / (4 + away ** 2) ** 1.5
    assert np.abs(found[:, :, 0] - expected).max() <= 0.01 * expected.max()


@pytest.mark.parametrize("inner, outer", [(0, math.pi / 4), (0.3, 0.5), (0.5, 0.5)])
def test_a_spot(drawing, inner, outer):
    """Broken by half angles taken for whole ones, a cone along another axis, or a penumbra that
    lies outside of the cone."""
    found = lit_by(carrying(type="spot", intensity=3 * LUMENS_PER_WATT,
                            spot={"innerConeAngle": inner, "outerConeAngle": outer}), drawing)
    own = {"type": "spot", "position": [0.5, 2, 0], "direction": [0, -1, 0],
           "intensity": [3, 1.5, 0.75], "cone_angle": math.degrees(2 * outer),
           "blend": 1 - inner / outer}
    assert same(found, drawing.pixels(body([], [own])))
    y, x = np.indices((SIDE, SIDE))
    away = np.hypot((x + 0.5) / SIDE * 4 - 2 - 0.5, (y + 0.5) / SIDE * 4 - 2)
    pixel = 4 / SIDE
    assert found[away > 2 * math.tan(outer) + pixel].max(initial=0) == 0
    assert (found[away < 2 * math.tan(outer) - 2 * pixel] > 0).all()


def test_the_cone_of_a_spot_has_defaults(drawing):
    """Broken by a spot without angles that is none: glTF's are 0 and a quarter of pi."""
    assert same(lit_by(carrying(type="spot", intensity=100, spot={}), drawing),
                lit_by(carrying(type="spot", intensity=100, spot={
                    "innerConeAngle": 0, "outerConeAngle": math.pi / 4}), drawing))


def test_a_directional_light(drawing):
    """Broken by lux taken for watts, or a distance that counts."""
    found = lit_by(carrying({"rotation": DOWN, "translation": [0, 50, 3]}, type="directional",
                            intensity=2 * LUMENS_PER_WATT), drawing)
    own = {"type": "directional", "direction": [0, -1, 0], "irradiance": [2, 1, 0.5], "angle": 0}
    assert same(found, drawing.pixels(body([], [own])))
    assert np.abs(found - 0.5 / math.pi * np.array([2, 1, 0.5])).max() <= 1e-5


def test_usual_color_and_intensity(drawing):
    """Broken by a default that is not white, or not 1."""
    asset = Asset()
    asset.node(rotation=DOWN, **asset.light(type="directional"))
    found = lit_by(asset, drawing)
    assert np.abs(found * LUMENS_PER_WATT / (0.5 / math.pi) - 1).max() <= 1e-4


def test_a_light_under_moving_and_growing_nodes(drawing):
    """Broken by a light that does not follow its parents, or whose power or axis their scale
    changes."""
    asset = Asset()
    arm = asset.node(scale=[3, 3, 3], rotation=[0, math.sqrt(0.5), 0, math.sqrt(0.5)])
    hand = asset.node(arm, translation=[0, 2 / 3, 0.5 / 3])
    asset.node(hand, rotation=DOWN, **asset.light(
        type="spot", intensity=LUMENS_PER_WATT, spot={"outerConeAngle": 0.5}))
    asset.animate(hand, "translation", [0, 1], [[0, 2 / 3, 0.5 / 3], [0, 2 / 3, -0.5 / 3]])
    for time, x in ((0, 0.5), (0.75, -0.25)):
        own = {"type": "spot", "position": [x, 2, 0], "direction": [0, -1, 0],
               "intensity": [1, 1, 1], "cone_angle": math.degrees(1), "blend": 1}
        found = lit_by(asset, drawing, shutter={"open": time, "close": time})
        assert same(found, drawing.pixels(body([], [own])))


def test_copies_of_an_object_bring_their_lights(drawing):
    """Broken by an instance of a glTF without its lights, or one that is hidden and shines."""
    asset = carrying(type="point", intensity=LUMENS_PER_WATT)
    hidden = drawing.object(asset, name="lamp", visible=False)
    moved = {"type": "instance", "of": "lamp", "transform": {"translate": [-1.5, 0, 0]}}
    own = {"type": "point", "position": [-1, 2, 0], "intensity": [1, 0.5, 0.25]}
    assert same(drawing.pixels(body([hidden, moved])), drawing.pixels(body([], [own])))


@pytest.mark.parametrize("light, word", [
    ({"type": "area"}, "type must be"),
    ({"type": "point", "intensity": -1}, "must not be negative"),
    ({"type": "point", "color": [1, -1, 1]}, "must not be negative"),
    ({"type": "spot", "spot": {"innerConeAngle": 0.5, "outerConeAngle": 0.4}}, "cones"),
    ({"type": "spot", "spot": {"outerConeAngle": 2}}, "cones"),
    ({"type": "spot", "spot": {"outerConeAngle": 0}}, "cones")])
def test_what_is_no_light(drawing, light, word):
    """Broken by a light that makes no sense and shines nevertheless."""
    said = drawing.refusal(carrying(**light))
    assert word in said and "light 0" in said
