# SPDX-License-Identifier: Apache-2.0
"""Kept scenes, and the views that are posted of them: overrides, previews, deadlines."""
import hashlib
import json
import os
import signal
import time

import farm
import image
import numpy as np
import pytest
import scene
from http_server import JSON, Server, problem

SCENE = scene.build(32, 16, 4, [scene.sphere()], background=0.5)
# So much that it is not done while a test runs.
LONG = {"image": {"width": 512, "height": 512}, "sampling": {"samples": 65536}}


def named(body):
    """The text of a scene, and its name."""
    text = json.dumps(body).encode()
    return text, hashlib.sha256(text).hexdigest()


@pytest.fixture(scope="module")
def server():
    with Server() as running:
        yield running


@pytest.fixture(scope="module")
def service():
    with farm.Farm(processes=1) as running:
        yield running


def keep(ask, body, expected=201):
    text, name = named(body)
    answer = ask("PUT", f"/v1/scenes/sha256/{name}", text, JSON)
    assert answer.status == expected, answer.body
    return f"sha256:{name}"


def refused(server, envelope, pointer):
    """The details of what is wrong at pointer, which must be told."""
    found = problem(server.post(envelope), 400)
    return next(e["detail"] for e in found["errors"] if e["pointer"] == pointer)


def test_a_scene_is_kept_as_it_was_sent(server):
    """Breaks if the text is written anew: then its hash is another, and nobody finds it."""
    text, name = named({**SCENE, "sampling": {"samples": 7}})
    path = f"/v1/scenes/sha256/{name}"
    problem(server.get(path), 404)
    assert server.ask("HEAD", path).status == 404
    assert server.ask("PUT", path, text, JSON).status == 201
    assert server.ask("PUT", path, text, JSON).status == 200
    assert server.ask("HEAD", path).status == 200
    assert server.get(path).body == text


def test_what_is_no_scene_is_not_kept(server):
    """Breaks if a fault is found only when a view is posted, by somebody else maybe."""
    text, name = named(SCENE)
    problem(server.ask("PUT", f"/v1/scenes/sha256/{'0' * 64}", text, JSON), 422)
    problem(server.ask("PUT", f"/v1/scenes/sha256/{name[:-1]}", text, JSON), 404)
    for body, pointer in [({**SCENE, "colour": 1}, "/colour"), ({"version": 1}, "/image")]:
        text, name = named(body)
        found = problem(server.ask("PUT", f"/v1/scenes/sha256/{name}", text, JSON), 400)
        assert pointer in [e["pointer"] for e in found["errors"]]
        assert server.ask("HEAD", f"/v1/scenes/sha256/{name}").status == 404
    text = b'{"version": 1,'
    name = hashlib.sha256(text).hexdigest()
    problem(server.ask("PUT", f"/v1/scenes/sha256/{name}", text, JSON), 400)


def test_a_name_of_nothing_is_told(server):
    assert "PUT it" in refused(server, {"scene": "sha256:" + "0" * 64}, "/scene")
    assert "64 hex digits" in refused(server, {"scene": "sha256:0"}, "/scene")
    name = keep(server.ask, {**SCENE, "background": {"color": [0, 0, 1]}})
    found = problem(server.post({"scene": name, "override": {"camera": {"zoom": 1}}}), 400)
    assert [e["pointer"] for e in found["errors"]] == ["/scene/camera/zoom"]


@pytest.mark.parametrize("options, pointer", [
    ({"preview": 1}, "/options/preview"), ({"replaces": "short"}, "/options/replaces"),
    ({"replaces": None}, "/options/replaces"), ({"deadline_s": 0}, "/options/deadline_s"),
    ({"deadline_s": "1"}, "/options/deadline_s"), ({"deadline_s": 31536001}, "/options/deadline_s"),
    ({"verify": "fully"}, "/options/verify"), ({"verfy": "none"}, "/options/verfy")])
def test_options_that_make_no_sense_are_named(server, options, pointer):
    refused(server, {"scene": SCENE, "options": options}, pointer)


def test_a_view_is_the_scene_with_its_override(service):
    """Breaks if the kept tree is changed by a view, or by the defaults that reading fills in: then
    the next view of it is another image."""
    name = keep(service.request, SCENE)
    camera = {"position": [0, 1, 6]}
    plain = service.render(SCENE)
    merged = {**SCENE, "camera": {**SCENE["camera"], **camera}}
    expected = service.render(merged)
    assert plain != expected
    for _ in range(2):
        assert service.render({"scene": name, "override": {"camera": camera}}) == expected
        assert service.render({"scene": name}) == plain
    edge = {"scene": name, "override": {"sampling": {"mode": "edge", "samples": 16}}}
    assert service.render(edge)


