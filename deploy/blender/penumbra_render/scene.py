# SPDX-License-Identifier: Apache-2.0
"""What of a Blender scene glTF has no words for, as a Penumbra scene around the GLB.

Blender has Z up, glTF and Penumbra have Y up: (x, y, z) becomes (x, z, -y).
"""
import math
import pathlib

FALLBACK_GREY = (0.050876, 0.050876, 0.050876)  # of a world without nodes


def size_of(render):
    share = render.resolution_percentage / 100
    return max(1, int(render.resolution_x * share)), max(1, int(render.resolution_y * share))


def crop_of(render):
    """(left, top, right, bottom), or None for the whole image. Blender counts from below."""
    if not render.use_border:
        return None
    width, height = size_of(render)
    left, right = int(render.border_min_x * width), int(render.border_max_x * width)
    bottom, top = int(render.border_min_y * height), int(render.border_max_y * height)
    return [left, height - top, right, height - bottom]


def scene_of(scene, depsgraph, directory):
    """The scene file's content. Files that it names are put into directory, but for model.glb."""
    camera = scene.camera.evaluated_get(depsgraph)
    width, height = size_of(scene.render)
    made = {
        "version": 1,
        "image": {"width": width, "height": height},
        "camera": {"from": camera.data.name, **lens_of(camera), **shutter_of(scene)},
        "integrator": {"type": "path", "max_depth": scene.penumbra.max_depth},
        "sampling": {"samples": scene.penumbra.samples, "mode": scene.penumbra.mode,
                     "seed": scene.penumbra.seed},
        "background": background_of(scene.world, directory),
        "objects": [{"type": "gltf", "asset": "model.glb"}],
    }
    if crop := crop_of(scene.render):
        made["image"]["crop"] = crop
    if lights := area_lights(depsgraph):
        made["lights"] = lights
    return made


def lens_of(camera):
    """Radius and focus of the lens; nothing for a pinhole."""
    depth = camera.data.dof
    if not depth.use_dof or depth.aperture_fstop <= 0:
        return {}
    focal = camera.data.lens / 1000 if camera.data.type == "PERSP" else 1
    found = {"aperture_radius": focal / (2 * depth.aperture_fstop),
             "focus_distance": max(focus_distance(camera), 1e-5)}
    if depth.aperture_blades >= 3:
        found["blades"] = depth.aperture_blades
        found["blade_rotation"] = math.degrees(depth.aperture_rotation)
    return found


def focus_distance(camera):
    """Of the plane in focus, along the line of sight."""
    depth = camera.data.dof
    if depth.focus_object is None:
        return depth.focus_distance
    place = camera.matrix_world.translation
    sight = camera.matrix_world.to_3x3().col[2].normalized()
    return abs((depth.focus_object.matrix_world.translation - place).dot(sight))


def shutter_of(scene):
    """The exporter puts frame n at n / fps seconds."""
    fps = scene.render.fps
    now = scene.frame_current + scene.frame_subframe
    length = scene.render.motion_blur_shutter if scene.render.use_motion_blur else 0
    position = getattr(getattr(scene, "cycles", None), "motion_blur_position", "CENTER")
    opens = now - length * {"START": 0, "CENTER": 0.5, "END": 1}[position]
    return {"shutter": {"open": opens / fps, "close": (opens + length) / fps}}


def linked(socket, kinds):
    """The node that feeds a socket, if it is of one of the kinds."""
    node = socket.links[0].from_node if socket.is_linked else None
    return node if node and node.type in kinds else None


def background_of(world, directory):
    """A colour, or the picture of an environment texture, turned as a mapping node says."""
    if world is None:
        return {"color": [0, 0, 0]}
    if not world.use_nodes:
        return {"color": list(world.color)}
    output = world.node_tree.get_output_node("ALL")
    node = linked(output.inputs["Surface"], {"BACKGROUND"}) if output else None
    if node is None:
        return {"color": [0, 0, 0]}
    strength = node.inputs["Strength"].default_value
    texture = linked(node.inputs["Color"], {"TEX_ENVIRONMENT"})
    if texture is None or texture.image is None:
        color = node.inputs["Color"].default_value
        return {"color": [strength * c for c in color[:3]]}
    found = {"image": picture_of(texture.image, directory), "intensity": strength}
    mapping = linked(texture.inputs["Vector"], {"MAPPING"})
    if mapping:
        found["rotation"] = math.degrees(-mapping.inputs["Rotation"].default_value[2])
    return found


def picture_of(image, directory):
    """The name of a copy of the image's file in directory."""
    import bpy
    source = pathlib.Path(bpy.path.abspath(image.filepath, library=image.library))
    name = "world" + (source.suffix.lower() or ".hdr")
    data = image.packed_file.data if image.packed_file else source.read_bytes()
    (directory / name).write_bytes(data)
    return name


def y_up(vector):
    return [vector[0], vector[2], -vector[1]]


def area_lights(depsgraph):
    """glTF has none. What the graph tells of an instance holds until it tells of the next one."""
    return [area_light(found.object.data, found.matrix_world) for found in depsgraph.object_instances
            if found.object.type == "LIGHT" and found.object.data.type == "AREA"]


def area_light(data, matrix):
    """Blender's watts are spread over four times the area, not pi times."""
    width = data.size
    height = data.size_y if data.shape in ("RECTANGLE", "ELLIPSE") else data.size
    u, v, normal = (matrix.to_3x3().col[i] for i in range(3))
    place = matrix.translation
    round_share = math.pi / 4 if data.shape in ("DISK", "ELLIPSE") else 1
    area = (u * width).cross(v * height).length * round_share
    radiance = [data.energy * c / (4 * area) for c in data.color]
    # It shines along its -Z.
    if data.shape == "DISK":
        return {"type": "disk", "center": y_up(place), "normal": y_up(-normal.normalized()),
                "radius": width * u.length / 2, "radiance": radiance}
    edge_u, edge_v = v * height, u * width
    if data.shape == "ELLIPSE":  # a rectangle of the same area stands in
        edge_u, edge_v = edge_u * math.sqrt(math.pi) / 2, edge_v * math.sqrt(math.pi) / 2
    return {"type": "rectangle", "corner": y_up(place - edge_u / 2 - edge_v / 2),
            "edge_u": y_up(edge_u), "edge_v": y_up(edge_v), "radiance": radiance, "visible": False}
