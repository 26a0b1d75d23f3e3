# SPDX-License-Identifier: Apache-2.0
"""A coordinator that runs out of descriptors, or of memory."""
import concurrent.futures
import contextlib
import json
import pathlib
import resource
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


SPARE = 24 << 20
HUNGRY = 40000 # objects; their tree takes more than SPARE


def limit_memory(service, more=None):
    """Of address space the coordinator alone gets so much more than it has, or again any."""
    pages = int(pathlib.Path(f"/proc/{service.server.pid}/statm").read_text().split()[0])
    hard = resource.prlimit(service.server.pid, resource.RLIMIT_AS)[1]
    soft = hard if more is None else pages * resource.getpagesize() + more
    resource.prlimit(service.server.pid, resource.RLIMIT_AS, (soft, hard))


def post(service, text):
    """The status, or 0 when the connection was dropped."""
    try:
        return service.request("POST", "/v1/renders", text, {"Content-Type": "application/json"}).status
    except OSError:
        return 0


def test_more_scenes_than_memory():
    """Broken by a coordinator that ends, or spins, where a scene finds no memory; by a refusal that
    blames the scene; by a render that suffers; or by a lack that lasts."""
    body = scene.build(64, 48, 600, [scene.sphere()], background=0.5)
    hungry = json.dumps(scene.build(64, 48, 1, [scene.sphere([n, 0, 0]) for n in range(HUNGRY)]))
    with farm.Farm(1, "--tile", 16) as service:
        undisturbed = service.render(body)
        limit_memory(service, SPARE)
        render = service.submit(body)
        with concurrent.futures.ThreadPoolExecutor(4) as pool:
            found = list(pool.map(lambda _: post(service, hungry), range(8)))
        assert set(found) <= {0, 503} and 503 in found, found
        begin, used = time.monotonic(), ticks(service.server.pid)
        time.sleep(2)
        share = (ticks(service.server.pid) - used) / 100 / (time.monotonic() - begin)
        assert share < 0.2, f"{share:.0%} of a core"
        # A worker whose connection found no memory is started anew, and the new one has the limit too.
        limit_memory(service)
        service.wait(render)
        assert service.image(render) == undisturbed
        service.wait(service.submit(hungry))
