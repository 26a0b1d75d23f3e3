# SPDX-License-Identifier: Apache-2.0
"""Runs in a Blender of its own: writes a scene of a .blend file as a GLB.

    blender -b --factory-startup -P export.py -- FILE.blend SCENE FRAME APPLY OUT.glb

The exporter goes through the frames of an animation, selects and changes modes; in a Blender of its
own it does so without touching the one that somebody works in.
"""
import sys

import bpy


def give_materials(scene):
    """To what has none Blender gives a matte grey, glTF a white metal."""
    plain = bpy.data.materials.new("Plain")
    plain.use_nodes = True
    surface = next(node for node in plain.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    surface.inputs["Base Color"].default_value = (0.8, 0.8, 0.8, 1)
    surface.inputs["Specular"].default_value, surface.inputs["Roughness"].default_value = 0, 1
    for placed in scene.objects:
        if placed.type not in {"MESH", "CURVE", "SURFACE", "FONT", "META"}:
            continue
        if not placed.material_slots:
            placed.data.materials.append(plain)
        for slot in placed.material_slots:
            slot.material = slot.material or plain


def main(path, name, frame, apply_modifiers, out):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    with bpy.data.libraries.load(path) as (_, wanted):
        wanted.scenes = [name]
    scene = wanted.scenes[0]
    bpy.context.window.scene = scene
    scene.frame_set(int(frame))
    give_materials(scene)
    bpy.ops.preferences.addon_enable(module="io_scene_gltf2")
    bpy.ops.export_scene.gltf(
        filepath=out, export_format="GLB", export_cameras=True, export_lights=True,
        use_active_scene=True, use_renderable=True, export_apply=apply_modifiers == "1",
        # Times count from frame 0, whatever part of the animation plays.
        export_frame_range=False)


if __name__ == "__main__":
    main(*sys.argv[sys.argv.index("--") + 1:])
