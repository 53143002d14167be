"""Identification on ships in two or three numbers: closed forms, exact data, known noise."""

import math
from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from boats import COUNT, SIZE, START, TRUE, WIDE, Boat, Growing, driven, measured

from shiplog.exceptions import ModelError
from shiplog.simulation import sensitivities, window_series
from shiplog.simulation.window_series import WindowSeries
from shiplog.training.physics import identifiability
from shiplog.training.physics.output_error import CORRELATION, Identified, identify


@jax.tree_util.register_static
@dataclass(frozen=True)
class Straight:
    """u̇ = thrust n₁, v̇ = lift n₂ + cross n₁: a rollout is linear in the parameters."""

    names = ("thrust", "lift", "cross")
    substeps = 1

    def acceleration(self, theta, state, actuator, true_wind):
        ahead, aside = actuator[..., 0], actuator[..., 1]
        across = theta[1] * aside + theta[2] * ahead
        return jnp.stack((theta[0] * ahead, across, jnp.zeros_like(ahead)), -1)


@jax.tree_util.register_static
@dataclass(frozen=True)
class Pair:
    """Two parameters that only enter together: u̇ = -0.05 u + (a ± b) n, or a b n."""

    kind: str
    names = ("a", "b")
    substeps = 1

    def acceleration(self, theta, state, actuator, true_wind):
        a, b = theta[0], theta[1]
        thrust = {"sum": a + b, "difference": a - b, "product": a * b}[self.kind]
        u, v, r = state[..., 1], state[..., 3], state[..., 5]
        return jnp.stack((-0.05 * u + thrust * actuator[..., 0], -v, -r), -1)


def noisy(data: WindowSeries, seed: int, sigma: float = 0.02) -> WindowSeries:
    """White noise on every measured velocity, the first among them."""
    error = np.zeros_like(data.measured)
    shape = (*error.shape[:2], 3)
    error[..., [1, 3, 5]] = np.random.default_rng(seed).normal(size=shape) * sigma * (1, 1, 0.1)
    return data._replace(measured=data.measured + error)


@pytest.fixture(scope="module")
def blurred(exact) -> WindowSeries:
    return noisy(exact, seed=1)


@pytest.fixture(scope="module")
def found(exact) -> Identified:
    return identify(Boat(), START, WIDE, exact)


def notes(found: Identified, names, spread, bounds=None) -> list[str]:
    limits = bounds or (np.full(len(names), -np.inf), np.full(len(names), np.inf))
    return identifiability.describe(found, names, spread, limits, lambda name: f"the {name}")


# ---------------------------------------------------------------- what is found


def test_exact_data_give_the_true_values_back(found):
    assert found.values[:2] == pytest.approx(TRUE[:2], rel=1e-4)
    assert found.converged and found.message == "converged"
    assert found.loss[0] > 1e3 and found.loss[1] < 1e-4 * found.loss[0]
    assert (found.standard_error[:2] < 1e-4).all()


def test_what_the_data_never_touch_stays_where_it_started(found):
    assert found.values[2] == START[2]
    assert found.standard_error[2] == pytest.approx(WIDE[2])
    assert identifiability.undetermined(found, WIDE).tolist() == [False, False, True]
    (sentence,) = notes(found, Boat.names, WIDE)
    assert sentence == "These data say nothing about silent: they stand where they started."


def test_it_may_begin_elsewhere_and_the_ridge_still_holds_to_the_start(exact):
    elsewhere = identify(Boat(), START, WIDE, exact, begin=np.array([0.1, -0.1, 5.0]))
    assert elsewhere.values[:2] == pytest.approx(TRUE[:2], rel=1e-4)
    assert elsewhere.values[2] == pytest.approx(START[2], abs=1e-6)


