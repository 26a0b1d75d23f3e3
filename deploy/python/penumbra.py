#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A client of a Penumbra server in one file, with nothing but Python's own library.

    import penumbra

    server = penumbra.Server("http://127.0.0.1:8080")
    render = server.submit("scene.json", samples=256)
    for state in render.watch():
        print(f"{state['progress']:.0%}")
    render.save("image.exr")

A scene is a dict, the path of a scene file, or the path of a GLB. Assets that a scene file names by
relative paths are uploaded, those that the server has already are not.

As a program it renders one file: penumbra.py SCENE -o IMAGE [--server URL].
"""
import argparse
import hashlib
import http.client
import json
import pathlib
import re
import sys
import time
import urllib.parse

__all__ = ["Server", "Render", "Refused", "Failed", "Unreachable"]

FINAL = ("done", "failed", "cancelled")
CHUNK = 1 << 20
ASSET = re.compile(r"sha256:[0-9a-f]{64}")
# The members whose values are assets.
ASSET_KEYS = ("asset", "image")
RETRY_STATUSES = (429, 503)


class Error(Exception):
    """What all errors of this module are."""


class Unreachable(Error):
    """No server answers at the address, or it stopped in the middle of an answer."""


class Refused(Error):
    """The server does not do what it was asked for.

    status is HTTP's; errors lists what is wrong with a scene as {"pointer", "detail"}.
    """

    def __init__(self, status, title, detail="", errors=()):
        lines = [": ".join(filter(None, (title, detail)))]
        lines += [f"  {e.get('pointer') or '(scene)'}: {e.get('detail')}" for e in errors]
        super().__init__("\n".join(lines))
        self.status, self.title, self.detail, self.errors = status, title, detail, list(errors)

    def within(self, prefix):
        """The same, its pointers counted from where prefix points."""
        errors = [{**e, "pointer": e.get("pointer", "").removeprefix(prefix)} for e in self.errors]
        return Refused(self.status, self.title, self.detail, errors)


class Failed(Error):
    """A render ended without its image; resource is its last state."""

    def __init__(self, resource):
        reason = resource.get("error") or resource["state"]
        lines = [f"  {e.get('pointer') or '(scene)'}: {e.get('detail')}"
                 for e in resource.get("errors") or ()]
        super().__init__("\n".join([f"render {resource['id']}: {reason}", *lines]))
        self.resource = resource


class Server:
    """A server at url; token, if it wants one, is sent as a bearer token. Not for many threads."""

    def __init__(self, url="http://127.0.0.1:8080", token=None, timeout_s=60, context=None):
        parts = urllib.parse.urlsplit(url)
        if parts.scheme not in ("http", "https") or not parts.hostname:
            raise ValueError(f"not the address of a server: {url}")
        self.timeout_s = timeout_s
        self._headers = {"Authorization": f"Bearer {token}"} if token else {}
        self._host, self._port = parts.hostname, parts.port
        self._prefix = parts.path.rstrip("/")
        self._secure, self._context = parts.scheme == "https", context
        self._connection = None

    def submit(self, scene, *, name=None, priority=None, override=None, fresh=False, key=None,
               preview=False, replaces=None, deadline_s=None, **settings):
        """Hands a scene in and returns its Render at once.

        scene: a dict, the path of a scene file or a GLB, or what keep() returned. override is a JSON Merge Patch onto
        it; settings are short for the usual ones: width, height, samples, seed, mode. fresh
        renders again what was rendered before; key, any text of your own, makes it safe to submit
        again after an error. A preview is not kept for long; the render (or id) that it replaces
        is cancelled at once. One that is not done after deadline_s fails.
        """
        patch = _merge(override or {}, _override_of(settings))
        options = {"name": name, "priority": priority, "preview": preview or None,
                   "replaces": getattr(replaces, "id", replaces), "deadline_s": deadline_s}
        options = {k: v for k, v in options.items() if v is not None}
        headers = {"Content-Type": "application/json"}
        if fresh:
            headers["Cache-Control"] = "no-store"
        if key is not None:
            headers["Idempotency-Key"] = key
        if isinstance(scene, str) and ASSET.fullmatch(scene):
            body = {"scene": scene, "override": patch, "options": options}
        else:
            scene = self._upload_assets(*_load(scene))
            body = {"scene": _patched(scene, patch), "options": options}
        try:
            answer = self._json("POST", "/v1/renders", json.dumps(body).encode(), headers)
        except Refused as refusal:
            raise refusal.within("/scene") from None
        return Render(self, answer["id"])

    def keep(self, scene):
        """Stores a scene for many views; returns the name that submit() takes in its place."""
        text = json.dumps(self._upload_assets(*_load(scene))).encode()
        digest = hashlib.sha256(text).hexdigest()
        self._request("PUT", f"/v1/scenes/sha256/{digest}", text,
                      {"Content-Type": "application/json"})
        return f"sha256:{digest}"

    def renders(self, state=None):
        """The resources of all renders, newest first, page by page as they are asked for."""
        query = {"state": state} if state else {}
        while True:
            page = self._json("GET", "/v1/renders?" + urllib.parse.urlencode(query))
            yield from page["renders"]
            if not page.get("next"):
                return
            query["cursor"] = page["next"]

    def workers(self):
        return self._json("GET", "/v1/workers")["workers"]

    def drain(self, worker):
        """Gives the worker with this id no more work."""
        return self._json("POST", f"/v1/workers/{worker}/drain")

    def reset(self, worker):
        """Forgets its strikes and gives it work again."""
        return self._json("POST", f"/v1/workers/{worker}/reset")

    def farm(self):
        return self._json("GET", "/v1/farm")

    def upload(self, path):
        """Stores a file as an asset, unless the server has it; returns "sha256:…"."""
        path = pathlib.Path(path)
        digest = _sha256_of(path)
        if self.missing([digest]):
            self._put(path, digest)
        return f"sha256:{digest}"

    def missing(self, digests):
        """Which of these assets (hex digits) the server does not have."""
        body = json.dumps({"assets": [f"sha256:{d}" for d in digests]}).encode()
        answer = self._json("POST", "/v1/assets/missing", body,
                            {"Content-Type": "application/json"})
        return [text.removeprefix("sha256:") for text in answer["missing"]]

    def _put(self, path, digest):
        with open(path, "rb") as file:
            headers = {"Content-Type": "application/octet-stream",
                       "Content-Length": str(path.stat().st_size)}
            self._request("PUT", f"/v1/assets/sha256/{digest}", file, headers)

    def _upload_assets(self, scene, base):
        """The scene with the hashes of its files in the place of their paths."""
        paths = {}
        _each_asset(scene, lambda text: paths.setdefault(text, _asset_path(base, text)))
        digests = {text: _sha256_of(path) for text, path in paths.items() if path}
        for digest in self.missing(sorted(set(digests.values()))) if digests else ():
            self._put(next(paths[t] for t, d in digests.items() if d == digest), digest)
        return _each_asset(
            scene, lambda text: f"sha256:{digests[text]}" if text in digests else text)

    # HTTP

    def _open(self):
        if self._connection is None:
            kind = http.client.HTTPSConnection if self._secure else http.client.HTTPConnection
            more = {"context": self._context} if self._secure and self._context else {}
            self._connection = kind(self._host, self._port, timeout=self.timeout_s, **more)
        return self._connection

    def close(self):
        if self._connection is not None:
            self._connection.close()
            self._connection = None

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def _request(self, method, path, body=None, headers=None):
        """(status, headers, body) of an answer below 400; waits as the server asks when busy."""
        for _ in range(100):
            status, fields, data = self._exchange(method, path, body, headers)
            if status not in RETRY_STATUSES:
                break
            time.sleep(min(float(fields.get("Retry-After", 1)), 30))
        if status >= 400:
            raise _refusal(status, fields, data)
        return status, fields, data

    def _exchange(self, method, path, body, headers):
        """A kept connection that the server has closed meanwhile is opened anew, once."""
        for attempt in range(2):
            fresh = self._connection is None
            if hasattr(body, "seek"):
                body.seek(0)
            try:
                connection = self._open()
                connection.request(method, self._prefix + path, body,
                                   {**self._headers, **(headers or {})})
                answer = connection.getresponse()
                return answer.status, answer.headers, answer.read()
            except (OSError, http.client.HTTPException) as error:
                self.close()
                if fresh or attempt:
                    raise Unreachable(f"{self._host}:{self._port}: {error}") from error
        raise AssertionError("unreachable")

    def _json(self, *arguments):
        return json.loads(self._request(*arguments)[2])


class Render:
    """One render of a server."""

    def __init__(self, server, identity):
        self.server, self.id = server, identity
        self._path = f"/v1/renders/{identity}"

    def resource(self):
        """What the server says of it now."""
        return self.server._json("GET", self._path)

    def watch(self, interval_s=0.25):
        """Its resource again and again, until it is over."""
        while True:
            found = self.resource()
            yield found
            if found["state"] in FINAL:
                return
            time.sleep(interval_s)

    def wait(self):
        """Its last resource; Failed unless it is done."""
        found = None
        for found in self.watch():
            pass
        if found["state"] != "done":
            raise Failed(found)
        return found

    def image(self, extension="png", frame=None, **query):
        """The bytes of its image as it is now: png, jpg, exr or hdr; query: exposure, layer."""
        place = "image" if frame is None else f"frames/{frame}"
        text = "?" + urllib.parse.urlencode(query) if query else ""
        return self.server._request("GET", f"{self._path}/{place}.{extension}{text}")[2]

    def save(self, path, **query):
        """Waits for the end and writes the image; the name's extension decides its format."""
        path = pathlib.Path(path)
        self.wait()
        path.write_bytes(self.image(path.suffix.removeprefix("."), **query))

    def change(self, **changes):
        """priority=N, or state="paused", "running" or "cancelled"."""
        return self.server._json("PATCH", self._path, json.dumps(changes).encode(),
                                 {"Content-Type": "application/json"})

    def cancel(self):
        return self.change(state="cancelled")

    def pause(self):
        return self.change(state="paused")

    def resume(self):
        return self.change(state="running")

    def delete(self):
        self.server._request("DELETE", self._path)


