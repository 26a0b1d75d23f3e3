#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The time of the whole renderer over that of the bare traversal of its rays, see limit.c.

    limit.py [--runs 5] [--samples 16] [--scale 2] [SCENE …]

Exits with 1 when a ratio is over what is promised: 1.6 on the mesh of two million triangles
(tests/bench/mesh_scene.py), 2.5 on five_balls. Images are 1 / --scale as wide and high.
"""
import argparse
import json
import pathlib
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "support"))
import mesh_scene  # noqa: E402
from farm import BIN  # noqa: E402

SCENES = HERE.parent / "reference/scenes"
PROMISED = {"mesh": 1.6, "mesh-path": 1.6, "five_balls": 2.5}
NAMES = ["five_balls", "soft_shadow", "depth_of_field", "motion_blur", "gloss", "mesh", "mesh-path"]


def scene_file(name, directory):
    if not name.startswith("mesh"):
        return SCENES / f"{name}.json"
    doc, digest, data = mesh_scene.for_penumbra(mesh_scene.parts())
    if name == "mesh-path":
        doc["integrator"]["type"] = "path"
    (directory / digest).write_bytes(data)
    path = directory / f"{name}.json"
    path.write_text(json.dumps(doc))
    return path


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    for option, default in (("--runs", 5), ("--samples", 16), ("--scale", 2)):
        parser.add_argument(option, type=int, default=default)
    parser.add_argument("scenes", nargs="*", default=NAMES)
    options = parser.parse_args()
    print(f"{options.runs} runs; processor seconds of the renderer, of bare Embree calls with the"
          " same rays, of the renderer's own tracing; renderer / bare")
    print(f"{'scene':15}{'rays':>10}{'renderer':>10}{'bare':>8}{'own':>8}{'ratio':>8}")
    missed = 0
    with tempfile.TemporaryDirectory() as temporary:
        directory = pathlib.Path(temporary)
        for name in options.scenes:
            command = [BIN.parent / "tests/limit", scene_file(name, directory), "--assets",
                       directory, "--samples", options.samples, "--scale", options.scale,
                       "--runs", options.runs]
            found = subprocess.run(list(map(str, command)), capture_output=True, text=True,
                                   check=True, timeout=900).stdout.split()
            whole, bare, own, ratio, least, greatest = map(float, found[3:])
            promised = PROMISED.get(name)
            missed += promised is not None and ratio > promised
            told = f"<= {promised}" if promised else ""
            print(f"{name:15}{found[1]:>10}{whole:10.3f}{bare:8.3f}{own:8.3f}{ratio:8.2f}"
                  f" ({least:.2f}-{greatest:.2f})  {told}", flush=True)
    return int(missed > 0)


if __name__ == "__main__":
    sys.exit(main())
