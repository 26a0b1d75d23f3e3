# SPDX-License-Identifier: Apache-2.0
"""Kubernetes manifests, compose file and Dockerfile: what they name is there, and fits together.

`tests/run.sh long manifests` validates them by their schemas too, which come from npm.
"""
import itertools
import re
import subprocess

import pytest
import yaml
from farm import ROOT, Farm, free_port, program
from proxy import Proxy, certificate, substitute

KUBERNETES, DOCKER = ROOT / "deploy/kubernetes", ROOT / "deploy/docker"
VERSION = re.search(r"VERSION (\d+\.\d+\.\d+)", (ROOT / "CMakeLists.txt").read_text())[1]
IMAGE = f"penumbra:{VERSION}"


def objects():
    return [value for path in sorted(KUBERNETES.glob("*.yaml")) for value in yaml.safe_load_all(path.read_text())]


def find(kind, name):
    found = [o for o in objects() if o["kind"] == kind and o["metadata"]["name"] == name]
    assert len(found) == 1, (kind, name)
    return found[0]


def deployments():
    return [o for o in objects() if o["kind"] == "Deployment"]


def pod(deployment):
    return deployment["spec"]["template"]


def containers():
    return [(d, c) for d in deployments() for c in pod(d)["spec"]["containers"]]


def test_all_kinds_are_there():
    kinds = {o["kind"] for o in objects()}
    assert kinds >= {"Deployment", "Service", "PersistentVolumeClaim", "PodDisruptionBudget", "ScaledObject",
                     "NetworkPolicy", "ConfigMap", "TriggerAuthentication"}
    names = [(o["kind"], o["metadata"]["name"]) for o in objects()]
    assert len(set(names)) == len(names)


def matches(selector, labels):
    return selector["matchLabels"].items() <= labels.items()


def test_selectors_find_the_pods():
    """Breaks when a label is changed in one place: a Service, a budget or a policy would be about nobody."""
    pods = {d["metadata"]["name"]: pod(d)["metadata"]["labels"] for d in deployments()}
    for deployment in deployments():
        assert matches(deployment["spec"]["selector"], pods[deployment["metadata"]["name"]])
    for kind, name, of in (("PodDisruptionBudget", "penumbra-worker", "penumbra-worker"),
                           ("NetworkPolicy", "penumbra", "penumbra"),
                           ("NetworkPolicy", "penumbra-worker", "penumbra-worker")):
        spec = find(kind, name)["spec"]
        selector = spec.get("selector") or spec["podSelector"]
        assert [p for p, labels in pods.items() if matches(selector, labels)] == [of]
    selector = find("Service", "penumbra")["spec"]["selector"]
    assert [p for p, labels in pods.items() if selector.items() <= labels.items()] == ["penumbra"]
    assert find("ScaledObject", "penumbra-worker")["spec"]["scaleTargetRef"]["name"] in pods


def test_ports_lead_from_the_service_through_the_policy_to_the_proxy():
    proxy = next(c for _, c in containers() if c["name"] == "proxy" and "ports" in c)
    ports = {p["name"]: p["containerPort"] for p in proxy["ports"]}
    text = find("ConfigMap", "penumbra-proxy")["data"]["haproxy.cfg"]
    assert {int(n) for n in re.findall(r"bind :(\d+)", text)} == set(ports.values())
    assert {p["targetPort"] for p in find("Service", "penumbra")["spec"]["ports"]} == set(ports)
    policy = find("NetworkPolicy", "penumbra")["spec"]["ingress"]
    assert {p["port"] for rule in policy for p in rule["ports"]} == set(ports)
    coordinator = next(c for _, c in containers() if c["name"] == "coordinator")
    for where in re.findall(r"server coordinator (127\.0\.0\.1:\d+)", text):
        assert where in coordinator["args"]
    worker = next(c for _, c in containers() if c["name"] == "worker")
    text = find("ConfigMap", "penumbra-worker-proxy")["data"]["haproxy.cfg"]
    assert re.search(r"bind (\S+)", text)[1] in worker["args"]
    assert f"penumbra:{ports['workers']} " in text and "verifyhost penumbra" in text
    trigger = find("ScaledObject", "penumbra-worker")["spec"]["triggers"][0]
    assert trigger["metadata"]["url"] == f"http://penumbra:{ports['http']}/v1/farm"
    assert trigger["metadata"]["valueLocation"] == "queue_depth"
    assert find("TriggerAuthentication", trigger["authenticationRef"]["name"])


