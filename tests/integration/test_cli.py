# SPDX-License-Identifier: Apache-2.0
"""The client commands of `penumbra` against a server that gives the answers a test needs."""
import json
import os
import signal
import socket
import subprocess
import time

import pytest
from fake_server import FakeServer
from farm import program, wait_for

COMMANDS = ("render", "submit", "status", "list", "watch", "cancel", "pause", "resume", "priority", "workers", "drain", "reset")
RUNNING = {"id": "abc", "state": "running", "progress": 0.5, "samples_done": 10, "seconds": 0.1}
DONE = {**RUNNING, "state": "done", "progress": 1, "seconds": 1.5}


def penumbra(*arguments, server=None, text=None):
    environment = {key: value for key, value in os.environ.items() if key != "PENUMBRA_SERVER"}
    if server:
        environment["PENUMBRA_SERVER"] = server.url
    return subprocess.run([program("penumbra"), *arguments], env=environment, input=text,
                          capture_output=True, text=True, timeout=30)


@pytest.mark.parametrize("command", COMMANDS)
def test_each_command_explains_itself(command):
    run = penumbra(command, "--help")
    assert run.returncode == 0 and run.stdout.startswith(f"usage: penumbra {command} ")


def test_the_command_lists_its_commands_and_tells_its_version():
    run = penumbra("--help")
    assert run.returncode == 0
    assert all(f"  {command} " in run.stdout for command in (*COMMANDS, "serve", "token", "worker", "cert", "version"))
    assert penumbra("--version").stdout == penumbra("version").stdout != ""


@pytest.mark.parametrize("arguments, complaint", [
    ((), "usage: penumbra"),
    (("paint",), "no command 'paint'"),
    (("submit",), "SCENE is missing"),
    (("watch", "a", "b"), "'b' is one word too many"),
    (("list", "a"), "'a' is one word too many"),
    (("status", "--colour"), "unknown option --colour"),
    (("submit", "x.json", "-o", "x.png"), "unknown option"),
    (("submit", "x.json", "--samples"), "--samples needs a value"),
    (("submit", "x.json", "--samples", "-1"), "whole number"),
    (("submit", "x.json", "--samples", "4294967296"), "whole number"),
    (("submit", "x.json", "--size", "640"), "WIDTHxHEIGHT"),
    (("submit", "x.json", "--crop", "1,2,3"), "LEFT,TOP,RIGHT,BOTTOM"),
    (("submit", "x.json", "--mode", "random"), "uniform, edge, adaptive or interleaved"),
    (("submit", "x.json", "--time", "soon"), "a number of seconds"),
    (("submit", "x.json", "--shutter", "inf"), "a number of seconds"),
    (("submit", "x.json", "--aperture-radius", "0.5m"), "a length"),
    (("submit", "x.json", "--background", "0,0"), "RED,GREEN,BLUE"),
    (("render", "x.json"), "-o FILE is missing"),
    (("render", "x.json", "-o", "x.gif"), ".png, .exr, .jpg or .hdr"),
    (("render", "x.json", "-o", "x.png", "--processes", "0"), "from 1 to 256"),
    (("render", "x.json", "-o", "x.png", "--isa", "v9"), "v2, v3 or v4"),
])
def test_wrong_usage_is_explained(arguments, complaint):
    run = penumbra(*arguments)
    assert run.returncode == 2 and complaint in run.stderr


def test_submit_sends_the_scene_as_it_was_written():
    """Numbers must not go through a double and back, nor keys change their order."""
    scene = '{"version": 1, "z": 1.000000000000000000001, "a": 1e2}'
    with FakeServer({("POST", "/v1/renders"): (202, RUNNING)}) as server:
        run = penumbra("submit", "-", server=server, text=scene)
    assert run.returncode == 0 and run.stdout == "abc\n"
    assert server.requests[0][2].decode() == '{"scene":' + scene + "}"


def test_submit_overrides_what_the_options_say():
    with FakeServer({("POST", "/v1/renders"): (202, RUNNING)}) as server:
        run = penumbra("submit", "-", "--samples", "4", "--seed", "7", "--size", "64x32",
                       "--crop", "1,2,3,4", server=server, text="{}")
    assert run.returncode == 0
    assert json.loads(server.requests[0][2])["override"] == {
        "sampling": {"samples": 4, "seed": 7},
        "image": {"width": 64, "height": 32, "crop": [1, 2, 3, 4]}}


