# SPDX-License-Identifier: Apache-2.0
"""A full disk, and what is removed before it is one."""
import errno
import os
import subprocess
import time

import farm
import pytest
import scene


def small(seed, samples=4):
    return scene.build(70, 50, samples, [scene.sphere()], background=0.5, seed=seed)


def animation(seed, frames=8):
    """Frames of 1 MiB, each some hundred milliseconds of two cores."""
    body = scene.build(256, 256, 40, [scene.sphere([0, 1, 0])], background=0.5, seed=seed)
    body["frames"] = {"first": 1, "last": frames, "fps": 24}
    return body


@pytest.fixture
def disk(tmp_path):
    """A file system of 32 MiB."""
    subprocess.run(["mount", "-t", "tmpfs", "-o", "size=32m", "tmpfs", tmp_path], check=True)
    yield tmp_path
    subprocess.run(["umount", "--lazy", tmp_path], check=True)


def free(path):
    found = os.statvfs(path)
    return found.f_bavail * found.f_frsize


def fill(disk, but):
    """Takes all room but so many bytes; the file to remove for it."""
    filler = disk / "filler"
    with open(filler, "wb") as file:
        while True:
            try:
                os.posix_fallocate(file.fileno(), 0, free(disk) - but)
                break
            except OSError as error:  # frames have taken some of it since
                if error.errno != errno.ENOSPC:
                    raise
                file.truncate(0)
    return filler


def test_a_full_disk_pauses_and_goes_on(disk):
    """Broken by a render that fails, one that is accepted and cannot be kept, a finished image that
    is not served, a removal that finds no room, or a pause that somebody must end by hand."""
    with farm.Farm(2, data=disk / "data") as service:
        undisturbed, done = service.submit(animation(1)), service.submit(small(2))
        service.wait(undisturbed, 120)
        service.wait(done)
        frames = [service.request("GET", f"/v1/renders/{undisturbed}/frames/{n}.exr").body
                  for n in range(1, 9)]
        assert service.request("DELETE", f"/v1/renders/{undisturbed}").status == 204
        render = service.submit(animation(1))
        farm.wait_for(lambda: service.resource(render)["frames"]["done"] >= 1, 60, "a frame")
        filler = fill(disk, 600 << 10)
        paused = farm.wait_for(
            lambda: (r := service.resource(render))["state"] == "paused" and r, 60, "the pause")
        assert "disk" in paused["error"]
        assert "room on the disk" in service.get("/v1/farm")["why_waiting"]
        assert service.post(small(3)).status == 507
        assert service.image(done, "png") and service.image(done, "exr")

        # To the last byte: even then a render can be removed.
        with open(disk / "rest", "wb") as file:
            os.posix_fallocate(file.fileno(), 0, free(disk))
        assert service.request("DELETE", f"/v1/renders/{done}").status == 204
        assert service.request("GET", "/livez").status == 200
        assert service.resource(render)["state"] == "paused"

        filler.unlink()
        (disk / "rest").unlink()
        service.wait(render, 120)
        for n, wanted in enumerate(frames, 1):
            assert service.request("GET", f"/v1/renders/{render}/frames/{n}.exr").body == wanted
        service.wait(service.submit(small(3)))


def test_a_pause_for_the_disk_outlives_the_coordinator(disk):
    """Broken by a restart that takes it for a user's."""
    with farm.Farm(2, data=disk / "data") as service:
        render = service.submit(animation(1))
        farm.wait_for(lambda: service.resource(render)["frames"]["done"] >= 1, 60, "a frame")
        filler = fill(disk, 600 << 10)
        farm.wait_for(lambda: service.resource(render)["state"] == "paused", 60, "the pause")
        service.kill()
        service.start()
        assert service.resource(render)["state"] == "paused"
        filler.unlink()
        service.wait(render, 120)


def test_a_users_pause_stays(disk):
    """Broken by upkeep that resumes whatever is paused."""
    with farm.Farm(2, data=disk / "data") as service:
        render = service.submit(animation(1))
        assert service.patch(render, {"state": "paused"}).status == 200
        time.sleep(3)
        assert service.resource(render)["state"] == "paused"
        assert service.patch(render, {"state": "cancelled"}).status == 200


def test_the_oldest_renders_go_first(tmp_path):
    """Broken by frames that grow without bound, or a removal of the newest or of unfinished ones."""
    with farm.Farm(2, "--keep-frames", 1, "--tile", 16, data=tmp_path / "data") as service:
        body = scene.build(160, 160, 1, [scene.sphere()], background=0.5)  # 400 KiB
        paused = service.submit(dict(body))
        assert service.patch(paused, {"state": "paused"}).status in (200, 409)
        renders = [service.submit(scene.build(160, 160, 1, [scene.sphere()], seed=n))
                   for n in range(4)]
        for render in renders:
            farm.wait_for(lambda r=render: service.request("GET", f"/v1/renders/{r}").status == 410
                          or service.resource(r)["state"] == "done", 30, "its end")

        def kept():
            return [service.request("GET", f"/v1/renders/{r}").status for r in renders]

        farm.wait_for(lambda: kept() == [410, 410, 200, 200], 30, "removal of the oldest")


def test_bad_bounds_are_refused(tmp_path):
    """Broken by a number that is taken for none."""
    for option, value in (("--keep-frames", "x"), ("--keep-frames", str((1 << 30) + 1)),
                          ("--keep-renders", "-1"), ("--keep-renders", "87601")):
        run = subprocess.run([farm.program("penumbra"), "serve", "--data", tmp_path, option, value],
                             capture_output=True, text=True, timeout=10)
        assert run.returncode == 2 and option in run.stderr
