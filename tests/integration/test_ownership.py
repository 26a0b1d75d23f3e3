# SPDX-License-Identifier: Apache-2.0
"""Whose a render is: of the token that it was asked for with, and nobody else's but an administrator's."""
import json
import sqlite3
import subprocess

import contract
import farm
import pytest
import scene
from bearer import Client, token

TINY = scene.build(16, 16, 1, [scene.sphere()])
LONG = scene.build(256, 256, 65536, [scene.sphere()])
UNKNOWN = "a" * 26


@pytest.fixture(scope="module")
def service(tmp_path_factory):
    data = tmp_path_factory.mktemp("owners") / "data"
    secrets = {name: token(data, name) for name in ("alice", "bob")}
    secrets["root"] = token(data, "root", "admin")
    with farm.Farm(1, data=data) as running:
        for name, secret in secrets.items():
            setattr(running, name, Client(running, secret))
        yield running


def operations_of(render):
    """(method, path) of all that the document says one can ask of a render."""
    for template, item in contract.DOCUMENT["paths"].items():
        if "/renders/{id}" not in template:
            continue
        path = template.replace("{id}", render).replace("{number}", "1").replace("{extension}", "png")
        path = (path.replace("{region}", "full").replace("{size}", "max").replace("{rotation}", "0")
                .replace("{turn}", "0").replace("{quality}", "default"))
        assert "{" not in path
        for method in ("get", "head", "patch", "delete", "put", "post"):
            if item.get("get" if method == "head" else method):
                yield method.upper(), path


def ask_all(client, render):
    """What there is to ask of a render, without what changes it."""
    answers = {}
    for method, path in operations_of(render):
        for query in ("", "?layer=normal", "?layer=heat") if "image" in path or "frames" in path else ("",):
            body = {"state": "cancelled"} if method == "PATCH" else None
            answer = client.ask(method, path + query, body)
            answers[method, path.replace(render, "ID") + query] = answer.status, answer.body.replace(
                render.encode(), b"ID")
    return answers


def test_what_is_anothers_is_not_there(service):
    """Every operation of the document on a render, by who does not own it, before the end and after:
    word for word what is answered for an id that there never was. Broken by a route that looks a
    render up by itself, by 403 in place of 404, by an ETag or a field that tells of it."""
    running = service.alice.post(LONG)
    done = service.alice.done(service.alice.post(TINY))
    removed = service.alice.done(service.alice.post(scene.build(16, 16, 2, [scene.sphere()])))
    assert service.alice.ask("DELETE", f"/v1/renders/{removed}").status == 204
    unknown = ask_all(service.bob, UNKNOWN)
    assert len(unknown) >= 20 and {status for status, _ in unknown.values()} == {404}
    for render in (running, done, removed):
        assert ask_all(service.bob, render) == unknown
    assert service.alice.status(done) == 200 and service.alice.state(running) in ("queued", "running")
    assert service.alice.status(removed) == service.root.status(removed) == 410
    changing = ("PATCH", "DELETE")
    for client in (service.alice, service.root):
        for method, path in operations_of(done):
            if method not in changing:
                assert client.ask(method, path).status in (200, 204, 303), (method, path)
    assert service.root.ask("PATCH", f"/v1/renders/{running}", {"state": "cancelled"}).status == 200
    assert service.root.ask("DELETE", f"/v1/renders/{done}").status == 204
    assert service.alice.ask("DELETE", f"/v1/renders/{running}").status == 204


def test_lists_have_ones_own(service):
    """Broken by a page that is full of other people's renders, or ends at one."""
    mine = [service.alice.post(scene.build(16, 16, 3, [scene.sphere()], seed=seed)) for seed in range(3)]
    his = []
    for seed in range(2):
        his.append(service.bob.post(scene.build(16, 16, 3, [scene.sphere()], seed=seed)))
        mine.append(service.alice.post(scene.build(16, 16, 3, [scene.sphere()], seed=7 + seed)))
    for client, renders in ((service.alice, mine), (service.bob, his)):
        assert client.listed()[:len(renders)] == renders[::-1]
        assert client.pages() == client.listed()
        for render in renders:
            client.done(render)
        assert set(renders) <= set(client.listed("&state=done"))
    assert not set(service.alice.listed()) & set(service.bob.listed())
    assert set(mine + his) <= set(service.root.listed())


def test_what_another_one_had_rendered_is_rendered_anew(service):
    """Broken by reuse of content across tokens: it would tell that somebody else has that render."""
    body = scene.build(16, 16, 5, [scene.sphere()])
    first = service.alice.done(service.alice.post(body))
    assert service.alice.post(body) == first
    second = service.bob.done(service.bob.post(body))
    assert second != first
    assert service.bob.post(body) == second and service.alice.post(body) == first
    contents = {json.loads(service.root.ask("GET", f"/v1/renders/{render}").body)["content"]
                for render in (first, second)}
    assert len(contents) == 1


