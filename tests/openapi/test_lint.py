# SPDX-License-Identifier: Apache-2.0
"""The description of the HTTP interface by the linter of @redocly/cli, with its recommended rules."""
import json
import pathlib
import shutil
import subprocess

import pytest

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[1]
FILES = (ROOT / "server/openapi.json", ROOT / "core/scene/scene.schema.json")  # served from one place

# What it warns of and stays, by rule and place.
KEPT = {
    # IIIF's base URI redirects to info.json (Image API 3.0, section 2).
    ("operation-2xx-response", "#/paths/~1v1~1renders~1{id}~1iiif/get/responses"),
    # A frame's number has no dot in it.
    ("no-ambiguous-paths", "#/paths/~1v1~1renders~1{id}~1frames~1{number}.{extension}"),
}


@pytest.fixture(scope="module", name="linter")
def fixture_linter():
    """As package-lock.json has it, once; without the scripts of any package."""
    lock, installed = HERE / "package-lock.json", HERE / "node_modules/.package-lock.json"
    if not installed.exists() or installed.stat().st_mtime < lock.stat().st_mtime:
        subprocess.run(["npm", "ci", "--ignore-scripts", "--no-audit", "--no-fund"], cwd=HERE, check=True,
                       timeout=300)
    return HERE / "node_modules/.bin/redocly"


def problems(linter, directory):
    """(rule, place) of each."""
    run = subprocess.run([linter, "lint", "--extends=recommended", "--format=json", "openapi.json"], cwd=directory,
                         env={"PATH": "/usr/bin:/bin", "HOME": str(directory), "REDOCLY_TELEMETRY": "off",
                              "REDOCLY_SUPPRESS_UPDATE_NOTICE": "true"},
                         capture_output=True, text=True, check=False, timeout=120)
    found = json.loads(run.stdout)["problems"]
    return {(problem["ruleId"], place["pointer"]) for problem in found for place in problem["location"]}


def test_the_description_has_no_fault(linter, tmp_path):
    """Breaks with any error or warning that is not explained above, and when one of those has gone."""
    for path in FILES:
        shutil.copy(path, tmp_path)
    assert problems(linter, tmp_path) == KEPT


def test_a_fault_is_found(linter, tmp_path):
    """Breaks when the linter finds nothing whatever it is given."""
    shutil.copy(FILES[1], tmp_path)
    description = json.loads(FILES[0].read_text())
    del description["paths"]["/v1/renders"]["post"]["responses"]
    description["components"]["schemas"]["Envelope"]["type"] = "envelope"
    (tmp_path / "openapi.json").write_text(json.dumps(description))
    assert {rule for rule, _ in problems(linter, tmp_path) - KEPT} >= {"struct"}