def test_options_of_the_camera_override_it():
    """What the scene says for another mode or kind of background must not stay beside the new."""
    with FakeServer({("POST", "/v1/renders"): (202, RUNNING)}) as server:
        run = penumbra("submit", "-", "--mode", "edge", "--aperture-radius", "0.5",
                       "--focus-distance", "2", "--time", "1.5", "--shutter", "0.25",
                       "--background", "1,0.5,0", server=server, text="{}")
    assert run.returncode == 0
    assert json.loads(server.requests[0][2])["override"] == {
        "sampling": {"mode": "edge", "error": None, "confidence": None, "min_samples": None,
                     "pattern": None},
        "camera": {"aperture_radius": 0.5, "focus_distance": 2,
                   "shutter": {"open": 1.5, "close": 1.75}},
        "background": {"color": [1, 0.5, 0], "image": None, "intensity": None, "rotation": None}}


def test_a_refused_scene_is_explained_pointer_by_pointer():
    problem = {"title": "Bad Request", "detail": "the scene has 2 errors", "errors": [
        {"pointer": "/scene/image/width", "detail": "must be at least 1"},
        {"pointer": "/scene/lights/0", "detail": "has no area"}]}
    with FakeServer({("POST", "/v1/renders"): (400, problem)}) as server:
        run = penumbra("submit", "-", server=server, text="{}")
    assert run.returncode == 4 and run.stdout == ""
    assert "the scene has 2 errors" in run.stderr
    assert "  /image/width: must be at least 1\n  /lights/0: has no area\n" in run.stderr


def test_text_that_is_no_json_is_refused_before_it_is_sent():
    with FakeServer({("POST", "/v1/renders"): (202, RUNNING)}) as server:
        run = penumbra("submit", "-", server=server, text='{"a":\n 1,]')
    assert run.returncode == 4 and "line 2, column 4" in run.stderr
    assert server.requests == []


def test_a_scene_over_the_limit_is_refused_before_it_is_sent():
    with FakeServer({("POST", "/v1/renders"): (202, RUNNING)}) as server:
        run = penumbra("submit", "-", server=server, text=" " * ((8 << 20) + 1))
    assert run.returncode == 4 and "larger than 8 MiB" in run.stderr
    assert server.requests == []


def test_no_server_is_told_apart():
    with socket.socket() as unused:
        unused.bind(("127.0.0.1", 0))
        url = f"http://127.0.0.1:{unused.getsockname()[1]}"
        run = penumbra("status", "abc", "--server", url)
    assert run.returncode == 3 and f"cannot reach {url}: nothing listens there" in run.stderr


def test_a_server_that_is_just_starting_is_waited_for():
    """Breaks when what the README has one type, serve in the background and then submit, fails."""
    answers = {("GET", "/v1/renders/abc"): (200, DONE)}
    with socket.socket() as unused:
        unused.bind(("127.0.0.1", 0))
        port = unused.getsockname()[1]
    asking = subprocess.Popen([program("penumbra"), "status", "abc", "--server", f"http://127.0.0.1:{port}"],
                              stdout=subprocess.PIPE, text=True)
    time.sleep(0.3)
    with FakeServer(answers, port=port):
        told, _ = asking.communicate(timeout=30)
    assert asking.returncode == 0 and "abc" in told


@pytest.mark.parametrize("status, answer, complaint", [
    (503, {"detail": "draining"}, "draining (503)"),
    (404, {"detail": "no such render"}, "no such render (404)"),
    (500, b"<html>", "no reason given (500)"),
    (200, b"<html>", "not a JSON object"),
    (200, b"[]", "not a JSON object"),
    (200, {"id": "../../etc", "state": "done"}, "no render"),
    (200, {"id": "abc"}, "no render"),
])
def test_strange_answers_are_failures_with_a_reason(status, answer, complaint):
    with FakeServer({("GET", "/v1/renders/abc"): (status, answer)}) as server:
        run = penumbra("status", "abc", server=server)
    assert run.returncode == 1 and complaint in run.stderr


def test_an_id_that_is_none_never_becomes_a_path():
    with FakeServer({}) as server:
        run = penumbra("cancel", "../workers", server=server)
    assert run.returncode == 1 and "no render's id" in run.stderr
    assert server.requests == []


