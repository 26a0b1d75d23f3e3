# SPDX-License-Identifier: Apache-2.0
"""What has been asked for before: by Idempotency-Key, or the same content."""
import concurrent.futures
import json

import farm
import pytest
import scene

SCENE = scene.build(32, 16, 4, [scene.sphere()], background=0.5)
LONG = scene.build(512, 512, 65536, [scene.sphere()])


@pytest.fixture(scope="module")
def service():
    with farm.Farm(processes=1) as running:
        yield running


def post(service, body, **fields):
    headers = {"Content-Type": "application/json",
               **{name.replace("_", "-"): value for name, value in fields.items()}}
    return service.request("POST", "/v1/renders", json.dumps(body), headers)


def render_of(answer, status):
    assert answer.status == status, answer.body
    found = json.loads(answer.body)
    assert answer.headers["Location"] == f"/v1/renders/{found['id']}"
    return found["id"]


def with_seed(seed):
    return {**SCENE, "sampling": {**SCENE["sampling"], "seed": seed}}


def test_the_same_content_is_not_rendered_twice(service):
    """Breaks if a scene that says the same in other words is rendered again, or if one that is not
    done yet, or another one, is taken for it."""
    body = with_seed(1)
    first = render_of(post(service, body), 202)
    service.wait(first)
    assert render_of(post(service, body), 200) == first
    words = {**body, "image": {**body["image"], "width": 32.0, "exposure": 0}}
    assert render_of(post(service, words), 200) == first
    override = {"scene": SCENE, "override": {"sampling": {"seed": 1}}, "options": {"priority": 9}}
    assert render_of(post(service, override), 200) == first
    assert render_of(post(service, with_seed(2)), 202) != first
    running = render_of(post(service, LONG), 202)
    again = render_of(post(service, LONG), 202)
    assert again != running
    for render in (running, again):
        service.patch(render, {"state": "cancelled"})


def test_whoever_wants_a_new_one_gets_it(service):
    body = with_seed(3)
    first = render_of(post(service, body), 202)
    service.wait(first)
    second = render_of(post(service, body, Cache_Control="max-age=0, No-Store"), 202)
    service.wait(second)
    assert render_of(post(service, body), 200) == second


def test_what_is_gone_or_a_preview_is_not_given_again(service):
    """Breaks if an answer names a render that is not there, or soon will not be."""
    body = with_seed(4)
    first = render_of(post(service, body), 202)
    service.wait(first)
    assert service.request("DELETE", f"/v1/renders/{first}").status == 204
    preview = render_of(post(service, {"scene": body, "options": {"preview": True}}), 202)
    service.wait(preview)
    second = render_of(post(service, body), 202)
    assert len({first, preview, second}) == 3


def test_a_render_given_again_still_replaces(service):
    """Breaks if an orbit that comes back to an earlier view leaves the one between rendering."""
    body = with_seed(5)
    first = render_of(post(service, body), 202)
    service.wait(first)
    running = render_of(post(service, LONG), 202)
    assert render_of(post(service, {"scene": body, "options": {"replaces": running}}), 200) == first
    service.wait(running, state="cancelled")
    own = {"scene": body, "options": {"replaces": first}}
    assert render_of(post(service, own), 200) == first
    assert service.resource(first)["state"] == "done"


def test_a_key_makes_a_post_safe_to_repeat(service):
    """Breaks if a client that did not hear the answer makes two renders, whatever their state."""
    key = '"8e03978e-40d5-43dd-bc93-6894a57f9324"'
    first = render_of(post(service, LONG, Idempotency_Key=key), 202)
    assert render_of(post(service, LONG, Idempotency_Key=key), 202) == first
    answer = post(service, with_seed(6), Idempotency_Key=key)
    assert answer.status == 422
    service.patch(first, {"state": "cancelled"})
    assert render_of(post(service, LONG, Idempotency_Key=key, Cache_Control="no-store"), 200) == first
    assert render_of(post(service, LONG, Idempotency_Key="other"), 202) != first
    service.request("DELETE", f"/v1/renders/{first}")
    assert render_of(post(service, LONG, Idempotency_Key=key), 202) != first
    for render in service.get("/v1/renders?state=running")["renders"]:
        service.patch(render["id"], {"state": "cancelled"})


@pytest.mark.parametrize("key", ["", "x" * 256])
def test_keys_that_are_none(service, key):
    assert post(service, SCENE, Idempotency_Key=key).status == 400


def test_many_at_once_with_one_key_make_one_render(service):
    """Breaks if the key is looked up before the render is accepted and noted after it."""
    with concurrent.futures.ThreadPoolExecutor(8) as pool:
        answers = list(pool.map(lambda _: post(service, with_seed(7), Idempotency_Key="one"),
                                range(24)))
    assert {a.status for a in answers} <= {200, 202, 409}
    assert len({json.loads(a.body)["id"] for a in answers if a.status != 409}) == 1
    assert all(a.headers["Retry-After"] == "1" for a in answers if a.status == 409)


def test_keys_and_contents_are_known_after_a_restart(tmp_path):
    """Breaks if they are kept in memory alone: then a crash makes two renders of one."""
    with farm.Farm(1, data=tmp_path / "data") as service:
        first = render_of(post(service, SCENE, Idempotency_Key="k"), 202)
        service.wait(first)
        service.kill()
        service.start()
        farm.wait_for(lambda: service.get("/v1/workers")["workers"], 20, "a worker")
        assert render_of(post(service, SCENE), 200) == first
        assert render_of(post(service, SCENE, Idempotency_Key="k"), 200) == first
        assert post(service, with_seed(8), Idempotency_Key="k").status == 422
