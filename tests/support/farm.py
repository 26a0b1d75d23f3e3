# SPDX-License-Identifier: Apache-2.0
"""A running coordinator with its local workers, for tests.

    with Farm(processes=2) as farm:
        render = farm.submit(scene)
        farm.wait(render)
        pixels = image.read(farm.image(render, "exr"))

Leaving the block stops the coordinator by SIGTERM and fails when it does not end with code 0 or
when one of its processes outlives it. After a failure inside the block the coordinator's log goes
to stderr. Nothing here sleeps for a fixed time: every wait polls and has a deadline.
"""
import collections
import http.client
import json
import os
import pathlib
import shutil
import signal
import socket
import ssl
import subprocess
import sys
import tempfile
import time

import contract

ROOT = pathlib.Path(__file__).resolve().parents[2]
BIN = pathlib.Path(os.environ.get("PEN_BIN", ROOT / "build/release/bin"))
# An instrumented build is slower: PEN_SLOW=10 gives every deadline ten times as long.
SLOW = float(os.environ.get("PEN_SLOW", 1))
# PEN_ISA=v2 has every farm render with that instruction set, unless a test asks for another.
ISA = ["--isa", os.environ["PEN_ISA"]] if "PEN_ISA" in os.environ else []

Response = collections.namedtuple("Response", "status headers body")

FINAL = ("done", "failed", "cancelled")


def program(name):
    return str(BIN / name)


def free_port():
    with socket.create_server(("127.0.0.1", 0)) as held:
        return held.getsockname()[1]


def listens(port):
    with socket.socket() as probe:
        return probe.connect_ex(("127.0.0.1", port)) == 0


def wait_for(condition, seconds, what, pace=0.0):
    """The first true value of condition(); AssertionError when none comes in time.

    pace: the part of the time waited so far that passes between two looks, beyond 10 ms.
    """
    start = time.monotonic()
    deadline = start + seconds * SLOW
    while True:
        value = condition()
        if value:
            return value
        if time.monotonic() > deadline:
            raise AssertionError(f"{what}: not within {seconds * SLOW:g} s")
        time.sleep(0.01 + pace * (time.monotonic() - start))


def _stat(pid):
    """(command name, state, parent) of a process, or None when there is none."""
    try:
        text = pathlib.Path(f"/proc/{pid}/stat").read_text()
    except OSError:
        return None
    name, rest = text[text.index("(") + 1:].rsplit(")", 1)
    fields = rest.split()
    return name, fields[0], int(fields[1])


def alive(pid):
    found = _stat(pid)
    return found is not None and found[1] not in "ZX"


def children(pid):
    """The living child processes of pid, oldest first."""
    found = []
    for entry in os.listdir("/proc"):
        if entry.isdigit():
            stat = _stat(entry)
            if stat and stat[2] == pid and stat[1] not in "ZX":
                found.append(int(entry))
    return sorted(found)


def descendants(pid):
    found = children(pid)
    for child in list(found):
        found += descendants(child)
    return found


def processor_seconds(pids):
    """Processor time of processes' threads, and of the processes that they have waited for."""
    seconds = 0.0
    for pid in pids:
        try:
            stat = pathlib.Path(f"/proc/{pid}/stat").read_text()
            for thread in os.listdir(f"/proc/{pid}/task"):
                text = pathlib.Path(f"/proc/{pid}/task/{thread}/schedstat").read_text()
                seconds += 1e-9 * int(text.split()[0])
        except OSError:
            continue  # gone meanwhile
        waited_for = stat[stat.rindex(")") + 2:].split()[13:15]
        seconds += sum(map(int, waited_for)) / os.sysconf("SC_CLK_TCK")
    return seconds


class Worker:
    """The process tree of one pool process: zygotes, scene processes, render processes.

    A role follows from the depth: a scene process is forked by the zygote, a render process by a
    scene process.
    """

    def __init__(self, pool):
        self.pool = pool

    def zygotes(self):
        return children(self.pool)

    def scenes(self):
        return [pid for zygote in self.zygotes() for pid in children(zygote)]

    def renders(self):
        return [pid for scene in self.scenes() for pid in children(scene)]


