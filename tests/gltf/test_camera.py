# SPDX-License-Identifier: Apache-2.0
"""A camera of a glTF, and what the scene text says beside it."""
import json
import math

import numpy as np
import pytest
from conftest import frame
from glb import Asset
from measure import GREEN, QUAD, RED, square

EYE, YFOV = [1.0, 1.5, 9.0], 0.5
TURN = [-0.15, 0.1, 0.02]  # of the node, about x, y and z
# What a scene says that has no camera, nor a glTF with one.
DEFAULT = {"position": [0, 2, 10], "look_at": [0, 0, 0], "up": [0, 1, 0], "horizontal_fov": 50}
AT_REST = {"shutter": {"open": 0, "close": 0}}


def quaternion():
    """The turn about the vector TURN, by its length."""
    angle = math.hypot(*TURN)
    axis = np.array(TURN) / angle
    return [*(math.sin(angle / 2) * axis).tolist(), math.cos(angle / 2)]


def axes():
    """Right, up and back of the node, as columns: Rodrigues' formula."""
    angle = math.hypot(*TURN)
    x, y, z = np.array(TURN) / angle
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * cross @ cross


def spelled_out(focus=10.0):
    """The same camera in the words of the scene text."""
    turned = axes()
    return {"position": EYE, "look_at": (np.array(EYE) - focus * turned[:, 2]).tolist(),
            "up": turned[:, 1].tolist(), "horizontal_fov": math.degrees(YFOV)}


def stage(*names):
    """A red square that moves before a green one, and cameras; the first one is EYE's."""
    asset = Asset()
    moving = asset.node(mesh=asset.mesh(square(), QUAD, asset.unlit(RED)), translation=[0, 0, 3])
    asset.animate(moving, "translation", [0, 1], [[0, 0, 3], [0.5, 0, 3]])
    asset.node(mesh=asset.mesh(square(half=0.75), QUAD, asset.unlit(GREEN)))
    for i, name in enumerate(names):
        camera = asset.add("cameras", {"name": name, "type": "perspective",
                                       "perspective": {"yfov": YFOV * (1 + i), "znear": 0.01}})
        asset.node(camera=camera, name=f"node of {name}", translation=EYE, rotation=quaternion())
    return asset


def shown(drawing, asset, camera, samples=16, known={}):
    """The pixels; what has been asked for before is not rendered again."""
    body = frame([drawing.object(asset)], side=48, samples=samples)
    body.pop("camera")
    if camera is not None:
        body["camera"] = camera
    text = json.dumps(body)
    if text not in known:
        known[text] = drawing.pixels(body)
    return known[text]


def far(a, b):
    return np.abs(a - b).mean()


@pytest.mark.parametrize("camera", [
    None, {}, AT_REST, {"aperture_radius": 0}, {"focus_distance": 5}, {"focal_surface": "sphere"}])
def test_the_first_camera_of_a_gltf_is_the_camera_of_a_text_without_one(drawing, camera):
    """Broken by a camera that a text loses when it speaks of lens or shutter alone, or by another
    than the first."""
    expected = shown(drawing, stage(), spelled_out())
    assert far(shown(drawing, stage("first", "second"), camera), expected) < 1e-4
    assert far(shown(drawing, stage("first", "second"), {"from": "second"}), expected) > 0.01


@pytest.mark.parametrize("key, value", [
    ("position", [2, 2, 10]), ("look_at", [0.5, 0, 0]), ("up", [1, 3, 0]), ("horizontal_fov", 20)])
def test_a_text_with_a_view_has_its_own_camera(drawing, key, value):
    """Broken by a glTF's camera that gets in between, wholly or in part, when nobody asked for it."""
    asked = shown(drawing, stage("first"), {key: value})
    assert (asked == shown(drawing, stage("first"), {**DEFAULT, key: value})).all()
    assert far(asked, shown(drawing, stage("first"), None)) > 0.01


@pytest.mark.parametrize("keys", [
    {"position": [2, 1, 8]}, {"look_at": [0.5, 0.5, 0]}, {"up": [0.3, 1, 0]},
    {"position": [2, 1, 8], "look_at": [0, 0.5, 0]}, {"horizontal_fov": 45},
    {"aperture_radius": 0.5, "focus_distance": 6}, {"shutter": {"open": 0, "close": 1}},
    {"shutter": {"open": 1, "close": 1}},
    {"aperture_radius": 0.5, "focus_distance": 6, "blades": 3, "blade_rotation": 20},
    {"keyframes": [{"time": 0, "position": [2, 1, 8], "look_at": [0, 0, 0]}]}],
    ids=lambda keys: " ".join(keys))
