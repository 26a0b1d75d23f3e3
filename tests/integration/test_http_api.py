# SPDX-License-Identifier: Apache-2.0
"""The HTTP contract against the real interface and encoders over fake renders, which stand still
in each state (tests/support/fake_jobs.h)."""
import collections
import http.client
import json
import os
import re
import select
import signal
import socket
import subprocess
import tempfile
import time

import farm
import pytest
import scene
from http_server import JSON, Server, problem

SCENE = scene.build(8, 8, 1, [scene.sphere()])
FORMATS = {"png": b"\x89PNG", "jpg": b"\xff\xd8\xff", "exr": b"v/1\x01", "hdr": b"#?RADIANCE"}
MIB = 1 << 20


@pytest.fixture(scope="module")
def server():
    with Server() as running:
        yield running


# Submitting


def test_a_scene_is_accepted(server):
    """Breaks if status, Location, Retry-After or the resource differ from the contract."""
    answer = server.post(SCENE)
    resource = json.loads(answer.body)
    assert answer.status == 202
    assert answer.headers["Location"] == f"/v1/renders/{resource['id']}"
    assert int(answer.headers["Retry-After"]) >= 1
    assert resource["state"] == "queued" and resource["progress"] == 0
    fields = """id state progress samples_done tiles_done tiles_total frames eta_seconds created
                started finished seconds class content restarts warnings error errors links"""
    assert set(fields.split()) <= set(resource)
    assert server.get(answer.headers["Location"]).status == 200


@pytest.mark.parametrize("content_type", [
    "application/json", "application/json; charset=utf-8", "Text/JSON",
    "application/x-www-form-urlencoded", None])
def test_content_types_that_are_read_as_json(server, content_type):
    """Breaks if curl --data stops working without a header, or a parameter refuses a body."""
    headers = {"Content-Type": content_type} if content_type else {}
    assert server.post(SCENE, headers.items()).status == 202


@pytest.mark.parametrize("content_type", ["model/gltf+json", "text/plain", "application/jsonx",
                                          "multipart/form-data; boundary=x"])
def test_other_content_types_are_refused(server, content_type):
    problem(server.post(SCENE, {"Content-Type": content_type}.items()), 415)


def test_an_envelope_is_opened(server):
    """Breaks if options get lost or an override is not merged before the scene is checked."""
    answer = server.post({"scene": {**SCENE, "image": {"width": 0, "height": 8}},
                          "override": {"image": {"width": 8}, "camera": None},
                          "options": {"name": "Tür", "priority": 7, "verify": "none",
                                      "preview": False}})
    resource = json.loads(answer.body)
    assert answer.status == 202
    assert (resource["name"], resource["priority"]) == ("Tür", 7)


ENVELOPES = [
    ({"scene": "sha256:" + "0" * 64}, "/scene"),
    ({"scene": 5}, "/scene"),
    ({"scene": SCENE, "overide": {}}, "/overide"),
    ({"scene": SCENE, "a/~b": {}}, "/a~1~0b"),
    ({"scene": SCENE, "x" * 4000: {}}, ""),
    ({"scene": SCENE, "override": []}, "/override"),
    ({"scene": {**SCENE, "x": 1}}, "/scene/x"),
    ({"scene": SCENE, "override": {"image": {"width": -1}}}, "/scene/image/width"),
    ({"scene": SCENE, "options": []}, "/options"),
    ({"scene": SCENE, "options": {"colour": 1}}, "/options/colour"),
    ({"scene": SCENE, "options": {"priority": 101}}, "/options/priority"),
    ({"scene": SCENE, "options": {"priority": -1}}, "/options/priority"),
    ({"scene": SCENE, "options": {"priority": 5.5}}, "/options/priority"),
    ({"scene": SCENE, "options": {"name": "x" * 257}}, "/options/name"),
    ({"scene": SCENE, "options": {"name": 1}}, "/options/name"),
    ({"scene": SCENE, "options": {"deadline_s": 0}}, "/options/deadline_s"),
    ({"scene": SCENE, "options": {"verify": "fully"}}, "/options/verify"),
    ({"scene": SCENE, "options": {"preview": 1}}, "/options/preview"),
    ({"scene": SCENE, "options": {"replaces": "x"}}, "/options/replaces"),
]


