# SPDX-License-Identifier: Apache-2.0
"""The many ways in which a glTF file may write down one mesh: they are all one image."""
import numpy as np
import pytest
import scene
from conftest import frame
from glb import Asset
from measure import BLUE, GREEN, QUAD, RED, close, moments, polygon, square, viewed

# A ribbon of six corners, coloured at each.
RIBBON = np.array([[x, y + 0.25 * x * x, 0.1 * x] for x in (-1.5, 0.0, 1.5) for y in (-0.5, 0.75)])
COLORS = np.array([[k / 5, 1 - k / 5, (k % 2) / 2, 1] for k in range(6)])
TRIANGLES = [0, 1, 2, 1, 3, 2, 2, 3, 4, 3, 5, 4]


def shown(drawing, asset, **more):
    return drawing.film(frame([drawing.object(asset)], side=32, samples=16, **more))


def ribbon(positions=None, indices=None, colors=None, **more):
    asset = Asset()
    viewed(asset)
    material = asset.unlit([1, 1, 1])
    find = [value(asset) if callable(value) else value for value in (positions, indices, colors)]
    positions, indices, colors = [usual if found is None else found for found, usual in
                                  zip(find, (RIBBON, TRIANGLES, COLORS))]
    asset.node(mesh=asset.mesh(positions, indices if len(np.shape(indices)) == 0 or
                               len(indices) else None, material, COLOR_0=colors, **more))
    return asset


@pytest.fixture(name="plain", scope="module")
def fixture_plain(drawing):
    return shown(drawing, ribbon())


def test_a_strip(drawing, plain):
    """Broken by a strip whose every other triangle is wound the wrong way, or starts elsewhere."""
    assert (shown(drawing, ribbon(mode=5, indices=[])) == plain).all()
    order = [0, 1, 2, 3, 4, 5]
    assert (shown(drawing, ribbon(mode=5, indices=order)) == plain).all()


def test_a_fan(drawing):
    """Broken by a fan that turns about another corner than its first."""
    around = [0, 2, 4, 5, 3, 1]
    fan = [2, 4, 0, 4, 5, 0, 5, 3, 0, 3, 1, 0]
    expected = shown(drawing, ribbon(indices=fan))
    assert (shown(drawing, ribbon(mode=6, indices=around)) == expected).all()
    listed = ribbon(mode=6, indices=[], positions=RIBBON[around], colors=COLORS[around])
    assert (shown(drawing, listed) == expected).all()


@pytest.mark.parametrize("mode, order", [(5, [0, 1, 2, 3]), (6, [0, 1, 3, 2])])
def test_winding_of_strips_and_fans(drawing, mode, order):
    """Broken by a triangle that shows its back: the surface is seen from its front alone."""
    points = square()[[0, 1, 3, 2]]
    for sign, area in ((1, 0.25), (-1, 0)):
        asset = Asset()
        viewed(asset)
        material = asset.unlit(RED, doubleSided=False)
        asset.node(mesh=asset.mesh(points * [sign, 1, 1], order, material, mode=mode))
        assert drawing.show(asset)[:, :, 0].sum() * (4 / 64) ** 2 == pytest.approx(area, rel=0.01)


@pytest.mark.parametrize("kind", ["uint8", "uint16", "uint32"])
def test_kinds_of_indices(drawing, plain, kind):
    """Broken by an index read in another width."""
    asset = ribbon(indices=lambda a: a.accessor(TRIANGLES, kind))
    assert (shown(drawing, asset) == plain).all()


def test_no_indices(drawing, plain):
    """Broken by vertices that are taken in another order than they come."""
    asset = ribbon(indices=[], positions=RIBBON[TRIANGLES], colors=COLORS[TRIANGLES])
    assert (shown(drawing, asset) == plain).all()


def test_interleaved_attributes(drawing, plain):
    """Broken by a stride that is passed over, or an accessor's offset that is."""
    asset = ribbon()
    rows = np.hstack([RIBBON, COLORS, np.full((6, 2), 9)]).astype("float32")
    view = asset.view(b"1234" + rows.tobytes(), byteStride=36)
    for name, offset in (("POSITION", 4), ("COLOR_0", 16)):
        accessor = asset.tree["accessors"][asset.tree["meshes"][0]["primitives"][0]
                                           ["attributes"][name]]
        accessor.update(bufferView=view, byteOffset=offset)
    assert (shown(drawing, asset) == plain).all()


