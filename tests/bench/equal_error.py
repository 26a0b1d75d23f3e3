#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The time to an equal error beside Blender's Cycles, scene by scene.

    equal_error.py [--runs 3] [--samples 64 256] [--processes 2] [--seeds 4] [--scale 0.5]
                   [--full 1] [SCENE …]

How far each renderer is off after so many samples is the RMSE, over pixels and channels, of values
compressed by v / (1 + v), against its own image with 16 times the most samples and another seed;
the mean square is over images of --seeds seeds, for where most of it is in few pixels that of one
image differs by a tenth from another's.
Penumbra's fewest samples, a multiple of 16, whose RMSE is at most that of Cycles are looked for;
these errors are measured on images of --scale the size, which makes them no other but the
references cheaper. Then both render the scene in --full its size with as many samples, in turn, runs
times. Counted is rendering alone, by the wall (Penumbra's "seconds" of the resource, the stamps of
Cycles' log from its first sample to its last) and in processor time of all processes (what a run
takes beyond one of a single sample). Start, loading, building and writing the file is what the rest
of a whole run takes, told beside. On a machine that does nothing else both ratios are one; on a
busy one the processor time still holds. The scene "mesh" is tests/bench/mesh_scene.py.

Exits with 1 when a ratio of processor times is below what is promised: 8, and 4 for the mesh.
"""
import argparse
import collections
import json
import math
import pathlib
import re
import resource
import statistics
import subprocess
import sys
import tempfile
import time

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "support"))
import farm  # noqa: E402
import image  # noqa: E402
import mesh_scene  # noqa: E402
import numpy as np  # noqa: E402
from sampling_error import compress  # noqa: E402

SCENES = HERE.parent / "reference/scenes"
NAMES = ["five_balls", "soft_shadow", "depth_of_field", "motion_blur", "gloss", "mesh"]
PROMISED = {"mesh": 4}
REFERENCE_SEED, REFERENCE_FACTOR, BLOCK = 1 << 20, 16, 16


# The pixels; the seconds of rendering, by the wall; those of all the rest; processor time of both.
Run = collections.namedtuple("Run", "pixels seconds rest processor")


class Penumbra:
    def __init__(self, doc, service):
        self.doc, self.service = doc, service

    def processor(self):
        pid = self.service.server.pid
        return farm.processor_seconds([pid, *farm.descendants(pid)])

    def render(self, size, samples, seed=0):
        doc = {**self.doc, "image": {**self.doc["image"], **size},
               "sampling": {"mode": "uniform", "samples": samples, "seed": seed}}
        start, before = time.monotonic(), self.processor()
        render = self.service.submit(doc)
        seconds = self.service.wait(render, 3600)["seconds"]
        pixels = image.read(self.service.image(render))
        rest, processor = time.monotonic() - start - seconds, self.processor() - before
        self.service.request("DELETE", f"/v1/renders/{render}")
        return Run(pixels, seconds, rest, processor)


class Cycles:
    def __init__(self, doc, directory, threads):
        self.doc, self.directory, self.threads = doc, directory, threads

    @staticmethod
    def processor():
        used = resource.getrusage(resource.RUSAGE_CHILDREN)
        return used.ru_utime + used.ru_stime

    def render(self, size, samples, seed=0):
        path, output = self.directory / "scene.json", self.directory / "cycles.exr"
        path.write_text(json.dumps({**self.doc, "image": {**self.doc["image"], **size}}))
        command = ["blender", "-b", "--factory-startup", "-noaudio",
                   "-P", str(HERE / "cycles_scene.py"), "--", str(path), str(output),
                   str(samples), str(self.threads), str(seed)]
        start, before = time.monotonic(), self.processor()
        log = subprocess.run(command, capture_output=True, text=True, check=True,
                             timeout=3600).stdout
        whole, processor = time.monotonic() - start, self.processor() - before
        stamps = {}
        for minutes, seconds, sample in re.findall(r"Time:(\d+):(\d+\.\d+).*\| Sample (\d+)/", log):
            stamps.setdefault(int(sample), 60 * int(minutes) + float(seconds))
        if samples not in stamps or 0 not in stamps:
            raise RuntimeError(f"Cycles' log has no times:\n{log[-2000:]}")
        seconds = stamps[samples] - stamps[0]
        return Run(image.read_file(output), seconds, whole - seconds, processor)


class Errors:
    """RMSE by samples of one renderer."""

    def __init__(self, renderer, size, most, seeds):
        self.renderer, self.size, self.seeds, self.known = renderer, size, seeds, {}
        self.reference = compress(
            renderer.render(size, REFERENCE_FACTOR * most, REFERENCE_SEED).pixels)

    def at(self, samples):
        if samples not in self.known:
            images = (self.renderer.render(self.size, samples, seed).pixels
                      for seed in range(self.seeds))
            self.known[samples] = math.sqrt(statistics.fmean(
                ((compress(pixels) - self.reference) ** 2).mean() for pixels in images))
        return self.known[samples]

    def fewest(self, target):
        """The fewest samples, a multiple of a block, whose error is at most the target's."""
        high = BLOCK
        while self.at(high) > target:
            high *= 2
        low = high // 2 if high > BLOCK else 0
        while high - low > BLOCK:
            middle = (low + high) // 2 // BLOCK * BLOCK
            low, high = (middle, high) if self.at(middle) > target else (low, middle)
        return high


