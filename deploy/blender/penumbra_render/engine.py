# SPDX-License-Identifier: Apache-2.0
"""The render engine. Blender calls it from a thread of its own, so that nothing here may change the
scene that is being worked on."""
import contextlib
import json
import pathlib
import subprocess
import tempfile
import time

import bpy

from . import penumbra, scene as description

LOOK_S = 0.25  # between two looks at a render's state
SHOW_S = 0.5  # between two partial images, at least


class Cancelled(Exception):
    """Esc was pressed."""


class PenumbraEngine(bpy.types.RenderEngine):
    bl_idname = "PENUMBRA"
    bl_label = "Penumbra"
    bl_use_preview = False
    bl_use_eevee_viewport = True
    bl_use_shading_nodes_custom = False
    bl_use_postprocess = True

    def render(self, depsgraph):
        preferences = bpy.context.preferences.addons[__package__].preferences
        try:
            with workplace(preferences.keep) as directory, connection(preferences) as server:
                self.prepare(depsgraph, directory)
                self.follow(server.submit(directory / "scene.json"), depsgraph, directory)
        except Cancelled:
            pass
        except (penumbra.Error, OSError, ValueError, subprocess.SubprocessError) as error:
            self.report({"ERROR"}, str(error))
            self.error_set(f"Penumbra: {error}")

    def prepare(self, depsgraph, directory):
        """Leaves scene.json and what it names in directory."""
        scene = depsgraph.scene.original
        if scene.camera is None:
            raise ValueError("the scene has no camera")
        self.update_stats("", "Exporting the scene")
        content = description.scene_of(scene, depsgraph, directory)
        (directory / "scene.json").write_text(json.dumps(content, indent=2))
        self.export(scene, directory)

    def export(self, scene, directory):
        """Another Blender writes model.glb from a copy of the scene."""
        copy, model = directory / "scene.blend", directory / "model.glb"
        bpy.data.libraries.write(str(copy), {scene}, path_remap="ABSOLUTE", fake_user=True)
        trusted = bpy.context.preferences.filepaths.use_scripts_auto_execute
        command = [bpy.app.binary_path, "-b", "--factory-startup", "-noaudio", "-y" if trusted else "-Y",
                   "--python-exit-code", "1", "-P", str(pathlib.Path(__file__).with_name("export.py")),
                   "--", str(copy), scene.name, str(scene.frame_current),
                   str(int(scene.penumbra.apply_modifiers)), str(model)]
        with open(directory / "export.log", "w+", encoding="utf-8") as log:
            child = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=log, stderr=log)
            try:
                while child.poll() is None:
                    self.stop_if_asked()
                    time.sleep(0.05)
            finally:
                child.kill()
                child.wait()
            log.seek(0)
            if child.returncode != 0 or not model.exists():
                raise ValueError(f"Blender cannot export the scene: {log.read()[-2000:]}")
        copy.unlink()

    def stop_if_asked(self):
        if self.test_break():
            raise Cancelled

    def follow(self, render, depsgraph, directory):
        """Shows the render until it ends; cancels it when Esc is pressed."""
        width, height = description.size_of(depsgraph.scene.render)
        if crop := description.crop_of(depsgraph.scene.render):
            width, height = crop[2] - crop[0], crop[3] - crop[1]
        result = self.begin_result(0, 0, width, height, layer=depsgraph.view_layer.name)
        cancelled = True
        try:
            self.watch(render, result, directory / "image.exr")
            cancelled = False
        except Cancelled:
            render.cancel()
            raise
        finally:
            self.end_result(result, cancel=cancelled)

    def watch(self, render, result, path):
        shown, shown_at, pause = 0, time.monotonic(), SHOW_S
        for found in render.watch(LOOK_S):
            self.stop_if_asked()
            self.update_progress(found["progress"])
            self.update_stats("", f"{found['state'].capitalize()}, {100 * found['progress']:.0f} %")
            now = time.monotonic()
            if found["progress"] > shown and now - shown_at >= pause and found["state"] == "running":
                shown, pause = found["progress"], self.show(render, result, path)
                shown_at = time.monotonic()
        if found["state"] != "done":
            raise penumbra.Failed(found)
        self.show(render, result, path)
        for warning in found.get("warnings") or ():
            text = warning.get("detail") if isinstance(warning, dict) else warning
            self.report({"WARNING"}, f"Penumbra: {text}")

    def show(self, render, result, path):
        """The image as it is now. Returns how long to wait before the next one."""
        start = time.monotonic()
        try:
            path.write_bytes(render.image("exr"))
        except penumbra.Refused:  # nothing is rendered of it yet
            return SHOW_S
        result.layers[0].load_from_file(str(path))
        self.update_result(result)
        return max(SHOW_S, 4 * (time.monotonic() - start))


@contextlib.contextmanager
def workplace(kept):
    """A directory for what is sent; it stays if somebody wants to have it."""
    if kept:
        path = pathlib.Path(bpy.path.abspath(kept))
        path.mkdir(parents=True, exist_ok=True)
        yield path
        return
    with tempfile.TemporaryDirectory(prefix="penumbra-") as path:
        yield pathlib.Path(path)


@contextlib.contextmanager
def connection(preferences):
    token = None
    if preferences.token_file:
        token = pathlib.Path(bpy.path.abspath(preferences.token_file)).read_text(encoding="utf-8").strip()
    with penumbra.Server(preferences.server, token) as server:
        yield server
