# SPDX-License-Identifier: Apache-2.0
"""Proxies' processes, their keys, and examples with a test's own values."""
import signal
import subprocess

from farm import listens, wait_for


def openssl(*words):
    subprocess.run(["openssl", *map(str, words)], capture_output=True, check=True, timeout=60)


def certificate(directory, name, authority=None):
    """name.pem with key and certificate, signed by another one or by itself."""
    key, cert, pem = (directory / f"{name}.{end}" for end in ("key", "crt", "pem"))
    signer = ["-CA", f"{authority}.crt", "-CAkey", f"{authority}.key"] if authority else []
    openssl("req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes", "-days", 2,
            "-subj", f"/CN={name}", "-addext", f"subjectAltName=DNS:{name}", *signer,
            *(["-addext", "basicConstraints=critical,CA:FALSE"] if authority else []),
            "-keyout", key, "-out", cert)
    pem.write_text(cert.read_text() + key.read_text())
    return pem


def substitute(text, *pairs):
    """Every pair must be in the text: the examples are used as they are but for these."""
    for old, new in pairs:
        assert old in text, old
        text = text.replace(old, str(new))
    return text


class Proxy:
    """A proxy's process with its port; ends with the block."""

    def __init__(self, command, *ports):
        self.command, self.ports = command, ports

    def __enter__(self):
        self.process = subprocess.Popen(list(map(str, self.command)), stdin=subprocess.DEVNULL,
                                        stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        try:
            wait_for(lambda: all(map(listens, self.ports)), 20, f"{self.command[0]} listening")
        except BaseException:
            self.__exit__()
            print(self.process.stdout.read().decode())
            raise
        return self

    def __exit__(self, *_):
        self.process.send_signal(signal.SIGTERM)
        self.process.wait(timeout=20)
