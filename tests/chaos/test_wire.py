# SPDX-License-Identifier: Apache-2.0
"""Four workers, two of them in network namespaces behind a proxy that spoils the wire, while workers
are killed, stopped and cut off: no render is lost, no bit differs.

PEN_WIRE_SEED and PEN_WIRE_SECONDS choose another run; the seed is printed with the faults.
"""
import collections
import contextlib
import os
import random
import signal
import subprocess
import time

import farm
import scene
from fault_proxy import KINDS, FaultProxy

SEED = int(os.environ.get("PEN_WIRE_SEED", 1))
SECONDS = float(os.environ.get("PEN_WIRE_SECONDS", 60))


def subject(seed):
    return scene.build(160, 120, 150, [scene.floor(), scene.sphere([0, 1, 0], 1, "satin")], seed=seed,
                       camera=scene.look([0, 2, 6], [0, 1, 0]),
                       materials={"white": scene.matte(0.7), "satin": scene.glossy(0.3)}, background=0.4)


def ip(*words):
    subprocess.run(["ip", *map(str, words)], check=True, capture_output=True)


class Namespace:
    """A network namespace, a cable to it, and a proxy at this end of the cable."""

    def __init__(self, number, target, seed):
        self.name, self.cable = f"pen-{os.getpid()}-{number}", f"pen{os.getpid() % 10000}.{number}"
        network = f"10.199.{2 * (SEED % 100) + number}" # those of other seeds may go on beside it
        here, there = f"{network}.1", f"{network}.2"
        ip("netns", "add", self.name)
        ip("link", "add", self.cable, "type", "veth", "peer", "name", "eth0", "netns", self.name)
        ip("addr", "add", f"{here}/24", "dev", self.cable)
        ip("-n", self.name, "addr", "add", f"{there}/24", "dev", "eth0")
        for words in (("link", "set", self.cable, "up"), ("-n", self.name, "link", "set", "eth0", "up")):
            ip(*words)
        self.proxy = FaultProxy(here, target, seed)
        self.address = f"{here}:{self.proxy.port}"

    def cut(self):
        ip("link", "set", self.cable, "down")

    def join(self):
        ip("link", "set", self.cable, "up")

    def close(self):
        self.proxy.close()
        with contextlib.suppress(subprocess.CalledProcessError):
            ip("netns", "del", self.name)


class Remote:
    """A worker that is started again when it has ended."""

    def __init__(self, service, namespace=None):
        self.service, self.namespace, self.process = service, namespace, None
        self.start()

    def start(self):
        prefix = ["ip", "netns", "exec", self.namespace.name] if self.namespace else []
        address = self.namespace.address if self.namespace else f"127.0.0.1:{self.service.worker_port}"
        with open(self.service.log, "ab") as log:
            self.process = subprocess.Popen(
                [*prefix, farm.program("penumbra-worker"), "--connect", address, "--processes", "1",
                 "--name", self.namespace.name if self.namespace else "plain"],
                stdin=subprocess.DEVNULL, stdout=log, stderr=log)

    def signal(self, number):
        if self.process.poll() is None:
            self.process.send_signal(number)

    def end(self):
        self.signal(signal.SIGCONT)
        self.signal(signal.SIGKILL)
        self.process.wait(timeout=10)


class Nemesis:
    def __init__(self, remotes, seed):
        self.remotes, self.random = remotes, random.Random(seed)
        self.fired, self.healing = collections.Counter(), []

    def strike(self):
        remote = self.random.choice(self.remotes)
        kind = self.random.choice(["kill", "stop", "cut"] if remote.namespace else ["kill", "stop"])
        self.fired[kind] += 1
        until = time.monotonic() + self.random.uniform(1, 15)
        if kind == "kill":
            remote.end()
            remote.start()
        elif kind == "stop":
            remote.signal(signal.SIGSTOP)
            self.healing.append((until, lambda: remote.signal(signal.SIGCONT)))
        else:
            remote.namespace.cut()
            self.healing.append((until, remote.namespace.join))

    def heal(self, now=float("inf")):
        for until, mend in self.healing:
            if until <= now:
                mend()
        self.healing = [(until, mend) for until, mend in self.healing if until > now]


def run(service, nemesis):
    """Renders come and go while the nemesis strikes, every second to five; (render, seed) of each."""
    accepted, end, next_strike = [], time.monotonic() + SECONDS, 0
    while time.monotonic() < end:
        states = [service.resource(render)["state"] for render, _ in accepted[-4:]]
        if sum(state not in farm.FINAL for state in states) < 2:
            seed = len(accepted) % 3
            accepted.append((service.submit(subject(seed)), seed))
        nemesis.heal(time.monotonic())
        if time.monotonic() >= next_strike:
            nemesis.strike()
            next_strike = time.monotonic() + nemesis.random.uniform(1, 5)
        time.sleep(0.2)
    return accepted


def test_wire():
    """Broken by a message that is believed though it was spoiled, a worker that is taken for alive or
    for dead too long, or one that does not come back."""
    print(f"seed {SEED}, {SECONDS:g} s")
    with farm.Farm(1) as service, contextlib.ExitStack() as stack:
        wanted = {seed: service.render(subject(seed), 120) for seed in range(3)}
        namespaces = []
        for number in (1, 2):
            namespaces.append(Namespace(number, lambda: service.worker_port, SEED + number))
            stack.callback(namespaces[-1].close)
        remotes = [Remote(service), *(Remote(service, namespace) for namespace in namespaces)]
        for remote in remotes:
            stack.callback(remote.end)
        farm.wait_for(lambda: len(service.get("/v1/workers")["workers"]) == 4, 60, "four workers")
        nemesis = Nemesis(remotes, SEED)
        accepted = run(service, nemesis)
        nemesis.heal()
        for namespace in namespaces:
            namespace.proxy.heal()
        fired = nemesis.fired + namespaces[0].proxy.fired + namespaces[1].proxy.fired
        print(dict(fired), f"{len(accepted)} renders")
        for render, seed in accepted:
            service.wait(render, 120)
            assert service.image(render) == wanted[seed], f"render {render}, seed {seed}"
        assert set(fired) >= {*KINDS, "kill", "stop", "cut"} and len(accepted) >= 3
        farm.wait_for(lambda: len(service.get("/v1/workers")["workers"]) == 4, 60, "all workers again")
