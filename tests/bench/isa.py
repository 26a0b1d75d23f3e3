#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Millions of samples a second by instruction set, on one core.

    isa.py [--runs 5] [--samples 32] [SCENE …]

Each scene is rendered in turn by render-core with --isa v2, v3 and v4, as far as the processor goes;
the last column is the speed over that of x86-64-v2 of the same turn. A farm is asked for each set, too,
and must tell it as its class. Scenes: mesh (mesh_scene.py), and those of tests/reference/scenes.
"""
import argparse
import pathlib
import statistics
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "support"))
import farm  # noqa: E402
import limit  # noqa: E402


def sets_here():
    flags = next(line for line in open("/proc/cpuinfo") if line.startswith("flags")).split()
    return ["v2"] + ["v3"] * ("avx2" in flags) + ["v4"] * ("avx512vl" in flags)


def class_of(isa):
    with farm.Farm(1, "--isa", isa) as service:
        return farm.wait_for(lambda: service.get("/v1/workers")["workers"], 20,
                             "a worker")[0]["class"]


def speed(path, assets, isa, samples):
    told = subprocess.run([farm.BIN.parent / "tests/render-core", path, "/dev/null", "--assets",
                           assets, "--isa", isa, "--samples", str(samples), "--time"],
                          capture_output=True, text=True, check=True, timeout=300).stdout
    return float(told.split()[2])


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=5)
    parser.add_argument("--samples", type=int, default=32)
    parser.add_argument("scenes", nargs="*", default=["five_balls", "gloss", "mesh"])
    options = parser.parse_args()
    sets = sets_here()
    for isa in sets:
        name = class_of(isa)
        assert f"x86-64-{isa}" in name, name
        print(f"--isa {isa}: a worker of class {name}")
    print(f"{'scene':16}{'set':5}{'Msamples/s':>11}  least-greatest  over v2")
    for scene in options.scenes:
        with tempfile.TemporaryDirectory() as temporary:
            directory = pathlib.Path(temporary)
            path = limit.scene_file(scene, directory)
            turns = [[speed(path, directory, isa, options.samples) for isa in sets]
                     for _ in range(options.runs)]
        for i, isa in enumerate(sets):
            found = [turn[i] for turn in turns]
            ratio = statistics.median(turn[i] / turn[0] for turn in turns)
            print(f"{scene:16}{isa:5}{statistics.median(found):11.3f}  "
                  f"{f'{min(found):.3f}-{max(found):.3f}':14}{ratio:9.2f}", flush=True)


if __name__ == "__main__":
    main()
