# SPDX-License-Identifier: Apache-2.0
"""Penumbra as a render engine of Blender: F12 renders the scene on a Penumbra server.

The scene goes out as glTF, by Blender's own exporter, with what glTF has no words for beside it:
lens, shutter, world and area lights. The image appears while it is being rendered; Esc cancels.
"""
import bpy
from bpy.props import BoolProperty, EnumProperty, IntProperty, PointerProperty, StringProperty

from . import engine

bl_info = {
    "name": "Penumbra",
    "author": "Penumbra maintainers",
    "version": (0, 1, 0),
    "blender": (3, 4, 0),
    "location": "Properties > Render > Render Engine",
    "description": "Renders scenes on a Penumbra server",
    "category": "Render",
}

# Of the built-in engines' panels, those about worlds, lights, cameras, meshes and materials.
SHARED = ("WORLD_PT_", "DATA_PT_", "MATERIAL_PT_", "EEVEE_WORLD_PT_surface", "EEVEE_MATERIAL_PT_")


class Preferences(bpy.types.AddonPreferences):
    bl_idname = __package__

    server: StringProperty(
        name="Server", default="http://127.0.0.1:8080",
        description="Where the Penumbra server answers: http://HOST:PORT or https://…")
    token_file: StringProperty(
        name="Token file", subtype="FILE_PATH",
        description="File with the bearer token, if the server wants one")
    keep: StringProperty(
        name="Keep scenes in", subtype="DIR_PATH",
        description="Directory that what is sent is left in (scene.json, model.glb), for "
                    "`penumbra render`; nothing is kept if it is empty")

    def draw(self, _):
        for name in ("server", "token_file", "keep"):
            self.layout.prop(self, name)


class Settings(bpy.types.PropertyGroup):
    samples: IntProperty(name="Samples", default=64, min=1, max=65536, description="Samples per pixel")
    mode: EnumProperty(
        name="Sampling", default="uniform", description="Which pixels get the samples",
        items=[("uniform", "Uniform", "All pixels the same number"),
               ("adaptive", "Adaptive", "Pixels until their estimated error is small"),
               ("edge", "Edges", "More where neighbours differ")])
    max_depth: IntProperty(name="Bounces", default=8, min=1, max=64,
                           description="Scattering events of a path")
    seed: IntProperty(name="Seed", default=0, min=0)
    apply_modifiers: BoolProperty(
        name="Apply modifiers", default=True,
        description="Send meshes as their modifiers make them. Shape keys then do not blur in motion")


class RENDER_PT_penumbra(bpy.types.Panel):
    bl_label = "Penumbra"
    bl_space_type, bl_region_type, bl_context = "PROPERTIES", "WINDOW", "render"
    COMPAT_ENGINES = {engine.PenumbraEngine.bl_idname}

    @classmethod
    def poll(cls, context):
        return context.engine in cls.COMPAT_ENGINES

    def draw(self, context):
        layout, scene = self.layout, context.scene
        layout.use_property_split = True
        for name in ("samples", "mode", "max_depth", "seed", "apply_modifiers"):
            layout.prop(scene.penumbra, name)
        layout.prop(scene.render, "use_motion_blur")
        layout.prop(scene.render, "motion_blur_shutter")


CLASSES = (Preferences, Settings, RENDER_PT_penumbra, engine.PenumbraEngine)


def panels():
    """Blender's own panels that make sense here too."""
    for panel in bpy.types.Panel.__subclasses__():
        engines = getattr(panel, "COMPAT_ENGINES", ())
        if "BLENDER_EEVEE" in engines and panel.__name__.startswith(SHARED):
            yield panel


def register():
    for kind in CLASSES:
        bpy.utils.register_class(kind)
    bpy.types.Scene.penumbra = PointerProperty(type=Settings)
    for panel in panels():
        panel.COMPAT_ENGINES.add(engine.PenumbraEngine.bl_idname)


def unregister():
    for panel in panels():
        panel.COMPAT_ENGINES.discard(engine.PenumbraEngine.bl_idname)
    del bpy.types.Scene.penumbra
    for kind in reversed(CLASSES):
        bpy.utils.unregister_class(kind)
