# SPDX-License-Identifier: Apache-2.0
"""What is wrong with a scene, or left out of it, is told with its render, and not forgotten."""
import hashlib
import subprocess
import time

import farm
import pytest
import scene
from glb import glb, triangle
from tile_peer import FAILURE, LEASE, SCENE_REPORT, WELCOME, Peer, message

SCENE_FAULT = 4
ERRORS = [{"pointer": "/objects/0", "detail": 'mesh 0 "näme": broken'},
          {"pointer": "/materials/a~1b", "detail": "no picture"}]
WARNINGS = ["/objects/0: the extension EXT_nothing is left out", "/camera: näh"]


@pytest.fixture
def service():
    with farm.Farm(0, "--tile", 16) as running:
        yield running


def small(seed=0):
    return scene.build(16, 16, 1, [scene.sphere()], seed=seed)


def lease_of(service, name="test"):
    """A worker that has been given a unit of the only render."""
    peer = Peer(service.worker_port)
    peer.hello(name=name)
    peer.wait_for(WELCOME)
    return peer, peer.wait_for(LEASE)


def report(peer, lease, errors=(), warnings=(), sha256=None):
    peer.send(SCENE_REPORT, message(f1=lease[2], f2=sha256 or lease[13],
                                    f3=[e["pointer"] for e in errors],
                                    f4=[e["detail"] for e in errors], f5=list(warnings)))


def restart(service):
    service.kill()
    service.start()


def test_errors_stay_with_a_failed_render(service):
    """Breaks when errors are lost on their way to the resource or the store, or come late."""
    render = service.submit(small())
    peer, lease = lease_of(service)
    report(peer, lease, ERRORS)
    peer.send(FAILURE, message(f1=lease[1], f2=SCENE_FAULT, f3="/objects/0: broken"))
    found = service.wait(render, 1, state="failed")
    assert found["error"] == "/objects/0: broken"
    assert found["errors"] == ERRORS and found["warnings"] == []
    restart(service)
    again = service.resource(render)
    assert (again["state"], again["error"]) == ("failed", "/objects/0: broken")
    assert again["errors"] == ERRORS and again["warnings"] == []
    peer.socket.close()


def test_warnings_show_while_it_renders(service):
    """Breaks when warnings come only at the end, or a restart forgets them."""
    render = service.submit(small())
    peer, lease = lease_of(service)
    before = service.request("GET", f"/v1/renders/{render}")
    report(peer, lease, warnings=WARNINGS)
    farm.wait_for(lambda: service.resource(render)["warnings"] == WARNINGS, 1, "warnings")
    etag = {"If-None-Match": before.headers["ETag"]}
    assert service.request("GET", f"/v1/renders/{render}", headers=etag).status == 200
    found = service.resource(render)
    assert found["state"] == "running" and found["errors"] == []
    restart(service)
    assert service.resource(render)["warnings"] == WARNINGS
    peer.socket.close()


def test_a_report_of_another_scene_is_dropped(service):
    """Breaks when a worker that is behind, or lies, can write into a render that is not its own."""
    render = service.submit(small())
    peer, lease = lease_of(service)
    report(peer, lease, warnings=["not of this scene"], sha256=b"\x07" * 32)
    report(peer, {**lease, 2: lease[2] + 1000}, warnings=["of no render"])
    report(peer, lease, warnings=WARNINGS)
    farm.wait_for(lambda: service.resource(render)["warnings"], 1, "warnings")
    report(peer, lease, warnings=["a second time"])
    peer.send(FAILURE, message(f1=lease[1], f2=SCENE_FAULT, f3="broken"))
    assert service.wait(render, 1, state="failed")["warnings"] == WARNINGS
    peer.socket.close()


@pytest.mark.parametrize("errors, warnings", [
    (ERRORS, WARNINGS), ((), ()), ([{"pointer": "/a\n", "detail": ""}], ()), ((), ["w"] * 65)])
def test_what_is_no_report_costs_the_connection(service, errors, warnings):
    """Breaks when texts that no worker sends get into a resource."""
    render = service.submit(small())
    peer, lease = lease_of(service)
    report(peer, lease, errors, warnings)
    assert peer.closed()
    found = service.resource(render)
    assert found["errors"] == found["warnings"] == []


def put(service, data):
    name = hashlib.sha256(data).hexdigest()
    assert service.request("PUT", f"/v1/assets/sha256/{name}", data).status in (200, 201)
    return f"sha256:{name}"


def of_files(service, *files, seed=0):
    body = scene.build(16, 16, 1, [{"type": "gltf", "asset": put(service, data)} for data in files],
                       background=1, seed=seed)
    return service.submit(body)


