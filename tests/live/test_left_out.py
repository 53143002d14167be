"""What a watch and the voyages that are left out of its campaign have in common."""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from shiplog.diagnosis.nominal import campaign_prior
from shiplog.diagnosis.nominal.voyage_effects import VoyageEffects
from shiplog.live import left_out


@dataclass(frozen=True)
class Said:
    """A campaign of which only the share is looked at."""

    reference: Any
    effects: Any = None


def of_share(share: float) -> Said:
    return Said(SimpleNamespace(counts=share))


@pytest.mark.parametrize(
    ("own", "others", "chosen"),
    [
        (1.0, [0.5, 0.5, 0.5, 0.5, 0.5], 0.5),  # the campaign alone says 1
        (0.5, [1.0, 1.0, 1.0, 1.0, 0.5], 1.0),
        (1.0, [1.0, 0.5, 0.5], 0.5),  # of two and two the lower
        (0.25, [1.0, 0.5], 0.5),
    ],
)
def test_one_share_is_that_which_most_of_them_say(monkeypatch, own, others, chosen):
    asked = iter(others)

    def without(campaign, out, shares, effects=None):
        return of_share(shares[0] if len(shares) == 1 else next(asked))

    monkeypatch.setattr(left_out, "without", without)
    of = np.repeat(np.arange(len(others)), 3)
    campaign: Any = of_share(own)
    assert left_out.in_common(campaign, of).reference.counts == chosen
    used = [one.reference.counts for _, one in left_out.folds(campaign, of)]
    assert used == [own] * len(others)  # each with that of the campaign it is given


def test_of_one_voyage_the_share_stays():
    campaign: Any = of_share(0.25)
    assert left_out.in_common(campaign, np.zeros(5, int)) is campaign


def test_a_share_that_is_given_is_kept_whatever_the_voyages_say():
    """Voyages that contradict each other count for little; one share that is offered is taken."""
    rng = np.random.default_rng(68)
    effects = VoyageEffects(np.array([0.01]), np.array([10.0]))
    parts = []
    for value in (-3.0, -3.0, 3.0, 3.0):
        J, e = np.ones((40, 1)), value + rng.normal(0.0, 1.0, 40)
        A = np.column_stack((e, J[:, 0]))
        parts.append(A.T @ A)
    voyages = np.array([0, 1, 2, 3])
    _, free = campaign_prior.learn(parts, voyages, effects, np.zeros(1))
    assert free < 0.5
    _, given = campaign_prior.learn(parts, voyages, effects, np.zeros(1), (0.5,))
    assert given == 0.5
