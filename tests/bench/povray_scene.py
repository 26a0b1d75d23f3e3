# SPDX-License-Identifier: Apache-2.0
"""A scene of the format as text for POV-Ray 3.7, for the parts that POV-Ray can express.

Each camera sample is one blur sample of the focal blur camera (a pinhole gets an aperture of 1e-6),
each area light a jittered grid of 2 x 2. Gloss and motion have no counterpart, nor has the light of
the background, so that its rays are fewer than ours. Radiance becomes the colour of an area light
that fades with distance: close enough for a comparison of speed.
"""
import math


class NotExpressible(Exception):
    pass


def _vector(v):
    return "<{:.9g},{:.9g},{:.9g}>".format(*v)


def _texture(spec):
    color = "rgb " + _vector(spec["color"])
    if spec["type"] == "matte":
        return f"texture {{ pigment {{ {color} }} finish {{ ambient 0 diffuse 1 }} }}"
    if spec["type"] == "glass" and spec.get("roughness", 0) == 0:
        return (f"texture {{ pigment {{ {color} transmit 1 }} finish {{ ambient 0 diffuse 0"
                f" reflection {{ 0 1 fresnel on }} conserve_energy }} }}"
                f" interior {{ ior {spec['ior']} }}")
    raise NotExpressible(f"{spec['type']} of this roughness")


def _object(item, textures):
    if "keyframes" in item:
        raise NotExpressible("motion")
    texture = textures[item["material"]]
    if item["type"] == "sphere":
        return f"sphere {{ {_vector(item['center'])}, {item['radius']} {texture} }}"
    corners = [_vector(item["vertices"][i]) for i in item["indices"]]
    triangles = (f"triangle {{ {a}, {b}, {c} }}" for a, b, c in zip(*[iter(corners)] * 3))
    return f"mesh {{ {' '.join(triangles)} {texture} }}"


def _light(light):
    if light["type"] == "rectangle":
        corner, u, v = light["corner"], light["edge_u"], light["edge_v"]
    elif light["type"] == "triangle":
        corner, second, third = light["vertices"]
        u, v = ([b - a for a, b in zip(corner, other)] for other in (second, third))
    else:
        raise NotExpressible(f"{light['type']} light")
    middle = [c + (a + b) / 2 for c, a, b in zip(corner, u, v)]
    cross = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]
    strength = math.sqrt(sum(c * c for c in cross)) / math.pi
    color = [strength * r / 2 for r in light["radiance"]]
    return (f"light_source {{ {_vector(middle)} rgb {_vector(color)} area_light {_vector(u)},"
            f" {_vector(v)}, 2, 2 jitter fade_distance 1 fade_power 2 }}")


def text(doc, samples):
    """The .pov file; NotExpressible names what POV-Ray lacks."""
    camera, image = doc["camera"], doc["image"]
    if "shutter" in camera:
        raise NotExpressible("a shutter")
    textures = {name: None for name in doc["materials"]}
    for name, spec in doc["materials"].items():
        textures[name] = _texture(spec)
    aspect = image["width"] / image["height"]
    away = [t - p for t, p in zip(camera["look_at"], camera["position"])]
    length = math.sqrt(sum(a * a for a in away))
    distance = camera.get("focus_distance", length)
    focus = [p + a * distance / length for p, a in zip(camera["position"], away)]
    aperture = max(2 * camera.get("aperture_radius", 0), 1e-6)
    return "\n".join([
        "#version 3.7;",
        f"global_settings {{ assumed_gamma 1 max_trace_level {doc['integrator']['max_depth']} }}",
        f"background {{ rgb {_vector(doc['background']['color'])} }}",
        f"camera {{ perspective location {_vector(camera['position'])} up y right -x*{aspect}",
        f"  angle {camera['horizontal_fov']} sky {_vector(camera.get('up', [0, 1, 0]))}",
        f"  look_at {_vector(camera['look_at'])} focal_point {_vector(focus)} aperture {aperture}",
        f"  blur_samples {samples} variance 0 confidence 0.999 }}",
        *(_light(light) for light in doc["lights"]),
        *(_object(item, textures) for item in doc["objects"]), ""])
