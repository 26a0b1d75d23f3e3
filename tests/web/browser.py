# SPDX-License-Identifier: Apache-2.0
"""A headless Chromium that plays scenarios, through driver.mjs and playwright-core."""
import json
import pathlib
import subprocess

import farm

HERE = pathlib.Path(__file__).resolve().parent
CHROMIUM = "/usr/bin/chromium"


def install():
    """playwright-core as package-lock.json has it, once."""
    lock, installed = HERE / "package-lock.json", HERE / "node_modules/.package-lock.json"
    if not installed.exists() or installed.stat().st_mtime < lock.stat().st_mtime:
        subprocess.run(["npm", "ci", "--no-audit", "--no-fund"], cwd=HERE, check=True, timeout=120)


class Browser:
    def __enter__(self):
        install()
        self.node = subprocess.Popen(["node", HERE / "driver.mjs", CHROMIUM], text=True,
                                     stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        assert self._hear() == {"ready": True}
        return self

    def __exit__(self, *_):
        self.node.stdin.close()
        try:
            self.node.wait(timeout=10)
        except subprocess.TimeoutExpired:
            self.node.kill()
            self.node.wait()

    def _say(self, value):
        self.node.stdin.write(json.dumps(value) + "\n")
        self.node.stdin.flush()

    def _hear(self):
        line = self.node.stdout.readline()
        assert line, "the driver has ended"
        return json.loads(line)

    def play(self, scenario, service, calls=None, **args):
        """What the scenario tells; AssertionError with what went wrong. calls: what it may have done
        outside of the browser."""
        url = f"http://127.0.0.1:{service.http_port}"
        args["timeout"] = 30000 * farm.SLOW
        self._say({"scenario": scenario, "url": url, "args": args})
        while "call" in (heard := self._hear()):
            self._say({"result": calls[heard["call"]]()})
        assert heard["ok"], heard["error"]
        return heard.get("result")
