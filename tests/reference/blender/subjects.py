# SPDX-License-Identifier: Apache-2.0
"""The scenes of make.py. Each function fills an empty Blender scene.

What it returns goes into the scene file, since a GLB cannot carry it: "background", and of the
camera "aperture_radius", "focus_distance" and, in frames of Blender, "shutter". "noise" multiplies
the samples that Cycles takes for the reference; with "model": False there is no image of it in
models/, since gltf_nodes.py has no wiring for what is in it.
"""
import math
import random

import bpy
import numpy as np
import parts
from parts import glowing, lamp, principled

DIM = {"background": {"color": [0.12, 0.14, 0.18]}}
GREY = (0.5, 0.5, 0.5)


def checks(side, squares, dark, light):
    """Squares of two colours, with a softer pattern in each."""
    u, v = parts.grid(side)
    which = (np.floor(u * squares) + np.floor(v * squares)) % 2
    shade = 0.7 + 0.3 * parts.waves(side, squares)
    return parts.opaque(*[(d + (b - d) * which) * shade for d, b in zip(dark, light)])


def textures(_):
    """Base colour, roughness and metallic from pictures, one of them repeated by a transform."""
    tiles = parts.picture("tiles", checks(64, 8, (0.2, 0.25, 0.3), (0.8, 0.75, 0.6)), "sRGB")
    paint = parts.picture("paint", checks(64, 4, (0.7, 0.1, 0.1), (0.9, 0.8, 0.2)), "sRGB")
    u, _ = parts.grid(64)
    wear = parts.picture("wear", parts.opaque(
        np.zeros_like(u), 0.3 + 0.5 * parts.waves(64, 2), np.where(u < 0.5, 0.0, 1.0)), "Non-Color")
    floor = parts.textured(principled("floor", roughness=0.9), "Base Color", tiles, 2)
    ball = parts.metallic_roughness(
        parts.textured(principled("ball"), "Base Color", paint), wear)
    box = parts.textured(principled("box", roughness=0.7), "Base Color", paint)
    parts.plane("floor", floor)
    parts.sphere("ball", ball, 1, (-1.1, 0, 1))
    parts.cube("box", box, 0.8, (1.2, 0.3, 0.8)).rotation_euler = (0, 0, 0.5)
    lamp("sun", "SUN", 3, toward=(1, 2, -1))
    lamp("bulb", "POINT", 300, (-3, -3, 4), color=(1, 0.8, 0.6))
    parts.camera((0, -6, 3.2), (0, 0, 0.8))
    return DIM


def normal_map(_):
    """Waves on a floor, a metal sphere and a box, of different strengths."""
    bumps = parts.picture("bumps", parts.bumps(64, 4, 0.5), "Non-Color")
    floor = parts.normal_mapped(principled("floor", GREY, roughness=0.8), bumps, 0.6, 2)
    ball = parts.normal_mapped(principled("ball", (0.9, 0.6, 0.3), 1, 0.35), bumps, 1, 2)
    box = parts.normal_mapped(principled("box", (0.2, 0.5, 0.3), roughness=0.6), bumps)
    parts.plane("floor", floor)
    parts.sphere("ball", ball, 1, (-1.1, 0, 1))
    parts.cube("box", box, 0.8, (1.2, 0.3, 0.8)).rotation_euler = (0, 0, -0.4)
    lamp("sun", "SUN", 2.5, toward=(1, 1, -1))
    lamp("bulb", "POINT", 200, (3, -3, 3))
    parts.camera((0, -6, 3.2), (0, 0, 0.8))
    return {"background": {"color": [0.3, 0.33, 0.4]}}


