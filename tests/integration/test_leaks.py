# SPDX-License-Identifier: Apache-2.0
"""The coordinator under memcheck and AddressSanitizer, through renders and bad requests.

Both end the program with another code than 0 when memory is misused or lost, and Farm.stop demands
0. Memcheck runs the release build, whose workers connect from outside; AddressSanitizer needs the
asan preset.
"""
import json

import farm
import image
import scene
from test_bad_input import GOOD, NOT_JSON, REFUSED, changed

MEMCHECK = ["valgrind", "--quiet", "--leak-check=full", "--errors-for-leak-kinds=definite,indirect",
            "--error-exitcode=99", "--child-silent-after-fork=yes", "--trace-children=no"]


def exercise(service):
    """Every kind of request once, and each bad one."""
    for where, value, _ in REFUSED.values():
        assert service.post(changed(where, value)).status == 400
    for body, _ in NOT_JSON.values():
        assert service.post(body).status == 400
    assert service.post(b" " * (9 << 20)).status == 413
    render = service.submit({"scene": GOOD, "override": {"sampling": {"samples": 4}}})
    service.wait(render, 60)
    for extension in ("exr", "png", "jpg", "hdr"):
        assert image.read(service.image(render, extension), extension).shape == (16, 16, 3)
    cancelled = service.submit(scene.build(256, 256, 5000, [scene.sphere()]))
    assert service.patch(cancelled, {"state": "cancelled"}).status == 200
    assert {r["id"] for r in service.get("/v1/renders")["renders"]} == {render, cancelled}
    assert service.request("DELETE", f"/v1/renders/{cancelled}").status == 204
    assert service.request("GET", f"/v1/renders/{cancelled}").status == 410
    assert service.request("GET", "/v1/renders/nothing").status == 404
    assert json.loads(service.request("GET", "/v1/workers").body)["workers"]


def test_memcheck():
    """Broken by a leak, an invalid read or write, or a decision on memory never set."""
    with farm.Farm(0, prefix=MEMCHECK) as service:
        worker = service.connect_worker(1)
        exercise(service)
        assert farm.stop_process(worker) == 0


def test_address_sanitizer():
    """Broken by the same and by undefined behaviour, in the coordinator and in its local worker."""
    binaries = farm.ROOT / "build/asan/bin"
    assert (binaries / "penumbra").exists(), "build the asan preset first"
    with farm.Farm(1, binaries=binaries) as service:
        exercise(service)
