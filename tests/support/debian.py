# SPDX-License-Identifier: Apache-2.0
"""A Debian 12 of its own below a directory, fresh from the mirror."""
import os
import subprocess

AS_ROOT = [] if os.geteuid() == 0 else ["sudo", "-n"]


def run(*command, **more):
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True, check=False,
                          **{"timeout": 600, **more})
    assert done.returncode == 0, f"{command}: {done.stdout[-2000:]}\n{done.stderr[-2000:]}"
    return done.stdout


def mirror():
    """Where this machine takes its own packages from."""
    policy = run("apt-get", "indextargets", "--format", "$(SITE) $(CODENAME) $(COMPONENT)")
    return next(line.split()[0] for line in policy.splitlines() if line.endswith("bookworm main"))


class Chroot:
    """A Debian of its own, with proc and devices while it is in use."""

    def __init__(self, root):
        self.root = root

    def __enter__(self):
        run(*AS_ROOT, "debootstrap", "--variant=minbase", "bookworm", self.root, mirror())
        for name in ("proc", "dev", "sys"):
            run(*AS_ROOT, "mount", "--rbind", f"/{name}", self.root / name)
            run(*AS_ROOT, "mount", "--make-rslave", self.root / name)
        run(*AS_ROOT, "cp", "/etc/resolv.conf", self.root / "etc/resolv.conf")
        return self

    def __exit__(self, *_):
        for name in ("proc", "dev", "sys"):
            subprocess.run([*AS_ROOT, "umount", "-l", self.root / name], check=False)
        run(*AS_ROOT, "rm", "-r", "--one-file-system", self.root)

    def run(self, *command):
        return run(*AS_ROOT, "chroot", self.root, "env", "DEBIAN_FRONTEND=noninteractive", *command)
