# SPDX-License-Identifier: Apache-2.0
"""A server under load: 200 keep-alive pollers and 20 new renders a second beside a long render.

    load.sh [--seconds 30] [--pollers 200] [--posts 20]

The pollers are wrk, each asking for the long render's resource again as soon as it is answered; the
new renders are small and distinct. Prints requests per second and their latencies, and the long
render's speed alone and under the load. Fails when a render is lost or failed, or a poll erred.
"""
import argparse
import concurrent.futures
import json
import pathlib
import re
import statistics
import subprocess
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
import farm  # noqa: E402
import scene  # noqa: E402

QUIET_S = 8


def long_render():
    """More than any machine renders while this runs."""
    return scene.build(640, 480, 20000, [scene.floor(), scene.sphere([0, 1, 0])],
                       camera=scene.look([0, 2, 6], [0, 1, 0]), background=0.5)


def small_render(number):
    return scene.build(32, 32, 4, [scene.sphere()], background=0.5, seed=number)


def rate_over(service, render, during):
    """What during() returns, and the render's samples per second meanwhile."""
    begin, before = time.monotonic(), service.resource(render)["samples_done"]
    result = during()
    after = service.resource(render)["samples_done"]
    return result, (after - before) / (time.monotonic() - begin)


def start_wrk(service, render, options):
    return subprocess.Popen(
        ["wrk", "-t1", f"-c{options.pollers}", f"-d{options.seconds}s", "--latency",
         f"http://127.0.0.1:{service.http_port}/v1/renders/{render}"],
        stdout=subprocess.PIPE, text=True)


def post_timed(service, number):
    """The id of a small render, and the seconds until it was accepted."""
    begin = time.monotonic()
    return service.submit(small_render(number)), time.monotonic() - begin


def post_evenly(service, options):
    """Posts at a steady pace, without waiting for the answers."""
    with concurrent.futures.ThreadPoolExecutor(32) as pool:
        begin, answers = time.monotonic(), []
        for number in range(options.seconds * options.posts):
            time.sleep(max(begin + number / options.posts - time.monotonic(), 0))
            answers.append(pool.submit(post_timed, service, number))
        return [answer.result() for answer in answers]


def load(service, render, options):
    wrk = start_wrk(service, render, options)
    accepted = post_evenly(service, options)
    report, _ = wrk.communicate(timeout=30)
    return accepted, report


def outcome(service, accepted):
    """How many of the accepted renders are in which state once no more are waiting."""
    def states():
        found = [service.request("GET", f"/v1/renders/{render}") for render, _ in accepted]
        names = [json.loads(f.body)["state"] if f.status == 200 else "lost" for f in found]
        return names if not {"queued", "running"} & set(names) else None

    names = farm.wait_for(states, 120, "end of the small renders")
    return {name: names.count(name) for name in set(names)}


def figure(report, pattern):
    found = re.search(pattern, report)
    return found.group(1) if found else None


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=int, default=30)
    parser.add_argument("--pollers", type=int, default=200)
    parser.add_argument("--posts", type=int, default=20)
    options = parser.parse_args()
    with farm.Farm(2) as service:
        render = service.submit(long_render())
        service.wait_progress(render)
        _, alone = rate_over(service, render, lambda: time.sleep(QUIET_S))
        (accepted, report), loaded = rate_over(service, render,
                                               lambda: load(service, render, options))
        assert service.patch(render, {"state": "cancelled"}).status == 200
        states = outcome(service, accepted)
    posts = sorted(seconds for _, seconds in accepted)
    errors = re.findall(r"(?:Socket errors|Non-2xx).*", report)
    print(f"polls     {figure(report, r'Requests/sec: *([0-9.]+)')}/s,"
          f" p50 {figure(report, r'50% +(.+)')}, p99 {figure(report, r'99% +(.+)')}")
    print(f"posts     {len(posts)} accepted, p50 {1000 * statistics.median(posts):.1f} ms,"
          f" p99 {1000 * posts[int(0.99 * len(posts))]:.1f} ms; then {states}")
    print(f"long one  {alone / 1e6:.2f} M samples/s alone, {loaded / 1e6:.2f} under load"
          f" ({loaded / alone:.0%})")
    if errors or states != {"done": len(accepted)}:
        sys.exit(f"failed: {errors or 'renders lost or failed'}")


if __name__ == "__main__":
    main()
