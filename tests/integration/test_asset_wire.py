# SPDX-License-Identifier: Apache-2.0
"""Assets on their way from the coordinator to the scene processes of its workers."""
import hashlib
import os
import signal
import struct
import zlib

import image
import pytest
from farm import Farm, wait_for
from glb import glb, triangle


def png(side, pixel):
    """A square PNG; pixel(x, y) is its red, green and blue."""
    rows = b"".join(b"\0" + bytes(c for x in range(side) for c in pixel(x, y)) for y in range(side))

    def chunk(kind, data):
        return (struct.pack(">I", len(data)) + kind + data +
                struct.pack(">I", zlib.crc32(kind + data)))

    header = struct.pack(">IIBBBBB", side, side, 8, 2, 0, 0, 0)
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows)) +
            chunk(b"IEND", b""))


def put(farm, data):
    name = hashlib.sha256(data).hexdigest()
    assert farm.request("PUT", f"/v1/assets/sha256/{name}", data).status in (200, 201)
    return f"sha256:{name}"


CHECKS = png(64, lambda x, y: (255, 40, 40) if (x // 8 + y // 8) % 2 else (40, 40, 255))
MODEL = glb(*triangle({"doubleSided": True, "pbrMetallicRoughness": {
    "baseColorFactor": [0.2, 0.8, 0.2, 1], "metallicFactor": 0}}))


def scene(farm, **more):
    """A triangle of a GLB over a floor with a picture, seen from the front."""
    return {
        "version": 1, "image": {"width": 96, "height": 64}, "sampling": {"samples": 16},
        "camera": {"position": [0, 0.5, 4], "look_at": [0, 0, 0]},
        "background": {"color": [0.7, 0.7, 0.7]},
        "textures": {"checks": {"image": put(farm, CHECKS)}},
        "materials": {"floor": {"type": "matte", "color": {"texture": "checks"}}},
        "objects": [
            {"type": "gltf", "asset": put(farm, MODEL)},
            {"type": "mesh", "material": "floor", "indices": [0, 1, 2, 0, 2, 3],
             "vertices": [[-3, -1, 3], [3, -1, 3], [3, -1, -3], [-3, -1, -3]],
             "uvs": [[0, 1], [1, 1], [1, 0], [0, 0]]}], **more}


@pytest.fixture(scope="module")
def expected():
    with Farm(processes=1) as farm:
        return image.read(farm.render(scene(farm)))


def test_the_picture_shows_what_is_in_the_assets(expected):
    """Breaks when an asset is given to another object, or not at all."""
    height, width = expected.shape[:2]
    triangle_pixel = expected[height // 2 + 4, width // 2]
    assert triangle_pixel[1] > 2 * triangle_pixel[0], "the triangle is green"
    floor = expected[int(height * 0.8):, :, :3].reshape(-1, 3)
    assert (floor[:, 0] > 2 * floor[:, 2]).any() and (floor[:, 2] > 2 * floor[:, 0]).any()


def test_two_workers_give_the_same_bits(expected):
    """Breaks when a worker builds from anything but the asset's bytes."""
    with Farm(processes=0) as farm:
        for _ in range(2):
            farm.connect_worker(1)
        wait_for(lambda: len(farm.get("/v1/workers")["workers"]) == 2, 10, "both workers")
        found = image.read(farm.render(scene(farm)))
        assert (found == expected).all()


def test_a_second_scene_takes_the_assets_from_the_worker(expected):
    """Breaks when a worker fetches again what it has: the file is gone by then."""
    with Farm(processes=1) as farm:
        farm.render(scene(farm))
        again = scene(farm, integrator={"type": "distribution", "max_depth": 7})
        for name in os.listdir(farm.data / "assets"):
            os.truncate(farm.data / "assets" / name, 0)
        assert (image.read(farm.render(again)) == expected).all()


def test_a_worker_killed_while_it_fetches_costs_nothing(expected):
    """Breaks when half an asset is kept, or a lost fetch is waited for."""
    with Farm(processes=0) as farm:
        worker = farm.connect_worker(1)
        wait_for(lambda: farm.get("/v1/workers")["workers"], 10, "the worker")
        ballast = png(512, lambda x, y: ((x * y) & 255, x & 255, y & 255))
        wanted = scene(farm)
        wanted["textures"]["ballast"] = {"image": put(farm, ballast)}
        render = farm.submit(wanted)
        worker.send_signal(signal.SIGKILL)
        worker.wait(timeout=10)
        farm.remote.remove(worker)
        farm.connect_worker(1)
        farm.wait(render)
        assert (image.read(farm.image(render)) == expected).all()


def test_the_coordinator_restarts_while_a_worker_fetches(expected):
    """Breaks when a worker waits for ever for what an earlier connection was to bring."""
    with Farm(processes=1) as farm:
        render = farm.submit(scene(farm))
        farm.kill()
        farm.start()
        farm.wait(render)
        assert (image.read(farm.image(render)) == expected).all()


def test_what_only_the_asset_shows_ends_the_render(farm_of_one):
    """Breaks when a broken asset is rendered as nothing, or crashes what reads it."""
    for data in (b"", b"glTF", MODEL[:-30], b"x" * 1000):
        wanted = scene(farm_of_one)
        wanted["objects"][0]["asset"] = put(farm_of_one, data)
        found = farm_of_one.wait(farm_of_one.submit(wanted), state="failed")
        assert "/objects/0" in found["error"], found["error"]
    wanted = scene(farm_of_one)
    wanted["textures"]["checks"]["image"] = put(farm_of_one, CHECKS[:100])
    found = farm_of_one.wait(farm_of_one.submit(wanted), state="failed")
    assert "/textures/checks" in found["error"], found["error"]


def test_an_asset_that_has_gone_is_named(farm_of_one):
    """Breaks when a render waits without end for a file that nobody has."""
    wanted = scene(farm_of_one)
    wanted["textures"]["gone"] = {"image": put(farm_of_one, png(4, lambda x, y: (9, 9, 9)))}
    name = wanted["textures"]["gone"]["image"].removeprefix("sha256:")
    blocker = farm_of_one.submit({"version": 1, "image": {"width": 640, "height": 640},
                                  "sampling": {"samples": 65536}})
    render = farm_of_one.submit(wanted)
    os.unlink(farm_of_one.data / "assets" / name)
    farm_of_one.patch(blocker, {"state": "cancelled"})
    found = farm_of_one.wait(render, state="failed")
    assert name in found["error"], found["error"]


def test_many_assets_arrive(farm_of_one):
    """Breaks when there are more than one message, one window or one table holds."""
    wanted = scene(farm_of_one)
    for i in range(100):
        wanted["textures"][f"t{i}"] = {
            "image": put(farm_of_one, png(2, lambda x, y, i=i: (i, x, y)))}
    farm_of_one.wait(farm_of_one.submit(wanted))


@pytest.fixture(scope="module")
def farm_of_one():
    with Farm(processes=1) as farm:
        yield farm