def test_a_render_tells_its_scene(service):
    """Breaks if the text is another than the one that was rendered: it is a scene, with what was
    overridden, and renders to the same image."""
    render = service.submit({"scene": SCENE, "override": {"camera": {"position": [0, 1, 6]}}})
    service.wait(render)
    answer = service.request("GET", f"/v1/renders/{render}/scene")
    told = json.loads(answer.body)
    assert answer.headers["ETag"].strip('"') == hashlib.sha256(answer.body).hexdigest()
    assert told["camera"]["position"] == [0, 1, 6] and told["camera"]["horizontal_fov"] > 0
    assert service.render(told) == service.image(render)
    preview = service.submit({"scene": {**SCENE, "background": {"color": [1, 0, 0]}}, "options": {"preview": True}})
    service.wait(preview)
    problem(service.request("GET", f"/v1/renders/{preview}/scene"), 404)
    problem(service.request("GET", f"/v1/renders/{'a' * 26}/scene"), 404)


def test_kept_scenes_are_there_after_a_restart(tmp_path):
    with farm.Farm(1, data=tmp_path / "data") as service:
        name = keep(service.request, SCENE)
        first = service.render({"scene": name})
        service.stop()
        service.start()
        assert keep(service.request, SCENE, 200) == name
        assert service.render({"scene": name}) == first


def test_a_preview_is_an_image_and_does_not_outlive_the_service(tmp_path):
    """Breaks if previews fill the store, or are other images than renders are."""
    with farm.Farm(1, data=tmp_path / "data") as service:
        expected = service.render(SCENE)
        preview = service.submit({"scene": SCENE, "options": {"preview": True}})
        assert service.wait(preview)["preview"] is True
        assert service.image(preview) == expected
        running = service.submit({"scene": SCENE, "override": LONG, "options": {"preview": True}})
        service.wait_progress(running)
        scenes = list((tmp_path / "data/scenes").iterdir())
        assert len(scenes) == 1
        service.stop()
        service.start()
        for gone in [preview, running]:
            assert service.request("GET", f"/v1/renders/{gone}").status == 404
        assert len(list((tmp_path / "data/frames").iterdir())) == 1
        assert len(service.get("/v1/renders")["renders"]) == 1


def test_only_the_last_previews_are_kept(service):
    """Breaks if an hour of turning a view round fills the disk."""
    tiny = scene.build(16, 16, 1, [scene.sphere()])
    first = service.submit({"scene": tiny, "options": {"preview": True}})
    service.wait(first)
    for _ in range(64):
        last = service.submit({"scene": tiny, "options": {"preview": True}})
        service.wait(last)
    assert service.request("GET", f"/v1/renders/{first}").status == 404
    assert not list((service.data / "frames").glob(f"{first}*"))
    assert service.image(last)
    assert service.request("DELETE", f"/v1/renders/{last}").status == 204
    assert service.request("GET", f"/v1/renders/{last}").status == 410
    service.wait(service.submit({"scene": tiny, "options": {"preview": True}}))


@pytest.mark.parametrize("preview", [False, True])
def test_a_view_cancels_the_one_that_it_replaces(service, preview):
    """Breaks if the earlier view goes on being rendered: then an orbit falls ever further behind."""
    view = {"scene": SCENE, "override": LONG, "options": {"preview": preview}}
    earlier = service.submit(view)
    service.wait_progress(earlier)
    start = time.monotonic()
    later = service.submit({"scene": SCENE,
                            "options": {"preview": preview, "replaces": earlier}})
    assert service.wait(earlier, state="cancelled")
    service.wait(later)
    assert time.monotonic() - start < 2 * farm.SLOW
    again = service.submit({"scene": SCENE, "options": {"replaces": earlier}})
    service.wait(again)
    service.wait(service.submit({"scene": SCENE, "options": {"replaces": "a" * 26}}))


@pytest.mark.parametrize("preview", [False, True])
def test_a_render_that_is_not_done_by_its_deadline_fails(service, preview):
    """Breaks if it fails too early, too late, or goes on being rendered."""
    options = {"deadline_s": 1, "preview": preview}
    start = time.monotonic()
    late = service.submit({"scene": SCENE, "override": LONG, "options": options})
    found = service.wait(late, 10, "failed")
    assert 0.9 < time.monotonic() - start < 3 * farm.SLOW
    assert "deadline" in found["error"] and found["deadline"] > found["created"]
    assert service.image(late)
    early = service.submit({"scene": SCENE, "options": {"deadline_s": 60}})
    assert service.wait(early)["state"] == "done"
    farm.wait_for(lambda: service.get("/v1/farm")["queue_depth"] == 0, 5, "an idle farm")


def test_a_deadline_holds_over_a_restart_and_a_pause(tmp_path):
    with farm.Farm(1, data=tmp_path / "data") as service:
        late = service.submit({"scene": SCENE, "override": LONG, "options": {"deadline_s": 2}})
        deadline = service.resource(late)["deadline"]
        service.patch(late, {"state": "paused"})
        service.stop()
        service.start()
        assert service.resource(late)["deadline"] == deadline
        assert "deadline" in service.wait(late, 10, "failed")["error"]


