# SPDX-License-Identifier: Apache-2.0
"""glTF files made to harm whoever reads them: (name, bytes, reason), each the same every time.

The reason is a word of the sentence that refuses the file; "" where it must be read; None where
either is right.
"""
import base64
import copy
import json
import random
import struct

import hostile_pictures
from glb import Asset, glb, triangle

NAN, INF = float("nan"), float("inf")
HUGE = [2**31 - 1, 2**31, 2**32 - 1, 2**32, 2**53, 2**63 - 1, 2**63, 2**64 - 2, 2**64 - 1]
FILLER = [1e300, -1e300, 1e-320, -1, 0, 2**31, 2**64 - 1, True, None, "x", [], {}, [1e39] * 3]


def put(tree, path, value):
    """The tree with one place changed: "accessors/0/count"."""
    tree = copy.deepcopy(tree)
    *parents, last = [int(key) if key.isdigit() else key for key in path.split("/")]
    place = tree
    for key in parents:
        place = place.setdefault(key, {}) if isinstance(place, dict) else place[key]
    place[last] = value
    return tree


def indexed(indices=(0, 1, 2), kind="uint16"):
    """A triangle with indices; its accessors: 0 positions, 1 indices."""
    asset = Asset()
    points = asset.accessor([[-1, -1, 0], [1, -1, 0], [0, 1, 0]])
    asset.node(mesh=asset.mesh(points, asset.accessor(indices, kind)))
    return asset


def figure():
    """A bit of everything that can be referred to: skin, morph targets, animation, light, camera."""
    asset = Asset()
    joints = [asset.node(translation=[0, 0, 0]), asset.node(translation=[0, 1, 0])]
    points = [[-1, -1, 0], [1, -1, 0], [0, 1, 0]]
    mesh = asset.mesh(points, [0, 1, 2], targets=[[[0, 0, 1]] * 3, [[0, 1, 0]] * 3],
                      JOINTS_0=asset.accessor([[0, 1, 0, 0]] * 3, "uint8"),
                      WEIGHTS_0=[[0.5, 0.5, 0, 0]] * 3)
    inverse = asset.accessor([[1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]] * 2)
    skin = asset.add("skins", {"joints": joints, "inverseBindMatrices": inverse})
    node = asset.node(mesh=mesh, skin=skin, weights=[0.1, 0.2])
    asset.animate(node, "weights", [0, 1], [0, 0, 1, 1])
    asset.animate(joints[0], "rotation", [0, 1], [[0, 0, 0, 1], [0, 0, 1, 0]])
    asset.node(camera=asset.add("cameras", {"type": "perspective", "perspective": {
        "yfov": 0.8, "znear": 0.1}}), translation=[0, 0, 5])
    asset.node(**asset.light(type="point", intensity=100), translation=[0, 3, 0])
    return asset


def textured(picture, mime="image/png"):
    """A triangle with a picture on it."""
    asset = Asset()
    use = {"index": asset.add("textures", {"source": asset.add("images", {
        "mimeType": mime, "bufferView": asset.view(picture)})})}
    asset.node(mesh=asset.mesh([[-1, -1, 0], [1, -1, 0], [0, 1, 0]], TEXCOORD_0=[[0, 0]] * 3,
                               material=asset.add("materials", {
                                   "pbrMetallicRoughness": {"baseColorTexture": use}})))
    return asset


def changed(asset, path, value):
    return glb(put(asset.tree, path, value), bytes(asset.binary))


# Containers

def raw(text, binary=None, version=2, length=None, kind=0x4E4F534A, text_length=None):
    """A GLB whose header may say anything."""
    body = struct.pack("<II", len(text) if text_length is None else text_length, kind) + text
    if binary is not None:
        body += struct.pack("<II", len(binary), 0x004E4942) + binary
    return struct.pack("<4sII", b"glTF", version, 12 + len(body) if length is None else length) + body


