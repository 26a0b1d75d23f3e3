# SPDX-License-Identifier: Apache-2.0
"""The files of the web page as they are served. tests/web uses the page itself."""
import http.client

import contract
import pytest
from http_server import Server

WEB = contract.TREE / "server/web"
TYPES = {".html": "text/html; charset=utf-8", ".js": "text/javascript; charset=utf-8",
         ".css": "text/css; charset=utf-8", ".svg": "image/svg+xml"}
POLICY = ("default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob:; "
          "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'")


@pytest.fixture(scope="module")
def server():
    with Server() as running:
        yield running


def test_every_file_is_served(server):
    """Breaks if a file is added that the build does not see, or has a type no browser runs."""
    files = [path for path in WEB.rglob("*") if path.is_file()]
    assert len(files) > 20
    for path in files:
        answer = server.get(f"/web/{path.relative_to(WEB)}")
        assert answer.status == 200 and answer.body == path.read_bytes(), path
        assert answer.headers["Content-Type"] == TYPES[path.suffix]
    demo = server.get("/web/demo.json")
    assert demo.body == (contract.TREE / "deploy/demo/spiral.json").read_bytes()
    assert demo.headers["Content-Type"] == "application/json"
    assert server.get("/").body == (WEB / "index.html").read_bytes()


def test_the_page_may_do_nothing_but_its_work(server):
    """Breaks if a second policy, as the other answers have it, forbids the page its own scripts, or
    if one of these is forgotten: each of them keeps something out."""
    for path in ["/", "/web/main.js"]:
        headers = server.get(path).headers
        assert headers.get_all("Content-Security-Policy") == [POLICY]
        assert headers.get_all("X-Content-Type-Options") == ["nosniff"]
        assert headers.get_all("Referrer-Policy") == ["no-referrer"]
    assert server.get("/livez").headers.get_all("Content-Security-Policy") == ["default-src 'none'"]


def test_what_the_browser_has_is_not_sent_again(server):
    """Breaks if the page comes out of a cache that is older than the service."""
    first = server.get("/web/main.js")
    assert first.headers["Cache-Control"] == "no-cache"
    again = server.get("/web/main.js", If_None_Match=first.headers["ETag"])
    assert (again.status, again.body) == (304, b"")
    assert again.headers["Content-Security-Policy"] == POLICY
    assert server.get("/").headers["ETag"] != first.headers["ETag"]


@pytest.mark.parametrize("name", ["", "main", "main.js/", "/main.js", "../openapi.json",
                                  "%2e%2e/openapi.json", "style", "x" * 63, "x" * 64, "x" * 5000])
def test_there_is_nothing_else(server, name):
    """Breaks if a name can lead out of the page's files, or out of the place that holds it."""
    link = http.client.HTTPConnection("127.0.0.1", server.port, timeout=10)
    link.request("GET", f"/web/{name}")
    answer = link.getresponse()
    problem_of = answer.read()
    link.close()
    assert answer.status == 404 and b"Not Found" in problem_of


def test_no_file_brings_markup_or_code_from_elsewhere():
    """Breaks if something is loaded from another host, or if text could become markup or code."""
    for path in WEB.rglob("*"):
        if path.suffix not in (".js", ".html", ".css"):
            continue
        text = path.read_text()
        for word in ["innerHTML", "outerHTML", "insertAdjacentHTML", "document.write", "eval(",
                     "new Function", "DOMParser", "https://", "@import", "style=\"", " onclick="]:
            assert word not in text, f"{path}: {word}"
