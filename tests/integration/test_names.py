# SPDX-License-Identifier: Apache-2.0
"""No scene, file, picture or request makes any process of a farm open a file that it names, or connect.

names.json lists the names and where they stand. {bait} is a file that is there and can be read, {link} a
link to it, {dir} their directory, {port} a port where a server listens. strace tells what the kernel was
asked for by all processes of the farm, sandboxed or not: a call that the sandbox refuses is a finding
too, since then only the sandbox was in the way."""
import base64
import contextlib
import hashlib
import http.client
import json
import pathlib
import re
import shutil
import socket
import struct
import threading

import farm
import hostile_pictures
import pytest
import scene
from glb import glb, triangle

NAMES = json.loads((pathlib.Path(__file__).parent / "names.json").read_text())
PICTURE = hostile_pictures.png(hostile_pictures.ihdr(), hostile_pictures.idat(b"\0" * 200))


@contextlib.contextmanager
def listener():
    """(port, list of who connected)"""
    came = []
    with socket.create_server(("127.0.0.1", 0)) as server:
        def accept():
            with contextlib.suppress(OSError):
                while True:
                    came.append(server.accept()[1])

        threading.Thread(target=accept, daemon=True).start()
        yield server.getsockname()[1], came
        server.shutdown(socket.SHUT_RDWR)


def put_asset(service, content):
    name = hashlib.sha256(content).hexdigest()
    assert service.request("PUT", f"/v1/assets/sha256/{name}", content).status in (200, 201)
    return f"sha256:{name}"


def base():
    return scene.build(8, 8, 1, [scene.sphere()], background=1)


def showing_picture(service, content=None, name=None):
    body = base()
    body["textures"] = {"t": {"image": name or put_asset(service, content)}}
    body["materials"]["white"] = {"type": "matte", "color": {"texture": "t"}}
    return body


def showing_model(service, content=None, name=None):
    body = base()
    body["objects"].append({"type": "gltf", "asset": name or put_asset(service, content)})
    return body


def model(picture=None, binary=False, buffer=None, **more):
    """A triangle whose buffer or picture is elsewhere, as a glTF or a GLB."""
    tree, data = triangle({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}, **more)
    tree["textures"] = [{"source": 0}]
    tree["images"] = [picture or {"uri": "data:image/png;base64," + base64.b64encode(PICTURE).decode()}]
    if not binary:
        tree["buffers"] = [buffer or {"uri": "data:;base64," + base64.b64encode(data).decode(), "byteLength": len(data)}]
        return json.dumps(tree).encode()
    if buffer is None:
        return glb(tree, data)
    return glb({**tree, "buffers": [buffer]})


def png_with(chunk_name, content):
    chunk = hostile_pictures.chunk(chunk_name, content)
    return PICTURE[:33] + chunk + PICTURE[33:]


def exr_with(name, folder):
    return hostile_pictures.exr(more=hostile_pictures.attribute(b"textureFile", b"string", name.encode()))


def jpeg_with(name, folder):
    made = hostile_pictures.jpeg_base(folder)
    xmp = f'http://ns.adobe.com/xap/1.0/\0<x:xmpmeta xmlns:x="adobe:ns:meta/"><r href="{name}"/></x:xmpmeta>'
    body = xmp.encode()
    return made[:2] + b"\xff\xe1" + struct.pack(">H", len(body) + 2) + body + made[2:]


def bodies(service, folder):
    """place: function of a name that gives what is posted."""
    length = 60
    return {
        "texture": lambda n: showing_picture(service, name=n),
        "background": lambda n: {**base(), "background": {"image": n}},
        "object": lambda n: showing_model(service, name=n),
        "unknown-field": lambda n: {**base(), "file": n},
        "include": lambda n: {**base(), "include": [n], "$ref": n, "$schema": n},
        "material-name": lambda n: {**base(), "materials": {"white": scene.matte(1.0), n: scene.matte(0.5)}},
        "gltf-buffer": lambda n: showing_model(service, model(buffer={"uri": n, "byteLength": length})),
        "gltf-image": lambda n: showing_model(service, model({"uri": n})),
        "glb-buffer": lambda n: showing_model(service, model(binary=True, buffer={"uri": n, "byteLength": length})),
        "glb-image": lambda n: showing_model(service, model({"uri": n}, binary=True)),
        "gltf-extension": lambda n: showing_model(service, model(
            binary=True, extensionsUsed=["EXT_lights_image_based", "KHR_techniques_webgl", "MSFT_lod"],
            extensions={"EXT_lights_image_based": {"lights": [{"uri": n}]}, "KHR_xmp_json_ld": {"packets": [n]}})),
        "gltf-extras": lambda n: showing_model(service, model(binary=True, extras={"uri": n, "file": n})),
        "gltf-shader": lambda n: showing_model(service, model(
            binary=True, shaders=[{"uri": n, "type": 35632}], extensionsUsed=["KHR_techniques_webgl"])),
        "mtl": lambda n: showing_model(service, f"mtllib {n}\nusemtl a\nv 0 0 0\n".encode()),
        "png-text": lambda n: showing_picture(service, png_with(b"tEXt", b"Source\0" + n.encode())),
        "png-profile": lambda n: showing_picture(service, png_with(b"iCCP", n.encode()[:79] + b"\0\0")),
        "exr-attribute": lambda n: showing_picture(service, exr_with(n, folder)),
        "jpeg-xmp": lambda n: showing_picture(service, jpeg_with(n, folder)),
        "bytes": lambda n: showing_picture(service, n.encode()),
        "render-name": lambda n: {"scene": base(), "options": {"name": n}},
        "scene-digest": lambda n: {"scene": n},
    }


