# SPDX-License-Identifier: Apache-2.0
"""Processes that die, join and are told to stop, in the middle of a render."""
import json
import os
import pathlib
import signal
import subprocess
import time

import farm
import pytest
import scene

WIDTH, HEIGHT, SAMPLES = 160, 120, 600


def long_render(samples):
    return scene.build(
        WIDTH, HEIGHT, samples,
        [scene.floor(), scene.sphere([0, 1, 0], 1, "satin"), scene.sphere([2, 1, -1], 1, "clear")],
        camera=scene.look([0, 2, 7], [0, 1, 0], aperture_radius=0.1, focus_distance=7),
        materials={"white": scene.matte(0.7), "satin": scene.glossy(0.3), "clear": scene.glass(0)},
        lights=[scene.panel([-2, 5, 0], [3, 0, 0], [0, 0, 3], 8)], background=0.2)


@pytest.fixture(scope="module")
def undisturbed():
    with farm.Farm(2) as service:
        return service.render(long_render(SAMPLES), 120)


@pytest.fixture
def service():
    with farm.Farm(2) as running:
        yield running


def started(service, samples=SAMPLES):
    """A render that has merged something, and whose render processes work."""
    render = service.submit(long_render(samples))
    service.wait_progress(render)
    farm.wait_for(service.renders, 5, "render processes")
    return render


def finish(service, render, undisturbed):
    """The render must end as if nothing had happened."""
    found = service.wait(render, 120)
    assert found["tiles_done"] == found["tiles_total"]
    assert found["samples_done"] == WIDTH * HEIGHT * SAMPLES
    assert service.image(render) == undisturbed


def test_render_process_killed(service, undisturbed):
    """Broken by a death that costs more than one process: its brothers and their scene stay."""
    render = started(service)
    worker = service.pools()[0]
    scenes = worker.scenes()
    victim, *others = worker.renders()
    assert others
    os.kill(victim, signal.SIGKILL)
    finish(service, render, undisturbed)
    assert set(others) <= set(worker.renders()) or not worker.renders()
    assert set(scenes) & set(worker.scenes()), "the scene was loaded again"
    assert service.pools()[0].pool == worker.pool
    assert service.resource(render)["restarts"] == 0


def test_scene_process_killed(service, undisturbed):
    """Broken by a pool process that waits for ever for a scene process that is gone."""
    render = started(service)
    for pid in service.pools()[0].scenes():
        os.kill(pid, signal.SIGKILL)
    finish(service, render, undisturbed)


def test_zygote_killed(service, undisturbed):
    """Broken by a worker that goes on without the process that makes its processes."""
    render = started(service)
    os.kill(service.pools()[0].zygotes()[0], signal.SIGKILL)
    finish(service, render, undisturbed)


def test_pool_process_killed(service, undisturbed):
    """Broken by leases that stay with a dead worker, by orphans, or by a pool not started again."""
    render = started(service)
    pool = service.pools()[0].pool
    orphans = farm.descendants(pool)
    os.kill(pool, signal.SIGKILL)
    farm.wait_for(lambda: not any(map(farm.alive, orphans)), 5, "end of the pool's processes")
    farm.wait_for(lambda: any(w.pool != pool for w in service.pools()), 10, "a new pool process")
    finish(service, render, undisturbed)


def test_stopped_render_process(service, undisturbed):
    """Broken by a lease that is renewed by being alive: a stopped process must lose its unit."""
    render = started(service)
    os.kill(service.renders()[0], signal.SIGSTOP)
    finish(service, render, undisturbed)


def test_worker_that_joins_gets_work_at_once(service):
    """Broken by a scheduler that gives out everything at the start."""
    render = started(service, 4000)
    service.connect_worker(1, "--name", "late")

    def late():
        workers = service.get("/v1/workers")["workers"]
        return next((w for w in workers if w["name"] == "late"), None)

    farm.wait_for(late, 10, "the worker's connection")
    farm.wait_for(lambda: late()["tiles_done"] > 0, 2, "its first finished unit")
    assert service.resource(render)["state"] == "running"
    assert service.patch(render, {"state": "cancelled"}).status == 200


def test_work_waits_for_a_worker():
    """Broken by a render that fails, or is lost, because no worker is there yet."""
    with farm.Farm(0) as service:
        render = service.submit(scene.build(32, 32, 4, [scene.sphere()]))
        assert service.resource(render)["state"] == "queued"
        assert service.get("/v1/workers")["workers"] == []
        worker = service.connect_worker(1)
        service.wait(render, 20)
        assert farm.stop_process(worker) == 0


def test_coordinator_killed(service, undisturbed):
    """Broken by an accepted render that is forgotten, or by tiles merged twice after a restart."""
    render = started(service)
    before = service.wait_progress(render, 0.2)
    service.kill()
    service.start()
    after = service.resource(render)
    assert after["state"] in ("queued", "running")
    assert after["created"] == before["created"]
    finish(service, render, undisturbed)


def test_finished_render_survives_a_restart(service):
    """Broken by an image that lives in memory only."""
    render = service.submit(scene.build(40, 30, 4, [scene.sphere()]))
    done = service.wait(render)
    bits = service.image(render)
    service.kill()
    service.start()
    assert service.resource(render)["finished"] == done["finished"]
    assert service.image(render) == bits


