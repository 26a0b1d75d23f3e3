# SPDX-License-Identifier: Apache-2.0
"""Images made to harm whoever decodes them: (name, bytes, verdict), each the same every time.

The verdict is "refused" or "decoded" where only one is right, else None.
"""
import random
import struct
import zlib

import image
import numpy as np

SIDE, LONG = 16384, 4096  # together the most pixels that are accepted


# PNG

def chunk(name, content=b"", length=None, crc=None):
    length = len(content) if length is None else length
    crc = zlib.crc32(name + content) if crc is None else crc
    return struct.pack(">I", length) + name + content + struct.pack(">I", crc)


def ihdr(width=8, height=8, depth=8, color=2, compression=0, method=0, interlace=0):
    return chunk(b"IHDR", struct.pack(">2I5B", width, height, depth, color, compression, method,
                                      interlace))


def png(*chunks, end=True):
    return b"\x89PNG\r\n\x1a\n" + b"".join(chunks) + (chunk(b"IEND") if end else b"")


def rows(width=8, height=8, bits=24, method=0):
    row = bytes([method]) + bytes(i * 37 % 256 for i in range((width * bits + 7) // 8))
    return row * height


def idat(raw, level=9):
    return chunk(b"IDAT", zlib.compress(raw, level))


def bomb(mebibytes):
    """As much of zeros, deflated."""
    deflate = zlib.compressobj(9)
    return b"".join(deflate.compress(bytes(1 << 20)) for _ in range(mebibytes)) + deflate.flush()


def pngs():
    body = idat(rows())
    palette = chunk(b"PLTE", bytes(range(6)))
    yield "rgb", png(ihdr(), body), "decoded"
    yield "rgba", png(ihdr(color=6), idat(rows(bits=32))), "decoded"
    yield "grey and alpha", png(ihdr(color=4), idat(rows(bits=16))), "decoded"
    yield "16 bits", png(ihdr(depth=16), idat(rows(bits=48))), "decoded"
    yield "1 bit", png(ihdr(depth=1, color=0), idat(rows(bits=1))), "decoded"
    yield "palette", png(ihdr(color=3), chunk(b"PLTE", bytes(768)), idat(rows(bits=8))), "decoded"
    yield "interlaced", png(ihdr(interlace=1), idat(rows(12, 30))), None
    for width, height in ((0, 8), (8, 0), (65535, 65535), (2**31 - 1, 1), (2**31, 8), (2**32 - 1,) * 2,
                          (SIDE + 1, 1), (SIDE, LONG + 1)):
        yield f"{width}x{height}", png(ihdr(width, height), body), "refused"
    yield "large of nothing", png(ihdr(SIDE, LONG), body), "refused"
    yield "large of zeros", png(ihdr(LONG, LONG), chunk(b"IDAT", bomb(49))), None
    yield "large and interlaced of nothing", png(ihdr(SIDE, LONG, interlace=1), body), "refused"
    yield "bomb in IDAT", png(ihdr(), chunk(b"IDAT", bomb(1024))), None
    yield "bomb in zTXt", png(ihdr(), chunk(b"zTXt", b"Comment\0\0" + bomb(512)), body), "decoded"
    yield "bomb in iTXt", png(ihdr(), chunk(b"iTXt", b"C\0\1\0\0\0" + bomb(512)), body), "decoded"
    yield "bomb in iCCP", png(ihdr(), chunk(b"iCCP", b"P\0\0" + bomb(512)), body), "decoded"
    yield "no IDAT", png(ihdr()), "refused"
    yield "no IHDR", png(body), "refused"
    yield "two IHDR", png(ihdr(), ihdr(4096, 4096), body), None
    yield "no IEND", png(ihdr(), body, end=False), None
    yield "signature alone", png(end=False), "refused"
    yield "IDAT is no deflate", png(ihdr(), chunk(b"IDAT", b"\xff" * 400)), "refused"
    yield "IDAT is cut", png(ihdr(), chunk(b"IDAT", zlib.compress(rows())[:12])), "refused"
    yield "many empty IDAT", png(ihdr(), chunk(b"IDAT") * 20000, body), None
    yield "many tEXt", png(ihdr(), chunk(b"tEXt", b"a\0b") * 20000, body), "decoded"
    yield "unknown and critical", png(ihdr(), chunk(b"ABCD", b"x"), body), "refused"
    yield "unknown and safe", png(ihdr(), chunk(b"abcd", b"x"), body), "decoded"
    for method in (1, 2, 3, 4, 5, 255):
        yield f"filter {method}", png(ihdr(), idat(rows(method=method))), None
    for depth, color in ((3, 0), (4, 2), (0, 0), (32, 2), (8, 5), (8, 255), (16, 3)):
        yield f"depth {depth} of type {color}", png(ihdr(depth=depth, color=color), body), "refused"
    yield "compression 1", png(ihdr(compression=1), body), "refused"
    yield "filter method 1", png(ihdr(method=1), body), None
    yield "interlace 2", png(ihdr(interlace=2), body), "refused"
    yield "no PLTE", png(ihdr(color=3), idat(rows(bits=8))), "refused"
    yield "short PLTE", png(ihdr(color=3), palette, idat(rows(bits=8))), None
    yield "empty PLTE", png(ihdr(color=3), chunk(b"PLTE"), idat(rows(bits=8))), "refused"
    yield "PLTE of 4 bytes", png(ihdr(color=3), chunk(b"PLTE", b"abcd"), idat(rows(bits=8))), None
    yield "PLTE of 300", png(ihdr(color=3), chunk(b"PLTE", bytes(900)), idat(rows(bits=8))), None
    yield "long tRNS", png(ihdr(color=3), palette, chunk(b"tRNS", bytes(300)),
                           idat(rows(bits=8))), None
    yield "tRNS of RGBA", png(ihdr(color=6), chunk(b"tRNS", bytes(6)), idat(rows(bits=32))), None
    yield "gAMA 0", png(ihdr(), chunk(b"gAMA", bytes(4)), body), None
    yield "cHRM 0", png(ihdr(), chunk(b"cHRM", bytes(32)), body), None
    yield "pHYs 0", png(ihdr(), chunk(b"pHYs", bytes(9)), body), None
    yield "sBIT 255", png(ihdr(), chunk(b"sBIT", b"\xff\xff\xff"), body), None
    for name, exif in exifs():
        yield f"eXIf {name}", png(ihdr(), chunk(b"eXIf", exif), body), "decoded"
    for length in (0, 12, 14, 2**31 - 1, 2**32 - 1):
        content = struct.pack(">2I5B", 8, 8, 8, 2, 0, 0, 0)
        yield f"IHDR of {length}", png(chunk(b"IHDR", content, length), body), "refused"
    for length in (2**31 - 1, 2**32 - 1):
        yield f"IDAT of {length}", png(ihdr(), chunk(b"IDAT", b"abc", length)), "refused"
    yield "wrong CRC", png(ihdr(), chunk(b"IDAT", zlib.compress(rows()), crc=1)), None


def exifs():
    """TIFF directories, which go with PNG and JPEG alike."""
    def directory(*entries, follow=0):
        return (struct.pack("<H", len(entries)) + b"".join(struct.pack("<2H2I", *e) for e in entries)
                + struct.pack("<I", follow))

    head = b"II*\0\x08\0\0\0"
    yield "of itself", head + directory((0x8769, 4, 1, 8))
    yield "in a circle", head + directory((0x8769, 4, 1, 26)) + directory((0xa005, 4, 1, 8))
    yield "followed by itself", head + directory((0x100, 4, 1, 1), follow=8)
    yield "beyond the end", b"II*\0\xf0\xff\xff\xff"
    yield "of huge counts", head + directory(*((tag, 5, 2**31 + 7, 8) for tag in range(0x100, 0x140)))
    yield "of 65535 entries", head + struct.pack("<H", 65535)
    yield "of strings at the end", head + directory(*((tag, 2, 4000, 2**32 - 8)
                                                      for tag in (0x10e, 0x10f, 0x110)))
    yield "of nothing", b""


# JPEG

def jpeg_base(folder):
    path = folder / "base.jpg"
    y, x = np.mgrid[:24, :40] / 40.0
    image.write_file(path, np.stack([x, y, x * y], 2), "uint8")
    return path.read_bytes()


def segments(content):
    """Marker and body of each segment; the last one has the scan's data too."""
    at, found = 2, []
    while content[at + 1] != 0xda:
        length = struct.unpack_from(">H", content, at + 2)[0]
        found.append((content[at + 1], content[at + 4:at + 2 + length]))
        at += 2 + length
    return found, content[at:]


def segment(marker, body=b"", length=None):
    return bytes([0xff, marker]) + struct.pack(">H", len(body) + 2 if length is None else length) + body


def is_frame(marker):
    return 0xc0 <= marker <= 0xcf and marker not in (0xc4, 0xc8, 0xcc)


class Jpeg:
    def __init__(self, content):
        self.content = content
        self.segments, self.scan = segments(content)

    def frame(self):
        return next(body for marker, body in self.segments if is_frame(marker))

    def edited(self, edit, scan=None, before=b""):
        """edit(marker, body) gives the segment's bytes, None to keep it."""
        parts = []
        for marker, body in self.segments:
            new = edit(marker, body)
            parts.append(segment(marker, body) if new is None else new)
        return b"\xff\xd8" + before + b"".join(parts) + (self.scan if scan is None else scan)

    def framed(self, change, marker=None):
        """With another frame header: change(body) edits a bytearray of it."""
        def edit(found, body):
            if not is_frame(found):
                return None
            body = bytearray(body)
            change(body)
            return segment(found if marker is None else marker, bytes(body))
        return self.edited(edit)

    def without(self, *markers):
        return self.edited(lambda marker, _: b"" if marker in markers else None)


def put(at, *values):
    def change(body):
        body[at:at + len(values)] = bytes(values)
    return change


def progressive(width, height, scans):
    """A frame of scans that refine nothing, of hardly any bytes."""
    table = segment(0xc4, b"\0" + b"\1" + bytes(15) + b"\0" + b"\x10" + b"\1" + bytes(15) + b"\0")
    quant = segment(0xdb, b"\0" + b"\1" * 64)
    frame = segment(0xc2, struct.pack(">B2HB", 8, height, width, 1) + b"\1\x11\0")
    first = segment(0xda, b"\1\1\0\0\0\0") + bytes(40)
    more = segment(0xda, b"\1\1\0\1\x3f\0") + bytes(8)
    return b"\xff\xd8" + quant + frame + table + first + more * (scans - 1) + b"\xff\xd9"


def jpegs(folder):
    base = Jpeg(jpeg_base(folder))
    head = base.scan[:14]
    keep = lambda *_: None
    yield "good", base.content, "decoded"
    for name, change in (("0 wide", put(3, 0, 0)), ("0 high", put(1, 0, 0)),
                         ("65535x65535", put(1, *b"\xff" * 4)), ("0 components", put(5, 0)),
                         ("255 components", put(5, 255)), ("samplings 0", put(7, 0)),
                         ("precision 0", put(0, 0))):
        yield name, base.framed(change), "refused"
    for name, change in (("16384x4096 of nothing", put(1, 0x10, 0, 0x40, 0)),
                         ("12 bits", put(0, 12)), ("5 components", put(5, 5)), ("2 components", put(5, 2)),
                         ("samplings 15", put(7, 0xff)), ("samplings 1 and 4", put(7, 0x14)),
                         ("table 255", put(8, 255)), ("one component twice", put(9, base.frame()[6]))):
        yield name, base.framed(change), None
    for marker in (0xc1, 0xc2, 0xc3, 0xc5, 0xc9, 0xca, 0xcb, 0xcf):
        yield f"frame of type {marker:x}", base.framed(lambda body: None, marker), None
    yield "no tables of codes", base.without(0xc4), None
    yield "no quantisation", base.without(0xdb), None
    yield "no frame", base.without(*range(0xc0, 0xc4)), "refused"
    yield "two frames", base.edited(lambda m, b: segment(m, b) * 2 if is_frame(m) else None), "refused"
    yield "codes overfull", base.edited(
        lambda m, b: segment(m, b[:1] + b"\xff" * 16 + b[17:]) if m == 0xc4 else None), None
    yield "codes of table 255", base.edited(
        lambda m, b: segment(m, b"\xff" + b[1:]) if m == 0xc4 else None), None
    yield "quantisation of 0", base.edited(
        lambda m, b: segment(m, b[:1] + bytes(len(b) - 1)) if m == 0xdb else None), None
    for length in (0, 1, 2, 65535):
        yield f"segments of {length}", base.edited(
            lambda m, b, length=length: segment(m, b, length) if m == 0xdb else None), None
    yield "restarts everywhere", base.edited(keep, head + bytes(
        [0xff, 0xd0]) * 4000 + b"\xff\xd9", segment(0xdd, b"\0\1")), None
    yield "scan of 0 components", base.edited(keep, segment(0xda, b"\0\0\x3f\0") + bytes(99)), None
    yield "scan of 5", base.edited(keep, segment(0xda, b"\5" + b"\1\0" * 5 + b"\0\x3f\0")), None
    yield "scan of strangers", base.edited(keep, segment(0xda, b"\1\x77\0\0\x3f\0") + bytes(99)), None
    yield "scan from 63 to 1", base.edited(keep, segment(0xda, b"\1\1\0\x3f\1\xff") + bytes(9)), None
    for cut in (3, 20, 100, 200, len(base.content) // 2, len(base.content) - 3):
        yield f"cut at {cut}", base.content[:cut], None
    for name, exif in exifs():
        yield f"exif {name}", base.edited(keep, before=segment(0xe1, b"Exif\0\0" + exif)), "decoded"
    for name, body in (("ICC part 0 of 0", b"ICC_PROFILE\0\0\0"), ("ICC part 9 of 1",
                       b"ICC_PROFILE\0\x09\1" + bytes(99)), ("ICC of 255", b"ICC_PROFILE\0\1\xff")):
        yield name, base.edited(keep, before=segment(0xe2, body)), "decoded"
    yield "IPTC", base.edited(keep, before=segment(
        0xed, b"Photoshop 3.0\0" + b"8BIM\4\4\0\0\xff\xff\xff\xff" + b"\x1c\2\x05\xff\xff")), "decoded"
    yield "XMP", base.edited(keep, before=segment(
        0xe1, b"http://ns.adobe.com/xap/1.0/\0" + b"<a>" * 20000)), "decoded"
    yield "Adobe 255", base.edited(keep, before=segment(0xee, b"Adobe\0\x64" + b"\xff" * 5)), None
    yield "64 scans of 16384x4096", progressive(SIDE, LONG, 64), None
    yield "65 scans", progressive(8, 8, 65), "refused"


# EXR

def attribute(name, kind, value, size=None):
    size = len(value) if size is None else size
    return name + b"\0" + kind + b"\0" + struct.pack("<I", size & 0xffffffff) + value


def channel(name, kind=2, x=1, y=1):
    return name + b"\0" + struct.pack("<4I", kind, 0, x, y)


RGB = channel(b"B") + channel(b"G") + channel(b"R")


def exr(width=4, height=2, *, channels=RGB, compression=0, window=None, display=None, order=0,
        more=b"", flags=0, version=2, offsets=None, body=None, without=()):
    """Uncompressed scan lines of floats, whatever the header says."""
    window = window or (0, 0, width - 1, height - 1)
    header = {
        "channels": attribute(b"channels", b"chlist", channels + b"\0"),
        "compression": attribute(b"compression", b"compression", bytes([compression])),
        "dataWindow": attribute(b"dataWindow", b"box2i", struct.pack("<4i", *window)),
        "displayWindow": attribute(b"displayWindow", b"box2i", struct.pack("<4i", *(display or window))),
        "lineOrder": attribute(b"lineOrder", b"lineOrder", bytes([order])),
        "pixelAspectRatio": attribute(b"pixelAspectRatio", b"float", struct.pack("<f", 1)),
        "screenWindowCenter": attribute(b"screenWindowCenter", b"v2f", bytes(8)),
        "screenWindowWidth": attribute(b"screenWindowWidth", b"float", struct.pack("<f", 1)),
    }
    head = (b"\x76\x2f\x31\x01" + struct.pack("<I", version | flags)
            + b"".join(value for name, value in header.items() if name not in without) + more + b"\0")
    line = bytes(range(1, 12 * width + 1)) if width < 20 else bytes(12 * width)
    lines = [struct.pack("<iI", y, len(line)) + line for y in range(height)]
    start = len(head) + 8 * height
    if offsets is None:
        offsets = [start + y * len(lines[0]) for y in range(height)]
    table = b"".join(struct.pack("<Q", offset & (2**64 - 1)) for offset in offsets)
    return head + table + (b"".join(lines) if body is None else body)


def tiles(x, y, mode=0):
    return attribute(b"tiles", b"tiledesc", struct.pack("<2IB", x, y, mode))


def exrs(folder):
    dice = random.Random(3)
    noise = dice.randbytes(5000)
    yield "good", exr(), "decoded"
    for number in range(1, 10):
        yield f"compression {number} of noise", exr(64, 32, compression=number, body=b"".join(
            struct.pack("<iI", y, 120) + noise[y:y + 120] for y in range(32))), None
    yield "compression 255", exr(compression=255), "refused"
    yield "line order 9", exr(order=9), None
    for name, window in (("huge", (-2**31, -2**31, 2**31 - 1, 2**31 - 1)), ("backwards", (3, 3, 0, 0)),
                         ("65536 wide", (0, 0, 65535, 0)), ("16384x4097", (0, 0, SIDE - 1, LONG))):
        yield f"window {name}", exr(window=window), "refused"
    yield "window far out", exr(window=(2**31 - 5, 0, 2**31 - 2, 1)), None
    yield "window of the lowest", exr(window=(-2**31, -2**31, -2**31 + 3, -2**31 + 1)), None
    yield "16384x4096 of nothing", exr(window=(0, 0, SIDE - 1, LONG - 1)), "refused"
    yield "display of everything", exr(display=(-2**31, -2**31, 2**31 - 1, 2**31 - 1)), None
    yield "display backwards", exr(display=(9, 9, 0, 0)), None
    yield "no channels", exr(channels=b""), "refused"
    yield "65 channels", exr(channels=b"".join(channel(b"c%03d" % i) for i in range(65))), "refused"
    yield "4000 channels", exr(channels=b"".join(channel(b"c%04d" % i) for i in range(4000))), "refused"
    yield "channels twice", exr(channels=RGB + RGB), None
    yield "a name of 300", exr(channels=channel(b"R" * 300)), None
    yield "samplings 0", exr(channels=channel(b"R", x=0, y=0)), "refused"
    yield "samplings 2", exr(channels=channel(b"B", x=2, y=2) + channel(b"G") + channel(b"R")), None
    yield "samplings 2^31", exr(channels=channel(b"R", x=2**31, y=2**31)), "refused"
    yield "type 3", exr(channels=channel(b"R", kind=3)), "refused"
    yield "whole numbers", exr(channels=channel(b"B", 0) + channel(b"G", 0) + channel(b"R", 0)), None
    yield "channels without an end", exr(without=("channels",),
                                         more=attribute(b"channels", b"chlist", RGB)), None
    for x, y, mode in ((0, 0, 0), (2**31, 2**31, 0), (SIDE, SIDE, 0), (1, 1, 1), (64, 64, 2),
                       (64, 64, 15), (8, 8, 0x21)):
        yield f"tiles of {x}x{y}, mode {mode}", exr(more=tiles(x, y, mode), flags=0x200), None
    yield "tiles unsaid", exr(flags=0x200), None
    yield "tiles in lines", exr(more=tiles(8, 8)), None
    yield "one tile a texel of 4096x4096", exr(window=(0, 0, 4095, 4095), more=tiles(1, 1),
                                               flags=0x200), None
    for name, offsets in (("0", [0, 0]), ("2^63", [2**63] * 2), ("2^64 - 1", [2**64 - 1] * 2),
                          ("the header", [4, 4]), ("none", [])):
        yield f"offsets {name}", exr(offsets=offsets), "refused" if name.startswith("2^") else None
    for name, body in (("none", b""), ("of size 2^31", struct.pack("<iI", 0, 2**31)),
                       ("of size -1", struct.pack("<iI", 0, 2**32 - 1) + bytes(90)),
                       ("of line 2^31", struct.pack("<iI", -2**31, 48) + bytes(90)),
                       ("cut", struct.pack("<iI", 0, 48) + bytes(5))):
        yield f"lines {name}", exr(body=body), None
    yield "bomb in lines", exr(window=(0, 0, LONG - 1, 15), compression=3, height=1, body=struct.pack(
        "<iI", 0, len(bomb(64))) + bomb(64)), None
    for size in (-1, 2**31, 0, 3):
        yield f"attribute of size {size}", exr(more=attribute(b"a", b"string", b"text", size)), None
    yield "preview of 2^31", exr(more=attribute(b"preview", b"preview", struct.pack(
        "<2I", 2**31 - 1, 2**31 - 1))), None
    yield "texts without an end", exr(more=attribute(b"v", b"stringvector", struct.pack(
        "<I", 2**31 - 1) + b"x")), None
    yield "20000 attributes", exr(more=b"".join(
        attribute(b"n%d" % i, b"float", bytes(4)) for i in range(20000))), None
    for name in ("channels", "compression", "dataWindow", "displayWindow", "lineOrder"):
        yield f"no {name}", exr(without=(name,)), None
    for version in (0, 1, 3, 255):
        yield f"version {version}", exr(version=version), None
    for flags in (0x400, 0x800, 0x1000, 0x1800, 0xffffe000):
        yield f"flags {flags:x}", exr(flags=flags), "refused" if flags & 0x1800 else None
    for name in ("rle", "zips", "zip", "piz", "pxr24", "b44", "b44a", "dwaa", "dwab"):
        content = bytearray(exr_base(folder, name))
        for _ in range(6):
            content[dice.randrange(len(content) * 2 // 3, len(content))] ^= dice.randrange(1, 256)
        yield f"damaged {name}", bytes(content), None


def exr_base(folder, compression):
    path = folder / f"{compression}.exr"
    y, x = np.mgrid[:40, :40] / 40.0
    image.write_file(path, np.stack([x, y, x * y], 2), "half", compression=compression)
    return path.read_bytes()


# HDR

def hdr(size=b"-Y 4 +X 8", body=None, head=b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n"):
    return head + size + b"\n" + (bytes(range(128)) if body is None else body)


def hdrs():
    line = b"\2\2\0\x08"
    yield "good", hdr(), "decoded"
    yield "of runs", hdr(body=(line + b"\x88\x70" * 4) * 4), "decoded"
    for size in (b"-Y 0 +X 8", b"-Y 8 +X 0", b"-Y 65536 +X 65536", b"-Y 4 +X 99999999999999999999",
                 b"-Y -4 +X 8", b"+X 8 -Y 4", b"-Y 4", b"", b"-Y 4 +X x"):
        yield f"size {size.decode()!r}", hdr(size), "refused"
    yield "16384x4096 of nothing", hdr(b"-Y 4096 +X 16384"), "refused"
    yield "no texels", hdr(body=b""), "refused"
    yield "runs beyond the line", hdr(body=(line + b"\xff\x70" * 4) * 4), "refused"
    yield "copies beyond the line", hdr(body=line + b"\x7f" + bytes(200)), "refused"
    yield "copies of 0", hdr(body=line + bytes(500)), "refused"
    yield "a line of another length", hdr(body=b"\2\2\x7f\xff" + bytes(500)), None
    yield "old runs at first", hdr(body=b"\1\1\1\xff" * 40), None
    yield "old runs shifted out", hdr(body=b"\x10\x10\x10\x80" + b"\1\1\1\x01" * 80), None
    yield "exponents 255", hdr(body=b"\xff\xff\xff\xff" * 40), None
    yield "a line without an end", hdr(head=b"#?RADIANCE\n" + b"x" * 9000), "refused"
    yield "many lines", hdr(head=b"#?RADIANCE\n" + b"#\n" * 50000 + b"\n"), None
    yield "no format", hdr(head=b"#?RADIANCE\n\n"), None
    for exposure in (b"0", b"nan", b"1e39", b"-1"):
        yield f"exposure {exposure.decode()}", hdr(
            head=b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\nEXPOSURE=" + exposure + b"\n\n"), None
    yield "header alone", b"#?RADIANCE\n", "refused"


# All

def crc_mended(content):
    """A PNG whose checksums are right again, as far as its chunks can be told apart."""
    content, at = bytearray(content), 8
    while at + 12 <= len(content):
        length = struct.unpack_from(">I", content, at)[0]
        if length > len(content) - at - 12:
            break
        struct.pack_into(">I", content, at + 8 + length, zlib.crc32(content[at + 4:at + 8 + length]))
        at += 12 + length
    return bytes(content)


def mutated(content, dice):
    """A few bytes changed, made extreme, cut out or written twice."""
    content = bytearray(content)
    for _ in range(dice.randrange(1, 5)):
        at = dice.randrange(len(content))
        span = dice.randrange(1, 9)
        how = dice.randrange(4)
        if how == 0:
            content[at] = dice.randrange(256)
        elif how == 1:
            content[at:at + span] = bytes([dice.choice((0, 0x7f, 0x80, 0xff))]) * span
        elif how == 2 and len(content) > 40:
            del content[at:at + span]
        else:
            content[at:at] = content[at:at + span]
    return bytes(content)


def all_pictures(folder, seed=1, mutations=30):
    made = {"png": list(pngs()), "jpeg": list(jpegs(folder)), "exr": list(exrs(folder)),
            "hdr": list(hdrs())}
    dice = random.Random(seed)

    for kind, pictures in made.items():
        for name, content, verdict in pictures:
            yield f"{kind}: {name}", content, verdict
        small = [content for _, content, _ in pictures if len(content) < 20000]
        for i in range(mutations):
            content = mutated(dice.choice(small), dice)
            yield f"{kind}: mutation {i}", crc_mended(content) if kind == "png" else content, None
