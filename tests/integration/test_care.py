# SPDX-License-Identifier: Apache-2.0
"""penumbra fsck, backup and restore."""
import shutil
import sqlite3
import subprocess

import farm
import pytest
import scene


def small(seed, **more):
    return scene.build(70, 50, 4, [scene.sphere()], background=0.5, seed=seed, **more)


def long():
    return scene.build(128, 96, 3000, [scene.floor(), scene.sphere([0, 1, 0])],
                       camera=scene.look([0, 2, 7], [0, 1, 0]), background=0.5)


def care(command, *arguments):
    return subprocess.run([farm.program("penumbra"), command, *map(str, arguments)],
                          capture_output=True, text=True, timeout=60 * farm.SLOW)


@pytest.fixture
def service(tmp_path):
    with farm.Farm(2, "--tile", 16, data=tmp_path / "data") as running:
        yield running


def animation(seed):
    body = small(seed)
    body["frames"] = {"first": 1, "last": 3, "fps": 24}
    return body


def test_a_sound_directory(service):
    """Broken by a fault that is seen where there is none, or a look at what is being written."""
    for body in (small(1), animation(2)):
        service.wait(service.submit(body))
    busy = care("fsck", "--data", service.data)
    assert busy.returncode == 1 and "another coordinator" in busy.stderr
    service.stop()
    run = care("fsck", "--data", service.data)
    assert (run.returncode, run.stdout) == (0, "2 renders, 4 frames: 0 faults\n")
    service.start()


def test_what_is_damaged_is_found_and_rendered_again(service):
    """Broken by a byte that nobody checks, or a repair that changes an image, or others with it."""
    renders = [service.submit(body) for body in (small(1), small(2), animation(3), small(4))]
    for render in renders:
        service.wait(render)
    paths = [f"/v1/renders/{r}/image.exr" for r in renders]
    images = [service.request("GET", path).body for path in paths]
    finished = service.resource(renders[3])["finished"]
    service.stop()
    frames = service.data / "frames"
    with open(frames / f"{renders[0]}.f32", "r+b") as file:
        file.seek(5 * 16 * 16 * 16 + 700)
        byte = file.read(1)
        file.seek(-1, 1)
        file.write(bytes([byte[0] ^ 1]))
    (frames / f"{renders[1]}.f32").unlink()
    with open(frames / f"{renders[2]}.0.2.f32", "r+b") as file:
        file.truncate(1000)
    run = care("fsck", "--data", service.data)
    assert run.returncode == 1
    assert f"render {renders[0]}: tile 5 of frame 1 is damaged\n" in run.stdout
    assert f"render {renders[1]}: frame 1 is gone\n" in run.stdout
    assert f"render {renders[2]}: " in run.stdout and "frame 2 is" in run.stdout
    assert run.stdout.endswith("4 renders, 5 frames: 3 faults\n")
    service.start()
    lost = service.request("GET", f"/v1/renders/{renders[1]}/image.exr")
    assert lost.status == 500 and b"fsck --repair" in lost.body
    service.stop()
    run = care("fsck", "--data", service.data, "--repair")
    assert run.stdout.endswith("3 faults, 3 renders will be rendered again\n")
    service.start()
    for render, path, image in zip(renders, paths, images):
        service.wait(render)
        assert service.request("GET", path).body == image
    assert service.resource(renders[3])["finished"] == finished
    service.stop()
    assert care("fsck", "--data", service.data).returncode == 0
    service.start()


def test_a_damaged_database_and_scene(service):
    """Broken by a check that takes SQLite's word for it, or skips the scenes."""
    service.wait(service.submit(small(1)))
    service.stop()
    name, = (service.data / "scenes").iterdir()
    name.write_bytes(name.read_bytes().replace(b"70", b"71"))
    assert care("fsck", "--data", service.data).returncode == 0  # the next start makes it again
    with sqlite3.connect(service.data / "penumbra.db") as database:
        database.execute("UPDATE scenes SET text = CAST('torn' AS BLOB)")
    database.close()
    run = care("fsck", "--data", service.data)
    assert run.returncode == 1 and "its scene is damaged" in run.stdout
    with sqlite3.connect(service.data / "penumbra.db") as database:
        database.execute("UPDATE jobs SET tile_px = 17")
    database.close()
    run = care("fsck", "--data", service.data)
    assert run.returncode == 1 and "row is damaged" in run.stdout
    shutil.rmtree(service.data)
    service.start()


def test_a_backup_of_a_running_coordinator(service, tmp_path):
    """Broken by a copy that lacks anything, or tears a render that is at work."""
    done = service.submit(animation(1))
    service.wait(done)
    image = service.image(done)
    undisturbed = service.submit(long())
    service.wait_progress(undisturbed, 0.3)
    run = care("backup", "--data", service.data, tmp_path / "copy")
    assert run.returncode == 0, run.stderr
    again = care("backup", "--data", service.data, tmp_path / "copy")
    assert again.returncode == 1 and "is there already" in again.stderr
    service.wait(undisturbed, 120)
    wanted = service.image(undisturbed)

    refused = care("restore", "--data", service.data, tmp_path / "copy")
    assert refused.returncode == 1 and "is there already" in refused.stderr
    run = care("restore", "--data", tmp_path / "restored", tmp_path / "copy")
    assert run.returncode == 0, run.stderr
    with farm.Farm(2, data=tmp_path / "restored") as other:
        assert other.image(done) == image
        other.wait(undisturbed, 120)
        assert other.image(undisturbed) == wanted


def test_a_backup_that_cannot_read_all_fails(service, tmp_path):
    """Broken by a directory that is left out because it cannot be opened: the renders whose files it has
    would be missing from the copy, and nobody would know before it is needed."""
    service.wait(service.submit(small(1)))
    service.stop()
    frames = service.data / "frames"
    frames.rename(tmp_path / "aside")
    frames.write_text("no directory")
    run = care("backup", "--data", service.data, tmp_path / "copy")
    assert run.returncode == 1 and "cannot read" in run.stderr and "frames" in run.stderr
    assert not (tmp_path / "copy").exists()


def test_a_damaged_backup_is_not_restored(service, tmp_path):
    """Broken by a restore that brings back what is not what was saved."""
    render = service.submit(small(1))
    service.wait(render)
    assert care("backup", "--data", service.data, tmp_path / "copy").returncode == 0
    with open(tmp_path / "copy/frames" / f"{render}.f32", "r+b") as file:
        file.write(b"\x01\x02\x03\x04")
    run = care("restore", "--data", tmp_path / "restored", tmp_path / "copy")
    assert run.returncode == 1 and "damaged" in run.stdout
    assert not (tmp_path / "restored").exists()


def test_wrong_words(tmp_path):
    """Broken by a directory that is made by looking at it, or a word that is taken for none."""
    assert care("fsck", "--data", tmp_path / "none").returncode == 1
    assert not (tmp_path / "none").exists()
    assert care("backup", "--data", tmp_path / "none", tmp_path / "copy").returncode == 1
    for arguments in (["fsck", "more"], ["backup"], ["restore", "a", "b"], ["backup", "--repair"]):
        run = care(*arguments)
        assert run.returncode == 2 and "--help" in run.stderr
    for command in ("fsck", "backup", "restore"):
        assert f"penumbra {command}" in care(command, "--help").stdout
