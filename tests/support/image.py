# SPDX-License-Identifier: Apache-2.0
"""Image files to arrays and back (Debian's python3-openimageio and python3-numpy)."""
import os
import tempfile

import numpy as np
import OpenImageIO as oiio


def read_file(path, channels="RGB"):
    """Some channels of a file, R, G and B, as float32[height, width, n] (EXR: of its data window)."""
    source = oiio.ImageInput.open(str(path))
    if source is None:
        raise ValueError(f"{path}: {oiio.geterror()}")
    spec = source.spec()
    names = [name.upper() for name in spec.channelnames]
    pixels = np.asarray(source.read_image("float"), dtype=np.float32)
    source.close()
    pixels = pixels.reshape(spec.height, spec.width, spec.nchannels)
    return pixels[:, :, [names.index(channel.upper()) for channel in channels]]


def read(data, extension="exr"):
    """As read_file, of a file's bytes."""
    handle, path = tempfile.mkstemp(suffix="." + extension)
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(data)
        return read_file(path)
    finally:
        os.unlink(path)


def write_file(path, pixels, kind="float", **attributes):
    """Writes float[height, width, 3]; kind is the format of the samples in the file."""
    height, width, channels = pixels.shape
    spec = oiio.ImageSpec(width, height, channels, kind)
    for name, value in attributes.items():
        spec.attribute(name, value)
    target = oiio.ImageOutput.create(str(path))
    if target is None or not target.open(str(path), spec):
        raise ValueError(f"{path}: {oiio.geterror()}")
    written = target.write_image(np.ascontiguousarray(pixels, dtype=np.float32))
    target.close()
    if not written:
        raise ValueError(f"{path}: {target.geterror()}")


def luminance(pixels):
    return pixels @ np.array([0.2126, 0.7152, 0.0722], dtype=pixels.dtype)
