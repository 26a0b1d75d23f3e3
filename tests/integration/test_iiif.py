# SPDX-License-Identifier: Apache-2.0
"""The IIIF Image API 3.0, level 1, over images of 40x24 pixels that stand still (fake_jobs.h)."""
import json

import image
import pytest
from http_server import Server, problem

BASE = "/v1/renders/done/iiif"


@pytest.fixture(scope="module")
def server():
    with Server() as running:
        yield running


def size_of(answer, extension):
    assert answer.status == 200, answer.body
    height, width, _ = image.read(answer.body, extension).shape
    return width, height


def test_what_a_viewer_wants_to_know(server):
    """Breaks if a viewer cannot find its way from the base, or from another site's page."""
    answer = server.get(BASE)
    assert (answer.status, answer.headers["Location"]) == (303, f"{BASE}/info.json")
    answer = server.get(f"{BASE}/info.json", Host="localhost:8080")
    found = json.loads(answer.body)
    assert found["id"] == f"http://localhost:8080{BASE}"
    assert (found["width"], found["height"]) == (40, 24)
    assert found["tiles"] == [{"width": 512, "scaleFactors": [1]}]
    assert answer.headers["Access-Control-Allow-Origin"] == "*"
    linked = server.get(f"{BASE}/info.json", Accept="application/ld+json")
    assert linked.headers["Content-Type"].startswith("application/ld+json;profile=")
    assert linked.body != b""


@pytest.mark.parametrize("region, size, expected", [
    ("full", "max", (40, 24)), ("square", "max", (24, 24)), ("8,4,16,10", "max", (16, 10)),
    ("full", "20,", (20, 12)), ("full", ",8", (13, 8)), ("full", "7,9", (7, 9)),
    ("30,20,100,100", "max", (10, 4)), ("0,0,40,24", "40,24", (40, 24)), ("full", "1,", (1, 1)),
    ("39,23,1,1", "1,1", (1, 1))])
@pytest.mark.parametrize("extension", ["png", "jpg"])
def test_regions_and_sizes(server, region, size, expected, extension):
    answer = server.get(f"{BASE}/{region}/{size}/0/default.{extension}")
    assert size_of(answer, extension) == expected
    assert answer.headers["Access-Control-Allow-Origin"] == "*"


@pytest.mark.parametrize("rest, status", [
    ("full/max/0/default.tif", 501), ("full/max/0/gray.jpg", 501), ("full/max/0/nice.jpg", 400),
    ("full/max/90/default.jpg", 501), ("full/max/!0/default.jpg", 501), ("full/max/x/default.jpg", 400),
    ("full/^max/0/default.jpg", 501), ("full/!10,10/0/default.jpg", 501), ("full/pct:50/0/default.jpg", 501),
    ("pct:0,0,50,50/max/0/default.jpg", 501), ("40,0,1,1/max/0/default.jpg", 400),
    ("0,0,0,1/max/0/default.jpg", 400), ("0,0,1/max/0/default.jpg", 400), ("0,0,1,1,1/max/0/default.jpg", 400),
    ("-1,0,1,1/max/0/default.jpg", 400), ("0,0,99999999999,1/max/0/default.jpg", 400), ("all/max/0/default.jpg", 400),
    ("full/41,/0/default.jpg", 400), ("full/,25/0/default.jpg", 400), ("full/0,/0/default.jpg", 400),
    ("full/,/0/default.jpg", 400), ("full/10/0/default.jpg", 400), ("full/1,2,3/0/default.jpg", 400)])
def test_what_is_not_offered(server, rest, status):
    """Breaks if a viewer that asks for more than level 1 cannot tell that from a mistake."""
    problem(server.get(f"{BASE}/{rest}"), status)


def test_parts_are_named_apart(server):
    """Breaks if a cache gives one region, or size, for another."""
    paths = [f"{BASE}/{region}/{size}/0/default.png" for region in ["full", "0,0,20,24", "1,0,20,24"]
             for size in ["max", "10,"]]
    tags = [server.get(path).headers["ETag"] for path in paths]
    assert len(set(tags)) == len(paths)
    again = server.get(paths[0], If_None_Match=tags[0])
    assert (again.status, again.body) == (304, b"")
    assert "immutable" in again.headers["Cache-Control"]
    part = server.get(paths[0], Range="bytes=0-7")
    assert (part.status, part.body) == (206, b"\x89PNG\r\n\x1a\n")


@pytest.mark.parametrize("render, status", [("nothing", 404), ("removed", 410), ("failed", 409)])
def test_renders_that_have_no_image(server, render, status):
    problem(server.get(f"/v1/renders/{render}/iiif/full/max/0/default.jpg"), status)


def test_a_partial_image_can_be_zoomed_into(server):
    answer = server.get("/v1/renders/running/iiif/full/10,/0/default.png")
    assert answer.status == 200 and answer.headers["Cache-Control"] == "no-cache"
    assert answer.headers["Penumbra-Progress"] == "0.50"
