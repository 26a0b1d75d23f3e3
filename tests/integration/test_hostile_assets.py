# SPDX-License-Identifier: Apache-2.0
"""Files made to harm, sent to a farm: each is refused in words or rendered, and nobody is hurt."""
import hashlib
import os
import pathlib
import re
import subprocess
import time

import farm
import hostile_gltf
import hostile_pictures
import pytest
import scene

READER = farm.BIN.parent / "tests" / "gltf-read"
HAS_SANITIZER = "PEN_SLOW" in os.environ
SECONDS_MAX = 20  # of processor time, for one file
MEBIBYTES_MAX = 1024  # what reading one takes at a time
MACHINE = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGESIZE")
REPORT = re.compile(r"ERROR: \w+Sanitizer|runtime error:|SUMMARY: ")
TOGETHER = 100  # renders that wait at a time


def read(path):
    """(first line, further lines, seconds, mebibytes) of reading a glTF file by itself."""
    with open(path.with_suffix(".log"), "w+", encoding="utf-8", errors="replace") as log:
        process = subprocess.Popen([READER, path], stdout=log, stderr=log)
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        log.seek(0)
        first, *more = log.read().splitlines() or [""]
    assert process.returncode == 0, (process.returncode, first, more)
    return first, more, usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024


def test_gltf_files_are_refused_or_read_within_limits(tmp_path):
    """Broken by a file that crashes its reader, takes time or memory without bound, is refused
    without a place and a reason, or read though nobody can tell what it means."""
    made = list(hostile_gltf.all_assets())
    path, wrong, refused = tmp_path / "model.glb", [], 0

    for name, content, reason in made:
        path.write_bytes(content)
        first, more, seconds, mebibytes = read(path)
        told = [line for line in more if line.startswith("  error /objects/0: ")]
        is_right = first.startswith("accepted ") or (first.startswith("refused ") and told)
        if reason is not None:
            is_right = is_right and (any(reason in line for line in told) if reason
                                     else first.startswith("accepted "))
        if not is_right or seconds > SECONDS_MAX * farm.SLOW or (
                mebibytes > MEBIBYTES_MAX and not HAS_SANITIZER):
            wrong.append((name, first[:200], more[:2], seconds, mebibytes))
        refused += first.startswith("refused ")
    assert not wrong
    assert len({content for _, content, _ in made}) >= 400 and refused >= 300


def put(service, content):
    name = hashlib.sha256(content).hexdigest()
    assert service.request("PUT", f"/v1/assets/sha256/{name}", content).status in (200, 201)
    return f"sha256:{name}"


def showing(service, kind, content):
    """A scene that has to look at a file."""
    body = scene.build(8, 8, 1, [scene.sphere()], background=1)
    if kind == "glb":
        body["objects"].append({"type": "gltf", "asset": put(service, content)})
        return body
    body["textures"] = {"picture": {"image": put(service, content)}}
    body["materials"]["white"] = {"type": "matte", "color": {"texture": "picture"}}
    return body


def everything(folder):
    """(kind, name, content, verdict): what is left to either has None."""
    for name, content, reason in hostile_gltf.all_assets():
        verdict = None if reason is None else "failed" if reason else "done"
        yield "glb", name, content, verdict
    for name, content, verdict in hostile_pictures.all_pictures(folder):
        yield (name.partition(":")[0], name, content,
               {"refused": "failed", "decoded": "done", None: None}[verdict])


def fault(found, kind, verdict):
    """What is wrong with what was told of a render; None: nothing."""
    if verdict not in (None, found["state"]):
        return f"{found['state']}, not {verdict}: {found['error']}"
    if found["state"] == "done":
        return None
    pointer = "/objects/1" if kind == "glb" else "/textures/picture"
    if not found["errors"] or any(error["pointer"] != pointer or len(error["detail"]) < 10
                                  for error in found["errors"]):
        return f"told as {found['errors']}, {found['error']}"
    return None


def memory_limits(service):
    """Of address space, of each scene process that is there."""
    lines = [pathlib.Path(f"/proc/{pid}/limits").read_text() for pool in service.pools()
             for pid in pool.scenes()]
    return [int(re.search(r"Max address space\s+(\d+)", text)[1]) for text in lines]


