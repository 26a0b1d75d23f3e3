# SPDX-License-Identifier: Apache-2.0
"""A worker that renders as it should and sends something else: a real penumbra-worker, and between it and the
coordinator a relay that changes its results. What goes out is a right frame in every other respect: its sums
are of what is sent.

    liar = LyingWorker(service, darken)

A lie takes the fields and pixels of a result and tells what is sent for it: a list of (fields,
pixels), empty when it waits for another one."""
import contextlib
import socket
import struct
import threading

from tile_peer import MAGIC, RESULT, field, read_message, xxh3

HEAD = "<IBBHIIQ"
FIXED = {6}  # fields of eight bytes


def read(stream, size):
    data = b""
    while len(data) < size:
        piece = stream.recv(size - len(data))
        if not piece:
            raise EOFError
        data += piece
    return data


def write_message(fields):
    return b"".join(field(number, ("fixed64", value) if number in FIXED else value) for number, value in fields.items())


class LyingWorker:
    """told: how many results it sent that were none; own: those that it had."""

    def __init__(self, service, lie, name="liar", processes=1):
        self.lie, self.told, self.own, self.sequence = lie, 0, 0, 0
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.target = service.worker_port
        threading.Thread(target=self._accept, daemon=True).start()
        port, service.worker_port = service.worker_port, self.listener.getsockname()[1]
        service.connect_worker(processes, "--name", name)
        service.worker_port = port

    def close(self):
        self.listener.close()

    def _accept(self):
        with contextlib.suppress(OSError):
            while True:
                inner, _ = self.listener.accept()
                outer = socket.create_connection(("127.0.0.1", self.target))
                self.sequence = 0
                threading.Thread(target=self._orders, args=(outer, inner), daemon=True).start()
                threading.Thread(target=self._answers, args=(inner, outer), daemon=True).start()

    @staticmethod
    def _end(*streams):
        for stream in streams:
            with contextlib.suppress(OSError):
                stream.shutdown(socket.SHUT_RDWR)

    def _orders(self, source, sink):
        with contextlib.suppress(OSError):
            while piece := source.recv(1 << 16):
                sink.sendall(piece)
        self._end(source, sink)

    def _send(self, sink, kind, control, payload):
        body = control + payload
        sink.sendall(struct.pack(HEAD, MAGIC, 1, kind, len(control), len(payload), self.sequence, xxh3(body)) + body)
        self.sequence += 1

    def _answers(self, source, sink):
        with contextlib.suppress(OSError, EOFError):
            while True:
                head = struct.unpack(HEAD, read(source, 24))
                control, payload = read(source, head[3]), read(source, head[4])
                if head[2] != RESULT:
                    self._send(sink, head[2], control, payload)
                    continue
                fields = read_message(control)
                self.own += 1
                for changed, pixels in self.lie(fields, payload):
                    self.told += 1
                    self._send(sink, RESULT, write_message({**changed, 6: xxh3(pixels)}), pixels)
        self._end(source, sink)


def size(fields, pixels):
    """A pixel is missing."""
    return [(fields, pixels[:-16])]


def not_a_number(fields, pixels):
    return [(fields, struct.pack("<f", float("nan")) + pixels[4:])]


def flip(fields, pixels):
    """One bit of one value, which stays finite and near what it was."""
    middle = len(pixels) // 2 // 16 * 16
    return [(fields, pixels[:middle] + bytes([pixels[middle] ^ 1]) + pixels[middle + 1:])]


def darken(fields, pixels):
    """All colours by a hundredth; the counts stay."""
    values = list(struct.unpack(f"<{len(pixels) // 4}f", pixels))
    for i in range(len(values)):
        if i % 4 != 3:
            values[i] *= 0.99
    return [(fields, struct.pack(f"<{len(values)}f", *values))]


def exchange():
    """The results of two units, each under the other's number."""
    waiting = []

    def lie(fields, pixels):
        waiting.append((fields, pixels))
        if len(waiting) < 2:
            return []
        (first, its_pixels), (second, other_pixels) = waiting
        waiting.clear()
        return [(first, other_pixels), (second, its_pixels)]
    return lie


def replay():
    """What it sent first, for every unit of the same size."""
    kept = {}
    return lambda fields, pixels: [(fields, kept.setdefault(len(pixels), pixels))]


# By name: what makes the lie, which may remember what it saw.
LIES = {"size": lambda: size, "NaN": lambda: not_a_number, "flip": lambda: flip, "darken": lambda: darken,
        "id": exchange, "replay": replay}
