# SPDX-License-Identifier: Apache-2.0
"""The coordinator's answers a second beside nginx's, which serves the same bytes from files.

One core each: the server whose turn it is on the first, wrk on the second; the turns alternate, and
the medians are compared. Both keep connections alive and write no log of requests.
"""
import contextlib
import os
import pathlib
import re
import statistics
import subprocess
import tempfile

import farm
import scene

SERVER_CORE, CLIENT_CORE = "0", "1"
CONNECTIONS = 64
CONFIGURATION = """\
worker_processes 1;
daemon off;
pid {directory}/pid;
error_log {directory}/error.log;
events {{ worker_connections 1024; }}
http {{
    access_log off;
    sendfile on;
    tcp_nopush on;
    keepalive_requests 1000000000;
    open_file_cache max=100;
    types {{ application/json json; image/png png; }}
    client_body_temp_path {directory}/body;
    proxy_temp_path {directory}/proxy;
    fastcgi_temp_path {directory}/fastcgi;
    uwsgi_temp_path {directory}/uwsgi;
    scgi_temp_path {directory}/scgi;
    server {{ listen 127.0.0.1:{port} backlog=1024; root {directory}/files; }}
}}
"""


def noise():
    """A picture that hardly compresses: about a megabyte as PNG."""
    return scene.build(1600, 1056, 1, [scene.floor(half=100)], sequence="random",
                       camera=scene.look([0, 1, 0], [0, 0, 0], up=(0, 0, 1)),
                       lights=[scene.panel([-3, 2, -3], [6, 0, 0], [0, 0, 6], 1.5)])


@contextlib.contextmanager
def nginx(files):
    """An nginx on the server's core that serves files, a dict of bytes by name: its port."""
    port = farm.free_port()
    with tempfile.TemporaryDirectory(prefix="penumbra-load-") as name:
        directory = pathlib.Path(name)
        directory.chmod(0o755)
        (directory / "files").mkdir()
        for path, data in files.items():
            (directory / "files" / path).write_bytes(data)
        configuration = directory / "nginx.conf"
        user = "user root;\n" if os.geteuid() == 0 else ""
        configuration.write_text(user + CONFIGURATION.format(directory=directory, port=port))
        server = subprocess.Popen(["taskset", "-c", SERVER_CORE, "nginx", "-c", configuration,
                                   "-e", directory / "error.log"])
        try:
            farm.wait_for(lambda: farm.listens(port), 10, "nginx")
            yield port
        finally:
            farm.stop_process(server)


def rate(url, header, seconds):
    """Answers a second, as wrk counts them; each must be 2xx or 304."""
    command = ["taskset", "-c", CLIENT_CORE, "wrk", "-t1", f"-c{CONNECTIONS}", f"-d{seconds}s", url]
    run = subprocess.run([*command, *(("-H", header) if header else ())], stdout=subprocess.PIPE,
                         text=True, check=True)
    assert not re.search(r"Socket errors|Non-2xx", run.stdout), run.stdout
    return float(re.search(r"Requests/sec: *([0-9.]+)", run.stdout).group(1))


def etag(url):
    run = subprocess.run(["curl", "-s", "-o", "/dev/null", "-D", "-", url],
                         stdout=subprocess.PIPE, text=True, check=True)
    return re.search(r"(?i)^etag: (.*?)\r?$", run.stdout, re.MULTILINE).group(1)


def compare(rounds, seconds):
    """[(what, ours, nginx's)], medians of answers a second."""
    with farm.Farm(0, prefix=["taskset", "-c", SERVER_CORE]) as service:
        worker = service.connect_worker(1)
        render = service.submit(noise())
        service.wait(render)
        farm.stop_process(worker)
        service.remote.remove(worker)
        here = f"http://127.0.0.1:{service.http_port}/v1/renders/{render}"
        files = {"render.json": service.request("GET", f"/v1/renders/{render}").body,
                 "image.png": service.image(render, "png")}
        with nginx(files) as port:
            there = f"http://127.0.0.1:{port}"
            table = []
            for what, ours, theirs in [
                    (f"render resource, {len(files['render.json'])} bytes", here,
                     f"{there}/render.json"),
                    (f"PNG, {len(files['image.png'])} bytes", f"{here}/image.png",
                     f"{there}/image.png"),
                    ("PNG that has not changed, 304", f"{here}/image.png", f"{there}/image.png")]:
                conditional = what.endswith("304")
                pairs = [[rate(url, f"If-None-Match: {etag(url)}" if conditional else None, seconds)
                          for url in (ours, theirs)] for _ in range(rounds)]
                table.append((what, *(statistics.median(side) for side in zip(*pairs))))
    return table
