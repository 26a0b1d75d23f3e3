# SPDX-License-Identifier: Apache-2.0
"""The course paper on distribution ray tracing: supersampling at edges, and what effects cost."""
import rig

PAPER = "the course paper"
SIDES = [2, 3, 4, 6, 8]
COSTS = [2, 4, 8]
LENS = [4, 16, 64]


def plain(**more):
    """Five balls without lens, shutter and area light: all that is left to smooth are edges."""
    found = rig.scene("five_balls", image={"width": 480, "height": 270})
    for each in found["objects"]:
        each.pop("keyframes", None)
    found["objects"][3]["center"] = [0.6, 1, -8]
    found["camera"].update(aperture_radius=0)
    found["camera"].pop("shutter")
    for name in ("satin", "clear"):
        found["materials"][name] = {"type": "matte", "color": [0.6, 0.6, 0.6]}
    found["lights"] = [{"type": "point", "position": [-4, 9, 2], "intensity": [370, 370, 370]}]
    return rig.changed(found, **more)


def visible(pixels, reference):
    """Root mean square difference of what a screen shows."""
    return rig.rmse(rig.encoded(pixels), rig.encoded(reference))


def supersampling(given):
    # What one ray through a pixel sees has no noise.
    def sharp(**sampling):
        return plain(integrator={"type": "whitted"}, sampling=sampling)

    truth = given.render(sharp(samples=1024)).pixels
    scenes = {}
    for side in SIDES:
        same = {"samples": side ** 2, "sequence": "jittered"}
        scenes["uniform", side] = sharp(**same)
        scenes["edge", side] = sharp(**same, mode="edge")
    seconds = given.in_turn(scenes)
    found = {key: given.render(wanted) for key, wanted in scenes.items()}
    errors = {key: visible(render.pixels, truth) for key, render in found.items()}
    uniform = [("uniform", side) for side in SIDES]
    rows, ratios = [], []
    for side in SIDES:
        edge = ("edge", side)
        equal = rig.at_error(errors[edge], [errors[key] for key in uniform],
                             [seconds[key].median for key in uniform])
        ratios.append(equal / seconds[edge].median)
        rows.append([f"{side}×{side}", errors["uniform", side], seconds["uniform", side],
                     errors[edge], seconds[edge], found[edge].samples,
                     ratios[-1]])
    crop = (slice(120, 200), slice(80, 200))
    panels = [found[key].pixels[crop] for key in (("uniform", 2), ("edge", 4), ("uniform", 4))]
    mask = given.counts(scenes["edge", 4])[crop]
    shown = rig.picture("course", [*panels, mask], 4, 2, "2×2 everywhere, 4×4 at edges, 4×4 "
                        "everywhere, the pixels that count as edges")
    head = ["n×n", "error, uniform", "seconds, uniform", "error, edge", "seconds, edge",
            "samples, edge", "ratio"]
    return rig.table(head, rows), shown, ratios


def growth(given, scenes):
    """The exponent of the cost in the keys, and the costs."""
    seconds = given.in_turn(scenes)
    costs = [seconds[key].median for key in scenes]
    return rig.exponent(list(scenes), costs), costs


def section(given):
    table, shown, ratios = supersampling(given)
    sharp, thin = {"aperture_radius": 0}, {"aperture_radius": 0.25, "focus_distance": 15}
    size = {"width": 640, "height": 400}

    def scenes(counts, samples, camera):
        return {n: plain(image=size, camera=camera, sampling={"samples": samples(n),
                                                              "sequence": "jittered"})
                for n in counts}

    cases = [("antialiasing, n×n samples a pixel", "2", COSTS, lambda n: n * n, sharp),
             ("lens, n samples a pixel", "1", LENS, lambda n: n, thin),
             ("both together, n×n samples a pixel", "2", COSTS, lambda n: n * n, thin)]
    rows = []
    for name, claim, counts, samples, camera in cases:
        power, costs = growth(given, scenes(counts, samples, camera))
        rows.append([name, claim, power, ", ".join(map(rig.cell, counts)),
                     ", ".join(map(rig.cell, costs))])
    text = f"""The course paper: samples at edges, and what the effects cost

Supersampling where neighbouring pixels differ against n×n everywhere, on balls with hard shadows
and without other effects, traced as Whitted did, 480×270. The error is the root mean square difference of sRGB-encoded
values from 1024 samples; the ratio is the time that uniform sampling takes to reach the error of
the edge's, over the edge's time. The paper reports a ratio of 7.

{table}

{shown}

With r the time of one ray through every pixel, the paper has antialiasing cost O(r n²), n samples
of the lens O(r n), and both together no more than the antialiasing, as they share their samples.
The exponents of n that fit best, 640×400:

{rig.table(['effect', 'claimed', 'measured', 'n', 'seconds'], rows)}"""
    claims = [["time of n×n everywhere over supersampling at edges, equal visible error", "7",
               f"{min(ratios):.2g} to {max(ratios):.2g}, n {SIDES[0]} to {SIDES[-1]}"]]
    claims += [[f"exponent of n in the cost: {row[0]}", *row[1:3]] for row in rows]
    return text, claims
