# SPDX-License-Identifier: Apache-2.0
"""Prometheus' rules and Grafana's dashboard: right by themselves, and about metrics that there are."""
import json
import re
import shutil
import subprocess

import pytest
import yaml
from farm import ROOT, Farm

PROMETHEUS = ROOT / "deploy/prometheus"
DASHBOARD = ROOT / "deploy/grafana/penumbra.json"
# Of PromQL, and of Prometheus itself.
WORDS = {"up"}


def promtool(*words):
    return subprocess.run(["promtool", *map(str, words)], capture_output=True, text=True, timeout=60,
                          cwd=PROMETHEUS, check=False)


def test_promtool_accepts_configuration_and_rules():
    run = promtool("check", "config", "prometheus.yml")
    assert run.returncode == 0, run.stdout + run.stderr
    assert "9 rules found" in run.stdout


def test_the_alerts_fire_when_they_should():
    """Breaks when an expression matches nothing, or a label is lost on the way."""
    run = promtool("test", "rules", "penumbra.rules.test.yml")
    assert run.returncode == 0, run.stdout + run.stderr


def test_a_broken_rule_is_found(tmp_path):
    """The check above can fail."""
    for path in PROMETHEUS.iterdir():
        shutil.copy(path, tmp_path)
    rules = tmp_path / "penumbra.rules.yml"
    rules.write_text(rules.read_text().replace("penumbra_queue_units > 0 and", "penumbra_units_total < 0 and"))
    run = subprocess.run(["promtool", "test", "rules", "penumbra.rules.test.yml"], cwd=tmp_path,
                         capture_output=True, text=True, timeout=60, check=False)
    assert run.returncode != 0 and "PenumbraNoWorkers" in run.stdout + run.stderr


def expressions():
    """(place, PromQL) of all rules and panels."""
    for group in yaml.safe_load((PROMETHEUS / "penumbra.rules.yml").read_text())["groups"]:
        for rule in group["rules"]:
            yield rule.get("alert") or rule["record"], rule["expr"]
    for panel in json.loads(DASHBOARD.read_text())["panels"]:
        for target in panel.get("targets", ()):
            yield panel["title"], target["expr"]


def recorded():
    groups = yaml.safe_load((PROMETHEUS / "penumbra.rules.yml").read_text())["groups"]
    return {rule["record"] for group in groups for rule in group["rules"] if "record" in rule}


def names_in(expression):
    code = re.sub(r"\{[^}]*\}|\[[^]]*\]|\"[^\"]*\"", "", expression)
    return set(re.findall(r"\b(?:penumbra|process)[\w:]+|\bup\b", code))


@pytest.fixture(scope="module")
def metrics():
    """Each metric of a coordinator at work, with the names of its labels."""
    with Farm(processes=1) as farm:
        farm.render({"version": 1, "image": {"width": 32, "height": 32}, "objects": []})
        text = farm.request("GET", "/metrics").body.decode()
    found = {}
    for name, labels in re.findall(r"^(\w+)(?:\{(.*)\})? ", text, flags=re.M):
        found.setdefault(name, set()).update(re.findall(r'(\w+)="', labels))
    return found


def test_every_metric_that_is_asked_for_exists(metrics):
    """Breaks when a metric is renamed: an alert that asks for it would be silent for ever."""
    found = [(place, name) for place, text in expressions() for name in names_in(text)]
    assert len(found) > 15 and len({place for place, _ in found}) > 12
    missing = [pair for pair in found if pair[1] not in {*metrics, *recorded(), *WORDS}]
    assert not missing


def test_every_label_that_is_asked_for_exists(metrics):
    for place, text in expressions():
        for name, labels in re.findall(r"(\w+)\{([^}]*)\}", text):
            asked = set(re.findall(r"(\w+)\s*[=!]", labels)) - {"job", "instance"}
            assert asked <= metrics.get(name, set()), (place, name)


def test_the_dashboard_is_whole():
    """Breaks when a panel has no query, two panels lie on each other, or a data source is named that is
    not chosen above."""
    board = json.loads(DASHBOARD.read_text())
    assert [variable["name"] for variable in board["templating"]["list"]] == ["source", "instance"]
    taken = set()
    for panel in board["panels"]:
        place = panel["gridPos"]
        cells = {(x, y) for x in range(place["x"], place["x"] + place["w"])
                 for y in range(place["y"], place["y"] + place["h"])}
        assert not cells & taken and place["x"] + place["w"] <= 24, panel["title"]
        taken |= cells
        assert panel["targets"] and panel["datasource"] == {"type": "prometheus", "uid": "${source}"}
    identities = [panel["id"] for panel in board["panels"]]
    assert len(set(identities)) == len(identities) >= 8
