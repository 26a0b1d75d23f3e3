# SPDX-License-Identifier: Apache-2.0
"""Workers that send pixels which are plausible and wrong."""
import json
import threading
import time

import farm
import pytest
import scene
from lying_worker import LIES, LyingWorker
from tile_peer import LEASE, Peer, pixels_of


def subject(samples=64):
    return scene.build(160, 120, samples, [scene.floor(), scene.sphere([0, 1, 0])],
                       camera=scene.look([0, 2, 7], [0, 1, 0]), background=0.5)


@pytest.fixture
def service():
    with farm.Farm(1, "--tile", 16) as running:
        yield running


class Liar(threading.Thread):
    """A worker of the class of the real one, which renders nothing and says that all is grey."""

    def __init__(self, service, pause=0.0, link=None):
        super().__init__(daemon=True)
        self.class_ = farm.wait_for(
            lambda: service.get("/v1/workers")["workers"], 20, "the real worker")[0]["class"]
        self.peer = Peer(service.worker_port, link)
        self.peer.hello(processes=2, name="liar", class_=self.class_)
        self.lies, self.pause = 0, pause

    def run(self):
        try:
            while True:
                kind, lease, _ = self.peer.receive()
                if kind == LEASE:
                    time.sleep(self.pause)
                    self.peer.result(lease, pixels_of(lease, 0.5 * (lease[6] if 6 in lease else 1)))
                    self.lies += 1
        except (EOFError, OSError):
            pass


def state_of_liar(service):
    return [w["state"] for w in service.get("/v1/workers")["workers"] if w["name"] == "liar"]


@pytest.mark.parametrize("verify", ["spot", "full"])
def test_a_liar_is_found(service, verify):
    """Broken by pixels that count because they came first, or by a farm that believes the liar."""
    undisturbed = service.render(subject(), 120)
    liar = Liar(service)
    liar.start()
    farm.wait_for(lambda: state_of_liar(service), 20, "the liar")
    render = service.submit({"scene": subject(), "options": {"verify": verify}})
    found = service.wait(render, 120)
    assert service.image(render) == undisturbed
    assert liar.lies > 0 and found["restarts"] == 0
    assert state_of_liar(service) in ([], ["quarantined"])


# How many results of such a worker may come before it is out of service (decisions/0009). Of what can be right
# the first unit of each worker is compared. What cannot is refused, and costs the worker its place when another
# has rendered three of these units, at its own pace. What it has leases for by then comes too.
BOUNDS = {"size": 32, "NaN": 32, "flip": 1, "darken": 1, "id": 2, "replay": 2}
LEASES_MAX = 8  # of a worker of one process


@pytest.mark.parametrize("verify", ["spot", "full"])
@pytest.mark.parametrize("lie", LIES)
def test_each_lie_is_found_within_its_bound(service, lie, verify):
    """Broken by a lie that gets into an image, takes longer to be found than was said, or costs the honest
    worker its good name."""
    undisturbed = service.render(subject(), 120)
    liar = LyingWorker(service, LIES[lie]())
    farm.wait_for(lambda: state_of_liar(service), 20, "the liar")
    renders = [service.submit({"scene": subject(), "options": {"verify": verify, "name": str(i)}}) for i in range(3)]
    for render in renders:
        assert service.wait(render, 120)["restarts"] == 0
        assert service.image(render) == undisturbed
    found = {w["name"] == "liar": w for w in service.get("/v1/workers")["workers"]}
    print(lie, verify, "sent", liar.told, "of", liar.own, found[True])
    liar.close()
    assert found[True]["state"] == "quarantined"
    assert 0 < liar.told <= BOUNDS[lie] + LEASES_MAX
    assert (found[False]["state"], found[False]["strikes"]) == ("ready", 0)


def test_what_nobody_checked_is_redone(service):
    """Broken by a liar whose earlier pixels stay where they are."""
    undisturbed = service.render(subject(6000), 120)
    liar = Liar(service, 0.1)
    liar.start()
    farm.wait_for(lambda: state_of_liar(service), 20, "the liar")
    trusting = service.submit(subject(6000))
    farm.wait_for(lambda: liar.lies > 3, 30, "lies")
    service.submit({"scene": subject(16), "options": {"verify": "full", "priority": 100}})
    farm.wait_for(lambda: state_of_liar(service) in ([], ["quarantined"]), 60, "quarantine")
    found = service.wait(trusting, 120)
    assert found["restarts"] == 1
    assert service.image(trusting) == undisturbed


def test_verification_outlives_the_coordinator(service):
    """Broken by a row that forgets it."""
    undisturbed = service.render(subject(512), 120)
    render = service.submit({"scene": subject(512), "options": {"verify": "full"}})
    service.wait_progress(render)
    service.kill()
    service.start()
    liar = Liar(service)
    liar.start()
    service.wait(render, 120)
    assert service.image(render) == undisturbed
    assert liar.lies > 0


def test_a_render_that_nobody_checked_is_no_answer(service):
    """Broken by an image that is found again although it was looked at less closely."""
    def post(verify):
        body = json.dumps({"scene": subject(4), "options": {"verify": verify}})
        answer = service.request("POST", "/v1/renders", body, {"Content-Type": "application/json"})
        return json.loads(answer.body)["id"]

    plain = post("none")
    service.wait(plain)
    full = post("full")
    service.wait(full)
    assert full != plain and post("spot") == full and post("full") == full
