# SPDX-License-Identifier: Apache-2.0
"""Runs in a Blender of its own: writes a scene of a .blend file as a GLB.

    blender -b --factory-startup -P export.py -- FILE.blend SCENE FRAME APPLY OUT.glb

The exporter goes through the frames of an animation, selects and changes modes; in a Blender of its
own it does so without touching the one that somebody works in.
"""
import sys

import bpy


def main(path, name, frame, apply_modifiers, out):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    with bpy.data.libraries.load(path) as (_, wanted):
        wanted.scenes = [name]
    scene = wanted.scenes[0]
    bpy.context.window.scene = scene
    scene.frame_set(int(frame))
    bpy.ops.preferences.addon_enable(module="io_scene_gltf2")
    bpy.ops.export_scene.gltf(
        filepath=out, export_format="GLB", export_cameras=True, export_lights=True,
        use_active_scene=True, use_renderable=True, export_apply=apply_modifiers == "1",
        # Times count from frame 0, whatever part of the animation plays.
        export_frame_range=False)


if __name__ == "__main__":
    main(*sys.argv[sys.argv.index("--") + 1:])
