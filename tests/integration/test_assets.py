# SPDX-License-Identifier: Apache-2.0
"""Assets over HTTP: stored once, whole and for good, or not at all."""
import hashlib
import http.client
import json
import os
import socket
import struct

import pytest
from farm import Farm, wait_for

DATA = bytes(range(256)) * 1000
NAME = hashlib.sha256(DATA).hexdigest()
PATH = f"/v1/assets/sha256/{NAME}"


@pytest.fixture(scope="module")
def farm():
    with Farm(processes=0) as running:
        yield running


def put(farm, data, name=None, **headers):
    name = name or hashlib.sha256(data).hexdigest()
    return farm.request("PUT", f"/v1/assets/sha256/{name}", data, headers)


def stored(farm):
    return sorted(os.listdir(farm.data / "assets"))


def glb(tree):
    """A GLB of JSON alone."""
    text = json.dumps(tree).encode()
    text += b" " * (-len(text) % 4)
    return struct.pack("<4sIIII", b"glTF", 2, 20 + len(text), len(text), 0x4E4F534A) + text


EMPTY = glb({"asset": {"version": "2.0"}})


def test_an_asset_is_stored_once_under_its_hash(farm):
    """Breaks when a second upload is taken for a new one, or the file differs from the bytes."""
    assert farm.request("HEAD", PATH).status == 404
    assert put(farm, DATA).status == 201
    assert put(farm, DATA).status == 200
    assert farm.request("HEAD", PATH).status == 200
    assert (farm.data / "assets" / NAME).read_bytes() == DATA


def test_bytes_with_another_hash_leave_nothing(farm):
    """Breaks when a name can be given to bytes that are not its own."""
    before = stored(farm)
    answer = put(farm, b"other bytes", name="0" * 64)
    assert answer.status == 422 and b"SHA-256" in answer.body
    assert stored(farm) == before


@pytest.mark.parametrize("name", ["0" * 63, "0" * 65, "A" * 64, "g" * 64, "..", "%2e%2e%2fports"])
def test_only_a_hash_is_a_name(farm, name):
    """Breaks when a path of the client's making reaches the file system."""
    before = stored(farm)
    assert put(farm, b"bytes", name=name).status == 404
    assert farm.request("HEAD", f"/v1/assets/sha256/{name}").status == 404
    assert stored(farm) == before


def test_what_is_missing_is_told(farm):
    """Breaks when the answer lists what is there, or loses what is not."""
    put(farm, DATA)
    names = [f"sha256:{NAME}", "sha256:" + "1" * 64]
    answer = farm.request("POST", "/v1/assets/missing", json.dumps({"assets": names}))
    assert json.loads(answer.body) == {"missing": names[1:]}


@pytest.mark.parametrize("body", ["", "[]", "{}", '{"assets": 1}', '{"assets": [1]}',
                                  '{"assets": ["sha256:12"]}', '{"assets": [], "more": 1}'])
def test_a_list_that_is_none_is_refused(farm, body):
    """Breaks when a name that cannot be one is answered as missing."""
    assert farm.request("POST", "/v1/assets/missing", body).status == 400


@pytest.mark.parametrize("count, status", [(4095, 200), (4096, 200), (4097, 400)])
def test_the_list_has_its_limit(farm, count, status):
    """Breaks when PEN_ASSETS_MAX is off by one."""
    body = json.dumps({"assets": ["sha256:" + "2" * 64] * count})
    assert farm.request("POST", "/v1/assets/missing", body).status == status


def test_an_asset_past_the_limit_is_refused_before_its_bytes(farm):
    """Breaks when the length is believed only after the disk is full."""
    with socket.create_connection(("127.0.0.1", farm.http_port), timeout=10) as client:
        client.sendall(f"PUT {PATH} HTTP/1.1\r\nHost: localhost\r\n"
                       f"Content-Length: {(1 << 30) + 1}\r\n\r\n".encode())
        assert client.recv(4096).startswith(b"HTTP/1.1 413")


def test_a_page_of_another_site_stores_nothing(farm):
    """Breaks when the origin is looked at only after the bytes are on the disk."""
    data = b"from another site"
    assert put(farm, data, Origin="http://evil.example").status == 403
    assert put(farm, data, Host="evil.example").status == 421
    assert farm.request("HEAD", f"/v1/assets/sha256/{hashlib.sha256(data).hexdigest()}").status == 404


def test_an_upload_that_breaks_off_leaves_nothing(farm):
    """Breaks when half an asset keeps a place in the directory, or, past the 15 seconds in which
    a silent client may come back, its descriptor."""
    before = stored(farm)
    descriptors = len(os.listdir(f"/proc/{farm.server.pid}/fd"))
    data = os.urandom(1 << 20)
    for _ in range(3):
        with socket.create_connection(("127.0.0.1", farm.http_port), timeout=10) as client:
            client.sendall(f"PUT /v1/assets/sha256/{hashlib.sha256(data).hexdigest()} HTTP/1.1\r\n"
                           f"Host: localhost\r\nContent-Length: {len(data)}\r\n\r\n".encode())
            client.sendall(data[:500000])
    wait_for(lambda: len(os.listdir(f"/proc/{farm.server.pid}/fd")) <= descriptors, 25,
             "end of the broken uploads")
    assert stored(farm) == before


