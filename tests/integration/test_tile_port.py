# SPDX-License-Identifier: Apache-2.0
"""The tile port against workers that are wrong, hostile or old. Frames are made by hand."""
import socket
import struct
import time

import farm
import pytest
import scene
from tile_peer import (HELLO, LEASE, MAGIC, REFUSE, SCENE_DATA, SCENE_GET, WELCOME, Peer, message,
                       pixels_of)


@pytest.fixture(scope="module")
def service():
    with farm.Farm(0, "--tile", 16) as running:
        yield running


@pytest.fixture
def peer(service):
    connected = Peer(service.worker_port)
    yield connected
    connected.socket.close()


def test_another_protocol_is_refused_with_a_reason(peer):
    """Broken by a worker that is cut off and never learns why."""
    peer.hello(protocol=2)
    assert b"version" in peer.wait_for(REFUSE)[1]
    assert peer.closed()


@pytest.mark.parametrize("data", [b"GET / HTTP/1.1\r\n\r\n" * 4, b"\x00" * 100, b"PENu" * 50,
                                  struct.pack("<IBBHIIQ", MAGIC, 1, HELLO, 10, 2 ** 32 - 1, 0, 0)])
def test_what_is_no_frame_closes_the_connection(service, peer, data):
    """Broken by waiting for the rest of nonsense, or by making room for it."""
    peer.socket.sendall(data)
    assert peer.closed()
    assert service.request("GET", "/livez").status == 200


def test_nothing_but_a_hello_comes_first(peer):
    """Broken by a lease for someone who has not said who it is."""
    peer.send(SCENE_GET, message(f1=b"\x00" * 32))
    assert peer.wait_for(REFUSE)
    assert peer.closed()


def test_silence_is_cut_off(service, peer):
    """Broken by connections that stay without a hello."""
    begin = time.monotonic()
    assert peer.closed()
    assert time.monotonic() - begin < 8 * farm.SLOW


def test_an_unknown_scene_is_said_to_be_missing(peer):
    """Broken by a worker that waits for ever."""
    peer.hello()
    peer.wait_for(WELCOME)
    peer.send(SCENE_GET, message(f1=b"\x07" * 32))
    assert peer.wait_for(SCENE_DATA)[4] == 1


def test_the_scene_comes_whole(service, peer):
    """Broken by pieces that are lost, doubled or out of order."""
    body = scene.build(16, 16, 1, [scene.sphere([i * 1e-3, 0, 0]) for i in range(6000)])
    render = service.submit(body)
    peer.hello()
    lease = peer.wait_for(LEASE)
    peer.send(SCENE_GET, message(f1=lease[13]))
    text, size = b"", None
    while size is None or len(text) < size:
        kind, fields, payload = peer.receive()
        if kind == SCENE_DATA:
            assert fields.get(3, 0) == len(text)
            text, size = text + payload, fields[2]
    assert size > 2 * (256 << 10), "several pieces"
    import hashlib
    assert hashlib.sha256(text).digest() == lease[13]
    peer.result(lease, pixels_of(lease, 0.5))
    service.wait(render)


def test_stale_results_are_dropped(service, peer):
    """Broken by merging what was not leased, or twice."""
    render = service.submit(scene.build(16, 16, 2, [scene.sphere()]))
    peer.hello()
    first = peer.wait_for(LEASE)
    for wrong in ({**first, 1: first[1] + 1000}, {**first, 3: 7}, {**first, 4: 1}, {**first, 5: 1}):
        peer.result(wrong, pixels_of(first, 9))
    peer.result(first, pixels_of(first, 0.25))
    peer.result(first, pixels_of(first, 9))
    second = peer.wait_for(LEASE)
    assert second[5] == 1
    peer.result(second, pixels_of(second, 0.25))
    service.wait(render)
    frame = (service.data / "frames" / f"{render}.f32").read_bytes()
    pixels = frame[:16 * 16 * 16]  # the seal stands behind
    assert set(struct.iter_unpack("<4f", pixels)) == {(0.5, 0.5, 0.5, 2.0)}


@pytest.mark.parametrize("spoil, reason", [
    (lambda pixels: struct.pack("<f", float("nan")) + pixels[4:], "finite"),
    (lambda pixels: struct.pack("<f", float("inf")) + pixels[4:], "finite"),
    (lambda pixels: pixels[:-16], "size"),
    (lambda pixels: pixels[:12] + struct.pack("<f", 2) + pixels[16:], "count"),
])
def test_wrong_pixels_are_the_workers_fault(service, peer, spoil, reason):
    """Broken by merging them, or by going on for ever with a worker that makes no others."""
    render = service.submit(scene.build(16, 16, 1, [scene.sphere()]))
    peer.hello(class_=f"test/{reason}", name="bad")
    for _ in range(3):
        lease = peer.wait_for(LEASE)
        peer.result(lease, spoil(pixels_of(lease, 1)))
    found = service.wait(render, state="failed")
    assert "tile 0" in str(found["error"]) and reason in str(found["error"])
    strikes = [w["strikes"] for w in service.get("/v1/workers")["workers"] if w["name"] == "bad"]
    assert strikes == [3]


def test_a_worker_that_does_not_read_is_cut_off(service, peer):
    """Broken by a coordinator that keeps everything for it in memory."""
    peer.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    peer.hello(name="deaf")
    try:
        for _ in range(200000):
            peer.send(SCENE_GET, message(f1=b"\x07" * 32))
    except OSError:
        pass
    gone = [w for w in service.get("/v1/workers")["workers"] if w["name"] == "deaf"]
    farm.wait_for(lambda: not [w for w in service.get("/v1/workers")["workers"]
                               if w["name"] == "deaf"], 15, f"end of {gone}")