@pytest.mark.parametrize("kind", ["uint8", "uint16", "uint32"])
@pytest.mark.parametrize("has_base", [True, False])
def test_sparse_accessors(drawing, plain, has_base, kind):
    """Broken by values put in another element's place, or zeros that are none."""
    asset = ribbon()
    moved = asset.tree["accessors"][asset.tree["meshes"][0]["primitives"][0]
                                    ["attributes"]["POSITION"]]
    if has_base:
        base, places = RIBBON.copy(), [1, 4]
        base[places] += 1
        moved["bufferView"] = asset.view(base.astype("float32").tobytes())
    else:
        places = range(6)
        del moved["bufferView"]
    moved["sparse"] = {
        "count": len(places),
        "indices": {"bufferView": asset.view(np.array(places, kind).tobytes()),
                    "componentType": {"uint8": 5121, "uint16": 5123, "uint32": 5125}[kind]},
        "values": {"bufferView": asset.view(b"12345678" +
                                            RIBBON[list(places)].astype("float32").tobytes()),
                   "byteOffset": 8}}
    assert (shown(drawing, asset) == plain).all()


@pytest.mark.parametrize("kind, most", [("uint8", 255), ("uint16", 65535)])
@pytest.mark.parametrize("width", [3, 4])
def test_colors_as_integers(drawing, kind, most, width):
    """Broken by integers that are not divided by the largest, or taken for sRGB."""
    whole = np.round(COLORS * most)[:, :width]
    asset = ribbon(colors=lambda a: a.accessor(whole, kind, normalized=True))
    exact = ribbon(colors=np.hstack([whole / most, np.ones((6, 4 - width))]))
    assert np.abs(shown(drawing, asset) - shown(drawing, exact)).max() <= 1e-4


@pytest.mark.parametrize("kind, scale, normalized", [
    ("int8", 1 / 127, True), ("int16", 1 / 32767, True), ("uint8", 1 / 255, True),
    ("uint16", 1 / 65535, True), ("int8", 1, False), ("uint16", 1, False)])
def test_quantized_positions(drawing, kind, scale, normalized):
    """Broken by another rule than KHR_mesh_quantization's, c / most, for signed integers."""
    most = np.iinfo(kind).max
    half = 0.75 * most if np.iinfo(kind).min < 0 else 0.375 * most
    corners = np.round(square(half=half) + (0 if np.iinfo(kind).min < 0 else [half, half, 0]))
    asset = Asset(extensionsRequired=["KHR_mesh_quantization"])
    viewed(asset)
    size = 1.5 if normalized else 1.5 / most
    # Padded to four bytes an element, as the extension asks.
    rows = np.zeros((4, 4), kind)
    rows[:, :3] = corners
    positions = asset.add("accessors", {
        "bufferView": asset.view(rows.tobytes(), byteStride=rows.strides[0]), "count": 4,
        "componentType": {"int8": 5120, "uint8": 5121, "int16": 5122, "uint16": 5123}[kind],
        "type": "VEC3", "normalized": normalized})
    asset.node(scale=[size] * 3, mesh=asset.mesh(positions, QUAD, asset.unlit(RED)))
    assert close(moments(drawing.show(asset)), polygon(corners * size * (scale if normalized else 1)))


def test_nodes_that_share_a_mesh(drawing):
    """Broken by an instance that loses its place, its mirror or its colour."""
    asset = Asset()
    viewed(asset)
    mesh = asset.mesh([[0, 0, 0], [1, 0, 0], [0, 0.5, 0]], [0, 1, 2],
                      asset.unlit(RED, doubleSided=False))
    asset.node(mesh=mesh, translation=[-1, -1, 0])
    asset.node(mesh=mesh, translation=[-1, 1, 0], scale=[-0.5, 1, 1])
    arm = asset.node(rotation=[0, 0, 1, 0])
    asset.node(arm, mesh=mesh, translation=[-1.5, 0, 0], scale=[1, -1.5, 1])
    area, center = moments(drawing.show(asset))
    parts = [polygon([[-1, -1], [0, -1], [-1, -0.5]]), polygon([[-1, 1], [-1.5, 1], [-1, 1.5]]),
             polygon([[1.5, 0], [0.5, 0], [1.5, 0.75]])]
    whole = sum(part[0] for part in parts)
    assert close((area, center), (whole, sum(part[0] * part[1] for part in parts) / whole))


@pytest.mark.parametrize("chosen, channel", [(0, 0), (1, 1), (None, 0)])
def test_several_scenes(drawing, chosen, channel):
    """Broken by a scene that is shown beside the default one, or in its place."""
    asset = Asset(scenes=[{"nodes": []}, {"nodes": []}])
    for index, color in enumerate((RED, GREEN)):
        camera = asset.add("cameras", {"type": "orthographic", "orthographic": {
            "xmag": 2, "ymag": 2, "znear": 0.01, "zfar": 100}})
        asset.node(scene=index, camera=camera, translation=[0, 0, 10])
        asset.node(scene=index, mesh=asset.mesh(square(), QUAD, asset.unlit(color)))
    if chosen is None:
        del asset.tree["scene"]
    else:
        asset.tree["scene"] = chosen
    pixels = drawing.show(asset)
    assert close(moments(pixels, channel), (0.25, [0, 0]))
    assert pixels[:, :, 1 - channel].max() == 0