def containers():
    good = glb(*triangle())
    yield "good", good, ""
    yield "nothing", b"", "JSON"
    yield "zeros", bytes(1000), "JSON"
    for size in (4, 11, 12, 19, 20, 21, len(good) - 1):
        yield f"cut to {size} bytes", good[:size], "GLB header"
    for version in (0, 1, 3, 2**32 - 1):
        yield f"version {version}", raw(b"{}", version=version), "version"
    for length in (0, 19, 2**31, 2**32 - 1):
        yield f"length {length}", raw(b"{}  ", length=length), "GLB header"
    for length in (5, 2**31, 2**32 - 1):
        yield f"text of {length} bytes", raw(b"{}  ", text_length=length), "cut short"
    yield "first chunk BIN", raw(b"{}  ", kind=0x004E4942), "JSON"
    for length in (1, 2**31, 2**32 - 1):
        yield f"chunk of {length} bytes", raw(
            b"{}  " + struct.pack("<II", length, 0x004E4942), text_length=4), "cut short"
    yield "second chunk of another kind", raw(b"{}  " + struct.pack("<II", 0, 7), text_length=4), "BIN"
    yield "a picture", hostile_pictures.png(hostile_pictures.ihdr()), "JSON"


def texts():
    head = b'{"asset":{"version":"2.0"},'
    for name, text in (
            ("nothing", b""), ("a list", b"[]"), ("a number", b"1e999"), ("cut", head),
            ("a byte order mark", b"\xef\xbb\xbf" + head), ("a zero byte", head + b'"\0":1}'),
            ("no UTF-8", head + b'"scenes":[{"name":"\xff\xfe"}]}'),
            ("half a surrogate", head + b'"scenes":[{"name":"\\ud800"}]}'),
            ("a number beyond all", head + b'"scene":1e999}'),
            ("digits", head + b'"scene":' + b"9" * 100000 + b"}"),
            ("comments", head + b"/* */}"), ("keys twice", head + b'"nodes":[],"nodes":7}')):
        yield f"text: {name}", raw(text + b" " * (-len(text) % 4)), None
    for opening, closing in ((b"[", b"]"), (b'{"a":', b"}")):
        for depth in (70, 100000, 1000000):
            text = head + b'"extras":' + opening * depth + b"0" + closing * depth + b"}"
            yield f"text: {depth} times {opening.decode()}", raw(text), "nested"
    yield "text: brackets without an end", raw(b"[" * 3000000), "nested"
    yield "text: 3000000 values", raw(head + b'"extras":[' + b"0," * 3000000 + b"0]}"), "values"
    yield "text: a name of 8 MiB", raw(head + b'"scene":0,"scenes":[{"name":"' + b"x" * (8 << 20)
                                       + b'"}]}'), None
    for version in ('"1.0"', '"3.0"', "2", "null", '""', '{"version":"2.0"}'):
        yield f"asset version {version}", raw(b'{"asset":{"version":' + version.encode() + b"}}"), "2.0"
    yield "no asset", raw(b"{} "), "2.0"
    for kind in ("buffers", "bufferViews", "accessors", "meshes", "nodes", "scenes", "materials",
                 "textures", "images", "samplers", "skins", "animations", "cameras"):
        for value in (7, "x", {}, [7], [[]], [None]):
            yield f"{kind} are {value}", glb({**triangle()[0], kind: value}, triangle()[1]), None


# Offsets, counts, indices

