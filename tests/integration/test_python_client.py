# SPDX-License-Identifier: Apache-2.0
"""deploy/python/penumbra.py, the client in one file, against a real farm."""
import json
import subprocess
import sys

import pytest
from farm import ROOT, Farm

sys.path.insert(0, str(ROOT / "deploy/python"))
import penumbra  # noqa: E402

SCENE = {"version": 1, "image": {"width": 48, "height": 32}, "sampling": {"samples": 4},
         "background": {"color": [0.2, 0.4, 0.6]},
         "objects": [{"type": "sphere", "center": [0, 0, 0], "radius": 1}]}


@pytest.fixture(scope="module")
def farm():
    with Farm(processes=1) as running:
        yield running


@pytest.fixture
def server(farm):
    with penumbra.Server(f"http://127.0.0.1:{farm.http_port}") as client:
        yield client


def test_a_dict_becomes_the_image_that_curl_gets(farm, server):
    """Breaks when submit, wait or image differ from the plain requests."""
    render = server.submit(SCENE, name="from Python", width=64)
    found = render.wait()
    assert (found["state"], found["name"]) == ("done", "from Python")
    assert render.image("exr") == farm.image(render.id, "exr")
    changed = {**SCENE, "image": {"width": 64, "height": 32}}
    assert farm.render(changed) == render.image("exr")


def test_a_merge_patch_is_applied_as_rfc_7396_says(server):
    """Breaks when null does not remove, or a nested member replaces its siblings."""
    scene = {**SCENE, "image": {"width": 48, "height": 32, "exposure": 3}}
    render = server.submit(scene, override={"image": {"exposure": None, "height": 16}})
    plain = server.submit({**SCENE, "image": {"width": 48, "height": 16}})
    render.wait(), plain.wait()
    assert render.image("png") == plain.image("png")


def test_what_is_wrong_with_a_scene_is_told_with_its_place(server):
    """Breaks when the list of errors is lost between the answer and the exception."""
    with pytest.raises(penumbra.Refused) as caught:
        server.submit({**SCENE, "objects": [{"type": "sphere", "radius": -1}]})
    assert caught.value.status == 400
    assert [e["pointer"] for e in caught.value.errors] == ["/objects/0/radius"]
    assert "/objects/0/radius" in str(caught.value)


def test_watching_ends_with_the_render(server):
    """Breaks when watch misses the end, or hides that a render was cancelled."""
    render = server.submit({**SCENE, "sampling": {"samples": 65536, "seed": 7}})
    states = []
    for found in render.watch(interval_s=0.01):
        states.append(found["state"])
        if len(states) == 1:
            render.cancel()
    assert states[-1] == "cancelled"
    with pytest.raises(penumbra.Failed):
        render.wait()
    render.delete()
    with pytest.raises(penumbra.Refused) as caught:
        render.resource()
    assert caught.value.status == 410


def test_a_failed_render_says_all_that_is_wrong():
    """Breaks when the errors of a scene's files are lost between the resource and the exception."""
    errors = [{"pointer": "/objects/0", "detail": "broken"}, {"pointer": "", "detail": "odd"}]
    text = str(penumbra.Failed({"id": "abc", "state": "failed", "error": "bad", "errors": errors}))
    assert text == "render abc: bad\n  /objects/0: broken\n  (scene): odd"
    assert str(penumbra.Failed({"id": "abc", "state": "cancelled"})) == "render abc: cancelled"


def test_the_list_has_every_render_once_newest_first(server):
    """Breaks when a page is fetched twice or the cursor is dropped."""
    ids = [server.submit({**SCENE, "sampling": {"samples": 1, "seed": n}}).id for n in range(3)]
    listed = [found["id"] for found in server.renders()]
    assert listed[:3] == ids[::-1]
    assert len(set(listed)) == len(listed)


def test_a_kept_connection_that_was_closed_is_opened_anew(farm, server):
    """Breaks when a restart of the server is shown as an error to the next request."""
    server.farm()
    farm.stop()
    farm.start()
    client = penumbra.Server(f"http://127.0.0.1:{farm.http_port}")
    client._connection, server._connection = server._connection, None
    client.farm()
    client.close()


def test_no_server_is_an_error_of_its_own():
    """Breaks when the reason is a traceback of the socket module."""
    with pytest.raises(penumbra.Unreachable):
        penumbra.Server("http://127.0.0.1:9").farm()
    with pytest.raises(ValueError):
        penumbra.Server("127.0.0.1:8080")


@pytest.mark.parametrize("text", ["/etc/passwd", "../secret.png", "http://localhost/x.png", "a/../../x"])
def test_assets_are_files_below_the_scene_s_directory(tmp_path, text):
    """Breaks when a scene file can make the client read or send what lies elsewhere."""
    scene = tmp_path / "scene.json"
    scene.write_text(json.dumps({**SCENE, "background": {"image": text}}))
    with pytest.raises(ValueError):
        penumbra.Server().submit(scene)


def test_a_link_out_of_the_directory_is_not_followed(tmp_path):
    """Breaks when the path is checked before links are resolved."""
    directory = tmp_path / "scene"
    directory.mkdir()
    (tmp_path / "secret.png").write_bytes(b"secret")
    (directory / "link.png").symlink_to(tmp_path / "secret.png")
    (directory / "scene.json").write_text(json.dumps({**SCENE, "background": {"image": "link.png"}}))
    with pytest.raises(ValueError):
        penumbra.Server().submit(directory / "scene.json")


def test_as_a_program_it_renders_a_file(farm, tmp_path):
    """Breaks when the program's options do not reach the scene, or its exit code lies."""
    scene, output = tmp_path / "scene.json", tmp_path / "image.png"
    scene.write_text(json.dumps(SCENE))
    program = [sys.executable, str(ROOT / "deploy/python/penumbra.py"), str(scene),
               "--server", f"http://127.0.0.1:{farm.http_port}", "--samples", "2", "-o"]
    subprocess.run([*program, str(output)], check=True, timeout=60)
    assert output.read_bytes().startswith(b"\x89PNG")
    scene.write_text("{}")
    assert subprocess.run([*program, str(output)], timeout=60).returncode == 1


def test_views_of_a_kept_scene(server):
    """Breaks if a view is rendered without its override, or leaves the one before rendering."""
    kept = server.keep(SCENE)
    assert server.keep(SCENE) == kept
    first = server.submit(kept, preview=True, samples=60000, width=512, height=512)
    view = server.submit(kept, override={"image": {"width": 16}}, preview=True, replaces=first)
    assert view.wait()["width"] == 16
    assert first.resource()["state"] == "cancelled"


def test_a_key_makes_submitting_again_safe(server):
    again = [server.submit(SCENE, key="mine", fresh=True).id for _ in range(2)]
    assert again[0] == again[1]


def test_pausing_and_draining(server):
    worker = server.workers()[0]["id"]
    assert server.drain(worker)["state"] == "draining"
    render = server.submit(SCENE, seed=77)
    assert render.pause()["state"] == "paused"
    assert render.resume()["state"] == "queued"
    assert server.reset(worker)["state"] == "ready"
    render.wait()
