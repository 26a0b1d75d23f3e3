# SPDX-License-Identifier: Apache-2.0
"""Renders a scene file with Blender's Cycles, as a peer for speed and for the picture.

    blender -b --factory-startup -noaudio -P cycles_scene.py -- \
        SCENE.json OUT.exr SAMPLES THREADS [SEED]

Knows what the reference scenes use: matte, glossy and glass; spheres and meshes, moved by
keyframes; rectangle, triangle and sphere lights; lens, shutter. Besides those of the scene format
there are objects of type "arrays": points and triangles in a file of numpy's at "path". Blender is Z-up:
(x, y, z) becomes (x, -z, y). Cycles has no true spheres: they become smooth meshes of 256 x 128
faces.
"""
import json
import math
import sys

import bpy
import numpy as np
from mathutils import Matrix, Quaternion, Vector

SEGMENTS, RINGS = 256, 128


def point(p):
    return Vector((p[0], -p[2], p[1]))


def rotation(q):
    return Quaternion((q[3], q[0], -q[2], q[1]))


def settings(scene, doc, samples, threads, seed):
    cycles, integrator, image = scene.cycles, doc["integrator"], doc["image"]
    scene.render.engine = "CYCLES"
    cycles.device, cycles.samples, cycles.seed = "CPU", samples, seed
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    depth, everything = integrator["max_depth"], integrator["type"] == "path"
    cycles.max_bounces = cycles.glossy_bounces = cycles.transmission_bounces = depth
    cycles.diffuse_bounces = depth if everything else 0
    cycles.caustics_reflective = cycles.caustics_refractive = everything
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = cycles.blur_glossy = 0
    cycles.pixel_filter_type, cycles.filter_width = "BOX", 1
    render = scene.render
    render.threads_mode, render.threads = "FIXED", threads
    render.resolution_x, render.resolution_y = image["width"], image["height"]
    render.resolution_percentage = 100
    render.image_settings.file_format = "OPEN_EXR"
    render.image_settings.color_depth = "32"
    world = scene.world = bpy.data.worlds.new("world")
    world.use_nodes = True
    background = world.node_tree.nodes["Background"]
    background.inputs["Color"].default_value = (*doc["background"]["color"], 1)


def empty_material(name):
    made = bpy.data.materials.new(name)
    made.use_nodes = True
    made.node_tree.nodes.clear()
    return made, made.node_tree.nodes, made.node_tree.links