@pytest.mark.parametrize("scale", [[-1, 1, 1], [1, -2, 1], [1, 1, -1], [-1, -1, -1]])
def test_mirrored_nodes_keep_their_front(drawing, scale):
    """Broken by a mirrored surface that shows its back: glTF's front follows the determinant."""
    asset = Asset()
    viewed(asset)
    back = np.linalg.det(np.diag(scale)) * np.prod(scale[:2]) < 0  # seen from behind
    asset.node(scale=scale, mesh=asset.mesh(square((0.5, 0.25)), QUAD,
                                            asset.unlit(RED, doubleSided=False)))
    pixels = drawing.show(asset)
    if back:
        assert pixels.max() == 0
    else:
        assert close(moments(pixels), polygon(square((0.5, 0.25)) * scale))


def test_what_has_no_volume(drawing):
    """Broken by nodes of scale 0 and empty meshes that end the render, or take others with them."""
    asset = Asset()
    viewed(asset)
    asset.node(mesh=asset.mesh(square((-1, 0)), QUAD, asset.unlit(RED)), scale=[0, 0, 0])
    asset.node(mesh=asset.mesh(square((1, 0)), QUAD, asset.unlit(GREEN)), scale=[1, 1, 0])
    asset.node(mesh=asset.mesh(square((0, 1)), QUAD, asset.unlit(RED)), scale=[0, 1, 1])
    asset.node(mesh=asset.add("meshes", {"primitives": []}))
    asset.node(mesh=asset.mesh(square(), [0, 1, 1], asset.unlit(RED)))
    twice = asset.mesh(square((0, -1)), QUAD, asset.unlit(BLUE))
    asset.node(mesh=twice)
    asset.node(mesh=twice, scale=[0, 0, 0])
    pixels = drawing.show(asset)
    assert pixels[:, :, 0].max() == 0
    assert close(moments(pixels, 1), (0.25, [1, 0]))
    assert close(moments(pixels, 2), (0.25, [0, -1]))


def test_a_node_that_grows_from_nothing(drawing):
    """Broken by a scale of 0 at the shutter's opening that ends the render: what pops up does so."""
    asset = Asset()
    viewed(asset)
    node = asset.node(mesh=asset.mesh(square(half=1), QUAD, asset.unlit(RED)))
    asset.animate(node, "scale", [0, 1], [[0, 0, 0], [1, 1, 1]])
    area, center = moments(drawing.show(asset, samples=1024, time=0, close=1))
    assert area == pytest.approx(4 / 3, rel=0.01) and np.abs(center).max() < 0.01


@pytest.mark.parametrize("size", [1e-4, 1, 1e5])
@pytest.mark.parametrize("is_node", [True, False])
def test_sizes_of_the_world(drawing, size, is_node):
    """Broken by a distance in units that stands for none: a hut and its shadow look the same at
    any size, whether vertices or nodes give it."""
    def lit(size):
        asset = Asset()
        root = asset.node(scale=[size if is_node else 1] * 3)
        by = 1 if is_node else size
        white = asset.add("materials", {"pbrMetallicRoughness": {"metallicFactor": 0},
                                        "doubleSided": True})
        ground = np.array([[-9, 0, 9], [9, 0, 9], [9, 0, -9], [-9, 0, -9]]) * by
        asset.node(root, mesh=asset.mesh(ground, QUAD, white))
        box = scene.box(0.7)
        asset.node(root, translation=[0, 0.7 * by, 0], mesh=asset.mesh(
            np.array(box["vertices"]) * by, box["indices"], white))
        view = scene.look([4 * size, 3 * size, 5 * size], [0, 0, 0], shutter={"open": 0, "close": 0})
        sun = {"type": "directional", "direction": [1, -2, -1], "irradiance": [2, 2, 2]}
        return drawing.pixels(frame([drawing.object(asset)], side=32, samples=64, camera=view,
                                    lights=[sun], background={"color": [0.3, 0.4, 0.6]}))

    found, expected = lit(size), lit(1)
    assert np.abs(found - expected).mean() <= 0.002
    assert expected.std() > 0.05


@pytest.mark.parametrize("far", [1e3, 1e6])
def test_far_from_the_origin(drawing, far):
    """Broken by a place far out that floats cannot tell from its neighbours: vertices near their
    node's origin stay whole there."""
    asset = Asset()
    viewed(asset, translation=[far, 0, 10])
    asset.node(translation=[far, 0, 0], mesh=asset.mesh(square(), QUAD, asset.unlit(RED)))
    area, center = moments(drawing.show(asset))
    tolerance = 0.004 + far * 2e-7
    assert abs(area - 0.25) <= 0.25 * 4 * tolerance and np.abs(center).max() <= tolerance
