# SPDX-License-Identifier: Apache-2.0
"""Cook, Porter, Carpenter 1984: all effects in one scene, each by itself, and what they cost.

The paper: once a pixel takes several rays, spreading them over lens, shutter, lights and lobes
gives the effects "with no additional rays beyond those needed for spatial antialiasing".
"""
import copy

import rig

PAPER = "Cook, Porter, Carpenter 1984"
SIZE = {"width": 240, "height": 150, "filter": {"type": "box", "width": 1}}
SAMPLES = 256

# Each effect as what it changes of the plain scene.
EFFECTS = ["soft shadows", "depth of field", "motion blur", "gloss", "translucency"]


def everything():
    return {
        "version": 1, "image": SIZE,
        "camera": {"position": [0, 2.2, 8], "look_at": [0, 0.9, 0], "horizontal_fov": 40,
                   "aperture_radius": 0.12, "focus_distance": 7.4,
                   "shutter": {"open": 0, "close": 1}},
        "integrator": {"type": "distribution", "max_depth": 6},
        "sampling": {"samples": SAMPLES},
        "background": {"color": [0.25, 0.3, 0.4]},
        "materials": {
            "floor": {"type": "matte", "color": [0.5, 0.5, 0.5]},
            "red": {"type": "matte", "color": [0.7, 0.1, 0.1]},
            "blue": {"type": "matte", "color": [0.1, 0.2, 0.7]},
            "gloss": {"type": "glossy", "color": [0.8, 0.75, 0.6], "roughness": 0.35},
            "frosted": {"type": "glass", "color": [0.95, 1, 0.95], "ior": 1.5, "roughness": 0.35}},
        "objects": [
            {"type": "mesh", "material": "floor", "indices": [0, 1, 2, 0, 2, 3],
             "vertices": [[-60, 0, 60], [60, 0, 60], [60, 0, -60], [-60, 0, -60]]},
            {"type": "sphere", "material": "gloss", "center": [-2, 1, 0], "radius": 1},
            {"type": "sphere", "material": "frosted", "center": [0.2, 0.8, 0.8], "radius": 0.8},
            {"type": "sphere", "material": "blue", "center": [2.6, 1, -6], "radius": 1},
            {"type": "sphere", "material": "red", "center": [0, 0, 0], "radius": 0.6, "keyframes": [
                {"time": 0, "translate": [1.4, 0.6, 0]},
                {"time": 1, "translate": [2.6, 1.1, 0.4]}]}],
        "lights": [{"type": "rectangle", "corner": [-3, 6, 2], "edge_u": [2, 0, 0],
                    "edge_v": [0, 0, 2], "radiance": [30, 30, 30]}],
    }


def with_effects(kept):
    """The scene with some of its effects; the others are made sharp, the light's power stays."""
    found = copy.deepcopy(everything())
    if "soft shadows" not in kept:
        light = found["lights"][0]
        light.update(corner=[-2.02, 6, 2.98], edge_u=[0.04, 0, 0], edge_v=[0, 0, 0.04],
                     radiance=[30 * 2500] * 3)
    if "depth of field" not in kept:
        found["camera"]["aperture_radius"] = 0
    if "motion blur" not in kept:
        del found["camera"]["shutter"]
    if "gloss" not in kept:
        found["materials"]["gloss"]["roughness"] = 0
    if "translucency" not in kept:
        found["materials"]["frosted"]["roughness"] = 0
    return found


def section(given):
    scenes = {"none": with_effects([]), **{e: with_effects([e]) for e in EFFECTS},
              "all": with_effects(EFFECTS)}
    seconds = given.in_turn(scenes)
    panels = [given.render(found).pixels for found in scenes.values()]
    shown = rig.picture("cook", panels, 4, caption="No effect, each alone, all of them")
    rows = [[name, found, found.median / seconds["none"].median]
            for name, found in seconds.items()]
    text = f"""Cook, Porter, Carpenter 1984: every effect from the same rays

The claim: once a pixel takes many rays, soft shadows, depth of field, motion blur, gloss and
translucency need no more of them. One scene, {SIZE['width']}×{SIZE['height']}, {SAMPLES} samples a
pixel in each picture: without effects but antialiasing; each of them alone, in the table's order;
all.

{shown}

{rig.table(['effects', 'seconds', 'of none'], rows)}

The number of rays is the same throughout; what is left of the ratios is rays that go different
ways: less coherent packets, moving bodies, and rough lobes in place of mirrors."""
    ratio = seconds["all"].median / seconds["none"].median
    return text, [["time with every effect over time without, at equal samples", "about 1", ratio]]
