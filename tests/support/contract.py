# SPDX-License-Identifier: Apache-2.0
"""What the OpenAPI document promises, held against real answers."""
import json
import pathlib
import re

import jsonschema

TREE = pathlib.Path(__file__).resolve().parents[2]
DOCUMENT = json.loads((TREE / "server/openapi.json").read_text())


def resolve(node):
    """What a local reference points at; anything else as it is."""
    while "$ref" in node:
        place, target = DOCUMENT, node["$ref"]
        for key in target.removeprefix("#/").split("/"):
            place = place[key.replace("~1", "/").replace("~0", "~")]
        node = place
    return node


def validate(schema, value):
    """Raises jsonschema.ValidationError. The schema's references are local ones."""
    schema = {"allOf": [schema], "components": DOCUMENT["components"]}
    jsonschema.Draft202012Validator(schema).validate(value)


def pattern_of(template):
    """A regular expression for the paths of a template."""
    pieces = re.split(r"\{\w+\}", template)
    return ("(.+)" if "{page}" in template else "([^/.]+)").join(map(re.escape, pieces))


def find(path):
    """The path item of a path, without its query; None when the document has none."""
    path = path.partition("?")[0]
    for template, item in DOCUMENT["paths"].items():
        if re.fullmatch(pattern_of(template), path):
            return item
    return None


def check_headers(promised, headers):
    for name, header in promised.items():
        header = resolve(header)
        assert name in headers or not header.get("required"), f"no {name} in {dict(headers)}"
        if name in headers:
            validate(header["schema"], headers[name])


def check_body(promised, headers, body):
    if not promised:
        assert body == b"" and "Content-Type" not in headers, headers["Content-Type"]
        return
    media_type = headers["Content-Type"].partition(";")[0]
    assert media_type in promised, f"{media_type} is none of {list(promised)}"
    schema = promised[media_type].get("schema")
    if schema:
        text = body.decode()
        validate(schema, json.loads(text) if media_type.endswith("json") else text)


def check(method, path, status, headers, body):
    """AssertionError or ValidationError when the document does not promise such an answer."""
    item = find(path)
    if item is None:
        assert status in (401, 404, 421), f"{path} is not in the document and was answered {status}"
        return
    if method == "OPTIONS":
        assert status in (204, 401, 421) and (status != 204 or "Allow" in headers), status
        return
    operation = item.get("get" if method == "HEAD" else method.lower())
    if operation is None:
        assert status in (401, 405, 403), f"{method} {path} is not in the document: {status}"
        return
    responses = operation["responses"]
    assert str(status) in responses, f"{method} {path}: {status} is none of {list(responses)}"
    response = resolve(responses[str(status)])
    check_headers(response.get("headers", {}), headers)
    if method != "HEAD":
        check_body(response.get("content"), headers, body)
