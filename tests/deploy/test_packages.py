# SPDX-License-Identifier: Apache-2.0
"""The Debian packages: well formed, confined, and gone without a trace when they are purged."""
import json
import pathlib
import re
import shutil
import subprocess
import time

import debian
import pytest
from debian import AS_ROOT, run
from farm import ROOT

BUILD = ROOT / "build/release"
UNITS = ("penumbra.service", "penumbra-worker.service")


@pytest.fixture(scope="module")
def packages(tmp_path_factory):
    """The packages of this build, by name."""
    where = tmp_path_factory.mktemp("packages")
    run("cpack", "-B", where, cwd=BUILD)
    return {path.name.split("_")[0]: path for path in where.glob("*.deb")}


def test_lintian_finds_no_error(packages):
    """Breaks when a file lies where Debian does not want it, or a script is unsafe."""
    assert set(packages) == {"penumbra", "penumbra-worker", "penumbra-blender"}
    run("lintian", "--allow-root", "--fail-on", "error", *packages.values())


def test_the_add_on_is_whole(packages, tmp_path):
    """Breaks when a module that the add-on imports is not in its package, or does not compile."""
    run("dpkg-deb", "-x", packages["penumbra-blender"], tmp_path)
    addon = tmp_path / "usr/share/blender/scripts/addons/penumbra_render"
    source = ROOT / "deploy/blender/penumbra_render"
    assert sorted(p.name for p in addon.iterdir()) == sorted(p.name for p in source.glob("*.py"))
    for path in addon.iterdir():
        assert path.read_text() == (source / path.name).read_text()
        compile(path.read_text(), path.name, "exec")


@pytest.mark.parametrize("unit", UNITS)
def test_a_unit_is_confined(unit):
    """Breaks when a line of the hardening is lost: the score is systemd's own, 10 is open."""
    report = run("systemd-analyze", "security", "--offline=true", "--no-pager",
                 ROOT / "deploy/systemd" / unit)
    score = float(re.search(r"exposure level for \S+: ([\d.]+)", report)[1])
    assert score <= 1.5


def test_the_units_say_nothing_that_systemd_does_not_know(packages, tmp_path):
    """Breaks on a misspelt key or a program that is not installed where the unit starts it."""
    for package in packages.values():
        run("dpkg-deb", "-x", package, tmp_path)
    (tmp_path / "usr/share/man").rename(tmp_path / "usr/share/manuals")
    for name in ("sysinit", "basic", "sockets", "multi-user", "shutdown", "network"):
        (tmp_path / f"usr/lib/systemd/system/{name}.target").write_text(f"[Unit]\nDescription={name}\n")
    (tmp_path / "bin").mkdir(exist_ok=True)
    shutil.copy("/bin/kill", tmp_path / "bin")  # every Debian has it
    found = run("systemd-analyze", "verify", "--man=no", f"--root={tmp_path}",
                *(f"/usr/lib/systemd/system/{unit}" for unit in (*UNITS, "penumbra.socket")))
    assert found == ""


class Installed(debian.Chroot):
    """With our packages."""

    def read_ports(self, seconds=30):
        """What the coordinator says it listens on, once it does."""
        deadline = time.monotonic() + seconds
        while True:
            found = subprocess.run([*AS_ROOT, "cat", self.root / "var/lib/penumbra/ports"],
                                   capture_output=True, text=True, check=False)
            if found.returncode == 0:
                return json.loads(found.stdout)
            assert time.monotonic() < deadline, found.stderr
            time.sleep(0.05)

    def serve(self):
        """What the unit starts, as the user that it starts it as."""
        unit = (self.root / "usr/lib/systemd/system/penumbra.service").read_text()
        command = re.search(r"^ExecStart=(.*)$", unit, re.M)[1]
        command = command.replace("$PENUMBRA_OPTIONS", "")
        variables = [v.replace("%S", "/var/lib") for v in re.findall(r"^Environment=(.+)$", unit, re.M)]
        return subprocess.Popen([*AS_ROOT, "chroot", str(self.root), "setpriv", "--reuid=penumbra",
                                 "--regid=penumbra", "--clear-groups", "--no-new-privs",
                                 "env", *variables, *command.split(), "--listen", "127.0.0.1:0",
                                 "--worker-listen", "127.0.0.1:0", "--processes", "1"])


def test_a_render_outlives_an_upgrade_and_a_purge_leaves_nothing(packages, tmp_path):
    """Breaks when a dependency is missing, a script fails, or an upgrade touches the data."""
    scene = pathlib.Path("/usr/share/doc/penumbra/examples/spiral.json")
    with Installed(tmp_path / "debian") as chroot:
        # Not the add-on, which would bring Blender.
        files = [packages[name] for name in ("penumbra", "penumbra-worker")]
        for package in files:
            run(*AS_ROOT, "cp", package, chroot.root / "tmp")
        files = [f"/tmp/{package.name}" for package in files]

        def install():
            chroot.run("apt-get", "install", "-q", "-y", "--no-install-recommends", "--reinstall",
                       "--allow-downgrades", *files)

        def serving():
            chroot.run("rm", "-f", "/var/lib/penumbra/ports")
            server = chroot.serve()
            return server, f"http://127.0.0.1:{chroot.read_ports()['http']}"

        def stop(server):
            run(*AS_ROOT, "kill", server.pid)
            assert server.wait(timeout=30) == 0

        chroot.run("apt-get", "update", "-q")
        install()
        # The unit's StateDirectory= makes it where systemd runs.
        chroot.run("install", "-d", "-o", "penumbra", "-g", "penumbra", "-m", "700", "/var/lib/penumbra")
        server, url = serving()
        identity = chroot.run("penumbra", "submit", "--server", url, scene).strip()
        chroot.run("penumbra", "watch", "--server", url, identity)
        stop(server)

        # The administrator's settings outlive it too.
        settings = chroot.root / "etc/penumbra/penumbra.conf"
        run(*AS_ROOT, "sed", "-i", "s/^#log-level = .*/log-level = debug/", settings)
        install()
        assert "\nlog-level = debug\n" in settings.read_text()
        assert "correct" in chroot.run("penumbra", "config", "check")
        server, url = serving()
        listed = json.loads(chroot.run("penumbra", "list", "--server", url, "--json"))
        assert [(r["id"], r["state"]) for r in listed["renders"]] == [(identity, "done")]
        stop(server)

        chroot.run("dpkg", "--purge", "penumbra", "penumbra-worker")
        left = [str(path) for place in ("etc", "usr", "var/lib/systemd")
                for path in (chroot.root / place).rglob("*penumbra*")]
        assert left == [] and not (chroot.root / "var/lib/penumbra").exists()