@pytest.mark.parametrize(("tight", "factor"), [(0.002, 1.0), (0.02, 1.0), (0.004, 0.5)])
def test_the_ridge_holds_as_firmly_as_the_closed_form_says(tight, factor):
    """|r₀ + J s x|²/σ² + |x|² is least at x = -(sJᵀJs/σ² + 1)⁻¹ sJᵀr₀/σ²; σ² of the start.

    s is the spread in the ridge, `factor` times the plausible one."""
    spread = factor * np.array([tight, 3 * tight, tight])
    data = noisy(measured(Straight(), (0.02, -0.01, 0.005), driven(2)), seed=2)
    start = np.array([0.05, 0.03, 0.0])
    at = sensitivities.normal(Straight(), start, data)
    noise = CORRELATION * at.loss.sum() / (3 * COUNT * (SIZE - 1.0))
    gram = at.gram * np.outer(spread, spread) / noise
    wanted = -np.linalg.solve(gram + np.eye(3), at.pull.sum(0) * spread / noise)
    held = identify(Straight(), start, spread / factor, data, factor=factor, rounds=1)
    assert (held.values - start) / spread == pytest.approx(wanted, rel=1e-3, abs=1e-4)
    assert np.abs(wanted).max() > 0.1


def test_less_noise_left_over_loosens_the_ridge():
    """Its weight follows the noise that the round before it left: three come nearer than one."""
    data = measured(Straight(), (0.02, -0.01, 0.005), driven(2))
    start, spread = np.array([0.05, 0.03, 0.0]), np.full(3, 0.01)
    one, three = (identify(Straight(), start, spread, data, rounds=k) for k in (1, 3))
    assert three.loss[1] < 0.01 * one.loss[1]
    assert three.noise < one.noise


@pytest.mark.parametrize(("kind", "sign"), [("sum", "-"), ("difference", "+"), ("product", "-")])
def test_parameters_that_only_show_together_are_named_as_a_pair(kind, sign):
    data = noisy(measured(Pair(kind), (0.2, 0.1), driven(1)), seed=3)
    spread = np.full(2, 0.5)
    both = identify(Pair(kind), np.array([0.25, 0.15]), spread, data)
    a, b = both.values
    assert {"sum": a + b, "difference": a - b, "product": a * b}[kind] == pytest.approx(
        {"sum": 0.3, "difference": 0.1, "product": 0.02}[kind], rel=0.1
    )
    ((i, j, value),) = identifiability.correlated_pairs(both)
    assert (i, j) == (0, 1) and abs(value) > 0.9
    sentence = notes(both, Pair.names, spread)[0]
    assert "the a (a) and the b (b) trade against each other" in sentence
    assert f"correlation {sign}" in sentence


def test_the_strongest_trades_are_named_and_the_rest_counted():
    """Five parameters that all err together: ten pairs, six of them in words."""
    error = np.array([0.1, 0.2, 0.3, 0.4, 0.5])
    shared = np.outer(error, error) * (0.8 + 0.2 * np.eye(5))
    shared[1, 3] = shared[3, 1] = -0.95 * 0.2 * 0.4
    shared[0] = shared[:, 0] = 0.0  # held: no error, no correlation
    free = np.array([False, True, True, True, True])
    made = Identified(np.zeros(5), shared, free, 1.0, (1.0, 1.0), 1, True, "converged")
    pairs = identifiability.correlated_pairs(made)
    assert len(pairs) == 6 and pairs[0] == (1, 3, pytest.approx(-0.95))
    assert not identifiability.correlations(made)[0].any()
    names = ("p", "q", "r", "s", "t")
    assert len(notes(made, names, np.ones(5))) == 6
    shared[0] = shared[:, 0] = 0.85 * error * 0.1
    shared[0, 0] = 0.01
    output = notes(made, names, np.ones(5))
    assert len(output) == 7 and output[-1] == "4 more pairs correlate above 0.75."


