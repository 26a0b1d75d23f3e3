# SPDX-License-Identifier: Apache-2.0
"""Each allocation, and each write, sync and change of a name, of the coordinator's main paths fails
once: it does not crash, hang or lie, says what is wrong, and goes on.

A path is walked once to count its calls, and then as often again with one of them failing: some,
by a stride whose start PEN_TORTURE_SEED moves, or with PEN_TORTURE_WHOLE all, and then it goes on
until nothing fails any more. What became of each is printed.
"""
import collections
import contextlib
import http.client
import json
import os
import signal
import time

import farm
import pytest
import scene
import torture

SEED = int(os.environ.get("PEN_TORTURE_SEED", 1))
WHOLE = "PEN_TORTURE_WHOLE" in os.environ
ROUNDS = 5 # of a path and kind, when not all
NEVER = 1 << 60
LIVES = "lives"
DEATHS = (ConnectionError, http.client.HTTPException, OSError)


def subject(seed):
    """Two tiles, two rounds."""
    return scene.build(32, 16, 20, [scene.sphere()], background=0.5, seed=seed)


def is_of_library(service, code):
    """Whether it died inside a library by a lack of memory that this did not look at: libuv aborts
    when its table of watchers cannot grow, and jansson 2.14 reads past a text that could not."""
    place = service.place()
    return (len(place) > 2 and (
        (code == -signal.SIGABRT and place[2][0].startswith("libuv")) or
        (code in (-signal.SIGABRT, -signal.SIGSEGV) and place[2][0].startswith("libjansson"))))


def is_misread(service):
    """Whether jansson 2.14 lacked memory for a string's text, of which it then loses a byte."""
    place = service.place()
    return len(place) > 2 and place[2][0].startswith("libjansson")


class Path:
    """What is done in a round. accepted: renders that must be there whatever fails."""

    def __init__(self, service):
        self.service, self.accepted = service, []

    def prepare(self):
        """What the round is about, undisturbed."""

    def walk(self, given):
        """The answer, or None when there was none."""
        raise NotImplementedError

    def post(self):
        found = self.service.post(subject(len(self.accepted)))
        if found.status == 202:
            self.accepted.append(json.loads(found.body)["id"])
        return found

    def render(self):
        """One that is done."""
        self.post()
        self.service.wait(self.accepted[-1])
        return self.accepted[-1]


class Submit(Path):
    def walk(self, given):
        return self.post()


class Render(Path):
    """From leases to the image: commits, merges, flushes, publication."""

    def prepare(self):
        self.service.disarm()
        assert self.post().status == 202
        return self.accepted[-1]

    def walk(self, given):
        def over():
            found = self.service.request("GET", f"/v1/renders/{given}")
            if found.status != 200:
                return found
            state = json.loads(found.body)["state"]
            return found if state in (*farm.FINAL, "paused") else None
        return farm.wait_for(over, 30, "end of the render")


class Poll(Path):
    """Resource, list, page, metrics and workers."""

    def prepare(self):
        return self.accepted[0] if self.accepted else self.render()

    def walk(self, given):
        answers = [self.service.request("GET", path) for path in (
            f"/v1/renders/{given}", "/v1/renders?limit=5", "/v1/workers", "/metrics", "/")]
        return max(answers, key=lambda answer: answer.status)


class Image(Path):
    def prepare(self):
        return self.render()

    def walk(self, given):
        answers = [self.service.request("GET", f"/v1/renders/{given}/image.{extension}")
                   for extension in ("png", "exr")]
        return max(answers, key=lambda answer: answer.status)


class Missing(Path):
    """Which assets of a list are there: none."""

    def walk(self, given):
        names = [f"sha256:{number:064x}" for number in range(8)]
        found = self.service.request("POST", "/v1/assets/missing", json.dumps({"assets": names}),
                                     {"Content-Type": "application/json"})
        assert found.status != 200 or json.loads(found.body) == {"missing": names}
        return found


