# SPDX-License-Identifier: Apache-2.0
"""The penumbra-encoder program, driven as the coordinator drives it: what comes in as sums and
counts must come out of each format as an independent reader (Debian's OpenImageIO) decodes it."""
import contextlib
import math
import os
import random
import socket
import struct
import subprocess
import tempfile

import OpenImageIO as oiio
import pytest
from farm import program

PNG, JPEG, EXR, HDR = range(4)
REQUEST = struct.Struct("=20Id72s96s")  # struct pen_encoding_request
COLOR, ALBEDO, NORMAL, DEPTH, SAMPLES = range(5)  # enum pen_layer
REPLY = struct.Struct("=Qi500s")  # struct pen_encoding_reply
SOCKET = 3


@contextlib.contextmanager
def encoder():
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)

    def take_socket():
        os.dup2(theirs.fileno(), SOCKET)

    process = subprocess.Popen([program("penumbra-encoder")], preexec_fn=take_socket,
                               pass_fds=[SOCKET])
    theirs.close()
    with ours:
        yield Encoder(ours, process)
        ours.shutdown(socket.SHUT_RDWR)
    assert process.wait(10) == 0


class Encoder:
    def __init__(self, link, process):
        self.link, self.process = link, process
        link.settimeout(30)

    def ask(self, request, framebuffer, output):
        """(code, text, size) of the reply."""
        socket.send_fds(self.link, [request], [framebuffer.fileno(), output.fileno()])
        size, code, text = REPLY.unpack(self.link.recv(REPLY.size))
        return code, text.split(b"\0")[0].decode(), size

    def encode(self, frame, image_format, final=True, exposure=0.0, **more):
        """The bytes of the file made from a frame."""
        with tempfile.TemporaryFile() as framebuffer, tempfile.TemporaryFile() as output:
            framebuffer.write(frame.bytes())
            framebuffer.flush()
            request = frame.request(image_format, final, exposure, **more)
            code, text, size = self.ask(request, framebuffer, output)
            assert (code, text) == (0, "")
            data = output.read()
            assert len(data) == size
            return data


