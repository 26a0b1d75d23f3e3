# SPDX-License-Identifier: Apache-2.0
"""`penumbra render` from the command line to the file: nothing may stand in for its parts here."""
import json
import os
import pty
import signal
import stat
import subprocess

import OpenImageIO as oiio
import pytest
import scene
from farm import SLOW, alive, children, descendants, program, wait_for

SMALL = scene.build(48, 32, 4, [scene.sphere()], background=1.0)
ENDLESS = scene.build(640, 360, 65536, [scene.sphere()], background=1.0, integrator="path")
MAGIC = {"png": b"\x89PNG\r\n\x1a\n", "exr": b"\x76\x2f\x31\x01", "jpg": b"\xff\xd8\xff",
         "hdr": b"#?RADIANCE"}


@pytest.fixture
def place(tmp_path):
    """A directory with the scenes, and an empty one that TMPDIR points to."""
    (tmp_path / "tmp").mkdir()
    (tmp_path / "small.json").write_text(json.dumps(SMALL))
    (tmp_path / "endless.json").write_text(json.dumps(ENDLESS))
    return tmp_path


def start(place, *arguments, **more):
    environment = {**os.environ, "TMPDIR": str(place / "tmp")}
    return subprocess.Popen([program("penumbra"), "render", *arguments], cwd=place,
                            env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                            text=True, **more)


def render(place, *arguments):
    process = start(place, *arguments)
    out, err = process.communicate(timeout=60 * SLOW)
    return subprocess.CompletedProcess(arguments, process.returncode, out, err)


def names(place):
    return {path.name for path in place.iterdir()}


def rendering(process):
    """The whole family of a render, once its render processes (the fifth generation) work."""
    def generations():
        family, level = [], [process.pid]
        for _ in range(5):
            level = [child for pid in level for child in children(pid)]
            family += level
        return family if level else None

    return wait_for(generations, 20, "render processes")


def assert_nothing_left(place, family, before):
    wait_for(lambda: not any(map(alive, family)), 5, "end of the farm's processes")
    assert names(place) == before and not names(place / "tmp")


def test_every_format_is_written(place):
    run = render(place, "small.json", *[word for ext in MAGIC for word in ("-o", f"out.{ext}")])
    assert run.returncode == 0, run.stderr
    assert [line.split(":")[0] for line in run.stdout.splitlines()] == [f"out.{e}" for e in MAGIC]
    for extension, magic in MAGIC.items():
        path = place / f"out.{extension}"
        assert path.read_bytes().startswith(magic)
        spec = oiio.ImageInput.open(str(path)).spec()
        assert (spec.width, spec.height) == (48, 32)
    assert not names(place / "tmp")


def test_a_background_of_one_comes_out_as_one(place):
    """The values, not only the file: a corner of the image shows the background alone."""
    run = render(place, "small.json", "-o", "out.exr", "--quiet")
    assert (run.returncode, run.stdout, run.stderr) == (0, "", "")
    pixels = oiio.ImageInput.open(str(place / "out.exr")).read_image("float")
    assert pixels[0][0][0] == 1.0 and pixels[-1][-1][2] == 1.0


def test_options_override_the_scene(place):
    run = render(place, "small.json", "-o", "out.exr", "--size", "20x10", "--samples", "2",
                 "--processes", "1", "--seed", "5", "--json")
    assert run.returncode == 0, run.stderr
    spec = oiio.ImageInput.open(str(place / "out.exr")).spec()
    resource = json.loads(run.stdout)
    assert (spec.width, spec.height) == (20, 10)
    assert resource["state"] == "done" and resource["samples_done"] == 20 * 10 * 2


def test_the_scene_may_come_from_standard_input(place):
    with open(place / "small.json") as text:
        process = start(place, "-", "-o", "out.png", stdin=text)
    assert process.communicate(timeout=60)[1] == "" and process.returncode == 0