@pytest.mark.parametrize("body, pointer", ENVELOPES)
def test_a_wrong_envelope_is_refused_with_its_pointer(server, body, pointer):
    """Breaks if something not offered is passed over in silence, or blamed on the wrong place."""
    answer = server.post(body)
    errors = problem(answer, 400)["errors"]
    assert [error["pointer"] for error in errors] == [pointer] and errors[0]["detail"]
    assert answer.ms < 50 * farm.SLOW


def test_every_offender_is_named_at_once(server):
    body = {"scene": {**SCENE, "x": 1, "y": 2}}
    assert {e["pointer"] for e in problem(server.post(body), 400)["errors"]} == \
        {"/scene/x", "/scene/y"}


@pytest.mark.parametrize("size", [4, 256, 257])
def test_the_longest_name_is_taken(server, size):
    answer = server.post({"scene": SCENE, "options": {"name": "n" * size}})
    assert answer.status == (202 if size <= 256 else 400)


@pytest.mark.parametrize("body, place", [
    (b"", "line 1"), (b"{", "line 1"), (b'{"version": 1,\n "image": tru}', "line 2"),
    (b"[" * 10000, "byte"), (b'{"a": 1e400}', "byte"), (b'{"a": NaN}', "byte"),
    (b'{"a": "\xff"}', "byte"), (b'{"a": 1} x', "byte"), (b"[]", "")])
def test_what_is_no_json_is_refused_with_its_place(server, body, place):
    answer = server.post(body)
    found = problem(answer, 400)
    assert place in found["detail"] or found["errors"]
    assert answer.ms < 50 * farm.SLOW


def test_input_is_not_echoed(server):
    """Breaks if an error repeats a value, which a page could be made to run."""
    body = {**SCENE, "image": {"width": "<script>", "height": 8}}
    assert b"script" not in server.post(body).body
    assert b"script" not in server.post("<script>").body
    assert b"script" not in server.get("/v1/renders/<script>").body
    assert b"script" not in server.get("/<script>").body


@pytest.mark.parametrize("name, status", [("full", 429), ("disk", 507), ("broken", 500)])
def test_a_submission_that_fails_is_told(server, name, status):
    """Breaks if a render that was not stored is called accepted."""
    answer = server.post({"scene": SCENE, "options": {"name": name}})
    problem(answer, status)
    assert ("Retry-After" in answer.headers) == (status == 429)


def test_a_large_scene_is_read_beside_the_loop(server):
    """Breaks if a large scene is lost, or keeps a small request waiting while it is read."""
    vertices = [[x / 7, 0, 1] for x in range(60000)] + [[0, 1, 0]]
    mesh = {"type": "mesh", "material": "white", "vertices": vertices, "indices": [0, 1, 60000]}
    body = json.dumps(scene.build(8, 8, 1, [mesh])).encode()
    assert MIB < len(body) < 8 * MIB
    with socket.create_connection(("127.0.0.1", server.port)) as link:
        link.sendall(b"POST /v1/renders HTTP/1.1\r\nHost: localhost\r\nContent-Length: %d\r\n\r\n"
                     % len(body) + body)
        start, waits = time.monotonic(), []
        while not select.select([link], [], [], 0)[0]:
            waits.append(server.get("/livez").ms)
        elapsed = (time.monotonic() - start) * 1000
        assert link.recv(65536).startswith(b"HTTP/1.1 202")
    assert max(waits) < elapsed / 2


# Bodies that are too large


