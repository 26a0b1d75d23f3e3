# SPDX-License-Identifier: Apache-2.0
"""GET /metrics, as Prometheus reads it."""
import re

from farm import Farm

SCENE = {"version": 1, "image": {"width": 64, "height": 64}, "sampling": {"samples": 16}}
SAMPLE = re.compile(r'([a-z_]+)(?:\{(.*)\})? (-?[0-9.e+]+)')
LABELS = re.compile(r'[a-z_]+="(?:[^"\\\n]|\\["\\n])*"(?:,|$)')


def scrape(farm):
    """{name: {labels: value}}; every line must be one that the text format knows."""
    answer = farm.request("GET", "/metrics")
    assert answer.status == 200
    assert answer.headers["Content-Type"].startswith("text/plain; version=0.0.4")
    found, declared = {}, {}
    for line in answer.body.decode().splitlines():
        if line.startswith("# "):
            _, kind, name, text = line.split(" ", 3)
            assert kind in ("HELP", "TYPE")
            if kind == "TYPE":
                assert name not in declared, f"{name} is declared twice"
                declared[name] = text
            continue
        name, labels, value = SAMPLE.fullmatch(line).groups()
        assert LABELS.sub("", labels or "") == "", line
        assert name in declared and (declared[name] == "counter") == name.endswith("_total")
        series = found.setdefault(name, {})
        assert labels not in series, f"{name}{{{labels}}} stands there twice"
        series[labels] = float(value)
    return found


def test_the_numbers_are_those_of_the_farm():
    """Breaks when a counter is not raised, or counts units of one worker only."""
    with Farm(processes=1) as farm:
        before = scrape(farm)
        assert before["penumbra_samples_total"][None] == 0
        render = farm.submit(SCENE)
        farm.wait(render)
        after = scrape(farm)
        assert after["penumbra_samples_total"][None] == 64 * 64 * 16
        assert after["penumbra_units_total"][None] > 0
        assert after["penumbra_units_failed_total"][None] == 0
        assert after["penumbra_renders"]['state="done"'] == 1
        assert sum(after["penumbra_renders"].values()) == 1
        assert after["penumbra_workers"]['state="ready"'] == 1
        assert after["process_resident_memory_bytes"][None] > 1 << 20
        assert after["process_open_fds"][None] > 3


def test_counters_outlive_their_worker_and_names_are_escaped():
    """Breaks when totals are summed over who is there now, or a name can end its label."""
    with Farm(processes=0) as farm:
        worker = farm.connect_worker(1, "--name", 'a "quoted" \\ name')
        farm.wait(farm.submit(SCENE))
        shown = scrape(farm)["penumbra_worker_samples_total"]
        assert [re.search('name="(.*)"', labels)[1] for labels in shown] == [
            r'a \"quoted\" \\ name']
        worker.terminate()
        worker.wait(timeout=20)
        after = scrape(farm)
        assert "penumbra_worker_samples_total" not in after
        assert after["penumbra_samples_total"][None] == 64 * 64 * 16
