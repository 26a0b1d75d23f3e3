# SPDX-License-Identifier: Apache-2.0
"""Small glTF files, made in the tests."""
import json
import struct


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
