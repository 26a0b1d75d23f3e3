# SPDX-License-Identifier: Apache-2.0
"""Rewires Principled BSDFs to what glTF 2.0 says, so that Cycles renders glTF's model.

Blender's Principled BSDF 3.4 differs from the model that its exporter writes: its diffuse lobe is
Burley's, brighter than Lambert's at grazing angles on rough surfaces; the specular lobe comes on
top of it and takes nothing from it; and its coat has a quarter of the strength and takes nothing
either. Here

    alpha * (coat(mix(lambert * 0.96 + specular, metal, metallic)) + emission) + (1 - alpha) * behind

where specular and metal are lobes of Principled BSDFs without a diffuse part, and 0.96 is what a
dielectric of index 1.5 lets through head-on. Transmission is left to the Principled BSDF, which
has no diffuse lobe then. Pictures in sRGB become linear ones: Cycles interpolates between their
encoded values, glTF between the light they stand for.
"""
import bpy
import numpy as np

BELOW_SPECULAR = 0.96


class Wiring:
    def __init__(self, material):
        self.tree = material.node_tree
        self.source = self.tree.nodes["Principled BSDF"]

    def node(self, kind):
        return self.tree.nodes.new(f"ShaderNode{kind}")

    def feed(self, name, target):
        """Gives target what the Principled BSDF has in an input: a link, or a value."""
        socket = self.source.inputs[name]
        if socket.is_linked:
            self.tree.links.new(socket.links[0].from_socket, target)
        elif socket.type != "VECTOR":
            target.default_value = socket.default_value

    def lobes(self, color, metallic):
        """A Principled BSDF of one kind, with the source's roughness and normal."""
        made = self.node("BsdfPrincipled")
        made.inputs["Metallic"].default_value = metallic
        made.inputs["Specular"].default_value = 0.5
        for name in ("Roughness", "Normal"):
            self.feed(name, made.inputs[name])
        if color is None:
            self.feed("Base Color", made.inputs["Base Color"])
        else:
            made.inputs["Base Color"].default_value = color
        return made.outputs[0]

    def diffuse(self):
        made, dim = self.node("BsdfDiffuse"), self.node("MixRGB")
        dim.blend_type = "MULTIPLY"
        dim.inputs["Fac"].default_value = 1
        dim.inputs["Color2"].default_value = (*[BELOW_SPECULAR] * 3, 1)
        self.feed("Base Color", dim.inputs["Color1"])
        self.feed("Normal", made.inputs["Normal"])
        self.tree.links.new(dim.outputs[0], made.inputs["Color"])
        return made.outputs[0]

    def add(self, first, second):
        made = self.node("AddShader")
        self.tree.links.new(first, made.inputs[0])
        self.tree.links.new(second, made.inputs[1])
        return made.outputs[0]

    def mix(self, first, second):
        """The mix's output, and its factor's input."""
        made = self.node("MixShader")
        self.tree.links.new(first, made.inputs[1])
        self.tree.links.new(second, made.inputs[2])
        return made.outputs[0], made.inputs["Fac"]

    def coated(self, below):
        coat, fresnel, share = self.node("BsdfGlossy"), self.node("Fresnel"), self.node("Math")
        coat.distribution = "GGX"
        coat.inputs["Color"].default_value = (1, 1, 1, 1)
        self.feed("Clearcoat Roughness", coat.inputs["Roughness"])
        fresnel.inputs["IOR"].default_value = 1.5
        share.operation = "MULTIPLY"
        self.tree.links.new(fresnel.outputs[0], share.inputs[0])
        self.feed("Clearcoat", share.inputs[1])
        shader, factor = self.mix(below, coat.outputs[0])
        self.tree.links.new(share.outputs[0], factor)
        return shader

    def surface(self):
        dielectric = self.add(self.diffuse(), self.lobes((0, 0, 0, 1), 0))
        shader, factor = self.mix(dielectric, self.lobes(None, 1))
        self.feed("Metallic", factor)
        return shader

    def rewire(self):
        if self.source.inputs["Transmission"].default_value > 0:
            return
        shader = self.surface()
        if self.source.inputs["Clearcoat"].default_value > 0:
            shader = self.coated(shader)
        emission = self.node("Emission")
        self.feed("Emission", emission.inputs["Color"])
        self.feed("Emission Strength", emission.inputs["Strength"])
        if emission.inputs["Color"].is_linked or any(emission.inputs["Color"].default_value[:3]):
            shader = self.add(shader, emission.outputs[0])
        shader, factor = self.mix(self.node("BsdfTransparent").outputs[0], shader)
        self.feed("Alpha", factor)
        output = next(n for n in self.tree.nodes if n.type == "OUTPUT_MATERIAL")
        self.tree.links.new(shader, output.inputs["Surface"])


def linear_picture(image):
    """The picture, decoded from sRGB, as floats."""
    pixels = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(pixels)
    color = pixels.reshape(-1, 4)[:, :3]
    color[:] = np.where(color < 0.04045, color / 12.92, ((color + 0.055) / 1.055) ** 2.4)
    made = bpy.data.images.new(f"{image.name} linear", *image.size, float_buffer=True, alpha=True)
    made.colorspace_settings.name = "Non-Color"
    made.alpha_mode = image.alpha_mode
    made.pixels.foreach_set(pixels)
    return made


def decode_pictures(tree):
    for node in tree.nodes:
        if node.type == "TEX_IMAGE" and node.image.colorspace_settings.name == "sRGB":
            node.image = linear_picture(node.image)


def rewire_all():
    for material in bpy.data.materials:
        if material.use_nodes and "Principled BSDF" in material.node_tree.nodes:
            decode_pictures(material.node_tree)
            Wiring(material).rewire()
