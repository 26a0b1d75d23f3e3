# SPDX-License-Identifier: Apache-2.0
"""What a frame of an animation costs beside its tiles: 240 frames of 320x180 on 2 processes.

    PYTHONPATH=tests/support python3 tests/bench/animation.py [FRAMES]

Prints (wall time x processes - time of the render processes) / frames.
"""
import re
import sys

import farm

PROCESSES = 2


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


if __name__ == "__main__":
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 240
    overhead, frame = overhead_ms(count)
    print(f"{count} frames: {frame:.1f} ms each, {overhead:.1f} ms of overhead a frame")
