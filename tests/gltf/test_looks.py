# SPDX-License-Identifier: Apache-2.0
"""Materials and textures of glTF files, against closed forms and the scene format's own."""
import math

import numpy as np
import pytest
import scene
from conftest import frame
from glb import Asset
from measure import (BLUE, GREEN, HALF, QUAD, RED, close, moments, png, polygon, square, texture,
                     viewed)

SCREEN = square(half=HALF)
UVS = np.array([[0, 1], [1, 1], [1, 0], [0, 0]])  # v points down
TEXELS = np.random.default_rng(7).choice([0, 255], (4, 4, 3))


def srgb(value):
    return value / 12.92 if value <= 0.04045 else ((value + 0.055) / 1.055) ** 2.4


def painted(material, uvs=None, **more):
    """A square that fills the view, with the material that material(asset) adds."""
    asset = Asset()
    viewed(asset)
    if uvs is not None:
        more["TEXCOORD_0"] = uvs
    asset.node(mesh=asset.mesh(SCREEN, QUAD, material(asset), **more))
    return asset


def test_what_is_unlit_shows_its_color(drawing):
    """Broken by light that falls on it, or a color that is decoded once more."""
    pixels = drawing.show(painted(lambda a: a.unlit([0.2, 0.4, 0.8])), side=8, samples=4,
                          background={"color": [1, 1, 1]})
    assert np.abs(pixels - [0.2, 0.4, 0.8]).max() <= 1e-6


def test_emission_has_its_strength(drawing):
    """Broken by a strength that is dropped, or counted twice where the surface is a light."""
    def material(asset):
        asset.use("KHR_materials_emissive_strength")
        return asset.add("materials", {
            "emissiveFactor": [0.25, 0.5, 1], "pbrMetallicRoughness": {
                "baseColorFactor": [0, 0, 0, 1], "metallicFactor": 0},
            "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 12},
                           "KHR_materials_ior": {"ior": 1}}})

    pixels = drawing.show(painted(material), side=8, samples=4)
    assert np.abs(pixels - 12 * np.array([0.25, 0.5, 1])).max() <= 1e-5


@pytest.mark.parametrize("double_sided", [False, True])
@pytest.mark.parametrize("faces_us", [False, True])
def test_sides(drawing, double_sided, faces_us):
    """Broken by a back that shows though it is not doubleSided, or does not though it is."""
    asset = Asset()
    viewed(asset)
    asset.node(mesh=asset.mesh(SCREEN, QUAD if faces_us else QUAD[::-1],
                               asset.unlit(RED, doubleSided=double_sided)))
    pixels = drawing.show(asset, side=8, samples=4, background={"color": [0, 1, 0]})
    assert (pixels == (RED if faces_us or double_sided else GREEN)).all()


def layered(drawing, alpha, colors=None, **material):
    """A red square of some alpha before a green one."""
    asset = Asset()
    viewed(asset)
    asset.node(mesh=asset.mesh(SCREEN, QUAD, asset.unlit(GREEN)), translation=[0, 0, -1])
    more = {"COLOR_0": colors} if colors is not None else {}
    asset.node(mesh=asset.mesh(SCREEN, QUAD, asset.unlit([*RED, alpha], **material), **more))
    return drawing.show(asset, side=16, samples=256)


FADING = np.array([[1, 1, 1, a] for a in (0, 1, 1, 0)])  # from left to right


def test_blend(drawing):
    """Broken by an alpha that is a weight of the front alone, or not multiplied by the vertices'."""
    pixels = layered(drawing, 0.25, alphaMode="BLEND")
    assert np.abs(pixels.mean((0, 1)) - [0.25, 0.75, 0]).max() <= 0.005
    pixels = layered(drawing, 0.5, FADING, alphaMode="BLEND")
    expected = (np.arange(16) + 0.5) / 16 * 0.5
    assert np.abs(pixels[:, :, 0].mean(0) - expected).max() <= 0.02
    assert np.abs(pixels.sum(2) - 1).max() <= 1e-5


