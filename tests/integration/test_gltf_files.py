# SPDX-License-Identifier: Apache-2.0
"""Every glTF 2 file of Debian's assimp-testmodels, good and broken: read, or refused with a reason."""
import base64
import json
import os
import pathlib
import subprocess
import urllib.parse

import pytest
from glb import Asset

ROOT = pathlib.Path(__file__).resolve().parents[2]
BIN = pathlib.Path(os.environ.get("PEN_BIN", ROOT / "build/release/bin"))
MODELS = pathlib.Path("/usr/share/assimp/models/glTF2")
READER = BIN.parent / "tests" / "gltf-read"

# What must be read, and the word that must stand in the reason of what must not.
ACCEPTED = {"2CylinderEngine.glb", "BoxBadNormals.glb", "BoxTextured.glb", "simple_skin.gltf",
            "AnimatedMorphCube.gltf", "TextureTransformTest.gltf", "Cameras.gltf",
            "ClearCoatTest.gltf", "texcoord_crash.gltf"}
REFUSED = {"BoxWithInfinites.glb": "not finite", "RecursiveNodes.gltf": "no root",
           "2CylinderEngine.gltf": "KHR_draco_mesh_compression",
           "AllIndicesOutOfRange.gltf": "index", "IndexOutOfRange.gltf": "index"}


def models():
    return sorted(path for path in MODELS.rglob("*") if path.suffix in (".gltf", ".glb"))


def embedded(path, folder):
    """The same file with the files that it names, as far as they exist, as data URIs."""
    try:
        asset = json.loads(path.read_text(encoding="utf-8"))
    except ValueError:
        return path
    for item in asset.get("buffers", []) + asset.get("images", []):
        uri = item.get("uri") if isinstance(item, dict) else None
        beside = path.parent / urllib.parse.unquote(uri) if isinstance(uri, str) else None
        if beside and not uri.startswith("data:") and beside.is_file():
            item["uri"] = ("data:application/octet-stream;base64,"
                           + base64.b64encode(beside.read_bytes()).decode())
    packed = folder / path.name
    packed.write_text(json.dumps(asset), encoding="utf-8")
    return packed


def test_the_models_are_there():
    """Without them the next test would pass by testing nothing."""
    assert len(models()) >= 40, "install assimp-testmodels"


@pytest.mark.parametrize("path", models(), ids=lambda path: path.name)
def test_a_file_is_read_or_refused(path, tmp_path):
    """Breaks when a file crashes the reader, hangs it, or is refused without a reason."""
    source = embedded(path, tmp_path) if path.suffix == ".gltf" else path
    run = subprocess.run([READER, source], capture_output=True, text=True, timeout=60)
    assert run.returncode == 0, run.stderr
    verdict = run.stdout.splitlines()[0]
    assert verdict.startswith(("accepted ", "refused "))
    if path.name in ACCEPTED:
        assert verdict.startswith("accepted "), run.stdout
    if path.name in REFUSED:
        assert verdict.startswith("refused ") and REFUSED[path.name] in run.stdout, run.stdout
    if verdict.startswith("refused "):
        assert "error /objects/0: " in run.stdout


@pytest.mark.parametrize("shines", ["nothing", "a lamp", "emission", "an unlit body"])
def test_darkness_is_told(shines, tmp_path):
    """Breaks when a picture comes out black without a word, or a lit one is said to be dark."""
    asset = Asset()
    unlit = asset.unlit([1, 1, 1]) if shines == "an unlit body" else None
    bright = asset.add("materials", {"emissiveFactor": [0, 1, 0]}) if shines == "emission" else unlit
    lamp = asset.light(type="point") if shines == "a lamp" else {}
    asset.node(mesh=asset.mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], None, bright), **lamp)
    path = tmp_path / "asset.glb"
    path.write_bytes(asset.bytes())
    run = subprocess.run([READER, path], capture_output=True, text=True, timeout=60, check=True)
    assert run.stdout.startswith("accepted ")
    assert ("nothing gives light" in run.stdout) == (shines == "nothing")
