# SPDX-License-Identifier: Apache-2.0
"""How much may wait, of one token and of all, and how often a token may ask."""
import json
import time

import farm
import pytest
import scene
from bearer import Client, token

TINY = scene.build(16, 16, 1, [scene.sphere()])
BURST, QUEUED, ALL = 20, 100, 1000


def ask(client, body=TINY, **fields):
    return client.ask("POST", "/v1/renders", body, Content_Type="application/json",
                      **{"Cache_Control": "no-store", **fields})


def patiently(client, body=TINY):
    """Asks as often as is allowed; the answer is none of asking too often."""
    while True:
        answer = ask(client, body)
        if answer.status != 429 or b"too often" not in answer.body:
            return answer
        time.sleep(int(answer.headers["Retry-After"]))


@pytest.fixture
def service(tmp_path):
    data = tmp_path / "data"
    secrets = {name: token(data, name) for name in ("alice", "bob")}
    with farm.Farm(0, data=data) as running:
        for name, secret in secrets.items():
            setattr(running, name, Client(running, secret))
        yield running


def test_how_often_one_may_ask(service):
    """Broken by a burst that is not counted, by one token's haste that slows another, by a
    Retry-After after which the answer is the same."""
    began = time.monotonic()
    answers = [ask(service.alice, {} if n % 2 else TINY) for n in range(60)]
    seconds = time.monotonic() - began
    taken = sum(answer.status != 429 for answer in answers)
    assert BURST <= taken <= BURST + 1 + seconds / 0.1
    assert [a.status == 429 for a in answers[:BURST]] == [False] * BURST
    refused = [answer for answer in answers if answer.status == 429]
    assert refused and all(answer.headers["Retry-After"] == "1" for answer in refused)
    assert ask(service.bob).status == 202
    time.sleep(1)
    assert ask(service.alice).status == 202


def test_how_many_may_wait_of_one_token(service):
    """At 99, 100 and 101. Broken by renders of others that count, by a cancelled one or a replaced
    one that keeps its place, by a place that is given for nothing."""
    ids = []
    for _ in range(QUEUED):
        answer = patiently(service.alice)
        assert answer.status == 202, answer.body
        ids.append(json.loads(answer.body)["id"])
    refused = patiently(service.alice)
    assert refused.status == 429 and b"100 renders of this token" in refused.body
    assert refused.headers["Retry-After"] == "60"  # nothing is rendered: nobody knows
    assert len(service.alice.listed()) == QUEUED
    assert ask(service.bob).status == 202
    replacing = {"scene": TINY, "options": {"replaces": ids[0]}}
    assert patiently(service.alice, replacing).status == 202
    farm.wait_for(lambda: service.alice.state(ids[0]) == "cancelled", 5, "the replacement")
    assert patiently(service.alice).status == 429
    assert patiently(service.alice, replacing).status == 429  # it is over: no place to take
    assert service.alice.ask("DELETE", f"/v1/renders/{ids[1]}").status == 204
    assert patiently(service.alice).status == 202
    assert patiently(service.alice).status == 429


def test_how_many_samples_may_wait_of_one_token(service):
    """One frame of 2^36 samples more or less around 2^42. Broken by frames that are not counted, or
    by a token that may ask for nothing at all because one render is larger than its share."""
    def large(frames):
        body = scene.build(1024, 1024, 65536, [scene.sphere()])
        return {**body, "frames": {"first": 1, "last": frames, "fps": 24}}

    assert ask(service.alice, large(63)).status == 202
    refused = ask(service.alice, large(2))
    assert refused.status == 429 and b"samples" in refused.body
    assert ask(service.alice, large(1)).status == 202
    assert ask(service.alice, TINY).status == 429
    assert ask(service.bob, large(65)).status == 202
    assert ask(service.bob, TINY).status == 429


def test_how_many_may_wait_at_all():
    """At 999, 1000 and 1001, without tokens. Broken by 503, which says that the service is not well."""
    with farm.Farm(0) as service:
        nobody = Client(service, None)
        statuses = [ask(nobody).status for _ in range(ALL)]
        assert statuses == [202] * ALL
        refused = ask(nobody)
        assert refused.status == 429 and b"1000 renders wait" in refused.body
        first = json.loads(nobody.ask("GET", "/v1/renders?limit=1").body)["renders"][0]["id"]
        assert nobody.ask("DELETE", f"/v1/renders/{first}").status == 204
        assert ask(nobody).status == 202
        assert ask(nobody).status == 429


def test_how_many_may_wait_is_the_operators_choice():
    """At 4, 5 and 6 of 5. Broken by an option that is read and not heeded."""
    with farm.Farm(0, "--max-waiting", 5) as service:
        nobody = Client(service, None)
        assert [ask(nobody).status for _ in range(6)] == [202] * 5 + [429]
        assert b"5 renders wait" in ask(nobody).body


def test_when_to_come_again_is_told_from_the_pace(tmp_path):
    """Broken by a fixed number: the one render that runs says when it will be over."""
    data = tmp_path / "data"
    secret = token(data, "alice")
    with farm.Farm(1, data=data) as service:
        alice = Client(service, secret)
        running = json.loads(patiently(alice, scene.build(512, 512, 20000, [scene.sphere()])).body)["id"]
        for _ in range(QUEUED - 1):
            body = {"scene": scene.build(512, 512, 65536, [scene.sphere()]), "options": {"priority": 0}}
            assert patiently(alice, body).status == 202

        def eta():
            return json.loads(alice.ask("GET", f"/v1/renders/{running}").body)["eta_seconds"]

        farm.wait_for(eta, 20, "an estimate")
        before, answer, after = eta(), patiently(alice), eta()
        assert answer.status == 429
        low, high = sorted((min(before, 3600), min(after, 3600)))
        assert 0.5 * low <= int(answer.headers["Retry-After"]) <= 2 * high + 1
