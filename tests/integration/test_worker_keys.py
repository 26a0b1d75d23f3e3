# SPDX-License-Identifier: Apache-2.0
"""The port for workers, once it asks for keys: who is let in, and what is said to those who are not.

openssl plays workers that are not ours: it knows TLS, and nothing of the tile protocol."""
import os
import pathlib
import re
import socket
import ssl
import stat
import subprocess
import time

import farm
import pytest
import scene
from test_tokens import penumbra
from tile_peer import Peer

SCENE = scene.build(96, 64, 16, [scene.sphere(), scene.sphere([0, -101, 0], 100.0)], background=0.4)


def add(data, name, file):
    penumbra("worker", "add", name, "--data", data, "--output", file)
    return file.read_text().split()[1]


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    return tmp_path_factory.mktemp("keys")


@pytest.fixture(scope="module")
def keys(place):
    return {name: add(place / "data", name, place / name) for name in ("one", "two")}


@pytest.fixture(scope="module")
def service(place, keys):
    """On all addresses, with a worker of its own, which the same rule holds for."""
    with farm.Farm(1, "--worker-listen", "0.0.0.0:0", "--log-level", "debug", data=place / "data") as running:
        farm.wait_for(lambda: workers(running), 30, "the pool")
        yield running


def workers(service):
    return service.get("/v1/workers")["workers"]


def connect(service, file):
    before = {worker["id"] for worker in workers(service)}
    process = service.connect_worker(1, "--key-file", file)
    return process, farm.wait_for(lambda: next((worker for worker in workers(service) if worker["id"] not in before),
                                               None), 30, "the worker")


def handshake(service, *options, text=b""):
    """Of a TLS client: the cipher that was agreed on, None without one, and the alert that it was sent."""
    run = subprocess.run(["openssl", "s_client", "-connect", f"127.0.0.1:{service.worker_port}", *options],
                         input=text, capture_output=True, timeout=30)
    cipher = re.search(rb"Cipher is (?!\(NONE\))(\S+)", run.stdout)
    alert = re.search(rb"alert number (\d+)", run.stderr)
    return cipher and cipher[1].decode(), alert and int(alert[1])


def psk(name, key):
    return "-psk_identity", name, "-psk", key, "-tls1_3", "-ciphersuites", "TLS_AES_128_GCM_SHA256"


def strangers(service):
    return service.log.read_text().count("no worker at")


def test_a_hello_in_the_clear_is_not_answered(service):
    """A message that is right in everything but the key. Broken by any reply, or by reading it at all."""
    begin = time.monotonic()
    for _ in range(3):
        peer = Peer(service.worker_port)
        peer.hello(protocol=99)
        assert peer.socket.recv(1) == b""
        peer.socket.close()
    assert time.monotonic() - begin < 4 * farm.SLOW
    assert "version 1 of the tile protocol" not in service.log.read_text()
    assert strangers(service) == 1  # and once a minute is enough to say so


@pytest.mark.parametrize("data", [b"GET / HTTP/1.1\r\nHost: x\r\n\r\n", b"\x00" * 100, b"\x16" * 1000,
                                  b"\x16\x03\x01\xff\xff" + b"x" * 70000, b"PENu"])
def test_what_is_no_handshake_gets_no_answer_but_an_alert(service, data):
    with socket.create_connection(("127.0.0.1", service.worker_port), timeout=10 * farm.SLOW) as link:
        try:
            link.sendall(data)
            answer = link.recv(65536)
        except ConnectionError:
            answer = b""
        assert answer == b"" or (answer[0] == 0x15 and len(answer) == 7)  # a TLS alert, whole
    assert service.request("GET", "/livez").status == 200


def test_strangers_who_speak_tls(service, keys):
    """Without a key, with a certificate in mind, an older version, a wrong key, a name that is not there:
    all fail in the handshake. Broken by a port that falls back on something."""
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    context.check_hostname, context.verify_mode = False, ssl.CERT_NONE
    with socket.create_connection(("127.0.0.1", service.worker_port)) as link, pytest.raises((ssl.SSLError, ConnectionError)):
        context.wrap_socket(link)
    told = set()
    for options in (psk("one", keys["two"]), psk("three", keys["one"]), psk("/local", keys["one"]), psk("x" * 65, keys["one"])):
        cipher, alert = handshake(service, *options)
        assert cipher is None
        told.add(alert)
    assert len(told) == 1, told  # nobody learns which names there are
    older = ("-psk_identity", "one", "-psk", keys["one"], "-tls1_2", "-cipher", "PSK")
    assert handshake(service, *older)[0] is None


def test_a_key_opens_the_door_and_no_more(service, keys):
    """The right key gets in, so that the tests above fail for the right reason; then the protocol holds as
    ever. Broken by trusting whoever has a key."""
    before = len(workers(service))
    found = handshake(service, *psk("one", keys["one"]), text=b"nonsense" * 20)
    assert found == ("TLS_AES_128_GCM_SHA256", None)
    assert len(workers(service)) == before


def test_a_worker_with_a_key_renders_the_same_bits(service, place):
    """Broken by pixels that change on their way through TLS, or a key that nobody can use."""
    with farm.Farm(1) as plain:
        expected = plain.render(SCENE)
    process, worker = connect(service, place / "one")
    assert worker["state"] == "ready"
    own = next(found["id"] for found in workers(service) if found["id"] != worker["id"])
    assert service.request("POST", f"/v1/workers/{own}/drain").status == 200
    assert service.render(SCENE) == expected
    assert next(w for w in workers(service) if w["id"] == worker["id"])["samples_done"] > 0
    service.request("POST", f"/v1/workers/{own}/reset")
    farm.stop_process(process)


