#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""A new user's path, in a Debian 12 that has nothing but git and sudo: from the clone to the demo's
image, and on to an own GLB that is dropped on the page in a browser. What is typed is what README.md
says. Writes the seconds of each step to tests/results/new_user.txt.

The browser is this machine's: the network is shared. Needs root, or sudo.
"""
import base64
import datetime
import pathlib
import re
import subprocess
import sys
import tempfile
import time
import types
import urllib.request

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "tests" / part) for part in ("support", "web")]

# pylint: disable=wrong-import-position
import browser
import debian
import glb

RESULTS = ROOT / "tests/results/new_user.txt"
USER = "ada"
PORT = 8080
HOME = pathlib.Path(f"/home/{USER}")


def block(heading, number):
    """A block of commands below a heading of README.md."""
    text = (ROOT / "README.md").read_text(encoding="utf-8").split(f"{heading}\n", 1)[1]
    return re.findall(r"```sh\n(.*?)```", text, re.S)[number]


class Path:
    def __init__(self, chroot):
        self.chroot, self.rows = chroot, []

    def command(self, script, where):
        return [*debian.AS_ROOT, "chroot", str(self.chroot.root), "su", "-", USER, "-c",
                f"cd {where}\nset -eu\n{script}"]

    def step(self, what, call):
        """Tells how long it took."""
        begin = time.monotonic()
        found = call()
        self.rows.append(f"{time.monotonic() - begin:8.1f} s  {what}")
        print(self.rows[-1], flush=True)
        return found

    def type(self, what, script, where=HOME / "penumbra"):
        return self.step(what, lambda: debian.run(*self.command(script, where), timeout=3600))


def prepare(chroot):
    """Git, sudo, a user who may use it, and the repository where a clone can be had from."""
    chroot.run("apt-get", "update", "-q")
    chroot.run("apt-get", "install", "-q", "-y", "--no-install-recommends", "git", "sudo",
               "ca-certificates", "procps")
    chroot.run("useradd", "--create-home", "--shell", "/bin/bash", USER)
    chroot.run("sh", "-c", f"echo '{USER} ALL=(ALL) NOPASSWD: ALL' >/etc/sudoers.d/{USER}")
    debian.run(*debian.AS_ROOT, "git", "-c", "safe.directory=*", "clone", "-q", "--bare", "--no-local", ROOT,
               chroot.root / "srv/penumbra.git")
    chroot.run("chown", "-R", USER, "/srv/penumbra.git")


def model():
    """A GLB with a camera and a triangle that shines."""
    tree, data = glb.triangle(
        {"emissiveFactor": [1, 0.5, 0]}, scenes=[{"nodes": [0, 1]}],
        nodes=[{"mesh": 0}, {"camera": 0, "translation": [0, 0, 3]}],
        cameras=[{"type": "perspective", "perspective": {"yfov": 0.9, "znear": 0.1}}])
    return base64.b64encode(glb.glb(tree, data)).decode()


def answers():
    for _ in range(600):
        try:
            return urllib.request.urlopen(f"http://127.0.0.1:{PORT}/livez", timeout=1)
        except OSError:
            time.sleep(0.05)
    raise AssertionError("the coordinator does not answer")


def drop_a_model():
    with browser.Browser() as window:
        window.play("drop", types.SimpleNamespace(http_port=PORT), glb=model())


def walk(path):
    path.type("git clone", "git clone -q /srv/penumbra.git", HOME)
    told = path.type("deploy/demo.sh: install, build, render", "deploy/demo.sh")
    assert "spiral.exr" in told
    path.type("the first command of the quick tour", block("## Quick tour", 0))
    # What the tour starts in the background lives as long as this shell.
    script = block("## Quick tour", 1) + "\nwait"
    serving = subprocess.Popen(path.command(script, HOME / "penumbra"))
    try:
        path.step("penumbra serve answers", answers)
        path.step("the page, a GLB dropped on it, its image", drop_a_model)
    finally:
        path.chroot.run("pkill", "-x", "-u", USER, "penumbra")
        serving.wait(timeout=60)


def main():
    with tempfile.TemporaryDirectory(prefix="penumbra-new-user-") as place, \
            debian.Chroot(pathlib.Path(place) / "debian") as chroot:
        path = Path(chroot)
        path.step("not the user's: a Debian 12, git, sudo, a user", lambda: prepare(chroot))
        walk(path)
    head = ["git", "-c", "safe.directory=*", "rev-parse", "--short", "HEAD"]
    commit = subprocess.run(head, cwd=ROOT, stdout=subprocess.PIPE, text=True, check=True).stdout
    RESULTS.write_text("\n".join([
        f"tests/run.sh long new_user, {datetime.date.today().isoformat()}, commit {commit.strip()}, "
        "2 cores; packages come from a mirror near by", *path.rows, ""]))


if __name__ == "__main__":
    main()