# Scenes

def _load(scene):
    """(scene as a dict, directory of its relative paths or None)"""
    if isinstance(scene, dict):
        return scene, None
    path = pathlib.Path(scene)
    if path.suffix.lower() == ".glb":
        return {"version": 1, "image": {"width": 640, "height": 360},
                "integrator": {"type": "path"},
                "objects": [{"type": "gltf", "asset": path.name}]}, path.parent
    return json.loads(path.read_text(encoding="utf-8")), path.parent


def _each_asset(value, change):
    """A copy of value with change applied to the text of every asset."""
    if isinstance(value, list):
        return [_each_asset(item, change) for item in value]
    if not isinstance(value, dict):
        return value
    return {key: change(item) if key in ASSET_KEYS and isinstance(item, str)
            else _each_asset(item, change) for key, item in value.items()}


def _asset_path(base, text):
    """The file that a scene names; None when it is a hash already."""
    if ASSET.fullmatch(text):
        return None
    if base is None:
        raise ValueError(f"{text}: a scene without a file has no relative paths; use upload()")
    relative = pathlib.PurePosixPath(text)
    if relative.is_absolute() or ".." in relative.parts or "://" in text:
        raise ValueError(f"{text}: assets are named by paths below the scene file's directory")
    path = base / relative
    if not path.resolve().is_relative_to(base.resolve()):
        raise ValueError(f"{text}: leads out of the scene file's directory")
    return path


