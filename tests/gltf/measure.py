# SPDX-License-Identifier: Apache-2.0
"""Flat shapes seen along -Z by a camera of parallel rays, measured in the units of the asset."""
import pathlib
import tempfile

import image
import numpy as np

HALF = 2.0  # of what the view shows, along each axis


def viewed(asset, **node):
    """Adds the camera: what the image shows is the square of HALF about the origin."""
    camera = asset.add("cameras", {"type": "orthographic", "orthographic": {
        "xmag": HALF, "ymag": HALF, "znear": 0.01, "zfar": 100}})
    return asset.node(camera=camera, **{"translation": [0, 0, 10], **node})


def moments(pixels, channel=0):
    """Area and centre of what one colour shows, the background being black."""
    side = len(pixels)
    covered = pixels[:, :, channel]
    y, x = np.indices((side, side))
    total = covered.sum()
    assert total > 0
    center = [(covered * axis).sum() / total
              for axis in ((x + 0.5) * 2 * HALF / side - HALF, HALF - (y + 0.5) * 2 * HALF / side)]
    return total * (2 * HALF / side) ** 2, np.array(center)


def polygon(points):
    """Area and centre of a polygon, by the shoelace formula."""
    a = np.asarray(points, float)[:, :2]
    b = np.roll(a, -1, 0)
    cross = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    return abs(cross.sum() / 2), ((a + b) * cross[:, None]).sum(0) / (3 * cross.sum())


def square(center=(0, 0), half=0.25):
    """The corners of a square in the plane z = 0, counter-clockwise."""
    x, y = center
    return np.array([[x - half, y - half, 0], [x + half, y - half, 0], [x + half, y + half, 0],
                     [x - half, y + half, 0]])


QUAD = [0, 1, 2, 0, 2, 3]
RED, GREEN, BLUE = np.eye(3)


def close(found, expected, tolerance=0.004):
    """Whether area and centre are those expected, to a sixteenth of a pixel."""
    (area, center), (wanted, place) = found, expected
    return abs(area - wanted) <= 0.01 * wanted and np.abs(center - place).max() <= tolerance


def png(texels):
    """The bytes of a PNG of height x width x 3 bytes."""
    with tempfile.TemporaryDirectory() as directory:
        path = pathlib.Path(directory) / "texels.png"
        image.write_file(path, np.asarray(texels) / 255, "uint8")
        return path.read_bytes()


def texture(asset, texels, **sampler):
    """Adds a picture within the file, and its use."""
    source = asset.add("images", {"mimeType": "image/png", "bufferView": asset.view(png(texels))})
    use = {"source": source}
    if sampler:
        use["sampler"] = asset.add("samplers", sampler)
    return asset.add("textures", use)
