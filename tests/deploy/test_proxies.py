# SPDX-License-Identifier: Apache-2.0
"""nginx and HAProxy before a coordinator, from the examples: uploads, events, host names, origins, and
workers with certificates."""
import base64
import hashlib
import http.client
import json
import pathlib
import socket
import ssl
import subprocess
import time

import pytest
from farm import ROOT, Farm, free_port, program
from proxy import Proxy, certificate, substitute

DEPLOY = ROOT / "deploy"
NAME = "render.example"
PASSWORD = "artist:secret"


@pytest.fixture(scope="module")
def keys(tmp_path_factory):
    directory = tmp_path_factory.mktemp("keys")
    directory.chmod(0o755)
    certificate(directory, "authority")
    for name in (NAME, "worker"):
        certificate(directory, name, directory / "authority")
    certificate(directory, "stranger")
    return directory


def hash_of(password):
    return subprocess.run(["openssl", "passwd", "-5", password], capture_output=True, text=True, check=True,
                          timeout=60).stdout.strip()


def nginx(directory, farm, keys, port):
    (directory / "users").write_text(f"artist:{hash_of('secret')}\n")
    server = substitute((DEPLOY / "nginx/penumbra.conf").read_text(),
                        ("server 127.0.0.1:8080;", f"server 127.0.0.1:{farm.http_port};"),
                        ("listen 443 ssl http2;", f"listen 127.0.0.1:{port} ssl http2;"),
                        ("/etc/ssl/certs/render.example.pem", keys / f"{NAME}.crt"),
                        ("/etc/ssl/private/render.example.key", keys / f"{NAME}.key"),
                        ("/etc/nginx/penumbra.users", directory / "users"))
    (directory / "nginx.conf").write_text(
        f"daemon off; user root; pid {directory}/nginx.pid; error_log {directory}/error.log;\n"
        f"events {{}}\nhttp {{ access_log off; client_body_temp_path {directory}/body; "
        f"proxy_temp_path {directory}/temp;\n{server}\n}}\n")
    return Proxy(["nginx", "-e", directory / "error.log", "-c", directory / "nginx.conf"], port)


def haproxy(directory, farm, keys, port, worker_port=None):
    text = substitute((DEPLOY / "haproxy/penumbra.cfg").read_text(),
                      ("server coordinator 127.0.0.1:8080", f"server coordinator 127.0.0.1:{farm.http_port}"),
                      ("server coordinator 127.0.0.1:8081", f"server coordinator 127.0.0.1:{farm.worker_port}"),
                      ("bind :443 ", f"bind 127.0.0.1:{port} "),
                      ("bind :8443 ", f"bind 127.0.0.1:{worker_port or free_port()} "),
                      ("/etc/haproxy/penumbra/http.pem", keys / f"{NAME}.pem"),
                      ("/etc/haproxy/penumbra/workers.pem", keys / f"{NAME}.pem"),
                      ("/etc/haproxy/penumbra/ca.pem", keys / "authority.crt"),
                      ("$5$penumbra$replace-this-line-by-your-own", hash_of("secret")))
    (directory / "haproxy.cfg").write_text(text)
    return Proxy(["haproxy", "-q", "-db", "-f", directory / "haproxy.cfg"], port, *filter(None, [worker_port]))


@pytest.fixture(scope="module", params=[nginx, haproxy])
def front(request, tmp_path_factory, keys):
    """A coordinator behind a proxy: its farm, the proxy's port, the keys, the proxy's name."""
    directory, port = tmp_path_factory.mktemp("proxy"), free_port()
    with Farm(processes=1) as farm, request.param(directory, farm, keys, port):
        yield farm, port, keys, request.param.__name__


def connect(front):
    _, port, keys, _ = front
    context = ssl.create_default_context(cafile=str(keys / "authority.crt"))
    connection = http.client.HTTPSConnection(NAME, port, context=context, timeout=60)
    connection._create_connection = lambda address, *more: socket.create_connection(("127.0.0.1", port), *more)
    return connection


def request(front, method, path, body=None, password=PASSWORD, **fields):
    headers = {name.replace("_", "-"): value for name, value in fields.items()}
    if password:
        headers["Authorization"] = "Basic " + base64.b64encode(password.encode()).decode()
    connection = connect(front)
    connection.request(method, path, body, headers)
    answer = connection.getresponse()
    data = answer.read()
    connection.close()
    return answer.status, data


def scene(samples):
    return json.dumps({"version": 1, "image": {"width": 256, "height": 256}, "sampling": {"samples": samples},
                       "background": {"color": [0.1, 0.2, 0.3]},
                       "materials": {"m": {"type": "matte", "color": [0.5, 0.5, 0.5]}},
                       "objects": [{"type": "sphere", "material": "m", "center": [0, 0, -4], "radius": 1}]})