def transmission(_):
    """Clear, rough and tinted solids before a coloured wall, under a panel."""
    clear = principled("clear", (1, 1, 1), roughness=0.0, transmission=1.0)
    frosted = principled("frosted", (1, 1, 1), roughness=0.4, transmission=1.0)
    tinted = principled("tinted", (0.5, 0.8, 0.6), roughness=0.15, transmission=1.0)
    stripes = parts.picture("stripes", checks(64, 8, (0.1, 0.1, 0.3), (0.9, 0.6, 0.3)), "sRGB")
    back = parts.textured(principled("back", roughness=1.0), "Base Color", stripes)
    parts.plane("floor", principled("floor", GREY, roughness=1.0))
    parts.wall("back", back, 10, 5, (0, 2.5, 2.5))
    parts.sphere("clear", clear, 0.9, (-1.9, 0, 0.9))
    parts.sphere("frosted", frosted, 0.9, (0, 0, 0.9))
    parts.cube("tinted", tinted, 0.75, (1.9, 0, 0.8)).rotation_euler = (0, 0, 0.4)
    parts.plane("panel", glowing("panel", (1, 0.95, 0.9), 8), 1.5, (0, -2, 5))
    parts.camera((0, -7, 2.5), (0, 0, 0.9), 50)
    return {"background": {"color": [0.4, 0.4, 0.4]}, "noise": 4}


def clearcoat(_):
    """Coats of two roughnesses over rough colours and over metal."""
    parts.plane("floor", principled("floor", GREY, roughness=0.9))
    coats = [principled("smooth", (0.6, 0.05, 0.05), roughness=0.6, clearcoat=1.0,
                        clearcoat_roughness=0.0),
             principled("rough", (0.05, 0.1, 0.5), roughness=0.8, clearcoat=1.0,
                        clearcoat_roughness=0.3),
             principled("metal", (0.9, 0.7, 0.4), 1.0, 0.5, clearcoat=0.5,
                        clearcoat_roughness=0.1)]
    for k, coat in enumerate(coats):
        parts.sphere(coat.name, coat, 0.9, (2.0 * k - 2, 0, 0.9))
    parts.plane("panel", glowing("panel", (1, 1, 1), 6), 1.2, (-1, -2, 4.5))
    parts.camera((0, -7, 2.8), (0, 0, 0.8), 50)
    return {"background": {"color": [0.35, 0.4, 0.5]}}


def leaves(side=64):
    """Ragged discs that are opaque, and nothing in between."""
    u, v = parts.grid(side)
    angle = np.arctan2(v % 0.5 - 0.25, u % 0.5 - 0.25)
    distance = np.hypot(u % 0.5 - 0.25, v % 0.5 - 0.25)
    inside = 0.17 + 0.04 * np.cos(5 * angle) - distance
    pixels = parts.opaque(0.2 + 0.4 * u, 0.6 - 0.2 * v, 0.15 + 0 * u)
    pixels[..., 3] = np.clip(0.5 + 16 * inside, 0, 1)
    return pixels


def alpha(_):
    """A screen of leaves by alpha mask, a half transparent pane by blend, and their shadows."""
    image = parts.picture("leaves", leaves(), "sRGB")
    screen = parts.textured(principled("screen", roughness=0.9), "Base Color", image, alpha=True)
    screen.blend_method, screen.alpha_threshold = "CLIP", 0.5
    tree = screen.node_tree
    cut = tree.nodes.new("ShaderNodeMath")
    cut.operation = "GREATER_THAN"
    cut.inputs[1].default_value = 0.5
    node = next(n for n in tree.nodes if n.type == "TEX_IMAGE")
    pane = principled("pane", (0.2, 0.4, 0.8), roughness=0.9, alpha=0.4)
    pane.blend_method = "BLEND"
    parts.plane("floor", principled("floor", GREY, roughness=0.9))
    parts.wall("screen", screen, 2.4, 2.4, (-1.3, 0, 1.2))
    parts.wall("pane", pane, 2, 2.2, (1.2, -0.5, 1.1))
    parts.sphere("ball", principled("ball", (0.8, 0.3, 0.2), roughness=0.8), 0.7, (1.0, 1.0, 0.7))
    lamp("sun", "SUN", 3, toward=(0.6, 1.5, -1.5))

    def before_render():  # what the exporter writes as alphaMode MASK, Cycles needs as nodes
        tree.links.new(node.outputs["Alpha"], cut.inputs[0])
        tree.links.new(cut.outputs[0], parts.socket(screen, "Alpha"))

    parts.camera((0, -6, 3), (0, 0, 0.9), 50)
    return {"background": {"color": [0.3, 0.35, 0.45]}, "before_render": before_render}


