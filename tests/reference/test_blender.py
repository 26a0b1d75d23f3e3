# SPDX-License-Identifier: Apache-2.0
"""Scenes that Blender exported as GLB, against Cycles' images of them.

tests/reference/blender/make.py made all of them: the GLB by Blender's own exporter, and two images
by Cycles. models/NAME.exr has glTF's model of surfaces, wired of Cycles' nodes: it is held to
narrow limits. images/NAME.exr is the scene as Blender has it, with the Principled BSDF of Blender
3.4, which is not the model that its exporter writes: WIDER names what differs.
"""
import json
import pathlib
import subprocess

import compare
import farm
import image
import pytest

HERE = pathlib.Path(__file__).resolve().parent / "blender"
LIMITS = {"mean": 0.015, "p99": 0.08, "max": 0.3}


def wider(mean, p99, largest=LIMITS["max"]):
    return {"mean": mean, "p99": p99, "max": largest}


# Against glTF's model. Cycles weighs reflection and refraction of rough glass by Fresnel's term at the
# surface's normal, Penumbra at each facet, as Walter and others 2007: at the rim Cycles' returns
# more.
MODEL_WIDER = {"transmission": wider(0.015, 0.14)}

# Against Cycles' own model the limits are wider, for two differences in every rough dielectric.
# Blender's specular layer takes nothing from the diffuse base below it, glTF's at least 4 %: that
# much brighter is everything there. And its diffuse lobe is Burley's: at a roughness of 0.9 up to
# 2.3 times Lambert's for a grazing view, and again for grazing light. Scenes with more of either
# have more room.
WIDER = {
    "alpha": wider(0.06, 0.16),
    "clearcoat": wider(0.05, 0.14),  # and its coat has a quarter of glTF's strength
    "emissive": wider(0.12, 0.32, 0.35),  # a room of roughness 1, whose light goes on
    "environment": wider(0.06, 0.17),
    "instances": wider(0.07, 0.12),
    "lens": wider(0.08, 0.24),
    "many_lights": wider(0.1, 0.22),  # bulbs low above a floor of roughness 1
    "morph": wider(0.08, 0.24),
    "normal_map": wider(0.065, 0.19),
    "rigid_motion": wider(0.08, 0.21),
    "skin": wider(0.08, 0.24),
    "spots": wider(0.065, 0.36, 0.55),  # little but a floor of roughness 1 at slanting light
    "textures": wider(0.055, 0.18),  # and texels are interpolated as sRGB, not as light
    "transmission": wider(0.09, 0.22),  # and the rough glass of MODEL_WIDER
}

NAMES = ["alpha", "clearcoat", "emissive", "environment", "instances", "lens", "many_lights",
         "morph", "normal_map", "rigid_motion", "skin", "spots", "textures", "transmission"]


def render(name, directory):
    output = directory / f"{name}.exr"
    subprocess.run([farm.program("penumbra"), "render", HERE / "scenes" / f"{name}.json",
                    "-o", output, "--quiet"], check=True, timeout=120 * farm.SLOW)
    return image.read_file(output)


@pytest.fixture(scope="module")
def rendered(tmp_path_factory):
    """name -> image, each rendered once."""
    images = {}

    def get(name):
        if name not in images:
            images[name] = render(name, tmp_path_factory.mktemp(name))
        return images[name]
    return get


def compare_to(pixels, path, limits):
    figures, worst = compare.difference(pixels, image.read_file(path))
    print(path.name, figures, worst)
    for figure, limit in limits.items():
        assert figures[figure] <= limit, f"{figure} {figures[figure]:.4f} > {limit}, worst {worst}"


@pytest.mark.parametrize("name", NAMES)
def test_agrees_with_the_model_in_cycles(name, rendered):
    """Broken by whatever is read from the GLB otherwise than Blender meant it, or looks otherwise.
    """
    compare_to(rendered(name), HERE / "models" / f"{name}.exr",
               {**LIMITS, **MODEL_WIDER.get(name, {})})


@pytest.mark.parametrize("name", NAMES)
def test_looks_as_in_blender(name, rendered):
    """Broken by a surface whose look departs from Blender's by more than the models' difference."""
    compare_to(rendered(name), HERE / "images" / f"{name}.exr", {**LIMITS, **WIDER.get(name, {})})


def test_all_scenes_are_compared():
    """Broken by a scene, a GLB or an image that was lost, or is not in the list above."""
    for directory, suffix in (("scenes", "json"), ("scenes", "glb"), ("images", "exr"),
                              ("models", "exr")):
        found = sorted(path.stem for path in (HERE / directory).glob(f"*.{suffix}"))
        assert found == NAMES, directory
    for name in NAMES:
        scene = json.loads((HERE / "scenes" / f"{name}.json").read_text())
        assert scene["objects"] == [{"type": "gltf", "asset": f"{name}.glb"}]