def surface(name, spec):
    made, nodes, links = empty_material(name)
    kind = {"matte": "Diffuse", "glossy": "Glossy", "glass": "Glass"}[spec["type"]]
    bsdf = nodes.new(f"ShaderNodeBsdf{kind}")
    bsdf.inputs["Color"].default_value = (*spec["color"], 1)
    if kind != "Diffuse":
        roughness = spec.get("roughness", 0)
        bsdf.distribution = "GGX" if roughness > 0 else "SHARP"
        bsdf.inputs["Roughness"].default_value = roughness
    if kind == "Glass":
        bsdf.inputs["IOR"].default_value = spec["ior"]
    links.new(bsdf.outputs[0], nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    return made


def emitter(name, radiance, one_sided):
    """An emission that is black from behind."""
    made, nodes, links = empty_material(name)
    emission = nodes.new("ShaderNodeEmission")
    emission.inputs["Color"].default_value = (*radiance, 1)
    front = emission.outputs[0]
    if one_sided:
        black = nodes.new("ShaderNodeBsdfDiffuse")
        black.inputs["Color"].default_value = (0, 0, 0, 1)
        mix = nodes.new("ShaderNodeMixShader")
        links.new(nodes.new("ShaderNodeNewGeometry").outputs["Backfacing"], mix.inputs[0])
        links.new(front, mix.inputs[1])
        links.new(black.outputs[0], mix.inputs[2])
        front = mix.outputs[0]
    links.new(front, nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    return made


def add(scene, name, vertices, faces, material, smooth=False):
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(vertices, [], faces)
    mesh.polygons.foreach_set("use_smooth", [smooth] * len(faces))
    mesh.materials.append(material)
    placed = bpy.data.objects.new(name, mesh)
    scene.collection.objects.link(placed)
    return placed


def add_mesh(scene, name, vertices, indices, material):
    faces = [tuple(indices[i:i + 3]) for i in range(0, len(indices), 3)]
    return add(scene, name, [point(v) for v in vertices], faces, material)


def add_arrays(scene, name, path, material):
    """Millions of triangles, which lists would take minutes for."""
    arrays = np.load(path)
    points, triangles = arrays["points"], arrays["triangles"]
    mesh = bpy.data.meshes.new(name)
    mesh.vertices.add(len(points))
    mesh.vertices.foreach_set(
        "co", np.stack([points[:, 0], -points[:, 2], points[:, 1]], axis=1).ravel())
    mesh.loops.add(triangles.size)
    mesh.loops.foreach_set("vertex_index", triangles.ravel().astype(np.int32))
    mesh.polygons.add(len(triangles))
    mesh.polygons.foreach_set("loop_start", np.arange(0, triangles.size, 3, dtype=np.int32))
    mesh.polygons.foreach_set("loop_total", np.full(len(triangles), 3, dtype=np.int32))
    mesh.update(calc_edges=True)
    mesh.materials.append(material)
    placed = bpy.data.objects.new(name, mesh)
    scene.collection.objects.link(placed)
    return placed


def add_sphere(scene, name, center, radius, material):
    def vertex(ring, segment):
        theta, phi = math.pi * ring / RINGS, 2 * math.pi * segment / SEGMENTS
        return (radius * math.sin(theta) * math.cos(phi), radius * math.sin(theta) * math.sin(phi),
                radius * math.cos(theta))

    vertices = [vertex(r, s) for r in range(RINGS + 1) for s in range(SEGMENTS)]
    faces = []
    for r in range(RINGS):
        for s in range(SEGMENTS):
            a, b = r * SEGMENTS + s, r * SEGMENTS + (s + 1) % SEGMENTS
            faces.append((a, a + SEGMENTS, b + SEGMENTS, b))
    placed = add(scene, name, vertices, faces, material, smooth=True)
    placed.location = point(center)
    return placed


def linear(placed):
    for curve in placed.animation_data.action.fcurves:
        curve.extrapolation = "CONSTANT"
        for key in curve.keyframe_points:
            key.interpolation = "LINEAR"


def animate(placed, keys, rest, opened):
    """Scene time 'opened' is Blender's frame 1, a second is one frame."""
    placed.rotation_mode = "QUATERNION"
    for key in keys:
        frame = 1 + key["time"] - opened
        if "translate" in key:
            placed.location = point([a + b for a, b in zip(rest, key["translate"])])
            placed.keyframe_insert("location", frame=frame)
        if "rotate" in key:
            placed.rotation_quaternion = rotation(key["rotate"])
            placed.keyframe_insert("rotation_quaternion", frame=frame)
        if "scale" in key:
            x, y, z = key["scale"]
            placed.scale = (x, z, y)
            placed.keyframe_insert("scale", frame=frame)
    linear(placed)


def add_objects(scene, doc, opened):
    materials = {name: surface(name, spec) for name, spec in doc["materials"].items()}
    for number, item in enumerate(doc["objects"]):
        name, material = f"object {number}", materials[item["material"]]
        if item["type"] == "sphere":
            placed = add_sphere(scene, name, item["center"], item["radius"], material)
        elif item["type"] == "mesh":
            placed = add_mesh(scene, name, item["vertices"], item["indices"], material)
        elif item["type"] == "arrays":
            placed = add_arrays(scene, name, item["path"], material)
        else:
            sys.exit(f"no {item['type']} here")
        if "keyframes" in item:
            animate(placed, item["keyframes"], item.get("center", (0, 0, 0)), opened)


def add_lights(scene, doc):
    for number, light in enumerate(doc.get("lights", [])):
        name, kind = f"light {number}", light["type"]
        material = emitter(name, light["radiance"], kind != "sphere")
        material.cycles.sample_as_light = True
        if kind == "rectangle":
            c, u, v = (Vector(light[key]) for key in ("corner", "edge_u", "edge_v"))
            add_mesh(scene, name, [c, c + u, c + u + v, c + v], [0, 1, 2, 0, 2, 3], material)
        elif kind == "triangle":
            add_mesh(scene, name, light["vertices"], [0, 1, 2], material)
        elif kind == "sphere":
            add_sphere(scene, name, light["center"], light["radius"], material)
        else:
            sys.exit(f"no {kind} light here")


def frame_of(position, look_at, up):
    eye, back = point(position), (point(position) - point(look_at)).normalized()
    right = point(up).cross(back).normalized()
    columns = Matrix((right, back.cross(right), back)).transposed()
    return Matrix.Translation(eye) @ columns.to_4x4()


def add_camera(scene, spec, opened):
    lens = bpy.data.cameras.new("camera")
    eye = scene.camera = bpy.data.objects.new("camera", lens)
    scene.collection.objects.link(eye)
    up = spec.get("up", [0, 1, 0])
    eye.matrix_world = frame_of(spec["position"], spec["look_at"], up)
    eye.rotation_mode = "QUATERNION"
    for key in spec.get("keyframes", []):
        whole = {**spec, **key}
        pose = frame_of(whole["position"], whole["look_at"], up)
        eye.location, eye.rotation_quaternion = pose.translation, pose.to_quaternion()
        for channel in ("location", "rotation_quaternion"):
            eye.keyframe_insert(channel, frame=1 + key["time"] - opened)
    if "keyframes" in spec:
        linear(eye)
    lens.sensor_fit, lens.angle = "HORIZONTAL", math.radians(spec["horizontal_fov"])
    lens.clip_start, lens.clip_end = 0.01, 10000
    radius = spec.get("aperture_radius", 0)
    if radius > 0:
        lens.dof.use_dof = True
        lens.dof.focus_distance = spec["focus_distance"]
        lens.dof.aperture_fstop = lens.lens / 1000 / (2 * radius)


def main():
    path, output, samples, threads, *seed = sys.argv[sys.argv.index("--") + 1:]
    with open(path) as file:
        doc = json.load(file)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    settings(scene, doc, int(samples), int(threads), int(seed[0]) if seed else 0)
    shutter = doc["camera"].get("shutter")
    if shutter:
        scene.render.use_motion_blur = True
        scene.render.motion_blur_shutter = shutter["close"] - shutter["open"]
        scene.cycles.motion_blur_position = "START"
    opened = shutter["open"] if shutter else 0
    add_objects(scene, doc, opened)
    add_lights(scene, doc)
    add_camera(scene, doc["camera"], opened)
    scene.render.filepath = output
    scene.frame_set(1)
    bpy.ops.render.render(write_still=True)


main()
