#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Small renders, one after the other for hours: memory does not grow, descriptors and the disk come
back to what they were, and the last ones are as fast as the first. Adds a row to the results.

PEN_SOAK_JOBS (default 10000) are spread over PEN_SOAK_SECONDS (default 7200); the first eighth warms
up. Every render is submitted, waited for, fetched and removed; its image must be that of the first
one with the same seed. What else the machine does changes in hours: in the last eighth a farm that
has just been started has the same renders in turn, and the old one must be as fast as that.
"""
import contextlib
import csv
import datetime
import hashlib
import json
import os
import pathlib
import subprocess
import sys
import time

import farm
import scene

ROOT = pathlib.Path(__file__).resolve().parents[2]
RESULTS = ROOT / "tests/results/soak.csv"
JOBS = int(os.environ.get("PEN_SOAK_JOBS", 10000))
SECONDS = float(os.environ.get("PEN_SOAK_SECONDS", 7200))
SEEDS = 50
SLOPE_MAX = 1.0 # MiB an hour
SLOWDOWN_MAX = 1.2
DATABASE_BYTES_MAX = 64 << 20 # and its log; ids of removed renders stay
COLUMNS = ["commit", "date", "seconds", "jobs", "coordinator_mib", "coordinator_mib_h", "pool_mib",
           "pool_mib_h", "descriptors", "descriptors_end", "disk_bytes", "disk_bytes_end", "p50_ms",
           "p99_ms", "p99_end_ms", "p99_fresh_ms", "passed"]


def resident_mib(pid):
    pages = int(pathlib.Path(f"/proc/{pid}/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGESIZE") / (1 << 20)


def descriptors(pid):
    return len(os.listdir(f"/proc/{pid}/fd"))


def disk(directory):
    """Bytes below a data directory, without the database's: (those, the database's)."""
    files = [path for path in directory.rglob("*") if path.is_file()]
    of_database = sum(p.stat().st_size for p in files if p.name.startswith("penumbra.db"))
    return sum(p.stat().st_size for p in files) - of_database, of_database


def slope(points):
    """Of a line through (hours, MiB), by least squares."""
    mean_x = sum(x for x, _ in points) / len(points)
    mean_y = sum(y for _, y in points) / len(points)
    spread = sum((x - mean_x) ** 2 for x, _ in points)
    return sum((x - mean_x) * (y - mean_y) for x, y in points) / spread if spread else 0.0


def quantile(values, share):
    return sorted(values)[min(len(values) - 1, int(share * len(values)))]


class Soak:
    def __init__(self, service):
        self.service, self.images = service, {}
        self.latencies, self.fresh, self.memory = [], [], []

    def one(self, number, service):
        """Seconds from the submission to the last byte of the image."""
        seed = number % SEEDS
        body = scene.build(64, 48, 16, [scene.sphere()], background=0.5, seed=seed)
        begin = time.monotonic()
        render = service.submit(body)
        while True:
            found = json.loads(service.request(
                "GET", f"/v1/renders/{render}", headers={"Prefer": "wait=30"}, timeout=60).body)
            if found["state"] in farm.FINAL:
                break
        assert found["state"] == "done", found["error"]
        image = service.image(render, "exr")
        latency = time.monotonic() - begin
        # What a file says of itself names the render.
        found = hashlib.sha256(service.image(render, "hdr")).hexdigest()
        assert self.images.setdefault(seed, found) == found and image, f"render {render}"
        assert service.request("DELETE", f"/v1/renders/{render}").status == 204
        return latency

    def run(self, jobs, seconds):
        begin, fresh = time.monotonic(), None
        with contextlib.ExitStack() as stack:
            for number in range(jobs):
                due = begin + number * seconds / jobs
                time.sleep(max(0.0, due - time.monotonic()))
                self.latencies.append(self.one(number, self.service))
                self.look(number, jobs, begin)
                if number == jobs - jobs // 8:
                    fresh = stack.enter_context(start())
                    for warming in range(SEEDS):
                        self.one(warming, fresh)
                if fresh:
                    self.fresh.append(self.one(number, fresh))
        return time.monotonic() - begin

    def look(self, number, jobs, begin):
        if number % 10 == 0:
            self.memory.append(((time.monotonic() - begin) / 3600,
                                resident_mib(self.service.server.pid),
                                resident_mib(self.service.pools()[0].pool)))
        if number % max(1, jobs // 20) == 0:
            print(f"{number} renders, {self.memory[-1][1]:.1f} MiB, "
                  f"{1e3 * self.latencies[-1]:.0f} ms", flush=True)


def settled(service, before):
    """Descriptors and bytes once what was removed has gone."""
    def now():
        return descriptors(service.server.pid), disk(service.data)[0]
    try:
        farm.wait_for(lambda: all(a <= b for a, b in zip(now(), before)), 60, "the baseline")
    except AssertionError:
        pass
    return now()


def start():
    return farm.Farm(2, "--tile", 16)


def measure():
    with start() as service:
        soak = Soak(service)
        soak.one(0, service) # encoders and zygotes are there
        farm.wait_for((service.data / "ballast").exists, 60, "the reserve on the disk")
        before = descriptors(service.server.pid), disk(service.data)[0]
        seconds = soak.run(JOBS, SECONDS)
        after = settled(service, before)
        database = disk(service.data)[1]
    warm = len(soak.memory) // 8
    steady = soak.latencies[JOBS // 8:]
    eighth = max(1, JOBS // 8)
    row = {
        "seconds": round(seconds), "jobs": JOBS,
        "coordinator_mib": round(soak.memory[-1][1], 1),
        "coordinator_mib_h": round(slope([(h, a) for h, a, _ in soak.memory[warm:]]), 2),
        "pool_mib": round(soak.memory[-1][2], 1),
        "pool_mib_h": round(slope([(h, b) for h, _, b in soak.memory[warm:]]), 2),
        "descriptors": before[0], "descriptors_end": after[0],
        "disk_bytes": before[1], "disk_bytes_end": after[1],
        "p50_ms": round(1e3 * quantile(steady, 0.5)),
        "p99_ms": round(1e3 * quantile(steady[:eighth], 0.99)),
        "p99_end_ms": round(1e3 * quantile(steady[-eighth:], 0.99)),
        "p99_fresh_ms": round(1e3 * quantile(soak.fresh, 0.99)),
    }
    row["passed"] = "yes" if (
        max(row["coordinator_mib_h"], row["pool_mib_h"]) < SLOPE_MAX and after[0] <= before[0] and
        after[1] <= before[1] and database <= DATABASE_BYTES_MAX and
        row["p99_end_ms"] <= SLOWDOWN_MAX * row["p99_fresh_ms"]) else "no"
    return row


def main():
    head = ["git", "-c", "safe.directory=*", "rev-parse", "--short", "HEAD"]
    commit = subprocess.run(head, cwd=ROOT, stdout=subprocess.PIPE, text=True, check=True).stdout
    row = {"commit": commit.strip(), "date": datetime.date.today().isoformat(), **measure()}
    print(row)
    rows = list(csv.DictReader(RESULTS.open())) if RESULTS.exists() else []
    with RESULTS.open("w", newline="") as file:
        writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        writer.writeheader()
        writer.writerows([*rows, row])
    return int(row["passed"] == "no")


if __name__ == "__main__":
    sys.exit(main())
