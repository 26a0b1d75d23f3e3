# SPDX-License-Identifier: Apache-2.0
"""Prefer: wait=N (RFC 7240): answers that are held until there is something to say."""
import concurrent.futures
import json
import time

import farm
import pytest
import scene
from http_server import JSON, Server, problem

SCENE = scene.build(64, 64, 16, [scene.sphere()])


@pytest.fixture(scope="module")
def server():
    with Server() as running:
        yield running


def ask_meanwhile(server, path, change, **fields):
    """The answer to a GET during which change() is made, not before it has been held a while."""
    with concurrent.futures.ThreadPoolExecutor(1) as pool:
        asked = pool.submit(server.get, path, **fields)
        with pytest.raises(concurrent.futures.TimeoutError):
            asked.result(0.2)
        change()
        return asked.result(10)


def new_render(server):
    return json.loads(server.post(SCENE).body)["id"]


def patch(server, path, change):
    assert server.ask("PATCH", path, json.dumps(change), JSON).status == 200


def test_a_get_is_answered_at_the_next_change(server):
    """Breaks if the answer comes before there is one, or tells what was before it."""
    path = f"/v1/renders/{new_render(server)}"
    answer = ask_meanwhile(server, path, lambda: patch(server, path, {"priority": 9}),
                           Prefer="wait=20")
    assert answer.status == 200 and json.loads(answer.body)["priority"] == 9
    assert answer.headers["Preference-Applied"] == "wait=20"


def test_what_the_client_has_decides(server):
    """Breaks if a change between two polls is slept through: a new ETag is answered at once."""
    path = f"/v1/renders/{new_render(server)}"
    etag = server.get(path).headers["ETag"]
    answer = ask_meanwhile(server, path, lambda: patch(server, path, {"priority": 3}),
                           Prefer="wait=20", If_None_Match=etag)
    assert answer.status == 200 and answer.headers["ETag"] != etag
    again = server.get(path, Prefer="wait=20", If_None_Match=etag)
    assert again.status == 200 and again.ms < 1000 * farm.SLOW


def test_nothing_happens_for_so_long(server):
    path = "/v1/renders/paused"
    etag = server.get(path).headers["ETag"]
    answer = server.get(path, Prefer="wait=1")
    assert answer.status == 200 and answer.ms > 900
    answer = server.get(path, Prefer="wait=1", If_None_Match=etag)
    assert (answer.status, answer.body) == (304, b"") and answer.ms > 900


@pytest.mark.parametrize("state", ["done", "failed", "cancelled"])
def test_what_is_over_is_answered_at_once(server, state):
    answer = server.get(f"/v1/renders/{state}", Prefer="wait=20")
    assert answer.status == 200 and answer.ms < 1000 * farm.SLOW


@pytest.mark.parametrize("prefer", ["respond-async", "wait=0", "wait=x", ""])
def test_other_preferences_are_ignored(server, prefer):
    answer = server.get("/v1/renders/paused", Prefer=prefer)
    assert answer.status == 200 and answer.ms < 1000 * farm.SLOW
    assert "Preference-Applied" not in answer.headers


def test_nobody_is_held_longer_than_the_longest(server):
    answer = server.get("/v1/renders/done", Prefer="wait=31")
    assert answer.headers["Preference-Applied"] == "wait=30"


def test_a_removed_render_is_told(server):
    path = f"/v1/renders/{new_render(server)}"
    answer = ask_meanwhile(server, path, lambda: server.ask("DELETE", path), Prefer="wait=20")
    problem(answer, 404)


def test_clients_that_leave_while_they_wait_harm_nothing(server):
    path = f"/v1/renders/{new_render(server)}"
    for _ in range(20):
        with pytest.raises(TimeoutError):
            server.ask("GET", path, headers={"Prefer": "wait=20"}, timeout=0.01)
    patch(server, path, {"priority": 1})
    assert server.get(path).status == 200


def test_stopping_while_clients_wait():
    """Breaks if the service waits for its clients; __exit__ checks that it ends with code 0."""
    with concurrent.futures.ThreadPoolExecutor(3) as pool:
        with Server() as server:
            asked = [pool.submit(server.get, f"/v1/renders/{state}", Prefer="wait=30")
                     for state in ["queued", "running", "paused"]]
            time.sleep(0.2)
        for answer in asked:
            assert answer.exception(10) or answer.result().status == 503


def test_a_post_is_answered_when_the_render_is_over():
    """Breaks if a client without a loop needs one: one request, and the image is there."""
    headers = {"Content-Type": "application/json", "Prefer": "wait=30"}
    with farm.Farm(processes=1) as service:
        answer = service.request("POST", "/v1/renders", json.dumps(SCENE), headers, timeout=60)
        found = json.loads(answer.body)
        assert (answer.status, found["state"]) == (200, "done")
        assert answer.headers["Location"] == f"/v1/renders/{found['id']}"
        assert service.image(found["id"], "png")
        long = scene.build(512, 512, 4096, [scene.sphere()])
        answer = service.request("POST", "/v1/renders", json.dumps(long),
                                 {**headers, "Prefer": "wait=1"})
        assert answer.status == 202 and "Retry-After" in answer.headers
