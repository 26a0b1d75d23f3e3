#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The Blender add-on, in Debian's Blender against a farm: tests/run.sh long blender_addon.

Each image that Blender saved has the bits of `penumbra render` of the scene that the add-on sent;
images under area lights and a turned sky agree with Cycles; Esc cancels the render on the server; a
server that does not answer is an error. The figures go to tests/results/blender_addon.txt.
"""
import json
import pathlib
import subprocess
import sys
import tempfile
import time

import image
from farm import ROOT, Farm, program

RESULTS = ROOT / "tests/results/blender_addon.txt"
SCENES = ("lens", "motion", "border", "area", "sky")
AGAINST_CYCLES = {"area": 0.02, "sky": 0.02}  # of the mean


def run_blender(farm, out):
    done = subprocess.run(
        ["blender", "-b", "--factory-startup", "-noaudio", "--python-exit-code", "1",
         "-P", pathlib.Path(__file__).with_name("blender_addon_scenes.py"), "--",
         ROOT / "deploy/blender", f"http://127.0.0.1:{farm.http_port}", out],
        capture_output=True, text=True, timeout=900, check=False)
    # Not the exit code, which tells of the interruption.
    report = out / "report.json"
    assert report.exists(), done.stdout[-3000:] + done.stderr[-3000:]
    return json.loads(report.read_text())


def pixels(path):
    return image.read_file(path, "RGBA")


def compare(name, out):
    """A line about one scene; AssertionError when a bit differs."""
    reference = out / f"{name}-reference.exr"
    subprocess.run([program("penumbra"), "render", "--quiet", out / name / "scene.json", "-o", reference],
                   check=True, timeout=300)
    found, wanted = pixels(out / f"{name}.exr"), pixels(reference)
    assert found.shape == wanted.shape, f"{name}: {found.shape} and {wanted.shape}"
    assert found.tobytes() == wanted.tobytes(), f"{name}: bits differ"
    assert found[..., :3].std() > 0.01, f"{name}: nothing is to be seen"
    line = f"{name}: {found.shape[1]}x{found.shape[0]}, red, green, blue and alpha have the bits of penumbra render"
    if name in AGAINST_CYCLES:
        cycles = pixels(out / f"{name}-cycles.exr")[..., :3]
        error = abs(found[..., :3] - cycles).mean() / cycles.mean()
        ratio = found[..., :3].mean() / cycles.mean()
        line += f"; against Cycles: mean {ratio:.4f}, absolute difference {error:.4f} of it"
        assert abs(ratio - 1) < AGAINST_CYCLES[name] and error < 0.1, line
    return line


def main():
    start = time.monotonic()
    lines = [subprocess.run(["blender", "--version"], capture_output=True, text=True, check=True)
             .stdout.splitlines()[0]]
    with tempfile.TemporaryDirectory() as directory, Farm(processes=2) as farm:
        out = pathlib.Path(directory)
        report = run_blender(farm, out)
        assert tuple(report["scenes"]) == SCENES
        lines += [compare(name, out) for name in SCENES]
        states = [render["state"] for render in farm.get("/v1/renders")["renders"]]
        assert states == ["cancelled"] + len(SCENES) * ["done"], states
        assert report["cancelled"]["partial_images"] >= 1 and not report["left_after_disable"]
        lines.append("cancelled: by Esc, after a partial image; the server's render is cancelled")
        assert "127.0.0.1:9" in report["nobody"], report
        lines.append("no server: an error that names it")
        wanted = {"RENDER_PT_penumbra", "EEVEE_WORLD_PT_surface", "EEVEE_MATERIAL_PT_surface", "DATA_PT_EEVEE_light",
                  "DATA_PT_lens", "DATA_PT_camera_dof"}
        assert wanted <= set(report["panels"]), wanted - set(report["panels"])
        lines.append("panels: world, materials, lights and cameras can be edited")
    print("\n".join(lines))
    RESULTS.write_text("\n".join(lines) + "\n")
    print(f"{len(lines) - 1} passed, 0 failed, in {time.monotonic() - start:.0f} s")


if __name__ == "__main__":
    sys.exit(main())