def broken(accessor, mesh="Fan"):
    """A triangle whose positions are those of an accessor that is not there."""
    tree, binary = triangle()
    tree["meshes"][0] = {"name": mesh, "primitives": [{"attributes": {"POSITION": accessor}}]}
    return glb(tree, binary)


def decorated(*extensions):
    """A triangle that uses extensions nobody knows."""
    return glb(*triangle(extensionsUsed=list(extensions)))


@pytest.fixture
def farm_of_one():
    with farm.Farm(1) as running:
        running.render(small())
        yield running


def test_each_broken_file_of_a_scene_is_told_with_its_place(farm_of_one):
    """Breaks when only the first fault arrives, late, without its place, or until a restart."""
    service = farm_of_one
    render = of_files(service, broken(7), decorated(), broken(9, "Näbel"))
    found = service.wait(render, 2, state="failed")
    assert [e["pointer"] for e in found["errors"]] == ["/objects/0", "/objects/2"]
    assert 'mesh 0 "Fan"' in found["errors"][0]["detail"] and "7" in found["errors"][0]["detail"]
    assert 'mesh 0 "Näbel"' in found["errors"][1]["detail"]
    assert found["error"] == "/objects/0: " + found["errors"][0]["detail"]
    restart(service)
    again = service.resource(render)
    assert [again[key] for key in ("state", "error", "errors")] == \
        [found[key] for key in ("state", "error", "errors")]


def test_a_broken_picture_is_told_with_its_place(farm_of_one):
    """Breaks when what only decoding finds has no pointer in the resource."""
    service = farm_of_one
    body = small(seed=3)
    body["materials"]["white"] = {"type": "matte", "color": {"texture": "cut"}}
    body["textures"] = {"cut": {"image": put(service, b"\x89PNG\r\n\x1a\nand no more")}}
    found = service.wait(service.submit(body), 2, state="failed")
    assert [e["pointer"] for e in found["errors"]] == ["/textures/cut"]
    assert found["errors"][0]["detail"] and found["error"]


def test_a_required_extension_is_an_error_that_names_it(farm_of_one):
    """Breaks when a file is rendered without what it says that it cannot do without, or when it is
    not told which extension that is."""
    names = ["EXT_nothing", "KHR_draco_mesh_compression"]
    for name in names:
        file = glb(*triangle(extensionsUsed=names, extensionsRequired=[name]))
        found = farm_of_one.wait(of_files(farm_of_one, file), state="failed")
        assert [e["pointer"] for e in found["errors"]] == ["/objects/0"]
        assert name in found["errors"][0]["detail"] and name in found["error"]
        assert found["warnings"] == []


def test_what_is_wrong_is_told_within_a_second(farm_of_one):
    """Breaks when a render of a broken file waits for anything but a free worker: a lease that runs
    out, or other workers to try. The best of a few, since the machine may be busy."""
    def seconds(seed):
        start = time.monotonic()
        found = farm_of_one.wait(of_files(farm_of_one, broken(7), seed=seed), state="failed")
        assert 'mesh 0 "Fan"' in found["errors"][0]["detail"]
        return time.monotonic() - start

    assert min(seconds(seed) for seed in range(5)) <= 1 * farm.SLOW


def test_what_is_left_out_is_told_to_each_render(farm_of_one):
    """Breaks when a scene that stands ready says nothing to the next render of it."""
    service = farm_of_one
    file = decorated("EXT_nothing", "EXT_less")
    renders = [of_files(service, file, seed=n) for n in (1, 1, 2)]
    found = [service.wait(render)["warnings"] for render in renders]
    assert len(found[0]) == 2 and found[1] == found[2] == found[0]
    assert found[0][0].startswith("/objects/0: ") and "EXT_nothing" in found[0][0]
    restart(service)
    assert [service.resource(render)["warnings"] for render in renders] == found
    assert service.wait(of_files(service, decorated()))["warnings"] == []


def test_the_command_line_tells_both(tmp_path):
    """Breaks when one who never sees the resource is not told."""
    def render(data):
        (tmp_path / "model.glb").write_bytes(data)
        return subprocess.run(
            [farm.program("penumbra"), "render", "model.glb", "-o", "out.png", "--size", "16x16",
             "--samples", "1", "--processes", "1"],
            cwd=tmp_path, capture_output=True, text=True, timeout=60 * farm.SLOW)

    bad, good = render(broken(7)), render(decorated("EXT_nothing"))
    assert bad.returncode == 1 and '  /objects/0: mesh 0 "Fan"' in bad.stderr
    assert good.returncode == 0 and "penumbra: warning: " in good.stderr
    assert "EXT_nothing" in good.stderr
