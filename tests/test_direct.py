"""Causes chosen by what they take off voyages left out: a linear ship with known faults."""

from dataclasses import dataclass

import numpy as np
import polars as pl
import pytest

from shiplog.direct import FOLDS, MOST, Search, select

VOYAGES, EACH, SAMPLES = 9, 4, 20
RNG = np.random.default_rng(0)
SHAPE = (VOYAGES * EACH, SAMPLES, 3)
BEND = {  # label → how its numbers bend the rollouts
    "wind": RNG.standard_normal((*SHAPE, 3)),
    "rudder": RNG.standard_normal((*SHAPE, 1)),
    "idle": RNG.standard_normal((*SHAPE, 1)),
    "once": np.zeros((*SHAPE, 1)),
    "many": RNG.standard_normal((*SHAPE, MOST)),
}
BEND["once"][:EACH] = RNG.standard_normal((EACH, SAMPLES, 3, 1))  # on the first voyage alone
TRUE = {"wind": [0.5, -0.6, -0.4], "rudder": [0.8], "once": [4.0]}
NOISE = 0.3 * RNG.standard_normal(SHAPE)


class Cut:
    """As much of Windows as a choice needs."""

    plan = pl.DataFrame({"voyage": [f"v{i // EACH}" for i in range(VOYAGES * EACH)]})

    def __len__(self):
        return self.plan.height


@dataclass(frozen=True)
class Linear(Search):
    """Errors that are linear in the numbers; units are twice the realistic size."""

    def residual(self, labels, x):
        wrong = NOISE - sum(BEND[n] @ np.array(p) for n, p in TRUE.items())
        numbers = x * self.size[self.where(labels)]
        at = 0
        for label in labels:
            count = len(self.at[label])
            wrong = wrong + BEND[label] @ numbers[at : at + count]
            at += count
        return wrong


def search(labels=tuple(BEND)):
    at, first = {}, 0
    for label in labels:
        at[label] = np.arange(first, first + BEND[label].shape[-1])
        first += BEND[label].shape[-1]
    size = np.full(first, 2.0)
    far = np.full(first, 10.0)
    return Linear(Cut(), None, None, None, at, size, -far, far)


@pytest.fixture(scope="module")
def found():
    return select(search())


def test_the_faults_are_chosen_and_nothing_else(found):
    """What helps one voyage alone takes much off on all windows and nothing off those left out."""
    assert list(found.numbers) == ["wind", "rudder"]
    assert found.numbers["wind"] == pytest.approx(TRUE["wind"], abs=0.1)
    assert found.numbers["rudder"] == pytest.approx(TRUE["rudder"], abs=0.1)
    assert min(found.probability.values()) > 0.9
    assert set(found.refused) & {"once", "idle"}


def test_intervals_come_from_leaving_voyages_out(found):
    """Jackknife of least squares: about σ/√(Σ x²) where noise is white, but for one odd voyage."""
    for label, true in TRUE.items():
        if label in found.numbers:
            sd = np.sqrt(np.diag(found.covariance[label]))
            assert (np.abs(found.numbers[label] - true) < 4.0 * sd).all()
            assert (sd < 0.1).all()


def test_each_voyage_has_numbers_fitted_without_it(found):
    """Refitted here by ordinary least squares on the other folds."""
    voyages = Cut.plan["voyage"].to_numpy()
    order = [f"v{i}" for i in range(VOYAGES)]
    design = np.concatenate((BEND["wind"], BEND["rudder"]), -1)
    target = sum(BEND[n] @ np.array(p) for n, p in TRUE.items()) - NOISE
    for voyage in ("v0", "v3"):
        fold = order.index(voyage) % FOLDS
        out = np.isin(voyages, [v for i, v in enumerate(order) if i % FOLDS == fold])
        x = np.linalg.lstsq(design[~out].reshape(-1, 4), target[~out].reshape(-1), rcond=None)[0]
        own = np.concatenate([found.without[voyage][n] for n in ("wind", "rudder")])
        assert own == pytest.approx(x, abs=5e-3)


def test_where_nothing_helps_nothing_is_chosen():
    nothing = select(search(("idle", "many")))
    assert not nothing.numbers and not nothing.without
    assert "takes" in nothing.refused["idle"]
