"""The fit of a nominal campaign: bounds that it keeps, and moves that it takes back."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import straight
from straight import CAUSES, SETTING

from shiplog.diagnosis.nominal import nominal_fit
from shiplog.diagnosis.nominal.nominal_fit import most_probable_in_room
from shiplog.models.starting_values import Start

BEGIN = 3.0  # of the coefficient; its true value is 0


@pytest.mark.parametrize("seed", range(6))
def test_numbers_within_bounds_are_where_none_may_gain_any_more(seed):
    """Karush, Kuhn and Tucker: the slope is zero but at a bound, where it points outwards."""
    rng = np.random.default_rng(seed)
    rows = rng.standard_normal((40, 7))
    information = rows.T @ rows
    free = rng.standard_normal(7)
    room = np.stack((-rng.uniform(0.0, 0.6, 4), rng.uniform(0.0, 0.6, 4)))
    found, gain = most_probable_in_room(free, np.linalg.inv(information), room)
    slope = information @ (free - found)
    low, high = (np.isclose(found[:4], end, atol=1e-8) for end in room)
    assert (found[:4] >= room[0] - 1e-8).all() and (found[:4] <= room[1] + 1e-8).all()
    assert (low | high).any()
    assert slope[4:] == pytest.approx(np.zeros(3), abs=1e-8)
    assert slope[:4][~low & ~high] == pytest.approx(0.0, abs=1e-8)
    assert (slope[:4][low] <= 1e-8).all() and (slope[:4][high] >= -1e-8).all()

    def density(numbers):
        return -0.5 * (numbers - free) @ information @ (numbers - free)

    at_zero = np.zeros(7)  # the other numbers stand where they are best with those at zero
    at_zero[4:] = free[4:] + np.linalg.solve(information[4:, 4:], information[4:, :4] @ free[:4])
    assert gain == pytest.approx(density(found) - density(at_zero))


def test_without_a_bound_in_reach_they_are_the_free_ones():
    rng = np.random.default_rng(1)
    rows = rng.standard_normal((30, 5))
    free = rng.standard_normal(5)
    found, gain = most_probable_in_room(
        free, np.linalg.inv(rows.T @ rows), np.array([[-9.0] * 3, [9.0] * 3])
    )
    assert found == pytest.approx(free)
    information = np.linalg.inv(np.linalg.inv(rows.T @ rows)[:3, :3])
    assert gain == pytest.approx(0.5 * free[:3] @ information @ free[:3])


class Base:
    names = ("hull.X_vv", "rudder.t_R")


class Model:
    base = Base()
    causes = CAUSES[:2]


def fitted(
    monkeypatch, start, shape=np.arctan, slope=lambda x: 1.0 / (1.0 + x**2), rounds=20,
    beyond=np.inf,
):  # fmt: skip
    """A campaign of 24 segments that feels its first coefficient as a `shape`, with its `slope`,
    and of which all diverge `beyond` a size of it: the fit, and the coefficients at which it was
    linearised."""
    columns = nominal_fit.columns_of(Model(), SETTING, start)
    record = straight.sailed(24)
    plain = straight.passed(record, columns, sensitivity=3.0)
    felt, asked = plain.j[..., 0] * columns.unit[0], []

    def linear(model, whole, *more):
        asked.append(whole[:2].copy())
        j = plain.j.copy()
        j[..., 0] = felt * slope(whole[0])
        e = plain.e - felt * shape(whole[0]) - plain.j[..., 1] * whole[1]
        return replace(plain, e=e, j=j, lost=np.full(24, abs(whole[0]) > beyond))

    monkeypatch.setattr(nominal_fit, "read", lambda *_: (plain.cut, None, None))
    for name, given in (
        ("linear", linear), ("fit_path", lambda *_: plain.path),
        ("predict_path", lambda *_: plain.path),
    ):  # fmt: skip
        monkeypatch.setattr(nominal_fit.linearisation, name, given)
    return nominal_fit.converged(Model(), SETTING, start, record, rounds), np.array(asked)


def test_a_move_that_overshoots_is_halved(monkeypatch):
    """Newton's step on an arctangent overshoots, from 3 to -9.5, and further each time."""
    start = Start(
        np.array([BEGIN, 0.0]), np.array([20.0, 2.0]), np.full(2, -99.0), np.full(2, 99.0)
    )
    found, asked = fitted(monkeypatch, start)
    assert asked[1, 0] < -BEGIN  # the first step goes too far
    assert found.theta[0] == pytest.approx(0.0, abs=0.1)
    with monkeypatch.context() as patch:
        patch.setattr(nominal_fit, "LOST_NATS", np.inf)
        kept, _ = fitted(patch, start)
    assert abs(kept.theta[0]) >= BEGIN - 1e-9  # with such moves it does not arrive


def test_a_coefficient_at_its_bound_does_not_move_the_others(monkeypatch):
    """The true value is beyond the bound: the fit stands at the bound, and ends there at once."""
    low = np.array([1.0, -99.0])
    start = Start(np.array([BEGIN, 0.0]), np.array([20.0, 2.0]), low, np.full(2, 99.0))
    found, asked = fitted(monkeypatch, start, shape=lambda x: x, slope=lambda x: 1.0)
    assert found.theta[0] == pytest.approx(1.0, abs=1e-3)
    # where the free fit has it as well, but for the noise of 24 segments
    free, _ = fitted(monkeypatch, replace(start, low=np.full(2, -99.0)), lambda x: x, lambda x: 1.0)
    assert found.theta[1] == pytest.approx(free.theta[1], abs=0.1)
    assert (asked[:, 0] >= 1.0).all()
    assert len(asked) <= 4


def test_without_rounds_the_coefficients_stay(monkeypatch):
    start = Start(
        np.array([BEGIN, 0.0]), np.array([20.0, 2.0]), np.full(2, -99.0), np.full(2, 99.0)
    )
    found, asked = fitted(monkeypatch, start, rounds=0)
    assert found.theta.tolist() == [BEGIN, 0.0]
    assert len(asked) == 1


def test_a_campaign_on_which_the_model_diverges_everywhere_is_no_fit(monkeypatch):
    """At the start there is nothing to compare; later it is a move that went too far: Newton's
    first step on an arctangent, from 3 to -9.5."""
    start = Start(
        np.array([BEGIN, 0.0]), np.array([20.0, 2.0]), np.full(2, -99.0), np.full(2, 99.0)
    )
    with pytest.raises(np.linalg.LinAlgError, match="every segment"):
        fitted(monkeypatch, start, beyond=0.9 * BEGIN)
    found, asked = fitted(monkeypatch, start, beyond=1.1 * BEGIN)
    assert asked[1, 0] < -1.1 * BEGIN
    assert found.theta[0] == pytest.approx(0.0, abs=0.1)


@pytest.mark.parametrize(
    ("lost", "value", "better"),
    [((1, 5), (-900.0, 0.0), True), ((5, 1), (0.0, -900.0), False),
     ((2, 2), (1.0, 0.0), True), ((2, 2), (0.0, 1.0), False)],
)  # fmt: skip
def test_what_diverges_on_fewer_segments_is_better_whatever_the_others_say(lost, value, better):
    """Segments on which it diverges are not in the density."""
    one, other = (
        SimpleNamespace(
            joint=SimpleNamespace(linear=SimpleNamespace(lost=np.arange(9) < count)),
            solution=SimpleNamespace(value=nats),
        )
        for count, nats in zip(lost, value, strict=True)
    )
    assert nominal_fit._Iterate.better(one, other) is better
