# SPDX-License-Identifier: Apache-2.0
"""Small glTF files, made in the tests."""
import json
import struct

import numpy as np


def glb(tree, binary=b""):
    """The bytes of a GLB: JSON, and what its buffer 0 holds."""
    if binary:
        tree = {**tree, "buffers": [{"byteLength": len(binary)}]}
    text = json.dumps(tree).encode()
    chunks = [(0x4E4F534A, text + b" " * (-len(text) % 4))]
    if binary:
        chunks.append((0x004E4942, binary + b"\0" * (-len(binary) % 4)))
    body = b"".join(struct.pack("<II", len(data), kind) + data for kind, data in chunks)
    return struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body


def triangle(material=None, **more):
    """One triangle in the plane z = 0, with uvs; material is the glTF's, more joins the tree."""
    points = struct.pack("<9f", -1, -1, 0, 1, -1, 0, 0, 1, 0)
    uvs = struct.pack("<6f", 0, 1, 1, 1, 0.5, 0)
    primitive = {"attributes": {"POSITION": 0, "TEXCOORD_0": 1}}
    tree = {
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}], "meshes": [{"primitives": [primitive]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3",
             "min": [-1, -1, 0], "max": [1, 1, 0]},
            {"bufferView": 1, "componentType": 5126, "count": 3, "type": "VEC2"}],
        "bufferViews": [{"buffer": 0, "byteLength": 36},
                        {"buffer": 0, "byteOffset": 36, "byteLength": 24}],
        **more}
    if material is not None:
        tree["materials"] = [material]
        primitive["material"] = 0
    return tree, points + uvs


COMPONENTS = {"int8": 5120, "uint8": 5121, "int16": 5122, "uint16": 5123, "uint32": 5125,
              "float32": 5126}
TYPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}


class Asset:
    """A glTF put together piece by piece; what adds a piece tells its index."""

    def __init__(self, **more):
        self.tree = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": []}], **more}
        self.binary = bytearray()

    def add(self, kind, item):
        self.tree.setdefault(kind, []).append(item)
        return len(self.tree[kind]) - 1

    def view(self, data, **more):
        self.binary += b"\0" * (-len(self.binary) % 4)
        view = {"buffer": 0, "byteOffset": len(self.binary), "byteLength": len(data), **more}
        self.binary += data
        return self.add("bufferViews", view)

    def accessor(self, values, kind="float32", **more):
        """An accessor of its own view: one element a row, of numpy's type kind."""
        array = np.asarray(values, dtype=kind)
        return self.add("accessors", {
            "bufferView": self.view(array.tobytes()), "componentType": COMPONENTS[kind],
            "count": len(array), "type": TYPES[array[0].size], **more})

    def mesh(self, positions, indices=None, material=None, targets=(), mode=None, **attributes):
        """A mesh of one primitive; attributes and targets are accessors, or rows of floats."""
        def find(values):
            return values if isinstance(values, int) else self.accessor(values)

        primitive = {"attributes": {"POSITION": find(positions),
                                    **{name: find(item) for name, item in attributes.items()}}}
        if indices is not None:
            primitive["indices"] = (indices if isinstance(indices, int)
                                    else self.accessor(indices, "uint16"))
        for name, value in (("material", material), ("mode", mode)):
            if value is not None:
                primitive[name] = value
        if targets:
            primitive["targets"] = [{"POSITION": find(target)} for target in targets]
        return self.add("meshes", {"primitives": [primitive]})

    def node(self, parent=None, scene=0, **node):
        """A node under its parent, or a root of the scene."""
        index = self.add("nodes", node)
        if parent is not None:
            self.tree["nodes"][parent].setdefault("children", []).append(index)
        else:
            self.tree["scenes"][scene]["nodes"].append(index)
        return index

    def unlit(self, color, **more):
        """A material that shows its colour as it is, from both sides."""
        self.use("KHR_materials_unlit")
        return self.add("materials", {
            "pbrMetallicRoughness": {"baseColorFactor": [*color, 1][:4], **more.pop("pbr", {})},
            "extensions": {"KHR_materials_unlit": {}}, "doubleSided": True, **more})

    def use(self, extension):
        used = self.tree.setdefault("extensionsUsed", [])
        if extension not in used:
            used.append(extension)

    def light(self, **light):
        """What a node says to carry a light."""
        self.use("KHR_lights_punctual")
        lights = self.tree.setdefault("extensions", {}).setdefault(
            "KHR_lights_punctual", {"lights": []})["lights"]
        lights.append(light)
        return {"extensions": {"KHR_lights_punctual": {"light": len(lights) - 1}}}

    def animate(self, node, path, times, values, interpolation="LINEAR", clip=0):
        clips = self.tree.setdefault("animations", [])
        while len(clips) <= clip:
            clips.append({"samplers": [], "channels": []})
        clips[clip]["samplers"].append({"input": self.accessor(times),
                                        "output": self.accessor(values),
                                        "interpolation": interpolation})
        clips[clip]["channels"].append({"sampler": len(clips[clip]["samplers"]) - 1,
                                        "target": {"node": node, "path": path}})

    def bytes(self):
        return glb(self.tree, bytes(self.binary))
