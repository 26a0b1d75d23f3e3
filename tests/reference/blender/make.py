# SPDX-License-Identifier: Apache-2.0
"""Makes the scenes that Blender is the witness of: GLB, scene file, and Cycles' image of it.

    blender -b --factory-startup -noaudio -P make.py -- [--samples N] [--keep] [--no-render] [NAME …]

Each scene of subjects.py is built in Blender, exported to scenes/NAME.glb by Blender's own glTF
exporter with its default options, and rendered by Cycles twice (half floats): as it is into
images/NAME.exr, and with glTF's model of surfaces (gltf_nodes.py) into models/NAME.exr.
scenes/NAME.json holds what a GLB cannot carry: size, filter, integrator, environment, lens and
shutter. Debian's Blender 3.4 made what is in the repository; the tests need only these files.
"""
import argparse
import json
import pathlib
import sys

import bpy

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))
import gltf_nodes  # noqa: E402
import subjects  # noqa: E402

WIDTH, HEIGHT, DEPTH, SAMPLES = 160, 120, 4, 256
FPS = 24


def settings(scene):
    """What Penumbra's path integrator does: DEPTH scattering events, no clamping, a box filter."""
    cycles, render = scene.cycles, scene.render
    render.engine = "CYCLES"
    cycles.device = "CPU"
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    cycles.max_bounces = cycles.diffuse_bounces = DEPTH
    cycles.glossy_bounces = cycles.transmission_bounces = DEPTH
    cycles.transparent_max_bounces = 64
    cycles.caustics_reflective = cycles.caustics_refractive = True
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0
    cycles.blur_glossy = cycles.light_sampling_threshold = 0
    cycles.pixel_filter_type, cycles.filter_width = "BOX", 1
    render.threads_mode, render.threads = "FIXED", 2
    render.resolution_x, render.resolution_y = WIDTH, HEIGHT
    render.resolution_percentage = 100
    render.image_settings.file_format = "OPEN_EXR"
    render.image_settings.color_mode = "RGB"
    render.image_settings.color_depth = "16"
    render.image_settings.exr_codec = "ZIP"
    render.fps = FPS
    scene.frame_start, scene.frame_end = 1, 5
    scene.frame_set(1)


def world(scene, background, directory):
    made = scene.world = bpy.data.worlds.new("world")
    made.use_nodes = True
    tree = made.node_tree
    node = tree.nodes["Background"]
    node.inputs["Strength"].default_value = background.get("intensity", 1)
    if "color" in background:
        node.inputs["Color"].default_value = (*background["color"], 1)
        return
    image = tree.nodes.new("ShaderNodeTexEnvironment")
    image.image = bpy.data.images.load(str(directory / background["image"]), check_existing=True)
    tree.links.new(image.outputs["Color"], node.inputs["Color"])


def lens(camera, found):
    if "aperture_radius" in found:
        depth = camera.data.dof
        depth.use_dof = True
        depth.focus_distance = found["focus_distance"]
        depth.aperture_fstop = camera.data.lens / 1000 / (2 * found["aperture_radius"])


def shutter(scene, found):
    """Blender's from frame to frame; the exporter puts frame n at n / FPS seconds."""
    if "shutter" not in found:
        return
    opens, closes = found["shutter"]
    scene.render.use_motion_blur = True
    scene.render.motion_blur_shutter = closes - opens
    scene.cycles.motion_blur_position = "START"
    for placed in scene.objects:
        placed.cycles.motion_steps = 5
    scene.frame_set(opens)


def plain_shadows(scene):
    """Cycles moves shadow rays off facets that only their smooth normals turn to the light."""
    for placed in scene.objects:
        placed.cycles.shadow_terminator_geometry_offset = 0


def scene_file(name, found):
    camera = {"from": "camera"}
    camera.update({k: found[k] for k in ("aperture_radius", "focus_distance") if k in found})
    if "shutter" in found:
        opens, closes = found["shutter"]
        camera["shutter"] = {"open": opens / FPS, "close": closes / FPS}
    return {
        "version": 1,
        "image": {"width": WIDTH, "height": HEIGHT, "filter": {"type": "box", "width": 1}},
        "camera": camera,
        "integrator": {"type": "path", "max_depth": DEPTH},
        "sampling": {"samples": SAMPLES},
        "background": found["background"],
        "objects": [{"type": "gltf", "asset": f"{name}.glb"}],
    }


def render(scene, path, options):
    if path.exists() and options.keep:
        return
    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)


def make(build, options):
    name = build.__name__
    directory = HERE / "scenes"
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    settings(scene)
    found = build(directory)
    world(scene, found["background"], directory)
    lens(scene.camera, found)
    bpy.ops.preferences.addon_enable(module="io_scene_gltf2")
    bpy.ops.export_scene.gltf(filepath=str(directory / f"{name}.glb"), export_format="GLB",
                              export_cameras=True, export_lights=True)
    text = json.dumps(scene_file(name, found), indent=2)
    (directory / f"{name}.json").write_text(text + "\n")
    if options.no_render:
        return
    found.get("before_render", lambda: None)()
    shutter(scene, found)
    plain_shadows(scene)
    scene.cycles.samples = options.samples * found.get("noise", 1)
    render(scene, HERE / "images" / f"{name}.exr", options)
    if not found.get("model", True):
        return
    gltf_nodes.rewire_all()
    render(scene, HERE / "models" / f"{name}.exr", options)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--samples", type=int, default=512)
    parser.add_argument("--no-render", action="store_true")
    parser.add_argument("--keep", action="store_true", help="render only images that are not there")
    parser.add_argument("names", nargs="*")
    options = parser.parse_args(sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else [])
    for directory in ("scenes", "images", "models"):
        (HERE / directory).mkdir(exist_ok=True)
    for build in subjects.ALL:
        if not options.names or build.__name__ in options.names:
            make(build, options)


if __name__ == "__main__":
    main()
