# SPDX-License-Identifier: Apache-2.0
"""A TCP proxy that spoils what goes through it, as its seed says; fired counts what it did."""
import collections
import contextlib
import random
import socket
import struct
import threading
import time

CHUNK = 16384
KINDS = ("delay", "dribble", "reset", "flip", "replay", "slow", "half-open")


class FaultProxy:
    """Listens on host (any port) and connects to target; rate: the chance that a piece is spoiled."""

    def __init__(self, host, target, seed, rate=0.02):
        self.target, self.rate, self.random = target, rate, random.Random(seed)
        self.fired, self.lock = collections.Counter(), threading.Lock()
        self.listener = socket.create_server((host, 0))
        self.port = self.listener.getsockname()[1]
        threading.Thread(target=self._accept, daemon=True).start()

    def heal(self):
        self.rate = 0

    def close(self):
        self.listener.close()

    def _accept(self):
        while True:
            try:
                inner, _ = self.listener.accept()
            except OSError:
                return
            try:
                outer = socket.create_connection(("127.0.0.1", self.target()), timeout=5)
            except OSError:
                inner.close()
                continue
            outer.settimeout(None)
            for pair in ((inner, outer), (outer, inner)):
                threading.Thread(target=self._pump, args=pair, daemon=True).start()

    def _draw(self):
        """The fault that strikes a piece now, or None."""
        with self.lock:
            if self.random.random() >= self.rate:
                return None
            # Those that end a connection would otherwise hide the others.
            kind = min(KINDS, key=lambda k: (self.fired[k], self.random.random()))
            self.fired[kind] += 1
            return kind

    def _pump(self, source, sink):
        with contextlib.suppress(OSError):
            while piece := source.recv(CHUNK):
                kind = self._draw()
                if kind == "half-open":
                    self._swallow(source)
                    break
                if kind == "reset":
                    linger = struct.pack("ii", 1, 0)
                    for end in (source, sink):
                        end.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, linger)
                    break
                self._pass(kind, piece, sink)
        for end in (source, sink):
            with contextlib.suppress(OSError):
                end.shutdown(socket.SHUT_RDWR)
            end.close()

    def _swallow(self, source):
        """One direction is dead, and neither end is told, until one gives up or it heals."""
        source.settimeout(1)
        while self.rate:
            with contextlib.suppress(TimeoutError):
                if not source.recv(CHUNK):
                    return

    def _pass(self, kind, piece, sink):
        if kind == "delay":
            time.sleep(self.random.uniform(0.005, 0.5))
        elif kind == "slow":
            time.sleep(len(piece) / 125000)
        elif kind == "flip":
            place = self.random.randrange(len(piece))
            bit = 1 << self.random.randrange(8)
            piece = piece[:place] + bytes([piece[place] ^ bit]) + piece[place + 1:]
        elif kind == "replay":
            piece += piece
        if kind == "dribble":
            for i in range(len(piece)):
                sink.sendall(piece[i:i + 1])
        else:
            sink.sendall(piece)
