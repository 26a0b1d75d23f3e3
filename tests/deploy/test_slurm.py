# SPDX-License-Identifier: Apache-2.0
"""Workers as jobs of a real Slurm: a node that dies, a preemption, and the scaler."""
import importlib.machinery
import importlib.util
import json
import subprocess

import pytest
from farm import ROOT, Farm, program, wait_for
from slurm import Slurm

SCRIPT = ROOT / "deploy/slurm/penumbra-worker.sbatch"
SCALE = ROOT / "deploy/slurm/penumbra-slurm-scale"


def scene(samples):
    return {"version": 1, "image": {"width": 320, "height": 192}, "sampling": {"samples": samples},
            "camera": {"position": [0, 2, 6], "look_at": [0, 0.5, 0], "aperture_radius": 0.1},
            "background": {"color": [0.5, 0.6, 0.7]},
            "materials": {"m": {"type": "matte", "color": [0.7, 0.4, 0.3]},
                          "g": {"type": "glossy", "color": [0.8, 0.8, 0.8], "roughness": 0.3}},
            "objects": [{"type": "sphere", "material": "g", "center": [x, 0.5, z], "radius": 0.5}
                        for x in range(-3, 4) for z in range(-4, 2)] +
                       [{"type": "sphere", "material": "m", "center": [0, -1000, 0], "radius": 1000}]}


@pytest.fixture(scope="module")
def slurm(tmp_path_factory):
    with Slurm(tmp_path_factory.mktemp("slurm")) as found:
        yield found


def scale(slurm, farm, *words):
    return slurm.run(SCALE, "--once", f"--server=http://127.0.0.1:{farm.http_port}",
                     f"--connect=127.0.0.1:{farm.worker_port}", f"--sbatch=--chdir={slurm.directory}",
                     "--sbatch=--partition=low", *words, PENUMBRA_WORKER=program("penumbra-worker"))


def workers(farm):
    return {worker["name"]: worker for worker in farm.get("/v1/workers")["workers"]}


def failures(farm):
    text = farm.request("GET", "/metrics").body.decode()
    return next(float(line.split()[1]) for line in text.splitlines()
                if line.startswith("penumbra_units_failed_total"))


def test_a_render_outlives_a_node_and_a_preemption(slurm):
    """Breaks when the batch script starts no worker, when a node's death changes or loses the image, or
    when a preempted worker drops what it is at."""
    with Farm(processes=2) as farm:
        undisturbed = farm.render(scene(768), 90)
    with Farm(processes=0) as farm:
        render = farm.submit(scene(768))
        wait_for(lambda: farm.get("/v1/farm")["queue_depth"] > 2, 20, "a queue")
        # What would be done, and then doing it.
        printed = scale(slurm, farm, "--units=1", "--max=2", "--dry-run")
        assert "--array=1-2" in printed and slurm.run("squeue", "--noheader") == ""
        scale(slurm, farm, "--units=1", "--max=2")
        try:
            wait_for(lambda: len(workers(farm)) == 2, 40, "two workers from Slurm")
            assert scale(slurm, farm, "--units=1", "--max=2") == ""
            farm.wait_progress(render, 0.05, 60)
            first = int(slurm.run("squeue", "--noheader", "--nodelist=first", "--format=%A"))
            slurm.kill_node("first")
            wait_for(lambda: f"slurm-{first}" not in workers(farm), 30, "the lost worker's end")
            preempted(slurm, farm, render)
        except BaseException:
            print(slurm.logs())
            raise
        assert farm.image(render) == undisturbed


def preempted(slurm, farm, render):
    """An urgent job takes the second node: the worker there drains, one that comes later ends the render."""
    second = int(slurm.run("squeue", "--noheader", "--nodelist=second", "--format=%A"))
    assert f"slurm-{second}" in workers(farm)
    before = failures(farm)
    urgent = slurm.run("sbatch", "--parsable", "--partition=urgent", "--nodelist=second", "--output=none",
                       f"--chdir={slurm.directory}", "--wrap=true").strip()
    wait_for(lambda: f"slurm-{second}" not in workers(farm), 40, "the preempted worker's end")
    assert failures(farm) == before, "the preempted worker left units behind"
    assert farm.resource(render)["state"] == "running"
    wait_for(lambda: slurm.job(urgent) in ("", "COMPLETING", "COMPLETED"), 40, "the urgent job's end")
    # Slurm may not know yet of the first node's end: that worker counts still.
    scale(slurm, farm, "--units=1", "--max=2", "--sbatch=--nodelist=second")
    farm.wait(render, 90)
    # Idle: it is let go, by the signal that lets it end in peace.
    name = wait_for(lambda: next(iter(workers(farm)), None), 20, "the worker")
    printed = wait_for(lambda: scale(slurm, farm, "--idle=0"), 20, "a worker let go")
    assert printed == f"scancel --batch --signal=TERM {name.removeprefix('slurm-')}\n"
    wait_for(lambda: not workers(farm), 30, "its end")


@pytest.fixture(scope="module")
def scaler():
    loader = importlib.machinery.SourceFileLoader("penumbra_slurm_scale", str(SCALE))
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader(loader.name, loader))
    loader.exec_module(module)
    return module


@pytest.mark.parametrize("depth, leases, expected", [
    (0, 0, 1), (1, 0, 1), (16, 0, 1), (17, 0, 2), (10, 7, 2), (1000, 0, 5)])
def test_workers_wanted(scaler, depth, leases, expected):
    """Breaks when units that are at work do not count, or a limit does not hold."""
    options = scaler.read_options(["--min=1", "--max=5", "--units=16"])
    assert scaler.wanted({"queue_depth": depth}, [{"leases": leases}], options) == expected


@pytest.mark.parametrize("want, idle, expected", [
    (5, [], (2, [], [])), (3, ["1"], (0, [], [])), (2, ["1"], (0, ["9_2"], [])),
    (0, ["2", "1"], (0, ["9_2"], ["2", "1"])), (1, ["2", "1"], (0, ["9_2"], ["2"])),
    (0, ["7"], (0, ["9_2"], [])), (0, [], (0, ["9_2"], []))])
def test_who_goes(scaler, want, idle, expected):
    """Breaks when a worker that renders would be ended, or one that waits outlives an idle one."""
    have = {"1": "RUNNING", "2": "RUNNING", "9_2": "PENDING"}
    assert scaler.decide(want, have, idle) == expected


def test_idle_counts_from_the_last_work(scaler):
    now = [0]
    idle = scaler.Idle(lambda: now[0])

    def worker(job, leases, state="ready"):
        return {"name": f"slurm-{job}", "leases": leases, "state": state}

    for now[0], leases in ((0, 0), (5, 1), (10, 0), (19, 0)):
        idle.look([worker("1", leases), worker("2", 0), worker("3", 0, "draining"),
                   {"name": "other", "leases": 0, "state": "ready"}])
    assert idle.longer_than(10) == ["2"] and idle.longer_than(9) == ["2", "1"]


def test_a_server_that_is_away_is_an_error_and_no_end(slurm):
    """Breaks when the scaler would cancel workers because the coordinator restarts."""
    run = subprocess.run([SCALE, "--once", "--server=http://127.0.0.1:9"], capture_output=True, text=True,
                         env=slurm.environment, timeout=60, check=False)
    assert run.returncode == 1 and "refused" in run.stderr and run.stdout == ""
    assert json.dumps(slurm.states())
