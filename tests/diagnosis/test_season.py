"""Sizes voyage by voyage: pooling against numerical integration, limits, events, speed loss."""

import math
from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta
from types import SimpleNamespace

import closed
import jax
import jax.numpy as jnp
import numpy as np
import pytest
import straight
from scipy.stats import multivariate_normal, norm
from straight import CAUSES
from test_onset import fit, switched

from shiplog.diagnosis.onset import stretch_information
from shiplog.diagnosis.season import (
    asked,
    limit,
    own_numbers,
    pooling,
    season_fit,
    speed_loss,
    trends,
    voyage_sizes,
)
from shiplog.diagnosis.season.pooling import HALF_CAUCHY, LEVEL_SPREAD, SPREADS, Pooled, Voyages
from shiplog.diagnosis.trial.fitted import Point
from shiplog.diagnosis.verdict.result import Named
from shiplog.exceptions import ShiplogError, UsageError
from shiplog.models.causes import Current, Fouling, ThrustLoss
from shiplog.ship_profile import file as profiles

# Effects and standard errors of the eight schools (Rubin 1981, Table 1), in tens of points.
SCHOOLS = np.array([2.839, 0.794, -0.275, 0.682, -0.064, 0.063, 1.801, 1.216])
ERRORS = np.array([1.49, 1.02, 1.63, 1.10, 0.94, 1.14, 1.04, 1.76])


def likelihood(values, errors, days=None, level=None) -> Voyages:
    count = len(values)
    M = np.zeros((count, 1, count, 1))
    M[np.arange(count), 0, np.arange(count), 0] = errors**-2.0
    days = np.arange(count, dtype=float) if days is None else days
    level = np.zeros(count, dtype=int) if level is None else level
    return Voyages((values * errors**-2.0)[:, None], M, days, level)


def test_eight_schools_are_pooled_as_numerical_integration_has_it():
    """Posterior means of μ, τ and each effect: p(τ | r) ∝ p(τ) N(r; 0, s² 1 1ᵀ + diag(σ² + τ²))."""
    (pooled,) = pooling.pool(likelihood(SCHOOLS, ERRORS), [False])
    tau = np.geomspace(SPREADS[0], SPREADS[-1], 400)
    together = LEVEL_SPREAD**2 * np.ones((8, 8))
    log_p = np.array([
        multivariate_normal(None, together + np.diag(ERRORS**2 + t**2)).logpdf(SCHOOLS)
        for t in tau
    ])  # fmt: skip
    weight = np.exp(log_p - log_p.max()) / (1.0 + (tau / HALF_CAUCHY) ** 2) * tau
    weight /= weight.sum()
    effects = np.array([
        (together + t**2 * np.eye(8))
        @ np.linalg.solve(together + np.diag(ERRORS**2 + t**2), SCHOOLS)
        for t in tau
    ])  # fmt: skip
    assert pooled.spread.mean() == pytest.approx(weight @ tau, rel=0.1)
    assert pooled.sizes[..., 0].mean(0) == pytest.approx(weight @ effects, abs=0.05)
    # a school by itself is its own effect, drawn to zero by N(0, s²) alone
    alone = SCHOOLS / (1.0 + (ERRORS / LEVEL_SPREAD) ** 2)
    assert pooled.alone[..., 0].mean(0) == pytest.approx(alone, abs=0.06)
    assert pooled.sizes[:, 0, 0].std() < pooled.alone[:, 0, 0].std()