def _sha256_of(path):
    digest = hashlib.sha256()
    with open(path, "rb") as file:
        while chunk := file.read(CHUNK):
            digest.update(chunk)
    return digest.hexdigest()


def _override_of(settings):
    places = {"width": "image", "height": "image", "samples": "sampling", "seed": "sampling",
              "mode": "sampling"}
    unknown = sorted(set(settings) - set(places))
    if unknown:
        raise TypeError(f"unknown setting: {', '.join(unknown)}")
    patch = {}
    for key, value in settings.items():
        if value is not None:
            patch.setdefault(places[key], {})[key] = value
    return patch


def _merge(target, patch):
    """One patch that does what both do, the second one last."""
    result = dict(target)
    for key, value in patch.items():
        both = isinstance(value, dict) and isinstance(result.get(key), dict)
        result[key] = _merge(result[key], value) if both else value
    return result


def _patched(target, patch):
    """JSON Merge Patch (RFC 7396)."""
    if not isinstance(patch, dict):
        return patch
    result = dict(target) if isinstance(target, dict) else {}
    for key, value in patch.items():
        if value is None:
            result.pop(key, None)
        else:
            result[key] = _patched(result.get(key), value)
    return result


def _refusal(status, fields, data):
    problem = {}
    if "json" in (fields.get("Content-Type") or ""):
        try:
            problem = json.loads(data)
        except ValueError:
            pass
    title = problem.get("title") or http.client.responses.get(status, "refused")
    return Refused(status, title, problem.get("detail", ""), problem.get("errors", ()))


# The program

def _show(found):
    sys.stderr.write(f"\r{found['state']} {100 * found['progress']:5.1f} %")
    sys.stderr.flush()


def main(arguments=None):
    parser = argparse.ArgumentParser(description="Renders one scene or GLB on a Penumbra server.")
    parser.add_argument("scene")
    parser.add_argument("-o", "--output", required=True, help="image: .png .jpg .exr .hdr")
    parser.add_argument("--server", default="http://127.0.0.1:8080")
    parser.add_argument("--token-file", type=pathlib.Path, help="file that holds the bearer token")
    parser.add_argument("--width", type=int)
    parser.add_argument("--height", type=int)
    parser.add_argument("--samples", type=int)
    given = parser.parse_args(arguments)
    token = given.token_file.read_text().strip() if given.token_file else None
    try:
        with Server(given.server, token) as server:
            render = server.submit(given.scene, width=given.width, height=given.height,
                                   samples=given.samples)
            try:
                for found in render.watch():
                    _show(found)
            except KeyboardInterrupt:
                render.cancel()
                raise
            sys.stderr.write("\n")
            render.save(given.output)
    except KeyboardInterrupt:
        return 130
    except (Error, OSError, ValueError) as error:
        print(f"penumbra.py: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