class Frame:
    """A picture as the coordinator keeps it: a dict of (x, y) to (r, g, b, count).

    With layers each pixel goes on with sums of albedo, normal and depth, and the count of hits.
    """

    def __init__(self, width, height, crop=None, tile_px=16, seed=1, holes=0.0, layers=False):
        self.width, self.height, self.tile_px, self.layers = width, height, tile_px, layers
        self.crop = crop or (0, 0, width, height)
        values = random.Random(seed)
        self.pixels = {}
        for y in range(self.crop[1], self.crop[3]):
            for x in range(self.crop[0], self.crop[2]):
                count = 0 if values.random() < holes else values.choice([1, 3, 16, 64])
                sums = [single(values.uniform(0, 2) * count) for _ in range(3)]
                self.pixels[x, y] = (*sums, float(count))
                if layers:
                    self.pixels[x, y] += self.firsts(values, count)

    @staticmethod
    def firsts(values, count):
        hits = values.choice([0, count // 2, count])
        return (*(single(values.uniform(0, 1) * hits) for _ in range(3)),
                *(single(values.uniform(-1, 1) * hits) for _ in range(3)),
                single(values.uniform(1, 9) * hits), float(hits))

    def bytes(self):
        x0, y0, x1, y1 = self.crop
        px = self.tile_px
        out = bytearray()
        for ty in range(y0 // px * px, y1, px):
            for tx in range(x0 // px * px, x1, px):
                tile = [self.pixels[x, y] for y in range(max(ty, y0), min(ty + px, y1))
                        for x in range(max(tx, x0), min(tx + px, x1))]
                used = b"".join(struct.pack(f"<{len(pixel)}f", *pixel) for pixel in tile)
                # NaNs where nothing may be read
                out += used.ljust(px * px * (48 if self.layers else 16), b"\xff")
        return bytes(out)

    def request(self, image_format, final, exposure, layer=COLOR, content="", number=1,
                region=(0, 0, 0, 0), size=(0, 0)):
        planes, layers = (7, 31) if self.layers else (0, 1)
        return REQUEST.pack(image_format, final, self.width, self.height, *region, *size, *self.crop,
                            self.tile_px, planes, layers, layer, 64, number, exposure,
                            content.encode(), b"1/class" if content else b"")

    def layer(self, layer, x, y):
        """The values of a layer at a pixel, in single precision."""
        if layer == COLOR:
            return self.linear(x, y)
        pixel = self.pixels[x, y]
        if pixel[3] == 0:
            return (0.0,) * (3 if layer < DEPTH else 1)
        if layer == SAMPLES:
            return (pixel[3],)
        if layer == DEPTH:
            return (single(pixel[10] / pixel[11]) if pixel[11] else math.inf,)
        first = 4 if layer == ALBEDO else 7
        return tuple(single(s / pixel[3]) for s in pixel[first:first + 3])

    def linear(self, x, y):
        """The mean colour and alpha at a pixel, in single precision."""
        *sums, count = self.pixels.get((x, y), (0.0, 0.0, 0.0, 0.0))[:4]
        if count == 0:
            return (0.0, 0.0, 0.0, 0.0)
        return (*(single(s / count) for s in sums), 1.0)


def single(value):
    return struct.unpack("f", struct.pack("f", value))[0]


def srgb(linear, exposure):
    """IEC 61966-2-1, written from the standard and not from the program."""
    v = min(max(linear * 2.0 ** exposure, 0.0), 1.0)
    v = 12.92 * v if v <= 0.0031308 else 1.055 * v ** (1 / 2.4) - 0.055
    return v * 255


def decode(data, extension):
    """(spec, rows of pixels as tuples) by OpenImageIO."""
    with tempfile.NamedTemporaryFile(suffix="." + extension) as file:
        file.write(data)
        file.flush()
        source = oiio.ImageInput.open(file.name)
        spec = source.spec()
        pixels = source.read_image("float" if extension in ("exr", "hdr") else "uint8")
        source.close()
    return spec, pixels


@pytest.fixture(scope="module")
def shared():
    with encoder() as running:
        yield running


FRAMES = [Frame(1, 1), Frame(37, 21), Frame(64, 48, tile_px=32),
          Frame(70, 50, crop=(13, 5, 61, 44)), Frame(33, 40, holes=0.5)]
IDS = ["one pixel", "odd", "whole tiles", "crop", "holes"]


@pytest.mark.parametrize("frame", FRAMES, ids=IDS)
@pytest.mark.parametrize("final", [True, False])
def test_exr_holds_every_float_exactly(shared, frame, final):
    """Breaks if a float is rounded, a channel swapped, a tile misplaced, a window shifted."""
    spec, pixels = decode(shared.encode(frame, EXR, final), "exr")
    x0, y0, x1, y1 = frame.crop
    assert (spec.x, spec.y, spec.width, spec.height) == (x0, y0, x1 - x0, y1 - y0)
    assert (spec.full_width, spec.full_height) == (frame.width, frame.height)
    assert spec.channelnames == ("R", "G", "B", "A")
    for y in range(y0, y1):
        for x in range(x0, x1):
            assert tuple(pixels[y - y0][x - x0]) == frame.linear(x, y)


@pytest.mark.parametrize("frame", FRAMES, ids=IDS)
@pytest.mark.parametrize("exposure", [0.0, -3.5, 4.0])
def test_png_is_tone_mapped_to_the_nearest_code(shared, frame, exposure):
    """Breaks if curve, exposure, clamp or rounding is wrong, or the crop is not put in place."""
    spec, pixels = decode(shared.encode(frame, PNG, exposure=exposure), "png")
    opaque = frame.crop == (0, 0, frame.width, frame.height)
    assert (spec.width, spec.height) == (frame.width, frame.height)
    assert spec.nchannels == (3 if opaque else 4)
    for y in range(frame.height):
        for x in range(frame.width):
            *rgb, alpha = frame.linear(x, y)
            got = [int(v) for v in pixels[y][x]]
            for value, linear in zip(got, rgb):
                assert abs(value - srgb(linear, exposure)) <= 0.5001
            assert opaque or got[3] == 255 * alpha


def test_a_partial_png_is_transparent_where_nothing_is_rendered(shared):
    """Breaks if a picture in progress shows black for pixels that are only late."""
    frame = FRAMES[4]
    spec, pixels = decode(shared.encode(frame, PNG, final=False), "png")
    alphas = {(x, y): pixels[y][x][3] for y in range(frame.height) for x in range(frame.width)}
    assert spec.nchannels == 4
    assert alphas == {at: 255 * (count > 0) for at, (_, _, _, count) in frame.pixels.items()}
    assert set(alphas.values()) == {0, 255}


def mean(frame, x0, y0, x1, y1):
    """The mean of what is rendered of a rectangle, and 1; zeros when nothing is."""
    total, weight = [0.0] * 3, 0.0
    for y in range(math.floor(y0), math.ceil(y1)):
        for x in range(math.floor(x0), math.ceil(x1)):
            *rgb, alpha = frame.linear(x, y)
            share = alpha * (min(x + 1, x1) - max(x, x0)) * (min(y + 1, y1) - max(y, y0))
            total = [t + share * value for t, value in zip(total, rgb)]
            weight += share
    return ([t / weight for t in total], 1) if weight > 0 else (total, 0)


@pytest.mark.parametrize("frame", FRAMES, ids=IDS)
@pytest.mark.parametrize("size", [(1.0, 1.0), (0.5, 0.5), (0.4, 0.9), (0.0, 0.0)])
def test_a_region_is_the_mean_of_what_it_covers(shared, frame, size):
    """Breaks if a pixel at a border counts wrongly, the mean is one of codes and not of light, or
    what is not rendered makes it darker."""
    x0, y0 = frame.width // 5, frame.height // 4
    region = (x0, y0, frame.width, frame.height)
    across, down = frame.width - x0, frame.height - y0
    size = (max(1, int(size[0] * across)), max(1, int(size[1] * down)))
    data = shared.encode(frame, PNG, final=False, region=region, size=size)
    spec, pixels = decode(data, "png")
    assert (spec.width, spec.height, spec.nchannels) == (*size, 4)
    for v in range(size[1]):
        for u in range(size[0]):
            rgb, alpha = mean(frame, x0 + across * u / size[0], y0 + down * v / size[1],
                              x0 + across * (u + 1) / size[0], y0 + down * (v + 1) / size[1])
            *got, opaque = [int(value) for value in pixels[v][u]]
            assert opaque == 255 * alpha
            for value, linear in zip(got, rgb):
                assert abs(value - srgb(linear, 0.0)) <= 0.51


@pytest.mark.parametrize("more", [
    dict(region=(0, 0, 38, 5), size=(1, 1)), dict(region=(3, 3, 3, 4), size=(1, 1)),
    dict(region=(0, 0, 4, 4), size=(5, 1)), dict(region=(0, 0, 4, 4), size=(1, 0)),
    dict(region=(0, 0, 4, 4), size=(1, 5))])
def test_a_region_that_is_none_is_refused(shared, more):
    """Breaks if what the coordinator gets wrong makes the encoder read elsewhere."""
    frame = Frame(37, 21)
    with tempfile.TemporaryFile() as framebuffer, tempfile.TemporaryFile() as output:
        framebuffer.write(frame.bytes())
        framebuffer.flush()
        code, text, _ = shared.ask(frame.request(PNG, True, 0.0, **more), framebuffer, output)
        assert code < 0 and "not valid" in text


LAYERED = Frame(37, 21, crop=(2, 3, 37, 20), holes=0.2, layers=True)
CHANNELS = {COLOR: ("R", "G", "B", "A"), ALBEDO: ("albedo.R", "albedo.G", "albedo.B"),
            NORMAL: ("normal.X", "normal.Y", "normal.Z"), DEPTH: ("depth.Z",),
            SAMPLES: ("samples.X",)}


def test_exr_has_all_layers_by_name(shared):
    """Breaks if a layer has another's values or name, or a depth without hits is finite."""
    spec, pixels = decode(shared.encode(LAYERED, EXR), "exr")
    assert sorted(spec.channelnames) == sorted(sum(CHANNELS.values(), ()))
    x0, y0, x1, y1 = LAYERED.crop
    places = {layer: [spec.channelnames.index(name) for name in names]
              for layer, names in CHANNELS.items()}
    for y in range(y0, y1):
        for x in range(x0, x1):
            for layer, channels in places.items():
                found = tuple(float(pixels[y - y0][x - x0][c]) for c in channels)
                assert found == LAYERED.layer(layer, x, y)
    assert any(LAYERED.layer(DEPTH, x, y) == (math.inf,) for x, y in LAYERED.pixels)


@pytest.mark.parametrize("layer", [ALBEDO, NORMAL, DEPTH, SAMPLES])
def test_a_layer_alone_in_exr(shared, layer):
    """Breaks if it is scaled, or is not what a viewer takes for the image."""
    spec, pixels = decode(shared.encode(LAYERED, EXR, layer=layer), "exr")
    assert spec.channelnames == ("R", "G", "B", "A")
    x0, y0, x1, y1 = LAYERED.crop
    for (x, y), pixel in LAYERED.pixels.items():
        values = LAYERED.layer(layer, x, y)
        values = values * 3 if len(values) == 1 else values
        assert tuple(pixels[y - y0][x - x0]) == (*values, float(pixel[3] > 0))


@pytest.mark.parametrize("layer", [ALBEDO, NORMAL, DEPTH, SAMPLES])
def test_a_layer_alone_in_png(shared, layer):
    """Breaks if negative or infinite values do not show, or data get a curve that is for light."""
    shown = {ALBEDO: lambda v: srgb(v, 0), NORMAL: lambda v: 255 * (v / 2 + 0.5),
             DEPTH: lambda v: 255 / (1 + v), SAMPLES: lambda v: 255 * v / 64}[layer]
    _, pixels = decode(shared.encode(LAYERED, PNG, layer=layer), "png")
    for (x, y), pixel in LAYERED.pixels.items():
        values = LAYERED.layer(layer, x, y)
        values = values * 3 if len(values) == 1 else values
        wanted = [shown(v) for v in values] if pixel[3] > 0 else [0, 0, 0]
        *found, alpha = (int(v) for v in pixels[y][x])
        assert all(abs(a - b) <= 0.501 for a, b in zip(found, wanted))
        assert alpha == 255 * (pixel[3] > 0)


@pytest.mark.parametrize("image_format, extension", [(EXR, "exr"), (PNG, "png")])
def test_files_say_where_they_come_from(shared, image_format, extension):
    """Breaks if a file cannot be told apart from that of another request, class or version."""
    data = shared.encode(FRAMES[1], image_format, content="ab" * 32, number=7)
    spec, _ = decode(data, extension)
    said = {a.name: a.value for a in spec.extra_attribs}
    assert said["Software"].startswith("Penumbra ")
    assert {name: said[f"penumbra:{name}"] for name in ("content", "class", "samples", "frame")} \
        == {"content": "ab" * 32, "class": "1/class", "samples": "64", "frame": "7"}
    assert "DateTime" not in said and "HostComputer" not in said


def test_hdr_keeps_shared_exponent_precision(shared):
    """Breaks if values are clamped, tone-mapped or off by more than RGBE's eight bits."""
    frame = FRAMES[3]
    _, pixels = decode(shared.encode(frame, HDR), "hdr")
    for y in range(frame.height):
        for x in range(frame.width):
            *rgb, _ = frame.linear(x, y)
            step = max(rgb) / 128
            assert all(abs(a - b) <= step for a, b in zip(pixels[y][x], rgb))


def test_jpeg_is_close_to_the_png(shared):
    """Breaks if JPEG gets linear values or swapped channels; a smooth picture stays close."""
    frame = Frame(64, 64)
    for (x, y) in frame.pixels:
        frame.pixels[x, y] = (single(x / 64), single(y / 64), 0.25, 1.0)
    _, png = decode(shared.encode(frame, PNG), "png")
    _, jpeg = decode(shared.encode(frame, JPEG), "jpg")
    worst = max(abs(int(a) - int(b)) for rows in zip(png, jpeg) for p, q in zip(*rows)
                for a, b in zip(p, q))
    assert 0 < worst <= 8


@pytest.mark.parametrize("image_format", [PNG, JPEG, EXR, HDR])
def test_files_repeat_byte_for_byte(shared, image_format):
    """Breaks if a file holds a date, a process number or anything else that varies by run."""
    first = shared.encode(FRAMES[1], image_format)
    with encoder() as other:
        assert other.encode(FRAMES[1], image_format) == first


def test_the_encoder_is_confined(shared):
    """Breaks if it reads a request before it enters its sandbox (Seccomp: 2 is a filter)."""
    shared.encode(FRAMES[0], PNG)
    with open(f"/proc/{shared.process.pid}/status") as status:
        fields = dict(line.split(":\t", 1) for line in status.read().splitlines())
    assert (fields["Seccomp"], fields["NoNewPrivs"]) == ("2", "1")


def test_bright_and_dark_extremes(shared):
    """Breaks if a huge or tiny float turns into anything but white, black or itself."""
    frame = Frame(4, 1)
    values = [3e38, 1e-38, 0.0, 1.0]
    for x, value in enumerate(values):
        frame.pixels[x, 0] = (single(value),) * 3 + (1.0,)
    _, exr = decode(shared.encode(frame, EXR), "exr")
    _, png = decode(shared.encode(frame, PNG, exposure=60.0), "png")
    assert [float(p[0]) for p in exr[0]] == [single(v) for v in values]
    assert [int(p[0]) for p in png[0]] == [255, 0, 0, 255]


def bad_requests():
    frame = FRAMES[1]
    good = [PNG, 1, frame.width, frame.height, *[0] * 6, *frame.crop, 16, 0, 1, COLOR, 64, 1, 0.0, b"", b""]
    for index, value in [(0, 4), (2, 16385), (3, 0), (10, 37), (12, 38), (14, 0), (14, 24), (14, 272),
                         (16, 0), (16, 3), (16, 33), (17, SAMPLES), (17, 5), (18, 0),
                         (20, math.nan), (20, math.inf), (21, b"x" * 72), (22, b"x" * 96)]:
        yield REQUEST.pack(*good[:index], value, *good[index + 1:])


@pytest.mark.parametrize("request_bytes", bad_requests(), ids=lambda _: "")
def test_a_bad_request_is_answered_and_survived(shared, request_bytes):
    """Breaks if a number out of range reaches the arithmetic."""
    with tempfile.TemporaryFile() as framebuffer, tempfile.TemporaryFile() as output:
        code, text, _ = shared.ask(request_bytes, framebuffer, output)
    assert code < 0 and "not valid" in text


def test_a_short_framebuffer_is_an_error(shared):
    """Breaks if reading past the file's end yields pixels, or ends the program."""
    frame = FRAMES[1]
    with tempfile.TemporaryFile() as framebuffer, tempfile.TemporaryFile() as output:
        framebuffer.write(frame.bytes()[:-1])
        framebuffer.flush()
        code, text, _ = shared.ask(frame.request(PNG, True, 0.0), framebuffer, output)
    assert code < 0 and "too short" in text


@pytest.mark.parametrize("image_format", [PNG, JPEG, EXR, HDR])
def test_a_full_disk_is_told(shared, image_format):
    """Breaks if a failed write passes as a finished file."""
    frame = FRAMES[1]
    with tempfile.TemporaryFile() as framebuffer, open("/dev/full", "r+b", buffering=0) as output:
        framebuffer.write(frame.bytes())
        framebuffer.flush()
        code, text, _ = shared.ask(frame.request(image_format, True, 0.0), framebuffer, output)
    assert code == -10 and "No space left" in text
