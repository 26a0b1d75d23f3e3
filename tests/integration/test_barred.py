# SPDX-License-Identifier: Apache-2.0
"""A worker with a key of its own that sent wrong pixels, and comes back.

openssl carries the liar's frames in TLS."""
import contextlib
import socket
import subprocess

import farm
import pytest
from test_verify import Liar, state_of_liar, subject
from test_worker_keys import add, handshake, psk


@pytest.fixture
def service(tmp_path):
    add(tmp_path / "data", "one", tmp_path / "one")
    with farm.Farm(1, "--tile", 16, data=tmp_path / "data") as running:
        yield running


@contextlib.contextmanager
def tunnel(service, key):
    """A link to the port for workers, of the worker "one"."""
    here, there = socket.socketpair()
    here.settimeout(10 * farm.SLOW)
    client = subprocess.Popen(
        ["openssl", "s_client", "-quiet", "-nocommands", "-connect", f"127.0.0.1:{service.worker_port}",
         *psk("one", key)], stdin=there, stdout=there, stderr=subprocess.DEVNULL)
    there.close()
    try:
        with here:
            yield here
    finally:
        client.kill()
        client.wait()


def gone(service):
    farm.wait_for(lambda: not state_of_liar(service), 20, "end of the connection")


def knock(service, key):
    """The state it has as soon as it is welcomed."""
    with tunnel(service, key) as link:
        Liar(service, link=link)
        state = farm.wait_for(lambda: state_of_liar(service), 20, "the liar again")
    gone(service)
    return state


def test_a_liar_that_comes_back(service, tmp_path):
    """Broken by a conviction that a new connection ends, or that nothing ends."""
    key = (tmp_path / "one").read_text().split()[1]
    undisturbed = service.render(subject(), 120)
    with tunnel(service, key) as link:
        liar = Liar(service, link=link)
        liar.start()
        farm.wait_for(lambda: state_of_liar(service), 20, "the liar")
        render = service.submit({"scene": subject(), "options": {"verify": "full"}})
        service.wait(render, 120)
        assert liar.lies > 0 and service.image(render) == undisturbed
    gone(service)

    assert knock(service, key) == ["quarantined"]
    with tunnel(service, key) as link:
        liar = Liar(service, link=link)
        liar.start()
        farm.wait_for(lambda: state_of_liar(service) == ["quarantined"], 20, "the liar again")
        assert service.render(subject(65), 120) and liar.lies == 0
        worker = next(w for w in service.get("/v1/workers")["workers"] if w["name"] == "liar")
        assert service.request("POST", f"/v1/workers/{worker['id']}/reset").status in (200, 204)
        farm.wait_for(lambda: state_of_liar(service) == ["ready"], 20, "its pardon")
    gone(service)
    assert knock(service, key) == ["ready"]


def test_a_new_key_is_a_new_start(service, tmp_path):
    """Broken by a name that is barred instead of a key."""
    key = (tmp_path / "one").read_text().split()[1]
    with tunnel(service, key) as link:
        Liar(service, link=link).start()
        farm.wait_for(lambda: state_of_liar(service), 20, "the liar")
        service.wait(service.submit({"scene": subject(), "options": {"verify": "full"}}), 120)
    gone(service)
    subprocess.run([farm.program("penumbra"), "worker", "remove", "one", "--data", tmp_path / "data"],
                   check=True, capture_output=True)
    key = add(tmp_path / "data", "one", tmp_path / "again")
    farm.wait_for(lambda: handshake(service, *psk("one", key))[0], 20, "the new key to be seen")
    assert knock(service, key) == ["ready"]