def test_two_causes_are_pooled_as_numerical_integration_has_it():
    """Two numbers that each voyage hardly tells apart: means of x and τ over all pairs of τ."""
    rng = np.random.default_rng(4)
    true = np.stack((0.4 + 0.3 * rng.standard_normal(4), np.full(4, -0.2)), -1).ravel()
    block = np.linalg.inv(0.2**2 * np.array([[1.0, -0.8], [-0.8, 1.0]]))
    information = np.kron(np.eye(4), block)
    seen = true + np.linalg.cholesky(np.linalg.inv(information)) @ rng.standard_normal(8)
    of = Voyages(
        (information @ seen).reshape(4, 2), information.reshape(4, 2, 4, 2), np.arange(4.0),
        np.zeros(4, dtype=int), (1, 1),
    )  # fmt: skip
    first, second = pooling.pool(of, [False, False])
    # p(τ | r) ∝ p(τ) N(r; 0, K), K the covariance of what is seen, and x | r, τ its mean
    tau = np.geomspace(SPREADS[0], SPREADS[-1], 50)
    pairs = np.stack(np.meshgrid(tau, tau), -1).reshape(-1, 2)
    prior = np.kron(np.full((4, 4), LEVEL_SPREAD**2), np.eye(2)) + np.zeros((len(pairs), 8, 8))
    prior[:, np.arange(8), np.arange(8)] += np.tile(pairs**2, 4)
    K = prior + np.linalg.inv(information)
    solved = np.linalg.solve(K, np.tile(seen[:, None], (len(pairs), 1, 1)))[..., 0]
    log_p = -0.5 * (solved @ seen + np.linalg.slogdet(K)[1])
    weight = np.exp(log_p - log_p.max())
    weight *= (pairs / (1.0 + (pairs / HALF_CAUCHY) ** 2)).prod(1)
    weight /= weight.sum()
    sizes, spreads = np.einsum("t,tab,tb->a", weight, prior, solved), weight @ pairs
    found = np.concatenate((first.sizes, second.sizes), -1).mean(0)
    assert found.ravel() == pytest.approx(sizes, abs=0.02)
    assert [first.spread.mean(), second.spread.mean()] == pytest.approx(spreads, rel=0.15)


def test_a_slope_and_a_docking_are_found():
    """0.6 of wear over 100 days, and 0.8 taken away after 60 of them; errors of 0.05."""
    rng = np.random.default_rng(2)
    days = np.linspace(0.0, 100.0, 11)
    level = (days > 60.0).astype(int)
    values = 0.4 + 0.006 * (days - 50.0) - 0.8 * level + 0.05 * rng.standard_normal(11)
    of = likelihood(values, np.full(11, 0.05), days, level)
    (pooled,) = pooling.pool(of, [True])
    assert pooled.slope[:, 0].mean() == pytest.approx(0.6, abs=0.15)
    levels = pooled.levels[..., 0].mean(0)
    assert levels == pytest.approx([0.4, -0.4], abs=0.12)
    assert not pooling.pool(of, [False])[0].slope.any()


def drawn(level: float, slope: float, spread: float) -> Pooled:
    rng = np.random.default_rng(0)
    one = level + spread * rng.standard_normal((pooling.DRAWS, 1, 1))
    return Pooled(one, one, np.full((pooling.DRAWS, 1), slope), np.ones(pooling.DRAWS), one)


def test_the_date_of_a_limit_is_where_level_and_slope_meet_it():
    """μ ~ N(0.2, 0.05²) at day 50, β = 0.5 over 100 days: 0.8 at day 50 + 200 (0.8 - μ)/1."""
    of = likelihood(np.zeros(3), np.ones(3), np.array([0.0, 50.0, 100.0]))
    found = limit.passing(of, drawn(0.2, 0.5, 0.05), 0.8)
    wanted = [50.0 + 200.0 * (0.8 - (0.2 + 0.05 * norm.ppf(1.0 - p))) for p in (0.05, 0.5, 0.95)]
    assert [found.low, found.value, found.high] == pytest.approx(wanted, abs=1.0)
    assert (found.passed, found.ever) == (0.0, 1.0)
    # thrust is lost the other way round, and what goes away from a limit never passes it
    lost = limit.passing(of, drawn(-0.2, -0.5, 0.05), -0.8)
    assert lost.value == pytest.approx(found.value, abs=1.0)
    never = limit.passing(of, drawn(0.2, -0.5, 0.05), 0.8)
    assert (never.low, never.value, never.high, never.ever) == (None, None, None, 0.0)
    assert limit.passing(of, drawn(1.2, 0.1, 0.05), 0.8).passed == 1.0


