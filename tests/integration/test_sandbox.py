# SPDX-License-Identifier: Apache-2.0
"""What --sandbox asks for is what runs, and what the machine lacks is told before anything is read."""
import ctypes
import os
import pathlib
import subprocess
import sys

import farm
import pytest
import scene

LACKING = pathlib.Path(farm.__file__).with_name("lacking.py")
SCENE = scene.build(16, 16, 4, [scene.sphere()], background=1.0)
SAYS = {"landlock": "this kernel lacks Landlock: it takes Linux 5.13",
        "landlock-boot": "this kernel lacks Landlock: it was started without landlock among its lsm=",
        "seccomp": "this kernel lacks seccomp filters"}

pytestmark = pytest.mark.skipif("PEN_SLOW" in os.environ, reason="builds with sanitizers have no sandbox")


def run(*command, lacking=None, seconds=30):
    words = [sys.executable, LACKING, lacking] if lacking else []
    return subprocess.run([*words, farm.program(command[0]), *command[1:]], capture_output=True, text=True,
                          timeout=seconds)


def confinement(pid):
    """(seccomp, no new privileges, capabilities) of a process."""
    lines = pathlib.Path(f"/proc/{pid}/status").read_text().splitlines()
    fields = dict(line.split(":\t", 1) for line in lines)
    return fields["Seccomp"], fields["NoNewPrivs"], int(fields["CapEff"], 16) | int(fields["CapPrm"], 16)


def option(pid):
    words = pathlib.Path(f"/proc/{pid}/cmdline").read_bytes().split(b"\0")
    return words[words.index(b"--sandbox") + 1].decode()


@pytest.mark.parametrize("mode, expected", [("require", ("2", "1")), ("off", ("0", "1")), (None, ("2", "1"))])
def test_encoders_and_the_pool_run_as_it_was_asked(mode, expected):
    """Breaks when the option does not reach one of the processes, or does nothing there."""
    with farm.Farm(2, *(["--sandbox", mode] if mode else [])) as server:
        server.render(SCENE)
        pool, (encoder, *_) = server.pools()[0], server.encoders()
        assert option(pool.pool) == option(encoder) == (mode or "best-effort")
        for pid in [encoder, *pool.scenes(), *pool.renders()]:
            seccomp, privileges, capabilities = confinement(pid)
            assert (seccomp, privileges) == expected, pid
            assert capabilities == 0 or mode == "off"


def test_render_processes_have_a_filter_of_their_own():
    """Breaks when a render process keeps what its scene process may do: it must have one filter more."""
    def filters(pid):
        text = pathlib.Path(f"/proc/{pid}/status").read_text()
        return int(text.split("Seccomp_filters:\t")[1].split()[0])

    with farm.Farm(1, "--sandbox", "require") as server:
        server.render(SCENE)
        pool = server.pools()[0]
        renders = pool.renders()
        assert renders and {filters(pid) for pid in renders} == {filters(pid) + 1 for pid in pool.scenes()}


@pytest.mark.parametrize("lacking", SAYS)
def test_what_is_required_and_missing_keeps_it_from_starting(lacking, tmp_path):
    """Breaks when the coordinator, its file's check or a worker goes on without, or does not say what is
    missing and what can be done."""
    (tmp_path / "conf").write_text("sandbox = require\n")
    runs = [
        run("penumbra", "serve", "--data", tmp_path / "data", "--listen", "127.0.0.1:0", "--worker-listen",
            "127.0.0.1:0", "--sandbox", "require", lacking=lacking),
        run("penumbra", "config", "check", tmp_path / "conf", lacking=lacking),
        run("penumbra-worker", "--connect", "127.0.0.1:1", "--sandbox", "require", lacking=lacking),
    ]
    for found in runs:
        assert found.returncode == 1
        assert SAYS[lacking] in found.stderr and "--sandbox best-effort" in found.stderr
    assert not (tmp_path / "data" / "ports").exists()
    assert run("penumbra", "config", "check", tmp_path / "conf").returncode == 0


