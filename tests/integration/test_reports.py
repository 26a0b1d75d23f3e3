# SPDX-License-Identifier: Apache-2.0
"""What is wrong with a scene, or left out of it, is told with its render, and not forgotten."""
import farm
import pytest
import scene
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
