# SPDX-License-Identifier: Apache-2.0
"""Meshes, materials, lights and pictures for the scenes of make.py, by Blender's own means.

Everything is Z-up, as in Blender; the exporter turns it. Materials are the Principled BSDF, wired
as the glTF exporter expects it, with an index of 1.5 and a specular of 0.5: both say that a
dielectric returns 4 % head-on, as glTF has it.
"""
import math

import bmesh
import bpy
import numpy as np
from mathutils import Matrix, Vector


def link(name, data):
    placed = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(placed)
    return placed


# Pictures: float[rows, columns, 4], the first row at the bottom, as Blender keeps them.


def picture(name, pixels, color_space):
    """A picture that is packed into the blend file, and so into the GLB, as a PNG of 8 bits."""
    rows, columns = pixels.shape[:2]
    made = bpy.data.images.new(name, columns, rows, alpha=True)
    made.colorspace_settings.name = color_space
    made.alpha_mode = "CHANNEL_PACKED"
    made.pixels.foreach_set(np.ascontiguousarray(pixels, dtype=np.float32).ravel())
    made.file_format = "PNG"
    made.pack()
    return made


def grid(side):
    """Coordinates of the pixels' middles in [0,1)."""
    line = (np.arange(side) + 0.5) / side
    return np.meshgrid(line, line)


def opaque(red, green, blue):
    return np.stack([red, green, blue, np.ones_like(red)], axis=2)


def waves(side, turns):
    """A smooth pattern in [0,1] that repeats."""
    u, v = grid(side)
    angle = 2 * math.pi * turns
    return 0.5 + 0.25 * np.sin(angle * u) + 0.25 * np.sin(angle * v)


def bumps(side, turns, depth):
    """A tangent space normal map of waves."""
    u, v = grid(side)
    angle = 2 * math.pi * turns
    slope_u, slope_v = depth * np.cos(angle * u), depth * np.cos(angle * v)
    length = np.sqrt(1 + slope_u ** 2 + slope_v ** 2)
    normal = np.stack([-slope_u, -slope_v, np.ones_like(u)], axis=2) / length[..., None]
    return opaque(*np.moveaxis(0.5 + 0.5 * normal, 2, 0))


def sky(path, rows=64):
    """Writes an environment of a soft sun over ground and sky; tells its picture."""
    columns = 2 * rows
    longitude = 2 * math.pi * (np.arange(columns) + 0.5) / columns
    latitude = math.pi * ((np.arange(rows) + 0.5) / rows - 0.5)
    across, up = np.meshgrid(longitude, latitude)
    direction = np.stack([np.cos(up) * np.cos(across), np.cos(up) * np.sin(across), np.sin(up)],
                         axis=2)
    sun = np.array([0.3, 0.6, 0.74]) / np.linalg.norm([0.3, 0.6, 0.74])
    glow = 40 * np.exp(60 * (direction @ sun - 1))
    above = np.clip(0.5 + 3 * np.sin(up), 0, 1)
    tint = [0.25, 0.4, 0.8]
    ground = [0.25, 0.2, 0.12]
    channels = [g * (1 - above) + t * above * (1 + 0.5 * np.cos(across)) + glow * s
                for g, t, s in zip(ground, tint, (1, 0.9, 0.7))]
    made = bpy.data.images.new("sky", columns, rows, float_buffer=True)
    made.pixels.foreach_set(opaque(*channels).astype(np.float32).ravel())
    made.file_format = "HDR"
    made.filepath_raw = str(path)
    made.save()
    bpy.data.images.remove(made)
    return bpy.data.images.load(str(path))


# Materials


def principled(name, color=(0.8, 0.8, 0.8), metallic=0.0, roughness=0.5, **inputs):
    """inputs: further sockets of the node, with _ for a space: clearcoat_roughness=0.1."""
    made = bpy.data.materials.new(name)
    made.use_nodes = True
    sockets = made.node_tree.nodes["Principled BSDF"].inputs
    sockets["Base Color"].default_value = (*color, 1)
    sockets["Metallic"].default_value = metallic
    sockets["Roughness"].default_value = roughness
    sockets["IOR"].default_value = 1.5
    sockets["Specular"].default_value = 0.5
    for key, value in inputs.items():
        socket = sockets[key.replace("_", " ").title()]
        socket.default_value = (*value, 1) if isinstance(value, tuple) else value
    return made


def glowing(name, color, strength, **inputs):
    """A black surface that emits."""
    return principled(name, (0, 0, 0), roughness=1.0, emission=color, emission_strength=strength,
                      **inputs)


def image_node(material, image, scale=1.0):
    """An image texture, repeated scale times each way."""
    tree = material.node_tree
    node = tree.nodes.new("ShaderNodeTexImage")
    node.image = image
    if scale != 1:
        mapping = tree.nodes.new("ShaderNodeMapping")
        mapping.inputs["Scale"].default_value = (scale, scale, 1)
        uv = tree.nodes.new("ShaderNodeUVMap")
        tree.links.new(uv.outputs[0], mapping.inputs["Vector"])
        tree.links.new(mapping.outputs[0], node.inputs["Vector"])
    return node


def socket(material, name):
    return material.node_tree.nodes["Principled BSDF"].inputs[name]


def textured(material, name, image, scale=1.0, alpha=False):
    """Puts a picture into an input of the material, and its alpha into Alpha."""
    node = image_node(material, image, scale)
    material.node_tree.links.new(node.outputs["Color"], socket(material, name))
    if alpha:
        material.node_tree.links.new(node.outputs["Alpha"], socket(material, "Alpha"))
    return material


