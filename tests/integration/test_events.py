# SPDX-License-Identifier: Apache-2.0
"""The events of a render, as a browser follows them."""
import json
import signal
import socket
import time

import farm
import pytest
import scene
from events import Stream
from http_server import JSON, Server, problem

SCENE = scene.build(256, 144, 64, [scene.sphere()])


@pytest.fixture(scope="module")
def server():
    with Server() as running:
        yield running


def patch(server, render, change):
    assert server.ask("PATCH", f"/v1/renders/{render}", json.dumps(change), JSON).status == 200


def test_a_client_that_comes_is_told_what_there_is(server):
    """Breaks if a viewer that comes late misses the tiles that came before it."""
    with Stream(server.port, "paused") as stream:
        assert stream.headers["Content-Type"] == "text/event-stream"
        events = iter(stream)
        tiles, progress = next(events), next(events)
    assert (tiles.name, progress.name) == ("tiles", "progress")
    assert tiles.data["tiles"] == [[0, 0, 16, 16], [16, 0, 16, 16], [32, 0, 8, 16]]
    assert progress.data["state"] == "paused" and progress.data["tiles_done"] == 3


def test_what_happens_is_told_once(server):
    """Breaks if a tile is lost, told twice, or told more than a fifth of a second late."""
    with Stream(server.port, "running") as stream:
        events = iter(stream)
        first = [next(events), next(events)]
        server.process.send_signal(signal.SIGUSR1)
        sent = time.monotonic()
        second = [next(events), next(events)]
        assert second[1].at - sent < 0.4 * farm.SLOW
        assert [e.name for e in first + second] == ["tiles", "progress"] * 2
        assert second[0].data["tiles"] == [[0, 16, 16, 8]]
        assert second[1].id > first[1].id


def test_a_client_goes_on_where_it_was(server):
    """Breaks if a client that was away is told everything again, or not what it missed."""
    render = json.loads(server.post(SCENE).body)["id"]
    with Stream(server.port, render) as stream:
        first = next(iter(stream))
    patch(server, render, {"priority": 7})
    with Stream(server.port, render, first.id) as stream:
        second = next(iter(stream))
        assert second.id > first.id
    with Stream(server.port, render, second.id) as stream:
        patch(server, render, {"state": "cancelled"})
        done = list(stream)
    assert [(e.name, e.data["state"]) for e in done] == [("done", "cancelled")]
    assert done[0].id > second.id


@pytest.mark.parametrize("last", ["", "x", "-1", "99999999999999999999999", str(1 << 62)])
def test_an_id_that_is_none_says_nothing(server, last):
    with Stream(server.port, "paused", last) as stream:
        assert next(iter(stream)).name == "tiles"


@pytest.mark.parametrize("state", ["done", "failed", "cancelled"])
def test_of_a_render_that_is_over_the_end_is_told(server, state):
    """Breaks if a browser, which comes back when a stream ends, comes back for ever."""
    with Stream(server.port, state) as stream:
        (event,) = stream
    assert event.name == "done" and event.data["state"] == state
    with Stream(server.port, state, event.id) as stream:
        assert stream.status == 204


def test_a_removed_render_ends_its_streams(server):
    render = json.loads(server.post(SCENE).body)["id"]
    with Stream(server.port, render) as stream:
        events = iter(stream)
        next(events)
        assert server.ask("DELETE", f"/v1/renders/{render}").status == 204
        assert [(e.name, e.data) for e in events] == [("done", None)]


@pytest.mark.parametrize("render, status", [("nothing", 404), ("removed", 410)])
def test_of_what_is_not_there_nothing_is_told(server, render, status):
    problem(server.get(f"/v1/renders/{render}/events"), status)


def test_the_number_of_streams_is_bounded():
    """Breaks if clients that follow can take all connections, or their places are not given back:
    1024 are served, the next is refused, and the service stays awake."""
    with Server() as server:
        request = b"GET /v1/renders/queued/events HTTP/1.1\r\nHost: localhost\r\n\r\n"
        links = []
        for _ in range(1024):
            links.append(socket.create_connection(("127.0.0.1", server.port)))
            links[-1].sendall(request)
        assert all(link.recv(12) == b"HTTP/1.1 200" for link in links)
        problem(server.get("/v1/renders/queued/events"), 503)
        assert server.get("/livez").ms < 50 * farm.SLOW
        for link in links:
            link.close()
        server.process.send_signal(signal.SIGUSR1)  # makes the service write to all of them

        def admitted():
            with Stream(server.port, "queued") as stream:
                return stream.status == 200

        farm.wait_for(admitted, 5, "a place for another stream")


