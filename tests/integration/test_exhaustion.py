# SPDX-License-Identifier: Apache-2.0
"""A coordinator that runs out of descriptors."""
import contextlib
import pathlib
import socket
import time

import farm
import scene

DESCRIPTORS = 64


def ticks(pid):
    """CPU time of a process, in hundredths of a second."""
    fields = pathlib.Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    return int(fields[11]) + int(fields[12])


def test_more_connections_than_descriptors():
    """Broken by a coordinator that spins on what it cannot accept, ends for it, or stays deaf when
    there is room again."""
    body = scene.build(64, 48, 16, [scene.sphere()], background=0.5)
    with farm.Farm(1, prefix=("prlimit", f"--nofile={DESCRIPTORS}:{DESCRIPTORS}")) as service:
        before = service.render(body)
        with contextlib.ExitStack() as stack:
            for _ in range(4 * DESCRIPTORS):
                connection = socket.socket()
                stack.callback(connection.close)
                connection.setblocking(False)
                connection.connect_ex(("127.0.0.1", service.http_port))
            time.sleep(0.5)
            begin, used = time.monotonic(), ticks(service.server.pid)
            time.sleep(2)
            share = (ticks(service.server.pid) - used) / 100 / (time.monotonic() - begin)
            assert share < 0.2, f"{share:.0%} of a core"
        farm.wait_for(lambda: answers(service), 30, "an answer when the others have gone")
        assert service.render(body) == before


def answers(service):
    try:
        return service.request("GET", "/livez", timeout=2).status == 200
    except OSError:
        return False
