# SPDX-License-Identifier: Apache-2.0
"""The real HTTP interface and encoders over fake renders, which stand still in each state
(fake_jobs.h). Every answer is held against the OpenAPI document."""
import collections
import http.client
import json
import pathlib
import select
import socket
import subprocess
import tempfile
import time

import contract
import farm

JSON = {"Content-Type": "application/json"}

Answer = collections.namedtuple("Answer", "status headers body ms")


class Server:
    def __init__(self, encoder=None):
        self.directory = tempfile.TemporaryDirectory(prefix="penumbra-test-")
        program = pathlib.Path(farm.BIN).parent / "tests/http-server"
        self.process = subprocess.Popen(
            [program, encoder or farm.program("penumbra-encoder"), self.directory.name],
            stdout=subprocess.PIPE, text=True)
        self.port = int(self.process.stdout.readline())

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.terminate()
        assert self.process.wait(10) == 0
        self.process.stdout.close()
        self.directory.cleanup()

    def ask(self, method, path, body=None, headers=(), connection=None, timeout=20):
        own = connection or http.client.HTTPConnection("127.0.0.1", self.port, timeout=timeout)
        start = time.monotonic()
        own.request(method, path, body, dict(headers))
        answer = own.getresponse()
        data = answer.read()
        elapsed = (time.monotonic() - start) * 1000
        if not connection:
            own.close()
        contract.check(method, path, answer.status, answer.headers, data)
        return Answer(answer.status, answer.headers, data, elapsed)

    def get(self, path, **headers):
        return self.ask("GET", path, headers={k.replace("_", "-"): v for k, v in headers.items()})

    def post(self, body, headers=JSON.items()):
        return self.ask("POST", "/v1/renders", body if isinstance(body, (str, bytes)) else
                        json.dumps(body), headers)

    def raw(self, data, seconds=5):
        """What comes back, until the server closes or is silent, for bytes as they are."""
        with socket.create_connection(("127.0.0.1", self.port)) as link:
            link.sendall(data)
            got = b""
            while select.select([link], [], [], seconds)[0]:
                piece = link.recv(65536)
                if not piece:
                    break
                got += piece
            return got


def problem(answer, status):
    """The problem of an answer, which must be one with this status."""
    assert answer.status == status, answer.body
    assert answer.headers["Content-Type"] == "application/problem+json"
    body = json.loads(answer.body)
    assert body["status"] == status and body["type"] and body["title"] and body["detail"]
    return body