@pytest.mark.parametrize("deployment, container", containers(),
                         ids=lambda value: value.get("name") or value["metadata"]["name"])
def test_containers_are_confined_and_whole(deployment, container):
    security = container["securityContext"]
    assert security["readOnlyRootFilesystem"] and not security["allowPrivilegeEscalation"]
    assert security["capabilities"] == {"drop": ["ALL"]}
    assert pod(deployment)["spec"]["securityContext"]["runAsNonRoot"]
    assert container["resources"]["limits"]["memory"] and container["resources"]["requests"]["cpu"]
    volumes = {v["name"]: v for v in pod(deployment)["spec"]["volumes"]}
    assert {m["name"] for m in container["volumeMounts"]} <= set(volumes)
    for volume in volumes.values():
        if "configMap" in volume:
            assert find("ConfigMap", volume["configMap"]["name"])
        if "persistentVolumeClaim" in volume:
            assert find("PersistentVolumeClaim", volume["persistentVolumeClaim"]["claimName"])
    if container["name"] in ("coordinator", "worker"):
        assert container["image"] == IMAGE


def options_of(*words):
    text = subprocess.run([program(words[0]), *words[1:], "--help"], capture_output=True, text=True, check=True,
                          timeout=30).stdout
    return set(re.findall(r"--[a-z][\w-]*", text))


def compose():
    return yaml.safe_load((DOCKER / "compose.yaml").read_text())


def test_the_programs_know_the_options_that_are_given_to_them():
    """Breaks when an option is renamed."""
    given = {c["name"]: c["args"] for _, c in containers() if c["name"] in ("coordinator", "worker")}
    services = compose()["services"]
    serve = [*given["coordinator"], *services["coordinator"]["command"]]
    worker = [*given["worker"], *services["worker"]["command"]]
    assert given["coordinator"][0] == services["coordinator"]["command"][0] == "serve"
    assert {w for w in serve if w.startswith("--")} <= options_of("penumbra", "serve")
    assert {w for w in worker if w.startswith("--")} <= options_of("penumbra-worker")


def haproxy_texts():
    yield "compose", (DOCKER / "haproxy.cfg").read_text()
    for name in ("penumbra-proxy", "penumbra-worker-proxy"):
        yield name, find("ConfigMap", name)["data"]["haproxy.cfg"]


@pytest.mark.parametrize("name, text", haproxy_texts(), ids=lambda value: value.split("\n")[0][:20])
def test_haproxy_accepts_its_files(name, text, tmp_path):
    """Breaks on a misspelt keyword, which would show when the pod starts only."""
    pem = certificate(tmp_path, "penumbra").read_text()
    for key in ("workers.pem", "worker.pem", "ca.pem"):
        (tmp_path / key).write_text(pem)
    path = tmp_path / "haproxy.cfg"
    path.write_text(text.replace("/keys/", f"{tmp_path}/").replace(" penumbra:8443", " 127.0.0.1:8443"))
    run = subprocess.run(["haproxy", "-c", "-f", path], capture_output=True, text=True, timeout=60, check=False,
                         env={"PENUMBRA_PASSWORD": "secret", "PATH": "/usr/sbin:/usr/bin"})
    assert run.returncode == 0 and "[WARNING]" not in run.stderr, run.stderr


def test_the_pods_proxies_carry_clients_and_workers(tmp_path):
    """The texts of both ConfigMaps, between a coordinator and a worker. Breaks when a probe wants a password, a
    client needs none, or a worker does not come through with its certificate."""
    for name, authority in (("authority", None), ("penumbra", tmp_path / "authority"), ("worker", tmp_path / "authority")):
        certificate(tmp_path, name, authority)
    http, far, near = (free_port() for _ in range(3))
    with Farm(processes=0) as farm:
        (tmp_path / "a.cfg").write_text(substitute(
            find("ConfigMap", "penumbra-proxy")["data"]["haproxy.cfg"], ("bind :8080", f"bind 127.0.0.1:{http}"),
            ("bind :8443", f"bind 127.0.0.1:{far}"), ("127.0.0.1:8090", f"127.0.0.1:{farm.http_port}"),
            ("127.0.0.1:8081", f"127.0.0.1:{farm.worker_port}"), ("/keys/workers.pem", tmp_path / "penumbra.pem"),
            ("/keys/ca.pem", tmp_path / "authority.crt"), ("${PENUMBRA_PASSWORD}", "secret")))
        (tmp_path / "b.cfg").write_text(substitute(
            find("ConfigMap", "penumbra-worker-proxy")["data"]["haproxy.cfg"],
            ("127.0.0.1:8081", f"127.0.0.1:{near}"), ("penumbra:8443", f"127.0.0.1:{far}"),
            ("/keys/worker.pem", tmp_path / "worker.pem"), ("/keys/ca.pem", tmp_path / "authority.crt")))
        with (Proxy(["haproxy", "-db", "-q", "-f", tmp_path / "a.cfg"], http, far),
              Proxy(["haproxy", "-db", "-q", "-f", tmp_path / "b.cfg"], near)):
            url = f"http://127.0.0.1:{http}"
            for path, expected in (("/livez", 200), ("/readyz", 200), ("/metrics", 200), ("/v1/farm", 401)):
                assert status_of("-H", "Host: penumbra:8080", url + path) == expected, path
            assert status_of("-u", "penumbra:secret", "-H", "Host: penumbra:8080", url + "/v1/farm") == 200
            worker = subprocess.Popen([program("penumbra-worker"), "--connect", f"127.0.0.1:{near}",
                                       "--processes", "1"], stdin=subprocess.DEVNULL)
            try:
                farm.render({"version": 1, "image": {"width": 32, "height": 32}, "objects": []})
            finally:
                worker.terminate()
                worker.wait(timeout=20)