def submit(front, samples=4):
    status, data = request(front, "POST", "/v1/renders", scene(samples), Content_Type="application/json",
                           Cache_Control="no-store")
    assert status == 202, data
    return json.loads(data)["id"]


def test_a_render_comes_through(front):
    """Breaks when the name that the coordinator does not answer for is passed on to it."""
    render = submit(front)
    front[0].wait(render)
    status, data = request(front, "GET", f"/v1/renders/{render}/image.exr")
    assert status == 200 and data == front[0].image(render)


def test_only_with_a_password(front):
    """Breaks when a location is open, or the password goes on to the coordinator."""
    assert request(front, "GET", "/v1/farm", password=None)[0] == 401
    assert request(front, "GET", "/v1/farm", password="artist:wrong")[0] == 401
    assert request(front, "GET", "/v1/farm")[0] == 200


def test_other_sites_pages_are_refused_and_the_own_is_not(front):
    """Breaks when the origin is dropped for all: any page could then post with the reader's password."""
    own = f"https://{NAME}:{front[1]}"
    for origin, expected in ((own, 202), ("https://evil.example", 403), (f"https://{NAME}.evil.example", 403)):
        status, data = request(front, "POST", "/v1/renders", scene(1), Origin=origin,
                               Content_Type="application/json")
        assert status in ((202, 200) if expected == 202 else (expected,)), (origin, status, data)


def test_a_large_upload_comes_through_at_once(front):
    """64 MiB. Breaks when the proxy has a bound of its own."""
    data = bytes(range(256)) * (1 << 18)
    digest = hashlib.sha256(data).hexdigest()
    assert request(front, "PUT", f"/v1/assets/sha256/{digest}", data)[0] == 201
    assert request(front, "HEAD", f"/v1/assets/sha256/{digest}")[0] == 200


def test_events_are_not_held_back(front):
    """An event is through within a second of what it tells. Breaks when the proxy buffers answers."""
    farm = front[0]
    farm.patch(submit(front, 65536), {"state": "cancelled"})  # the scene's process is warm
    render = submit(front, 65536)
    farm.wait_progress(render)
    connection = connect(front)
    connection.request("GET", f"/v1/renders/{render}/events",
                       headers={"Authorization": "Basic " + base64.b64encode(PASSWORD.encode()).decode()})
    answer = connection.getresponse()
    assert answer.status == 200 and answer.headers["Content-Type"].startswith("text/event-stream")
    while not answer.readline().startswith(b"event: "):
        pass
    farm.patch(render, {"state": "cancelled"})
    start = time.monotonic()
    while answer.readline() != b"event: done\n":
        assert time.monotonic() - start < 1
    assert time.monotonic() - start < 1
    connection.close()


def test_metrics_are_for_monitoring(front):
    """With nginx, open on this machine; with HAProxy, for nobody: it is asked beside it. Breaks when the
    rule about the path is lost."""
    expected = 200 if front[3] == "nginx" else 403
    assert request(front, "GET", "/metrics")[0] == expected


def tunnel(directory, keys, port, far, pem):
    """worker.cfg, as on a worker's machine."""
    text = substitute((DEPLOY / "haproxy/worker.cfg").read_text(),
                      ("bind 127.0.0.1:8081", f"bind 127.0.0.1:{port}"),
                      ("render.example:8443", f"127.0.0.1:{far}"),
                      ("/etc/haproxy/penumbra/worker.pem", keys / pem),
                      ("/etc/haproxy/penumbra/ca.pem", keys / "authority.crt"))
    path = directory / f"{pathlib.Path(pem).stem}.cfg"
    path.write_text(text)
    return Proxy(["haproxy", "-q", "-db", "-f", path], port)


def test_a_worker_comes_through_with_its_certificate_only(tmp_path, keys):
    """Breaks when the workers' port takes anybody, or what goes through is not what was sent."""
    with Farm(processes=1) as farm:
        expected = farm.render(scene(16))
    http_port, far, near, strange = (free_port() for _ in range(4))
    with (Farm(processes=0) as farm, haproxy(tmp_path, farm, keys, http_port, far),
          tunnel(tmp_path, keys, near, far, "worker.pem"),
          tunnel(tmp_path, keys, strange, far, "stranger.pem")):
        workers = [subprocess.Popen([program("penumbra-worker"), "--connect", f"127.0.0.1:{port}",
                                     "--processes", "1", "--name", name], stdin=subprocess.DEVNULL)
                   for name, port in (("known", near), ("stranger", strange))]
        try:
            assert farm.render(scene(16)) == expected
            assert [w["name"] for w in farm.get("/v1/workers")["workers"]] == ["known"]
        finally:
            for worker in workers:
                worker.terminate()
                worker.wait(timeout=20)