def environment(directory):
    """Everything lit by a picture of a sky with a sun in it."""
    parts.sky(directory / "sky.hdr")
    parts.plane("floor", principled("floor", (0.6, 0.55, 0.5), roughness=1.0))
    parts.sphere("mirror", principled("mirror", (0.95, 0.95, 0.95), 1, 0.0), 0.9, (-2, 0, 0.9))
    parts.sphere("satin", principled("satin", (0.9, 0.7, 0.4), 1, 0.4), 0.9, (0, 0, 0.9))
    parts.sphere("chalk", principled("chalk", (0.8, 0.8, 0.8), roughness=1.0), 0.9, (2, 0, 0.9))
    parts.camera((0, -7, 2.6), (0, 0, 1), 50)
    return {"background": {"image": "sky.hdr", "intensity": 0.8}}


def room(depth, height, sides):
    """Floor, ceiling, back and two side walls, open towards the camera."""
    white = principled("white", (0.75, 0.75, 0.75), roughness=1.0)
    red, green = (principled(n, c, roughness=1.0) for n, c in sides)
    parts.plane("floor", white, depth)
    parts.plane("ceiling", white, depth, (0, 0, height)).rotation_euler = (math.pi, 0, 0)
    parts.wall("back", white, 2 * depth, height, (0, depth, height / 2))
    left = parts.wall("left", red, 2 * depth, height, (-depth, 0, height / 2))
    right = parts.wall("right", green, 2 * depth, height, (depth, 0, height / 2))
    left.rotation_euler, right.rotation_euler = (0, 0, math.pi / 2), (0, 0, -math.pi / 2)


def emissive(_):
    """A room lit by a glowing body, a bright panel, and a screen whose emission is a picture."""
    room(2.5, 4, (("red", (0.6, 0.1, 0.1)), ("green", (0.1, 0.5, 0.1))))
    u, v = parts.grid(32)
    stripes = parts.picture("stripes", parts.opaque(
        0.2 + 0.8 * (np.sin(12 * u) > 0), 0.5 + 0.4 * np.sin(9 * v), 0.9 - 0.6 * u), "sRGB")
    screen = parts.textured(glowing("screen", (1, 1, 1), 3), "Emission", stripes)
    parts.wall("screen", screen, 1.6, 1.2, (-0.9, 2.45, 2.2))
    body = parts.monkey("body", glowing("body", (1, 0.6, 0.25), 2), (0.9, 0.4, 1.2))
    body.scale = (0.7, 0.7, 0.7)
    panel = parts.plane("panel", glowing("panel", (0.9, 0.95, 1), 6), 0.6, (0, 0, 3.95))
    panel.rotation_euler = (math.pi, 0, 0)
    parts.cube("box", principled("box", (0.7, 0.7, 0.7), roughness=1.0), 0.5, (-1, 0, 0.5))
    parts.camera((0, -6.5, 2), (0, 0, 1.9), 45)
    return {"background": {"color": [0, 0, 0]}, "noise": 4}


def rigid_motion(_):
    """A turning arm that carries a turning cube, a flying ball, and one that grows."""
    parts.plane("floor", principled("floor", GREY, roughness=0.9))
    arm = parts.cube("arm", principled("arm", (0.7, 0.2, 0.15), roughness=0.8), 1.0, (-1, 0, 1.3))
    arm.scale = (1, 0.2, 0.2)
    hand = parts.cube("hand", principled("hand", (0.2, 0.4, 0.7), roughness=0.8), 0.35)
    pivot = parts.link("pivot", None)
    pivot.location = (-1, 0, 1.3)
    arm.location = (0, 0, 0)
    arm.parent = hand.parent = pivot
    hand.location = (1.3, 0, 0)
    parts.key(pivot, "rotation_euler", {1: (0, 0, 0), 5: (0, math.radians(-160), 0)})
    parts.key(hand, "rotation_euler", {1: (0, 0, 0), 5: (math.radians(300), 0, 0)})
    ball = parts.sphere("ball", principled("ball", (0.8, 0.8, 0.2), roughness=0.8), 0.5)
    parts.key(ball, "location", {1: (0.8, -0.5, 0.5), 5: (3.6, 0.3, 2.4)})
    grows = parts.sphere("grows", principled("grows", (0.3, 0.7, 0.4), roughness=0.8), 1.0,
                         (1.2, 1.6, 0.7))
    parts.key(grows, "scale", {1: (0.4, 0.4, 0.4), 5: (1.2, 0.8, 1.2)})
    lamp("sun", "SUN", 3, toward=(1, 2, -2))
    parts.camera((0, -7, 2.8), (0.3, 0, 1.2))
    return {**DIM, "shutter": (2, 3)}


