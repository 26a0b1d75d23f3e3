#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""What the farm costs beside the rendering itself, on two million triangles (mesh_scene.py).

    farm_cost.py [--pairs 21] [--width 800] [--samples 16] [--cpu-samples 512]

scaling: the speed-up of 2 render processes against 1, over that which two pinned copies of the bare
traversal of the scene's rays (limit.c) reach against one. core: the farm with 2 render processes
against render-core with 2, which has no network. All are measured in turn, so that a core that has
something else to do slows them alike; the figures are medians of the pairs' ratios, with where the
median lies with 95 %. Then the processor time of the coordinator over that of all its processes,
with tiles of 64x64 pixels whose units take 20 ms. Exits with 1 when one misses what is promised.
"""
import argparse
import json
import pathlib
import re
import subprocess
import sys
import tempfile
import time

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "support"))
import farm  # noqa: E402
import mesh_scene  # noqa: E402
from figures import Page  # noqa: E402

TESTS = farm.BIN.parent / "tests"
CORES = 2
COPIES_S = 0.7  # of a replay
COORDINATORS = 7


class Copies:
    """Pinned copies of the bare traversal, which wait to be asked."""

    def __init__(self, path, assets):
        self.process = subprocess.Popen(
            [TESTS / "limit", path, "--assets", assets, "--samples", "4", "--scale", "2",
             "--copies"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self.rate(1, 0)

    def rate(self, copies, first_core):
        self.process.stdin.write(f"{copies} {first_core} {COPIES_S}\n")
        self.process.stdin.flush()
        return float(self.process.stdout.readline())

    def end(self):
        self.process.stdin.close()
        assert self.process.wait(timeout=60) == 0


def farm_seconds(service, doc):
    """Of rendering. Looks seldom: answers take the coordinator's time too."""
    render, found = service.submit(doc), None
    while not found or found["state"] not in farm.FINAL:
        time.sleep(0.2)
        found = service.resource(render)
    assert found["state"] == "done", found["error"]
    assert service.request("DELETE", f"/v1/renders/{render}").status == 204
    return found["seconds"]


def core_seconds(path, assets):
    told = subprocess.run([TESTS / "render-core", path, "/dev/null", "--assets", assets,
                           "--processes", str(CORES), "--time"],
                          capture_output=True, text=True, check=True, timeout=300).stdout
    return float(told.split()[0])


def pairs(count, doc, path, assets, services):
    """The ratios of both comparisons, and the speed-ups, by name."""
    copies, found = Copies(path, assets), {"bare": [], "farm": [], "scaling": [], "core": []}
    one, two = services
    for number in range(-1, count):  # the first makes everything warm
        bare = [copies.rate(n, max(number, 0) % CORES) for n in (1, CORES)]
        alone, both = farm_seconds(one, doc), farm_seconds(two, doc)
        core = core_seconds(path, assets)
        if number >= 0:
            found["bare"].append(bare[1] / bare[0])
            found["farm"].append(alone / both)
            found["scaling"].append(alone / both * bare[0] / bare[1])
            found["core"].append(core / both)
    copies.end()
    return found


def units(service):
    text = service.request("GET", "/metrics").body.decode()
    return float(re.search(r"^penumbra_units_total (\S+)", text, re.M).group(1))


def coordinator(doc):
    """Processor time of the coordinator and of all its processes, and the number of units."""
    with farm.Farm(CORES, "--tile", 64) as service:
        pid = service.server.pid
        farm_seconds(service, {**doc, "sampling": {"mode": "uniform", "samples": 1}})
        family = [pid, *farm.descendants(pid)]

        def state():
            return [farm.processor_seconds([pid]), farm.processor_seconds(family), units(service)]

        before = state()
        farm_seconds(service, doc)
        return [b - a for a, b in zip(before, state())]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    for option, default in (("--pairs", 21), ("--width", 800), ("--samples", 16),
                            ("--cpu-samples", 512)):
        parser.add_argument(option, type=int, default=default)
    options = parser.parse_args()
    doc, digest, data = mesh_scene.for_penumbra(mesh_scene.parts())
    doc["image"].update(width=options.width, height=options.width * 9 // 16)
    doc["sampling"]["samples"] = options.samples
    page = Page()
    with (tempfile.TemporaryDirectory() as assets, farm.Farm(1) as one, farm.Farm(CORES) as two):
        (pathlib.Path(assets) / digest).write_bytes(data)
        path = pathlib.Path(assets) / "scene.json"
        path.write_text(json.dumps(doc))
        for service in (one, two):
            service.request("PUT", f"/v1/assets/sha256/{digest}", data, timeout=120)
        found = pairs(options.pairs, doc, path, assets, (one, two))
    page.line(f"speed-up of {CORES} bare copies", found["bare"])
    page.line(f"speed-up of {CORES} render processes", found["farm"])
    page.line("scaling: the latter over the former", found["scaling"], least=0.97)
    page.line("core: speed over render-core's", found["core"], least=0.97)
    doc = json.loads((HERE.parent / "reference/scenes/five_balls.json").read_text())
    doc["image"].update(width=960, height=540)
    doc["sampling"] = {"mode": "uniform", "samples": options.cpu_samples}
    found = [coordinator(doc) for _ in range(COORDINATORS)]
    page.line("processor time of a 64x64 unit, ms", [1e3 * whole / count for _, whole, count in found])
    page.line("the coordinator's of it, ms", [1e3 * own / count for own, _, count in found])
    page.line("the coordinator's of all, %", [100 * own / whole for own, whole, _ in found], most=1)
    return int(not page.holds)


if __name__ == "__main__":
    sys.exit(main())
