# SPDX-License-Identifier: Apache-2.0
"""Logs for programs: a line of JSON an event, with the ids of what it is about."""
import json
import os
import re
import signal
import subprocess

import farm
import scene

TRACE = "0af7651916cd43dd8448eb211c80319c"
LEVELS = {"error", "warning", "info", "debug"}


def subject(samples=64):
    return scene.build(128, 128, samples, [scene.sphere()], background=0.5)


def lines_of(service):
    """Each is an object by itself, whatever program wrote it; but for what serve prints when it is ready."""
    found = [json.loads(line) for line in service.log.read_text().splitlines()
             if not line.startswith("penumbra: ")]
    assert all(line["level"] in LEVELS and line["time"].endswith("Z") and line["message"] for line in found)
    return found


def test_a_render_with_a_death_in_it_is_told_by_ids():
    """Breaks when a line is no JSON, or a render's way cannot be followed by its ids from the request
    to the tiles of each worker."""
    with farm.Farm(2, "--log-level", "debug", "--log-format", "json") as service:
        answer = service.request("POST", "/v1/renders", json.dumps({"scene": subject(4096)}),
                                 headers={"Content-Type": "application/json", "X-Request-Id": "asked.by-me",
                                          "traceparent": f"00-{TRACE}-b7ad6b7169203331-01"})
        assert answer.status == 202 and answer.headers["X-Request-Id"] == "asked.by-me"
        render = json.loads(answer.body)["id"]
        farm.wait_for(lambda: service.resource(render)["progress"] > 0, 30, "progress")
        os.kill(service.renders()[0], signal.SIGKILL)
        service.wait(render)
        lines = lines_of(service)
    accepted = [line for line in lines if line.get("request") == "asked.by-me" and line.get("job") == render]
    assert len(accepted) == 1 and accepted[0]["trace_id"] == TRACE
    span = accepted[0]["span_id"]
    assert re.fullmatch("[0-9a-f]{16}", span) and span != "b7ad6b7169203331"
    for program in ("penumbra", "penumbra-worker"):
        units = [line for line in lines if line["program"] == program and "tile" in line]
        assert {line["tile"] for line in units} >= set(range(4))
        assert all(line["job"] == render and line["worker"] == 1 and line["trace_id"] == TRACE
                   and line["span_id"] == span for line in units)
    assert any(line["program"] == "penumbra-worker" and line["level"] == "warning" and line.get("job") == render
               for line in lines)


def test_requests_are_named():
    """Breaks when two requests have one name, or what a client calls it gets into a log or a field
    that it could break out of."""
    with farm.Farm(0, "--log-level", "debug", "--log-format", "json") as service:
        names = [service.request("GET", "/livez", headers={"X-Request-Id": given} if given else {})
                 .headers["X-Request-Id"] for given in (None, "", "a b", 'x"}', "x" * 65, "x" * 64, None)]
        told = [line["request"] for line in lines_of(service) if "request" in line]
    assert names[5] == "x" * 64 and len(set(names)) == 7
    assert all(len(name) < 40 and " " not in name and '"' not in name for name in names[:5])
    assert [name for name in told if name in names] == names


def test_a_malformed_traceparent_is_ignored():
    """Breaks when it is refused, or kept and passed on."""
    with farm.Farm(1, "--log-level", "debug", "--log-format", "json") as service:
        answer = service.request("POST", "/v1/renders", json.dumps({"scene": subject()}),
                                 headers={"Content-Type": "application/json", "traceparent": f"00-{TRACE}-0-01"})
        assert answer.status == 202
        render = json.loads(answer.body)["id"]
        service.wait(render)
        lines = [line for line in lines_of(service) if line.get("job") == render]
    assert len(lines) > 2 and not any("trace_id" in line or "span_id" in line for line in lines)


def test_a_trace_outlives_the_coordinator(tmp_path):
    """Breaks when a render that goes on after a restart has forgotten of which trace it is."""
    with farm.Farm(0, data=tmp_path / "data") as service:
        answer = service.request("POST", "/v1/renders", json.dumps({"scene": subject()}),
                                 headers={"Content-Type": "application/json",
                                          "traceparent": f"00-{TRACE}-b7ad6b7169203331-01"})
        render = json.loads(answer.body)["id"]
    with farm.Farm(1, "--log-format", "json", data=tmp_path / "data") as service:
        service.wait(render)
        done = [line for line in lines_of(service) if line.get("job") == render]
    assert done and all(line["trace_id"] == TRACE for line in done)


def test_a_format_that_is_none_is_refused():
    for program in ("penumbra", "penumbra-worker"):
        words = ["serve"] if program == "penumbra" else []
        run = subprocess.run([farm.program(program), *words, "--log-format", "xml"], capture_output=True,
                             text=True, check=False, timeout=30)
        assert run.returncode != 0 and "--log-format takes text or json" in run.stderr