def raw(service, method, target, body=None):
    """The status of a request whose target goes out as it stands."""
    connection = http.client.HTTPConnection("127.0.0.1", service.http_port, timeout=30)
    connection._validate_path = lambda path: None
    connection.putrequest(method, target.replace(" ", "%20"), skip_accept_encoding=True)
    data = body or b""
    connection.putheader("Content-Length", str(len(data)))
    connection.putheader("Content-Type", "application/json")
    connection.endheaders(data)
    with contextlib.closing(connection):
        return connection.getresponse().status


def attempt(service, make, place, name):
    """Tells what came of it: a status, or how the render ended."""
    if place in ("put", "get"):
        return raw(service, place.upper(), name, b"{}" if place == "put" else None)
    if place == "missing":
        return raw(service, "POST", "/v1/assets/missing", json.dumps({"assets": [name]}).encode())
    answer = service.post(make[place](name))
    if answer.status != 202:
        return answer.status
    render = json.loads(answer.body)["id"]
    return farm.wait_for(lambda: (s := service.resource(render)["state"]) in farm.FINAL and s, 60, name)


CALL = re.compile(r"^(?:\d+ +)?(\w+)\((.*)")  # names stand where a call begins, not where it is resumed


def findings(trace, worker_port):
    """Lines of calls that name a bait, or connect to anything but the port for workers or a local socket."""
    found = []
    for line in trace.read_text(errors="replace").splitlines():
        call = CALL.match(line)
        if not call:
            continue
        if call[1] == "connect":
            if f"htons({worker_port})" not in line and "AF_UNIX" not in line:
                found.append(line)
        elif call[1] == "execve":
            # "" is of the trial of the sandbox.
            if not re.match(r'"([^"]*/penumbra(-worker|-encoder)?)?"', call[2]):
                found.append(line)
        elif "bait" in line:
            found.append(line)
    return found


@pytest.mark.skipif(farm.SLOW > 1, reason="strace of an instrumented build takes too long")
def test_nothing_that_is_named_is_opened(tmp_path, monkeypatch):
    """Broken by any process that opens, looks for or connects to what a scene, a file or a request names."""
    assert shutil.which("strace"), "strace is missing: deploy/install-deps.sh --tests"
    work = tmp_path / "b"
    work.mkdir()
    bait, link, trace = work / "bait.png", work / "bait-link.png", tmp_path / "trace"
    bait.write_bytes(PICTURE)
    link.symlink_to(bait)
    monkeypatch.setenv("BAIT", str(bait))
    monkeypatch.setenv("HOME", str(work))
    prefix = ["strace", "-D", "-f", "-qq", "-s", "8192", "-e", "trace=%file,connect", "-e", "signal=none",
              "-o", str(trace)]
    ended = {}

    with listener() as (port, came), farm.Farm(1, "--tile", 16, prefix=prefix) as service:
        make = bodies(service, tmp_path)
        for entry in NAMES:
            name = entry["name"].replace("{bait}", str(bait)).replace("{link}", str(link)) \
                .replace("{dir}", str(work)).replace("{port}", str(port))
            ended[entry["place"], entry["name"]] = attempt(service, make, entry["place"], name)
        good = put_asset(service, PICTURE)
        service.render(showing_picture(service, name=good))
        worker_port = service.worker_port
    print(*(f"{outcome}: {place} {name[:80]!r}" for (place, name), outcome in ended.items()), sep="\n")
    assert len(ended) == len(NAMES) >= 100
    assert findings(trace, worker_port) == []
    assert came == [] and not (work / "bait-made").exists()
    # The trace sees what is opened: the asset that was uploaded is.
    assert good.removeprefix("sha256:") in trace.read_text(errors="replace")
    assert not {500, 501, 502, 503} & set(ended.values())
    # Names reached the readers of files, and were not all turned away at the door.
    assert sum(outcome in ("failed", "done") for outcome in ended.values()) >= 40


@pytest.mark.parametrize("line, is_finding", [
    ('77 openat(AT_FDCWD, "/tmp/b/bait.png", O_RDONLY) = -1 EACCES (Permission denied)', True),
    ('77 newfstatat(AT_FDCWD, "bait.bin", 0x7ffc, 0) = ?', True),
    ('77 readlink("/tmp/b/bait-link.png",  <unfinished ...>', True),
    ('77 connect(3, {sa_family=AF_INET, sin_port=htons(53), sin_addr=inet_addr("10.0.0.1")}, 16 <unfinished ...>', True),
    ('77 connect(3, {sa_family=AF_INET, sin_port=htons(80), sin_addr=inet_addr("127.0.0.1")}, 16) = 0', True),
    ('77 execve("/bin/sh", ["sh", "-c", "x"], 0x7ffc) = 0', True),
    ('77 connect(3, {sa_family=AF_INET, sin_port=htons(8081), sin_addr=inet_addr("127.0.0.1")}, 16) = 0', False),
    ('77 openat(AT_FDCWD, "/usr/lib/x86_64-linux-gnu/libz.so.1", O_RDONLY|O_CLOEXEC) = 3', False),
    ('77 execve("/usr/bin/penumbra-worker", ["penumbra-worker"], 0x7ffc) = 0', False)])
def test_the_trace_is_read_as_it_should(tmp_path, line, is_finding):
    """Breaks when the test above would pass by seeing nothing."""
    (tmp_path / "trace").write_text(line + "\n")
    assert findings(tmp_path / "trace", 8081) == ([line] if is_finding else [])