def storage():
    tree, binary = triangle()
    for path, reason in (("bufferViews/0/byteOffset", "leave"), ("bufferViews/0/byteLength", "leave"),
                         ("bufferViews/0/byteStride", "byteStride"),
                         ("accessors/0/byteOffset", "leave"), ("accessors/0/count", "")):
        for value in HUGE:
            yield f"{path} {value}", glb(put(tree, path, value), binary), reason or "POSITION"
    yield "offset and length add up to 2^64", glb(put(put(
        tree, "bufferViews/0/byteOffset", 2**64 - 36), "bufferViews/0/byteLength", 36), binary), "buffer"
    yield "stride times count passes 2^64", glb(put(put(
        tree, "bufferViews/0/byteStride", 2**62), "accessors/0/count", 6), binary), None
    for value in HUGE:
        text = json.dumps({**tree, "buffers": [{"byteLength": value}]}).encode()
        yield f"buffer of {value} bytes", raw(text + b" " * (-len(text) % 4), binary), "byteLength"
    for path in ("bufferViews/0/buffer", "accessors/0/bufferView", "meshes/0/primitives/0/indices",
                 "meshes/0/primitives/0/attributes/POSITION", "meshes/0/primitives/0/material",
                 "nodes/0/mesh", "scenes/0/nodes/0", "scene"):
        for value in (7, 2**31 - 1, 2**31, 2**53):
            yield f"{path} {value}", glb(put(tree, path, value), binary), None
    for value in (-1, -2**31, 0.5, 1e300, "0", None):
        yield f"accessors/0/bufferView {value!r}", glb(put(tree, "accessors/0/bufferView", value),
                                                       binary), None
    for count in (2**26, 2**27, 2**28 - 1):
        zeros = put(tree, "accessors/0", {"componentType": 5126, "type": "VEC3", "count": count})
        yield f"{count} vertices of no bytes", glb(zeros, binary), "POSITION"
    zeros = put(tree, "accessors/0", {"componentType": 5126, "type": "VEC3", "count": 2**22})
    zeros["accessors"] *= 10
    zeros["meshes"] = [{"primitives": [{"attributes": {"POSITION": i}} for i in range(0, 20, 2)]}]
    yield "2^22 vertices of no bytes ten times", glb(zeros, binary), "no bytes"
    for place, value in (("count", 4), ("count", 2**31 - 1), ("count", -1),
                         ("indices/byteOffset", 2**31 - 1), ("values/byteOffset", 2**31 - 1),
                         ("indices/byteOffset", -5), ("indices/bufferView", 9),
                         ("values/bufferView", 9), ("indices/componentType", 5126)):
        asset = Asset()
        places = asset.view(struct.pack("<3H", 0, 1, 2))
        values = asset.view(bytes(36))
        points = asset.accessor([[-1, -1, 0], [1, -1, 0], [0, 1, 0]], sparse={
            "count": 3, "indices": {"bufferView": places, "componentType": 5123},
            "values": {"bufferView": values}})
        asset.node(mesh=asset.mesh(points))
        yield f"sparse {place} {value}", changed(asset, f"accessors/0/sparse/{place}", value), "POSITION"


def indices():
    for kind, top in (("uint8", 255), ("uint16", 65535), ("uint32", 2**32 - 1)):
        for value in (3, top - 1, top):
            yield f"{kind} index {value}", indexed((0, 1, value), kind).bytes(), "index"
    yield "index of floats", indexed((0, 1, 2), "float32").bytes(), "unsigned"
    yield "index of signs", indexed((0, 1, 2), "int16").bytes(), "unsigned"
    yield "two indices", indexed((0, 1)).bytes(), "triangles"
    for mode in (7, 2**31 - 1, -1, 2**53):
        yield f"mode {mode}", changed(indexed(), "meshes/0/primitives/0/mode", mode), None
    for component in (0, 5124, 5127, 5130, -1, 2**31 - 1):
        yield f"component type {component}", changed(indexed(), "accessors/0/componentType",
                                                     component), "component"
    for kind in ("VEC9", "", "MAT2", "MAT4", "SCALAR", 5):
        yield f"type {kind}", changed(indexed(), "accessors/0/type", kind), None


def numbers():
    good = [[-1, -1, 0], [1, -1, 0], [0, 1, 0]]
    for value in (NAN, INF, -INF, 3e38):
        bad = [[-1, -1, 0], [1, value, 0], [0, 1, 0]]
        asset = Asset()
        asset.node(mesh=asset.mesh(bad))
        yield f"vertex {value}", asset.bytes(), "not finite"
        for name, width in (("NORMAL", 3), ("TANGENT", 4), ("TEXCOORD_0", 2), ("COLOR_0", 4)):
            asset = Asset()
            rows = [[0.0] * (width - 1) + [1.0]] * 2 + [[value] * width]
            asset.node(mesh=asset.mesh(good, **{name: rows}))
            yield f"{name} {value}", asset.bytes(), "not finite"
        asset = Asset()
        asset.node(mesh=asset.mesh(good, targets=[bad]))
        yield f"morph target {value}", asset.bytes(), "not finite"
    flat, far = Asset(), Asset()
    flat.node(mesh=flat.mesh([[0, 0, 0]] * 3, NORMAL=[[0, 0, 0]] * 3))
    yield "no extent, no normals", flat.bytes(), ""
    far.node(mesh=far.mesh([[1e15, 0, 0], [-1e15, 0, 0], [0, 1e15, 0]]))
    yield "vertices at the limit", far.bytes(), ""
    for path, value in (("translation", [1e39, 0, 0]), ("scale", [1e300] * 3), ("rotation", [0] * 4),
                        ("rotation", [1e300] * 4), ("translation", [1]), ("scale", ["x"] * 3),
                        ("matrix", [1e300] * 16), ("matrix", [0] * 16), ("matrix", [1] * 16),
                        ("matrix", [1, 2]), ("scale", [0, 0, 0]), ("scale", [1e-30] * 3),
                        ("matrix", [0] * 15 + [1])):
        yield f"{path} {value}", changed(indexed(), f"nodes/0/{path}", value), None