def test_a_large_asset_takes_no_memory(farm):
    """Breaks when a body that goes to the disk is gathered in memory first."""
    def resident():
        return int(open(f"/proc/{farm.server.pid}/statm").read().split()[1]) * 4096

    data = os.urandom(1 << 20) * 64
    before = resident()
    assert put(farm, data).status == 201
    assert resident() - before < 16 << 20


def test_a_body_of_unknown_length_is_taken(farm):
    """Breaks when only Content-Length says that there is a body."""
    data = b"chunk by chunk" * 1000
    connection = http.client.HTTPConnection("127.0.0.1", farm.http_port, timeout=10)
    connection.request("PUT", f"/v1/assets/sha256/{hashlib.sha256(data).hexdigest()}",
                       iter([data[:5000], data[5000:]]), encode_chunked=True,
                       headers={"Transfer-Encoding": "chunked"})
    assert connection.getresponse().status == 201
    connection.close()


def test_a_scene_that_names_what_is_not_there_is_told_where(farm):
    """Breaks when only the first is told, or the pointer is another object's."""
    put(farm, DATA)
    scene = {"version": 1, "image": {"width": 16, "height": 16},
             "background": {"image": "sha256:" + "3" * 64},
             "textures": {"there": {"image": f"sha256:{NAME}"},
                          "not": {"image": "sha256:" + "4" * 64}},
             "objects": [{"type": "gltf", "asset": "sha256:" + "5" * 64}]}
    answer = farm.post(scene)
    assert answer.status == 400
    errors = json.loads(answer.body)["errors"]
    assert sorted(e["pointer"] for e in errors) == [
        "/background/image", "/objects/0/asset", "/textures/not/image"]
    assert all("PUT" in e["detail"] for e in errors)


def test_a_glb_becomes_the_scene_that_the_command_line_makes(farm):
    """Breaks when the two ways to hand a GLB in give two renders of one picture."""
    answer = farm.request(
        "POST", "/v1/renders?width=32&height=16&samples=4&time=1&shutter=0.5&background=1,0,0.5"
        "&aperture_radius=0.25&focus_distance=3&mode=uniform&aovs=depth,samples&name=a%20b", EMPTY,
        {"Content-Type": "model/gltf-binary"})
    assert answer.status == 202, answer.body
    found = json.loads(answer.body)
    assert (found["width"], found["height"], found["samples"]) == (32, 16, 4)
    assert found["name"] == "a b"
    assert hashlib.sha256(EMPTY).hexdigest() in stored(farm)
    scene = {"version": 1, "image": {"width": 32, "height": 16, "aovs": ["depth", "samples"]},
             "integrator": {"type": "path"}, "sampling": {"samples": 4, "mode": "uniform"},
             "camera": {"aperture_radius": 0.25, "focus_distance": 3,
                        "shutter": {"open": 1, "close": 1.5}},
             "background": {"color": [1, 0, 0.5]},
             "objects": [{"type": "gltf", "asset": f"sha256:{hashlib.sha256(EMPTY).hexdigest()}"}]}
    same = farm.submit(scene)
    texts = {path.read_bytes() for path in (farm.data / "scenes").glob("*.json")}
    assert len([t for t in texts if hashlib.sha256(EMPTY).hexdigest().encode() in t]) == 1
    for render in (found["id"], same):
        farm.request("DELETE", f"/v1/renders/{render}")


@pytest.mark.parametrize("query", ["widht=3", "width=x", "width=1.5", "background=1,2", "time=nan",
                                   "width=0", "aovs=depth,", "aovs=heat", "name=%FF", "name=" + "x" * 257, "mode=fast", "samples=1e99"])
def test_a_query_that_makes_no_sense_is_refused(farm, query):
    """Breaks when a misspelt setting is passed over."""
    answer = farm.request("POST", f"/v1/renders?{query}", EMPTY,
                          {"Content-Type": "model/gltf-binary"})
    assert answer.status == 400, answer.body


def test_an_asset_outlives_a_kill_at_once_after_its_answer():
    """Breaks when 201 is told before file and name are durable."""
    with Farm(processes=0) as farm:
        assert put(farm, DATA).status == 201
        farm.kill()
        farm.start()
        assert farm.request("HEAD", PATH).status == 200
        assert (farm.data / "assets" / NAME).read_bytes() == DATA


def test_what_no_render_names_goes_after_a_while():
    """Breaks when an asset of a stored render is swept, or one that nobody names stays for ever."""
    named, unnamed = EMPTY, glb({"asset": {"version": "2.0"}, "scenes": [{}]})
    with Farm(0, "--keep-assets", "0") as farm:
        put(farm, named)
        scene = {"version": 1, "image": {"width": 16, "height": 16}, "objects": [
            {"type": "gltf", "asset": f"sha256:{hashlib.sha256(named).hexdigest()}"}]}
        render = farm.submit(scene)
        put(farm, unnamed)
        left = [hashlib.sha256(named).hexdigest()]
        wait_for(lambda: stored(farm) == left, 20, "the sweep")
        farm.request("DELETE", f"/v1/renders/{render}")
        farm.stop()
        farm.start()
        wait_for(lambda: stored(farm) == [], 20, "the second sweep")


def test_a_young_asset_stays():
    """Breaks when the sweep takes what was uploaded for a render still to be posted."""
    with Farm(0, "--keep-assets", "1") as farm:
        put(farm, DATA)
        old = put(farm, EMPTY) and hashlib.sha256(EMPTY).hexdigest()
        os.utime(farm.data / "assets" / old, (1e9, 1e9))
        wait_for(lambda: stored(farm) == [NAME], 20, "the sweep")