def test_one_key_is_one_worker(service, place):
    """Broken by a key that is passed on and makes two workers of one."""
    first, old = connect(service, place / "one")
    second, new = connect(service, place / "one")
    ids = {worker["id"] for worker in workers(service)}
    assert new["id"] in ids and old["id"] not in ids
    assert "gives way to another with the key one" in service.log.read_text()
    for process in (first, second):
        farm.stop_process(process)


def test_a_key_that_is_taken_back(service, place):
    """Broken by a worker that stays because it is already in."""
    add(service.data, "three", place / "three")
    process, worker = connect(service, place / "three")
    penumbra("worker", "remove", "three", "--data", service.data)
    farm.wait_for(lambda: worker["id"] not in {w["id"] for w in workers(service)}, 10, "the end of the worker")
    assert process.poll() is None  # it goes on asking
    farm.stop_process(process)


def test_a_wrong_key_is_told_to_the_worker(service, place, keys):
    wrong = place / "wrong"
    wrong.write_text(f"two {keys['one']}\n")
    wrong.chmod(0o600)
    process = service.connect_worker(1, "--key-file", wrong)
    farm.wait_for(lambda: "does not know this worker's key" in service.log.read_text(), 20, "a complaint")
    farm.stop_process(process)


def test_those_who_only_knock_hold_off_nobody(service, place):
    """Broken by a bound on connections that counts those who have not said who they are."""
    idle = [socket.create_connection(("127.0.0.1", service.worker_port)) for _ in range(200)]
    process, worker = connect(service, place / "two")
    assert worker["state"] == "ready"
    farm.stop_process(process)
    for link in idle:
        link.close()


def test_the_local_pool_gets_a_new_key_each_time(service):
    """Broken by a pool that stays away once its key is used up."""
    own = service.pools()[0].pool
    os.kill(own, 9)
    farm.wait_for(lambda: own not in [pool.pool for pool in service.pools()] and
                  any(w["state"] == "ready" for w in workers(service)), 30, "another pool")


def test_keys_are_nowhere_else(service, place, keys):
    """Broken by a key in an argument, a log, or the store."""
    process, _ = connect(service, place / "one")
    family = [service.server.pid, process.pid, *farm.descendants(service.server.pid), *farm.descendants(process.pid)]
    for pid in family:
        line = pathlib.Path(f"/proc/{pid}/cmdline").read_bytes() + pathlib.Path(f"/proc/{pid}/environ").read_bytes()
        assert not any(key.encode() in line for key in keys.values())
    farm.stop_process(process)
    others = [path for path in [*service.data.rglob("*"), service.log] if path.is_file() and path.name != "worker-keys"]
    assert len(others) > 3
    for path in others:
        content = path.read_bytes()
        assert not any(key.encode() in content or bytes.fromhex(key) in content for key in keys.values()), path
    assert stat.S_IMODE((service.data / "worker-keys").stat().st_mode) == 0o600


def test_the_pool_renders_nothing_without_a_sandbox_when_others_can_reach_it(service):
    words = pathlib.Path(f"/proc/{service.pools()[0].pool}/cmdline").read_bytes().split(b"\0")
    assert words[words.index(b"--sandbox") + 1] == b"require"


def test_an_open_port_without_keys_does_not_open(tmp_path):
    for address in ("0.0.0.0:0", "[::]:0"):
        run = penumbra("serve", "--data", tmp_path, "--listen", "127.0.0.1:0", "--worker-listen", address, check=False)
        assert run.returncode == 1 and "penumbra worker add NAME" in run.stderr
        assert not (tmp_path / "ports").exists()


def test_on_loopback_the_first_key_closes_the_door(tmp_path):
    """Those who came without one go. Broken by a worker without a key beside those that have one."""
    with farm.Farm(0, data=tmp_path / "data") as service:
        process = service.connect_worker(1)
        farm.wait_for(lambda: workers(service), 30, "the worker")
        add(service.data, "one", tmp_path / "one")
        farm.wait_for(lambda: not workers(service), 10, "an empty farm")
        _, worker = connect(service, tmp_path / "one")
        penumbra("worker", "remove", "one", "--data", service.data)
        farm.wait_for(lambda: not workers(service), 10, "an empty farm")
        time.sleep(1)
        assert not workers(service) and process.poll() is None


@pytest.mark.parametrize("text, mode, told", [
    ("one " + "0" * 64, 0o640, "chmod 600"), ("one " + "0" * 63, 0o600, "no key"), ("0" * 64, 0o600, "no key"),
    ("one " + "0" * 65, 0o600, "no key"), ("n" * 65 + " " + "0" * 64, 0o600, "no key"), ("", 0o600, "no key")])
def test_a_worker_refuses_what_is_no_key(tmp_path, text, mode, told):
    file = tmp_path / "key"
    file.write_text(text)
    file.chmod(mode)
    run = subprocess.run([farm.program("penumbra-worker"), "--connect", "127.0.0.1:1", "--key-file", file],
                         capture_output=True, text=True, timeout=30)
    assert run.returncode == 1 and told in run.stderr


@pytest.mark.parametrize("arguments, code, complaint", [
    (("add",), 2, "take a name"), (("make", "x"), 2, "add, list or remove"), (("add", "/local"), 1, "letters"),
    (("remove", "nobody"), 1, "no worker nobody"), (("add", "twice"), 1, "already"), (("add", "x", "--scope", "y"), 2, "unknown")])
def test_what_the_command_does_not_take(tmp_path, arguments, code, complaint):
    penumbra("worker", "add", "twice", "--data", tmp_path)
    run = penumbra("worker", *arguments, "--data", tmp_path, check=False)
    assert run.returncode == code and complaint in run.stderr and run.stdout == ""
    assert penumbra("worker", "list", "--data", tmp_path).stdout == "twice\n"