def test_a_client_that_takes_nothing_costs_nothing():
    """Breaks if events are kept for a client that does not read them."""
    with Server() as server:
        def resident():
            with open(f"/proc/{server.process.pid}/statm") as file:
                return int(file.read().split()[1]) * 4096

        render = json.loads(server.post(SCENE).body)["id"]
        with socket.create_connection(("127.0.0.1", server.port)) as link:
            link.sendall(b"GET /v1/renders/%s/events HTTP/1.1\r\nHost: localhost\r\n\r\n"
                         % render.encode())
            before = resident()
            for i in range(500):
                patch(server, render, {"priority": i % 101})
            assert resident() - before < 1 << 20


def test_a_whole_render_is_told():
    """Breaks if no tiles of a real render are told, if more than five changes come a second, or if
    the ids do not rise."""
    with farm.Farm(processes=1) as service:
        render = service.submit(scene.build(256, 144, 1024, [scene.sphere()]))
        with Stream(service.http_port, render) as stream:
            events = list(stream)
        ids = [event.id for event in events if event.id is not None]
        assert ids == sorted(set(ids))
        assert events[-1].name == "done" and events[-1].data["state"] == "done"
        times = [event.at for event in events if event.name == "progress"]
        assert all(b - a > 0.15 for a, b in zip(times, times[1:]))
        tiles = [tuple(t) for event in events if event.name == "tiles" for t in event.data["tiles"]]
        assert tiles and all(x < 256 and y < 144 and w * h > 0 for x, y, w, h in tiles)


def test_who_is_at_work_is_told():
    """Breaks if a tile is told of a worker that does not hold it, none is, or the last are never taken
    back: when nobody may go on, nobody holds anything."""
    with farm.Farm(2) as service:
        worker, = farm.wait_for(lambda: service.get("/v1/workers")["workers"], 20, "a worker")
        render = service.submit(scene.build(256, 144, 65536, [scene.sphere()]))
        with Stream(service.http_port, render) as stream:
            held = (event.data["workers"] for event in stream if event.name == "held")
            busy = next(workers for workers in held if workers and len(workers[0]["tiles"]) == 2)
            assert [(w["id"], w["name"]) for w in busy] == [(worker["id"], worker["name"])]
            tiles = [tuple(tile) for tile in busy[0]["tiles"]]
            assert len(set(tiles)) == 2
            assert all(frame == 1 and x + w <= 256 and y + h <= 144 and w * h > 0 for frame, x, y, w, h in tiles)
            assert service.patch(render, {"state": "paused"}).status == 200
            assert next(workers for workers in held if not workers) == []


def test_stopping_with_streams_open():
    """Breaks if the service cannot end while clients follow; __exit__ checks the code."""
    with Server() as server:
        streams = [Stream(server.port, state) for state in ["queued", "running", "paused"]]
        for stream in streams:
            next(iter(stream))
    for stream in streams:
        stream.connection.close()


def test_after_a_restart_a_client_gets_what_it_lacks():
    """Breaks if revisions begin anew with the coordinator: the client would wait for ever."""
    with farm.Farm(processes=0) as service:
        render = service.submit(SCENE)
        with Stream(service.http_port, render) as stream:
            first = next(iter(stream))
        service.stop()
        service.start()
        with Stream(service.http_port, render, first.id) as stream:
            second = next(iter(stream))
        assert second.name == "progress" and second.id > first.id


def test_a_silent_stream_is_pinged(server):
    """Breaks if a proxy would take a quiet stream for a dead one, or a client that has left is
    never noticed."""
    with Stream(server.port, "paused", timeout=20 * farm.SLOW) as stream:
        events = iter(stream)
        next(events), next(events)
        start = time.monotonic()
        line = stream.answer.readline()
        while not line.startswith(b":"):
            line = stream.answer.readline()
        assert 14 < time.monotonic() - start < 17 * farm.SLOW
