# SPDX-License-Identifier: Apache-2.0
"""Runs in Blender for blender_addon.py: renders scenes through the add-on, and some by Cycles.

    blender -b --factory-startup -P blender_addon_scenes.py -- ADDONS SERVER OUT

ADDONS is the folder that has penumbra_render. OUT/NAME/ gets what the add-on sent, OUT/NAME.exr the
image that Blender saved, OUT/NAME-cycles.exr that of Cycles; OUT/report.json tells what else went on.
"""
import json
import os
import pathlib
import signal
import struct
import sys

import addon_utils
import bpy

WIDTH, HEIGHT = 96, 64


def add(operator, location, **more):
    operator(location=location, **more)
    return bpy.context.object


def camera(scene, location=(0, -6, 1.5), rotation=(1.4, 0, 0)):
    scene.camera = add(bpy.ops.object.camera_add, location, rotation=rotation)
    return scene.camera


def world_color(scene, color):
    scene.world = bpy.data.worlds.new("world")
    scene.world.use_nodes = True
    scene.world.node_tree.nodes["Background"].inputs["Color"].default_value = (*color, 1)
    return scene.world.node_tree


def lens(scene, _):
    """Depth of field on an object, bladed; a mesh that only its modifier makes round."""
    found = camera(scene)
    cube = add(bpy.ops.mesh.primitive_cube_add, (0.5, 0.5, 0.5))
    cube.modifiers.new("round", "SUBSURF").render_levels = 2
    cube.modifiers["round"].levels = 2
    add(bpy.ops.mesh.primitive_plane_add, (0, 0, -0.5), size=20)
    found.data.dof.use_dof = True
    found.data.dof.focus_object, found.data.dof.aperture_fstop = cube, 0.1
    found.data.dof.aperture_blades = 6
    world_color(scene, (0.5, 0.6, 0.7))


def motion(scene, _):
    """A cube that moves, with the shutter about frame 5."""
    camera(scene)
    cube = add(bpy.ops.mesh.primitive_cube_add, (-1, 0, 0))
    cube.keyframe_insert("location", frame=1)
    cube.location.x = 1
    cube.keyframe_insert("location", frame=10)
    scene.render.use_motion_blur, scene.render.motion_blur_shutter = True, 0.8
    scene.frame_set(5)
    world_color(scene, (1, 1, 1))


def area(scene, _):
    """Two area lights above a floor."""
    camera(scene, (0, -6, 3), (1.1, 0, 0))
    add(bpy.ops.mesh.primitive_plane_add, (0, 0, 0), size=20)
    for shape, x in (("RECTANGLE", -1.5), ("DISK", 1.5)):
        light = add(bpy.ops.object.light_add, (x, 0, 2), type="AREA", rotation=(0.3, 0, 0)).data
        light.shape, light.size, light.size_y, light.energy = shape, 0.5, 1.0, 100
    world_color(scene, (0, 0, 0))


def sky(scene, out):
    """A ball under a sky that is bright on one side, turned."""
    camera(scene)
    add(bpy.ops.mesh.primitive_uv_sphere_add, (0, 0, 1), segments=64, ring_count=32)
    bpy.ops.object.shade_smooth()
    path = out / "sky.hdr"
    path.write_bytes(radiance_picture(32, 16))
    tree = world_color(scene, (0, 0, 0))
    texture, mapping, place = (tree.nodes.new(f"ShaderNode{kind}") for kind in
                               ("TexEnvironment", "Mapping", "TexCoord"))
    texture.image = bpy.data.images.load(str(path))
    mapping.inputs["Rotation"].default_value[2] = 0.7
    tree.links.new(place.outputs["Generated"], mapping.inputs["Vector"])
    tree.links.new(mapping.outputs["Vector"], texture.inputs["Vector"])
    tree.links.new(texture.outputs["Color"], tree.nodes["Background"].inputs["Color"])
    tree.nodes["Background"].inputs["Strength"].default_value = 1.5