# Trees, and what moves them

def cycles():
    tree, binary = triangle()
    yield "its own child", glb({**tree, "nodes": [{"mesh": 0, "children": [0]}]}, binary), "node"
    for count in (2, 3, 5000):
        nodes = [{"mesh": 0, "children": [(i + 1) % count]} for i in range(count)]
        yield f"a circle of {count}", glb({**tree, "nodes": nodes}, binary), "node"
        rooted = [{"children": [1]}, *({"children": [1 + (i + 1) % count]} for i in range(count))]
        yield f"a circle of {count} below a root", glb({**tree, "nodes": rooted}, binary), "parent"
    yield "two parents", glb({**tree, "scenes": [{"nodes": [0, 1]}], "nodes": [
        {"children": [2]}, {"children": [2]}, {"mesh": 0}]}, binary), "parent"
    # Each level names the next one twice: 2^60 nodes, if a walk followed.
    doubled = [{"children": [i + 1, i + 1]} for i in range(60)] + [{"mesh": 0}]
    yield "2^60 paths", glb({**tree, "nodes": doubled}, binary), "parent"
    yield "a root twice", glb({**tree, "scenes": [{"nodes": [0, 0]}]}, binary), "twice"
    for depth in (257, 60000):
        chain = [{"children": [i + 1]} for i in range(depth)] + [{"mesh": 0}]
        yield f"{depth} levels", glb({**tree, "nodes": chain}, binary), "255 nodes" if depth == 257 else None
    yield "children far out", glb({**tree, "nodes": [{"children": [2**31 - 1, -1]}]}, binary), "node"
    yield "a scene of nobody", glb({**tree, "scene": 5}, binary), "scene"


def motion():
    asset = figure()
    yield "a figure", asset.bytes(), ""
    animation = "animations/0/samplers/1"
    for path, value in (
            ("skins/0/joints", []), ("skins/0/joints/1", 99), ("skins/0/joints/1", -1),
            ("skins/0/joints", [0, 1] * 40000), ("skins/0/joints", [1]), ("skins/0/joints", [0, 1, 2]),
            ("skins/0/inverseBindMatrices", 0), ("skins/0/inverseBindMatrices", 99),
            ("nodes/2/skin", 9), ("nodes/2/weights", [1] * 3), ("nodes/2/weights", [1e300] * 2),
            ("nodes/2/camera", 99), ("nodes/3/camera", 2**31 - 1),
            ("nodes/4/extensions/KHR_lights_punctual/light", 9),
            ("nodes/4/extensions/KHR_lights_punctual/light", -9),
            ("extensions/KHR_lights_punctual/lights/0/type", "sun"),
            ("extensions/KHR_lights_punctual/lights/0/intensity", -1),
            ("extensions/KHR_lights_punctual/lights/0/intensity", 1e300),
            ("extensions/KHR_lights_punctual/lights/0/color", [1e300] * 3),
            ("extensions/KHR_lights_punctual/lights", 5),
            ("cameras/0/perspective/yfov", 0), ("cameras/0/perspective/yfov", 1e300),
            ("cameras/0/type", "pinhole"), ("cameras/0/perspective", None),
            (f"{animation}/input", 99), (f"{animation}/output", 99), (f"{animation}/output", 0),
            (f"{animation}/interpolation", "SMOOTH"), (f"{animation}/interpolation", "CUBICSPLINE"),
            ("animations/0/channels/1/sampler", 99), ("animations/0/channels/1/target/node", 99),
            ("animations/0/channels/1/target/path", "color"),
            ("meshes/0/primitives/0/attributes/JOINTS_0", 0),
            ("meshes/0/primitives/0/attributes/WEIGHTS_0", 0),
            ("meshes/0/primitives/0/attributes/WEIGHTS_0", 99),
            ("meshes/0/primitives/0/targets/1/POSITION", 99),
            ("meshes/0/primitives/0/targets", [{}] * 65), ("meshes/0/weights", [1e300])):
        yield f"figure: {path} {value!r:.40}", changed(asset, path, value), None
    for times in ([1, 0], [0, 0], [0, NAN], [INF, INF], [0, 1e7], [-1e30, 0]):
        moved = indexed()
        moved.animate(0, "translation", times, [[0, 0, 0], [1, 0, 0]])
        yield f"times {times}", moved.bytes(), "animation 0, channel 0"
    for path, values in (("translation", [[NAN] * 3, [0] * 3]), ("rotation", [[0] * 4] * 2),
                         ("scale", [[INF] * 3, [0] * 3]), ("translation", [[0, 0, 0]]),
                         ("rotation", [[1, 0, 0]] * 2)):
        moved = indexed()
        moved.animate(0, path, [0, 1], values)
        yield f"moved {path} {values}", moved.bytes(), "animation 0"
    uneven = figure()
    uneven.tree["meshes"][0]["primitives"].append(copy.deepcopy(
        uneven.tree["meshes"][0]["primitives"][0]))
    del uneven.tree["nodes"][2]["weights"]  # which would have to be as many
    for count in (1, 3, 64):
        targets = [uneven.tree["meshes"][0]["primitives"][0]["targets"][0]] * count
        yield f"another primitive of {count} targets", changed(
            uneven, "meshes/0/primitives/1/targets", targets), "targets"