def skin(_):
    """A column bent by three bones, each turning, while the shutter is open."""
    parts.plane("floor", principled("floor", GREY, roughness=0.9))
    body = parts.column("body", principled("body", (0.3, 0.5, 0.75), roughness=0.8), 0.35, 3, 24)
    frame = bpy.data.armatures.new("frame")
    rig = parts.link("rig", frame)
    bpy.context.view_layer.objects.active = rig
    bpy.ops.object.mode_set(mode="EDIT")
    before = None
    for k in range(3):
        bone = frame.edit_bones.new(f"bone{k}")
        bone.head, bone.tail = (0, 0, k), (0, 0, k + 1)
        bone.parent, bone.use_connect = before, before is not None
        before = bone
    bpy.ops.object.mode_set(mode="OBJECT")
    for k in range(3):
        group = body.vertex_groups.new(name=f"bone{k}")
        for vertex in body.data.vertices:
            weight = max(0, 1 - abs(vertex.co.z - (k + 0.5)))
            if k in (0, 2) and abs(vertex.co.z - 1.5) > 1:
                weight = float((k == 2) == (vertex.co.z > 1.5))
            if weight > 0:
                group.add([vertex.index], weight, "REPLACE")
    body.parent = rig
    bend = body.modifiers.new("bend", "ARMATURE")
    bend.object = rig
    for k, turn in enumerate((20, -50, 80)):
        bone = rig.pose.bones[f"bone{k}"]
        bone.rotation_mode = "XYZ"
        parts.key(bone, "rotation_euler", {1: (0, 0, 0), 4: (0, 0, math.radians(turn))})
    lamp("sun", "SUN", 3, toward=(1, 2, -2))
    lamp("bulb", "POINT", 200, (-3, -3, 4))
    parts.camera((0, -8, 2.6), (0, 0, 1.5))
    return {**DIM, "shutter": (3, 4)}


def morph(_):
    """A ball that two shape keys pull apart while the shutter is open."""
    parts.plane("floor", principled("floor", GREY, roughness=0.9))
    ball = parts.sphere("ball", principled("ball", (0.75, 0.35, 0.3), roughness=0.8), 1,
                        (-0.2, 0, 1.2), 48)
    ball.shape_key_add(name="basis")
    tall, wide = (ball.shape_key_add(name=n, from_mix=False) for n in ("tall", "wide"))
    for k, vertex in enumerate(ball.data.vertices):
        x, y, z = vertex.co
        tall.data[k].co = (0.7 * x, 0.7 * y, 1.6 * z + 0.3)
        wide.data[k].co = (x + 1.5 * max(z, 0) ** 2, y, z)
    for shape, values in ((tall, {1: 0.0, 4: 1.0}), (wide, {1: 0.0, 4: 0.9})):
        parts.key(shape, "value", values)
    lamp("sun", "SUN", 3, toward=(1, 2, -2))
    parts.camera((0, -7, 2.6), (0, 0, 1.3))
    return {**DIM, "shutter": (2, 3.5)}


def instances(_):
    """500 heads that share one mesh, each with its place, turn and size."""
    parts.plane("floor", principled("floor", GREY, roughness=0.9), 12)
    head = parts.monkey("head", principled("head", (0.7, 0.5, 0.3), roughness=0.7))
    draw = random.Random(7)
    for k in range(500):
        copy = head if k == 0 else parts.link(f"head{k}", head.data)
        column, row = k % 25, k // 25
        copy.location = (0.8 * (column - 12), 0.9 * row - 4, draw.uniform(0.2, 1.4))
        copy.rotation_euler = [draw.uniform(-1.5, 1.5) for _ in range(3)]
        size = draw.uniform(0.2, 0.4)
        copy.scale = (size, size, size * draw.uniform(0.7, 1.3))
    lamp("sun", "SUN", 3, toward=(1, 1, -1.5))
    parts.camera((0, -12, 7), (0, 1, 0.5), 45)
    return {"background": {"color": [0.4, 0.45, 0.55]}}