def test_bounds_are_respected_and_reported(exact):
    low, high = np.array([0.1, -1.0, 0.0]), np.array([1.0, 1.0, 1.0])  # the true drag is 0.05
    spread = np.full(3, 0.5)
    stopped = identify(Boat(), START, spread, exact, bounds=(low, high))
    assert (low <= stopped.values).all() and (stopped.values <= high).all()
    assert stopped.values[0] == pytest.approx(0.1, abs=1e-4)
    (sentence,) = [s for s in notes(stopped, Boat.names, spread, (low, high)) if "limit" in s]
    assert sentence.startswith("drag ran into the limit of its physical range at 0.1")


def test_a_start_on_its_limit_can_leave_it(exact):
    """As an identified value that ran into its limit does, when it is given again."""
    low, high = np.array([0.0, -1.0, 0.0]), np.array([0.2, 1.0, 0.7])
    freed = identify(Boat(), START, WIDE, exact, bounds=(low, high))
    assert freed.values[:2] == pytest.approx(TRUE[:2], rel=1e-4)


def test_only_what_is_free_moves(exact):
    free = np.array([False, True, False])
    some = identify(Boat(), START, WIDE, exact, free=free)
    assert some.values[[0, 2]].tolist() == START[[0, 2]].tolist()
    assert some.values[1] != START[1]
    assert not some.covariance[[0, 2]].any() and not some.covariance[:, [0, 2]].any()
    assert some.covariance[1, 1] > 0.0
    assert some.loss[1] < some.loss[0]
    output = notes(some, Boat.names, WIDE, (START - 1e-9, START + 1.0))
    assert not any("drag" in s or "silent" in s for s in output)  # held is neither silent nor stuck
    right = identify(Boat(), np.array([0.05, 0.3, 0.7]), WIDE, exact, free=free)
    assert right.values[1] == pytest.approx(TRUE[1], rel=1e-4)


def test_windows_of_no_weight_say_nothing(exact, blurred):
    weight = np.array([1.0, 0, 1, 1, 0, 1, 1, 1])
    wrong = blurred.measured.copy()
    wrong[weight == 0] += 3.0
    some = window_series.pick(blurred, np.flatnonzero(weight))
    alone = identify(Boat(), START, WIDE, some)
    left_out = identify(Boat(), START, WIDE, WindowSeries(wrong, *blurred[1:4], weight))
    assert left_out.values == pytest.approx(alone.values, rel=1e-9)
    assert left_out.covariance == pytest.approx(alone.covariance, rel=1e-6)
    assert left_out.loss == pytest.approx(alone.loss)
    assert left_out.noise == pytest.approx(alone.noise)


# ---------------------------------------------------------------- what diverges


def test_a_start_that_runs_away_is_led_in_from_short_windows(growing):
    """A hundred times the growth: no window is held to its end, but each to its third second."""
    assert np.isinf(sensitivities.losses(Growing(), np.array([2.0]), growing)).all()
    done = identify(Growing(), np.array([2.0]), np.full(1, 10.0), growing)
    assert done.values == pytest.approx([0.02], rel=1e-4) and done.converged
    assert done.loss[0] == np.inf and done.loss[1] < 1e-9


def test_a_start_that_runs_away_at_once_is_refused(growing):
    with pytest.raises(ModelError, match="The starting values let 8 of 8 windows diverge") as e:
        identify(Growing(), np.array([1e200]), np.ones(1), growing)
    assert "--parameters" in e.value.hint


def test_a_window_of_no_weight_may_run_away(growing):
    wild = growing.measured.copy()
    wild[3, :, 1] = 1e6  # from here even the true growth is endless
    data = growing._replace(measured=wild, weight=np.where(np.arange(COUNT) == 3, 0.0, 1.0))
    assert sensitivities.losses(Growing(), np.array([0.02]), data)[3] == np.inf
    done = identify(Growing(), np.array([0.015]), np.ones(1), data)
    assert done.values == pytest.approx([0.02], rel=1e-4)
    assert np.isfinite(done.covariance).all() and np.isfinite(done.loss).all()
    with pytest.raises(ModelError, match="let 1 of 8 windows diverge"):
        identify(Growing(), np.array([0.015]), np.ones(1), data._replace(weight=np.ones(COUNT)))