def test_each_voyage_has_its_own_part_of_the_likelihood(monkeypatch):
    """The cause acts in the second voyage alone; two voyages ten days apart."""
    monkeypatch.setattr(trends, "calm_speeds", lambda _, __, numbers: np.ones(len(numbers)))
    trial = switched(4, 8)
    told = stretch_information.of_cause(trial, fit(trial, {}, ("drag",)), "drag")
    began = datetime(2026, 5, 1, tzinfo=UTC)
    starts = {"v0": began, "v1": began + timedelta(days=10)}
    of, names = voyage_sizes.by_voyage(trial, told, starts, [began + timedelta(days=5)])
    assert names == ("v0", "v1")
    assert of.M.sum() == pytest.approx(told.M.sum())
    assert of.y[1] == pytest.approx(told.y[4:].sum(0))
    assert of.days == pytest.approx([60.0 / 86400.0, 10.0 + 60.0 / 86400.0])
    assert of.level.tolist() == [0, 1]
    sizes = pooling.pool(of, [False])[0].sizes[..., 0].mean(0) * told.unit[0]
    assert sizes == pytest.approx([0.0, 1.5], abs=0.25)
    (found,) = trends.of_fit(trial, fit(trial, {}, ("drag",)), ("drag",), starts,
                             [began + timedelta(days=5)])  # fmt: skip
    (event,) = found.events
    change = event.change["size"]
    assert change.low < 1.5 < change.high + 0.3
    assert found.voyages[1].pooled["size"].value == pytest.approx(1.5, abs=0.25)
    assert found.slope is None  # two voyages have none


DRAG = Named(CAUSES[1], 0.0, 1.0, np.zeros(1), np.eye(1))


@dataclass(frozen=True)
class Bent(straight.Straight):
    """Two voyages of which drag x is felt as f(x) = x + x²: true[v] of it is in the data."""

    true: tuple[float, ...] = (0.0, 0.0)

    def linearise(self, numbers, near=None, noise_factor=None, remainder=None):
        given = self.own
        (column,) = self.reference.columns.indices["drag"]
        x = float(np.asarray(numbers.get("drag", np.zeros(1)))[0])
        true = np.array(self.true)[self.record.voyage[self.rows]]
        felt = (true + true**2) - (x + x**2)
        j = given.j.copy()
        e = given.e + felt[:, None, None] * j[..., column]
        j[..., column] *= 1.0 + 2.0 * x
        linear = replace(given, e=e, j=j, path=replace(given.path))
        return Point(dict(numbers), linear.path, linear)


def bent(*true: float) -> Bent:
    columns = straight.columns_of(CAUSES)
    nominal, record = straight.sailed(12), straight.sailed(16, seed=3)
    campaign = straight.campaign(nominal, straight.passed(nominal, columns), columns)
    given = straight.passed(record, columns, seed=2, sensitivity=4.0)  # each size is well known
    made = Bent.build(campaign, record, given=given, true=true)
    return replace(made, first=made.linearise({}))