def too_large(size):
    return [b"x" * MIB] * (size // MIB) + [b"x" * (size % MIB)]


@pytest.mark.parametrize("size", [8 * MIB + (64 << 10) + 1, 300 * MIB])
def test_a_large_body_is_refused_at_once_and_read_by_http_client(server, size):
    """Breaks if the connection is reset while the client still sends: it would lose the answer."""
    connection = http.client.HTTPConnection("127.0.0.1", server.port, timeout=20)
    connection.request("POST", "/v1/renders", b"x" * size, JSON)
    answer = connection.getresponse()
    found = json.loads(answer.read())
    connection.close()
    assert answer.status == found["status"] == 413


def test_a_large_body_is_refused_before_it_is_sent(server):
    """Breaks if the answer waits for the body: within 50 ms of the header, whatever follows."""
    with socket.create_connection(("127.0.0.1", server.port)) as link:
        start = time.monotonic()
        link.sendall(b"POST /v1/renders HTTP/1.1\r\nHost: localhost\r\n"
                     b"Content-Length: 314572800\r\n\r\nx")
        got = link.recv(65536)
        assert (time.monotonic() - start) * 1000 < 50 * farm.SLOW
        assert got.startswith(b"HTTP/1.1 413")


def test_a_large_chunked_body_is_refused(server):
    """Breaks if a body without a length is kept however long it is."""
    connection = http.client.HTTPConnection("127.0.0.1", server.port, timeout=20)
    connection.request("POST", "/v1/renders", iter(too_large(40 * MIB)), JSON)
    assert connection.getresponse().status == 413
    connection.close()


@pytest.mark.parametrize("expect", ["Expect: 100-continue", "Expect:"])
def test_curl_reads_the_refusal(server, expect):
    with tempfile.NamedTemporaryFile() as body:
        body.truncate(300 * MIB)
        run = subprocess.run(
            ["curl", "-s", "-w", "%{http_code}", "-H", expect, "--data-binary", f"@{body.name}",
             f"http://127.0.0.1:{server.port}/v1/renders"], capture_output=True, text=True,
            timeout=30)
    assert run.returncode == 0 and run.stdout.endswith("413"), run


def test_the_largest_body_is_taken(server):
    body = json.dumps(SCENE).encode()
    assert server.post(body.ljust(8 * MIB + (64 << 10))).status in (202, 400)


def test_the_bodies_of_all_requests_together_are_bounded():
    """Breaks if many large bodies fill the memory, or the room they took is not given back."""
    with Server() as server:
        head = b"POST /v1/renders HTTP/1.1\r\nHost: localhost\r\nContent-Length: %d\r\n\r\n"
        links = [socket.create_connection(("127.0.0.1", server.port)) for _ in range(40)]
        for link in links:
            link.sendall(head % (8 * MIB) + b" " * (8 * MIB - 1))
        refused = farm.wait_for(lambda: select.select(links, [], [], 0)[0], 5, "a refusal")
        assert refused[0].recv(65536).startswith(b"HTTP/1.1 503")
        assert server.get("/livez").status == 200
        for link in links:
            link.close()
        farm.wait_for(lambda: server.post(json.dumps(SCENE).ljust(8 * MIB)).status == 202, 5,
                      "room for a body")


# The resource


@pytest.mark.parametrize("state", ["queued", "running", "paused", "done", "failed", "cancelled"])
def test_the_resource_of_each_state(server, state):
    answer = server.get(f"/v1/renders/{state}")
    resource = json.loads(answer.body)
    over = state in farm.FINAL
    assert answer.status == 200 and resource["state"] == state
    assert ("Retry-After" in answer.headers) != over
    assert (resource["error"] is not None) == (state == "failed")
    assert resource["links"]["self"] == f"/v1/renders/{state}"


def test_polling_with_an_etag(server):
    """Breaks if a poll that changes nothing costs a body, or a change is hidden by a 304."""
    path = "/v1/renders/paused"
    first = server.get(path)
    etag = first.headers["ETag"]
    assert etag.startswith('W/"')
    for condition in [etag, etag[2:], f'"x", {etag}', "*"]:
        again = server.get(path, If_None_Match=condition)
        assert (again.status, again.body) == (304, b"") and again.headers["ETag"] == etag
    assert server.get(path, If_None_Match='W/"other"').status == 200
    server.ask("PATCH", path, '{"priority": 3}', JSON)
    changed = server.get(path, If_None_Match=etag)
    assert changed.status == 200 and changed.headers["ETag"] != etag


def test_head_tells_what_get_tells(server):
    for path in ["/v1/renders/done", "/v1/renders/done/image.png", "/v1/renders", "/livez"]:
        get, head = server.get(path), server.ask("HEAD", path)
        names = set(get.headers) - {"Date", "X-Request-Id"}
        assert (head.status, head.body) == (get.status, b"")
        assert {n: head.headers[n] for n in names} == {n: get.headers[n] for n in names}


def test_the_list_is_paged_newest_first(server):
    """Breaks if a page repeats or loses a render, or ends early."""
    everything = json.loads(server.get("/v1/renders?limit=500").body)
    ids = [r["id"] for r in everything["renders"]]
    assert everything["next"] is None and ids[-6:] == list(
        reversed(["queued", "running", "paused", "done", "failed", "cancelled"]))
    found, cursor = [], ""
    while cursor is not None:
        page = json.loads(server.get(f"/v1/renders?limit=4{cursor and '&cursor=' + cursor}").body)
        assert 0 < len(page["renders"]) <= 4
        found += [r["id"] for r in page["renders"]]
        cursor = page["next"]
    assert found == ids


def test_the_list_of_one_state(server):
    found = json.loads(server.get("/v1/renders?state=done").body)
    assert [r["id"] for r in found["renders"]] == ["done"] and found["next"] is None


@pytest.mark.parametrize("query", ["limit=0", "limit=501", "limit=x", "limit=-1", "state=gone",
                                   "cursor=x", "cursor=99999999999999999999"])
def test_a_wrong_query_of_the_list(server, query):
    problem(server.get(f"/v1/renders?{query}"), 400)


# Changing


def test_pause_run_cancel_and_delete(server):
    """Breaks if a change is told before it holds, or a removed render is called unknown."""
    path = server.post(SCENE).headers["Location"]
    for state in ["paused", "running", "cancelled"]:
        answer = server.ask("PATCH", path, json.dumps({"state": state}), JSON)
        assert answer.status == 200 and json.loads(answer.body)["state"] == state
    problem(server.ask("PATCH", path, '{"state": "running"}', JSON), 409)
    assert server.ask("DELETE", path).status == 204
    problem(server.ask("DELETE", path), 404)


@pytest.mark.parametrize("body", ["", "{}", "[]", '{"state": "done"}', '{"state": 1}',
                                  '{"priority": 101}', '{"priority": -1}', '{"priority": "5"}',
                                  '{"state": "paused", "priority": 5}', '{"name": "x"}'])
def test_a_wrong_patch(server, body):
    problem(server.ask("PATCH", "/v1/renders/queued", body, JSON), 400)


@pytest.mark.parametrize("method", ["GET", "PATCH", "DELETE"])
def test_unknown_and_removed_renders(server, method):
    problem(server.ask(method, "/v1/renders/nothing", "{}", JSON), 404)
    problem(server.ask(method, "/v1/renders/removed", "{}", JSON), 410)


# Images


@pytest.mark.parametrize("extension", FORMATS)
def test_a_final_image(server, extension):
    answer = server.get(f"/v1/renders/done/image.{extension}")
    assert answer.status == 200 and answer.body.startswith(FORMATS[extension])
    assert "immutable" in answer.headers["Cache-Control"]
    assert "max-age=31536000" in answer.headers["Cache-Control"]
    assert answer.headers["Penumbra-Progress"] == "1.00"
    again = server.get(f"/v1/renders/done/image.{extension}", If_None_Match=answer.headers["ETag"])
    assert (again.status, again.body) == (304, b"")
    assert again.headers["Cache-Control"] == answer.headers["Cache-Control"]


@pytest.mark.parametrize("extension", FORMATS)
def test_a_partial_image(server, extension):
    answer = server.get(f"/v1/renders/cancelled/image.{extension}")
    assert answer.status == 200 and answer.body.startswith(FORMATS[extension])
    assert answer.headers["Cache-Control"] == "no-cache"
    assert answer.headers["Penumbra-Progress"] == "0.50"


def test_a_partial_image_grows():
    """Breaks if a later look gets the earlier picture, or two revisions share an ETag."""
    with Server() as server:
        path = "/v1/renders/running/image.png"
        first = server.get(path)
        server.process.send_signal(signal.SIGUSR1)
        second = farm.wait_for(
            lambda: (a := server.get(path, If_None_Match=first.headers["ETag"])).status == 200
            and a, 5, "a new revision")
        assert second.body != first.body and second.headers["ETag"] != first.headers["ETag"]
        assert second.headers["Penumbra-Progress"] == "0.66"


def test_an_image_before_anything_is_rendered(server):
    """Breaks if a viewer that comes early gets an error in place of an empty picture."""
    answer = server.get("/v1/renders/queued/image.png")
    assert answer.status == 200 and answer.headers["Penumbra-Progress"] == "0.00"


@pytest.mark.parametrize("path, status", [
    ("/v1/renders/failed/image.png", 409), ("/v1/renders/removed/image.png", 410),
    ("/v1/renders/nothing/image.png", 404), ("/v1/renders/done/image.gif", 404),
    ("/v1/renders/done/image.", 404), ("/v1/renders/done/image.png?exposure=x", 400),
    ("/v1/renders/done/image.png?exposure=nan", 400),
    ("/v1/renders/done/image.png?exposure=65", 400),
    ("/v1/renders/done/image.png?exposure=", 400),
    ("/v1/renders/done/image.png?layer=depth", 404)])
def test_images_that_there_are_not(server, path, status):
    problem(server.get(path), status)


@pytest.mark.parametrize("accept, media_type", [
    (None, "image/png"), ("*/*", "image/png"), ("image/*", "image/png"),
    ("image/jpeg", "image/jpeg"), ("image/x-exr, */*;q=0.1", "image/x-exr"),
    ("image/png;q=0.5, image/jpeg;q=0.9", "image/jpeg"), ("image/png;q=0, */*", "image/jpeg"),
    ("text/html, image/vnd.radiance", "image/vnd.radiance"), ("text/html", None)])
def test_negotiation(server, accept, media_type):
    """Breaks if a cache could hand one client the format of another."""
    answer = server.get("/v1/renders/done/image", **({"Accept": accept} if accept else {}))
    if media_type:
        assert (answer.status, answer.headers["Content-Type"]) == (200, media_type)
        assert answer.headers["Vary"] == "Accept"
    else:
        problem(answer, 406)


def test_exposure_changes_the_png_and_not_the_exr(server):
    def images(extension):
        return {server.get(f"/v1/renders/done/image.{extension}{query}").body
                for query in ["", "?exposure=0", "?exposure=1.5"]}

    assert len(images("png")) == 2
    assert len(images("exr")) == 1


@pytest.mark.parametrize("images", [7, 8, 9])  # PEN_UNCHANGED_MAX and beside it
def test_each_304_is_its_own(server, images):
    """Broken by answers that are kept for one image and given for another, or freed too early."""
    paths = [f"/v1/renders/done/image.{'png' if i % 2 else 'jpg'}?exposure={i}" for i in range(images)]
    paths[0] = "/v1/renders/done/image?exposure=0.5"
    kept = {path: server.get(path).headers for path in paths}
    for path in [*paths, *paths, *reversed(paths)]:
        again = server.get(path, If_None_Match=kept[path]["ETag"])
        assert (again.status, again.body) == (304, b"")
        for name in ("ETag", "Cache-Control", "Vary"):
            assert again.headers[name] == kept[path][name]
    named = server.get(paths[0], If_None_Match=kept[paths[0]]["ETag"], X_Request_Id="mine")
    assert named.status == 304 and named.headers["X-Request-Id"] == "mine"


def test_ranges(server):
    """Breaks if a resumed download is spliced at the wrong byte."""
    path = "/v1/renders/done/image.exr"
    whole = server.get(path)
    size = len(whole.body)
    cases = {"bytes=0-9": (0, 10), "bytes=10-": (10, size), "bytes=-7": (size - 7, size),
             f"bytes={size - 1}-{size + 50}": (size - 1, size), "bytes=-999999": (0, size)}
    for text, (first, end) in cases.items():
        answer = server.get(path, Range=text)
        assert (answer.status, answer.body) == (206, whole.body[first:end]), text
        assert answer.headers["Content-Range"] == f"bytes {first}-{end - 1}/{size}"
    for text in [f"bytes={size}-", "bytes=-0"]:
        answer = server.get(path, Range=text)
        problem(answer, 416)
        assert answer.headers["Content-Range"] == f"bytes */{size}"
    for text in ["bytes=0-1,5-6", "lines=1-2", "bytes=5-2", "bytes=x", "bytes=1-2x"]:
        assert server.get(path, Range=text).status == 200, text
    assert server.get(path, Range="bytes=0-1", If_Range=whole.headers["ETag"]).status == 206
    assert server.get(path, Range="bytes=0-1", If_Range='"other"').status == 200


def test_equal_requests_share_one_encoding():
    """Breaks if a crowd that asks for one picture has it encoded once for each."""
    with Server() as server:
        links = [socket.create_connection(("127.0.0.1", server.port)) for _ in range(200)]
        for link in links:
            link.sendall(b"GET /v1/renders/done/image.exr HTTP/1.1\r\nHost: localhost\r\n"
                         b"Connection: close\r\n\r\n")
        answers = [link.makefile("rb").read() for link in links]
        for link in links:
            link.close()
        assert all(a.startswith(b"HTTP/1.1 200") for a in answers)
        assert len({re.sub(rb"(Date|X-Request-Id):[^\n]*", b"", a) for a in answers}) == 1


def encoders_of(server):
    return farm.children(server.process.pid)


def test_a_killed_encoder_costs_nothing():
    """Breaks if a request that meets a dead encoder fails, or no new one is started."""
    with Server() as server:
        for extension in FORMATS:
            (pid, *_) = farm.wait_for(lambda: encoders_of(server), 5, "an encoder")
            os.kill(pid, signal.SIGKILL)
            assert server.get(f"/v1/renders/done/image.{extension}").status == 200


def test_an_encoder_that_never_works_is_told():
    """Breaks if a request waits for ever for a program that ends at once."""
    with Server(encoder="/bin/false") as server:
        answer = server.get("/v1/renders/done/image.png")
        problem(answer, 500)
        assert server.get("/livez").status == 200


def test_too_many_encodings_are_refused():
    """Breaks if the queue of encodings has no bound: 64 may wait, two are at work."""
    with Server() as server:
        pid = farm.wait_for(lambda: encoders_of(server), 5, "an encoder")[0]
        assert server.get("/v1/renders/done/image.png").status == 200
        os.kill(pid, signal.SIGSTOP)
        links = [socket.create_connection(("127.0.0.1", server.port)) for _ in range(100)]
        for i, link in enumerate(links):
            link.sendall(b"GET /v1/renders/done/image.png?exposure=%d.%d HTTP/1.1\r\n"
                         b"Host: localhost\r\nConnection: close\r\n\r\n" % (i // 10, i % 10 + 1))
        os.kill(pid, signal.SIGCONT)
        heads = collections.Counter(link.makefile("rb").readline() for link in links)
        for link in links:
            link.close()
        assert set(heads) <= {b"HTTP/1.1 200 OK\r\n", b"HTTP/1.1 503 Service Unavailable\r\n"}
        assert heads[b"HTTP/1.1 200 OK\r\n"] >= 64
        assert heads[b"HTTP/1.1 503 Service Unavailable\r\n"] > 0


# The farm, and health


def test_workers_and_farm(server):
    workers = json.loads(server.get("/v1/workers").body)["workers"]
    assert [(w["id"], w["processes"], w["state"]) for w in workers] == [("7", 2, "ready")]
    found = json.loads(server.get("/v1/farm").body)
    assert (found["workers"], found["processes"], found["queue_depth"]) == (1, 2, 5)


def test_draining_refuses_new_renders_alone():
    with Server() as server:
        assert server.get("/readyz").status == 200
        server.process.send_signal(signal.SIGUSR2)
        farm.wait_for(lambda: server.get("/readyz").status == 503, 5, "draining")
        answer = server.post(SCENE)
        problem(answer, 503)
        assert "Retry-After" in answer.headers
        assert server.get("/livez").status == 200
        assert server.get("/v1/renders/done/image.png").status == 200


# HTTP itself


@pytest.mark.parametrize("path", ["/v2", "/v1", "/v1/renders/", "/v1/renders/a/b", "//", "/livez/x",
                                  "/v1/renders/done/image.png/x", "/v1/renders/" + "x" * 64,
                                  "/../etc/passwd", "/%2e%2e/etc/passwd"])
def test_unknown_paths(server, path):
    problem(server.get(path), 404)


@pytest.mark.parametrize("method, path, allow", [
    ("PUT", "/v1/renders", "GET, HEAD, POST, OPTIONS"),
    ("POST", "/v1/renders/done", "GET, HEAD, PATCH, DELETE, OPTIONS"),
    ("DELETE", "/v1/renders/done/image.png", "GET, HEAD, OPTIONS"),
    ("GET", "/v1/workers/7/drain", "POST, OPTIONS"), ("BREW", "/", "GET, HEAD, OPTIONS")])
def test_wrong_methods(server, method, path, allow):
    answer = server.ask(method, path)
    problem(answer, 405)
    assert answer.headers["Allow"] == allow


@pytest.mark.parametrize("path, allow", [
    ("/livez", "GET, HEAD, OPTIONS"), ("/v1/renders", "GET, HEAD, POST, OPTIONS"),
    ("/v1/scenes/sha256/" + "0" * 64, "GET, HEAD, PUT, OPTIONS")])
def test_options_tell_what_may_be_done(server, path, allow):
    answer = server.ask("OPTIONS", path)
    assert (answer.status, answer.body, answer.headers["Allow"]) == (204, b"", allow)


@pytest.mark.parametrize("path", [
    "/", "/livez", "/readyz", "/metrics", "/openapi.json", "/scene.schema.json", "/v1/farm",
    "/v1/workers", "/v1/renders", "/v1/renders/done", "/v1/renders/done/image",
    "/v1/renders/done/image.png", "/v1/renders/done/frames/1.exr", "/v1/renders/done/iiif",
    "/v1/renders/done/iiif/info.json", "/v1/renders/done/iiif/full/max/0/default.jpg"])
def test_head_is_get_without_its_body(server, path):
    """Breaks if something that can be fetched cannot be asked for, or tells other fields then."""
    head, get = server.ask("HEAD", path), server.get(path)
    assert head.status == get.status and head.body == b""
    for field in ["Content-Type", "ETag", "Cache-Control", "Vary", "Location"]:
        assert head.headers[field] == get.headers[field]


def test_workers_are_drained_and_reset(server):
    assert server.ask("POST", "/v1/workers/7/drain").status == 200
    problem(server.ask("POST", "/v1/workers/7/reset"), 409)
    for worker in ["8", "0", "x", "9" * 30]:
        for verb in ["drain", "reset"]:
            problem(server.ask("POST", f"/v1/workers/{worker}/{verb}"), 404)


@pytest.mark.parametrize("host, status", [
    ("localhost", 200), ("LOCALHOST:80", 200), ("127.0.0.1:1", 200), ("[::1]:8080", 200),
    ("evil.example", 421), ("localhost.evil.example", 421), ("127.0.0.1.evil", 421),
    ("localhost:80x", 421), ("", 421)])
def test_only_the_local_host_names_are_answered(server, host, status):
    """Breaks if a web page can reach the service by a name that it made point here."""
    answer = server.get("/livez", Host=host)
    assert answer.status == status


@pytest.mark.parametrize("origin, status", [
    (None, 202), ("http://localhost:8080", 202), ("http://127.0.0.1", 202),
    ("http://evil.example", 403), ("https://localhost.evil.example", 403), ("null", 403)])
def test_pages_of_other_sites_change_nothing(server, origin, status):
    """Breaks if a page that somebody visits can start renders on their machine."""
    headers = {"Content-Type": "text/json", **({"Origin": origin} if origin else {})}
    assert server.post(SCENE, headers.items()).status == status
    assert server.get("/livez", **({"Origin": origin} if origin else {})).status == 200


def test_a_request_without_host(server):
    assert server.raw(b"GET /livez HTTP/1.0\r\n\r\n").startswith(b"HTTP/1.0 400") or \
        server.raw(b"GET /livez HTTP/1.0\r\n\r\n").startswith(b"HTTP/1.1 400")


@pytest.mark.parametrize("path", ["/livez", "/v1/renders/done", "/v1/renders/done/image.png",
                                  "/nothing"])
def test_security_fields_are_on_every_answer(server, path):
    headers = server.get(path).headers
    assert headers["X-Content-Type-Options"] == "nosniff"
    assert headers["Content-Security-Policy"] == "default-src 'none'"
    assert headers["Referrer-Policy"] == "no-referrer"
    assert headers["Cross-Origin-Resource-Policy"] == "same-origin"


def test_a_connection_is_kept(server):
    """Breaks if a poll costs a connection, or an answer that was waited for ends it."""
    connection = http.client.HTTPConnection("127.0.0.1", server.port, timeout=20)
    connection.connect()
    link = connection.sock
    for path in ["/livez", "/v1/renders/done", "/v1/renders/done/image.jpg?exposure=3", "/nothing"]:
        server.ask("GET", path, connection=connection)
    server.ask("POST", "/v1/renders", json.dumps(SCENE), JSON, connection=connection)
    server.ask("POST", "/v1/renders", "broken", JSON, connection=connection)
    assert connection.sock is link
    connection.close()


@pytest.mark.parametrize("data", [
    b"\x16\x03\x01\x02\x00\x01\x00", b"GET\r\n\r\n", b"GET / HTTP/1.1\r\nHost: localhost\r\n" +
    b"A: " + b"x" * 40000 + b"\r\n\r\n", b"GET /" + b"x" * 40000 + b" HTTP/1.1\r\n\r\n",
    b"POST /v1/renders HTTP/1.1\r\nHost: localhost\r\nContent-Length: -5\r\n\r\n",
    b"POST /v1/renders HTTP/1.1\r\nHost: localhost\r\nContent-Length: 99999999999999999999\r\n\r\n",
    b"POST /v1/renders HTTP/1.1\r\nHost: localhost\r\nTransfer-Encoding: chunked\r\n\r\nzz\r\n",
    b"\x00" * 1000])
def test_what_is_not_http_harms_nothing(server, data):
    got = server.raw(data, 0.2)
    assert not got or re.match(rb"HTTP/1\.[01] (4\d\d|505) ", got), got[:100]
    assert server.get("/livez").status == 200


def test_clients_that_leave_early_harm_nothing(server):
    """Breaks if an answer to a client that has gone touches freed memory (run it under ASan)."""
    requests = [b"GET /v1/renders/done/image.exr?exposure=%d HTTP/1.1\r\nHost: localhost\r\n\r\n",
                b"POST /v1/renders HTTP/1.1\r\nHost: localhost\r\nContent-Length: 9%d\r\n\r\n{",
                b"PATCH /v1/renders/paused HTTP/1.1\r\nHost: localhost\r\n"
                b'Content-Length: 15\r\n\r\n{"priority": 1%d']
    for i in range(60):
        with socket.create_connection(("127.0.0.1", server.port)) as link:
            link.sendall(requests[i % 3] % (i % 10))
    assert server.get("/livez").status == 200


def test_stopping_with_requests_under_way():
    """Breaks if the service cannot end while clients wait for images; __exit__ checks the code."""
    links = []
    with Server() as server:
        for i in range(20):
            links.append(socket.create_connection(("127.0.0.1", server.port)))
            links[-1].sendall(b"GET /v1/renders/done/image.exr?exposure=%d HTTP/1.1\r\n"
                              b"Host: localhost\r\n\r\n" % i)
        links[-1].sendall(b"POST /v1/renders HTTP/1.1\r\nHost: localhost\r\n"
                          b"Content-Length: 400000000\r\n\r\n")
    for link in links:
        link.close()