def metallic_roughness(material, image, scale=1.0):
    """glTF's one picture for both: roughness in green, metallic in blue."""
    tree = material.node_tree
    node = image_node(material, image, scale)
    parts = tree.nodes.new("ShaderNodeSeparateColor")
    tree.links.new(node.outputs["Color"], parts.inputs[0])
    tree.links.new(parts.outputs["Green"], socket(material, "Roughness"))
    tree.links.new(parts.outputs["Blue"], socket(material, "Metallic"))
    return material


def normal_mapped(material, image, strength=1.0, scale=1.0, name="Normal"):
    tree = material.node_tree
    node = image_node(material, image, scale)
    bend = tree.nodes.new("ShaderNodeNormalMap")
    bend.inputs["Strength"].default_value = strength
    tree.links.new(node.outputs["Color"], bend.inputs["Color"])
    tree.links.new(bend.outputs["Normal"], socket(material, name))
    return material


def vertex_coloured(material, layer):
    tree = material.node_tree
    node = tree.nodes.new("ShaderNodeVertexColor")
    node.layer_name = layer
    tree.links.new(node.outputs["Color"], socket(material, "Base Color"))
    return material


# Meshes


def finish(name, shape, material, at, smooth):
    mesh = bpy.data.meshes.new(name)
    shape.to_mesh(mesh)
    shape.free()
    mesh.polygons.foreach_set("use_smooth", [smooth] * len(mesh.polygons))
    if material:
        mesh.materials.append(material)
    placed = link(name, mesh)
    placed.location = at
    return placed


def with_uvs():
    shape = bmesh.new()
    shape.loops.layers.uv.new("UVMap")
    return shape


def plane(name, material, half=5.0, at=(0, 0, 0)):
    """A square that faces +Z; its uvs go from 0 to 1."""
    shape = with_uvs()
    bmesh.ops.create_grid(shape, x_segments=1, y_segments=1, size=half, calc_uvs=True)
    return finish(name, shape, material, at, False)


def wall(name, material, width, height, at):
    """A rectangle that faces -Y, at its middle."""
    shape = with_uvs()
    bmesh.ops.create_grid(shape, x_segments=1, y_segments=1, size=0.5, calc_uvs=True)
    turn = Matrix.Rotation(math.pi / 2, 4, "X") @ Matrix.Diagonal((width, height, 1, 1))
    bmesh.ops.transform(shape, matrix=turn, verts=shape.verts)
    return finish(name, shape, material, at, False)


def sphere(name, material, radius=1.0, at=(0, 0, 0), segments=48):
    shape = with_uvs()
    bmesh.ops.create_uvsphere(shape, u_segments=segments, v_segments=segments // 2, radius=radius,
                              calc_uvs=True)
    return finish(name, shape, material, at, True)


def cube(name, material, half=1.0, at=(0, 0, 0)):
    shape = with_uvs()
    bmesh.ops.create_cube(shape, size=2 * half, calc_uvs=True)
    return finish(name, shape, material, at, False)


def monkey(name, material, at=(0, 0, 0)):
    shape = with_uvs()
    bmesh.ops.create_monkey(shape)
    return finish(name, shape, material, at, True)


def column(name, material, radius, height, rings, sides=24):
    """A tube along Z that stands on the origin and has its vertices in rings."""
    shape = with_uvs()
    turns = [2 * math.pi * k / sides for k in range(sides)]
    levels = [[shape.verts.new((radius * math.cos(a), radius * math.sin(a), height * r / rings))
               for a in turns] for r in range(rings + 1)]
    for low, high in zip(levels, levels[1:]):
        for k in range(sides):
            after = (k + 1) % sides
            shape.faces.new((low[k], low[after], high[after], high[k]))
    shape.faces.new(levels[-1])
    return finish(name, shape, material, (0, 0, 0), True)


# Lights and cameras


def lamp(name, kind, power, at=(0, 0, 5), toward=(0, 0, 0), color=(1, 1, 1)):
    """A light without size, as KHR_lights_punctual knows it: POINT, SPOT or SUN."""
    made = bpy.data.lights.new(name, kind)
    made.energy, made.color = power, color
    if kind == "SUN":
        made.angle = 0
    else:
        made.shadow_soft_size = 0
    placed = link(name, made)
    aim(placed, at, toward)
    return placed


def aim(placed, at, toward):
    """Looks along its -Z, with +Z of the world upwards."""
    placed.location = at
    gaze = Vector(toward) - Vector(at)
    placed.rotation_euler = gaze.to_track_quat("-Z", "Y").to_euler()


def camera(at, toward, degrees=40.0):
    """Tells the camera; degrees are its horizontal field of view."""
    made = bpy.data.cameras.new("camera")
    made.sensor_fit = "HORIZONTAL"
    made.angle = math.radians(degrees)
    made.clip_start, made.clip_end = 0.01, 1000
    placed = link("camera", made)
    aim(placed, at, toward)
    bpy.context.scene.camera = placed
    return placed


def key(placed, path, values):
    """values: {frame: value}, straight in between and held outside."""
    for frame, value in values.items():
        setattr(placed, path, value)
        placed.keyframe_insert(path, frame=frame)
    for curve in placed.id_data.animation_data.action.fcurves:
        curve.extrapolation = "CONSTANT"
        for point in curve.keyframe_points:
            point.interpolation = "LINEAR"
