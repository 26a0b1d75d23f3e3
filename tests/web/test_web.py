# SPDX-License-Identifier: Apache-2.0
"""The web page as people use it, in a headless Chromium against a running farm. Each scenario fails on
anything that the console complains of, and on any violation of the page's policy."""
import base64
import concurrent.futures
import copy
import json
import statistics

import browser as chromium
import farm
import glb
import pytest
import scene
from bearer import Client, token

SCENE = scene.build(
    160, 90, 8, [scene.sphere(), scene.sphere([0, -101, 0], 100.0)],
    camera=scene.look([0, 1, 6], [0, 0, 0]), background=0.4,
    materials={"white": {"type": "matte", "color": [0.8, 0.3, 0.1]}})
TINY = scene.build(16, 9, 1, [scene.sphere()])
LAYERS = {"image": {"aovs": ["depth", "samples"]},
          "sampling": {"mode": "adaptive", "min_samples": 4, "samples": 64, "error": 0.05}}
# More work than is done while a test looks on.
LONG = {"image": {"width": 640, "height": 360}, "sampling": {"samples": 65536}}


@pytest.fixture(scope="module")
def browser():
    with chromium.Browser() as running:
        yield running


@pytest.fixture(scope="module")
def service():
    with farm.Farm(processes=2) as running:
        yield running


@pytest.fixture(scope="module")
def render(service):
    """A finished render with layers."""
    found = service.submit({"scene": SCENE, "override": LAYERS, "options": {"name": "ball"}})
    service.wait(found)
    return found


def test_faults_are_seen(browser, service):
    """Breaks if the other scenarios would pass on a page that violates its policy, or fails."""
    browser.play("policy", service)


def test_from_a_file_to_an_image(browser, service):
    """Breaks if a scene cannot be uploaded, its faults are not shown, its name becomes markup, or the
    canvas shows another image than the service has."""
    broken = copy.deepcopy(SCENE)
    broken["objects"][0]["radius"] = -1
    found = browser.play("upload", service, scene=json.dumps(SCENE), broken=json.dumps(broken))
    assert service.resource(found)["name"] == "ball <b>"
    assert service.get(f"/v1/renders/{found}/scene")["image"]["aovs"] == ["depth", "samples"]


def test_models_are_dropped_and_scenes_pasted(browser, service):
    tree, data = glb.triangle(
        {"emissiveFactor": [1, 0.5, 0]}, scenes=[{"nodes": [0, 1]}],
        nodes=[{"mesh": 0}, {"camera": 0, "translation": [0, 0, 3]}],
        cameras=[{"type": "perspective", "perspective": {"yfov": 0.9, "znear": 0.1}}])
    model = glb.glb(tree, data)
    pasted = json.dumps({**SCENE, "background": {"color": [0.1, 0.2, 0.3]}})
    browser.play("model", service, glb=base64.b64encode(model).decode(), scene=pasted)


def test_tiles_arrive_and_a_render_is_cancelled(browser, service):
    """Breaks if the image is only seen at its end, or the buttons do something else than they say."""
    running = service.submit({"scene": SCENE, "override": LONG})
    service.wait_progress(running)
    browser.play("live", service, render=running, worker=service.get("/v1/workers")["workers"][0]["name"])
    assert service.request("GET", f"/v1/renders/{running}").status == 410


def test_what_is_looked_at(browser, service, render):
    """Breaks if exposure, heat map, the line between two renders, zoom or downloads do nothing."""
    other = service.submit({"scene": SCENE, "options": {"name": "other"}})
    service.wait(other)
    browser.play("look", service, render=render, other=other)


def test_a_scene_is_turned_round(browser, service, render):
    """Breaks if a view posts the whole scene again, does not cancel the one before, shows nothing
    within the time that people feel as at once, or if the view that is rendered is another."""
    found = browser.play("orbit", service, render=render, turns=12)
    median = statistics.median(found["times"])
    print(f"orbit: median {median} ms, slowest {max(found['times'])} ms at {found['size']}")
    assert median < 1000 * farm.SLOW
    assert not [r for r in service.get("/v1/renders?state=running")["renders"] if r["preview"]]


def test_details_of_a_large_image(browser, service):
    """Breaks if a large image is fetched or held as a whole, or stays blurred when one looks closely."""
    image = {"width": 4096, "height": 3072, "crop": [1536, 1152, 2560, 1920]}
    large = service.submit({"scene": SCENE, "override": {"image": image, "sampling": {"samples": 1}}})
    service.wait(large)
    browser.play("deep", service, render=large, width=4096)


def test_a_restart_while_the_page_is_open(browser, service):
    """Breaks if the page has to be loaded again after the service was, or shows an old image."""
    port = service.http_port
    running = service.submit({"scene": SCENE, "override": LONG})
    service.wait_progress(running)
    ordinary, service.arguments = service.arguments, ["--listen", f"127.0.0.1:{port}"]
    try:
        browser.play("restart", service, {"stop": service.stop, "start": service.start}, render=running)
    finally:
        service.arguments = ordinary


def test_a_service_that_asks_for_a_token(browser, tmp_path):
    """Breaks if the page is shut out, asks without end, shows no pictures, tiles or files, or puts the
    token where others see it."""
    data = tmp_path / "data"
    secret = token(data, "page")
    with farm.Farm(processes=2, data=data) as service:
        owner = Client(service, secret)
        done = owner.done(owner.post(SCENE))
        running = owner.post({"scene": SCENE, "override": LONG})
        browser.play("token", service, token=secret, render=done, live=running)


def test_access_by_keys_and_ears(browser, service, render):
    """Breaks if a control has no name, or cannot be reached by Tab in the order of the page."""
    browser.play("access", service, render=render)


def test_five_hundred_renders(browser):
    """Breaks if the list shows one page only, shows a render twice, or fetches all pictures at once."""
    with farm.Farm(processes=1) as service:
        with concurrent.futures.ThreadPoolExecutor(16) as pool:
            answers = list(pool.map(service.post, [TINY] * 500))
        assert all(answer.status == 202 for answer in answers)
        found = browser.play("list", service, count=500)
        print(f"list: {found['loaded']} ms from 50 to 500 rows")