def test_a_refused_scene_leaves_nothing(place):
    (place / "bad.json").write_text(json.dumps({**SMALL, "colour": 1}))
    (place / "out.png").write_text("older image")
    before = names(place)
    run = render(place, "bad.json", "-o", "out.png")
    assert run.returncode == 4 and "  /colour: " in run.stderr
    assert (place / "out.png").read_text() == "older image"
    assert names(place) == before and not names(place / "tmp")


@pytest.mark.parametrize("arguments, code", [
    (("nowhere.json", "-o", "out.png"), 1),
    (("small.json", "-o", "nowhere/out.png"), 1),
    (("small.json", "-o", "out.png", "--size", "0x10"), 4),
])
def test_failures_have_a_reason_and_leave_nothing(place, arguments, code):
    before = names(place)
    run = render(place, *arguments)
    assert run.returncode == code and run.stderr.startswith("penumbra: ")
    assert names(place) == before and not names(place / "tmp")


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_an_interrupt_ends_everything_in_order(place, number):
    before = names(place)
    process = start(place, "endless.json", "-o", "out.png")
    family = rendering(process)
    process.send_signal(number)
    assert "interrupted" in process.communicate(timeout=15 * SLOW)[1]
    assert process.returncode == 130
    assert_nothing_left(place, family, before)


def test_a_killed_coordinator_is_a_failure(place):
    before = names(place)
    process = start(place, "endless.json", "-o", "out.png")
    family = rendering(process)
    os.kill(children(process.pid)[0], signal.SIGKILL)
    assert process.communicate(timeout=15 * SLOW)[1] != ""
    assert process.returncode in (1, 3)
    assert_nothing_left(place, family, before)


def test_a_killed_command_takes_its_farm_along(place):
    process = start(place, "endless.json", "-o", "out.png")
    family = rendering(process)
    process.kill()
    process.communicate(timeout=5)
    wait_for(lambda: not any(map(alive, family)), 15, "end of the farm's processes")


def test_the_private_directory_is_private(place):
    process = start(place, "endless.json", "-o", "out.png")
    family = rendering(process)
    (directory,) = (place / "tmp").iterdir()
    mode = stat.S_IMODE(directory.stat().st_mode)
    process.send_signal(signal.SIGINT)
    process.communicate(timeout=15 * SLOW)
    assert mode == 0o700 and not any(map(alive, family))


def test_a_terminal_gets_a_bar_and_quiet_means_quiet(place):
    """The bar must go before the result is printed, and --quiet leaves nothing on the terminal."""
    for arguments in ((), ("--quiet",)):
        ours, theirs = pty.openpty()
        process = subprocess.Popen(
            [program("penumbra"), "render", "endless.json", "-o", "out.png", *arguments],
            cwd=place, stdout=subprocess.DEVNULL, stderr=theirs)
        os.close(theirs)
        if arguments:
            rendering(process)
            process.send_signal(signal.SIGINT)
            assert os.read(ours, 4096) == b"penumbra: interrupted\r\n"
        else:
            text = b""
            while b"samples/s" not in text:
                text += os.read(ours, 4096)
            assert b"\r[" in text and b"%" in text
            process.send_signal(signal.SIGINT)
        process.wait(timeout=15 * SLOW)
        os.close(ours)


def test_a_pipe_gets_plain_lines(place):
    process = start(place, "endless.json", "-o", "out.png")
    line = process.stderr.readline()
    process.send_signal(signal.SIGINT)
    process.communicate(timeout=15 * SLOW)
    assert "%" in line and "\r" not in line and "\x1b" not in line


def test_processes_sets_the_number_of_render_processes(place):
    process = start(place, "endless.json", "-o", "out.png", "--processes", "3")
    family = rendering(process)

    def generation(n):
        level = [process.pid]
        for _ in range(n):
            level = [child for pid in level for child in children(pid)]
        return level

    wait_for(lambda: len(generation(5)) == 3, 10, "three render processes")
    process.send_signal(signal.SIGINT)
    process.communicate(timeout=15 * SLOW)
    assert not any(map(alive, family)) and descendants(process.pid) == []