def test_a_step_too_far_is_drawn_back(growing):
    """From no growth at all the tangent points far beyond where the rollout has an end."""
    at = sensitivities.normal(Growing(), np.zeros(1), growing)
    leap = -at.pull.sum(0) / at.gram[0]
    assert np.isinf(sensitivities.losses(Growing(), leap, growing)).any()
    done = identify(Growing(), np.zeros(1), np.ones(1), growing)
    assert done.values == pytest.approx([0.02], rel=1e-4) and done.converged


@pytest.mark.parametrize("most", [1, 2])
def test_where_the_evaluations_run_out_the_best_is_kept_and_reported(blurred, most):
    tired = identify(Boat(), START, WIDE, blurred, most=most, rounds=1)
    assert not tired.converged
    assert f"after {most} evaluations" in tired.message
    assert "drag" in tired.message and "thrust" in tired.message
    assert tired.loss[1] <= tired.loss[0]
    assert tired.evaluations <= most
    assert notes(tired, Boat.names, WIDE)[-1] == (
        f"The identification did not converge: {tired.message}."
    )


# ---------------------------------------------------------------- how sure it is


def test_standard_errors_cover_white_noise():
    """(estimate - truth) / standard error over twenty draws of the noise; rms about 1.

    Of 32 windows: each is one observation of its gradient, and eight say little of a variance.
    """
    exact = measured(Boat(), TRUE, driven(1, count=32))
    free = np.array([True, True, False])
    z = []
    for seed in range(20):
        one = identify(Boat(), START, WIDE, noisy(exact, 100 + seed), free=free, rounds=2)
        z.append((one.values[:2] - TRUE[:2]) / one.standard_error[:2])
    rms = np.sqrt((np.array(z) ** 2).mean(0))
    assert (rms > 0.5).all() and (rms < 2.0).all(), rms
    assert np.abs(np.mean(z, axis=0)).max() < 0.8  # and no bias to speak of


@pytest.mark.parametrize("factor", [0.25, 4.0])
def test_a_ridge_of_any_firmness_knows_no_more_of_what_no_data_touch(exact, factor):
    """How far from the truth a start may be is its plausible spread, however it is held."""
    done = identify(Boat(), START, WIDE, exact, factor=factor)
    assert done.values[2] == START[2]
    assert done.standard_error[2] == pytest.approx(WIDE[2])


@pytest.mark.parametrize(("weight", "factor"), [(1.0, 1.0), (2.0, 1.0), (1.0, 0.5), (1.0, 3.0)])
def test_the_covariance_is_the_closed_form_of_one_window(weight, factor):
    """u_k = u₀ + thrust Σ n dt. With J the sum, in the loss's cm/s and trapezoidal seconds:
    s² (w S + 1/f⁴) / (w s²JᵀJ/σ² + 1/f²)², S between the gradient's square and what is expected
    of it, f how many times the plausible spread s the ridge allows."""
    whole = measured(Straight(), (0.02, -0.01, 0.005), driven(2))
    data = noisy(window_series.pick(whole, [0]), seed=4)._replace(weight=np.array([weight]))
    free, spread = np.array([True, False, False]), np.array([0.03, 1.0, 1.0])
    start = np.array([0.05, -0.01, 0.005])
    done = identify(Straight(), start, spread, data, free=free, factor=factor, rounds=1)
    trapezoid = np.ones(SIZE)
    trapezoid[[0, -1]] = 0.5
    slope = np.concatenate(([0.0], np.cumsum(data.actuator[0, :-1, 0])))
    error = data.measured[0, 0, 1] + done.values[0] * slope - data.measured[0, :, 1]
    gram = 1e4 * (trapezoid * slope**2).sum()
    pull = 1e4 * (trapezoid * slope * error).sum()
    noise, s = done.noise, spread[0]
    rest = 1e4 * (trapezoid * error**2).sum()
    states = sensitivities.rollout(Straight(), done.values, data)[0]
    others = (states - data.measured[0])[:, [3, 5]] * (100.0, 1800.0 / math.pi)
    rest += (trapezoid[:, None] * others**2).sum()
    assert done.loss[1] == pytest.approx(rest)
    assert noise == pytest.approx(30.0 * rest / (3.0 * 39.0))  # three channels, 39 s
    expected = weight * s**2 * gram / noise
    bread = expected + 1.0 / factor**2
    estimated = expected / bread  # of one number: how much the data determine it
    scatter = (weight * weight * (s * pull / noise) ** 2 + estimated * expected) / (
        weight + estimated
    )
    meat = weight * scatter + 1.0 / factor**4  # n/(n - 1), its divisor held at 1
    assert done.covariance[0, 0] == pytest.approx(s**2 * meat / bread**2, rel=1e-9)


