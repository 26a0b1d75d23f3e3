# SPDX-License-Identifier: Apache-2.0
"""Crowds of clients of one coordinator: pollers and watchers of a render, and senders of new ones.

Latencies run from the moment at which a request was due, so that a client that is late because the
answer before it was late does not hide that.
"""
import asyncio
import gc
import json
import time

import scene

CONNECTIONS_MAX = 200 # of the senders


class Link:
    """A kept connection to the coordinator."""

    def __init__(self, port):
        self.port, self.reader, self.writer = port, None, None

    async def open(self):
        self.reader, self.writer = await asyncio.open_connection("127.0.0.1", self.port)

    async def head(self, method, path, body=b"", fields=""):
        """Asks; the status and the fields of the answer."""
        self.writer.write(f"{method} {path} HTTP/1.1\r\nHost: localhost\r\n{fields}"
                          f"Content-Length: {len(body)}\r\n\r\n".encode() + body)
        lines = (await self.reader.readuntil(b"\r\n\r\n")).decode().split("\r\n")
        pairs = [line.split(": ", 1) for line in lines[1:] if line]
        return int(lines[0].split()[1]), {name.lower(): value for name, value in pairs}

    async def ask(self, *request):
        status, fields = await self.head(*request)
        return status, await self.reader.readexactly(int(fields["content-length"]))

    def close(self):
        if self.writer:
            self.writer.close()


async def poll(link, render, start, seconds, latencies):
    for second in range(seconds):
        due = start + second
        await asyncio.sleep(max(0.0, due - time.monotonic()))
        status, _ = await link.ask("GET", f"/v1/renders/{render}")
        assert status == 200, f"a poll was answered {status}"
        latencies.append(time.monotonic() - due)


async def watch(link, render, counts):
    status, _ = await link.head("GET", f"/v1/renders/{render}/events")
    assert status == 200, f"a watcher was answered {status}"
    place = len(counts)
    counts.append(0)
    while await link.reader.readline():
        counts[place] += 1


async def look_on(port, render, pollers, watchers, seconds, around):
    """Each poller asks once a second, each at another moment of it; around(measured) is a context for
    the time that counts. The latencies, and the lines that each watcher was sent."""
    links = [Link(port) for _ in range(pollers + watchers)]
    latencies, lines = [], []
    for link in links:
        await link.open()
    watching = [asyncio.ensure_future(watch(link, render, lines)) for link in links[pollers:]]
    await asyncio.sleep(1)
    gc.freeze()
    with around:
        start = time.monotonic() + 0.1
        await asyncio.gather(*(poll(link, render, start + number / pollers, seconds, latencies)
                               for number, link in enumerate(links[:pollers])))
    for task in watching:
        assert not task.done(), "a watcher was sent away"
        task.cancel()
    for link in links:
        link.close()
    return latencies, lines


def tiny(number):
    """A scene of 64 x 64 pixels like no other."""
    return json.dumps(scene.build(64, 64, 4, [scene.sphere()], background=0.5, seed=number)).encode()


async def send_one(port, idle, body, due, answers):
    await asyncio.sleep(max(0.0, due - time.monotonic()))
    if idle.empty() and idle.opened < CONNECTIONS_MAX:
        idle.opened += 1
        link = Link(port)
        await link.open()
    else:
        link = await idle.get()
    status, found = await link.ask("POST", "/v1/renders", body, "Content-Type: application/json\r\n")
    answers.append((status, time.monotonic() - due, json.loads(found).get("id")))
    idle.put_nowait(link)


async def send(port, rate, seconds, first=0):
    """New renders at a steady rate, whatever becomes of those before: (status, seconds, id) of each."""
    idle, answers = asyncio.Queue(), []
    idle.opened = 0
    bodies = [tiny(first + number) for number in range(rate * seconds)]
    start = time.monotonic() + 0.1
    await asyncio.gather(*(send_one(port, idle, body, start + number / rate, answers)
                           for number, body in enumerate(bodies)))
    while not idle.empty():
        idle.get_nowait().close()
    return answers