def status_of(*words):
    run = subprocess.run(["curl", "-sS", "-o", "/dev/null", "-w", "%{http_code}", *words], capture_output=True,
                         text=True, timeout=30, check=True)
    return int(run.stdout)


def test_compose_names_what_is_there():
    """Breaks when a file that is mounted is renamed: Docker would make a folder in its place."""
    found = compose()
    for name, service in found["services"].items():
        assert service["image"], name
        for mount in service.get("volumes", ()):
            source = mount.split(":")[0]
            assert source in found["volumes"] if source[0] != "." else (DOCKER / source).exists(), mount
        assert set(service.get("depends_on", ())) <= set(found["services"])
        network = service.get("network_mode", "").removeprefix("service:")
        assert not network or network in found["services"]
    build = found["services"]["coordinator"]["build"]
    assert (DOCKER / build["context"]).resolve() == ROOT and (ROOT / build["dockerfile"]).exists()
    bind = re.search(r"bind :(\d+)", (DOCKER / "haproxy.cfg").read_text())[1]
    assert f"127.0.0.1:8080:{bind}" in found["services"]["coordinator"]["ports"]
    assert {s["image"] for s in found["services"].values() if "penumbra" in s["image"]} == {IMAGE}


def instructions():
    """(keyword, words) of the Dockerfile, in order."""
    text = (DOCKER / "Dockerfile").read_text().replace("\\\n", " ")
    for line in text.splitlines():
        if line and not line.startswith("#"):
            keyword, _, words = line.partition(" ")
            yield keyword, words.split()


def test_the_dockerfile_copies_and_runs_what_is_there():
    """Breaks when a script or a package that it names has moved."""
    stages = set()
    for keyword, words in instructions():
        if keyword == "FROM":
            stages |= {words[2]} if "AS" in words else set()
        if keyword == "COPY" and words[0].startswith("--from="):
            assert words[0].removeprefix("--from=") in stages
        elif keyword == "COPY":
            assert all((ROOT / word).exists() for word in words[:-1])
    everything = [word for _, words in instructions() for word in words]
    assert "deploy/install-deps.sh" in everything and (ROOT / "deploy/install-deps.sh").exists()
    assert '"name": "release"' in (ROOT / "CMakePresets.json").read_text()
    names = re.findall(r"_PACKAGE_NAME (\S+)\)", (ROOT / "deploy/cmake/Packaging.cmake").read_text())
    installed = re.findall(r"/packages/([\w-]+)_\*\.deb", " ".join(everything))
    assert installed == ["penumbra", "penumbra-worker"] and set(installed) <= set(names)
    user = next(words for keyword, words in instructions() if keyword == "USER")[0]
    ids = {str(pod(d)["spec"]["securityContext"]["runAsUser"]) for d in deployments()}
    assert set(itertools.chain(user.split(":"))) == ids


def test_grafanas_provisioning_leads_to_the_dashboard():
    boards = yaml.safe_load((DOCKER / "grafana-boards.yaml").read_text())["providers"][0]["options"]["path"]
    mounts = compose()["services"]["grafana"]["volumes"]
    source = next(m.split(":")[0] for m in mounts if m.split(":")[1] == boards)
    assert (DOCKER / source / "penumbra.json").exists()
