# SPDX-License-Identifier: Apache-2.0
"""Processes of every kind die at random while renders come and go: none is lost, no bit differs.

PEN_CHAOS_SEED and PEN_CHAOS_SECONDS choose another run; the seed is printed with the faults.
"""
import collections
import contextlib
import os
import random
import signal
import time

import farm
import scene

SEED = int(os.environ.get("PEN_CHAOS_SEED", 1))
SECONDS = float(os.environ.get("PEN_CHAOS_SECONDS", 45))


def subject(seed):
    """About a second of two cores."""
    return scene.build(
        160, 120, 300, [scene.floor(), scene.sphere([0, 1, 0], 1, "satin")], seed=seed,
        camera=scene.look([0, 2, 6], [0, 1, 0], aperture_radius=0.1, focus_distance=6),
        materials={"white": scene.matte(0.7), "satin": scene.glossy(0.3)}, background=0.2,
        lights=[scene.panel([-2, 5, 0], [3, 0, 0], [0, 0, 3], 8)])


class Nemesis:
    """One fault at a time, each kind as often as the others; fired counts those that hit."""

    def __init__(self, service, seed):
        self.service, self.random = service, random.Random(seed)
        self.fired = collections.Counter()

        self.kinds = {
            "render": self.kill_render, "scene": self.kill_scene, "zygote": self.kill_zygote,
            "pool": self.kill_pool, "stop": self.stop_render, "encoder": self.kill_encoder,
            "coordinator": self.kill_coordinator}

    def least(self):
        return min(self.fired[kind] for kind in self.kinds)

    def strike(self):
        least = self.least()
        kind = self.random.choice([k for k in sorted(self.kinds) if self.fired[k] == least])
        if self.kinds[kind]():
            self.fired[kind] += 1

    def _signal_one(self, pids, number=signal.SIGKILL):
        if not pids:
            return False
        with contextlib.suppress(ProcessLookupError):
            os.kill(self.random.choice(sorted(pids)), number)
            return True
        return False

    def _each(self, role):
        return [pid for worker in self.service.pools() for pid in role(worker)]

    def kill_render(self):
        return self._signal_one(self._each(farm.Worker.renders))

    def stop_render(self):
        return self._signal_one(self._each(farm.Worker.renders), signal.SIGSTOP)

    def kill_scene(self):
        return self._signal_one(self._each(farm.Worker.scenes))

    def kill_zygote(self):
        return self._signal_one(self._each(farm.Worker.zygotes))

    def kill_pool(self):
        return self._signal_one([worker.pool for worker in self.service.pools()])

    def kill_encoder(self):
        return self._signal_one(self.service.encoders())

    def kill_coordinator(self):
        family = self.service.kill()
        # One that lingers does so for ever; on a busy machine each of four generations that die one
        # after the other waits for its turn, at the lowest priority.
        farm.wait_for(lambda: not any(map(farm.alive, family)), 30, "end of its processes")
        self.service.start()
        return True


def unfinished(service, renders):
    states = [service.resource(render)["state"] for render, _ in renders]
    return sum(state not in farm.FINAL for state in states)


def test_chaos():
    """Broken by any death that loses a render, a tile, or a bit."""
    print(f"seed {SEED}, {SECONDS:g} s")
    with farm.Farm(2) as service:
        wanted = {seed: service.render(subject(seed), 120) for seed in range(3)}
        nemesis, accepted = Nemesis(service, SEED), []
        begin = time.monotonic()
        # On a busy machine little happens in that time: it goes on until each fault has fired.
        while time.monotonic() < begin + SECONDS or (
                time.monotonic() < begin + 5 * SECONDS and (nemesis.least() < 2 or len(accepted) < 3)):
            if unfinished(service, accepted[-4:]) < 2:
                seed = len(accepted) % len(wanted)
                accepted.append((service.submit(subject(seed)), seed))
            time.sleep(nemesis.random.uniform(0.2, 1.2))
            nemesis.strike()
        print(dict(nemesis.fired), f"{len(accepted)} renders")
        assert nemesis.least() >= 2 and len(accepted) >= 3
        for render, seed in accepted:
            service.wait(render, 120)
            assert service.image(render) == wanted[seed], f"render {render}, seed {seed}"
