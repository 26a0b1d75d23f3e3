# SPDX-License-Identifier: Apache-2.0
"""The JSON Schema of the scene format says what the parser says."""

import copy
import json
import pathlib

import jsonschema
import pytest

TREE = pathlib.Path(__file__).resolve().parents[2]
SCHEMA = json.loads((TREE / "core/scene/scene.schema.json").read_text())
CASES = json.loads((TREE / "tests/unit/scene_cases.json").read_text())
SCENES = sorted((TREE / "tests/reference").glob("*/*.json"))
MINIMAL = {"version": 1, "image": {"width": 8, "height": 4}}


def merge(target, patch):
    """RFC 7396."""
    if not isinstance(patch, dict):
        return patch
    result = dict(target) if isinstance(target, dict) else {}
    for key, value in patch.items():
        if value is None:
            result.pop(key, None)
        else:
            result[key] = merge(result.get(key), value)
    return result


@pytest.fixture(scope="module")
def validator():
    jsonschema.Draft202012Validator.check_schema(SCHEMA)
    return jsonschema.Draft202012Validator(SCHEMA)


# Broken by a range, key, type or default branch of the schema that differs from the parser's, which
# gives its verdict on the same table in unit/test_scene_cases.c.
@pytest.mark.parametrize("case", CASES, ids=lambda case: case["case"])
def test_schema_agrees_with_the_parser(validator, case):
    scene = merge(copy.deepcopy(MINIMAL), case["patch"])
    assert validator.is_valid(scene) == case["good"]


# Broken by a schema that is stricter than the scenes we ship.
@pytest.mark.parametrize("path", SCENES, ids=lambda path: path.stem)
def test_shipped_scenes_are_valid(validator, path):
    validator.validate(json.loads(path.read_text()))


# Broken by a default that its own schema refuses.
def test_defaults_are_valid(validator):
    def walk(node):
        if isinstance(node, dict):
            if "default" in node:
                yield node
            for value in node.values():
                yield from walk(value)
        elif isinstance(node, list):
            for value in node:
                yield from walk(value)

    nodes = list(walk(SCHEMA))
    assert len(nodes) > 50
    for node in nodes:
        validator.evolve(schema={**node, "$defs": SCHEMA["$defs"]}).validate(node["default"])
