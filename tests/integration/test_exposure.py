# SPDX-License-Identifier: Apache-2.0
"""What a coordinator asks of those who reach it, by where it listens and what it was given."""
import contextlib
import http.client
import itertools
import json
import os
import socket
import ssl
import stat
import subprocess

import farm
import pytest
import scene
from test_tokens import add, bearer, penumbra

NAMES = ("localhost", "127.0.0.1", "farm.example", "*.pool.example", "192.0.2.7")
# Who is not on loopback, to the coordinator.
ANYWHERE = ("0.0.0.0:0", "[::]:0")
HOSTS = {"127.0.0.1:80": True, "LOCALHOST": True, "[::1]:1": True, "farm.example": "tls", "192.0.2.7:9": "tls",
         "a.pool.example": "tls", "pool.example": False, "a.b.pool.example": False, "farm.example.evil": False,
         "evil.example": False, None: None}
ORIGINS = {None: True, "http://localhost:80": True, "https://farm.example": "tls", "https://evil.example": False,
           "null": False}
# What is asked for, with the scope that it takes and how it is answered when all is well.
ROUTES = {("GET", "/livez"): (None, 200), ("GET", "/v1/farm"): ("read", 200), ("POST", "/v1/renders"): ("submit", 400),
          ("POST", "/v1/workers/9/drain"): ("admin", 404), ("GET", "/metrics"): ("metrics", 200),
          ("PUT", "/v1/scenes/sha256/" + "0" * 64): ("submit", 422)}


@pytest.fixture(scope="module")
def keys(tmp_path_factory):
    """A data directory with a certificate and tokens, to be copied by name."""
    data = tmp_path_factory.mktemp("keys")
    penumbra("cert", *NAMES, "--data", data)
    tokens = {"read": add(data, "r", "read"), "admin": add(data, "a", "admin"), "wrong": "pnb_" + "x" * 43, None: None}
    return data, tokens


def options_of(keys, tls, closed):
    data, _ = keys
    options = ["--tls-cert", data / "cert.pem", "--tls-key", data / "key.pem"] if tls else []
    return [*options, "--tokens", data / ("tokens" if closed else "none")]


@contextlib.contextmanager
def running(keys, address, tls, closed, processes=0):
    options = options_of(keys, tls, closed)
    with farm.Farm(processes, "--listen", address, *options, tls=keys[0] / "cert.pem" if tls else None) as service:
        yield service


def expected(tls, closed, host, origin, token, method, scope, well):
    """The status, by the rules alone: the host, then the origin, then the token, then its scope."""
    if HOSTS[host] is None:
        return 400
    if HOSTS[host] is False or (HOSTS[host] == "tls" and not tls):
        return 421
    if method != "GET" and (ORIGINS[origin] is False or (ORIGINS[origin] == "tls" and not tls)):
        return 403
    if not closed or scope is None:
        return well
    if token in (None, "wrong"):
        return 401
    return well if token in ("admin", scope) else 403


def ask(connection, method, path, host, headers):
    connection.putrequest(method, path, skip_host=True)
    body = b"{" if method != "GET" else None
    for name, value in {"Host": host, **headers, "Content-Length": str(len(body)) if body else None}.items():
        if value is not None:
            connection.putheader(name, value)
    connection.endheaders(body)
    answer = connection.getresponse()
    answer.read()
    if answer.status == 400 and host is None:
        connection.close()
    return answer.status


@pytest.mark.parametrize("address, tls, closed", [
    ("127.0.0.1:0", False, False), ("127.0.0.1:0", False, True), ("127.0.0.1:0", True, False),
    ("127.0.0.1:0", True, True), ("0.0.0.0:0", True, True)])
def test_every_cell(keys, address, tls, closed):
    """Address × TLS × tokens × Host × Origin × token × scope: the exact status of each. Broken by any
    check that is left out, done in another order, or answered in another way."""
    cells, wrong = 0, []
    with running(keys, address, tls, closed) as service:
        connection = service.connection()
        for host, origin, token, (method, path) in itertools.product(HOSTS, ORIGINS, keys[1], ROUTES):
            scope, well = ROUTES[method, path]
            status = ask(connection, method, path, host, {"Origin": origin, **bearer(keys[1][token])})
            cells += 1
            want = expected(tls, closed, host, origin, token, method, scope, well)
            if status != want:
                wrong.append((host, origin, token, method, path, status, want))
        connection.close()
    assert cells == len(HOSTS) * len(ORIGINS) * 4 * len(ROUTES) and not wrong, wrong[:10]


@pytest.mark.parametrize("address", ANYWHERE)
@pytest.mark.parametrize("tls, closed, told", [
    (False, False, ("penumbra cert", "--tls-cert", "penumbra token add")), (False, True, ("penumbra cert", "--tls-key")),
    (True, False, ("penumbra token add",))])
def test_an_open_port_without_keys_does_not_open(keys, tmp_path, address, tls, closed, told):
    """Refused with a sentence that tells how to get there. Broken by listening all the same."""
    run = penumbra("serve", "--data", tmp_path, "--listen", address, "--worker-listen", "127.0.0.1:0",
                   *options_of(keys, tls, closed), check=False)
    assert run.returncode == 1 and all(word in run.stderr for word in told), run.stderr
    assert not (tmp_path / "ports").exists()


