"""A trial whose voyages are held in blocks answers as the trial does, to the last bit."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from shared_trials import asked, refuse_different, trial_of

from shiplog.commands import cluster_trials
from shiplog.diagnosis.trial import trial_products
from shiplog.diagnosis.trial.blocks import Block, Here
from shiplog.diagnosis.trial.cache import Cache
from shiplog.diagnosis.trial.cluster_blocks import OnCluster
from shiplog.diagnosis.trial.shared_trial import Remote, SharedTrial
from shiplog.exceptions import ShiplogError
from shiplog.training.network import cluster

pytestmark = pytest.mark.long


@pytest.fixture(scope="module", autouse=True)
def a_voyage_a_block():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(trial_products, "VOYAGES", 1)
        yield


@pytest.fixture
def trial(published, store):
    return trial_of(published[0], store)


@pytest.fixture(scope="module")
def alone(published, store):
    """What the trial answers by itself."""
    return asked(trial_of(published[0], store))


def anew(block):
    """The block as another process gets it: nothing is known of it."""
    return Block(replace(block.trial, cache=Cache()), block.begin)


class Forgetful(Here):
    """Before each question one of the blocks is begun anew."""

    def answer(self, call):
        self.turn = getattr(self, "turn", -1) + 1
        blocks = list(self.blocks)
        gone = self.turn % len(blocks)
        blocks[gone] = anew(blocks[gone])
        self.blocks = blocks
        return super().answer(call)


@pytest.mark.parametrize("holders", [Here, Forgetful])
def test_not_one_number_is_different(trial, alone, holders):
    shared = SharedTrial.share(trial, holders)
    assert [len(block.trial.rows) for block in shared.shared.holders.blocks] == [2, 2, 2]
    refuse_different(asked(shared), alone)


def test_blocks_of_several_voyages(trial, alone, monkeypatch, published, store):
    """Two voyages and one: added in another order, which is that of the trial alone, too."""
    monkeypatch.setattr(trial_products, "VOYAGES", 2)
    shared = SharedTrial.share(trial, Here)
    assert [len(block.trial.rows) for block in shared.shared.holders.blocks] == [4, 2]
    refuse_different(asked(shared), asked(trial_of(published[0], store)))


def test_nothing_large_comes_from_the_blocks_unasked(trial):
    shared = SharedTrial.share(trial, Here)
    point = shared.linearise({})
    assert isinstance(point.linear, Remote) and point.linear.farthest > 0.0
    shared.products.total(point, 1.0, shared.weight, trial_products.Remainder())
    assert "_whole" not in vars(point.linear)
    assert point.linear.e.shape[0] == len(trial.rows) and "_whole" in vars(point.linear)
    assert all(block.trial.campaign.reference.nominal is None
               for block in shared.shared.holders.blocks)  # fmt: skip


def test_a_model_that_diverges_fails_as_a_trial_does(trial, monkeypatch):
    shared = SharedTrial.share(trial, Here)
    point = shared.linearise({})

    def singular(*_):
        raise np.linalg.LinAlgError("the model diverges here")

    monkeypatch.setattr(Block, "add", singular)
    with pytest.raises(np.linalg.LinAlgError, match="the model diverges here"):
        shared.products.total(point, 1.0, shared.weight, trial_products.Remainder())


# --- a cluster that is this process


class Gone(Exception):
    """Stands for Ray's error of an actor that has died."""


class Cluster:
    """Ray's calls, answered here; actors of `dead` numbers raise what Ray raises."""

    def __init__(self, cores):
        self.cores, self.made, self.dead, self.calls = cores, [], set(), 0
        self.exceptions = SimpleNamespace(RayActorError=Gone)

    def put(self, block):
        return block

    def cluster_resources(self):
        return {"CPU": float(self.cores)}

    def remote(self, **_):
        return lambda kind: SimpleNamespace(remote=lambda: self._make(kind))

    def _make(self, kind):
        number, actor = len(self.made), kind()

        def of(name):
            def remote(*arguments):
                self.calls += 1
                if number in self.dead:
                    return Gone()
                fresh = [anew(one) if isinstance(one, Block) else one for one in arguments]
                return Reference([getattr(actor, name)(*fresh)])

            return SimpleNamespace(remote=remote)

        self.made.append(SimpleNamespace(take=of("take"), answer=of("answer")))
        return self.made[-1]

    def wait(self, references, timeout):
        return references[:1], references[1:]

    def get(self, reference):
        if isinstance(reference, Gone):
            raise reference
        return reference[0]

    def kill(self, actor):
        self.dead.add(self.made.index(actor))


class Reference(tuple):
    """Two answers that are equal are two references."""

    __hash__ = object.__hash__
    __eq__ = object.__eq__


def test_an_actor_that_is_gone_costs_nothing(trial, alone):
    ray = Cluster(cores=2)
    shared = SharedTrial.share(trial, lambda blocks: OnCluster(ray, blocks))
    holders, real = shared.shared.holders, OnCluster.answer
    asks = []

    def answer(self, call):
        asks.append(call.method)
        if len(asks) == 12:
            ray.dead.add(0)
        return real(self, call)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(OnCluster, "answer", answer)
        refuse_different(asked(shared), alone)
    assert len(asks) > 30 and len(ray.made) == 2
    assert set(map(id, holders._with)) == {id(ray.made[1])}


def test_a_cluster_without_cores_is_said(trial):
    ray = Cluster(cores=1)
    shared = SharedTrial.share(trial, lambda blocks: OnCluster(ray, blocks))
    ray.dead, ray.cores = {0}, 0
    with pytest.raises(ShiplogError, match="No core of the Ray cluster is left"):
        shared.linearise({})


def test_voyages_that_end_whoever_holds_them_are_given_up(trial):
    ray = Cluster(cores=1)
    shared = SharedTrial.share(trial, lambda blocks: OnCluster(ray, blocks))
    ray.dead = set(range(100))
    with pytest.raises(ShiplogError, match="ended while they held the same voyages"):
        shared.linearise({})
    assert len(ray.made) < 20


def test_the_actors_of_a_trial_end_before_those_of_the_next(trial, monkeypatch):
    ray = Cluster(cores=1)
    ray.shutdown = lambda: ray.dead.add("shut down")
    monkeypatch.setattr(cluster, "connected", lambda address: ray)
    with cluster_trials.on_cluster("here") as share:
        share(trial)
        assert ray.dead == set()
        share(trial)
        assert ray.dead == {0}
    assert "shut down" in ray.dead
