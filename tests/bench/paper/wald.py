# SPDX-License-Identifier: Apache-2.0
"""Wald and others 2001: interactive ray tracing; how soon a changed view is seen as a whole."""
import math
import time

import rig

PAPER = "Wald and others 2001"
VIEWS = 12
SCENES = ["five_balls", "soft_shadow"]
SIZE = {"width": 640, "height": 360}


def first_image(service, wanted):
    """Seconds from the POST until every pixel has a sample, and until its PNG is here."""
    start = time.monotonic()
    render = service.submit(wanted)
    pixels = SIZE["width"] * SIZE["height"]
    while service.resource(render)["samples_done"] < pixels:
        time.sleep(0.001)
    whole = time.monotonic() - start
    service.image(render, "png")
    shown = time.monotonic() - start
    service.patch(render, {"state": "cancelled"})
    service.wait(render, 10, "cancelled")
    return whole, shown


def views(name):
    """One scene, its camera a little further about its target in each."""
    base = rig.scene(name, image=SIZE, sampling={"samples": 1024})
    eye, target = base["camera"]["position"], base["camera"]["look_at"]
    for k in range(VIEWS):
        angle = 0.05 * k
        x, z = eye[0] - target[0], eye[2] - target[2]
        moved = [target[0] + math.cos(angle) * x + math.sin(angle) * z, eye[1],
                 target[2] - math.sin(angle) * x + math.cos(angle) * z]
        yield rig.changed(base, camera={"position": moved})


def section(given):
    rows, load = [], rig.load()
    for name in SCENES:
        times = [first_image(given.service, wanted) for wanted in views(name)]
        first, rest = times[0], times[1:]
        rows.append([name, 1000 * first[0],
                     *(rig.spread([1000 * each[k] for each in rest]) for k in (0, 1)),
                     1 / rig.spread([each[1] for each in rest]).median])
    head = ["scene", "first view, ms", "a changed view, ms", "with its PNG, ms", "views a second"]
    text = f"""Wald, Slusallek, Benthin, Wagner 2001: from a changed camera to a whole image

The paper renders interactively, by coherent packets on several machines. Here a client POSTs a
scene whose camera has moved, {VIEWS} times, at {SIZE['width']}×{SIZE['height']}, and measures by the
clock, over HTTP, until every pixel has its first sample, and until it has fetched the PNG of that.
Each view is a render of its own, with a scene of its own: validated, stored, built. The machine had
{load} meanwhile.

{rig.table(head, rows)}"""
    return text, [["images a second after a change of view", "interactive",
                   ", ".join(f"{row[0]} {row[-1]:.3g}" for row in rows)]]