class Farm:
    def __init__(self, processes=2, *arguments, data=None, binaries=BIN, prefix=(), tls=None):
        """arguments go to serve; prefix is a command to run it under, as valgrind; tls is the certificate
        that HTTP shows, for which arguments must say that it does."""
        self.tls = tls
        self.processes = processes
        self.binaries, self.prefix = pathlib.Path(binaries), list(prefix)
        self.arguments = [str(a) for a in arguments]
        self.directory = pathlib.Path(tempfile.mkdtemp(prefix="penumbra-test-"))
        self.data = pathlib.Path(data) if data else self.directory / "data"
        self.log = self.directory / "log"
        self.server = None
        self.remote = []
        self.http_port = self.worker_port = None

    def __enter__(self):
        try:
            self.start()
        except BaseException:
            self._abandon()
            raise
        return self

    def __exit__(self, kind, value, trace):
        try:
            if kind is None:
                self.stop()
        except BaseException:
            self._abandon()
            raise
        if kind is not None:
            self._abandon()
        else:
            shutil.rmtree(self.directory, ignore_errors=True)

    def command(self):
        return [*self.prefix, str(self.binaries / "penumbra"), "serve", "--data", str(self.data),
                "--listen", "127.0.0.1:0", "--worker-listen", "127.0.0.1:0",
                "--processes", str(self.processes), *ISA, *self.arguments]

    def start(self):
        """Starts the coordinator, on the same data directory when it ran before."""
        ports = self.data / "ports"
        ports.unlink(missing_ok=True)
        with open(self.log, "ab") as log:
            self.server = subprocess.Popen(self.command(), stdin=subprocess.DEVNULL,
                                           stdout=log, stderr=log)

        def ready():
            if self.server.poll() is not None:
                raise AssertionError(f"serve ended with {self.server.returncode} at once")
            return ports.exists()

        wait_for(ready, 20, "DATA/ports")
        found = json.loads(ports.read_text())
        self.http_port, self.worker_port = found["http"], found["workers"]

    def stop(self):
        """SIGTERM; the coordinator must end with code 0 and leave no process behind."""
        for worker in self.remote:
            stop_process(worker)
        self.remote = []
        if self.server is None:
            return
        family = descendants(self.server.pid)
        self.server.send_signal(signal.SIGTERM)
        code = self.server.wait(timeout=15 * SLOW)
        assert code == 0, f"serve ended with {code} after SIGTERM"
        self.server = None
        wait_for(lambda: not any(map(alive, family)), 30, "end of all processes of the farm")

    def kill(self):
        """SIGKILL to the coordinator alone; tells the processes that it had."""
        family = descendants(self.server.pid)
        self.server.kill()
        self.server.wait(timeout=5)
        self.server = None
        return family

    def connect_worker(self, processes=1, *arguments):
        """Starts a penumbra-worker that connects from outside; tells its Popen."""
        with open(self.log, "ab") as log:
            worker = subprocess.Popen(
                [program("penumbra-worker"), "--connect", f"127.0.0.1:{self.worker_port}",
                 "--processes", str(processes), *map(str, arguments)],
                stdin=subprocess.DEVNULL, stdout=log, stderr=log)
        self.remote.append(worker)
        return worker

    def _abandon(self):
        """After a failure: shows the log, ends what this farm started."""
        family = [self.server.pid, *descendants(self.server.pid)] if self.server else []
        for worker in self.remote:
            family += [worker.pid, *descendants(worker.pid)]
        if self.log.exists():
            sys.stderr.write(f"--- log of the farm ---\n{self.log.read_text(errors='replace')}")
        for pid in family:
            try:
                os.kill(pid, signal.SIGKILL)
            except ProcessLookupError:
                pass
        for process in [self.server, *self.remote]:
            if process:
                process.wait(timeout=5)
        self.server, self.remote = None, []
        shutil.rmtree(self.directory, ignore_errors=True)

    # Processes

    def encoders(self):
        return [pid for pid in children(self.server.pid)
                if (_stat(pid) or ("",))[0].startswith("penumbra-enc")]

    def pools(self):
        """The workers that the coordinator itself started."""
        encoders = self.encoders()
        return [Worker(pid) for pid in children(self.server.pid) if pid not in encoders]

    def renders(self):
        return [pid for worker in self.pools() for pid in worker.renders()]

    # HTTP

    def connection(self, timeout=30):
        if not self.tls:
            return http.client.HTTPConnection("127.0.0.1", self.http_port, timeout=timeout * SLOW)
        context = ssl.create_default_context(cafile=self.tls)
        return http.client.HTTPSConnection("127.0.0.1", self.http_port, timeout=timeout * SLOW, context=context)

    def request(self, method, path, body=None, headers=None, timeout=30):
        connection = self.connection(timeout)
        try:
            connection.request(method, path, body, headers or {})
            answer = connection.getresponse()
            data = answer.read()
        finally:
            connection.close()
        contract.check(method, path, answer.status, answer.headers, data)
        return Response(answer.status, answer.headers, data)

    def post(self, body):
        """POST of a scene or an envelope (a dict, or text as it is)."""
        text = body if isinstance(body, (str, bytes)) else json.dumps(body)
        return self.request("POST", "/v1/renders", text,
                            {"Content-Type": "application/json", "Cache-Control": "no-store"})

    def submit(self, body):
        """The id of a new render, which must be accepted."""
        answer = self.post(body)
        assert answer.status == 202, f"{answer.status}: {answer.body.decode(errors='replace')}"
        return json.loads(answer.body)["id"]

    def get(self, path):
        answer = self.request("GET", path)
        assert answer.status == 200, f"GET {path}: {answer.status}: {answer.body[:500]!r}"
        return json.loads(answer.body)

    def resource(self, render):
        return self.get(f"/v1/renders/{render}")

    def patch(self, render, change):
        return self.request("PATCH", f"/v1/renders/{render}", json.dumps(change),
                            {"Content-Type": "application/json"})

    def wait(self, render, seconds=60, state="done"):
        """The resource of a render that is over, in the state that is expected."""
        def over():
            found = self.resource(render)
            return found if found["state"] in FINAL else None

        # Of a long render the looks would cost more than the rendering.
        found = wait_for(over, seconds, f"end of render {render}", 0.03)
        assert found["state"] == state, f"{found['state']}: {found.get('error')}"
        return found

    def wait_progress(self, render, share=0.0, seconds=30):
        """The resource once more than share of it has been rendered; it must not be over yet."""
        def begun():
            found = self.resource(render)
            assert found["state"] not in FINAL, f"the render was {found['state']} too early"
            return found if found["progress"] > share else None

        return wait_for(begun, seconds, f"progress over {share} of render {render}")

    def image(self, render, extension="exr"):
        answer = self.request("GET", f"/v1/renders/{render}/image.{extension}")
        assert answer.status == 200, f"{answer.status}: {answer.body[:500]!r}"
        return answer.body

    def render(self, body, seconds=60):
        """Renders a scene to its end; tells the bytes of the EXR."""
        render = self.submit(body)
        self.wait(render, seconds)
        return self.image(render)


def stop_process(process, seconds=15):
    """SIGTERM, then the exit code."""
    if process.poll() is None:
        process.send_signal(signal.SIGTERM)
    return process.wait(timeout=seconds * SLOW)
