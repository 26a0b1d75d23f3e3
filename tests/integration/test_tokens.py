# SPDX-License-Identifier: Apache-2.0
"""Tokens: who is let in to what, and where secrets must not be."""
import json
import os
import pathlib
import re
import stat
import subprocess

import contract
import farm
import pytest
import scene

SCOPES = ("submit", "read", "metrics", "admin")
TINY = scene.build(16, 16, 1, [scene.sphere()])
ID, HASH = "a" * 26, "0" * 64


def penumbra(*arguments, check=True, **variables):
    environment = {key: value for key, value in os.environ.items() if not key.startswith("PENUMBRA")}
    run = subprocess.run([farm.program("penumbra"), *map(str, arguments)], text=True,
                         capture_output=True, timeout=30, env={**environment, **variables})
    assert not check or run.returncode == 0, run.stderr
    return run


def add(data, name, *scopes):
    return penumbra("token", "add", name, "--scope", ",".join(scopes), "--data", data).stdout.strip()


def bearer(token):
    return {"Authorization": f"Bearer {token}"} if token else {}


def operations():
    """(method, path, scope or None) of each thing that the document says one can ask for."""
    for template, item in contract.DOCUMENT["paths"].items():
        path = (template.replace("{id}", ID).replace("{hash}", HASH).replace("{extension}", "png")
                .replace("{number}", "1").replace("{page}", "main.js"))
        for method in ("get", "head", "post", "put", "patch", "delete"):
            operation = item.get("get" if method == "head" else method)
            if operation:
                security = operation.get("security")
                yield method.upper(), path, security and security[0]["token"][0]


OPERATIONS = list(operations())


@pytest.fixture(scope="module")
def data(tmp_path_factory):
    return tmp_path_factory.mktemp("tokens") / "data"


@pytest.fixture(scope="module")
def tokens(data):
    """One of each scope, one of none of this service's, and none."""
    known = {name: add(data, name, name) for name in SCOPES}
    return {**known, "wrong": "pnb_" + "A" * 43, None: None}


@pytest.fixture(scope="module")
def service(data, tokens):
    with farm.Farm(0, data=data) as running:
        yield running


@pytest.mark.parametrize("name", (*SCOPES, "wrong", None))
def test_who_may_do_what(service, tokens, name):
    """Every operation of the document with every kind of token. Broken by a route without a scope, or
    with another than the document says."""
    assert len(OPERATIONS) > 40
    for method, path, scope in OPERATIONS:
        answer = service.request(method, path, b"{" if method[0] == "P" else None, bearer(tokens[name]))
        challenge = answer.headers.get("WWW-Authenticate")
        if scope is None or name in (scope, "admin"):
            assert answer.status not in (401, 403), (method, path)
            assert challenge is None
        elif name in SCOPES:
            assert answer.status == 403, (method, path)
            assert challenge == f'Bearer realm="penumbra", error="insufficient_scope", scope="{scope}"'
        else:
            error = ', error="invalid_token"' if name else ""
            assert (answer.status, challenge) == (401, f'Bearer realm="penumbra"{error}'), (method, path)


def test_what_is_not_there_is_told_to_those_with_a_token_only(service, tokens):
    for method, path in (("GET", "/v2"), ("TRACE", "/v1/renders"), ("OPTIONS", "/v1/renders")):
        assert service.request(method, path).status == 401
        assert service.request(method, path, headers=bearer(tokens["read"])).status != 401


@pytest.mark.parametrize("field", ["Bearer", "Bearer ", "Basic {}", "{}", "Bearer {}x", "Bearer x{}", "Bearer {} {}",
                                   "Bearer {},"])
def test_other_fields_are_no_token(service, tokens, field):
    answer = service.request("GET", "/v1/farm",
                             headers={"Authorization": field.replace("{}", tokens["read"])})
    assert answer.status == 401


def test_the_scheme_may_be_written_as_one_likes(service, tokens):
    for field in ("bearer {}", "BEARER {}", "Bearer   {}"):
        headers = {"Authorization": field.replace("{}", tokens["read"])}
        assert service.request("GET", "/v1/farm", headers=headers).status == 200


def test_host_comes_before_origin_before_token(service, tokens):
    """Broken by telling a page that goes by another name whether a token is right."""
    for token in tokens.values():
        headers = {**bearer(token), "Host": "evil.example", "Origin": "http://evil.example"}
        assert service.request("POST", "/v1/renders", b"{}", headers).status == 421
        del headers["Host"]
        assert service.request("POST", "/v1/renders", b"{}", headers).status == 403


def test_a_body_is_not_kept_for_who_may_not_send_it(service):
    """Broken by taking in large bodies, or writing them to the disk, before the token is looked at."""
    for method, path in (("PUT", f"/v1/assets/sha256/{HASH}"), ("POST", "/v1/renders"),
                         ("PATCH", f"/v1/renders/{ID}")):
        assert service.request(method, path, b"x" * (1 << 20)).status == 401
    assert not [path for path in (service.data / "assets").rglob("*") if path.is_file()]