def test_the_last_token_does_not_open_the_door_when_it_goes(keys, tmp_path):
    """Broken by an open port without tokens, after the last one was taken back."""
    data = tmp_path / "data"
    token = add(data, "only", "read")
    options = ["--tls-cert", keys[0] / "cert.pem", "--tls-key", keys[0] / "key.pem"]
    with farm.Farm(0, "--listen", "0.0.0.0:0", *options, data=data, tls=keys[0] / "cert.pem") as service:
        assert service.request("GET", "/v1/farm", headers=bearer(token)).status == 200
        penumbra("token", "remove", "only", "--data", data)
        farm.wait_for(lambda: service.request("GET", "/v1/farm", headers=bearer(token)).status == 401, 5, "the end")
        assert service.request("GET", "/v1/farm").status == 401


def test_nothing_before_tls_1_3(keys):
    """Broken by a handshake of another version, or an answer to what is no TLS."""
    with running(keys, "0.0.0.0:0", True, True) as service:
        context = ssl.create_default_context(cafile=service.tls)
        context.maximum_version = ssl.TLSVersion.TLSv1_2
        with socket.create_connection(("127.0.0.1", service.http_port)) as plain, \
                pytest.raises((ssl.SSLError, ConnectionError)):
            context.wrap_socket(plain, server_hostname="localhost")
        plain = http.client.HTTPConnection("127.0.0.1", service.http_port, timeout=10)
        with pytest.raises((http.client.HTTPException, ConnectionError)):
            plain.request("GET", "/livez")
            plain.getresponse()
        plain.close()
        assert service.request("GET", "/livez").status == 200


def test_all_of_http_works_through_tls(keys, tmp_path):
    """A body of many records, one that is refused half way, an answer that comes late, a stream, and a
    part of a file. Broken by what libmicrohttpd does otherwise with TLS: data that waits inside of it."""
    body = scene.build(64, 48, 4, [scene.sphere([i * 1e-3, 0, 0]) for i in range(20000)])
    with running(keys, "127.0.0.1:0", True, False, processes=1) as service:
        render = service.submit(body)
        service.wait(render)
        pixels = service.image(render)
        part = service.request("GET", f"/v1/renders/{render}/image.exr", headers={"Range": "bytes=10-99"})
        assert part.status == 206 and part.body == pixels[10:100]
        assert service.request("PUT", f"/v1/assets/sha256/{'0' * 64}", b"x" * (8 << 20)).status == 422
        assert service.request("POST", "/v1/renders", b"x" * (9 << 20)).status == 413
        again = service.submit({"scene": body, "override": {"sampling": {"samples": 256}}})
        events = service.connection()
        events.request("GET", f"/v1/renders/{again}/events")
        text = events.getresponse().read().decode()
        assert "event: done" in text and "event: tiles" in text
        events.close()
        url = f"https://localhost:{service.http_port}"
        (tmp_path / "scene.json").write_text(json.dumps(scene.build(16, 16, 1, [scene.sphere()])))
        penumbra("submit", tmp_path / "scene.json", "--server", url, "--ca-file", service.tls)
        run = penumbra("status", "--server", url, check=False)
        assert run.returncode == 3 and "certificate" in run.stderr


def test_the_certificate_command(tmp_path):
    """Broken by a key that others may read, by files that are overwritten, or names that are left out."""
    data = tmp_path / "data"
    penumbra("cert", *NAMES, "::1", "--data", data)
    assert stat.S_IMODE((data / "key.pem").stat().st_mode) == 0o600
    text = subprocess.run(["openssl", "x509", "-in", data / "cert.pem", "-noout", "-text"], check=True,
                          capture_output=True, text=True, timeout=10).stdout
    assert all(f"DNS:{name}" in text or f"IP Address:{name}" in text for name in NAMES)
    assert "IP Address:0:0:0:0:0:0:0:1" in text and "CA:TRUE, pathlen:0" in text
    before = (data / "key.pem").read_bytes()
    run = penumbra("cert", "localhost", "--data", data, check=False)
    assert run.returncode == 1 and "is there already" in run.stderr
    assert (data / "key.pem").read_bytes() == before
    assert penumbra("cert", "--data", data, check=False).returncode == 2


@pytest.mark.parametrize("spoil, told", [
    (lambda cert, key: os.chmod(key, 0o644), "chmod 600"), (lambda cert, key: key.write_text("no key"), "not usable"),
    (lambda cert, key: cert.write_text(""), "not usable"), (lambda cert, key: cert.unlink(), "cannot open"),
    (lambda cert, key: penumbra("cert", "x", "--cert", cert.with_name("c"), "--key", key.with_name("k")) and
     os.replace(key.with_name("k"), key), "not usable")])
def test_keys_that_are_not_right(tmp_path, spoil, told):
    """Broken by a server that starts without TLS, with a key that everybody may read, or another's."""
    penumbra("cert", "localhost", "--data", tmp_path)
    cert, key = tmp_path / "cert.pem", tmp_path / "key.pem"
    spoil(cert, key)
    run = penumbra("serve", "--data", tmp_path / "data", "--listen", "127.0.0.1:0", "--worker-listen", "127.0.0.1:0",
                   "--tls-cert", cert, "--tls-key", key, check=False)
    assert run.returncode == 1 and told in run.stderr, run.stderr


def test_one_without_the_other_is_wrong_usage(tmp_path):
    for option in ("--tls-cert", "--tls-key"):
        run = penumbra("serve", "--data", tmp_path, option, tmp_path / "x", check=False)
        assert run.returncode == 2 and "go together" in run.stderr
