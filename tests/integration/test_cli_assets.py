# SPDX-License-Identifier: Apache-2.0
"""Files that a scene mentions, and glTF files, as `penumbra submit` hands them over."""
import base64
import hashlib
import json
import os
import struct
import subprocess

import pytest
from fake_server import FakeServer
from farm import program

RUNNING = {"id": "abc", "state": "running", "progress": 0}
GLB = b"glTF" + struct.pack("<II", 2, 12)
PNG = b"\x89PNG\r\n\x1a\n and so on"


def name_of(data):
    return "sha256:" + hashlib.sha256(data).hexdigest()


def submit(operand, missing=(), options=(), text=None):
    """The run and its requests to a server that lacks the named files."""
    answers = {("POST", "/v1/renders"): (202, RUNNING),
               ("POST", "/v1/assets/missing"): (200, {"missing": list(missing)})}
    for name in missing:
        answers["PUT", "/v1/assets/sha256/" + name.removeprefix("sha256:")] = (201, b"")
    with FakeServer(answers) as server:
        run = subprocess.run([program("penumbra"), "submit", str(operand), *options,
                              "--server", server.url], input=text, capture_output=True,
                             timeout=30)
    return run, server.requests


def write(folder, scene, **files):
    """A scene file in a folder with other files, by their names without their extensions."""
    for name, data in files.items():
        (folder / name).write_bytes(data)
    path = folder / "scene.json"
    path.write_text(json.dumps(scene))
    return path


def test_paths_become_hashes_and_only_missing_files_are_sent(tmp_path):
    """Breaks if a mention is passed over, sent twice, or sent although the server has it."""
    (tmp_path / "maps").mkdir()
    (tmp_path / "maps" / "wood.png").write_bytes(PNG)
    path = write(tmp_path, {
        "textures": {"a": {"image": "maps/wood.png"}, "b": {"image": name_of(b"old")}},
        "background": {"image": "sky"},
        "objects": [{"type": "sphere"}, {"type": "gltf", "asset": "model"}]}, sky=b"sun", model=GLB)
    run, requests = submit(path, [name_of(PNG), name_of(GLB), "sha256:" + 64 * "0"])
    assert run.returncode == 0 and run.stdout == b"abc\n", run.stderr
    asked = json.loads(requests[0][2])["assets"]
    assert sorted(asked) == sorted([name_of(PNG), name_of(GLB), name_of(b"sun")])
    put = {path: body for method, path, body in requests if method == "PUT"}
    assert put == {"/v1/assets/sha256/" + name_of(data)[7:]: data for data in (PNG, GLB)}
    method, path, body = requests[-1]
    assert (method, path) == ("POST", "/v1/renders")
    assert json.loads(body)["scene"] == {
        "textures": {"a": {"image": name_of(PNG)}, "b": {"image": name_of(b"old")}},
        "background": {"image": name_of(b"sun")},
        "objects": [{"type": "sphere"}, {"type": "gltf", "asset": name_of(GLB)}]}


def test_a_file_in_several_places_is_sent_once(tmp_path):
    path = write(tmp_path, {"background": {"image": "a"}, "textures": {"t": {"image": "a"},
                                                                       "u": {"image": "b"}}},
                 a=b"sun", b=b"sun")
    run, requests = submit(path, [name_of(b"sun")])
    assert run.returncode == 0
    assert json.loads(requests[0][2]) == {"assets": [name_of(b"sun")]}
    assert [method for method, _, _ in requests] == ["POST", "PUT", "POST"]


def test_a_scene_from_standard_input_has_its_files_in_the_current_folder(tmp_path, monkeypatch):
    (tmp_path / "sky").write_bytes(b"sun")
    monkeypatch.chdir(tmp_path)
    run, requests = submit("-", [name_of(b"sun")], text=b'{"background": {"image": "sky"}}')
    assert run.returncode == 0 and len(requests) == 3


