# SPDX-License-Identifier: Apache-2.0
"""Textured surfaces as a camera sees them, against what their pictures say."""
import hashlib
import json
import struct
import subprocess
import zlib

import farm
import numpy as np
import pytest
import scene

PROGRAM = farm.BIN.parent / "tests/render-core"


def png(texels):
    """texels: height x width x 3, bytes."""
    height, width = texels.shape[:2]
    rows = b"".join(b"\0" + row.tobytes() for row in texels.astype(np.uint8))

    def chunk(name, content):
        crc = struct.pack(">I", zlib.crc32(name + content))
        return struct.pack(">I", len(content)) + name + content + crc

    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">2I5B", width, height, 8, 2, 0, 0, 0))
            + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b""))


@pytest.fixture(name="draw")
def fixture_draw(tmp_path):
    """Renders a scene whose texture "t" is of these texels, linear; tells its pixels."""
    def draw(body, texels, **texture):
        content = png(texels)
        name = hashlib.sha256(content).hexdigest()
        (tmp_path / name).write_bytes(content)
        body["textures"] = {"t": {"image": f"sha256:{name}", "color_space": "linear", **texture}}
        (tmp_path / "scene.json").write_text(json.dumps(body))
        subprocess.run([PROGRAM, tmp_path / "scene.json", tmp_path / "out.f32", "--assets",
                        tmp_path, "--processes", "2", *farm.ISA], check=True, timeout=120 * farm.SLOW)
        head, _, floats = (tmp_path / "out.f32").read_bytes().partition(b"\n")
        x0, y0, x1, y1 = map(int, head.split())
        film = np.frombuffer(floats, np.float32).reshape(y1 - y0, x1 - x0, -1)
        return film[:, :, :3] / film[:, :, 3:4]
    return draw


def unlit(**place):
    return {"white": {"type": "principled", "unlit": True, "base_color": {"texture": "t", **place}}}