# Pictures, materials, extensions

def crowds():
    """Small files that unfold to more than a scene may hold."""
    tree, binary = triangle()
    crowd = {**tree, "nodes": [{"mesh": 0}] * 100, "scenes": [{"nodes": list(range(100))}],
             "meshes": [{"primitives": tree["meshes"][0]["primitives"] * 1000}]}
    yield "100 nodes of 1000 primitives", glb(crowd, binary), "more objects"
    for kind, item in (("nodes", {}), ("meshes", tree["meshes"][0]), ("materials", {}),
                       ("accessors", tree["accessors"][0]), ("bufferViews", tree["bufferViews"][0])):
        many = {**tree, kind: tree.get(kind, []) + [item] * 65537}
        yield f"more than 65536 {kind}", glb(many, binary), "65536"


def pictures():
    p = hostile_pictures
    good = p.png(p.ihdr(), p.idat(p.rows()))
    yield "a picture on it", textured(good).bytes(), ""
    for name, picture in (
            ("65535x65535", p.png(p.ihdr(65535, 65535), p.idat(p.rows()))),
            ("2^31x2^31", p.png(p.ihdr(2**31 - 1, 2**31 - 1), p.idat(p.rows()))),
            ("a zip bomb", p.png(p.ihdr(8, 8), p.chunk(b"IDAT", p.bomb(256)))),
            ("a zip bomb of texels", p.png(p.ihdr(16384, 4096), p.chunk(b"IDAT", p.bomb(64)))),
            ("cut", good[:50]), ("nothing", b"\x89PNG"), ("noise", random.Random(5).randbytes(900)),
            ("a JPEG of 65535x65535", b"\xff\xd8\xff\xc0\0\x11\x08\xff\xff\xff\xff\x03" + bytes(9))):
        yield f"picture: {name}", textured(picture).bytes(), "picture" if name == "" else None
    asset = textured(good)
    for path, value in (("images/0/bufferView", 99), ("images/0/bufferView", -1),
                        ("images/0/bufferView", 2**64 - 1), ("images/0", {}),
                        ("images/0", {"uri": "../../../etc/passwd"}),
                        ("images/0", {"uri": "http://127.0.0.1/x.png"}),
                        ("images/0", {"uri": "data:image/png;base64,!!!"}),
                        ("images/0", {"uri": "data:,x"}), ("images/0", {"uri": "data:;base64,"}),
                        ("images/0", {"uri": "data:image/png;base64," + base64.b64encode(
                            good[:40]).decode()}),
                        ("textures/0/source", 99), ("textures/0/source", -1),
                        ("textures/0/sampler", 99), ("textures/0/sampler", -7),
                        ("materials/0/pbrMetallicRoughness/baseColorTexture/index", 99),
                        ("materials/0/pbrMetallicRoughness/baseColorTexture/index", -5),
                        ("materials/0/pbrMetallicRoughness/baseColorTexture/texCoord", 2**31 - 1),
                        ("materials/0/pbrMetallicRoughness/baseColorTexture/texCoord", -3)):
        yield f"{path} {value!r:.60}", changed(asset, path, value), None
    transform = "materials/0/pbrMetallicRoughness/baseColorTexture/extensions/KHR_texture_transform"
    for value in ({"offset": [1e300, 0]}, {"scale": [1e300] * 2}, {"rotation": 1e300}, {"offset": [1]},
                  {"texCoord": 9}, 7):
        yield f"texture transform {value}", changed(asset, transform, value), None


