#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""What a thousand emissive triangles cost beside one rectangle light, for the same noise.

    many_lights.py [--runs 3] [--samples 64] [--triangles 1000]

Scenes under the same power: a rectangle light; the same rectangle as an emissive mesh of so many
triangles, which the renderer finds to be one; that mesh a little bent, so that one of its triangles
must be chosen; and as many triangles strewn over the whole ceiling. Once over a floor and two balls, of
which a sample costs next to nothing but its light, once over the two million triangles of
tests/bench/mesh_scene.py. The cost of an image is the processor time of rendering it times its
variance (the mean square of the difference of two renders with different seeds, halved, of values
compressed by v / (1 + v)). Exits with 1 when the triangles of the rectangle cost more than twice
what the rectangle light costs.
"""
import argparse
import json
import math
import pathlib
import resource
import statistics
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "support"))
import mesh_scene  # noqa: E402
import numpy as np  # noqa: E402
from farm import BIN  # noqa: E402
from sampling_error import compress  # noqa: E402

PROGRAM = BIN.parent / "tests/render-core"
SIDE, HEIGHT, RADIANCE, BEND = 4.0, 7.0, 20.0, 0.4
BALLS_FACTOR = 8  # samples over those of the mesh, so that they take as long
GLOW = {"type": "principled", "base_color": [0, 0, 0]}


def scene(objects, lights, glow):
    return {
        "version": 1, "image": {"width": 240, "height": 135},
        "camera": {"position": [0, 3.5, 9], "look_at": [0, 0.8, 0], "horizontal_fov": 45},
        "integrator": {"type": "distribution", "max_depth": 4},
        "sampling": {"mode": "uniform", "samples": 64}, "background": {"color": [0, 0, 0]},
        "materials": {
            "floor": {"type": "matte", "color": [0.6, 0.6, 0.6]},
            "red": {"type": "matte", "color": [0.7, 0.15, 0.1]},
            "satin": {"type": "glossy", "color": [0.8, 0.8, 0.8], "roughness": 0.4},
            "glow": {**GLOW, "emission": [glow] * 3}},
        "objects": [
            {"type": "mesh", "material": "floor", "indices": [0, 1, 2, 0, 2, 3],
             "vertices": [[-30, 0, 30], [30, 0, 30], [30, 0, -30], [-30, 0, -30]]},
            {"type": "sphere", "material": "red", "center": [-1.6, 1, 0], "radius": 1},
            {"type": "sphere", "material": "satin", "center": [1.6, 1, 0], "radius": 1}, *objects],
        "lights": lights}


def one_rectangle():
    half = SIDE / 2
    return scene([], [{"type": "rectangle", "corner": [-half, HEIGHT, -half],
                       "edge_u": [SIDE, 0, 0], "edge_v": [0, 0, SIDE],
                       "radiance": [RADIANCE] * 3}], 0)


def mesh_of(triangles):
    points = [list(map(float, p)) for t in triangles for p in t]
    return {"type": "mesh", "material": "glow", "vertices": points,
            "indices": list(range(len(points)))}


def tiles(count, corner, bend=0.0):
    """A square from its least corner in an even number of triangles, its middle so much lower."""
    columns = round(math.sqrt(count / 2))
    while count % (2 * columns):
        columns -= 1
    rows = count // (2 * columns)
    xs = corner[0] + np.linspace(0, SIDE, columns + 1)
    zs = corner[2] + np.linspace(0, SIDE, rows + 1)
    ys = corner[1] - bend * np.outer(np.sin(np.linspace(0, np.pi, columns + 1)),
                                     np.sin(np.linspace(0, np.pi, rows + 1)))
    triangles = []
    for i in range(columns):
        for k in range(rows):
            a, b, c, d = ((xs[m], ys[m, n], zs[n]) for m, n in
                          ((i, k), (i + 1, k), (i + 1, k + 1), (i, k + 1)))
            triangles += [(a, b, c), (a, c, d)]
    return mesh_of(triangles)


def tiled(count, bend=0.0):
    return scene([tiles(count, [-SIDE / 2, HEIGHT, -SIDE / 2], bend)], [], RADIANCE)


def over_mesh(count, directory):
    """The scene of two million triangles, under its rectangle, and that in triangles and bent."""
    doc, digest, data = mesh_scene.for_penumbra(mesh_scene.parts())
    (directory / digest).write_bytes(data)
    doc["image"] = {**doc["image"], "width": 240, "height": 135}
    light = doc["lights"][0]
    return doc, *({**doc, "lights": [],
                   "objects": [*doc["objects"], tiles(count, light["corner"], bend)],
                   "materials": {"glow": {**GLOW, "emission": light["radiance"]}}}
                  for bend in (0.0, BEND))


def strewn(count):
    """As much area, in equal triangles over a ceiling nine times as large."""
    random = np.random.default_rng(1)
    edge = math.sqrt(2 * SIDE * SIDE / count)
    corners = random.uniform(-1.5 * SIDE, 1.5 * SIDE, (count, 2))
    triangles = [((x, HEIGHT, z), (x + edge, HEIGHT, z), (x + edge, HEIGHT, z + edge))
                 for x, z in corners]
    return scene([mesh_of(triangles)], [], RADIANCE)


def render(doc, samples, seed, directory):
    """The pixels and the processor seconds of the whole program."""
    doc = {**doc, "sampling": {"mode": "uniform", "samples": samples, "seed": seed}}
    path, out = directory / "scene.json", directory / "out.f32"
    path.write_text(json.dumps(doc))
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([PROGRAM, path, out, "--assets", directory], check=True, timeout=600)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    head, _, floats = out.read_bytes().partition(b"\n")
    x0, y0, x1, y1 = map(int, head.split())
    film = np.frombuffer(floats, np.float32).reshape(y1 - y0, x1 - x0, -1)
    pixels = film[:, :, :3] / film[:, :, 3:4]
    return pixels, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def measure(doc, samples, runs, directory):
    """Of each run the time of rendering and the variance; and the mean of the image."""
    seconds, variances = [], []
    for run in range(runs):
        first, spent = render(doc, samples, 2 * run, directory)
        second, _ = render(doc, samples, 2 * run + 1, directory)
        _, least = render(doc, 1, 0, directory)
        seconds.append((spent - least) * samples / (samples - 1))
        variances.append(((compress(first) - compress(second)) ** 2).mean() / 2)
    return seconds, variances, first.mean()


def compare(docs, samples, runs, directory):
    """Prints a line for each scene; tells the second one's cost over the first's."""
    ratios, costs = [], None
    for name, doc in docs.items():
        seconds, variances, mean = measure(doc, samples, runs, directory)
        own = [s * v for s, v in zip(seconds, variances)]
        costs = costs or own
        found = sorted(o / c for o, c in zip(own, costs))
        ratios.append(statistics.median(found))
        print(f"{name:38}{statistics.median(seconds):8.3f} s{statistics.median(variances):12.3e}"
              f"{mean:8.4f}{ratios[-1]:8.2f} ({found[0]:.2f}-{found[-1]:.2f})", flush=True)
    return ratios[1]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--samples", type=int, default=64)
    parser.add_argument("--triangles", type=int, default=1000)
    options = parser.parse_args()
    count = options.triangles
    print(f"{options.samples} samples, {BALLS_FACTOR} times as many of the balls, {options.runs} runs;"
          " processor seconds, variance, mean; cost over that of the rectangle light (least-greatest)")
    with tempfile.TemporaryDirectory() as temporary:
        directory = pathlib.Path(temporary)
        mesh = dict(zip(("mesh, one rectangle light", f"mesh, it in {count} triangles",
                         f"mesh, {count} triangles, bent"), over_mesh(count, directory)))
        balls = {"balls, one rectangle light": one_rectangle(),
                 f"balls, it in {count} triangles": tiled(count),
                 f"balls, {count} triangles, bent": tiled(count, BEND),
                 f"balls, {count} triangles strewn": strewn(count)}
        found = [compare(mesh, options.samples, options.runs, directory),
                 compare(balls, BALLS_FACTOR * options.samples, options.runs, directory)]
    print(f"promised for the rectangle in triangles: <= 2; found {found[0]:.2f} and {found[1]:.2f}")
    return int(max(found) > 2)


if __name__ == "__main__":
    sys.exit(main())
