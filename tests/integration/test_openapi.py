# SPDX-License-Identifier: Apache-2.0
"""The OpenAPI document: sound in itself, about the routes that there are, and served.

That real answers are as it says is held by support/contract.py, through which the other tests of
HTTP ask."""
import json
import re

import contract
import farm
import jsonschema
import pytest
from http_server import Server

METHODS = ("get", "put", "post", "patch", "delete")
DOCUMENT = contract.DOCUMENT


def nodes(node, trail=()):
    """Every object of the document with the keys that lead to it."""
    if isinstance(node, dict):
        yield trail, node
        for key, value in node.items():
            yield from nodes(value, (*trail, key))
    elif isinstance(node, list):
        for index, value in enumerate(node):
            yield from nodes(value, (*trail, index))


def operations():
    for path, item in DOCUMENT["paths"].items():
        for method in METHODS:
            if method in item:
                yield path, method, item, item[method]


def test_references_lead_somewhere_and_everything_is_used():
    """Breaks if something is renamed in one place, or left behind when its last user has gone."""
    used = {node["$ref"] for _, node in nodes(DOCUMENT) if "$ref" in node}
    local = {name for name in used if name.startswith("#/")}
    assert used - local == {"scene.schema.json"}
    for name in local:
        contract.resolve({"$ref": name})
    for kind, components in DOCUMENT["components"].items():
        if kind == "securitySchemes":
            named = {name for *_, operation in operations() for rule in operation.get("security", ())
                     for name in rule}
            assert named == set(components)
        else:
            assert {f"#/components/{kind}/{name}" for name in components} <= used


def test_schemas_are_schemas():
    """Breaks if a keyword is misspelled in its value, as a type that there is not."""
    found = [node["schema"] for _, node in nodes(DOCUMENT) if "schema" in node]
    found += DOCUMENT["components"]["schemas"].values()
    assert len(found) > 40
    for schema in found:
        jsonschema.Draft202012Validator.check_schema(schema)


def test_operations_are_complete():
    """Breaks if a parameter of a path is not declared, or a generator would make two functions of
    one name."""
    names = [operation["operationId"] for *_, operation in operations()]
    assert len(names) == len(set(names)) > 15
    tags = {tag["name"] for tag in DOCUMENT["tags"]}
    for path, _, item, operation in operations():
        declared = map(contract.resolve, item.get("parameters", []) + operation.get("parameters", []))
        in_path = {p["name"] for p in declared if p["in"] == "path" and p["required"]}
        assert in_path == set(re.findall(r"\{(\w+)\}", path))
        assert operation["summary"] and set(operation["tags"]) <= tags
        assert all(contract.resolve(r)["description"] for r in operation["responses"].values())


def test_the_document_is_about_the_routes_that_there_are():
    """Breaks if a route is added without a word in the document, or the other way round."""
    source = (contract.TREE / "server/api.c").read_text()
    table = source[source.index("routes[] = {"):source.index("enum { ROUTES")]
    routes = {(path, method.lower())
              for path, method in re.findall(r'\{"([^"]+)",\s*PEN_(\w+),', table)}
    assert len(routes) > 15
    assert routes == {(path, method) for path, method, *_ in operations()}


def test_the_version_is_the_programs():
    lists = (contract.TREE / "CMakeLists.txt").read_text()
    assert DOCUMENT["info"]["version"] == re.search(r"VERSION (\d+\.\d+\.\d+)", lists)[1]


@pytest.mark.parametrize("path, file", [("/openapi.json", "server/openapi.json"),
                                        ("/scene.schema.json", "core/scene/scene.schema.json")])
def test_documents_are_served(path, file):
    """Breaks if the program has another text in it than the tree, or a poll of it costs a body."""
    with Server() as server:
        answer = server.get(path)
        assert answer.status == 200 and answer.headers["Content-Type"] == "application/json"
        assert answer.body == (contract.TREE / file).read_bytes()
        again = server.get(path, If_None_Match=answer.headers["ETag"])
        assert (again.status, again.body) == (304, b"")


RENDER = json.loads("""{"id": "a", "name": null, "state": "done", "progress": 1, "priority": 50,
    "preview": false, "deadline": null,
    "width": 1, "height": 1, "samples": 1, "samples_done": 1, "tiles_done": 1, "tiles_total": 1,
    "frames": {"first": 1, "last": 1, "total": 1, "done": 1, "running": []}, "eta_seconds": null,
    "created": "2026-01-31T12:00:00.123Z", "started": null, "finished": null, "seconds": 0,
    "class": null, "content": null, "restarts": 0, "warnings": [], "error": null, "errors": [],
    "links": {"self": "/", "image": "/", "frames": "/", "events": "/", "iiif": "/",
              "images": {"png": "/", "jpg": "/", "exr": "/", "hdr": "/"}}}""")
FIELDS = {"Content-Type": "application/json", "ETag": 'W/"1"', "Cache-Control": "no-cache"}
FAULTS = {
    "status": dict(status=299), "path": dict(path="/v1/nothing"), "method": dict(method="PUT"),
    "type": dict(headers={**FIELDS, "Content-Type": "text/plain"}),
    "field": dict(headers={**FIELDS, "ETag": '"strong"'}),
    "no field": dict(headers={"Content-Type": "application/json", "ETag": 'W/"1"'}),
    "value": dict(body={**RENDER, "progress": 1.5}), "state": dict(body={**RENDER, "state": "gone"}),
    "member": dict(body={**RENDER, "colour": 1}),
    "no member": dict(body={k: v for k, v in RENDER.items() if k != "links"}),
}


@pytest.mark.parametrize("fault", [None, *FAULTS])
def test_an_answer_that_differs_is_found(fault):
    """Breaks if the check of all the other tests passes whatever it is given."""
    answer = dict(method="GET", path="/v1/renders/a", status=200, headers=FIELDS, body=RENDER)
    answer.update(FAULTS.get(fault, {}))
    answer["body"] = json.dumps(answer["body"]).encode()
    if fault is None:
        contract.check(**answer)
        return
    with pytest.raises((AssertionError, jsonschema.ValidationError)):
        contract.check(**answer)


def test_a_whole_render_keeps_the_contract():
    """Breaks if what a real coordinator and its workers tell differs from the document."""
    scene = {"version": 1, "image": {"width": 32, "height": 16}, "sampling": {"samples": 4}}
    with farm.Farm(processes=1) as service:
        service.render(scene)
        for path in ["/v1/renders", "/v1/workers", "/v1/farm", "/metrics", "/readyz"]:
            assert service.request("GET", path).status == 200
