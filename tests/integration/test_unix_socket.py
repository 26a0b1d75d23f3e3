# SPDX-License-Identifier: Apache-2.0
"""HTTP by a socket in the file system: who comes in is told by the kernel."""
import http.client
import json
import os
import pathlib
import socket
import stat
import subprocess
import sys
import tempfile

import farm
import pytest
import scene
from bearer import token

TINY = scene.build(16, 16, 1, [scene.sphere()])
NOBODY = 65534
# What another user's process is answered: its argument is the path, then a token or nothing.
ASK = """
import socket, sys
link = socket.socket(socket.AF_UNIX)
link.connect(sys.argv[1])
field = f"Authorization: Bearer {sys.argv[2]}\\r\\n" if len(sys.argv) > 2 else ""
link.sendall(f"GET /v1/renders HTTP/1.1\\r\\nHost: x\\r\\nConnection: close\\r\\n{field}\\r\\n".encode())
print(link.makefile("rb").read().split()[1].decode())
"""


class Local(http.client.HTTPConnection):
    def __init__(self, path):
        super().__init__("localhost", timeout=20)
        self.path = path

    def connect(self):
        self.sock = socket.socket(socket.AF_UNIX)
        self.sock.connect(str(self.path))


def ask(path, method, target, body=None, **headers):
    link = Local(path)
    link.request(method, target, body, headers)
    answer = link.getresponse()
    found = answer.status, answer.read()
    link.close()
    return found


@pytest.fixture
def path():
    with tempfile.TemporaryDirectory(prefix="penumbra-test-") as directory:
        os.chmod(directory, 0o755)  # others may come as far as the socket
        yield pathlib.Path(directory) / "http.sock"


@pytest.fixture
def service(path):
    with farm.Farm(1, "--listen-unix", path) as running:
        yield running
    assert not path.exists()


def test_the_owner_needs_no_token(service, path):
    """Breaks if a token is asked for, a name is, or what came in here is answered elsewhere."""
    assert stat.S_IMODE(path.stat().st_mode) == 0o660
    secret = token(service.data, "alice")
    farm.wait_for(lambda: service.request("GET", "/v1/renders").status == 401, 5, "a closed door")
    status, body = ask(path, "POST", "/v1/renders", json.dumps(TINY),
                       **{"Content-Type": "application/json", "Host": "anything.example", "Origin": "http://x"})
    assert status == 202
    render = json.loads(body)["id"]
    farm.wait_for(lambda: json.loads(ask(path, "GET", f"/v1/renders/{render}")[1])["state"] == "done", 20, "the end")
    assert ask(path, "GET", f"/v1/renders/{render}/image.png")[1].startswith(b"\x89PNG")
    assert ask(path, "DELETE", f"/v1/renders/{render}")[0] == 204
    assert service.request("GET", "/v1/renders", headers={"Authorization": f"Bearer {secret}"}).status == 200


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can be somebody else")
def test_others_need_one(service, path):
    """Breaks if the socket's mode alone decides, or who has a token is kept out."""
    def as_nobody(*words):
        return subprocess.run([sys.executable, "-c", ASK, str(path), *words], user=NOBODY, group=NOBODY,
                              extra_groups=[], capture_output=True, text=True, timeout=20)

    assert "PermissionError" in as_nobody().stderr
    path.chmod(0o666)
    assert as_nobody().stdout == "401\n"  # nor when nobody has a token
    secret = token(service.data, "alice")
    farm.wait_for(lambda: service.request("GET", "/v1/renders").status == 401, 5, "a closed door")
    assert as_nobody().stdout == "401\n"
    assert as_nobody("pnb_" + "a" * 43).stdout == "401\n"
    assert as_nobody(secret).stdout == "200\n"


def test_what_is_left_behind_is_replaced(service, path):
    """Breaks if a coordinator that was killed has to be cleaned up after."""
    service.kill()
    assert path.exists()
    service.start()
    assert ask(path, "GET", "/livez")[0] == 200


@pytest.mark.parametrize("kind", ["service", "file", "long"])
def test_where_it_cannot_be(path, tmp_path, kind, request):
    """Breaks if another service, or a file, goes to make room, or the reason is not told."""
    place, reason = path, "no socket"
    if kind == "service":
        request.getfixturevalue("service")
        reason = "another service listens there"
    elif kind == "file":
        path.write_text("mine")
    else:
        place, reason = tmp_path / ("x" * 120), "at most 107 bytes"
    run = subprocess.run([farm.program("penumbra"), "serve", "--processes", "0", "--listen", "127.0.0.1:0",
                          "--worker-listen", "127.0.0.1:0", "--data", tmp_path / "other", "--listen-unix", place],
                         capture_output=True, text=True, timeout=20)
    assert run.returncode == 1 and reason in run.stderr, run.stderr
    assert kind != "file" or path.read_text() == "mine"
    assert kind != "service" or ask(path, "GET", "/livez")[0] == 200


def test_the_command_line(service, path, tmp_path):
    """Breaks if a client does not find it, or an absent one is not told of."""
    run = subprocess.run([farm.program("penumbra"), "submit", "-", "--server", f"unix:{path}"],
                         input=json.dumps(TINY), capture_output=True, text=True, timeout=20)
    assert run.returncode == 0, run.stderr
    run = subprocess.run([farm.program("penumbra"), "list"], env={**os.environ, "PENUMBRA_SERVER": f"unix:{path}"},
                         capture_output=True, text=True, timeout=20)
    assert run.returncode == 0 and len(run.stdout.splitlines()) >= 1, run.stderr
    run = subprocess.run([farm.program("penumbra"), "list", "--server", f"unix:{tmp_path}/none"],
                         capture_output=True, text=True, timeout=20)
    assert run.returncode != 0 and "nothing listens there" in run.stderr, run.stderr