@pytest.mark.parametrize("cutoff, share", [(0.25, 0.75), (None, 0.5), (2.0, 0)])
def test_mask(drawing, cutoff, share):
    """Broken by a cutoff that is not 0.5 unless it is said, or by alpha below it that shows."""
    more = {} if cutoff is None else {"alphaCutoff": cutoff}
    pixels = layered(drawing, 1.0, FADING, alphaMode="MASK", **more)
    edge = 16 - round(16 * share)
    assert (pixels[:, :edge] == GREEN).all() and (pixels[:, edge:] == RED).all()


def test_opaque_has_no_alpha(drawing):
    """Broken by an alpha that counts though the mode says that it does not."""
    assert (layered(drawing, 0.25, FADING) == RED).all()


def test_vertex_colors_multiply(drawing):
    """Broken by colours that replace the material's, or are taken for sRGB."""
    colors = np.array([[0.5, 0.5, 1]] * 4)
    pixels = drawing.show(painted(lambda a: a.unlit([0.5, 1, 0.25]), COLOR_0=colors), side=8,
                          samples=4)
    assert np.abs(pixels - [0.25, 0.5, 0.25]).max() <= 1e-6


def centers(pixels, count=4):
    """The pixels at the middles of so many texels a side; a side of them must be odd."""
    step = len(pixels) // count
    return pixels[step // 2::step, step // 2::step]


def looked_up(uvs_of, wrap=lambda i: i % 4):
    """The texels that a transform of uv shows at the middles of a 4 x 4 screen."""
    shown = np.empty((4, 4, 3))
    for row in range(4):
        for column in range(4):
            u, v = uvs_of((column + 0.5) / 4, (row + 0.5) / 4)
            shown[row, column] = TEXELS[wrap(math.floor(v * 4)), wrap(math.floor(u * 4))] / 255
    return shown


def transformed(offset=(0, 0), rotation=0.0, scale=(1, 1)):
    c, s = math.cos(rotation), math.sin(rotation)

    def apply(u, v):
        u, v = u * scale[0], v * scale[1]
        return c * u + s * v + offset[0], -s * u + c * v + offset[1]
    return apply


def textured(texel_use=None, uvs=UVS, sampler=None, **attributes):
    def material(asset):
        use = {"index": texture(asset, TEXELS, **(sampler or {})), **(texel_use or {})}
        return asset.unlit([1, 1, 1], pbr={"baseColorTexture": use})
    return painted(material, uvs, **attributes)


def draw_texels(drawing, asset):
    return centers(drawing.show(asset, side=60, samples=16))


@pytest.mark.parametrize("transform", [
    {}, {"offset": [0.25, 0.5]}, {"scale": [-1, 1]}, {"rotation": math.pi / 2},
    {"rotation": -math.pi / 2, "offset": [0.25, 0]}, {"rotation": math.pi, "scale": [1, -1]},
    {"rotation": math.pi / 2, "scale": [3, 1], "offset": [0.25, 0.75]}], ids=str)
def test_texture_transform(drawing, transform):
    """Broken by another order than translation, rotation, scale, or a turn the other way."""
    asset = textured({"extensions": {"KHR_texture_transform": transform}})
    found = draw_texels(drawing, asset)
    assert np.abs(found - looked_up(transformed(**transform))).max() <= 0.1


def test_the_second_set_of_uvs(drawing):
    """Broken by TEXCOORD_0 in its place; a transform's texCoord goes before the texture's."""
    mirrored = UVS * [-1, 1] + [1, 0]
    expected = looked_up(lambda u, v: (1 - u, v))
    for use in ({"texCoord": 1}, {"extensions": {"KHR_texture_transform": {"texCoord": 1}}}):
        found = draw_texels(drawing, textured(use, TEXCOORD_1=mirrored))
        assert np.abs(found - expected).max() <= 0.1
    back = {"texCoord": 1, "extensions": {"KHR_texture_transform": {"texCoord": 0}}}
    found = draw_texels(drawing, textured(back, TEXCOORD_1=mirrored))
    assert np.abs(found - looked_up(lambda u, v: (u, v))).max() <= 0.1


@pytest.mark.parametrize("kind", ["uint8", "uint16"])
def test_uvs_as_integers(drawing, kind):
    """Broken by integers that are not divided by the largest."""
    asset = textured()
    asset.tree["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = asset.accessor(
        UVS * np.iinfo(kind).max, kind, normalized=True)
    assert np.abs(draw_texels(drawing, asset) - looked_up(lambda u, v: (u, v))).max() <= 0.1


@pytest.mark.parametrize("wrap, rule", [
    (33071, lambda i: min(max(i, 0), 3)), (33648, lambda i: i % 8 if i % 8 < 4 else 7 - i % 8),
    (10497, lambda i: i % 4)], ids=["clamp", "mirror", "repeat"])
def test_wraps(drawing, wrap, rule):
    """Broken by a sampler that is not the texture's, or a wrap taken for another."""
    asset = textured({"extensions": {"KHR_texture_transform": {"offset": [-0.5, 0.75]}}},
                     sampler={"wrapS": wrap, "wrapT": wrap})
    found = draw_texels(drawing, asset)
    expected = looked_up(transformed(offset=(-0.5, 0.75)), rule)
    assert np.abs(found - expected).max() <= 0.1


def test_texels_that_are_not_interpolated(drawing):
    """Broken by a magFilter that is not read: each texel then fades into its neighbours."""
    expected = looked_up(lambda u, v: (u, v)).repeat(15, 0).repeat(15, 1)
    found = drawing.show(textured(sampler={"magFilter": 9728}), side=60, samples=16)
    assert np.abs(found - expected).max() <= 1e-6
    assert np.abs(drawing.show(textured(), side=60, samples=16) - expected).max() > 0.1


@pytest.mark.parametrize("generator, is_blender", [
    ("Khronos glTF Blender I/O v3.4.50", True), ("Khronos glTF Blender I/O v1.8.19", True),
    ("Khronos glTF Blender I/O v4.2.60", False), ("Khronos glTF Blender I/O v34", False),
    ("glTF Blender I/O v3.4.50", False)])
def test_whose_surfaces_they_are(drawing, generator, is_blender):
    """Broken by glTF's model where Blender 3 wrote the file, or the other way round: in a white
    world a body without a material is matte and grey there, not of rough metal, and nothing is
    taken from the light that a white base returns below the reflection."""
    bare, white = painted(lambda _: None), painted(lambda a: a.add("materials", {
        "pbrMetallicRoughness": {"metallicFactor": 0, "roughnessFactor": 0.5}}))
    for asset, returned in ((bare, 0.8), (white, 1.04)):
        asset.tree["asset"]["generator"] = generator
        pixels = drawing.show(asset, side=8, samples=256, background={"color": [1, 1, 1]})
        assert (abs(pixels.mean() - returned) < 0.02) == is_blender


def test_base_color_is_encoded(drawing):
    """Broken by a texel that is not decoded, or is before a factor multiplies it."""
    def material(asset):
        use = {"index": texture(asset, np.full((2, 2, 3), 128))}
        return asset.unlit([0.5, 1, 1], pbr={"baseColorTexture": use})

    pixels = drawing.show(painted(material, UVS), side=8, samples=4)
    assert np.abs(pixels - srgb(128 / 255) * np.array([0.5, 1, 1])).max() <= 2e-4


# How a material of the asset says what a principled one of the scene format does.
PARAMETERS = [
    ({"base_color": [0.2, 0.5, 0.9]}, {"baseColorFactor": [0.2, 0.5, 0.9, 1]}, {}),
    ({"metallic": 0.75}, {"metallicFactor": 0.75}, {}),
    ({"roughness": 0.2}, {"roughnessFactor": 0.2}, {}),
    ({"emission": [0.5, 1, 2], "emission_strength": 2},
     {}, {"KHR_materials_emissive_strength": {"emissiveStrength": 4},
          "emissiveFactor": [0.25, 0.5, 1]}),
    ({"ior": 1.9}, {}, {"KHR_materials_ior": {"ior": 1.9}}),
    # an index that returns 8 % head-on
    ({"ior": (1 + 0.08 ** 0.5) / (1 - 0.08 ** 0.5)}, {},
     {"KHR_materials_specular": {"specularFactor": 0.5, "specularColorFactor": [4, 4, 4]}}),
    ({"ior": 1}, {}, {"KHR_materials_specular": {"specularColorFactor": [0, 0, 0]},
                      "KHR_materials_ior": {"ior": 1.45}}),
    ({"ior": 1.3, "transmission": 0.7}, {},
     {"KHR_materials_specular": {"specularColorFactor": [0.25, 0.5, 0.25]},
      "KHR_materials_ior": {"ior": 1.3},
      "KHR_materials_transmission": {"transmissionFactor": 0.7}}),
    ({"transmission": 0.7}, {}, {"KHR_materials_transmission": {"transmissionFactor": 0.7}}),
    ({"clearcoat": 0.8}, {}, {"KHR_materials_clearcoat": {"clearcoatFactor": 0.8}}),
    ({"clearcoat": 0.8, "clearcoat_roughness": 0.6}, {},
     {"KHR_materials_clearcoat": {"clearcoatFactor": 0.8, "clearcoatRoughnessFactor": 0.6}}),
]

INPUTS = ["base_color", "metallic", "roughness", "emission", "transmission", "clearcoat",
          "clearcoat_roughness", "normal", "clearcoat_normal"]


def tilted(objects, material, **more):
    """A tilted square between a lamp, a red wall and a bright background."""
    view = scene.look([0, 1.5, 3], [0, 0, 0], shutter={"open": 0, "close": 0})
    return frame([scene.floor(half=6, y=-1.5), *objects], side=16, samples=64, camera=view,
                 lights=[{"type": "point", "position": [1, 3, 1], "intensity": [20, 15, 10]}],
                 materials={"white": scene.matte(0.6), "own": material},
                 background={"color": [0.4, 0.5, 0.7]}, **more)


SLOPE = np.array([[-1, -0.3, 1], [1, -0.3, 1], [1, 0.3, -1], [-1, 0.3, -1]])


def both(drawing, own, pbr, extensions, textures=None):
    """The image by a material of the scene format, and by the same of a glTF."""
    mesh = {"type": "mesh", "material": "own", "vertices": SLOPE.tolist(), "indices": QUAD,
            "uvs": UVS.tolist()}
    asset = Asset()
    if textures:
        asset.add("textures", {"source": 0})
        asset.add("images", {"mimeType": "image/png", "bufferView": asset.view(textures["png"])})
    material = {"pbrMetallicRoughness": {"metallicFactor": 0, "roughnessFactor": 0.5, **pbr},
                "doubleSided": True, "extensions": {}}
    for name, value in extensions.items():
        if name.startswith("KHR_"):
            material["extensions"][name] = value
            asset.use(name)
        else:
            material[name] = value
    asset.node(mesh=asset.mesh(SLOPE, QUAD, asset.add("materials", material), TEXCOORD_0=UVS))
    more = {"textures": textures["scene"]} if textures else {}
    return (drawing.pixels(tilted([mesh], {"type": "principled", **own}, **more)),
            drawing.pixels(tilted([drawing.object(asset)], scene.matte(1))))


@pytest.fixture(name="usual", scope="module")
def fixture_usual(drawing):
    return both(drawing, {}, {}, {})


@pytest.mark.parametrize("own, pbr, extensions", PARAMETERS,
                         ids=[f"{k}: {', '.join(own)}" for k, (own, _, _) in enumerate(PARAMETERS)])
def test_parameters(drawing, usual, own, pbr, extensions):
    """Broken by a parameter that does not reach the surface, or reaches it as another."""
    expected, found = both(drawing, own, pbr, extensions)
    assert np.abs(expected - usual[0]).max() > 0.01
    assert np.abs(found - expected).max() <= 1e-4 * expected.max()


def test_defaults_are_alike(usual):
    """Broken by a material of a glTF that starts from something else."""
    assert np.abs(usual[1] - usual[0]).max() <= 1e-4 * usual[0].max()


def use_of(name):
    """What of a glTF's material has the texture of an input: tables and keys on the way there."""
    return {"base_color": ("pbr", "baseColorTexture"), "metallic": ("pbr", "metallicRoughnessTexture"),
            "roughness": ("pbr", "metallicRoughnessTexture"), "emission": ("top", "emissiveTexture"),
            "normal": ("top", "normalTexture"),
            "transmission": ("KHR_materials_transmission", "transmissionTexture"),
            "clearcoat": ("KHR_materials_clearcoat", "clearcoatTexture"),
            "clearcoat_roughness": ("KHR_materials_clearcoat", "clearcoatRoughnessTexture"),
            "clearcoat_normal": ("KHR_materials_clearcoat", "clearcoatNormalTexture")}[name]


@pytest.mark.parametrize("name", INPUTS)
def test_textures_of_all_inputs(drawing, name):
    """Broken by a texture that is read from another channel, decoded though it is data, or not at
    all; metallic and roughness share one, and so each is shown with the other."""
    data = png(np.random.default_rng(3).integers(96, 255, (4, 4, 3)))
    picture = drawing.put(data)
    kind = "srgb" if name in ("base_color", "emission") else "linear"
    own = {"metallic": 1, "roughness": 1, "clearcoat": 1, "clearcoat_roughness": 1,
           "transmission": 1, "emission": [1, 1, 1], "base_color": [1, 1, 1]}
    shared = ("metallic", "roughness") if name in ("metallic", "roughness") else (name,)
    for key in shared:
        own[key] = {"texture": "t"}
    if "normal" in name:
        own[name]["scale"] = 0.5
    where, key = use_of(name)
    use = {"index": 0, **({"scale": 0.5} if "normal" in name else {})}
    pbr = {"metallicFactor": 1, "roughnessFactor": 1}
    extensions = {"emissiveFactor": [1, 1, 1],
                  "KHR_materials_transmission": {"transmissionFactor": 1},
                  "KHR_materials_clearcoat": {"clearcoatFactor": 1, "clearcoatRoughnessFactor": 1}}
    if name in ("transmission", "base_color"):
        own["metallic"] = pbr["metallicFactor"] = 0
    if name in ("normal", "clearcoat_normal"):
        own["clearcoat_roughness"] = extensions["KHR_materials_clearcoat"][
            "clearcoatRoughnessFactor"] = 0.2
        own["roughness"] = pbr["roughnessFactor"] = 0.3
    {"pbr": pbr, "top": extensions}.get(where, extensions.get(where))[key] = use
    expected, found = both(drawing, own, pbr, extensions, {
        "png": data, "scene": {"t": {"image": picture, "color_space": kind}}})
    assert np.abs(found - expected).max() <= 1e-4 * expected.max()


def test_a_material_of_the_scene_goes_before(drawing):
    """Broken by an object's own material that the file's outlives, in it or in its instances."""
    asset = painted(lambda a: a.unlit(RED))
    body = frame([drawing.object(asset, material="own")], side=8, samples=4,
                 materials={"own": {"type": "principled", "unlit": True, "base_color": [0, 0, 1]}})
    assert (drawing.pixels(body) == BLUE).all()


def test_a_square_has_its_place(drawing):
    """Broken by a view that the tests above take for granted."""
    asset = Asset()
    viewed(asset)
    asset.node(mesh=asset.mesh(square((0.5, -0.75)), QUAD, asset.unlit(RED)))
    assert close(moments(drawing.show(asset)), polygon(square((0.5, -0.75))))