def test_an_endless_answer_is_cut():
    with FakeServer({("GET", "/v1/farm"): (200, b" " * ((16 << 20) + 1))}) as server:
        run = penumbra("status", server=server)
    assert run.returncode == 1 and "too long" in run.stderr


def test_status_shows_a_render_or_the_farm():
    with FakeServer({("GET", "/v1/renders/abc"): (200, DONE),
                     ("GET", "/v1/farm"): (200, {"queue_depth": 3})}) as server:
        assert "state: done\n" in penumbra("status", "abc", server=server).stdout
        assert penumbra("status", server=server).stdout == "queue_depth: 3\n"
        assert json.loads(penumbra("status", "abc", "--json", server=server).stdout) == DONE


def test_the_option_beats_the_environment():
    with FakeServer({("GET", "/v1/farm"): (200, {"mine": 1})}) as mine, FakeServer({}) as other:
        run = penumbra("status", "--server", mine.url + "/", server=other)
    assert run.stdout == "mine: 1\n" and other.requests == []


def test_tables_are_aligned_and_cannot_drive_the_terminal():
    rows = [{"id": "a", "state": "done", "name": "evil\x1b[2J"},
            {"id": "bcd", "state": "running", "progress": 0.25}]
    with FakeServer({("GET", "/v1/renders"): (200, {"renders": rows})}) as server:
        lines = penumbra("list", server=server).stdout.splitlines()
    assert len({line.index(word) for line, word in zip(lines, ("state", "done", "running"))}) == 1
    assert "evil?[2J" in lines[1] and "0.25" in lines[2]


def test_workers_are_shown():
    row = {"id": 7, "name": "here", "address": "127.0.0.1:9", "processes": 2, "class": "1/v3"}
    with FakeServer({("GET", "/v1/workers"): (200, {"workers": [row]})}) as server:
        lines = penumbra("workers", server=server).stdout.splitlines()
    assert len(lines) == 2 and lines[1].split()[:4] == ["7", "here", "127.0.0.1:9", "2"]


@pytest.mark.parametrize("command, state", [("cancel", "cancelled"), ("pause", "paused"), ("resume", "running")])
def test_commands_ask_for_their_state(command, state):
    answer = {**RUNNING, "state": state}
    with FakeServer({("PATCH", "/v1/renders/abc"): (200, answer)}) as server:
        run = penumbra(command, "abc", server=server)
    assert run.returncode == 0 and run.stdout == f"abc: {state}\n"
    assert json.loads(server.requests[0][2]) == {"state": state}


def test_priority_asks_for_its_number():
    answer = {**RUNNING, "priority": 70}
    with FakeServer({("PATCH", "/v1/renders/abc"): (200, answer)}) as server:
        run = penumbra("priority", "abc", "70", server=server)
        whole = penumbra("priority", "--json", "abc", "0", server=server)
    assert run.returncode == 0 and run.stdout == "abc: priority 70\n"
    assert whole.returncode == 0 and json.loads(whole.stdout) == answer
    assert [json.loads(request[2]) for request in server.requests] == [{"priority": 70}, {"priority": 0}]


@pytest.mark.parametrize("words", [("abc",), ("abc", ""), ("abc", "101"), ("abc", "7x"), ("abc", "4294967346"),
                                   ("abc", "-1"), ("abc", "7", "8")])
def test_priority_refuses_what_is_none(words):
    with FakeServer({}) as server:
        run = penumbra("priority", *words, server=server)
    assert run.returncode == 2 and "penumbra priority --help" in run.stderr
    assert server.requests == []


@pytest.mark.parametrize("command, state", [("drain", "draining"), ("reset", "ready")])
def test_a_worker_is_drained_and_reset(command, state):
    row = {"id": "7", "name": "here", "state": state}
    with FakeServer({("POST", f"/v1/workers/7/{command}"): (200, row)}) as server:
        run = penumbra(command, "7", server=server)
        shown = penumbra(command, "--json", "7", server=server)
        strange = penumbra(command, "../renders", server=server)
    assert run.returncode == 0 and run.stdout == f"7: {state}\n"
    assert json.loads(shown.stdout) == row
    assert strange.returncode == 1 and "no worker's id" in strange.stderr
    assert len(server.requests) == 2


