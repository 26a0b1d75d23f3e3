# SPDX-License-Identifier: Apache-2.0
"""The configuration file of `penumbra serve`, and `penumbra config check`."""
import json
import os
import subprocess

import pytest
from farm import ROOT, Farm, program, wait_for

LINE_MAX, LINES_MAX = 4095, 10000


def penumbra(*arguments, **variables):
    environment = {k: v for k, v in os.environ.items() if k != "PENUMBRA_CONFIG"}
    return subprocess.run([program("penumbra"), *map(str, arguments)], capture_output=True, text=True,
                          timeout=30, env={**environment, **variables})


def check(tmp_path, text):
    path = tmp_path / "x.conf"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    run = penumbra("config", "check", path)
    assert run.stdout == (f"{path}: correct\n" if run.returncode == 0 else "")
    return run.returncode, run.stderr.removeprefix(f"penumbra: {path}:").rstrip("\n")


@pytest.mark.parametrize("text", [
    "", "\n\n", "# all of it a comment", "processes=2", "  processes\t=  2  \r\n", "tile = 32 # pixels\n",
    "data = /srv/a b#c\n", "listen = [::1]:0\nworker-listen = localhost:0\nprocesses = 0\nisa = v3\n"
    "tile = 16\nkeep-assets = 87600\nmax-waiting = 100000\nlog-level = debug\n",
])
def test_what_is_right_is_accepted(tmp_path, text):
    """Breaks when blanks, comments, the last line without its end or a setting are not understood."""
    assert check(tmp_path, text) == (0, "")


@pytest.mark.parametrize("text, fault", [
    ("\ntiles = 32\n", '2: there is no setting "tiles"'),
    ("parent-death = 1\n", '1: there is no setting "parent-death"'),
    ("config = x.conf\n", '1: there is no setting "config"'),
    ("help = 1\n", '1: there is no setting "help"'),
    ("til = 32\n", '1: there is no setting "til"'),
    ("processes\n", "1: a line is KEY = VALUE"),
    ("= 4\n", "1: a line is KEY = VALUE"),
    ("# one\nprocesses = 1\n\nprocesses = 2", "4: processes is set above already"),
    ("tile = 24\n", "1: tile takes a multiple of 16 from 16 to 256"),
    ("tile =\n", "1: tile takes a multiple of 16 from 16 to 256"),
    ("processes = 257\n", "1: processes takes a number from 0 to 256"),
    ("max-waiting = 0\n", "1: max-waiting takes a number from 1 to 100000"),
    ("max-waiting = 100001\n", "1: max-waiting takes a number from 1 to 100000"),
    ("log-level = loud\n", "1: log-level takes error, warning, info or debug"),
    ("listen = 127.0.0.1\n", "1: listen takes ADDRESS:PORT"),
    ("data =\n", "1: data takes a directory"),
    (b"tile = 32\0\ntile = 16\n", "1: a line has at most 4095 bytes, none of which is 0"),
])
def test_what_is_wrong_is_told_with_its_line(tmp_path, text, fault):
    """Breaks when a fault is passed by in silence: the server would run with other settings than the
    administrator believes."""
    assert check(tmp_path, text) == (1, fault)


def test_bounds(tmp_path):
    """Lines one below, at and one above the longest; as many lines as may be, and one more."""
    for length in (LINE_MAX - 1, LINE_MAX):
        assert check(tmp_path, "#" * length + "\ntile = 32\n") == (0, "")
        assert check(tmp_path, "#" * length) == (0, "")
    assert check(tmp_path, "\n" + "#" * (LINE_MAX + 1) + "\n")[1].startswith("2: a line has at most 4095 bytes")
    assert check(tmp_path, "\n" * LINES_MAX) == (0, "")
    assert check(tmp_path, "\n" * (LINES_MAX + 1)) == (1, "10001: there are more than 10000 lines")


def test_the_example_is_right_with_and_without_its_comment_signs(tmp_path):
    """Breaks when a default in the example is one that serve refuses."""
    text = (ROOT / "deploy/penumbra.conf").read_text()
    assert check(tmp_path, text) == (0, "")
    lines = [line[1:] if line.startswith("#") and not line.startswith("# ") else line
             for line in text.splitlines()]
    assert sum(" = " in line for line in lines) >= 8
    assert check(tmp_path, "\n".join(lines)) == (0, "")


def test_which_file_is_checked(tmp_path):
    """The one that is named, or the variable's; a file that is not there is a fault here."""
    good, bad = tmp_path / "good.conf", tmp_path / "bad.conf"
    good.write_text("tile = 32\n")
    bad.write_text("tile = 33\n")
    assert penumbra("config", "check", PENUMBRA_CONFIG=str(bad)).returncode == 1
    assert penumbra("config", "check", good, PENUMBRA_CONFIG=str(bad)).returncode == 0
    run = penumbra("config", "check", tmp_path / "none.conf")
    assert run.returncode == 1 and "there is no file" in run.stderr
    assert penumbra("config").returncode == penumbra("config", "check", "a", "b").returncode == 2


def test_serve_refuses_a_file_that_is_wrong_or_missing(tmp_path):
    bad = tmp_path / "bad.conf"
    bad.write_text("data = x\nprocesses = many\n")
    run = penumbra("serve", "--config", bad)
    assert run.returncode == 2 and f"{bad}:2: processes takes a number" in run.stderr
    assert penumbra("serve", PENUMBRA_CONFIG=str(bad)).returncode == 2
    run = penumbra("serve", "--config", tmp_path / "none.conf")
    assert run.returncode == 2 and "there is no file" in run.stderr
    assert penumbra("serve", "--help", "--config", bad).returncode == 0


class ConfiguredFarm(Farm):
    """A farm that finds its settings in a file."""

    def __init__(self, tmp_path, words, variables=()):
        super().__init__(data=tmp_path / "data", prefix=["env", *variables])
        self.words = words

    def command(self):
        return [*self.prefix, program("penumbra"), "serve", *map(str, self.words)]


def test_serve_does_what_the_file_says_and_the_command_line_more(tmp_path):
    """Breaks when a setting of the file is lost, or wins over the command line."""
    path = tmp_path / "x.conf"
    path.write_text(f"data = {tmp_path}/data\nlisten = 127.0.0.1:0\nworker-listen = 127.0.0.1:0\n"
                    "processes = 1\n")
    for words, count in (((), 1), (("--processes", 2), 2)):
        with ConfiguredFarm(tmp_path, ["--config", path, *words]) as farm:
            workers = wait_for(lambda farm=farm: farm.get("/v1/workers")["workers"], 20, "the worker")
            assert [worker["processes"] for worker in workers] == [count]


def test_the_variables_file_need_not_exist(tmp_path):
    """As under the unit, when the administrator has removed the file."""
    words = ["--listen", "127.0.0.1:0", "--worker-listen", "127.0.0.1:0", "--processes", 0]
    with ConfiguredFarm(tmp_path, [*words, "--data", tmp_path / "data"],
                        [f"PENUMBRA_CONFIG={tmp_path}/none.conf"]) as farm:
        assert json.dumps(farm.get("/v1/farm"))
