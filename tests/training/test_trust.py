"""Verdicts on coefficients against covariances worked out by hand."""

import math

import numpy as np
import polars as pl
import pytest

from shiplog.training.physics import trust
from shiplog.training.physics.agreement import Agreement
from shiplog.training.physics.trust import Information

BOUNDS = (np.full(2, -10.0), np.full(2, 10.0))


def identified(values=(1.0, 2.0), spread=(0.5, 2.0), free=(True, True), start=(0.0, 0.0)):
    names = ["hull.a", "hull.b"]
    return pl.DataFrame(
        {"name": names, "symbol": ["a", "b"], "meaning": ["this", "that"], "unit": ["1", "1"],
         "start": start, "spread": spread, "value": values, "standard_error": [0.0, 0.0],
         "free": free}
    )  # fmt: skip


def judged(gram, frame=None, covariance=None, pulls=None, agreed=None):
    """gram   H in units of the spreads, shared out evenly over the voyages that have a pull"""
    frame = identified() if frame is None else frame
    scale = frame["spread"].to_numpy()
    pulls = pulls or {"one": np.zeros(2), "two": np.zeros(2)}
    H = np.asarray(gram, dtype=float)
    if covariance is None:
        covariance = np.linalg.inv(H + np.eye(2)) * np.outer(scale, scale)
    found = Information(
        {name: H / np.outer(scale, scale) / len(pulls) for name in pulls},
        {name: pull / scale for name, pull in pulls.items()},
    )
    return trust.judge(frame, covariance, BOUNDS, found, "a textbook", agreed)


def test_what_the_data_show_and_what_they_do_not():
    seen, unseen = judged([[99.0, 0.0], [0.0, 0.21]])
    assert (seen.verdict, unseen.verdict) == ("trusted", "not measured")
    assert seen.own == pytest.approx(0.1) and unseen.own == pytest.approx(1.0 / 1.1)
    assert (seen.low, seen.high) == pytest.approx((1.0 - 1.645 * 0.05, 1.0 + 1.645 * 0.05))
    assert seen.typical == pytest.approx((-1.645 * 0.5, 1.645 * 0.5)) and not seen.alias
    assert unseen.source == "a textbook"


def test_two_of_which_only_the_sum_shows():
    """H = k [[1, 1], [1, 1]]: C = I - H/(1 + 2k), so that each has C_ii → ½ and the correlation is
    -k/(1 + k)."""
    k = 50.0
    a, b = judged(k * np.ones((2, 2)))
    assert a.own is not None
    assert (a.verdict, b.verdict) == ("only in combination",) * 2
    assert a.own == pytest.approx(math.sqrt((1 + k) / (1 + 2 * k)))
    assert a.alone == pytest.approx((k + 1.0) ** -0.5)
    (other,) = a.alias
    assert other.name == "hull.b" and other.correlation == pytest.approx(-k / (1 + k))
    # b moves against a in units of the spreads, and its spread is four times a's
    assert other.change == pytest.approx(-k / (1 + k) * 2.0 * a.own)
    sentence = trust.alias_sentence(a, 0.5 * a.own)
    assert sentence == "hull.a up by 0.36 with hull.b down by 1.4 looks the same to these data"


def test_voyages_that_do_not_agree():
    """Two voyages of weight w, one d above and one d below: Q = 2 w d², τ² = (Q - 1)/w."""
    w, d = 60.0, 1.0
    pulls = {"one": np.array([w * d, 0.0]), "two": np.array([-w * d, 0.0])}
    one, other = judged([[2 * w, 0.0], [0.0, 100.0]], pulls=pulls)
    assert one.between == pytest.approx(0.5 * math.sqrt((2 * w * d**2 - 1.0) / w))
    assert one.verdict == "only in combination" and "do not agree" in one.reason
    assert other.between == 0.0 and other.voyages == 2 and other.verdict == "trusted"


def test_parts_of_the_data_that_do_not_agree():
    """0.3 of the spread by chance and 0.4 by disagreement are ½; more is no longer trusted."""
    H = [[1 / 0.09 - 1.0, 0.0], [0.0, 99.0]]
    for apart, verdict, own in ((0.39, "trusted", 0.492), (0.8, "only in combination", 0.854)):
        agreed = Agreement(np.array([apart, 0.0]), ("slow and fast windows", ""))
        one, other = judged(H, agreed=agreed)
        assert (one.verdict, other.verdict) == (verdict, "trusted")
        assert one.own == pytest.approx(own, abs=1e-3) and one.apart == pytest.approx(0.5 * apart)
        assert one.high == pytest.approx(1.0 + 1.645 * 0.5 * own, abs=1e-3)
    assert one.reason == (
        "slow and fast windows do not agree on it: its error is 0.85 of the plausible spread, and "
        "0.3 if they did"
    )


def test_at_a_limit_an_interval_means_nothing():
    values = (1.0, 10.0)
    _, limited = judged(100.0 * np.eye(2), identified(values=values))
    assert limited.at_limit == "high" and limited.verdict == "not measured"
    assert "upper limit" in limited.reason


def test_what_was_held_is_not_measured():
    frame = identified(free=(True, False))
    _, held = judged(100.0 * np.eye(2), frame, np.diag([0.0025, 0.0]))
    assert held.verdict == "not measured" and held.low is None and held.own is None


def test_one_voyage_says_nothing_of_how_voyages_differ():
    only, _ = judged(100.0 * np.eye(2), pulls={"one": np.zeros(2)})
    assert only.between is None and only.voyages == 1 and only.verdict == "trusted"


def test_on_new_voyages_the_data_say_less_and_what_was_known_before_stays():
    """H/κ in the place of H: (H/κ + 1)⁻¹, also of coefficients that hide each other."""
    spread, H = np.array([0.5, 2.0]), np.array([[9.0, 4.0], [4.0, 2.0]])
    scale = np.outer(spread, spread)
    covariance = np.linalg.inv(H + np.eye(2)) * scale
    for kappa in (1.0, 3.0, 1e9):
        wanted = np.linalg.inv(H / kappa + np.eye(2)) * scale
        assert trust.on_new_voyages(covariance, spread, kappa) == pytest.approx(wanted)


def test_a_coefficient_that_was_held_stays_certain():
    found = trust.on_new_voyages(np.diag([0.01, 0.0]), np.array([0.5, 0.0]), 4.0)
    assert found[1].tolist() == [0.0, 0.0]
    assert found[0, 0] == pytest.approx(0.25 / (24.0 / 4.0 + 1.0))
