# SPDX-License-Identifier: Apache-2.0
"""Animations: frames one by one, the same bits whatever happens, files of their own."""
import importlib.util
import json
import subprocess

import farm
import image
import numpy as np
import pytest
import scene

FRAMES = 12

_spec = importlib.util.spec_from_file_location(
    "animation_bench", farm.ROOT / "tests/bench/animation.py")
animation_bench = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(animation_bench)


def animation(samples=4, last=FRAMES, **more):
    """A bar that moves as a rigid mesh, a sphere that travels, a floor that rests."""
    bar = {"type": "mesh", "material": "red", "indices": [0, 1, 2, 0, 1, 3, 1, 2, 3, 2, 0, 3],
           "vertices": [[-1, 0.5, 0], [1, 0.5, 0], [0, 2, 0], [0, 1, 1]],
           "keyframes": [{"time": 0, "translate": [-2, 0, 0], "rotate": [0, 0, 0, 1]},
                         {"time": 1, "translate": [2, 0, 0], "rotate": [0, 0.6, 0, 0.8]}]}
    ball = {"type": "sphere", "material": "red", "center": [0, 0, 0], "radius": 0.5,
            "keyframes": [{"time": 0, "translate": [2, 1, 0]},
                          {"time": 1, "translate": [-2, 1, 2]}]}
    return {"version": 1, "image": {"width": 96, "height": 64}, "sampling": {"samples": samples},
            "camera": {"position": [0, 2, 8], "look_at": [0, 1, 0],
                       "shutter": {"open": 0, "close": 0.02}},
            "background": {"color": [0.5, 0.6, 0.7]},
            "materials": {"red": {"type": "matte", "color": [0.8, 0.3, 0.2]}},
            "objects": [bar, ball, scene.floor() | {"material": "red"}],
            "frames": {"first": 1, "last": last, "fps": 24}} | more


def frames_of(service, render):
    answers = [service.request("GET", f"/v1/renders/{render}/frames/{n}.exr")
               for n in range(1, FRAMES + 1)]
    assert [answer.status for answer in answers] == [200] * FRAMES
    return [answer.body for answer in answers]


@pytest.fixture
def service():
    with farm.Farm(2, "--tile", 16) as running:
        yield running


def test_frames_differ_and_stand_alone(service):
    """Broken by a shutter that is not relative to the frame, or a frame that depends on the range.

    The objects of this scene move through every shutter, so that a frame alone is laid out like
    one of many.
    """
    render = service.submit(animation())
    service.wait(render)
    frames = frames_of(service, render)
    assert len(set(frames)) == FRAMES
    assert service.request("GET", f"/v1/renders/{render}/image.exr").body == frames[-1]
    assert service.request("GET", f"/v1/renders/{render}/frames/13.png").status == 404
    alone = service.submit(animation() | {"frames": {"first": 7, "last": 7, "fps": 24}})
    service.wait(alone)
    # The files name their renders' content, which is not the same.
    seventh = service.request("GET", f"/v1/renders/{alone}/frames/7.exr").body
    assert np.array_equal(image.read(seventh), image.read(frames[6]))


def test_frames_are_served_while_later_ones_render(service):
    """Broken by frames that are shown only in the end, or change after they were done."""
    render = service.submit(animation(600))
    farm.wait_for(lambda: service.resource(render)["frames"]["done"] > 0, 60, "a frame")
    early = service.request("GET", f"/v1/renders/{render}/frames/1.exr")
    assert service.resource(render)["frames"]["done"] < FRAMES
    assert "immutable" in early.headers["Cache-Control"]
    service.wait(render, 120)
    assert frames_of(service, render)[0] == early.body


def test_a_killed_coordinator_goes_on_with_the_same_bits(service):
    """Broken by a resumption that loses or mixes frames."""
    body = animation(300)
    render = service.submit(body)
    service.wait(render, 120)
    undisturbed = frames_of(service, render)
    render = service.submit(body)
    service.wait_progress(render, 0.4)
    service.kill()
    service.start()
    service.wait(render, 120)
    assert frames_of(service, render) == undisturbed
    assert service.request("DELETE", f"/v1/renders/{render}").status == 204


def test_numbered_files(tmp_path):
    """Broken by a command that writes other names, or every frame over the last."""
    path = tmp_path / "scene.json"
    path.write_text(json.dumps(animation()))
    command = [farm.program("penumbra"), "render", str(path), "--processes", "2", "--quiet"]
    run = subprocess.run([*command, "-o", str(tmp_path / "out.####.png"), "--frames", "3-5"],
                         capture_output=True, text=True, timeout=60)
    assert run.returncode == 0, run.stderr
    assert sorted(p.name for p in tmp_path.glob("*.png")) == [
        "out.0003.png", "out.0004.png", "out.0005.png"]
    run = subprocess.run([*command, "-o", str(tmp_path / "one.png")], capture_output=True,
                         text=True, timeout=60)
    assert run.returncode == 1 and "####" in run.stderr
    assert not (tmp_path / "one.png").exists()


def test_frames_cost_little_beside_their_tiles():
    """Broken by loading the scene anew for frames. A frame's own cost is a few ms; see the bench."""
    overhead, _ = animation_bench.overhead_ms(48)
    assert overhead < 60 * farm.SLOW
