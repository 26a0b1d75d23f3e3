#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""What large scenes and images take: memory, and time to the first ray.

    memory.py [--triangles 6000000] [--side 10000] [--runs 3]

processes: the proportional set size of all processes of a worker with 8 render processes, over that
of one with 1, while they render a mesh of so many triangles from a GLB. image: how much the
anonymous memory (RssAnon) of the coordinator and of the encoder rises, at most, from idle until an
image of side x side pixels with 4 layers is rendered and written as EXR. first ray: from the files
until the first ray is traced, over Embree's own building and reading the GLB (first_ray.c).
Exits with 1 when one misses what is promised.
"""
import argparse
import contextlib
import json
import pathlib
import re
import subprocess
import sys
import tempfile
import threading
import time

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "support"))
import farm  # noqa: E402
import mesh_scene  # noqa: E402
import scene  # noqa: E402
from figures import Page  # noqa: E402

MIB = 1 << 20


def field(pid, file, name):
    """Bytes that /proc tells of a process, 0 when it is gone."""
    with contextlib.suppress(OSError):
        text = pathlib.Path(f"/proc/{pid}/{file}").read_text()
        return 1024 * int(re.search(rf"^{name}:\s+(\d+) kB", text, re.M).group(1))
    return 0


def worker_bytes(processes, doc, digest, data):
    """All processes of a worker together, when all have rendered."""
    doc = {**doc, "sampling": {"mode": "uniform", "samples": 64 * processes}}
    with farm.Farm(processes) as service:
        service.request("PUT", f"/v1/assets/sha256/{digest}", data, timeout=120)
        render = service.submit(doc)
        service.wait_progress(render, 0.1, 300)
        pools = [worker.pool for worker in service.pools()]
        family = pools + [pid for pool in pools for pid in farm.descendants(pool)]
        size = sum(field(pid, "smaps_rollup", "Pss") for pid in family)
        assert len(service.renders()) >= processes
        assert service.patch(render, {"state": "cancelled"}).status == 200
    return size


class Peak:
    """The most anonymous memory of processes beyond that at the start, by pid."""

    def __init__(self, pids):
        self.idle = {pid: field(pid, "status", "RssAnon") for pid in pids}
        self.most, self.over = dict(self.idle), threading.Event()
        self.thread = threading.Thread(target=self.watch)

    def watch(self):
        while not self.over.wait(0.02):
            for pid in self.most:
                self.most[pid] = max(self.most[pid], field(pid, "status", "RssAnon"))

    def __enter__(self):
        self.thread.start()
        return self

    def __exit__(self, *_):
        self.over.set()
        self.thread.join()

    def rise(self, pids):
        return max(self.most[pid] - self.idle[pid] for pid in pids)


def image_rise(side):
    """(MiB of the coordinator, of an encoder, seconds of rendering, of encoding)."""
    doc = scene.build(side, side, 1, [scene.floor(), scene.sphere([0, 1, 0])], background=0.5,
                      camera=scene.look([0, 2, 6], [0, 1, 0]), integrator="whitted")
    doc["image"]["aovs"] = ["albedo", "normal", "depth"]
    with farm.Farm(2) as service:
        service.image(service.submit({**doc, "image": {**doc["image"], "width": 64, "height": 64}}))
        encoders = service.encoders()
        with Peak([service.server.pid, *encoders]) as peak:
            render = service.submit(doc)
            seconds = service.wait(render, 600)["seconds"]
            start = time.monotonic()
            answer = service.request("GET", f"/v1/renders/{render}/image.exr", timeout=300)
            assert answer.status == 200, answer.body[:300]
        return (peak.rise([service.server.pid]) / MIB, peak.rise(encoders) / MIB, seconds,
                time.monotonic() - start)


def first_rays(runs, doc, digest, data):
    """Each run's seconds to the first ray, of Embree's building, of reading."""
    with tempfile.TemporaryDirectory() as directory:
        path = pathlib.Path(directory) / "scene.json"
        path.write_text(json.dumps(doc))
        (pathlib.Path(directory) / digest).write_bytes(data)
        command = [farm.BIN.parent / "tests/first-ray", path, directory, digest]
        for _ in range(runs):
            told = subprocess.run(command, capture_output=True, text=True, check=True, timeout=600)
            whole, reading, building = map(float, told.stdout.split())
            yield whole, building, reading


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    for option, default in (("--triangles", 6000000), ("--side", 10000), ("--runs", 3)):
        parser.add_argument(option, type=int, default=default)
    options = parser.parse_args()
    page = Page()
    doc, digest, data = mesh_scene.for_penumbra([mesh_scene.hills_of(options.triangles)])
    found = list(first_rays(options.runs, doc, digest, data))
    page.line("first ray: Embree's building, s", [building for _, building, _ in found])
    page.line("first ray: reading the GLB, s", [reading for _, _, reading in found])
    page.line("first ray: over both", [whole / (building + reading)
                                       for whole, building, reading in found], most=1.5)
    one, eight = (worker_bytes(n, doc, digest, data) for n in (1, 8))
    page.line("processes: MiB of a worker with 1", [one / MIB])
    page.line("processes: 8 over 1", [eight / one], most=1.15)
    coordinator, encoder, rendering, encoding = image_rise(options.side)
    page.line("image: seconds of rendering", [rendering])
    page.line("image: seconds of encoding", [encoding])
    page.line("image: MiB of the coordinator beyond idle", [coordinator], most=256)
    page.line("image: MiB of an encoder beyond idle", [encoder], most=256)
    return int(not page.holds)


if __name__ == "__main__":
    sys.exit(main())