def subjects(name, service, directory, threads):
    if name == "mesh":
        meshes = mesh_scene.parts()
        doc, digest, data = mesh_scene.for_penumbra(meshes)
        answer = service.request("PUT", f"/v1/assets/sha256/{digest}", data, timeout=120)
        assert answer.status in (200, 201), answer.status
        return (Penumbra(doc, service),
                Cycles(mesh_scene.for_cycles(meshes, directory), directory, threads))
    doc = json.loads((SCENES / f"{name}.json").read_text())
    return Penumbra(doc, service), Cycles(doc, directory, threads)


def measure(name, options, service, directory):
    """Rows of one scene: a dict for each number of Cycles' samples."""
    ours, cycles = subjects(name, service, directory, options.processes)
    full, size = ({key: max(1, round(ours.doc["image"][key] * scale)) for key in ("width", "height")}
                  for scale in (options.full, options.scale))
    most = max(options.samples)
    errors = [Errors(renderer, size, most, options.seeds) for renderer in (ours, cycles)]
    for samples in options.samples:
        target = errors[1].at(samples)
        needed = errors[0].fewest(target)
        runs = [(ours.render(full, needed), cycles.render(full, samples),
                 ours.render(full, 1), cycles.render(full, 1)) for _ in range(options.runs)]
        yield {"scene": name, "rmse": target, "promised": PROMISED.get(name, 8),
               "own": row(needed, [(run[0], run[2]) for run in runs]),
               "cycles": row(samples, [(run[1], run[3]) for run in runs])}


def row(samples, runs):
    """Of one renderer: medians of runs, each beside one of a single sample."""
    share = samples / (samples - 1)
    return {"samples": samples, "wall": statistics.median(run.seconds for run, _ in runs),
            "rest": statistics.median(run.rest for run, _ in runs),
            "runs": [share * (run.processor - least.processor) for run, least in runs]}


def text(found):
    """A line of the table, and whether it holds what is promised."""
    own, cycles = found["own"], found["cycles"]
    ratios = sorted(c / max(o, 0.01) for c, o in zip(cycles["runs"], own["runs"]))
    ratio = statistics.median(ratios)
    line = f"{found['scene']:15}{found['rmse']:9.5f}"
    for side in (cycles, own):
        line += (f"{side['samples']:9}{statistics.median(side['runs']):8.2f}{side['wall']:8.2f}"
                 f"{side['rest']:7.1f}")
    spread = "(%.1f-%.1f)" % (ratios[0], ratios[-1])
    return (f"{line}{ratio:8.2f} {spread:14}{cycles['wall'] / own['wall']:7.2f}"
            f"{'>=':>5} {found['promised']}", ratio >= found["promised"])


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--samples", type=int, nargs="+", default=[64, 256])
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--seeds", type=int, default=4)
    parser.add_argument("--scale", type=float, default=0.5)
    parser.add_argument("--full", type=float, default=1)
    parser.add_argument("scenes", nargs="*", default=NAMES)
    options = parser.parse_args()
    print(f"{options.processes} cores, {options.runs} runs; seconds of rendering in processor time,"
          " by the wall, and of the rest; median (least-greatest) ratio of processor times, ratio"
          " by the wall")
    head = "".join(f"{who:>9}{'proc':>8}{'wall':>8}{'rest':>7}" for who in ("Cycles", "Penumbra"))
    print(f"{'scene':15}{'RMSE':>9}{head}{'ratio':>8}{'':15}{'wall':>7}  promised")
    missed = 0
    with tempfile.TemporaryDirectory() as temporary, farm.Farm(options.processes) as service:
        for name in options.scenes:
            for found in measure(name, options, service, pathlib.Path(temporary)):
                line, holds = text(found)
                missed += not holds
                print(line, flush=True)
    return int(missed > 0)


if __name__ == "__main__":
    sys.exit(main())