def radiance_picture(width, height):
    """A Radiance file without run lengths: one quarter of the horizon shines."""
    rows = bytearray()
    for y in range(height):
        for x in range(width):
            lit = width // 2 < x < 3 * width // 4 and y < height // 2
            rows += struct.pack("4B", *((200, 180, 120, 131) if lit else (30, 40, 60, 128)))
    return b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y %d +X %d\n" % (height, width) + bytes(rows)


def border(scene, out):
    """A part of an image."""
    lens(scene, out)
    scene.render.use_border = True
    scene.render.border_min_x, scene.render.border_max_x = 0.25, 0.75
    scene.render.border_min_y, scene.render.border_max_y = 0.5, 1.0
    scene.render.use_crop_to_border = True


def begin(build, out, server, keep):
    """A new scene, with the settings that all have."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    addon_utils.enable("penumbra_render", default_set=True)
    preferences = bpy.context.preferences.addons["penumbra_render"].preferences
    preferences.server, preferences.keep = server, str(keep)
    scene = bpy.context.scene
    render = scene.render
    render.engine = "PENUMBRA"
    render.resolution_x, render.resolution_y, render.resolution_percentage = 2 * WIDTH, 2 * HEIGHT, 50
    render.image_settings.file_format, render.image_settings.color_depth = "OPEN_EXR", "32"
    render.image_settings.color_mode = "RGBA"
    build(scene, out)
    return scene


def draw(scene, path):
    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)


def by_cycles(scene, path):
    scene.render.engine = "CYCLES"
    cycles = scene.cycles
    cycles.samples, cycles.use_adaptive_sampling, cycles.use_denoising = 256, False, False
    cycles.max_bounces = cycles.diffuse_bounces = 8
    cycles.sample_clamp_indirect = 0
    draw(scene, path)


def failure(scene, path):
    """What Blender tells when the render does not succeed."""
    try:
        draw(scene, path)
    except RuntimeError as error:
        return str(error)
    return ""


def cancelled(server, out):
    """Once something of the image has come, SIGINT: to Blender without windows it is what Esc is."""
    scene = begin(lens, out, server, out / "cancelled")
    scene.penumbra.samples = 65536
    from penumbra_render import engine
    show, shown = engine.PenumbraEngine.show, []

    def show_and_interrupt(self, *more):
        pause = show(self, *more)
        shown.append(pause)
        os.kill(os.getpid(), signal.SIGINT)
        return pause

    engine.PenumbraEngine.show = show_and_interrupt
    text = failure(scene, out / "cancelled.exr")
    engine.PenumbraEngine.show = show
    return {"partial_images": len(shown), "error": text}


def main(addons, server, out):
    sys.path.insert(0, addons)
    out = pathlib.Path(out)
    report = {"scenes": []}
    for build in (lens, motion, border, area, sky):
        name = build.__name__
        scene = begin(build, out, server, out / name)
        scene.penumbra.samples = 1024 if build in (area, sky) else 16
        draw(scene, out / f"{name}.exr")
        report["scenes"].append(name)
        if build in (area, sky):
            by_cycles(scene, out / f"{name}-cycles.exr")
    report["cancelled"] = cancelled(server, out)
    scene = begin(lens, out, "http://127.0.0.1:9", out / "nobody")
    report["nobody"] = failure(scene, out / "nobody.exr")
    report["panels"] = sorted(panel.__name__ for panel in bpy.types.Panel.__subclasses__()
                              if "PENUMBRA" in getattr(panel, "COMPAT_ENGINES", ()))
    addon_utils.disable("penumbra_render")
    report["left_after_disable"] = hasattr(bpy.types.Scene, "penumbra") or hasattr(bpy.types, "RENDER_PT_penumbra")
    (out / "report.json").write_text(json.dumps(report))


if __name__ == "__main__":
    main(*sys.argv[sys.argv.index("--") + 1:])
