# SPDX-License-Identifier: Apache-2.0
"""What a coordinator knows after it was killed."""
import json
import os
import sqlite3
import time

import farm
import pytest
import scene


def small(samples=4, **more):
    return scene.build(70, 50, samples, [scene.sphere()], background=0.5, **more)


def long(samples=3000):
    return scene.build(128, 96, samples, [scene.floor(), scene.sphere([0, 1, 0])],
                       camera=scene.look([0, 2, 7], [0, 1, 0]), background=0.5)


@pytest.fixture
def service():
    with farm.Farm(2, "--tile", 16) as running:
        yield running


def restart(service):
    service.kill()
    service.start()


def frame(service, render):
    return service.data / "frames" / f"{render}.f32"


def test_damaged_tiles_are_rendered_again(service):
    """Broken by trusting the bytes of a framebuffer, or by starting all of it again."""
    body = long(600)
    undisturbed = service.render(body, 120)
    render = service.submit(body)
    service.wait_progress(render, 0.5)
    service.kill()
    with open(frame(service, render), "r+b") as file:
        for tile in range(0, 48, 5):
            file.seek(tile * 16 * 16 * 16 + 100)
            file.write(b"\x00\x01\x02\x03")
    service.start()
    resumed = farm.wait_for(lambda: service.resource(render)["samples_done"], 20, "resumption")
    assert resumed > 0
    service.wait(render, 120)
    assert service.image(render) == undisturbed


def test_a_lost_framebuffer_is_rendered_again(service):
    """Broken by a resumption that needs the file."""
    body = long()
    undisturbed = service.render(body, 120)
    render = service.submit(body)
    service.wait_progress(render, 0.1)
    service.kill()
    frame(service, render).unlink()
    service.start()
    service.wait(render, 120)
    assert service.image(render) == undisturbed


def test_all_accepted_renders_are_done(service):
    """Broken by an answer that comes before the render is on the disk."""
    bodies = [small(seed=seed) for seed in range(30)]
    renders = [service.submit(body) for body in bodies]
    restart(service)
    for render in renders:
        service.wait(render, 60)
    listed = [r["id"] for r in service.get("/v1/renders?limit=100")["renders"]]
    assert listed == renders[::-1]


def test_paused_and_cancelled_stay_so(service):
    """Broken by a resumption of everything, or by a partial image that gets lost."""
    paused, cancelled = service.submit(long()), service.submit(long(3001))
    service.wait_progress(cancelled, 0.01)
    service.wait_progress(paused, 0.01)
    assert service.patch(paused, {"state": "paused"}).status == 200
    assert service.patch(cancelled, {"state": "cancelled"}).status == 200
    done = service.resource(cancelled)["samples_done"]
    restart(service)
    assert service.resource(paused)["state"] == "paused"
    found = service.resource(cancelled)
    assert found["state"] == "cancelled" and found["samples_done"] == done
    assert service.image(cancelled, "png")
    assert service.patch(paused, {"state": "running"}).status == 200
    merged = service.resource(paused)["samples_done"]
    farm.wait_for(lambda: service.resource(paused)["samples_done"] > merged, 20, "progress")
    assert service.request("DELETE", f"/v1/renders/{paused}").status == 204


def test_samples_of_frames_are_counted_once(service):
    """Broken by a count that takes a frame's sampling for uniform once it is on the disk."""
    body = small(200)
    body["sampling"] = {"mode": "adaptive", "samples": 400, "error": 0.003}
    body["frames"] = {"first": 1, "last": 12, "fps": 24}
    undisturbed = service.wait(service.submit(body))["samples_done"]
    assert undisturbed < 12 * 400 * 70 * 50
    render = service.submit(body)
    farm.wait_for(lambda: service.resource(render)["frames"]["done"] >= 3, 30, "three frames")
    restart(service)
    assert service.wait(render)["samples_done"] == undisturbed


def test_frames_go_on_after_each_restart(service):
    """Broken by a decision that is waited for although its frame is over, or made twice."""
    body = small(100)
    body["sampling"] = {"mode": "adaptive", "samples": 200, "error": 0.004}
    body["frames"] = {"first": 1, "last": 12, "fps": 24}
    undisturbed = service.submit(body)
    service.wait(undisturbed)
    render = service.submit(body)
    for done in (2, 4, 6, 8):
        farm.wait_for(lambda n=done: service.resource(render)["frames"]["done"] >= n, 30, "frames")
        restart(service)
    service.wait(render)
    for number in range(1, 13):
        pair = [service.request("GET", f"/v1/renders/{r}/frames/{number}.exr").body
                for r in (undisturbed, render)]
        assert pair[0] == pair[1], f"frame {number}"


def test_removed_renders_stay_removed(service):
    """Broken by an id that is forgotten, or files that are not."""
    running, done = service.submit(long()), service.submit(small())
    service.wait(done)
    service.wait_progress(running, 0.01)
    for render in (running, done):
        assert service.request("DELETE", f"/v1/renders/{render}").status == 204
        assert service.request("GET", f"/v1/renders/{render}").status == 410
    restart(service)
    for render in (running, done):
        assert service.request("GET", f"/v1/renders/{render}").status == 410
    assert os.listdir(service.data / "frames") == []
    assert os.listdir(service.data / "scenes") == []


def test_revisions_are_not_used_again(service):
    """Broken by an ETag that names two different images."""
    render = service.submit(long())
    service.wait_progress(render, 0.05)
    path = f"/v1/renders/{render}/image.png"
    seen = {}
    for _ in range(3):
        for _ in range(5):
            answer = service.request("GET", path)
            if answer.status == 200:
                before = seen.setdefault(answer.headers["ETag"], answer.body)
                assert before == answer.body
        restart(service)
        service.wait_progress(render, 0.0)
    assert len(seen) >= 3
    assert service.patch(render, {"state": "cancelled"}).status == 200


def test_a_stop_keeps_what_was_merged(service):
    """Broken by a drain that forgets tiles, or takes long."""
    render = service.submit(long())
    service.wait_progress(render, 0.2)
    before = service.resource(render)["samples_done"]
    service.stop()
    service.start()
    farm.wait_for(lambda: service.resource(render)["samples_done"] >= before, 20, "old progress")
    found = json.loads(service.patch(render, {"state": "cancelled"}).body)
    assert found["state"] == "cancelled"


def clone_row(database, number, render):
    """The row of the first render once more, under another number and name."""
    row = dict(database.execute("SELECT * FROM jobs ORDER BY number LIMIT 1").fetchone())
    row.update(number=number, id=render)
    database.execute(f"INSERT INTO jobs ({', '.join(row)}) VALUES ({', '.join('?' * len(row))})",
                     list(row.values()))


def test_ten_thousand_renders_are_there_within_five_seconds(service):
    """Broken by a start that looks at each finished image, or takes the square of their number."""
    first = service.submit(small())
    service.wait(first)
    bits = service.image(first)
    service.stop()
    names = ["".join("abcdefghijklmnop"[n >> 4 * k & 15] for k in range(6)) + first[6:]
             for n in range(10000)]
    with sqlite3.connect(service.data / "penumbra.db") as database:
        database.row_factory = sqlite3.Row
        for number, name in enumerate(names, 2):
            clone_row(database, number, name)
            os.link(frame(service, first), frame(service, name))
    database.close()
    begin = time.monotonic()
    service.start()
    assert service.request("GET", f"/v1/renders/{names[0]}").status == 200
    assert time.monotonic() - begin < 5 * farm.SLOW
    assert len(service.get("/v1/renders?limit=500")["renders"]) == 500
    assert service.image(names[5000]) == bits and service.image(first) == bits
