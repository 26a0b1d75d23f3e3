# SPDX-License-Identifier: Apache-2.0
"""The coordinator dies at each of the calls that change its data directory, and the disk keeps what a
power cut leaves of it: nothing that was acknowledged is missing, and no bit of an image differs.

Each round runs a scenario (renders accepted, finished, cancelled and removed) until the call whose
turn it is, and starts again; every third round dies once more while it recovers. PEN_POWER_SECONDS
chooses how long, PEN_POWER_SEED other rounds; what was cut is printed. With PEN_POWER_FIRST it goes
through all there are, from that one on: at each call a death that the disk knows nothing of and one
that it does, and a second one at each call of a recovery.
"""
import contextlib
import http.client
import json
import os
import random
import shutil
import subprocess
import time

import farm
import scene

SECONDS = float(os.environ.get("PEN_POWER_SECONDS", 60))
SEED = int(os.environ.get("PEN_POWER_SEED", 1))
FIRST = int(os.environ.get("PEN_POWER_FIRST", 0))
SHIM = farm.BIN.parent / "tests/power.so"


def still(seed):
    return scene.build(48, 32, 20, [scene.sphere()], background=0.5, seed=seed)


def moving(seed):
    body = scene.build(40, 32, 32, [scene.sphere()], background=0.5, seed=seed)
    body["sampling"] = {"mode": "adaptive", "samples": 64, "error": 0.02}
    body["frames"] = {"first": 1, "last": 3, "fps": 24}
    return body


class Cut(farm.Farm):
    """A farm whose coordinator is under the shim, when at is set."""

    at = seed = count = None

    def command(self):
        words = {"LD_PRELOAD": SHIM, "PEN_POWER_DIR": self.data, "PEN_POWER_AT": self.at,
                 "PEN_POWER_SEED": self.seed, "PEN_POWER_COUNT": self.count}
        shim = [f"{name}={value}" for name, value in words.items() if value is not None]
        return ["env", *(shim if self.at else []), *super().command()]

    def start_and_perhaps_die(self):
        with contextlib.suppress(AssertionError):
            self.start()
            return True
        self.reap()
        return False

    def reap(self):
        """After its death, or now."""
        if self.server is None:
            return
        family = farm.descendants(self.server.pid)
        self.server.kill()
        self.server.wait(timeout=10)
        self.server = None
        farm.wait_for(lambda: not any(map(farm.alive, family)), 30, "end of its processes")


class History:
    """What the coordinator has promised."""

    def __init__(self):
        self.accepted, self.cancelled, self.removed = {}, set(), set()


def until_it_dies(service, history):
    """Some of everything that is promised, until the coordinator is no more."""
    renders = []
    for body in (still(1), moving(2), still(3), still(4)):
        renders.append(service.submit(body))
        history.accepted[renders[-1]] = json.dumps(body)
    first, second, third, fourth = renders
    if service.patch(fourth, {"state": "cancelled"}).status == 200:
        history.cancelled.add(fourth)
    service.wait(first, 30)
    service.image(first)
    if service.request("DELETE", f"/v1/renders/{third}").status == 204:
        history.removed.add(third)
    service.wait(second, 30)


DEATHS = (ConnectionError, http.client.HTTPException, OSError)


def images(service, render):
    found = service.resource(render)
    first, last = found["frames"]["first"], found["frames"]["last"]
    return [service.request("GET", f"/v1/renders/{render}/frames/{n}.exr").body
            for n in range(first, last + 1)]


def check(service, history, wanted):
    for render, body in history.accepted.items():
        status = service.request("GET", f"/v1/renders/{render}").status
        if render in history.removed:
            assert status == 410, f"removed render {render}: {status}"
            continue
        if status == 410:
            continue  # its removal came through before the answer did
        assert status == 200, f"accepted render {render}: {status}"
        if render in history.cancelled:
            assert service.resource(render)["state"] == "cancelled"
            continue
        found = farm.wait_for(lambda r=render: (f := service.resource(r))["state"] in farm.FINAL and f,
                              60, f"end of {render}")
        if found["state"] != "cancelled":
            assert found["state"] == "done", found["error"]
            assert images(service, render) == wanted[body], f"render {render}"


def one_round(directory, at, seed, wanted, again):
    """seed: None when the disk keeps everything; again: the call of the recovery, or 0."""
    history = History()
    with Cut(1, "--tile", 16, data=directory) as service:
        service.stop()
        service.at, service.seed = at, seed
        if service.start_and_perhaps_die():
            with contextlib.suppress(*DEATHS, AssertionError):
                until_it_dies(service, history)
        service.reap()
        if again:
            service.at = again
            service.start_and_perhaps_die()
            service.reap()
        service.at = None
        service.start()
        check(service, history, wanted)
        service.stop()
        run = subprocess.run([farm.program("penumbra"), "fsck", "--data", directory],
                             capture_output=True, text=True, timeout=60)
        assert run.returncode == 0, run.stdout
        service.start()
    return len(history.accepted)


def undisturbed(directory):
    """The images of the scenario's renders, how many calls it makes in all, and a recovery."""
    count = directory / "count"
    wanted = {}
    with Cut(1, "--tile", 16, data=directory / "plain") as service:
        service.stop()
        service.at, service.count = 1 << 60, count
        service.start()
        until_it_dies(service, History())
        service.stop()
        service.at = None
        service.start()
        for body in (still(1), moving(2), still(3), still(4)):
            render = service.submit(body)
            service.wait(render)
            wanted[json.dumps(body)] = images(service, render)
    calls = int(count.read_text())
    with Cut(1, "--tile", 16, data=directory / "half") as service:
        service.stop()
        service.at = calls // 2
        service.start()
        with contextlib.suppress(*DEATHS, AssertionError):
            until_it_dies(service, History())
        service.reap()
        service.at, service.count = 1 << 60, count
        service.start()
        service.stop()
    return wanted, calls, int(count.read_text())


def some(calls, recovery, draw):
    order = draw.sample(range(1, calls + 1), calls)
    return [(at, True, draw.randint(1, recovery) if number % 3 == 2 else 0)
            for number, at in enumerate(order)]


def every(calls, recovery):
    """(call, whether the disk loses what it may, call of the recovery or 0)."""
    once = [(at, loses, 0) for at in range(1, calls + 1) for loses in (False, True)]
    # What there is to recover is another thing each time.
    twice = [(1 + again * calls // (recovery + 1), loses, again)
             for again in range(1, recovery + 1) for loses in (False, True)]
    return once + twice


def test_power_cuts(tmp_path):
    """Broken by an answer before its fsync, a file that is trusted before its directory is synced, or
    a recovery that cannot be interrupted."""
    wanted, calls, recovery = undisturbed(tmp_path)
    draw, end = random.Random(SEED), time.monotonic() + SECONDS
    order = every(calls, recovery) if FIRST else some(calls, recovery, draw)
    first = min(max(FIRST, 1), len(order))
    rounds = kept = 0
    for at, loses, again in order[first - 1:]:
        seed = draw.randrange(1, 1 << 30) if loses else None
        print(f"call {at} of {calls}, seed {seed}, then {again} of {recovery}", flush=True)
        kept += one_round(tmp_path / "round", at, seed, wanted, again)
        shutil.rmtree(tmp_path / "round")
        rounds += 1
        if time.monotonic() > end:
            break
    print(f"{rounds} power cuts, {kept} renders were accepted before them")
    print(f"rounds {first}-{first + rounds - 1} of {len(order)}")
    assert rounds >= min(3, len(order)) and (kept > 0 or FIRST)