def test_a_voyage_that_is_far_from_the_others_is_fitted_by_itself(monkeypatch, caplog):
    """Drag 0 in one voyage and 1.5 in the other. From x₀, one size for both, the likelihood of a
    voyage with size x is linear about x₀ + (f(x) - f(x₀))/f'(x₀), x₀ = 0.9: 0.29 and 1.63."""
    monkeypatch.setattr(trends, "calm_speeds", lambda _, __, numbers: np.ones(len(numbers)))
    trial = bent(0.0, 1.5)
    at = season_fit.fitted(trial, trial.first, ("drag",))
    there = own_numbers.common(trial, at, ("drag",))
    unit = trial.reference.columns.unit[trial.reference.columns.indices["drag"]]
    information = own_numbers.information_of(trial, at, ("drag",), there)
    of, _ = voyage_sizes.by_voyage(trial, information, {})
    linear = pooling.pool(of, [False])[0].alone[..., 0].mean(0) * unit[0]
    x0 = float(there.stood[0, 0] * unit[0])
    wanted = [x0 + (x + x**2 - x0 - x0**2) / (1.0 + 2.0 * x0) for x in trial.true]
    assert linear == pytest.approx(wanted, abs=0.05)
    assert min(abs(linear - trial.true)) > 0.08
    (found,) = trends.of_fit(trial, at, ("drag",), {})
    for one, true in zip(found.voyages, trial.true, strict=True):
        size = one.alone["size"]
        assert size.value == pytest.approx(true, abs=0.05) and size.low < true < size.high
    assert not caplog.records
    # of a verdict there is none: it would be the linear one
    assert (
        trends.of_verdict(trial, at, [Named(CAUSES[1], 0.0, 1.0, np.zeros(1), np.eye(1))], {}) == {}
    )


def test_voyages_that_are_alike_are_not_fitted_again(monkeypatch):
    monkeypatch.setattr(trends, "calm_speeds", lambda _, __, numbers: np.ones(len(numbers)))
    monkeypatch.setattr(own_numbers, "evaluate", None)  # it would fail
    trial = bent(0.7, 0.75)
    at = season_fit.fitted(trial, trial.first, ("drag",))
    (found,) = trends.of_fit(trial, at, ("drag",), {})
    assert [one.alone["size"].value for one in found.voyages] == pytest.approx(
        [0.7, 0.75], abs=0.05
    )
    named = [Named(CAUSES[1], 0.0, 1.0, np.zeros(1), np.eye(1))]
    assert trends.of_verdict(trial, at, named, {}).keys() == {"drag"}


def test_only_what_wears_has_a_limit():
    assert trends.refuse_limit(ThrustLoss()) == "factor"
    assert trends.refuse_limit(Fouling()) == "factor"
    with pytest.raises(UsageError, match="current can have no limit"):
        trends.refuse_limit(Current())


@pytest.mark.parametrize("text", ["thrust_loss", "=0.9", "thrust_loss=much", "thrust_loss=nan"])
def test_a_limit_is_a_cause_and_a_number(text):
    assert asked.parse_limit("thrust_loss=0.9") == ("thrust_loss", 0.9)
    with pytest.raises(UsageError, match="no limit"):
        asked.parse_limit(text)


def test_a_date_is_iso():
    assert asked.parse_date("2026-05-17") == datetime(2026, 5, 17, tzinfo=UTC)
    with pytest.raises(UsageError, match="no date"):
        asked.parse_date("17 May")


def test_a_cause_is_followed_by_its_name_or_label():
    trial = straight.trial(*made())
    assert season_fit.labels_of(trial, ["drag", "clock:wind"]) == ("drag", "clock:wind")
    with pytest.raises(UsageError, match="may be each of clock:gnss, clock:wind"):
        season_fit.labels_of(trial, ["clock"])
    with pytest.raises(UsageError, match="No cause 'rust'"):
        season_fit.labels_of(trial, ["rust"])
    with pytest.raises(ShiplogError, match="Too little"):
        season_fit.refuse_little(trial.record, enough=False)


def made():
    columns = straight.columns_of(CAUSES)
    nominal, record = straight.sailed(12), straight.sailed(8, seed=3)
    campaign = straight.campaign(nominal, straight.passed(nominal, columns), columns)
    return campaign, record, straight.passed(record, columns, seed=2)


# --- speed loss -----------------------------------------------------------------------------------


