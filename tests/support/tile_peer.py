# SPDX-License-Identifier: Apache-2.0
"""A worker made by hand: one end of the tile protocol, as right or wrong as a test wants it."""
import ctypes
import socket
import struct

import farm

HELLO, WELCOME, REFUSE, SCENE_GET, SCENE_DATA, LEASE, REVOKE, RESULT, FAILURE = range(1, 10)
SCENE_REPORT = 12
MAGIC = struct.unpack("<I", b"PENu")[0]

_xxhash = ctypes.CDLL("libxxhash.so.0")
_xxhash.XXH3_64bits.restype = ctypes.c_uint64
_xxhash.XXH3_64bits.argtypes = [ctypes.c_char_p, ctypes.c_size_t]


def xxh3(data):
    return _xxhash.XXH3_64bits(data, len(data))


def varint(value):
    out = bytearray()
    while value > 127:
        out.append(value & 127 | 128)
        value >>= 7
    return bytes(out + bytes([value]))


def field(number, value):
    """A protobuf field: a number, text, ("fixed64", number), or a list, which is repeated."""
    if isinstance(value, list):
        return b"".join(field(number, item) for item in value)
    if isinstance(value, tuple):
        return varint(number << 3 | 1) + struct.pack("<Q", value[1])
    if isinstance(value, int):
        return varint(number << 3) + varint(value)
    data = value.encode() if isinstance(value, str) else value
    return varint(number << 3 | 2) + varint(len(data)) + data


def message(**fields):
    return b"".join(field(int(name[1:]), value) for name, value in fields.items())


def read_message(data):
    """{field number: value} of a message without nesting."""
    found, at = {}, 0

    def number():
        nonlocal at
        value = shift = 0
        while True:
            byte = data[at]
            at += 1
            value |= (byte & 127) << shift
            shift += 7
            if byte < 128:
                return value

    while at < len(data):
        key = number()
        if key & 7 == 0:
            found[key >> 3] = number()
        elif key & 7 == 1:
            found[key >> 3] = struct.unpack_from("<Q", data, at)[0]
            at += 8
        else:
            size = number()
            found[key >> 3] = data[at:at + size]
            at += size
    return found


class Peer:
    """One end of the tile protocol, in the clear or over a link that is there."""

    def __init__(self, port, link=None):
        self.socket = link or socket.create_connection(("127.0.0.1", port), timeout=10 * farm.SLOW)
        self.sequence = 0

    def send(self, kind, control, payload=b""):
        body = control + payload
        self.socket.sendall(struct.pack("<IBBHIIQ", MAGIC, 1, kind, len(control), len(payload),
                                        self.sequence, xxh3(body)) + body)
        self.sequence += 1

    def hello(self, protocol=1, processes=1, name="test", class_="test/class"):
        self.send(HELLO, message(f1=protocol, f2=name, f3=processes, f4=class_, f5="0", f6=1))

    def read(self, size):
        data = b""
        while len(data) < size:
            piece = self.socket.recv(size - len(data))
            if not piece:
                raise EOFError
            data += piece
        return data

    def receive(self):
        """(type, fields, payload) of the next frame; EOFError at the end."""
        head = struct.unpack("<IBBHIIQ", self.read(24))
        return head[2], read_message(self.read(head[3])), self.read(head[4])

    def wait_for(self, kind):
        while True:
            found, fields, _ = self.receive()
            if found == kind:
                return fields

    def closed(self):
        try:
            while True:
                self.receive()
        except (EOFError, ConnectionResetError):
            return True

    def result(self, lease, pixels):
        self.send(RESULT, message(f1=lease[1], f2=lease[2], f3=lease.get(3, 0),
                                  f4=lease.get(4, 0), f5=lease.get(5, 0),
                                  f6=("fixed64", xxh3(pixels)), f7=1000,
                                  f11=lease.get(6, 0)), pixels)


def pixels_of(lease, value, count=1.0):
    area = (lease[9] - lease.get(7, 0)) * (lease[10] - lease.get(8, 0))
    return struct.pack("<4f", value, value, value, count) * area