def materials():
    asset = textured(hostile_pictures.png(hostile_pictures.ihdr(), hostile_pictures.idat(
        hostile_pictures.rows())))
    for path, value in (("pbrMetallicRoughness/baseColorFactor", [1e300] * 4),
                        ("pbrMetallicRoughness/baseColorFactor", [1]),
                        ("pbrMetallicRoughness/metallicFactor", -1),
                        ("pbrMetallicRoughness/roughnessFactor", 1e300),
                        ("emissiveFactor", [-1, 0, 0]), ("emissiveFactor", [1]),
                        ("alphaMode", "GONE"), ("alphaMode", 7), ("alphaCutoff", -1),
                        ("alphaCutoff", 1e300), ("normalTexture", {"index": 0, "scale": 1e300}),
                        ("normalTexture", {"index": 5}), ("doubleSided", "x"),
                        ("extensions", {"KHR_materials_ior": {"ior": -1}}),
                        ("extensions", {"KHR_materials_ior": {"ior": 1e300}}),
                        ("extensions", {"KHR_materials_emissive_strength": {"emissiveStrength": -1}}),
                        ("extensions", {"KHR_materials_transmission": {"transmissionFactor": 2}}),
                        ("extensions", {"KHR_materials_clearcoat": {"clearcoatFactor": -1}}),
                        ("extensions", {"KHR_materials_clearcoat": {"clearcoatTexture": {"index": 9}}}),
                        ("extensions", 7), ("extensions", {"KHR_materials_ior": 7})):
        yield f"material: {path} {value}", changed(asset, f"materials/0/{path}", value), None
    for name in ("KHR_draco_mesh_compression", "EXT_meshopt_compression", "KHR_texture_basisu", "x" * 9000):
        yield f"required: {name:.40}", glb(*triangle(
            extensionsUsed=[name], extensionsRequired=[name])), name[:60]
    yield "required: no text", glb(*triangle(extensionsRequired=[7])), "requires"
    yield "used: 60000 extensions", glb(*triangle(extensionsUsed=[f"X_{i}" for i in range(60000)])), ""


def mutations(count, seed=11):
    """Good files with a few bytes changed, or with a few places of their text."""
    dice = random.Random(seed)
    good = [figure(), indexed(), textured(hostile_pictures.png(
        hostile_pictures.ihdr(), hostile_pictures.idat(hostile_pictures.rows())))]
    for i in range(count):
        asset = dice.choice(good)
        if i % 2:
            yield f"mutation {i}", hostile_pictures.mutated(asset.bytes(), dice), None
            continue
        tree = copy.deepcopy(asset.tree)
        for _ in range(dice.randrange(1, 4)):
            place, key = dice.choice([*places(tree)])
            place[key] = dice.choice(FILLER)
        yield f"mutation {i}", glb(tree, bytes(asset.binary)), None


def places(tree):
    """Each (container, key) of a tree, below its top."""
    for key in tree if isinstance(tree, dict) else range(len(tree)):
        yield tree, key
        if isinstance(tree[key], (dict, list)):
            yield from places(tree[key])


def all_assets(mutated=60):
    for make in (containers, texts, storage, indices, numbers, cycles, motion, crowds, pictures, materials):
        for name, content, reason in make():
            yield f"glb: {name}", content, reason
    for name, content, reason in mutations(mutated):
        yield f"glb: {name}", content, reason