class Remove(Path):
    def prepare(self):
        render = self.render()
        self.accepted.remove(render)
        return render

    def walk(self, given):
        return self.service.request("DELETE", f"/v1/renders/{given}")


class Change(Path):
    """Paused, resumed and cancelled."""

    def prepare(self):
        return self.service.submit(scene.build(512, 512, 60000, [scene.sphere()], background=0.5))

    def walk(self, given):
        answers = [self.service.patch(given, change) for change in
                   ({"state": "paused"}, {"state": "running"}, {"state": "cancelled"})]
        self.service.disarm()
        self.service.patch(given, {"state": "cancelled"})
        return max(answers, key=lambda answer: answer.status)


PATHS = {kind.__name__.lower(): kind for kind in (
    Submit, Render, Poll, Image, Missing, Remove, Change)}


def numbers(calls):
    """Which calls fail, in turn."""
    if WHOLE:
        return range(1, 4 * calls + 100)
    stride = max(1, calls // ROUNDS)
    return range(1 + SEED % stride, calls + 1, stride)


class Walker:
    """Walks a path with one call failing, and looks at what that leaves."""

    def __init__(self, service, path, kind):
        self.service, self.path, self.kind = service, path, kind
        self.fates = collections.Counter()

    def walk(self, at):
        given = self.prepare()
        self.service.arm(self.kind, at)
        answer = None
        try:
            answer = self.path.walk(given)
        except DEATHS:
            pass
        finally:
            calls, fired = self.service.count(), self.service.fired()
            self.service.disarm()
        # What failed in the round before may end it only now.
        if not fired and (answer is not None or self.kind != "io"):
            assert answer is not None and answer.status < 300, answer
        return answer, calls, fired

    def prepare(self):
        """Once more when it was about to end."""
        try:
            return self.path.prepare()
        except (AssertionError, *DEATHS):
            farm.wait_for(lambda: self.service.server.poll() is not None, 10, "the end")
            self.look_after()
            return self.path.prepare()

    def count(self):
        return self.walk(NEVER)[1]

    def one(self, at):
        answer, _, fired = self.walk(at)
        if not fired:
            self.look_after()
            return False
        if answer is not None and answer.status >= 300:
            assert answer.status >= 500 or is_misread(self.service), answer
            self.fates["refused"] += 1
            if answer.body:
                assert json.loads(answer.body)["detail"], answer
        else:
            self.fates["dropped" if answer is None else "answered"] += 1
        self.look_after()
        return True

    def look_after(self):
        """It is there, or has ended as it should, and is started again."""
        code = farm.wait_for(self.code, 20, "an answer or an end")
        if code == LIVES:
            return
        # What the disk says it has may not be there: it stops rather than go on.
        assert (self.kind == "io" and code == 1) or is_of_library(self.service, code), (
            f"it ended with {code}")
        self.fates["stopped" if self.kind == "io" else "killed by a library"] += 1
        self.service.restart()

    def code(self):
        """LIVES, the exit code, or None as long as neither is known."""
        code = self.service.server.poll()
        if code is not None:
            return code or "0"
        with contextlib.suppress(*DEATHS):
            return LIVES if self.service.request("GET", "/readyz", timeout=5).status == 200 else None
        return None

    def look(self, wanted):
        """All that was accepted comes to its end, with every bit."""
        for number, render in enumerate(self.path.accepted):
            found = self.service.resource(render)
            assert found["state"] != "paused" or found["error"], found
            # For room they wait no longer than it lacks; a disk that fails somebody must look at.
            if found["state"] == "paused" and self.kind == "io":
                assert self.service.patch(render, {"state": "running"}).status == 200
                self.fates["resumed"] += 1
            self.service.wait(render)
            if number in wanted:
                assert self.service.image(render) == wanted[number], f"render {render}"


def start(service, kind, at):
    """Whether it runs, the number of its calls until then, and whether one failed."""
    service.arm(kind, at)
    try:
        service.start()
        runs = True
    except AssertionError:
        runs, code = False, service.server.poll()
        assert code == 1 or is_of_library(service, code), f"it ended with {code}, or hangs"
        assert code < 0 or "penumbra: " in service.log.read_text().splitlines()[-1]
        service.server = None
    calls, fired = service.count(), service.fired()
    service.disarm()
    return runs, calls, fired


def stop(service, kind):
    """When a file of its has failed it need not end well."""
    try:
        service.stop()
    except (AssertionError, ProcessLookupError):
        assert kind != "memory" and service.server.poll() == 1
        service.server = None


class Service(torture.Tortured):
    def restart(self):
        farm.wait_for(lambda: not any(map(farm.alive, self.family)), 30, "end of its processes")
        self.start()

    def start(self):
        super().start()
        self.family = farm.descendants(self.server.pid)


@pytest.fixture(scope="module")
def wanted():
    """The images of the first subjects, undisturbed."""
    with farm.Farm(1, "--tile", 16) as service:
        return {seed: service.render(subject(seed)) for seed in range(8)}


def tell(name, kind, calls, fates, begin):
    print(f"{name} {kind}: {calls} calls, {sum(fates.values())} rounds, {dict(fates)}, "
          f"{time.monotonic() - begin:.0f} s", flush=True)


def fail_in_turn(name, kind, service, calls, one):
    """one(at) says whether anything failed."""
    for at in numbers(calls):
        try:
            if not one(at) and at > calls:
                return
        except BaseException:
            print(f"{name} {kind} {at} of {calls}", service.place(), flush=True)
            raise


@pytest.mark.parametrize("name", sorted(PATHS))
def test_calls_fail(name, wanted):
    """Broken by: a failure that is not looked at, that ends the coordinator, or that is answered
    as if it were none; a render that is lost by it; a bit that differs."""
    with Service(1, "--tile", 16) as service:
        path = PATHS[name](service)
        for kind in torture.KINDS:
            begin, walker = time.monotonic(), Walker(service, path, kind)
            walker.count() # caches are filled
            calls = walker.count()
            fail_in_turn(name, kind, service, calls, walker.one)
            walker.look(wanted)
            tell(name, kind, calls, walker.fates, begin)
        service.stop()
        service.start()
        walker.look(wanted)


class Starts:
    """Starts on one directory after the other, or again and again on the same."""

    def __init__(self, service, kind, directory, renders):
        self.service, self.kind, self.directory, self.renders = service, kind, directory, renders
        self.fates, self.rounds = collections.Counter(), 0

    def one(self, at):
        """The number of calls until it was ready, and whether one failed."""
        self.rounds += 1
        if not self.renders:
            self.service.data = self.directory / str(self.rounds)
            self.service.data.mkdir(parents=True)
        runs, calls, fired = start(self.service, self.kind, at)
        try:
            for render in self.renders if runs else []:
                assert self.service.request("GET", f"/v1/renders/{render}").status == 200
        except DEATHS:
            # It has said where it listens, but cannot be sure that this is on the disk.
            assert self.kind == "io" and self.service.server.wait(timeout=10) == 1
        self.fates["runs" if runs else "ends"] += fired
        if runs:
            stop(self.service, self.kind)
        return calls, fired


@pytest.mark.parametrize("name", ["restart", "start"])
def test_starts_fail(name, wanted, tmp_path):
    """Broken by: a start that crashes or hangs, says nothing, goes on without what it needs, or
    spoils what was there."""
    renders = []
    with Service(1, "--tile", 16, data=tmp_path / "0") as service:
        if name == "restart":
            renders = [service.submit(subject(seed)) for seed in range(3)]
            service.wait(renders[0])
        service.stop()
        for kind in torture.KINDS:
            begin, starts = time.monotonic(), Starts(service, kind, tmp_path / kind, renders)
            calls, _ = starts.one(NEVER)
            fail_in_turn(name, kind, service, calls, lambda at, s=starts: s.one(at)[1])
            tell(name, kind, calls, starts.fates, begin)
        service.start()
        for seed, render in enumerate(renders):
            service.wait(render)
            assert service.image(render) == wanted[seed]
        service.wait(service.submit(subject(0)))
