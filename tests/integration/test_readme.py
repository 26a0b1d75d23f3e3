# SPDX-License-Identifier: Apache-2.0
"""What the documents tell a reader to type must work as it stands."""
import json
import os
import re
import subprocess

import OpenImageIO as oiio
from farm import ROOT, Farm, program

COMMANDS = ("render", "submit", "status", "list", "watch", "cancel", "workers", "serve")


def walk_through():
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    return re.search(r"runs this block as it stands. -->\n```sh\n(.*?)```", text, re.S)[1]


def size(path):
    spec = oiio.ImageInput.open(str(path)).spec()
    return spec.width, spec.height


def test_the_walk_through_with_curl_works_verbatim(tmp_path):
    """Run in a directory that has the repository's files, but where it may leave its own."""
    for name in ("deploy", "core", "README.md"):
        (tmp_path / name).symlink_to(ROOT / name)
    with Farm(processes=2) as farm:
        environment = {**os.environ, "PENUMBRA_SERVER": f"http://127.0.0.1:{farm.http_port}"}
        run = subprocess.run(["bash", "-e", "-u", "-o", "pipefail", "-c", walk_through()],
                             cwd=tmp_path, env=environment, capture_output=True, text=True,
                             timeout=120)
        assert run.returncode == 0, run.stderr
        assert json.loads(run.stdout)["state"] in ("queued", "running", "done")
        for name in ("partial.png", "final.png", "final.exr"):
            assert size(tmp_path / name) == (320, 180)
        finals = farm.get("/v1/renders")["renders"]
        assert [render["state"] for render in finals] == ["done"]


def test_every_file_that_the_documents_link_to_exists():
    for document in ROOT.glob("*.md"):
        links = re.findall(r"\]\((?!https?:)([^)#]+)", document.read_text(encoding="utf-8"))
        assert [link for link in links if not (ROOT / link).exists()] == [], document.name


def test_the_manual_and_the_completions_know_every_option():
    manual = (ROOT / "deploy/man/penumbra.1").read_text(encoding="utf-8")
    bash = (ROOT / "deploy/completions/bash/penumbra").read_text(encoding="utf-8")
    for command in COMMANDS:
        text = subprocess.run([program("penumbra"), command, "--help"], capture_output=True,
                              text=True, timeout=10, check=True).stdout
        options = set(re.findall(r"--([a-z][a-z-]+)", text))
        assert options, command
        for option in options:
            assert re.search(rf"[- ]-{option}\b", manual), f"penumbra.1 lacks --{option}"
            assert f"--{option} " in bash.replace('"', " "), f"bash completion lacks --{option}"


def test_the_worker_s_manual_knows_every_option():
    manual = (ROOT / "deploy/man/penumbra-worker.8").read_text(encoding="utf-8")
    text = subprocess.run([program("penumbra-worker"), "--help"], capture_output=True, text=True,
                          timeout=10, check=True).stdout
    options = set(re.findall(r"--([a-z][a-z-]+)", text)) - {"help", "version"}
    assert options and [o for o in options if f"Fl -{o}" not in manual] == []


def test_the_manual_s_scene_is_one():
    manual = (ROOT / "deploy/man/penumbra-scene.5").read_text(encoding="utf-8")
    scene = re.search(r"\.Bd -literal\n(.*?)\.Ed", manual, re.S)[1]
    with Farm(processes=0) as farm:
        farm.submit(scene)