def test_keys_beside_from_go_before_it(drawing, keys):
    """Broken by a key that is passed by, or that takes what it says nothing of from elsewhere."""
    asset, focus = stage("first"), keys.get("focus_distance", 10.0)
    own = spelled_out(focus)
    if "position" in keys and "look_at" not in keys:
        # The view keeps its direction.
        own["look_at"] = (np.array(own["look_at"]) - EYE + keys["position"]).tolist()
    own = {key: value for key, value in {**own, **keys}.items() if key != "up"}
    own["up"] = keys.get("up", [0, 1, 0] if "keyframes" in keys else spelled_out()["up"])
    found = shown(drawing, asset, {"from": "first", **keys}, samples=256)
    assert far(found, shown(drawing, asset, own, samples=256)) < 1e-3
    assert far(found, shown(drawing, asset, {"from": "first"}, samples=256)) > 0.002


@pytest.mark.parametrize("name, fov", [
    ("first", YFOV), ("second", 2 * YFOV), ("node of second", 2 * YFOV)])
def test_from_chooses_by_the_name_of_camera_or_node(drawing, name, fov):
    """Broken by a name that finds the first camera whatever it says, or only cameras' own names."""
    own = {**spelled_out(), "horizontal_fov": math.degrees(fov)}
    assert far(shown(drawing, stage("first", "second"), {"from": name}),
               shown(drawing, stage(), own)) < 1e-4


def test_a_name_that_no_camera_has(drawing):
    """Broken by a fault that does not say where it is, or what there is to choose from."""
    fault = drawing.refusal(stage("first", "second"), camera={"from": "third"})
    assert "/camera/from" in fault and '"first"' in fault and '"second"' in fault
    assert "none" in drawing.refusal(stage(), camera={"from": "first"})


@pytest.mark.parametrize("width, height", [(120, 120), (160, 60), (60, 160)])
@pytest.mark.parametrize("scale", [1e-3, 1, 300])
def test_where_there_is_no_camera_all_is_in_the_image(drawing, scale, width, height):
    """Broken by a camera of nowhere, one that cuts off what is high, wide or large, or shows what is
    small as a speck, and by bodies out of sight that count."""
    asset, hidden = Asset(), Asset()
    for x, y in ((0, 0), (3, 0), (3, 1)):
        asset.node(mesh=asset.mesh(square(), QUAD, asset.unlit(RED)),
                   translation=[scale * (100 + x), scale * y, 0], scale=3 * [scale])
    hidden.node(mesh=hidden.mesh(square(), QUAD, hidden.unlit(GREEN)), translation=[0, 9e4, 0])
    body = frame([drawing.object(asset), {**drawing.object(hidden), "visible": False}], samples=16)
    body.pop("camera")
    body["image"].update(width=width, height=height)
    shown_at = drawing.pixels(body).max(axis=2) > 0
    assert not shown_at[[0, -1]].any() and not shown_at[:, [0, -1]].any()
    spans = [np.ptp(np.flatnonzero(shown_at.any(axis=axis))) / shown_at.shape[1 - axis]
             for axis in (0, 1)]
    assert max(spans) >= 0.75


def test_the_camera_of_an_animation_without_one_rests(drawing):
    """Broken by a view that follows what moves from frame to frame."""
    asset = Asset()
    moving = asset.node(mesh=asset.mesh(square(), QUAD, asset.unlit(RED)))
    asset.animate(moving, "translation", [0, 1], [[0, 0, 0], [0.5, 0, 0]])
    asset.node(mesh=asset.mesh(square(half=1), QUAD, asset.unlit(GREEN)), translation=[0, 0, -0.01])
    body = frame([drawing.object(asset)], side=48, samples=16)
    body.pop("camera")
    body["frames"] = {"first": 1, "last": 13, "fps": 24}
    first, last = (drawing.pixels(body, "--frame", number)[:, :, 0] for number in (1, 13))
    centre, moved = (np.average(np.arange(48), weights=seen.sum(axis=0)) for seen in (first, last))
    # The green square is two units wide, and fills some nine tenths of the image.
    assert moved - centre == pytest.approx(0.25 / 2 * 0.85 * 48, rel=0.2)


def test_focus_of_a_camera_that_looks_at_something(drawing):
    """Broken by a focus that stays where the default camera would have it: without a distance, what
    is looked at is sharp."""
    view = {"from": "first", "aperture_radius": 1, "look_at": [0, 0, 0]}
    asset = stage("first")
    expected = shown(drawing, asset, {**view, "focus_distance": math.dist(EYE, [0, 0, 0])}, 256)
    assert far(shown(drawing, asset, view, 256), expected) < 1e-3
    assert far(shown(drawing, asset, {**view, "focus_distance": 20}, 256), expected) > 0.01