def test_nothing_survives_the_coordinator(service):
    """Broken by a process that does not die with its parent."""
    started(service)
    family = service.kill()
    assert len(family) >= 5, "pool, zygote, scene and render processes"
    farm.wait_for(lambda: not any(map(farm.alive, family)), 30, "end of all processes")
    service.start()


@pytest.mark.parametrize("command", [
    ["penumbra-worker", "--connect", "127.0.0.1:9"],
    ["penumbra", "serve", "--listen", "127.0.0.1:0", "--worker-listen", "127.0.0.1:0"]])
def test_a_parent_that_has_ended_already(command, tmp_path):
    """Broken by a process that takes whoever adopts it for its parent, and lives for ever."""
    gone = subprocess.Popen(["true"])
    gone.wait()
    data = ["--data", str(tmp_path / "data")] if "serve" in command else []
    code = subprocess.run(
        [farm.program(command[0]), *command[1:], *data, f"--parent-death={gone.pid}"],
        capture_output=True, timeout=10 * farm.SLOW).returncode
    assert code == (-signal.SIGTERM if data else 1)


def test_second_coordinator_refuses(service):
    """Broken by two processes that write one data directory."""
    second = subprocess.run(service.command(), capture_output=True, text=True, timeout=10)
    assert second.returncode not in (0, None) and second.returncode > 0
    assert str(service.data) in second.stderr + second.stdout
    assert service.request("GET", "/livez").status == 200


def busy_ticks(pids):
    """User CPU time of all these processes, in clock ticks."""
    total = 0
    for pid in pids:
        if farm.alive(pid):
            stat = pathlib.Path(f"/proc/{pid}/stat").read_text()
            total += int(stat.rsplit(")", 1)[1].split()[11])
    return total


def test_cancel_stops_work_within_a_second(service):
    """Broken by units of a cancelled render that are rendered to their end."""
    body = long_render(60000)
    body["image"].update(width=64, height=64)
    render = service.submit(body)
    service.wait_progress(render)
    workers = service.renders()
    begin = time.monotonic()
    assert service.patch(render, {"state": "cancelled"}).status == 200
    assert service.resource(render)["state"] == "cancelled"

    def idle():
        before = busy_ticks(workers)
        time.sleep(0.1)
        return busy_ticks(workers) == before

    farm.wait_for(idle, 1.1, "idle render processes")
    assert time.monotonic() - begin < 1.2 * farm.SLOW
    assert service.request("GET", f"/v1/renders/{render}/image.png").status == 200
    assert service.patch(render, {"state": "running"}).status == 409


def test_a_spare_scene_process_waits(service):
    """Broken by a pool that makes scene processes only when a scene is there: 10 ms late."""
    spare, = farm.wait_for(service.pools()[0].scenes, 5, "the spare scene process")
    assert farm.children(spare) == []
    render = started(service, 4000)
    farm.wait_for(lambda: farm.children(spare), 2, "use of the spare")
    others = farm.wait_for(lambda: set(service.pools()[0].scenes()) - {spare}, 5, "a new spare")
    assert all(farm.children(pid) == [] for pid in others)
    service.patch(render, {"state": "cancelled"})


def test_a_drained_worker_gets_work_again_after_a_reset():
    """Broken by a drain that only shows, or one that nothing but a restart ends."""
    with farm.Farm(1) as service:
        found, = farm.wait_for(lambda: service.get("/v1/workers")["workers"], 20, "a worker")
        path = f"/v1/workers/{found['id']}"
        assert json.loads(service.request("POST", f"{path}/drain").body)["state"] == "draining"
        render = service.submit(long_render(4))
        farm.wait_for(lambda: "leaving" in service.get("/v1/farm")["why_waiting"], 5, "a reason")
        assert service.resource(render)["state"] == "queued"
        assert json.loads(service.request("POST", f"{path}/reset").body)["state"] == "ready"
        service.wait(render)


def test_work_of_a_class_that_is_gone_says_so():
    """Breaks if people are told that processes are busy which may not take the work."""
    with farm.Farm(0) as service:
        first = service.connect_worker(1, "--isa", "v2")
        render = service.submit(long_render(SAMPLES))
        service.wait_progress(render)
        service.connect_worker(1, "--isa", "v3")
        farm.stop_process(first, 30)
        service.remote.remove(first)
        farm.wait_for(lambda: "class" in service.get("/v1/farm")["why_waiting"], 10, "the reason")
        assert service.patch(render, {"state": "cancelled"}).status == 200
        farm.wait_for(lambda: service.get("/v1/farm")["why_waiting"] == "", 10, "an end of it")


def test_sigterm_to_all_processes_of_a_worker_is_a_drain(undisturbed):
    """As systemd and Slurm stop what they started. Broken by render processes that end at once: what they
    were at would be lost, and the worker blamed for it."""
    with farm.Farm(0) as service:
        worker = service.connect_worker(2)
        render = service.submit(long_render(SAMPLES))
        service.wait_progress(render)
        for pid in (worker.pid, *farm.descendants(worker.pid)):
            os.kill(pid, signal.SIGTERM)
        assert worker.wait(timeout=30 * farm.SLOW) == 0
        text = service.request("GET", "/metrics").body.decode()
        assert "\npenumbra_units_failed_total 0\n" in text
        service.connect_worker(2)
        finish(service, render, undisturbed)