@pytest.mark.parametrize("image, complaint", [
    ("https://example.org/sky.hdr", b"nothing is fetched"),
    ("file:///etc/passwd", b"nothing is fetched"),
    ("/etc/passwd", b"absolute path"),
    ("../secret", b"'..'"),
    ("maps/../../secret", b"'..'"),
    ("maps/..", b"'..'"),
    ("out", b"leads out"),
    ("away/secret", b"leads out"),
    ("", b"is empty"),
    ("maps", b"no regular file"),
    ("pipe", b"no regular file"),
    ("nothing", b"there is no file"),
])
def test_no_file_from_elsewhere_is_sent(tmp_path, image, complaint):
    """Breaks if any path of a scene that somebody else has written leads out of its folder."""
    folder = tmp_path / "scene"
    folder.mkdir()
    (tmp_path / "secret").write_bytes(b"secret")
    (folder / "maps").mkdir()
    (folder / "out").symlink_to(tmp_path / "secret")
    (folder / "away").symlink_to("..")
    os.mkfifo(folder / "pipe")
    run, requests = submit(write(folder, {"background": {"image": image}}))
    assert run.returncode in (1, 4) and complaint in run.stderr, run.stderr
    assert requests == []


def test_links_within_the_folder_are_followed(tmp_path):
    (tmp_path / "link").symlink_to("sky")
    run, requests = submit(write(tmp_path, {"background": {"image": "link"}}, sky=b"sun"),
                           [name_of(b"sun")])
    assert run.returncode == 0 and requests[1][2] == b"sun"


def test_names_with_dots_are_no_way_up(tmp_path):
    (tmp_path / "..sky").write_bytes(b"sun")
    run, _ = submit(write(tmp_path, {"background": {"image": "..sky"}}), [name_of(b"sun")])
    assert run.returncode == 0, run.stderr


@pytest.mark.parametrize("status, code", [(422, 4), (507, 1), (413, 4)])
def test_a_file_that_the_server_does_not_take_ends_the_command(tmp_path, status, code):
    path = write(tmp_path, {"background": {"image": "sky"}}, sky=b"sun")
    name = name_of(b"sun")
    with FakeServer({("POST", "/v1/assets/missing"): (200, {"missing": [name]}),
                     ("PUT", "/v1/assets/sha256/" + name[7:]): (status, {"detail": "no"}),
                     }) as server:
        run = subprocess.run([program("penumbra"), "submit", path, "--server", server.url],
                             capture_output=True, timeout=30)
    assert run.returncode == code and run.stderr == f"penumbra: no ({status})\n".encode()
    assert server.requests[-1][0] == "PUT"


@pytest.mark.parametrize("from_input", [False, True])
def test_a_glb_is_a_scene_of_its_own(tmp_path, from_input):
    path = tmp_path / "model.bin"
    path.write_bytes(GLB)
    run, requests = submit("-" if from_input else path, [name_of(GLB)], ["--samples", "4"],
                           GLB if from_input else None)
    assert run.returncode == 0, run.stderr
    assert requests[1][:2] == ("PUT", "/v1/assets/sha256/" + name_of(GLB)[7:])
    assert requests[1][2] == GLB
    body = json.loads(requests[2][2])
    assert body["override"] == {"sampling": {"samples": 4}}
    assert body["scene"]["integrator"] == {"type": "path"}
    assert body["scene"]["objects"] == [{"type": "gltf", "asset": name_of(GLB)}]
    assert set(body["scene"]) == {"version", "image", "integrator", "objects"}


def chunks_of(glb):
    """The JSON and the binary chunk of a GLB (glTF 2.0, section 4.4)."""
    magic, version, size = struct.unpack_from("<4sII", glb)
    length, kind = struct.unpack_from("<I4s", glb, 12)
    assert (magic, version, size, kind) == (b"glTF", 2, len(glb), b"JSON") and length % 4 == 0
    text, rest = glb[20:20 + length], glb[20 + length:]
    if not rest:
        return json.loads(text), b""
    length, kind = struct.unpack_from("<I4s", rest)
    assert kind == b"BIN\0" and length % 4 == 0 and len(rest) == 8 + length
    return json.loads(text), rest[8:]


def sent(requests):
    return next(body for method, _, body in requests if method == "PUT")


def as_data(data):
    return "data:application/octet-stream;base64," + base64.b64encode(data).decode()


