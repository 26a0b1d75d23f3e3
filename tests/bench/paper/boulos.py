# SPDX-License-Identifier: Apache-2.0
"""Boulos and others 2007: packets of rays for Whitted's and for distribution ray tracing."""
import subprocess

import farm
import rig

PAPER = "Boulos and others 2007"
SCENES = ["five_balls", "gloss", "glass"]


def rates():
    """{(kind, rays): (Spread of single, Spread of packet)} in millions of rays a second."""
    program = farm.BIN.parent / "tests/packets"
    found = {}
    for line in subprocess.run([program], capture_output=True, text=True,
                               check=True).stdout.splitlines():
        kind, rays, _, single, packet = line.split()
        found.setdefault((kind, rays), []).append((float(single), float(packet)))
    return {key: [rig.spread(column) for column in zip(*runs)] for key, runs in found.items()}


def section(given):
    load = rig.load()
    rays = [[kind, name, single, packet, packet.median / single.median]
            for (kind, name), (single, packet) in rates().items()]
    rows = []
    for name in SCENES:
        base = rig.scene(name, sampling={"samples": 32})
        seconds = given.in_turn({kind: rig.changed(base, integrator={"type": kind})
                                 for kind in ("whitted", "distribution")})
        rows.append([name, seconds["whitted"], seconds["distribution"],
                     seconds["distribution"].median / seconds["whitted"].median])
    text = f"""Boulos and others 2007: packets for Whitted's and for distribution ray tracing

The paper: packets make distribution ray tracing about as fast a ray as Whitted's. First the rays
alone, by `tests/bench/packets.c`: the same 262,144 camera rays, and the shadow and reflected rays
from what they hit, through Embree singly and in packets of sixteen, on 400 spheres of triangles.
Whitted's packets are 4×4 pixels, one light point, mirrors; those of distribution ray tracing are
sixteen samples of one pixel, over a lens, an area light and wide lobes. Millions of rays a second
of processor time, on a machine with {load}:

{rig.table(['', 'rays', 'singly', 'in packets', 'ratio'], rays)}

Then the renderer, 32 samples a pixel of three reference scenes with both integrators, seconds
(distribution has lens, shutter, area lights and lobes where the scene has them; where a path splits,
whitted follows both branches, distribution one):

{rig.table(['scene', 'whitted', 'distribution', 'ratio'], rows)}"""
    gains = {kind: [row[4] for row in rays if row[0] == kind]
             for kind in ("whitted", "distribution")}
    return text, [["rays a second in packets over singly: camera, shadow, reflected",
                   "as well for distribution as for Whitted's",
                   "; ".join(f"{kind} {', '.join(f'{gain:.2f}' for gain in found)}"
                             for kind, found in gains.items())]]
