# SPDX-License-Identifier: Apache-2.0
"""The image is a function of the request: the same bits however it was rendered.

One odd-sized scene with everything that could tell (moving balls, turning instances, meshes that
coincide, a lens, glass and gloss) is rendered with 1 and 3 render processes, three tile sizes, and
with render processes killed, and the float pixels and the files are compared byte by byte. In the
modes that decide on the way which pixels go on, the coordinator is killed too.
"""
import contextlib
import os
import signal
import threading
import time

import farm
import image
import numpy as np
import pytest
import scene

WIDTH, HEIGHT = 173, 131

MODES = {
    "edge": {"mode": "edge", "samples": 40, "threshold": 0.15},
    "adaptive": {"mode": "adaptive", "samples": 300, "min_samples": 16, "error": 0.02},
    "interleaved": {"mode": "interleaved", "samples": 20, "pattern": 3},
}


def instance(angle, position):
    turn = [0, np.sin(np.radians(angle / 2)), 0, np.cos(np.radians(angle / 2))]
    return {"type": "instance", "of": "block", "material": "red",
            "keyframes": scene.motion({"translate": position, "rotate": [0, 0, 0, 1]},
                                      {"translate": position, "rotate": turn})}


def subject(samples, **image_keys):
    tie = {"vertices": [[-3, 0.5, -2], [3, 0.5, -2], [3, 2.5, -2], [-3, 2.5, -2]],
           "indices": [0, 1, 2, 0, 2, 3], "type": "mesh"}
    objects = [
        scene.floor(half=30, material="grey"),
        {**tie, "material": "red"},
        {**tie, "material": "grey"},
        scene.box(0.4, "red", name="block", visible=False),
        instance(100, [-1.6, 0.6, 0.5]),
        instance(-60, [1.7, 0.6, 0.2]),
        scene.sphere([0, 0, 0], 0.6, "clear",
                     keyframes=scene.motion([-0.4, 0.6, 1], [0.3, 0.8, 1.2])),
        scene.sphere([0, 0, 0], 0.5, "satin",
                     keyframes=scene.motion([0.6, 0.5, -1], [1.0, 0.5, -1])),
    ]
    body = scene.build(
        WIDTH, HEIGHT, samples, objects, background=0.4, integrator="path",
        camera=scene.look([0.3, 1.8, 6], [0, 0.8, 0], fov=45, aperture_radius=0.12,
                          focus_distance=5.4, shutter={"open": 0, "close": 1}),
        materials={"grey": scene.matte(0.6), "satin": scene.glossy(0.3, 0.8),
                   "clear": scene.glass(0.1), "red": {"type": "matte", "color": [0.7, 0.1, 0.1]}},
        lights=[scene.panel([-2, 4, 1], [2, 0, 0], [0, 0, 2], 9),
                {"type": "triangle", "vertices": [[2, 3, 0], [3.5, 3, -0.5], [3, 3, 1.5]],
                 "radiance": [6, 7, 9]}])
    body["image"].update(filter={"type": "gaussian", "width": 3}, **image_keys)
    return body


def files(service, body, seconds=60):
    """The image in all four formats, by extension."""
    render = service.submit(body)
    service.wait(render, seconds)
    return {kind: service.image(render, kind) for kind in ("exr", "png", "hdr", "jpg")}


def assert_same(found, wanted):
    """The same floats first, which says more when it fails, then the same files."""
    ours, theirs = image.read(found["exr"]), image.read(wanted["exr"])
    assert ours.shape == theirs.shape
    differing = int((ours.view(np.uint32) != theirs.view(np.uint32)).any(axis=2).sum())
    assert differing == 0, f"{differing} of {ours.shape[0] * ours.shape[1]} pixels differ"
    for extension in wanted:
        assert found[extension] == wanted[extension], f"the {extension} files differ"


@pytest.fixture(scope="module")
def wanted():
    """One render process, tiles of 64."""
    with farm.Farm(1, "--tile", 64) as service:
        return {samples: files(service, subject(samples)) for samples in (5, 64)}


@pytest.mark.parametrize("tile", [16, 48, 64])
@pytest.mark.parametrize("processes", [1, 3])
def test_tiles_and_processes(wanted, processes, tile):
    """Broken by state carried from pixel to pixel, and by sums whose order depends on who adds."""
    with farm.Farm(processes, "--tile", tile) as service:
        for samples in (64, 5):
            assert_same(files(service, subject(samples)), wanted[samples])


def sampled(mode):
    body = subject(1)
    body["sampling"] = MODES[mode]
    return body


@pytest.fixture(scope="module")
def decided():
    """Of each mode, with one render process and tiles of 64."""
    with farm.Farm(1, "--tile", 64) as service:
        return {mode: files(service, sampled(mode)) for mode in MODES}


