"""What nominal voyages say of a trial's numbers: closed forms, and draws with a known answer."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import block_diag

from shiplog.diagnosis.nominal import campaign_prior
from shiplog.diagnosis.nominal.campaign_prior import (
    INFORMATION_SHARES,
    learn,
    prior,
    reduce_voyages,
)
from shiplog.diagnosis.nominal.voyage_effects import VoyageEffects, reduced

EACH = np.arange(12)  # parts that are voyages of their own


def test_a_prior_is_the_posterior_of_the_parts_and_one_more_deviation():
    """Against drawn numbers: θ ~ N(mean, known⁻¹), each part sees all of θ, the trial's numbers
    are θ + b with b ~ N(0, D): a Gaussian by conditioning, of a part each with its power."""
    rng = np.random.default_rng(0)
    count, share = 4, 0.3
    known, anchor = rng.uniform(0.5, 3.0, count), rng.standard_normal(count)
    deviation = np.array([0.3, 0.0, 1.0, 0.2])
    j, e = rng.standard_normal((30, count)), rng.standard_normal(30)
    both = np.concatenate((e[:, None], j), 1)
    parts = [both[a : a + 10].T @ both[a : a + 10] for a in (0, 10, 20)]
    information, pull = prior(parts, known, anchor, deviation, share)

    before = np.diag(1.0 / known)
    whole = np.eye(30) / share + j @ before @ j.T
    gain = before @ j.T @ np.linalg.inv(whole)
    mean = anchor / known
    mean = mean + gain @ (e - j @ mean)
    covariance = before - gain @ j @ before + np.diag(deviation**2)
    assert np.linalg.inv(information) == pytest.approx(covariance, rel=1e-9)
    assert np.linalg.solve(information, pull) == pytest.approx(mean, rel=1e-9)
    # no parts: what was known, and the deviation
    information, pull = prior([], known, anchor, deviation, 1.0)
    assert np.linalg.inv(information) == pytest.approx(before + np.diag(deviation**2))
    assert np.linalg.solve(information, pull) == pytest.approx(anchor / known)


def drawn_parts(times: float, seed: int, count: int = 6, parts: int = 12) -> list[np.ndarray]:
    """Parts that agree on numbers of unit size, with noise `times` what is assumed."""
    rng = np.random.default_rng(seed)
    theta, found = rng.standard_normal(count), []
    for _ in range(parts):
        j = 0.5 * rng.standard_normal((30, count))
        both = np.concatenate(((j @ theta + times * rng.standard_normal(30))[:, None], j), 1)
        found.append(both.T @ both)
    return found


def test_a_right_noise_model_counts_whole_and_one_too_quiet_does_not():
    """Of 15 draws with the noise that is assumed most keep all of it, and none falls below a half;
    of 15 with twice that noise, which is four times the squares, none keeps more than a half."""
    effects, none = VoyageEffects(np.zeros(60), np.ones(60)), np.zeros(60)
    right, wrong = (
        [learn(drawn_parts(t, seed, 60), EACH, effects, none)[1] for seed in range(15)]
        for t in (1.0, 2.0)
    )
    assert sum(share == 1.0 for share in right) >= 9
    assert min(right) >= 0.5 >= max(wrong)
    assert set(right + wrong) <= set(INFORMATION_SHARES)


def test_one_voyage_cannot_say_how_far_campaigns_are_apart():
    effects = VoyageEffects(np.ones(6), np.ones(6))
    apart, share = learn(drawn_parts(1.0, 0), np.zeros(12), effects, np.zeros(6))
    assert apart**2 == pytest.approx((0.0 + 0.25**2 + 0.5**2 + 1.0) / 4)
    assert share == 1.0


def sailed(apart: float, seed: int, voyages: int = 8, count: int = 40) -> tuple[list, np.ndarray]:
    """Three parts a voyage, each with numbers of its own: of the voyage `apart` times as far from
    the others as its parts are from each other, 0.3. Their own numbers are integrated out."""
    rng = np.random.default_rng(seed)
    theta, parts = rng.standard_normal(count), []
    for _ in range(voyages):
        of_voyage = theta + 0.3 * apart * rng.standard_normal(count)
        for _ in range(3):
            own = of_voyage + 0.3 * rng.standard_normal(count)
            j = rng.standard_normal((120, count))
            both = np.concatenate(((j @ own + rng.standard_normal(120))[:, None], j), 1)
            parts.append(reduced(both.T @ both, np.full(count, 0.3))[0])
    return parts, np.repeat(np.arange(voyages), 3)


def test_how_far_campaigns_are_apart_is_what_the_voyages_say():
    """Drawn with 0 and with 1: the mean of five draws each is within a third of that."""
    effects = VoyageEffects(np.full(40, 0.3), np.ones(40))
    near, far = (
        [learn(*sailed(apart, seed), effects, np.zeros(40)) for seed in range(5)]
        for apart in (0.0, 1.0)
    )
    assert np.mean([apart for apart, _ in near]) < 0.33
    assert np.mean([apart for apart, _ in far]) > 0.67
    # what voyages differ in is no reason to count less
    assert sum(share == 1.0 for _, share in (*near, *far)) >= 6


@pytest.mark.parametrize("apart", [0.0, 0.6])
def test_products_of_voyages_are_those_of_a_dense_covariance(apart):
    """e = J d + ε, ε ~ N(0, I + J (D + a² D) Jᵀ) within a part and J a² D Jᵀ between the parts of
    a voyage; one of three voyages has two parts."""
    rng = np.random.default_rng(1)
    voyages, deviation = np.array([0, 1, 1, 2]), np.array([0.5, 0.0, 2.0])
    drawn = [rng.standard_normal((12, 4)) for _ in voyages]
    parts = [both.T @ both for both in drawn]
    found, volumes = reduce_voyages(parts, voyages, apart * deviation, deviation)
    for name, gram, volume in zip((0, 1, 2), found, volumes, strict=True):
        own = [both for both, of in zip(drawn, voyages, strict=True) if of == name]
        both, j = np.concatenate(own), block_diag(*(one[:, 1:] * deviation for one in own))
        shared = np.concatenate([one[:, 1:] for one in own]) * apart * deviation
        covariance = np.eye(len(both)) + np.asarray(j @ j.T) + shared @ shared.T
        assert gram == pytest.approx(both.T @ np.linalg.solve(covariance, both))
        assert volume == pytest.approx(np.linalg.slogdet(covariance)[1])


def test_voyages_are_predicted_from_the_total_less_their_own(monkeypatch):
    """As from a sum over the others, written out; one evaluation of the prior for each voyage,
    spread and share."""
    rng = np.random.default_rng(4)
    rows = [rng.standard_normal((30, 6)) for _ in range(8)]
    parts = [reduced(r.T @ r, np.full(5, 0.3))[0] for r in rows]
    voyages, effects = np.repeat(np.arange(4), 2), VoyageEffects(np.full(5, 0.3), np.ones(5))
    scores = []
    for apart in campaign_prior.VOYAGE_SPREADS:
        each, volumes = reduce_voyages(parts, voyages, apart * effects.deviation)
        score = 0.0
        for left in range(4):
            kept = sum(one for i, one in enumerate(each) if i != left)
            given = kept[1:, 1:] + np.eye(5), kept[1:, 0]
            score += campaign_prior.marginal(each[left], *given) - 0.5 * volumes[left]
        scores.append(score)
    weight = np.exp(scores - np.logaddexp.reduce(scores))
    monkeypatch.setattr(campaign_prior, "INFORMATION_SHARES", (1.0,))
    apart, share = campaign_prior.learn(parts, voyages, effects, np.zeros(5))
    assert share == 1.0
    assert apart**2 == pytest.approx(weight @ np.square(campaign_prior.VOYAGE_SPREADS), rel=1e-9)
