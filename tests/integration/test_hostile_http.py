# SPDX-License-Identifier: Apache-2.0
"""Requests that no honest client sends (tests/support/hostile_http.py), and clients that do nothing
but keep their place (slowhttptest): the server answers as it should and serves the others."""
import concurrent.futures
import http.client
import pathlib
import re
import select
import shutil
import socket
import subprocess
import time

import farm
import pytest
from hostile_http import CASES
from http_server import Server

ANSWER = re.compile(rb"HTTP/1\.[01] (\d\d\d) ")
LIKELY = {"200", "206", "400", "404", "405", "413", "414", "415", "416", "421", "431", "501", "505",
          "waits"}


@pytest.fixture(scope="module")
def server():
    with Server() as running:
        yield running


def statuses(data):
    """Of the answers in a stream."""
    found = []
    while data:
        match = ANSWER.match(data)
        head, end, rest = data.partition(b"\r\n\r\n")
        if not match or not end:
            return found + [f"no answer: {data[:60]!r}"]
        found.append(match[1].decode())
        length = re.search(rb"\r\ncontent-length: (\d+)", head, re.IGNORECASE)
        # An answer to HEAD has the length and not the body. libmicrohttpd 0.9.75 sends the header
        # of some refusals twice; nobody looks at what follows the first, but for a second answer.
        if re.search(rb"\r\nconnection: close", head, re.IGNORECASE):
            return found + ["404"] * (b" 404 Not Found" in rest)
        if not ANSWER.match(rest):
            rest = rest[int(length[1]) if length else 0:]
        data = rest
    return found


def exchange(port, data):
    """The answers until the server closes, or is silent; "waits" when it says and does nothing."""
    got = b""
    with socket.create_connection(("127.0.0.1", port)) as link:
        try:
            link.sendall(data)
        except OSError:
            pass  # refused before all was sent
        while select.select([link], [], [], min(0.5 if got else 2, 8 / farm.SLOW) * farm.SLOW)[0]:
            try:
                piece = link.recv(65536)
            except ConnectionError:
                piece = b""
            if not piece:
                return statuses(got)
            got += piece
    return statuses(got) or ["waits"]


def asset(server):
    """A request that is answered from another thread: it needs the loop itself, not HTTP alone."""
    start = time.monotonic()
    name = "0" * 64
    assert server.ask("PUT", f"/v1/assets/sha256/{name}", b"hello").status == 422
    return time.monotonic() - start


def test_each_is_answered_as_it_should(server):
    """Breaks if a request ends elsewhere for us than for a proxy, hangs, or harms the others."""
    assert len(CASES) >= 500
    delays = []
    with concurrent.futures.ThreadPoolExecutor(32) as pool:
        asked = {name: pool.submit(exchange, server.port, data) for name, (data, _) in CASES.items()}
        while not all(future.done() for future in asked.values()):
            delays.append(asset(server))
            time.sleep(0.05)
    found = {name: future.result() for name, future in asked.items()}
    wrong = {name: got for name, got in found.items()
             if " ".join(got) not in CASES[name][1]
             and (CASES[name][1] or not set(got) <= LIKELY)}
    for name, got in wrong.items():
        print(name, CASES[name][1], "->", got)
    assert not wrong
    assert len(delays) > 10 and max(delays) < 2 * farm.SLOW, delays


def test_a_request_that_libmicrohttpd_never_finishes(server):
    """Breaks if it is run again and again in its place, so that nothing else has a turn."""
    name = next(name for name in CASES if name.startswith("chunk ") and b"a" * 40000 in CASES[name][0])
    with socket.create_connection(("127.0.0.1", server.port)) as link:
        link.sendall(CASES[name][0])
        time.sleep(0.3)
        before = farm.processor_seconds([server.process.pid])
        assert asset(server) < farm.SLOW
        time.sleep(1)
        assert farm.processor_seconds([server.process.pid]) - before < 0.25 * farm.SLOW


CLIENTS, ATTACK_S = 500, 8
MIB = 1 << 20
# What keeps its place: headers, bodies and readers that never come to an end.
ATTACKS = {
    "headers": ["-H", "-i", "2", "-u", "/livez"],
    "bodies": ["-B", "-i", "2", "-s", "8192", "-f", "application/json", "-u", "/v1/renders"],
    "readers": ["-X", "-n", "2", "-w", "1024", "-y", "2048", "-z", "8", "-k", "10", "-u", "/openapi.json"],
}


def resident(process):
    text = pathlib.Path(f"/proc/{process.pid}/statm").read_text()
    return int(text.split()[1]) * 4096


def poll(port, until):
    """The 99th percentile of an honest client's polls in ms."""
    link = http.client.HTTPConnection("127.0.0.1", port, timeout=20)
    times = []
    while not until():
        begin = time.monotonic()
        link.request("GET", "/v1/renders/running")
        answer = link.getresponse()
        assert answer.status == 200 and answer.read()
        times.append(1000 * (time.monotonic() - begin))
        time.sleep(0.005)
    link.close()
    assert len(times) > 100
    return sorted(times)[len(times) * 99 // 100]


def until(seconds):
    end = time.monotonic() + seconds
    return lambda: time.monotonic() > end


def besiege(server, attack):
    """Whether 500 slow clients leave an honest one's 99th percentile within twice its usual."""
    *options, path = ATTACKS[attack]
    base = poll(server.port, until(2))
    slow = subprocess.Popen(
        ["slowhttptest", "-c", str(CLIENTS), "-r", str(CLIENTS), "-l", str(ATTACK_S), *options,
         f"http://localhost:{server.port}{path}"],
        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    time.sleep(1)  # in which it opens its connections, on the same processors
    found = poll(server.port, lambda: slow.poll() is not None)
    assert slow.returncode == 0
    print(f"{attack}: p99 {base:.2f} ms alone, {found:.2f} ms among {CLIENTS}")
    return found < max(2 * base, 5) * farm.SLOW and found < 100 * farm.SLOW


@pytest.mark.skipif(not shutil.which("slowhttptest"), reason="needs slowhttptest")
@pytest.mark.parametrize("attack", ATTACKS)
def test_slow_clients_cost_the_others_nothing(attack):
    """Breaks if 500 clients that never get done slow others down, or leave memory behind. Once of
    three times is enough: other processes own the processors too."""
    with Server() as server:
        poll(server.port, until(1))
        memory = resident(server.process)
        assert any(besiege(server, attack) for _ in range(3))
        farm.wait_for(lambda: resident(server.process) < memory + 4 * MIB, 20, "memory")