def test_idempotency_keys_are_ones_own(service):
    """Broken by 422, 409 or the render of another one for a key that he used."""
    body, other = (scene.build(16, 16, 6, [scene.sphere()], seed=seed) for seed in (1, 2))
    first = service.alice.post(body, Idempotency_Key="k", Cache_Control="no-store")
    second = service.bob.post(other, Idempotency_Key="k", Cache_Control="no-store")
    third = service.root.post(other, Idempotency_Key="k", Cache_Control="no-store")
    assert len({first, second, third}) == 3
    assert service.alice.post(body, Idempotency_Key="k", Cache_Control="no-store") == first
    assert service.bob.post(other, Idempotency_Key="k", Cache_Control="no-store") == second
    answer = service.bob.ask("POST", "/v1/renders", body, Idempotency_Key="k", Content_Type="application/json")
    assert answer.status == 422


@pytest.mark.parametrize("seen_before", [False, True])
def test_nobody_replaces_what_is_anothers(service, seen_before):
    """By a new render, and by one that there is already. Broken by a submission that cancels
    whatever render it names."""
    running = service.alice.post(LONG)
    body = scene.build(16, 16, 8, [scene.sphere()], seed=int(seen_before))
    if seen_before:
        service.bob.done(service.bob.post(body))
    service.bob.post({"scene": body, "options": {"replaces": running}})
    assert service.alice.state(running) in ("queued", "running")
    service.alice.post({"scene": body, "options": {"replaces": running}})
    farm.wait_for(lambda: service.alice.state(running) == "cancelled", 5, "the replacement")


def test_owners_outlive_the_coordinator_and_names_do_not_inherit(tmp_path):
    """Through SIGKILL, a name that is given anew, and a removal. Broken by owners told by name, or
    kept in memory alone."""
    data = tmp_path / "data"
    secrets = [token(data, name) for name in ("alice", "bob")]
    with farm.Farm(1, data=data) as service:
        alice, bob = (Client(service, secret) for secret in secrets)
        kept = alice.done(alice.post(TINY, Idempotency_Key="k"))
        removed = alice.done(alice.post(scene.build(16, 16, 2, [scene.sphere()])))
        assert alice.ask("DELETE", f"/v1/renders/{removed}").status == 204
        service.kill()
        subprocess.run([farm.program("penumbra"), "token", "remove", "bob", "--data", data], check=True, timeout=30)
        service.start()
        assert alice.listed() == [kept] and alice.status(removed) == 410
        assert alice.post(TINY, Idempotency_Key="k") == kept
        farm.wait_for(lambda: json.loads(alice.ask("GET", "/v1/farm").body)["workers"], 20, "a worker")
        assert alice.post(TINY) == kept
        subprocess.run([farm.program("penumbra"), "token", "remove", "alice", "--data", data], check=True, timeout=30)
        heir = Client(service, token(data, "alice"))
        farm.wait_for(lambda: heir.ask("GET", "/v1/farm").status == 200, 5, "the new token")
        assert heir.listed() == [] and heir.status(kept) == heir.status(removed) == 404
        assert bob.ask("GET", "/v1/farm").status == alice.ask("GET", "/v1/farm").status == 401


def test_what_was_there_before_there_were_owners(tmp_path):
    """A data directory of schema version 7: its renders are nobody's, seen by an administrator and,
    as long as there is no token, by everybody. Broken by an upgrade that loses them or gives them to
    whoever asks first."""
    data = tmp_path / "data"
    with farm.Farm(1, data=data) as service:
        kept = service.submit(TINY)
        service.wait(kept)
        removed = service.submit(scene.build(16, 16, 2, [scene.sphere()]))
        service.wait(removed)
        assert service.request("DELETE", f"/v1/renders/{removed}").status == 204
    database = sqlite3.connect(data / "penumbra.db")
    database.executescript("BEGIN; ALTER TABLE jobs DROP COLUMN owner; ALTER TABLE removed DROP COLUMN owner;"
                           "ALTER TABLE jobs DROP COLUMN trace; DROP TABLE scenes;"
                           "PRAGMA user_version = 7; COMMIT;")
    database.close()
    with farm.Farm(1, data=data) as service:
        assert [r["id"] for r in service.get("/v1/renders")["renders"]] == [kept]
        assert service.request("GET", f"/v1/renders/{removed}").status == 410
        root, alice = Client(service, token(data, "root", "admin")), Client(service, token(data, "alice"))
        farm.wait_for(lambda: service.request("GET", "/v1/farm").status == 401 and
                      alice.ask("GET", "/v1/farm").status == 200, 5, "the tokens")
        assert root.listed() == [kept] and root.status(removed) == 410
        assert alice.listed() == [] and alice.status(kept) == alice.status(removed) == 404
        assert alice.done(alice.post(TINY)) != kept
