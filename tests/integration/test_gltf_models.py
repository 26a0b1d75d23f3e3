# SPDX-License-Identifier: Apache-2.0
"""Every glTF file of Debian's assimp-testmodels, good and broken, through a farm: each renders or is
refused with a reason. tests/run.sh runs it on an instrumented build, too, where the scene process
must not read out of bounds."""
import hashlib

import farm
import numpy as np
import pytest
from test_gltf_files import ACCEPTED, MODELS, REFUSED, embedded, models
from test_hostile_assets import REPORT

import image

OLD = MODELS.parent / "glTF"
SIDE = 32


@pytest.fixture(scope="module")
def service():
    with farm.Farm(1) as running:
        yield running


def put(service, path, folder):
    is_new = MODELS in path.parents and path.suffix == ".gltf"
    content = (embedded(path, folder) if is_new else path).read_bytes()
    name = hashlib.sha256(content).hexdigest()
    assert service.request("PUT", f"/v1/assets/sha256/{name}", content).status in (200, 201)
    return f"sha256:{name}"


def submit(service, path, folder):
    return service.submit({
        "version": 1, "image": {"width": SIDE, "height": SIDE}, "sampling": {"samples": 1},
        "background": {"color": [0.25, 0.5, 1]}, "integrator": {"type": "path"},
        "objects": [{"type": "gltf", "asset": put(service, path, folder)}]})


def over(service, render):
    farm.wait_for(lambda: service.resource(render)["state"] in farm.FINAL, 120, render)
    return service.resource(render)


def refusal(found):
    """The sentence with its place that a failed render was refused with."""
    assert found["state"] == "failed", found
    assert found["errors"] and all(e["pointer"] == "/objects/0" for e in found["errors"]), found
    return " ".join(error["detail"] for error in found["errors"])


def test_each_model_renders_or_is_refused(service, tmp_path):
    """Broken by a model that ends the scene process, hangs it, or reads out of bounds; by one that
    is refused though it is good, or rendered though it is broken."""
    paths = models()
    assert len(paths) >= 40, "install assimp-testmodels"
    renders = [submit(service, path, tmp_path) for path in paths]
    done = 0
    for path, render in zip(paths, renders, strict=True):
        found = over(service, render)
        print(path.name, found["state"], found["error"])
        if path.name in REFUSED:
            assert REFUSED[path.name] in refusal(found)
        elif path.name in ACCEPTED or found["state"] == "done":
            assert found["state"] == "done", (path.name, found)
            assert np.isfinite(image.read(service.image(render, "exr"))).all()
            done += 1
        else:
            assert len(refusal(found)) > 10
    assert done >= 20
    log = service.log.read_text(errors="replace")
    assert not REPORT.search(log), log


def test_gltf_1_is_refused_with_a_sentence(service, tmp_path):
    """Broken by a file of the version before that is taken for one of version 2."""
    paths = sorted(path for path in OLD.rglob("*") if path.suffix in (".gltf", ".glb"))
    assert len(paths) >= 5
    for path in paths:
        found = refusal(over(service, submit(service, path, tmp_path)))
        assert "version" in found or "2.0" in found, (path, found)
