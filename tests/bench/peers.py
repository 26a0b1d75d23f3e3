#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Samples per second beside Blender's Cycles and POV-Ray, scene by scene.

    peers.py [--runs 5] [--samples 64] [--processes 2] [--scale 1] [--skip-povray] [SCENE …]

Each scene of tests/reference/scenes, in --scale its size, is rendered in turn by Penumbra, Cycles and POV-Ray, with the
same number of samples and of cores, runs times. Counted is rendering alone: Penumbra's "seconds" of
the resource, the stamps of Cycles' log from its first sample to its last, POV-Ray's trace time. The
table holds medians, with the least and the greatest; the last column is the ratio of the medians.
"""
import argparse
import json
import os
import pathlib
import re
import statistics
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "support"))
import farm  # noqa: E402
import povray_scene  # noqa: E402

SCENES = HERE.parent / "reference/scenes"


def penumbra(service, path, samples):
    doc = json.loads(path.read_text())
    render = service.submit({"scene": doc, "override": {"sampling": {"samples": samples}}})
    return service.wait(render, 600)["seconds"]


def cycles(path, samples, threads, directory):
    command = ["blender", "-b", "--factory-startup", "-noaudio",
               "-P", str(HERE / "cycles_scene.py"), "--", str(path),
               str(directory / "cycles.exr"), str(samples), str(threads)]
    log = subprocess.run(command, capture_output=True, text=True, check=True, timeout=900).stdout
    stamps = {}
    for minutes, seconds, sample in re.findall(r"Time:(\d+):(\d+\.\d+).*\| Sample (\d+)/", log):
        stamps.setdefault(int(sample), 60 * int(minutes) + float(seconds))
    if samples not in stamps or 0 not in stamps:
        raise RuntimeError(f"Cycles' log has no times:\n{log[-2000:]}")
    return stamps[samples] - stamps[0]


def povray(path, samples, threads, directory):
    """Seconds, or None for a scene that POV-Ray cannot express."""
    doc = json.loads(path.read_text())
    try:
        (directory / "scene.pov").write_text(povray_scene.text(doc, samples))
    except povray_scene.NotExpressible:
        return None
    command = ["povray", "+Iscene.pov", "+Oscene.png", f"+W{doc['image']['width']}",
               f"+H{doc['image']['height']}", f"+WT{threads}", "-D", "-V", "-A"]
    log = subprocess.run(command, cwd=directory, capture_output=True, text=True, timeout=900,
                         env={**os.environ, "HOME": str(directory)}).stderr
    found = re.search(r"Trace Time:.*\(([\d.]+) seconds\)", log)
    if not found:
        raise RuntimeError(f"POV-Ray told no time:\n{log[-2000:]}")
    return float(found.group(1))


def rates(path, samples, seconds):
    """Samples per second in millions: median, least, greatest."""
    image = json.loads(path.read_text())["image"]
    count = image["width"] * image["height"] * samples / 1e6
    values = sorted(count / s for s in seconds)
    return statistics.median(values), values[0], values[-1]


def cell(rate):
    return "%7.2f (%.2f-%.2f)" % rate if rate else "-"


def measure(service, path, options, directory):
    times = {"penumbra": [], "cycles": [], "povray": []}
    for _ in range(options.runs):
        times["penumbra"].append(penumbra(service, path, options.samples))
        times["cycles"].append(cycles(path, options.samples, options.processes, directory))
        if not options.skip_povray:
            times["povray"].append(povray(path, options.samples, options.processes, directory))
    return {name: rates(path, options.samples, seconds) if seconds and seconds[0] else None
            for name, seconds in times.items()}


def scaled(name, scale, directory):
    """A file of the scene in so much of its size."""
    doc = json.loads((SCENES / f"{name}.json").read_text())
    for side in ("width", "height"):
        doc["image"][side] = max(1, round(scale * doc["image"][side]))
    path = directory / f"{name}.json"
    path.write_text(json.dumps(doc))
    return path


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=5)
    parser.add_argument("--samples", type=int, default=64)
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--scale", type=float, default=1)
    parser.add_argument("--skip-povray", action="store_true")
    parser.add_argument("scenes", nargs="*", default=sorted(p.stem for p in SCENES.glob("*.json")))
    options = parser.parse_args()
    print(f"{options.samples} samples a pixel, {options.processes} cores, {options.runs} runs;"
          " millions of samples a second, median (least-greatest)")
    print(f"{'scene':16}{'Penumbra':>24}{'Cycles':>22}{'POV-Ray':>22}{'/ Cycles':>10}")
    with tempfile.TemporaryDirectory() as temporary, farm.Farm(options.processes) as service:
        for name in options.scenes:
            path = scaled(name, options.scale, pathlib.Path(temporary))
            found = measure(service, path, options, pathlib.Path(temporary))
            ratio = found["penumbra"][0] / found["cycles"][0]
            print(f"{name:16}{cell(found['penumbra']):>24}{cell(found['cycles']):>22}"
                  f"{cell(found['povray']):>22}{ratio:>10.2f}", flush=True)


if __name__ == "__main__":
    main()