@jax.tree_util.register_static
@dataclass(frozen=True)
class Screw:
    """u̇ = k n|n| - a u|u|, v̇ = -v, ṙ = -r: a steady speed of n √(k/a)."""

    names: tuple[str, ...] = ("k", "a")
    substeps: int = 1
    smooth: float = 0.0

    def acceleration(self, theta, state, actuator, true_wind):
        n, u = actuator[..., 1], state[..., 1]
        du = theta[0] * n * jnp.abs(n) - theta[1] * u * jnp.abs(u)
        return jnp.stack((du, -state[..., 3], -state[..., 5]), -1)


THETA = np.array([4e-4, 0.1])  # 10 rev/s: 0.632 m/s
STEADY = 10.0 * math.sqrt(THETA[0] / THETA[1])


def sailed(speeds, rudder=0.0, wind=(0.0, 0.0), seconds=400.0):
    """A voyage each of a steady speed, at 10 rev/s."""
    profile = profiles.load("esso-osaka")
    record = closed.record(profile)
    rows = round(seconds / record.step)
    count = rows * len(speeds)
    state = np.zeros((count, 6))
    state[:, 1] = np.repeat(speeds, rows)
    state[:, 1] += 0.002 * np.sin(np.arange(count))
    starts = np.zeros(count, dtype=bool)
    starts[::rows] = True
    true = np.tile(wind, (count, 1))
    of = replace(
        record, names=tuple(f"v{i}" for i in range(len(speeds))),
        voyage=np.repeat(np.arange(len(speeds)), rows), time=np.tile(np.arange(rows), len(speeds))
        * record.step, share=np.linspace(0.0, 1.0, count), starts=starts,
        measured=np.ones(count, dtype=bool), state=state,
        actuator=np.tile([math.radians(rudder), 10.0], (count, 1)),
        wind=true + state[:, [1, 3]],
    )  # fmt: skip
    return SimpleNamespace(record=of, reference=SimpleNamespace(model=Screw()))


def test_speed_loss_is_that_of_the_closed_form():
    trial = sailed([STEADY, 0.9 * STEADY])
    found = speed_loss.of_voyages(trial, THETA)
    assert found["v0"].value == pytest.approx(0.0, abs=0.05)
    assert found["v1"].value == pytest.approx(-10.0, abs=0.05)
    assert found["v1"].blocks == int(400.0 // (600.0 * math.sqrt(3.0 / 100.0)))
    assert found["v1"].low is not None and found["v1"].low <= found["v1"].value
    # a current of 0.1 STEADY ahead: through the water it is slower by that
    moved = speed_loss.of_voyages(trial, THETA, {"v0": (0.1 * STEADY, 0.0)})
    assert moved["v0"].value == pytest.approx(-10.0, abs=0.05)


@pytest.mark.parametrize(
    ("changes", "why"),
    [({"rudder": 6.0}, "rudder above 5 deg"), ({"wind": (2.0, 0.0)}, "wind above the limit")],
)
def test_blocks_outside_the_standard_are_left_out(changes, why):
    found = speed_loss.of_voyages(sailed([STEADY], **changes), THETA)["v0"]
    assert (found.value, found.low, found.blocks) == (None, None, 0)
    assert found.left_out == {why: 3}


def test_chauvenet_rejects_what_half_a_sample_would_not_expect():
    """Of ten values the criterion is 1.96 standard deviations (Taylor 1997, Sec. 6.2)."""
    values = np.array([1.0, 1.1, 0.9, 1.05, 0.95, 1.0, 1.1, 0.9, 1.0, 3.0])
    assert speed_loss.chauvenet(values).tolist() == [True] * 9 + [False]
    assert speed_loss.chauvenet(values[:9]).all()
    assert speed_loss.chauvenet(np.array([1.0, 9.0])).all()  # two say nothing of their spread


def test_froude_scales_block_and_wind_of_short_ships():
    assert speed_loss.scale(200.0) == 1.0
    assert speed_loss.scale(25.0) == pytest.approx(0.5)