def submit_gltf(path, *rest):
    """As submit, of glTF text, whose name as a GLB only the command knows."""
    with FakeServer({("POST", "/v1/assets/missing"): (200, {"missing": []})}) as server:
        subprocess.run([program("penumbra"), "submit", path, "--server", server.url],
                       capture_output=True, timeout=30)
    if not server.requests:
        return submit(path, *rest)
    return submit(path, json.loads(server.requests[0][2])["assets"], *rest)


def test_gltf_text_is_packed_with_its_files(tmp_path):
    """Breaks if a view reads other bytes than before, or an image is lost."""
    (tmp_path / "a b.bin").write_bytes(b"abcdefg")
    (tmp_path / "t.png").write_bytes(PNG)
    path = tmp_path / "model.gltf"
    path.write_text(json.dumps({
        "asset": {"version": "2.0"},
        "buffers": [{"uri": as_data(b"\0\1\2\3\xff"), "byteLength": 5},
                    {"uri": "a%20b.bin", "byteLength": 6}],
        "bufferViews": [{"buffer": 1, "byteOffset": 2, "byteLength": 3},
                        {"buffer": 0, "byteLength": 5, "byteStride": 4}],
        "images": [{"uri": "t.png", "name": "wood"}, {"uri": as_data(b"\xff\xd8 jpeg")},
                   {"bufferView": 1, "mimeType": "image/png"}]}))
    run, requests = submit_gltf(path)
    assert run.returncode == 0, run.stderr
    root, binary = chunks_of(sent(requests))
    assert root["buffers"] == [{"byteLength": len(binary)}]
    views = [binary[v.get("byteOffset", 0):][:v["byteLength"]] for v in root["bufferViews"]]
    assert views == [b"cde", b"\0\1\2\3\xff", PNG, b"\xff\xd8 jpeg"]
    assert all(view["buffer"] == 0 for view in root["bufferViews"])
    assert root["bufferViews"][1]["byteStride"] == 4
    assert root["images"] == [{"name": "wood", "bufferView": 2, "mimeType": "image/png"},
                              {"bufferView": 3, "mimeType": "image/jpeg"},
                              {"bufferView": 1, "mimeType": "image/png"}]


def test_gltf_text_that_a_scene_mentions_has_its_files_beside_it(tmp_path):
    (tmp_path / "models").mkdir()
    (tmp_path / "models" / "x.bin").write_bytes(b"1234")
    (tmp_path / "models" / "x.gltf").write_text(json.dumps(
        {"asset": {"version": "2.0"}, "buffers": [{"uri": "x.bin", "byteLength": 4}]}))
    run, requests = submit_gltf(
        write(tmp_path, {"objects": [{"type": "gltf", "asset": "models/x.gltf"}]}))
    assert run.returncode == 0, run.stderr
    assert chunks_of(sent(requests))[1] == b"1234"


@pytest.mark.parametrize("gltf, complaint", [
    ({"buffers": [{"byteLength": 1}]}, b"buffer 0 has no uri"),
    ({"buffers": [{"uri": as_data(b"12"), "byteLength": 3}]}, b"shorter than its byteLength"),
    ({"buffers": [{"uri": "data:;base64,a?b", "byteLength": 1}]}, b"no base64"),
    ({"buffers": [{"uri": "data:text/plain,abc", "byteLength": 3}]}, b"no base64"),
    ({"buffers": [{"uri": "%2e%2e/secret", "byteLength": 1}]}, b"'..'"),
    ({"buffers": [{"uri": "http://example.org/a", "byteLength": 1}]}, b"nothing is fetched"),
    ({"images": [{"uri": "/etc/passwd"}]}, b"absolute path"),
    ({"images": [{"uri": "none.png"}]}, b"there is no file"),
    ({"bufferViews": [{"buffer": 7, "byteLength": 1}]}, b"bufferView 0 is of no buffer"),
    ([], b"not a JSON object"),
])
def test_gltf_text_that_cannot_be_packed_is_refused(tmp_path, gltf, complaint):
    path = tmp_path / "model.gltf"
    path.write_text(json.dumps(gltf))
    run, requests = submit(path)
    assert run.returncode in (1, 4) and complaint in run.stderr, run.stderr
    assert requests == []
