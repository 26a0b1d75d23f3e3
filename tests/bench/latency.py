#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""How long a client waits for small things, over one connection that stays open.

    latency.py [--runs 30] [--scene FILE]

new scene: from the POST of a 64x64 scene of 4 samples that nobody has seen to its PNG.
new view: from the POST of another camera of a kept scene, as a preview that replaces the one before,
to its whole 640x360 image of 1 sample as JPEG. The two alternate; a GET of /livez between them shows
what the machine does meanwhile. Exits with 1 when a median is over what is promised.
"""
import argparse
import hashlib
import http.client
import json
import math
import pathlib
import sys
import time

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "support"))
import farm  # noqa: E402
import scene  # noqa: E402
from figures import Page  # noqa: E402

KEPT = HERE.parent / "reference/scenes/five_balls.json"
PROMISED_MS = {"new scene": 15, "new view": 40}
JSON = {"Content-Type": "application/json", "Prefer": "wait=30"}


class Client:
    def __init__(self, port):
        self.connection = http.client.HTTPConnection("127.0.0.1", port)

    def ask(self, method, path, body=None, headers=None):
        self.connection.request(method, path, body, headers or {})
        answer = self.connection.getresponse()
        return answer.status, answer.read()

    def image(self, envelope, extension):
        """The id and the image of a new render."""
        status, body = self.ask("POST", "/v1/renders", json.dumps(envelope), JSON)
        assert status == 200, body
        render = json.loads(body)["id"]
        status, body = self.ask("GET", f"/v1/renders/{render}/image.{extension}")
        assert status == 200, body
        return render, body


def timed(call, *arguments):
    start = time.perf_counter()
    result = call(*arguments)
    return 1000 * (time.perf_counter() - start), result


def tiny(number):
    return scene.build(64, 64, 4, [scene.sphere([0, 0, -0.001 * number])], background=0.5,
                       lights=[scene.panel([-1, 3, 1], [2, 0, 0], [0, 0, -2], 5)])


def view(name, number, replaces):
    """The kept scene from a point of a circle about it."""
    angle = 0.05 * number
    options = {"preview": True, **({"replaces": replaces} if replaces else {})}
    return {"scene": name, "options": options,
            "override": {"image": {"width": 640, "height": 360},
                         "sampling": {"mode": "uniform", "samples": 1},
                         "camera": {"position": [9 * math.sin(angle), 3, 9 * math.cos(angle)],
                                    "look_at": [0, 1, 0]}}}


def measure(service, kept, runs):
    client = Client(service.http_port)
    text = kept.read_bytes()
    name = hashlib.sha256(text).hexdigest()
    status, body = client.ask("PUT", f"/v1/scenes/sha256/{name}", text)
    assert status in (200, 201), body
    found = {"new scene": [], "new view": [], "livez": []}
    shown = None
    for number in range(-3, runs):
        scene_ms, _ = timed(client.image, tiny(number), "png")
        time.sleep(0.3)  # the spare scene process is made anew
        view_ms, (shown, _) = timed(client.image, view(f"sha256:{name}", number, shown), "jpg")
        time.sleep(0.05)
        livez_ms, _ = timed(client.ask, "GET", "/livez")
        if number >= 0:
            for what, ms in zip(found, (scene_ms, view_ms, livez_ms)):
                found[what].append(ms)
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=30)
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--scene", type=pathlib.Path, default=KEPT, help="of the views")
    options = parser.parse_args()
    with farm.Farm(options.processes) as service:
        found = measure(service, options.scene, options.runs)
    page = Page()
    for what, times in found.items():
        page.line(f"{what}, ms", times, most=PROMISED_MS.get(what))
    return int(not page.holds)


if __name__ == "__main__":
    sys.exit(main())