def many_lights(_):
    """200 bulbs of different colours and powers above blocks."""
    parts.plane("floor", principled("floor", (0.7, 0.7, 0.7), roughness=1.0), 8)
    draw = random.Random(11)
    block = parts.cube("block", principled("block", (0.6, 0.6, 0.6), roughness=0.9), 0.4,
                       (-4, 0, 0.4))
    for k in range(1, 12):
        parts.link(f"block{k}", block.data).location = (
            2.2 * (k % 4) - 3.3 + draw.uniform(-0.4, 0.4), 2 * (k // 4) - 2, 0.4)
    for k in range(200):
        at = (draw.uniform(-6, 6), draw.uniform(-4, 5), draw.uniform(0.4, 2.2))
        color = [0.3 + 0.7 * draw.random() for _ in range(3)]
        lamp(f"bulb{k}", "POINT", draw.uniform(0.5, 12), at, color=color)
    parts.camera((0, -9, 5), (0, 0, 0.4), 45)
    return {"background": {"color": [0.02, 0.02, 0.02]}, "noise": 4}


def spots(_):
    """Spots with hard and soft edges on a floor with vertex colours."""
    floor = parts.vertex_coloured(principled("floor", roughness=1.0), "shade")
    ground = parts.plane("floor", floor)
    shades = ground.data.color_attributes.new("shade", "FLOAT_COLOR", "POINT")
    for k, shade in enumerate(((0.8, 0.2, 0.2), (0.2, 0.8, 0.2), (0.3, 0.3, 0.9), (0.9, 0.9, 0.9))):
        shades.data[k].color = (*shade, 1)
    parts.monkey("head", principled("head", (0.8, 0.8, 0.8), roughness=0.8), (0, 0, 1))
    for k, blend in enumerate((0.0, 0.3, 1.0)):
        spot = lamp(f"spot{k}", "SPOT", 900, (3.0 * k - 3, -2, 4), (1.8 * k - 1.8, 0.3, 0))
        spot.data.spot_size, spot.data.spot_blend = math.radians(40), blend
    parts.camera((0, -7, 4.5), (0, 0, 0.4), 45)
    return DIM


def lens(_):
    """Satin and matte bodies near and far, through a wide lens."""
    parts.plane("floor", principled("floor", GREY, roughness=0.9), 12)
    for k in range(5):
        kind = principled(f"ball{k}", (0.8, 0.25 * k, 0.3), float(k % 2), 0.35 if k % 2 else 0.9)
        parts.sphere(f"ball{k}", kind, 0.6, (1.1 * k - 2.2, 2.2 * k - 3, 0.6), 32)
    lamp("sun", "SUN", 3, toward=(1, 2, -2))
    parts.camera((0, -8, 2.2), (0, 0, 0.6), 45)
    return {"background": {"color": [0.3, 0.35, 0.45]}, "aperture_radius": 0.25,
            "focus_distance": 7.0}


def defaults(_):
    """Bodies without a material, texels that show, and Specular other than 0.5."""
    parts.plane("floor", None)
    parts.cube("box", None, 0.5, (-0.4, 0.9, 0.5)).rotation_euler = (0, 0, 0.5)
    draw = np.random.default_rng(3)
    texels = parts.picture("texels", parts.opaque(*draw.random((3, 6, 6))), "sRGB")
    wall = parts.textured(principled("wall", roughness=0.8), "Base Color", texels)
    for node in wall.node_tree.nodes:
        if node.type == "TEX_IMAGE":
            node.interpolation = "Closest"
    parts.wall("wall", wall, 2, 2, (1.9, 0.6, 1))
    for k, specular in enumerate((0.1, 1.0)):
        shiny = principled(f"shiny{k}", (0.3, 0.1, 0.05), roughness=0.25, specular=specular)
        parts.sphere(shiny.name, shiny, 0.6, (1.6 * k - 2.2, -0.8 * k, 0.6), 32)
    lamp("sun", "SUN", 3, toward=(1, 2, -2))
    lamp("bulb", "POINT", 200, (-3, -3, 4))
    parts.camera((0, -6, 2.6), (0, 0, 0.8), 50)
    return {"background": {"color": [0.4, 0.45, 0.5]}, "model": False}


ALL = [defaults, textures, normal_map, transmission, clearcoat, alpha, environment, emissive, rigid_motion,
       skin, morph, instances, many_lights, spots, lens]