@pytest.mark.parametrize("tile", [16, 48])
@pytest.mark.parametrize("processes", [1, 3])
def test_modes(decided, processes, tile):
    """Broken by a decision that sees a tile's border, or sums that are not complete."""
    with farm.Farm(processes, "--tile", tile) as service:
        for mode in MODES:
            assert_same(files(service, sampled(mode)), decided[mode])


@contextlib.contextmanager
def killer(service, every=0.2):
    """Kills a render process (SIGKILL) at once and then every 200 ms; yields the times."""
    kills, over = [], threading.Event()

    def run():
        while not over.is_set():
            renders = service.renders()
            if renders:
                victim = renders[len(kills) % len(renders)]
                with contextlib.suppress(ProcessLookupError):
                    os.kill(victim, signal.SIGKILL)
                    kills.append(time.monotonic())
            over.wait(every if renders else 0.002)

    thread = threading.Thread(target=run)
    thread.start()
    try:
        yield kills
    finally:
        over.set()
        thread.join()


@pytest.mark.parametrize("samples", [5, 64])
def test_killed_processes(wanted, samples):
    """Broken by a unit that is lost, counted twice, or half merged when its process dies."""
    with farm.Farm(3, "--tile", 16) as service:
        with killer(service) as kills:
            found = files(service, subject(samples))
        assert kills, "no render process was there to be killed"
        assert_same(found, wanted[samples])


@pytest.mark.parametrize("mode", MODES)
def test_modes_and_killed_processes(decided, mode):
    """The same while render processes die: broken by a pixel that joins a round twice."""
    with farm.Farm(3, "--tile", 16) as service:
        with killer(service) as kills:
            found = files(service, sampled(mode))
        assert kills, "no render process was there to be killed"
        assert_same(found, decided[mode])


@pytest.mark.parametrize("mode", ["edge", "adaptive"])
def test_modes_and_killed_coordinators(decided, mode):
    """Broken by masks that are lost with the coordinator, or differ after it has come back."""
    with farm.Farm(2, "--tile", 16) as service:
        for share in (0, 0.1, 0.3, 0.5, 0.7, 0.9):
            render = service.submit(sampled(mode))
            farm.wait_for(lambda: service.resource(render)["progress"] > share, 30, "progress")
            service.kill()
            service.start()
            service.wait(render)
            assert_same({"exr": service.image(render)}, {"exr": decided[mode]["exr"]})


def test_killed_processes_for_seconds():
    """The same over a longer render, so that many units and their retries are hit."""
    body = subject(300)
    with farm.Farm(2, "--tile", 16) as service:
        undisturbed = files(service, body, 120)
        with killer(service) as kills:
            begin = time.monotonic()
            found = files(service, body, 240)
        assert len([k for k in kills if k > begin]) >= 5
        assert_same(found, undisturbed)


@pytest.mark.parametrize("crop", [[0, 0, 173, 1], [17, 31, 100, 90], [160, 120, 173, 131]], ids=str)
def test_crop(wanted, crop):
    """Broken by samples that are numbered from the crop's corner instead of the image's."""
    left, top, right, bottom = crop
    with farm.Farm(2, "--tile", 48) as service:
        found = image.read(service.render(subject(64, crop=crop)))
    whole = image.read(wanted[64]["exr"])[top:bottom, left:right]
    assert found.shape == whole.shape and found.tobytes() == np.ascontiguousarray(whole).tobytes()


def test_repeats_in_each_instruction_set(wanted):
    """Broken by a kernel of one instruction set whose lanes depend on their neighbours.

    Sets differ from each other in last bits, which is why a job stays in one class.
    """
    flags = next(line for line in open("/proc/cpuinfo") if line.startswith("flags")).split()
    sets = ["v2"] + ["v3"] * ("avx2" in flags) + ["v4"] * ("avx512vl" in flags)
    for name in sets:
        results = []
        for processes, tile in ((1, 64), (3, 16)):
            with farm.Farm(processes, "--tile", tile, "--isa", name) as service:
                found = {samples: files(service, subject(samples)) for samples in (5, 64)}
                assert name in service.get("/v1/workers")["workers"][0]["class"]
                results.append(found)
        for samples in (5, 64):
            assert_same(results[1][samples], results[0][samples])
            ours, theirs = (image.read(f[samples]["exr"]) for f in (results[0], wanted))
            assert np.median(np.abs(ours - theirs)) < 1e-4


def test_seed_matters(wanted):
    """Broken by a comparison that cannot fail: another seed must give other pixels."""
    with farm.Farm(1) as service:
        body = subject(64)
        body["sampling"]["seed"] = 1
        assert service.render(body) != wanted[64]["exr"]
