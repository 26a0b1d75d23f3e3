# SPDX-License-Identifier: Apache-2.0
"""Clients that send or take a byte now and then: each is let go in time, the patient ones are not.

All wait at the same time: each deadline is some ten seconds, whose numbers are in
core/base/limits.h.
"""
import concurrent.futures
import json
import select
import socket
import time

import farm
import scene
from http_server import Server

HEADER_S, IDLE_S, GRACE_S, RATE = 10, 15, 10, 1024
LONGER_S = 19  # than every deadline, for who must not be cut off
HOST = b"Host: localhost\r\n"
LIVE = b"GET /livez HTTP/1.1\r\n" + HOST + b"\r\n"


class Link:
    """A connection that tells how long the server kept it."""

    def __init__(self, port, receive=None):
        self.socket = socket.socket()
        if receive:
            self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive)
            # As over a network: loopback's large segments make the server's own buffers large.
            self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_MAXSEG, 536)
        self.socket.connect(("127.0.0.1", port))
        self.got = b""
        self.start = time.monotonic()

    def read(self, seconds, most=65536):
        """False when the server has closed."""
        if not select.select([self.socket], [], [], seconds)[0]:
            return True
        try:
            piece = self.socket.recv(most)
        except ConnectionError:
            return False
        self.got += piece
        return piece != b""

    def kept(self, send=b"", pace=0.5, seconds=2 * LONGER_S):
        """Seconds until the server closed, while one piece after the other is sent at a pace."""
        self.start = time.monotonic()
        pieces = iter(send) if isinstance(send, list) else None
        while time.monotonic() < self.start + seconds:
            try:
                self.socket.sendall(next(pieces, b"") if pieces else send)
            except ConnectionError:
                break
            turn = time.monotonic() + pace
            while (left := turn - time.monotonic()) > 0:
                if not self.read(left):
                    return time.monotonic() - self.start
        return time.monotonic() - self.start


def slow_header(port):
    link = Link(port)
    link.socket.sendall(b"GET /livez HTTP/1.1\r\n")
    return HEADER_S, link.kept(b"A: b\r\n")


def silent(port):
    return HEADER_S, Link(port).kept()


def slow_second_header(port):
    """On a connection that has been used and rested: the time begins with the first byte."""
    link = Link(port)
    link.socket.sendall(LIVE)
    rested = link.kept(seconds=6)
    assert link.got.startswith(b"HTTP/1.1 200 ") and rested >= 6
    return HEADER_S, link.kept(b"G")


def resting(port):
    link = Link(port)
    link.socket.sendall(LIVE)
    return IDLE_S, link.kept()


def polling(port):
    link = Link(port)
    kept = link.kept(LIVE, pace=3, seconds=LONGER_S)
    assert link.got.count(b"HTTP/1.1 200 ") >= LONGER_S // 3
    return None, kept


def body(length):
    return b"POST /v1/renders HTTP/1.1\r\n" + HOST + b"Content-Length: %d\r\n\r\n" % length


def slow_body(port):
    """10 bytes a second, which libmicrohttpd's timeout would bear for ever."""
    link = Link(port)
    link.socket.sendall(body(100000))
    return GRACE_S, link.kept(b" " * 5)


def slow_chunks(port):
    link = Link(port)
    link.socket.sendall(b"POST /v1/renders HTTP/1.1\r\n" + HOST +
                        b"Transfer-Encoding: chunked\r\n\r\n")
    return GRACE_S, link.kept(b"1\r\n \r\n")


def steady_body(port):
    """Twice the least rate for longer than the grace, and then its answer."""
    text = json.dumps(scene.build(8, 8, 1, [scene.sphere()])).encode().ljust(LONGER_S * 2 * RATE)
    pieces = [text[i:i + RATE] for i in range(0, len(text), RATE)]
    link = Link(port)
    link.socket.sendall(body(len(text)))
    kept = link.kept(pieces, seconds=LONGER_S + 2)
    assert link.got.startswith(b"HTTP/1.1 202 "), link.got
    return None, kept


def slow_reader(port):
    """Asks for more than the kernel holds for it, and takes 50 bytes a second."""
    link = Link(port, receive=2048)
    link.socket.sendall((b"GET /openapi.json HTTP/1.1\r\n" + HOST + b"\r\n") * 400)
    gone = select.poll()
    gone.register(link.socket, select.POLLHUP | select.POLLERR)
    while not gone.poll(200) and time.monotonic() < link.start + 2 * LONGER_S:
        link.socket.recv(10)
    return GRACE_S, time.monotonic() - link.start


def events(port):
    link = Link(port)
    link.socket.sendall(b"GET /v1/renders/running/events HTTP/1.1\r\n" + HOST + b"\r\n")
    kept = link.kept(seconds=LONGER_S)
    assert b"text/event-stream" in link.got
    return None, kept


def waiting(port):
    link = Link(port)
    link.socket.sendall(b"GET /v1/renders/running HTTP/1.1\r\n" + HOST +
                        b"Prefer: wait=20\r\nIf-None-Match: *\r\n\r\n")
    return None, link.kept(seconds=LONGER_S)


SLOW = [slow_header, silent, slow_second_header, resting, slow_body, slow_chunks, slow_reader]
PATIENT = [polling, steady_body, events, waiting]


def test_slow_clients_are_let_go_and_patient_ones_are_not():
    """Breaks if any deadline is of inactivity alone, or cuts off who waits with good reason."""
    with Server() as server, concurrent.futures.ThreadPoolExecutor(20) as pool:
        asked = {f.__name__: pool.submit(f, server.port) for f in SLOW + PATIENT}
        found = {name: future.result() for name, future in asked.items()}
        assert server.get("/livez").status == 200
    wrong = {name: (deadline, kept) for name, (deadline, kept) in found.items()
             if not (kept >= LONGER_S if deadline is None else
                     deadline - 1 <= kept <= deadline + 3 * farm.SLOW)}
    assert not wrong, wrong


def test_answers_that_nobody_takes_are_bounded():
    """Breaks if clients that ask and do not read fill the memory, or lock the others out for good."""
    renders, mib = 400, 1 << 20
    with farm.Farm(0) as service:
        for seed in range(renders):
            body = {"scene": scene.build(16, 16, 1, [scene.sphere()], seed=seed), "options": {"name": "n" * 256}}
            service.submit(body)
        size = {n: len(service.request("GET", f"/v1/renders?limit={n}").body) for n in (1, 2, renders)}
        page, most = size[renders], 256 * mib // size[renders]
        links = []

        def ask(limit):
            links.append(Link(service.http_port, receive=2048))
            links[-1].socket.sendall(b"GET /v1/renders?limit=%d HTTP/1.1\r\n%s\r\n" % (limit, HOST))

        for _ in range(most + 40):
            ask(renders)
        for link in links:
            link.read(10, 16)
        refused = sum(link.got.startswith(b"HTTP/1.1 503") for link in links)
        assert 20 <= refused <= 60, f"{refused} of {len(links)} with {page} bytes each"
        # So much more that there is no room for what is told of a new render, which is accepted all the same.
        ask(1 + (256 * mib - most * page - size[1]) // (size[2] - size[1]))
        assert b" 200 " in (links[-1].read(10, 16) and links[-1].got)
        body = {"scene": scene.build(16, 16, 1, [scene.sphere()], seed=renders), "options": {"name": "n" * 256}}
        answer = service.post(body)
        assert answer.status == 202 and len(answer.body) > size[2] - size[1] - 64, answer.body
        for link in links:
            link.socket.close()
        farm.wait_for(lambda: service.request("GET", f"/v1/renders?limit={renders}").status == 200, 5, "room")
