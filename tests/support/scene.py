# SPDX-License-Identifier: Apache-2.0
"""Scenes of a few parts, as dictionaries ready to be posted."""


def build(width, height, samples, objects, *, camera=None, lights=(), materials=None,
          background=0.0, integrator="distribution", depth=6, sequence="sobol", seed=0):
    """A scene with a box filter of one pixel, so that a pixel is the mean over its own square."""
    return {
        "version": 1,
        "image": {"width": width, "height": height, "filter": {"type": "box", "width": 1}},
        "camera": camera or look([0, 0, 5], [0, 0, 0]),
        "integrator": {"type": integrator, "max_depth": depth},
        "sampling": {"mode": "uniform", "samples": samples, "sequence": sequence, "seed": seed},
        "background": {"color": [background] * 3},
        "materials": materials or {"white": matte(1.0)},
        "objects": list(objects),
        "lights": list(lights),
    }


def look(position, target, fov=40.0, up=(0, 1, 0), **more):
    return {"position": list(position), "look_at": list(target), "up": list(up),
            "horizontal_fov": fov, **more}


def matte(grey):
    return {"type": "matte", "color": [grey] * 3}


def glossy(roughness, grey=1.0):
    return {"type": "glossy", "color": [grey] * 3, "roughness": roughness}


def glass(roughness, ior=1.5, grey=1.0):
    return {"type": "glass", "color": [grey] * 3, "roughness": roughness, "ior": ior}


def sphere(center=(0, 0, 0), radius=1.0, material="white", **more):
    return {"type": "sphere", "material": material, "center": list(center), "radius": radius,
            **more}


def motion(first, last):
    """Keyframes of a second: two poses, or two positions."""
    poses = [p if isinstance(p, dict) else {"translate": p} for p in (first, last)]
    return [{"time": time, **pose} for time, pose in enumerate(poses)]


def panel(corner, edge_u, edge_v, radiance):
    """A rectangular light that shines towards edge_u x edge_v."""
    return {"type": "rectangle", "corner": corner, "edge_u": edge_u, "edge_v": edge_v,
            "radiance": [radiance] * 3}


def floor(half=10.0, y=0.0, material="white", **more):
    """A square in the plane y, whose normal is +Y."""
    return {"type": "mesh", "material": material, "indices": [0, 1, 2, 0, 2, 3],
            "vertices": [[-half, y, half], [half, y, half], [half, y, -half], [-half, y, -half]],
            **more}


def box(half=1.0, material="white", **more):
    """A cube about the origin, its normals outwards."""
    corners = [[x * half, y * half, z * half] for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)]
    quads = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    indices = [corner for a, b, c, d in quads for corner in (a, b, c, a, c, d)]
    return {"type": "mesh", "material": material, "vertices": corners, "indices": indices, **more}