def test_each_window_is_one_observation_of_its_own_gradient():
    """Twice the windows, the same again: the data's part of the sandwich halves (Huber, White).

    Σ g gᵀ between the inverses of Σ JᵀJ, shrunk towards noise · Σ JᵀJ as if the three numbers
    fitted were three more windows, times n/(n - 1); the ridge is far too weak to matter."""
    data = noisy(measured(Straight(), (0.02, -0.01, 0.005), driven(2)), seed=5)
    start, spread = np.array([0.03, 0.0, 0.0]), np.full(3, 100.0)
    one = identify(Straight(), start, spread, data)
    at = sensitivities.normal(Straight(), one.values, data)
    inverse = np.linalg.inv(at.gram)
    scatter = (COUNT * at.pull.T @ at.pull + 3.0 * one.noise * at.gram) / (COUNT + 3.0)
    wanted = COUNT / (COUNT - 1.0) * inverse @ scatter @ inverse
    assert one.covariance == pytest.approx(wanted, rel=1e-3, abs=1e-3 * np.abs(wanted).min())
    twice = identify(Straight(), start, spread, window_series.pick(data, [*range(COUNT)] * 2))
    assert twice.values == pytest.approx(one.values, rel=1e-6)
    weighed = identify(Straight(), start, spread, data._replace(weight=np.full(COUNT, 2.0)))
    assert weighed.covariance == pytest.approx(twice.covariance, rel=1e-6)
    assert (np.diag(twice.covariance) < np.diag(one.covariance)).all()


NAMES = (
    "hull.y_vl", "hull.x_u", "propeller.c3", "wind.x1", "wind.y1", "thruster.port_ahead",
    "thruster.port_astern", "thruster.starboard_ahead", "thruster.starboard_astern",
)  # fmt: skip


def limited(**values) -> list[str]:
    named = {key.replace("__", "."): value for key, value in values.items()}
    gone = {name for name, value in named.items() if abs(value) < 1e-6}
    return identifiability.at_limits(named, gone, NAMES)


def test_one_coefficient_at_its_limit_accuses_no_sensor():
    (only,) = limited(hull__y_vl=0.00197)
    assert only.startswith("hull.y_vl ran into the limit of its physical range at 0.00197")
    assert "sensor" not in only


def test_several_coefficients_at_their_limits_are_counted_and_grouped():
    first, wind = limited(hull__y_vl=0.002, wind__x1=0.1, wind__y1=0.2)
    assert first.startswith("3 of 9 coefficients ran into the limits of their physical ranges")
    assert "hull.y_vl at 0.002" in first and "a sensor is wrong" in first
    assert wind.startswith("2 of them are of the wind") and "mirrored" in wind


def test_all_thrust_astern_that_vanished_asks_for_a_sign():
    said = limited(thruster__port_astern=2.4e-14, thruster__starboard_astern=1e-13)
    assert len(said) == 2 and said[1].startswith("All thrust astern vanished: is a `sign` turned")
    one = limited(thruster__port_astern=2.4e-14)
    assert not any("vanished" in sentence for sentence in one)