def test_a_worker_that_is_not_there_cannot_be_drained():
    with FakeServer({("POST", "/v1/workers/8/drain"): (404, {"detail": "no such worker"})}) as server:
        run = penumbra("drain", "8", server=server)
    assert run.returncode == 1 and "no such worker (404)" in run.stderr


@pytest.mark.parametrize("answer", [{"id": "7"}, {"id": "7", "state": "\x1b[2J"}])
def test_a_strange_worker_cannot_drive_the_terminal(answer):
    with FakeServer({("POST", "/v1/workers/7/drain"): (200, answer)}) as server:
        run = penumbra("drain", "7", server=server)
    assert run.returncode == 1 and "no worker" in run.stderr and "\x1b" not in run.stdout + run.stderr


def test_watch_follows_until_the_render_is_done():
    with FakeServer({("GET", "/v1/renders/abc"): [(200, RUNNING)] * 5 + [(200, DONE)]}) as server:
        run = penumbra("watch", "abc", server=server)
    assert run.returncode == 0 and run.stdout == "abc: done in 1.50 s\n"
    assert len(server.requests) == 6


def test_watch_tells_why_a_render_failed():
    failed = {**RUNNING, "state": "failed", "error": "tile 3 crashed three times",
              "errors": [{"pointer": "/objects/2", "detail": "too large"}]}
    with FakeServer({("GET", "/v1/renders/abc"): [(200, RUNNING), (200, failed)]}) as server:
        run = penumbra("watch", "abc", server=server)
    assert run.returncode == 1 and "tile 3 crashed three times" in run.stderr
    assert "  /objects/2: too large" in run.stderr


def test_warnings_are_shown_and_cannot_drive_the_terminal():
    """Breaks when a finished render hides what it lacks, or a file's bytes reach the terminal."""
    done = {**DONE, "warnings": ["/objects/0: left out \u00e4", "a\u001b[2Jb"]}
    failed = {**DONE, "state": "failed", "error": "bad",
              "errors": [{"pointer": "/objects/2\n", "detail": "too \u001blarge"}]}
    with FakeServer({("GET", "/v1/renders/abc"): (200, done),
                     ("GET", "/v1/renders/abd"): (200, failed)}) as server:
        watched = penumbra("watch", "abc", server=server)
        shown = penumbra("status", "abc", server=server).stdout
        broken = penumbra("status", "abd", server=server).stdout
    assert watched.returncode == 0
    assert "penumbra: warning: /objects/0: left out \u00e4\n" in watched.stderr
    assert "warning: /objects/0: left out \u00e4\nwarning: a\n" in shown
    assert "  /objects/2: too \n" in broken
    assert "\x1b" not in watched.stderr + shown + broken


def test_watch_outlives_a_restart_of_the_server():
    answers = {("GET", "/v1/renders/abc"): (200, RUNNING)}
    with FakeServer(answers) as server:
        watch = subprocess.Popen([program("penumbra"), "watch", "abc", "--server", server.url],
                                 stdout=subprocess.PIPE, text=True)
        wait_for(lambda: len(server.requests) > 2, 10, "polls of the first server")
    time.sleep(0.5)
    with FakeServer({("GET", "/v1/renders/abc"): (200, DONE)}, port=server.port):
        assert watch.communicate(timeout=10)[0] == "abc: done in 1.50 s\n"
    assert watch.returncode == 0


def test_ctrl_c_ends_watching_and_leaves_the_render_alone():
    with FakeServer({("GET", "/v1/renders/abc"): (200, RUNNING)}) as server:
        watch = subprocess.Popen([program("penumbra"), "watch", "abc", "--server", server.url],
                                 stderr=subprocess.PIPE, text=True)
        wait_for(lambda: len(server.requests) > 2, 10, "polls")
        watch.send_signal(signal.SIGINT)
        assert "interrupted" in watch.communicate(timeout=5)[1]
    assert watch.returncode == 130
    assert {method for method, _, _ in server.requests} == {"GET"}


def test_ctrl_c_ends_a_request_that_gets_no_answer():
    with socket.create_server(("127.0.0.1", 0)) as silent:
        url = f"http://127.0.0.1:{silent.getsockname()[1]}"
        status = subprocess.Popen([program("penumbra"), "status", "--server", url])
        connection, _ = silent.accept()
        status.send_signal(signal.SIGINT)
        assert status.wait(5) == 130
        connection.close()