def checkerboard(side, square):
    y, x = np.mgrid[:side, :side]
    return np.repeat(255 * ((x // square + y // square) % 2)[:, :, None], 3, 2)


def plane(samples, seed=0):
    """A plane of squares to the horizon: 128 of them along each side."""
    floor = scene.floor(half=64.0, uvs=[[0, 0], [16, 0], [16, 16], [0, 16]])
    camera = scene.look([0, 1.5, 40], [0, 0, 0], fov=40)
    return scene.build(96, 54, samples, [floor], camera=camera, materials=unlit(), seed=seed)


def test_far_squares_do_not_alias(draw):
    """Broken by textures read at a point, which makes of far squares a noise of black and white, and
    by a level of the pyramid for the longer side of a footprint, which makes near ones grey."""
    texels = checkerboard(64, 8)
    truth = draw(plane(1024), texels)
    error = draw(plane(4, seed=1), texels) - truth
    rms = np.sqrt((error ** 2).mean((1, 2)))

    assert rms[:20].max() == 0
    assert rms[24:].max() <= 0.1  # of four samples without a filter: 0.25
    assert abs(error[26:].mean()) <= 0.004
    assert truth[44:].std() >= 0.4


def quad(place, width=8, height=8):
    """The square of uv [0,1]² as the whole image, v down."""
    body = {"type": "mesh", "material": "white", "indices": [0, 1, 2, 0, 2, 3],
            "vertices": [[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]],
            "uvs": [[0, 1], [1, 1], [1, 0], [0, 0]]}
    camera = scene.look([0, 0, 100], [0, 0, 0], fov=2 * np.degrees(np.arctan(0.01)))
    return scene.build(width, height, 256, [body], camera=camera, materials=unlit(**place))


PLACES = {
    "as it is": ({}, lambda t: t),
    "moved": ({"offset": [0.25, 0.5]}, lambda t: np.roll(t, (-4, -2), (0, 1))),
    "turned": ({"rotation": 90}, lambda t: np.rot90(t, -1)),
    "turned back": ({"rotation": -90}, lambda t: np.rot90(t, 1)),
    "turned over": ({"rotation": 180}, lambda t: np.rot90(t, 2)),
    "mirrored": ({"scale": [-1, 1]}, lambda t: t[:, ::-1]),
    "turned, then moved": ({"rotation": 90, "offset": [0.25, 0]},
                           lambda t: np.rot90(np.roll(t, -2, 1), -1)),
    "scaled, then turned": ({"rotation": 90, "scale": [1, -1]},
                            lambda t: np.rot90(t, -1)[::-1]),
}


@pytest.mark.parametrize("place", PLACES)
def test_transforms_are_those_of_khr_texture_transform(draw, place):
    """Broken by a turn the other way round, by scale, turn and offset in another order, or by a
    picture upside down. Expected is translation * rotation * scale, counter-clockwise for uv."""
    transform, expected = PLACES[place]
    texels = np.random.default_rng(5).integers(0, 256, (8, 8, 3))
    pixels = draw(quad({"transform": transform}), texels)

    # A pixel is the mean of a texel interpolated with its neighbours: a tent over one and a half.
    wide = np.pad(expected(texels) / 255.0, ((1, 1), (1, 1), (0, 0)), "wrap")
    wide = 0.125 * wide[:-2] + 0.75 * wide[1:-1] + 0.125 * wide[2:]
    wide = 0.125 * wide[:, :-2] + 0.75 * wide[:, 1:-1] + 0.125 * wide[:, 2:]
    assert np.abs(pixels - wide).max() <= 0.02


BODIES = {
    "sphere": lambda more: scene.sphere(radius=0.6, **more),
    "mesh": lambda more: {"type": "mesh", "material": "white", "indices": [0, 1, 2],
                          "vertices": [[-0.6, -0.6, 0], [0.7, -0.5, 0], [0, 0.7, 0]],
                          "uvs": [[0, 0], [1.5, 0.2], [0.3, 1]], **more},
}


@pytest.mark.parametrize("body", BODIES)
def test_moving_textures_move_with_the_body(draw, body):
    """Broken by coordinates of another time than the hit's, or of the world instead of the body's:
    the mean over the shutter is the mean of bodies that stand still along the way."""
    texels = np.random.default_rng(7).integers(0, 256, (16, 16, 3))
    camera = scene.look([0, 0, 4], [0, 0, 0], fov=35)

    def pose(time):
        angle = np.radians(10 + 40 * time)
        return {"translate": [0.5 * time - 0.3, 0.2 * time, 0], "scale": [1.2, 0.8, 1],
                "rotate": [0, np.sin(angle / 2), 0, np.cos(angle / 2)]}

    def shot(more, samples, **shutter):
        return draw(scene.build(40, 40, samples, [BODIES[body](more)], materials=unlit(),
                                camera={**camera, "shutter": shutter}), texels)

    moving = shot({"keyframes": [{"time": t, **pose(t)} for t in (0, 1)]}, 1024, open=0, close=1)
    still = [shot({"transform": pose(t)}, 64, open=0, close=0) for t in (np.arange(32) + 0.5) / 32]
    error = moving - np.mean(still, 0)
    assert np.abs(error).mean() <= 0.004
    assert np.abs(error).max() <= 0.06


def lit(integrator, material, light):
    camera = scene.look([0.5, 1.0, 4], [0, 0, 0], fov=35)
    return scene.build(32, 32, 256, [scene.sphere()], materials={"white": material}, camera=camera,
                       lights=[light], integrator=integrator)


PAINTS = {
    "plastic": {"roughness": 0.5},
    "metal": {"metallic": 1, "roughness": 0.4},
    "coated": {"roughness": 0.8, "clearcoat": 1, "clearcoat_roughness": 0.3},
    "glow": {"roughness": 0.6, "emission": [0.2, 0.3, 0.4]},
}


@pytest.mark.parametrize("paint", PAINTS)
def test_integrators_agree_on_a_lone_body(draw, paint):
    """Broken by an integrator that loses a lobe of principled, counts one twice or forgets emission:
    alone, lit by one light, a convex body looks the same to distribution and path."""
    material = {"type": "principled", "base_color": [0.8, 0.6, 0.4], **PAINTS[paint]}
    light = scene.panel([-2, 3, 1], [1, 0, 0], [0, 0, 1], 20)
    texels = checkerboard(8, 4)
    images = [draw(lit(integrator, material, light), texels)
              for integrator in ("distribution", "path")]

    assert images[0].mean() >= 0.01
    assert abs(images[0].mean() / images[1].mean() - 1) <= 0.01
    assert np.abs(images[0] - images[1]).mean() <= 0.01 * images[0].mean() + 0.002
