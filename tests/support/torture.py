# SPDX-License-Identifier: Apache-2.0
"""A farm whose coordinator is under torture.so: the nth allocation, write or sync of it fails."""
import mmap
import struct

import farm

SHIM = farm.BIN.parent / "tests/torture.so"
KINDS = ("memory", "space", "io")
FRAMES_MAX = 24
NAME_BYTES = 64
SIZE = 40 + FRAMES_MAX * (8 + NAME_BYTES)


class Tortured(farm.Farm):
    def __init__(self, *arguments, **options):
        super().__init__(*arguments, **options)
        path = self.directory / "control"
        path.write_bytes(bytes(SIZE))
        with open(path, "r+b") as file:
            self.control = mmap.mmap(file.fileno(), SIZE)

    def command(self):
        return ["env", f"LD_PRELOAD={SHIM}", f"PEN_TORTURE_CONTROL={self.directory / 'control'}",
                f"PEN_TORTURE_DIR={self.data}", *super().command()]

    def arm(self, kind, at, stays=False):
        """The at-th from now on fails, and all after it if it stays."""
        self.disarm()
        struct.pack_into("<QQQI", self.control, 8, at, 0, 0, 0)
        struct.pack_into("<II", self.control, 0, 1 + KINDS.index(kind), int(stays))

    def disarm(self):
        struct.pack_into("<I", self.control, 0, 0)

    def count(self):
        """Of calls since it was armed."""
        return struct.unpack_from("<Q", self.control, 16)[0]

    def fired(self):
        return struct.unpack_from("<Q", self.control, 24)[0] > 0

    def place(self):
        """Of the failure: (file, address) from the innermost call on."""
        depth = struct.unpack_from("<I", self.control, 32)[0]
        names = 40 + FRAMES_MAX * 8
        return [(self.control[names + i * NAME_BYTES:names + (i + 1) * NAME_BYTES].split(b"\0")[0].decode(),
                 struct.unpack_from("<Q", self.control, 40 + 8 * i)[0]) for i in range(depth)]