def test_changes_are_seen_while_it_runs(tmp_path):
    """Open without tokens; closed once there is one, and then for good; a file that is broken
    changes nothing. Broken by a revoked token that still works, or a door that opens by itself."""
    with farm.Farm(0, data=tmp_path / "data") as service:
        path = service.data / "tokens"

        def status(token=None):
            return service.request("GET", "/v1/farm", headers=bearer(token)).status

        assert status() == 200
        token = add(service.data, "a", "read")
        farm.wait_for(lambda: status() == 401, 5, "a closed door")
        assert status(token) == 200
        other = add(service.data, "b", "read")
        farm.wait_for(lambda: status(other) == 200, 5, "the second token")
        path.write_text("nonsense\n")
        farm.wait_for(lambda: status() == 401 and "stay as they were" in service.log.read_text(), 5,
                      "a complaint")
        assert status(token) == 200 and status() == 401
        path.unlink()
        farm.wait_for(lambda: status(token) == 401, 5, "no tokens")
        assert status() == 401


def test_a_file_that_others_may_read_is_refused(tmp_path):
    data = tmp_path / "data"
    add(data, "a", "read")
    os.chmod(data / "tokens", 0o640)
    run = penumbra("serve", "--data", data, "--listen", "127.0.0.1:0", "--worker-listen", "127.0.0.1:0",
                   check=False)
    assert run.returncode == 1 and "chmod 600" in run.stderr


def test_the_command(tmp_path):
    """Broken by a secret that is printed twice, a file that others can read, a list that tells secrets."""
    data = tmp_path / "new/data"
    token = add(data, "alice", "submit", "read")
    assert re.fullmatch(r"pnb_[A-Za-z0-9_-]{43}", token)
    run = penumbra("token", "add", "bob", "--data", data, "--output", tmp_path / "bob")
    secret = (tmp_path / "bob").read_text().strip()
    assert run.stdout == "" and stat.S_IMODE((tmp_path / "bob").stat().st_mode) == 0o600
    text = (data / "tokens").read_text()
    assert token[4:] not in text and secret[4:] not in text
    assert stat.S_IMODE((data / "tokens").stat().st_mode) == 0o600
    listed = penumbra("token", "list", "--data", data).stdout.split()
    assert listed == ["alice", "submit,read", "bob", "submit,read"]
    penumbra("token", "remove", "alice", "--data", data)
    assert penumbra("token", "list", "--data", data).stdout.split() == ["bob", "submit,read"]


@pytest.mark.parametrize("arguments, code, complaint", [
    (("add",), 2, "take a name"), (("list", "x"), 2, "list takes none"), (("make", "x"), 2, "add, list or remove"),
    ((), 2, "is missing"), (("add", "a", "b"), 2, "is missing"), (("add", "a", "--colour"), 2, "unknown"),
    (("add", "a b"), 1, "letters"), (("add", "../a"), 1, "letters"), (("add", "a", "--scope", "all"), 1, "scopes are"),
    (("remove", "nobody"), 1, "no token nobody"), (("add", "twice"), 1, "already"),
])
def test_what_the_command_does_not_take(tmp_path, arguments, code, complaint):
    add(tmp_path, "twice", "read")
    run = penumbra("token", *arguments, "--data", tmp_path, check=False)
    assert run.returncode == code and complaint in run.stderr and run.stdout == ""


def test_the_client_shows_its_token(service, tokens, tmp_path):
    """By option, or by variable; and not to a server beyond this machine that reads along the way."""
    url = f"http://127.0.0.1:{service.http_port}"
    file = tmp_path / "token"
    file.write_text(tokens["admin"] + "\n")
    (tmp_path / "scene.json").write_text(json.dumps(TINY))
    penumbra("status", "--server", url, "--token-file", file)
    penumbra("status", "--server", url, PENUMBRA_TOKEN_FILE=str(file))
    penumbra("status", "--server", url, PENUMBRA_TOKEN=tokens["admin"])
    penumbra("submit", tmp_path / "scene.json", "--server", url, "--token-file", file)
    run = penumbra("status", "--server", url, check=False)
    assert run.returncode == 1 and "a token is needed" in run.stderr
    run = penumbra("status", "--server", "http://192.0.2.1", "--token-file", file, check=False)
    assert run.returncode == 4 and "in the clear" in run.stderr
    run = penumbra("status", "--server", "http://localhost@192.0.2.1", "--token-file", file, check=False)
    assert run.returncode == 4 and "in the clear" in run.stderr
    file.write_text("two words\n")
    run = penumbra("status", "--server", url, "--token-file", file, check=False)
    assert run.returncode == 4 and "holds no token" in run.stderr and "two" not in run.stderr


def test_secrets_stay_where_they_belong(tmp_path):
    """Broken by a secret in an argument, a variable of a child, a log or the store."""
    data = tmp_path / "data"
    token = add(data, "a", "admin")
    os.environ["PENUMBRA_TOKEN"] = token  # of somebody who starts a farm from his own shell
    try:
        with farm.Farm(1, "--log-level", "debug", data=data) as service:
            answer = service.request("POST", "/v1/renders", json.dumps(TINY).encode(), bearer(token))
            assert answer.status == 202, answer.body
            service.request("GET", f"/v1/renders?cursor={token}", headers=bearer(token))
            render = json.loads(answer.body)["id"]
            farm.wait_for(lambda: json.loads(service.request(
                "GET", f"/v1/renders/{render}", headers=bearer(token)).body)["state"] == "done", 30, "the render")
            for pid in (service.server.pid, *farm.descendants(service.server.pid)):
                assert token.encode() not in pathlib.Path(f"/proc/{pid}/cmdline").read_bytes()
            assert token not in service.log.read_text()
    finally:
        del os.environ["PENUMBRA_TOKEN"]
    kept = [path for path in data.rglob("*") if path.is_file()]
    assert len(kept) > 3
    assert not [path for path in kept if token.encode() in path.read_bytes()]