def good_scene():
    return scene.build(24, 24, 8, [scene.sphere(), scene.floor(y=-1)],
                       lights=[scene.panel([-1, 4, -1], [2, 0, 0], [0, 0, 2], 5)])


@pytest.fixture
def service():
    with farm.Farm(1, "--tile", 16) as running:
        yield running


@pytest.mark.skipif(HAS_SANITIZER, reason="builds with sanitizers do not limit the processor's time")
@pytest.mark.parametrize("planted, reason", [("crash", "ended by SIGSEGV"), ("loop", "took more than 20 s to decode")])
def test_a_library_gone_wrong_fails_the_render_alone(planted, reason, monkeypatch):
    """Broken by a reader of images that crashes, or never comes back, and takes more along than its own
    render, or leaves that without a word."""
    monkeypatch.setenv("LD_PRELOAD", str(farm.BIN.parent / "tests" / "planted.so"))
    monkeypatch.setenv("PENUMBRA_PLANTED", planted)
    with farm.Farm(1, "--tile", 16, "--sandbox", "require") as service:
        before = service.render(good_scene())
        family = [service.server.pid, *(pid for pool in service.pools() for pid in (pool.pool, *pool.zygotes()))]
        start = time.monotonic()
        render = service.submit(showing(service, "picture", hostile_pictures.png(hostile_pictures.ihdr(),
                                                                                hostile_pictures.idat(b"\0" * 200))))
        found = service.wait(render, 400, "failed")  # a busy machine gives it little
        print(planted, found["error"], time.monotonic() - start)
        assert reason in found["error"]
        assert service.render(good_scene()) == before
        assert all(map(farm.alive, family))


@pytest.mark.skipif(HAS_SANITIZER, reason="their own library has to come first")
def test_a_library_gone_wrong_in_the_encoder_costs_the_image_alone(monkeypatch):
    """Broken by an encoder whose crash takes the coordinator along, other formats of the image, or the next."""
    monkeypatch.setenv("LD_PRELOAD", str(farm.BIN.parent / "tests" / "planted.so"))
    monkeypatch.setenv("PENUMBRA_PLANTED", "write")
    with farm.Farm(1, "--sandbox", "require") as service:
        render = service.submit(good_scene())
        service.wait(render)
        before = service.image(render)
        answer = service.request("GET", f"/v1/renders/{render}/image.png")
        assert answer.status == 500 and b"the encoder ended" in answer.body
        assert service.image(render) == before
        assert service.render(good_scene()) == before


def test_a_farm_outlives_hundreds_of_them(service, tmp_path):
    """Broken by a file that ends, stops or outgrows a scene process, whose render does not say what
    is wrong, and by anything that lasts: a lost process, or other bits afterwards."""
    before = service.render(good_scene())
    family = [service.server.pid, *(pid for pool in service.pools()
                                    for pid in (pool.pool, *pool.zygotes()))]
    if not HAS_SANITIZER:
        assert memory_limits(service)
        assert max(memory_limits(service)) <= max(4 << 30, MACHINE // 2)
    made, wrong, start = list(everything(tmp_path)), [], time.monotonic()
    for first in range(0, len(made), TOGETHER):
        batch = made[first:first + TOGETHER]
        renders = [service.submit(showing(service, kind, content)) for kind, _, content, _ in batch]
        for render, (kind, name, _, verdict) in zip(renders, batch, strict=True):
            farm.wait_for(lambda: service.resource(render)["state"] in farm.FINAL, 300, name)
            told = fault(service.resource(render), kind, verdict)
            if told:
                wrong.append((name, told))
    print(f"{len(made)} files in {time.monotonic() - start:.1f} s")
    assert not wrong
    kinds = [kind for kind, *_ in made]
    assert all(kinds.count(kind) >= 40 for kind in ("glb", "png", "jpeg", "exr", "hdr"))
    assert service.render(good_scene()) == before
    assert all(map(farm.alive, family))
    log = service.log.read_text(errors="replace")
    assert not REPORT.search(log), log
