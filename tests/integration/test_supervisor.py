# SPDX-License-Identifier: Apache-2.0
"""What the coordinator says to a service manager, and takes from it."""
import json
import os
import signal
import socket
import subprocess
import sys

import pytest
from farm import program

# Takes a descriptor to where sd_listen_fds(3) looks for it, and becomes the coordinator.
ACTIVATE = """
import os, sys
os.dup2(int(sys.argv[1]), 3)
os.environ.update(LISTEN_PID=str(os.getpid()), LISTEN_FDS="1", LISTEN_FDNAMES=sys.argv[2])
os.execv(sys.argv[3], sys.argv[3:])
"""


@pytest.fixture
def manager(tmp_path):
    """A datagram socket in the place of the service manager's."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as ears:
        ears.bind(str(tmp_path / "notify"))
        ears.settimeout(20)
        yield ears


def start(tmp_path, listener, name="http", **environment):
    os.set_inheritable(listener.fileno(), True)
    return subprocess.Popen(
        [sys.executable, "-c", ACTIVATE, str(listener.fileno()), name, program("penumbra"),
         "serve", "--data", str(tmp_path / "data"), "--worker-listen", "127.0.0.1:0",
         "--listen", "127.0.0.1:0", "--processes", "0"],
        env={**os.environ, "NOTIFY_SOCKET": str(tmp_path / "notify"), **environment},
        pass_fds=[listener.fileno()], stderr=subprocess.PIPE, text=True)


def hear(manager, word):
    """The first message with that word; others come in between."""
    while True:
        message = manager.recv(4096).decode()
        if word in message:
            return message


def test_it_is_ready_only_when_it_serves_and_tells_when_it_stops(tmp_path, manager):
    """Breaks when READY is told before the socket answers, or STOPPING after it has closed."""
    with socket.create_server(("127.0.0.1", 0)) as listener:
        server = start(tmp_path, listener)
        assert "STATUS=" in hear(manager, "READY=1")
        port = listener.getsockname()[1]
        assert json.loads((tmp_path / "data/ports").read_text())["http"] == port
        with socket.create_connection(("127.0.0.1", port), timeout=5) as client:
            client.sendall(b"GET /livez HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n")
            assert client.recv(64).startswith(b"HTTP/1.1 200")
        server.send_signal(signal.SIGTERM)
        hear(manager, "STOPPING=1")
        assert server.wait(timeout=20) == 0


def test_a_reload_ends_nothing(tmp_path, manager):
    """Breaks when systemctl reload ends a coordinator that has no certificate."""
    with socket.create_server(("127.0.0.1", 0)) as listener:
        server = start(tmp_path, listener)
        hear(manager, "READY=1")
        server.send_signal(signal.SIGHUP)
        server.send_signal(signal.SIGTERM)
        hear(manager, "STOPPING=1")
        _, told = server.communicate(timeout=20)
        assert server.returncode == 0 and "no certificate to read again" in told, told


def test_the_watchdog_hears_from_a_living_loop_only(tmp_path, manager):
    """Breaks when the pings come from anything but the loop: a stopped one would go on."""
    with socket.create_server(("127.0.0.1", 0)) as listener:
        server = start(tmp_path, listener, WATCHDOG_USEC="200000")
        hear(manager, "READY=1")
        hear(manager, "WATCHDOG=1")
        server.send_signal(signal.SIGSTOP)
        manager.settimeout(1)
        with pytest.raises(TimeoutError):
            for _ in range(100):
                manager.recv(4096)
        server.send_signal(signal.SIGCONT)
        manager.settimeout(20)
        hear(manager, "WATCHDOG=1")
        server.terminate()
        assert server.wait(timeout=20) == 0


def test_a_socket_of_another_name_is_left_alone(tmp_path, manager):
    """Breaks when any inherited socket is taken for the HTTP interface."""
    with socket.create_server(("127.0.0.1", 0)) as listener:
        server = start(tmp_path, listener, name="other")
        hear(manager, "READY=1")
        ports = json.loads((tmp_path / "data/ports").read_text())
        assert ports["http"] != listener.getsockname()[1]
        server.terminate()
        assert server.wait(timeout=20) == 0


def test_an_inherited_socket_is_bound_by_the_same_rule_as_listen(tmp_path):
    """Breaks when socket activation opens the port to other machines."""
    with socket.create_server(("0.0.0.0", 0)) as listener:
        server = start(tmp_path, listener)
        reason = server.communicate(timeout=20)[1]
        assert server.returncode == 1 and "penumbra token add" in reason
