# SPDX-License-Identifier: Apache-2.0
"""A scene of two million triangles under a rectangle light: hills with eight bumpy balls on them.

As a scene file with a glTF asset, and for Cycles as arrays in a file. The glTF's materials have an
index of refraction of 1, which reflects nothing: they are matte.
"""
import hashlib
import pathlib
import sys

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
import glb  # noqa: E402

HILLS_SIDE, BALL_RINGS, BALLS = 707, 250, 8
COLORS = [[0.5, 0.5, 0.5], [0.7, 0.1, 0.1], [0.1, 0.6, 0.1], [0.1, 0.2, 0.7]]


def height(x, z):
    bumps = sum(np.sin(f * (x * np.cos(a) + z * np.sin(a))) / f
                for a, f in ((0.3, 0.8), (1.7, 1.9), (2.9, 4.3), (4.1, 9.7), (5.2, 23.0)))
    return 0.3 * bumps


def grid(rows, columns, wraps):
    """Triangles of a grid of corners; it closes round the columns where it wraps."""
    r, c = np.meshgrid(np.arange(rows - 1), np.arange(columns if wraps else columns - 1),
                       indexing="ij")
    a, b = r * columns + c, r * columns + (c + 1) % columns
    quads = np.stack([a, a + columns, b + columns, a, b + columns, b], axis=-1)
    return quads.reshape(-1, 3).astype(np.uint32)


def hills(corners=HILLS_SIDE):
    side = np.linspace(-16, 16, corners)
    z, x = np.meshgrid(side, side, indexing="ij")
    points = np.stack([x, height(x, z), z], axis=-1).reshape(-1, 3)
    return points.astype(np.float32), grid(corners, corners, False)


def ball(number):
    """Turns its pole, where triangles have no area, to the side."""
    theta = np.linspace(0, np.pi, BALL_RINGS + 1)[:, None]
    phi = np.linspace(0, 2 * np.pi, BALL_RINGS, endpoint=False)[None, :]
    radius = 0.8 + 0.04 * np.sin(12 * theta + number) * np.sin(11 * phi)
    center = np.array([-5 + 3.2 * (number % 4), 1.2, 2.5 - 5.5 * (number // 4)])
    points = np.stack([radius * np.cos(theta) + 0 * phi, radius * np.sin(theta) * np.cos(phi),
                       radius * np.sin(theta) * np.sin(phi)], axis=-1).reshape(-1, 3) + center
    return points.astype(np.float32), grid(BALL_RINGS + 1, BALL_RINGS, True)[:, ::-1]


def hills_of(triangles):
    """A mesh of about so many triangles, as one of the parts."""
    return (*hills(round((triangles / 2) ** 0.5) + 1), COLORS[0])


def parts():
    """(points, triangles, colour) of each mesh."""
    made = [(*hills(), COLORS[0])]
    return made + [(*ball(i), COLORS[1 + i % 3]) for i in range(BALLS)]


def asset(meshes):
    """The bytes of a GLB."""
    made = glb.Asset()
    made.use("KHR_materials_ior")
    for points, triangles, color in meshes:
        material = made.add("materials", {
            "pbrMetallicRoughness": {"baseColorFactor": [*color, 1], "metallicFactor": 0},
            "extensions": {"KHR_materials_ior": {"ior": 1}}, "doubleSided": True})
        positions = made.accessor(points, min=points.min(axis=0).tolist(),
                                  max=points.max(axis=0).tolist())
        indices = made.accessor(triangles.reshape(-1, 1), "uint32")
        made.node(mesh=made.mesh(positions, indices, material))
    return made.bytes()


def scene(objects, materials, width=480, height=270):
    return {
        "version": 1, "image": {"width": width, "height": height,
                                "filter": {"type": "box", "width": 1}},
        "camera": {"position": [0, 4, 10], "look_at": [0, 0.3, -1], "up": [0, 1, 0],
                   "horizontal_fov": 50},
        "integrator": {"type": "distribution", "max_depth": 4},
        "sampling": {"mode": "uniform", "samples": 64},
        "background": {"color": [0, 0, 0]}, "materials": materials, "objects": objects,
        "lights": [{"type": "rectangle", "corner": [-6, 9, 0], "edge_u": [4, 0, 0],
                    "edge_v": [0, 0, 4], "radiance": [23, 23, 23]}]}


def for_penumbra(meshes):
    """The scene file as a tree, the asset's name and its bytes."""
    data = asset(meshes)
    name = hashlib.sha256(data).hexdigest()
    return scene([{"type": "gltf", "asset": f"sha256:{name}"}], {}), name, data


def for_cycles(meshes, directory):
    """The scene file as a tree, with its arrays beside it."""
    objects, materials = [], {}
    for number, (points, triangles, color) in enumerate(meshes):
        path = directory / f"mesh{number}.npz"
        np.savez(path, points=points, triangles=triangles)
        objects.append({"type": "arrays", "path": str(path), "material": str(number)})
        materials[str(number)] = {"type": "matte", "color": color}
    return scene(objects, materials)
