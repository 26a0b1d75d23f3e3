# SPDX-License-Identifier: Apache-2.0
import hashlib
import json
import subprocess

import farm
import numpy as np
import pytest

PROGRAM = farm.BIN.parent / "tests/render-core"


class Drawing:
    """Renders of glTF files by the renderer alone."""

    def __init__(self, directory):
        self.directory = directory

    def put(self, data):
        """The name of a file in a scene."""
        name = hashlib.sha256(data).hexdigest()
        (self.directory / name).write_bytes(data)
        return f"sha256:{name}"

    def object(self, asset, **more):
        return {"type": "gltf", "asset": self.put(asset.bytes()), **more}

    def run(self, body, *options):
        path = self.directory / "scene.json"
        path.write_text(json.dumps(body))
        return subprocess.run([PROGRAM, path, self.directory / "out.f32", "--assets",
                               self.directory, *map(str, options)],
                              capture_output=True, text=True, timeout=60 * farm.SLOW)

    def film(self, body, *options):
        run = self.run(body, *options)
        assert run.returncode == 0, run.stderr
        head, _, floats = (self.directory / "out.f32").read_bytes().partition(b"\n")
        x0, y0, x1, y1 = map(int, head.split())
        return np.frombuffer(floats, np.float32).reshape(y1 - y0, x1 - x0, -1)

    def pixels(self, body, *options):
        film = self.film(body, *options).astype(np.float64)
        return film[:, :, :3] / film[:, :, 3:4]

    def show(self, asset, *options, **more):
        """The pixels of an asset by itself."""
        return self.pixels(frame([self.object(asset)], **more), *options)

    def refusal(self, asset, **more):
        """What is said of an asset that must be refused."""
        run = self.run(frame([self.object(asset)], **more))
        assert run.returncode == 1, run.stderr
        return run.stderr


def frame(objects, side=64, samples=64, time=0.0, close=None, **more):
    """A square image with a box filter of one pixel, taken at a time or from there on."""
    return {"version": 1, "objects": objects,
            "image": {"width": side, "height": side, "filter": {"type": "box", "width": 1}},
            "sampling": {"samples": samples}, "integrator": {"type": "path"},
            "camera": {"shutter": {"open": time, "close": time if close is None else close},
                       **more.pop("camera", {})}, **more}


@pytest.fixture(scope="session")
def drawing(tmp_path_factory):
    return Drawing(tmp_path_factory.mktemp("gltf"))