@pytest.mark.parametrize("lacking", SAYS)
def test_best_effort_warns_and_renders(lacking):
    """Breaks when a kernel without one of the two cannot be used at all, or is used in silence."""
    with farm.Farm(1, prefix=[sys.executable, str(LACKING), lacking]) as server:
        server.render(SCENE)
        log = server.log.read_text()
        for name in ("penumbra", "penumbra-worker"):
            assert any(f" {name}[" in line and "warning" in line and SAYS[lacking] in line
                       for line in log.splitlines()), name
        for pid in [*server.encoders(), *server.renders()]:
            # The filter of lacking.py is one, too: what it keeps away is the other half.
            assert confinement(pid)[1:] == ("1", 0)


def landlock_abi():
    """0 without."""
    return max(ctypes.CDLL(None).syscall(444, None, 0, 1), 0)


@pytest.mark.parametrize("lacking, opening, other", [
    (None, "EACCES", "SIGSYS"), ("landlock", "EACCES", "SIGSYS"), ("seccomp", "EACCES", None)])
def test_each_half_holds_without_the_other(lacking, opening, other):
    """Breaks when Landlock's rules or the filter do nothing, which the other one would hide."""
    abi = landlock_abi()
    words = [sys.executable, LACKING, lacking] if lacking else []
    text = subprocess.run([*words, farm.BIN.parent / "tests" / "sandbox-try"], capture_output=True, text=True,
                          check=True, timeout=30).stdout
    alone = {"open": opening, "mkdir": "EACCES", "bind": "EACCES" if abi >= 4 else "possible",
             "kill": "EPERM" if abi >= 6 else "possible"}
    assert abi >= 1
    assert dict(line.split(": ") for line in text.splitlines()) == (
        {name: other for name in alone} | {"open": opening} if other else alone)


def test_off_is_told():
    with farm.Farm(1, "--sandbox", "off") as server:
        server.render(SCENE)
        assert server.log.read_text().count("warning: --sandbox off") == 2


@pytest.mark.parametrize("addresses", [("--listen", "0.0.0.0:0"), ("--worker-listen", "0.0.0.0:0")])
def test_off_loopback_it_is_required(addresses, tmp_path):
    """Breaks when whoever opens a port gets by without a sandbox because nobody asked for it. That
    comes before tokens and keys, which are not there either."""
    both = dict([("--listen", "127.0.0.1:0"), ("--worker-listen", "127.0.0.1:0"), addresses])
    words = [word for pair in both.items() for word in pair]
    found = run("penumbra", "serve", "--data", tmp_path, *words, lacking="landlock")
    assert found.returncode == 1 and SAYS["landlock"] in found.stderr
    meant = run("penumbra", "serve", "--data", tmp_path, *words, "--sandbox", "best-effort", lacking="landlock")
    assert meant.returncode == 1 and "reach needs" in meant.stderr


@pytest.mark.parametrize("host, required", [
    ("127.0.0.1", False), ("127.9.9.9", False), ("localhost", False), ("[::1]", False),
    ("192.0.2.1", True), ("render.invalid", True), ("127.0.0.1.invalid", True), ("[2001:db8::1]", True)])
def test_a_worker_requires_it_for_other_machines(host, required):
    """Breaks when a worker takes scenes from elsewhere without a sandbox, or a private farm needs one."""
    command = [sys.executable, LACKING, "landlock", farm.program("penumbra-worker"), "--connect", f"{host}:1"]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as worker:
        line = worker.stderr.readline()
        worker.kill()
    assert SAYS["landlock"] in line
    assert (" error: " in line) == required and (" warning: " in line) != required


@pytest.mark.parametrize("words", [("penumbra", "serve"), ("penumbra-worker", "--connect", "127.0.0.1:1")])
def test_a_mode_that_does_not_exist(words):
    found = run(*words, "--sandbox", "none")
    assert found.returncode == 2 and "require, best-effort or off" in found.stderr
