#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""What a frame of an animation costs beside its tiles: 240 frames of 320x180 on 2 processes.

    animation.py [FRAMES [RUNS]]

That is (wall time x processes - time of the render processes) / frames. Exits with 1 when its median
is over what is promised.
"""
import pathlib
import re
import sys

HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent / "support")]  # a test has this file in another way
import farm  # noqa: E402
from figures import Page  # noqa: E402

PROCESSES = 2
PROMISED_MS = 15


def body(frames, side=40):
    """A ground of side x side x 2 triangles at rest, bars and a ball that move."""
    vertices = [[12 * x / side - 6, 0.05 * ((x * 7 + z * 13) % 5), 12 * z / side - 6]
                for z in range(side + 1) for x in range(side + 1)]
    indices = []
    for z in range(side):
        for x in range(side):
            a = z * (side + 1) + x
            indices += [a, a + side + 1, a + 1, a + 1, a + side + 1, a + side + 2]
    ground = {"type": "mesh", "material": "red", "vertices": vertices, "indices": indices}
    bars = [{"type": "mesh", "material": "red", "indices": [0, 1, 2, 0, 1, 3, 1, 2, 3, 2, 0, 3],
             "vertices": [[-1, 0.5, 0], [1, 0.5, 0], [0, 2, 0], [0, 1, 1]],
             "keyframes": [{"time": 0, "translate": [i - 4, 0, -i], "rotate": [0, 0, 0, 1]},
                           {"time": 10, "translate": [i - 2, 0, -i],
                            "rotate": [0, 0.6, 0, 0.8]}]} for i in range(8)]
    return {"version": 1, "image": {"width": 320, "height": 180}, "sampling": {"samples": 16},
            "camera": {"position": [0, 3, 8], "look_at": [0, 1, 0],
                       "shutter": {"open": 0, "close": 0.02}},
            "background": {"color": [0.5, 0.6, 0.7]},
            "materials": {"red": {"type": "matte", "color": [0.8, 0.3, 0.2]}},
            "objects": [ground, *bars], "frames": {"first": 1, "last": frames, "fps": 24}}


def render_seconds(service):
    text = service.request("GET", "/metrics").body.decode()
    return float(re.search(r"^penumbra_render_seconds_total (\S+)", text, re.M).group(1))


def overhead_ms(frames):
    """(overhead, wall time) of a frame, both in ms."""
    with farm.Farm(PROCESSES) as service:
        render = service.submit(body(frames))
        service.wait(render, 300)
        wall = service.resource(render)["seconds"]
        spent = render_seconds(service)
    return 1e3 * (wall * PROCESSES - spent) / frames, 1e3 * wall / frames


def main():
    frames, runs = [int(argument) for argument in sys.argv[1:]] + [240, 3][len(sys.argv) - 1:]
    found = [overhead_ms(frames) for _ in range(runs)]
    page = Page()
    page.line("a frame, ms", [frame for _, frame in found])
    page.line("overhead a frame, ms", [overhead for overhead, _ in found], most=PROMISED_MS)
    return int(not page.holds)


if __name__ == "__main__":
    sys.exit(main())