def pixels(service, render, frame=1):
    answer = service.request("GET", f"/v1/renders/{render}/frames/{frame}.exr")
    assert answer.status == 200, answer.body
    return image.read(answer.body)


TEXTURED = {
    **scene.build(48, 32, 4, [
        scene.sphere([0, 0, 0], 1, "coat", keyframes=scene.motion([0, 0, 0], [0.5, 0, 0])),
        scene.floor(4, -1, "white", uvs=[[0, 0], [1, 0], [1, 1], [0, 1]])],
        background=0.3, materials={"coat": {"type": "principled", "base_color": [0.8, 0.2, 0.1]},
                                   "white": scene.matte(0.7)},
        lights=[scene.panel([-1, 3, 1], [2, 0, 0], [0, 0, -2], 5)]),
    "camera": {**scene.look([0, 1, 5], [0, 0, 0]), "shutter": {"open": 0, "close": 0.5}}}
LOOKS = [
    {"camera": {"position": [3, 1, 4]}}, {"camera": {"horizontal_fov": 20}},
    {"camera": {"aperture_radius": 0.3, "focus_distance": 5, "blades": 5}},
    {"camera": {"keyframes": [{"time": 0, "position": [0, 1, 5], "look_at": [0, 0, 0]},
                              {"time": 1, "position": [2, 1, 5], "look_at": [0, 0, 0]}]}},
    {"image": {"width": 40, "height": 50, "crop": [3, 5, 30, 41]}},
    {"image": {"filter": {"type": "gaussian", "width": 2.5}, "aovs": ["albedo", "depth"]}},
    {"sampling": {"samples": 33, "seed": 5}}, {"sampling": {"mode": "edge", "samples": 16}},
    {"camera": {"shutter": {"open": 0, "close": 0.1}}}, {"integrator": {"max_depth": 2}}]


@pytest.mark.parametrize("frames", [None, {"first": 1, "last": 3}])
def test_another_view_has_the_bits_of_a_scene_of_its_own(frames):
    """Breaks if a view that takes over a built scene keeps anything of the view before: camera,
    filter, samples, layers; or if it takes over one that differs in more than its view."""
    body = {**TEXTURED, **({"frames": frames} if frames else {})}
    other = {**body, "materials": {**body["materials"], "unused": scene.matte(0.5)}}
    last = frames["last"] if frames else 1
    with farm.Farm(1) as service, farm.Farm(1) as fresh:
        for look in [{}, *LOOKS, {}]:
            ids = [(at, at.submit({"scene": of, "override": look}))
                   for at, of in [(service, body), (fresh, other)]]
            for at, render in ids:
                at.wait(render)
            for frame in range(1, last + 1):
                shown, alone = (pixels(at, render, frame) for at, render in ids)
                assert np.array_equal(shown, alone), look
            # The other farm forgets the scene, so that it builds each view anew.
            for number in range(8):
                fresh.wait(fresh.submit(scene.build(16, 16, 1, [scene.sphere([0, 0, number])])))


def test_a_view_takes_over_the_process_of_the_one_before(service):
    """Breaks if each step about a scene builds it again, or ends the work of somebody else."""
    pool = service.pools()[0]
    first = service.submit({"scene": SCENE, "override": {"camera": {"position": [0, 0, 9]}}})
    service.wait(first)
    farm.wait_for(lambda: len(pool.scenes()) >= 2, 5, "a spare scene process")
    before = set(pool.scenes())
    for step in range(10):
        service.wait(service.submit({"scene": SCENE, "override": {"camera": {"position": [0, step, 8]}}}))
    assert set(pool.scenes()) == before
    running = service.submit({"scene": SCENE, "override": LONG})
    service.wait_progress(running)
    service.wait(service.submit({"scene": SCENE, "override": {"camera": {"position": [1, 1, 7]}}}))
    assert service.resource(running)["state"] == "running"
    farm.wait_for(lambda: len(pool.scenes()) > len(before), 5, "a scene process of its own")
    service.patch(running, {"state": "cancelled"})


def test_a_process_that_dies_at_a_view_is_made_anew(service):
    """Breaks if a taken-over process that ends leaves the view waiting for ever."""
    service.wait(service.submit({"scene": SCENE, "override": {"camera": {"position": [0, 0, 3]}}}))
    pool = service.pools()[0]
    stopped = pool.scenes() + pool.renders()
    for pid in stopped:
        os.kill(pid, signal.SIGSTOP)
    view = service.submit({"scene": SCENE, "override": {"camera": {"position": [0, 0, 4]}}})
    farm.wait_for(lambda: service.get("/v1/workers")["workers"][0]["leases"] > 0, 5, "a lease")
    for pid in stopped:
        os.kill(pid, signal.SIGKILL)
    service.wait(view)
