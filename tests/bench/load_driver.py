# SPDX-License-Identifier: Apache-2.0
"""The coordinator under load, in four parts; see the bounds below.

    load.sh [--part peer|crowd|posts|refusals] [--seconds 60] [--rounds 5]

peer      its answers a second beside nginx's, which serves the same bytes: a core each for server
          and client, turns in alternation, medians
crowd     1,000 clients that poll a render once a second and 200 that watch its events while two
          processes render it: the coordinator's processor time, and when the polls are answered
posts     200 new renders a second for so many seconds, at --max-waiting 20000: when each is
          accepted, and how long it takes until all are done
refusals  the same at --max-waiting 100 without a worker: each is 202 or 429

Prints what it found and fails when a render is lost or failed; a bound that is missed is marked.
"""
import argparse
import asyncio
import contextlib
import pathlib
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
import farm  # noqa: E402
import load_crowd  # noqa: E402
import load_peer  # noqa: E402
import scene  # noqa: E402

POLLERS, WATCHERS, POSTS = 1000, 200, 200
RATIO_MIN = 1.0
COORDINATOR_SHARE_MAX = 0.05 # of two cores
POLL_P99_MS_MAX, ACCEPTED_P99_MS_MAX = 20, 50
END_S_MAX = 600


def say(what, figures, good=True):
    print(f"{what:<9} {figures}{'' if good else '   <- MISSED'}", flush=True)


def quantile(values, share):
    return sorted(values)[min(len(values) - 1, int(share * len(values)))]


def milliseconds(latencies):
    """(the median, the 99th percentile)"""
    return 1e3 * quantile(latencies, 0.5), 1e3 * quantile(latencies, 0.99)


def peer(options):
    for what, ours, theirs in load_peer.compare(options.rounds, 3):
        say("peer", f"{what}: {ours:.0f}/s, nginx {theirs:.0f}/s: {ours / theirs:.2f} times",
            ours >= RATIO_MIN * theirs)


def long_render():
    """More than any machine renders while this runs."""
    return scene.build(640, 480, 20000, [scene.floor(), scene.sphere([0, 1, 0])],
                       camera=scene.look([0, 2, 6], [0, 1, 0]), background=0.5)


class Measured(contextlib.AbstractContextManager):
    """The processor's and the clock's seconds of a process between in and out."""

    def __init__(self, pid):
        self.pid = pid

    def __enter__(self):
        self.begin, self.used = time.monotonic(), farm.processor_seconds([self.pid])

    def __exit__(self, *_):
        self.seconds = time.monotonic() - self.begin
        self.used = farm.processor_seconds([self.pid]) - self.used


def crowd(options):
    with farm.Farm(2) as service:
        render = service.submit(long_render())
        service.wait_progress(render)
        measured = Measured(service.server.pid)
        latencies, lines = asyncio.run(load_crowd.look_on(
            service.http_port, render, POLLERS, WATCHERS, options.seconds, measured))
        assert service.patch(render, {"state": "cancelled"}).status == 200
    share = measured.used / (2 * measured.seconds)
    median, p99 = milliseconds(latencies)
    say("crowd", f"{len(latencies)} polls: p50 {median:.1f} ms, p99 {p99:.1f} ms",
        p99 <= POLL_P99_MS_MAX)
    say("crowd", f"coordinator: {share:.1%} of two cores; events: {min(lines)} to {max(lines)} lines"
        f" to each of {len(lines)} watchers", share <= COORDINATOR_SHARE_MAX and min(lines) > 0)


def listed(service, state, limit, cursor=None):
    """A page of the renders in that state, and what leads to the next one, or None."""
    page = service.get(f"/v1/renders?state={state}&limit={limit}{f'&cursor={cursor}' if cursor else ''}")
    return [render["id"] for render in page["renders"]], page["next"]


def all_listed(service, state):
    found, cursor = listed(service, state, 500)
    while cursor:
        more, cursor = listed(service, state, 500, cursor)
        found += more
    return set(found)


def posts(options):
    with farm.Farm(2, "--max-waiting", 20000) as service:
        begin = time.monotonic()
        answers = asyncio.run(load_crowd.send(service.http_port, POSTS, options.seconds))
        accepted = [seconds for status, seconds, _ in answers if status == 202]
        assert len(accepted) == len(answers), "a render was refused"
        median, p99 = milliseconds(accepted)
        say("posts", f"{len(accepted)} accepted at {POSTS}/s: p50 {median:.1f} ms, p99 {p99:.1f} ms",
            p99 <= ACCEPTED_P99_MS_MAX)
        farm.wait_for(lambda: not any(listed(service, state, 1)[0] for state in ("running", "queued")),
                      END_S_MAX, "end of the renders")
        seconds = time.monotonic() - begin
        done = all_listed(service, "done")
        lost = {render for _, _, render in answers} - done
        assert not lost, f"{len(lost)} renders are not done"
    say("posts", f"all done {seconds:.1f} s after the first: {len(answers) / seconds:.0f}/s")


def refusals(options):
    with farm.Farm(0, "--max-waiting", 100) as service:
        answers = asyncio.run(load_crowd.send(service.http_port, POSTS, min(options.seconds, 5)))
    statuses = [status for status, _, _ in answers]
    _, p99 = milliseconds([seconds for _, seconds, _ in answers])
    say("refusals", f"{statuses.count(202)} times 202, {statuses.count(429)} times 429, p99 {p99:.1f} ms",
        statuses.count(202) == 100)
    assert set(statuses) <= {202, 429}, set(statuses)


PARTS = {"peer": peer, "crowd": crowd, "posts": posts, "refusals": refusals}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--part", choices=PARTS)
    parser.add_argument("--seconds", type=int, default=60)
    parser.add_argument("--rounds", type=int, default=5)
    options = parser.parse_args()
    for name in [options.part] if options.part else PARTS:
        PARTS[name](options)


if __name__ == "__main__":
    main()
