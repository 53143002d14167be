"""Identification on ships in two or three numbers: closed forms, exact data, known noise."""

import math
from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from shiplog.exceptions import ModelError
from shiplog.simulation import prediction_interval, sensitivities
from shiplog.simulation.sensitivities import Simulator, WindowSeries
from shiplog.training import hybrid_training, identifiability
from shiplog.training.cross_validation import cross_validate, folds
from shiplog.training.output_error import CORRELATION, Identified, identify


@jax.tree_util.register_static
@dataclass(frozen=True)
class Boat:
    """u̇ = -drag u + push n; sway and yaw rate fade by themselves, and nothing hears `silent`."""

    names = ("drag", "push", "silent")
    substeps = 1

    def acceleration(self, theta, state, actuator, true_wind):
        drag, push = theta[0], theta[1]
        u, v, r = state[..., 1], state[..., 3], state[..., 5]
        return jnp.stack((-drag * u + push * actuator[..., 0], -0.1 * v, -0.1 * r), -1)


@jax.tree_util.register_static
@dataclass(frozen=True)
class Straight:
    """u̇ = push n₁, v̇ = lift n₂ + cross n₁: a rollout is linear in the parameters."""

    names = ("push", "lift", "cross")
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
        push = {"sum": a + b, "difference": a - b, "product": a * b}[self.kind]
        u, v, r = state[..., 1], state[..., 3], state[..., 5]
        return jnp.stack((-0.05 * u + push * actuator[..., 0], -v, -r), -1)


@jax.tree_util.register_static
@dataclass(frozen=True)
class Growing:
    """u̇ = growth u²: a little too much of it and the rollout leaves every number behind."""

    names = ("growth",)
    substeps = 1

    def acceleration(self, theta, state, actuator, true_wind):
        u = state[..., 1]
        return jnp.stack((theta[0] * u * u, -state[..., 3], -state[..., 5]), -1)


COUNT, SIZE = 8, 40
TRUE, START = np.array([0.05, 0.02, 0.3]), np.array([0.2, 0.05, 0.7])
WIDE = np.full(3, 10.0)  # a ridge that hardly holds


def driven(actuators: int, seed: int = 0, count: int = COUNT) -> WindowSeries:
    """Windows of 40 s with commands that change and a start in motion; nothing measured yet."""
    rng = np.random.default_rng(seed)
    state = np.zeros((count, SIZE, 6))
    state[:, 0, [1, 3, 5]] = rng.normal(size=(count, 3)) * (0.3, 0.1, 0.01)
    command = np.repeat(rng.normal(size=(count, SIZE // 8, actuators)), 8, axis=1) + 0.5
    calm = np.zeros((count, SIZE, 2))
    return WindowSeries(state, command, calm, np.ones((count, SIZE - 1)), np.ones(count))


def measured(model, theta, data: WindowSeries) -> WindowSeries:
    return data._replace(measured=sensitivities.rollout(model, np.array(theta), data))


def noisy(data: WindowSeries, seed: int, sigma: float = 0.02) -> WindowSeries:
    """White noise on every measured velocity, the first among them."""
    error = np.zeros_like(data.measured)
    shape = (*error.shape[:2], 3)
    error[..., [1, 3, 5]] = np.random.default_rng(seed).normal(size=shape) * sigma * (1, 1, 0.1)
    return data._replace(measured=data.measured + error)


@pytest.fixture(scope="module")
def exact() -> WindowSeries:
    return measured(Boat(), TRUE, driven(1))


@pytest.fixture(scope="module")
def blurred(exact) -> WindowSeries:
    return noisy(exact, seed=1)


@pytest.fixture(scope="module")
def found(exact) -> Identified:
    return identify(Boat(), START, WIDE, exact)


def notes(found: Identified, names, spread, bounds=None) -> list[str]:
    limits = bounds or (np.full(len(names), -np.inf), np.full(len(names), np.inf))
    return identifiability.note(found, names, spread, limits, lambda name: f"the {name}")


# ---------------------------------------------------------------- what is found


def test_exact_data_give_the_true_values_back(found):
    assert found.values[:2] == pytest.approx(TRUE[:2], rel=1e-4)
    assert found.converged and found.message == "converged"
    assert found.loss[0] > 1e3 and found.loss[1] < 1e-4 * found.loss[0]
    assert (found.standard_error[:2] < 1e-4).all()


def test_what_the_data_never_touch_stays_where_it_started(found):
    assert found.values[2] == START[2]
    assert found.standard_error[2] == pytest.approx(WIDE[2])
    assert identifiability.silent(found, WIDE).tolist() == [False, False, True]
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
    ((i, j, value),) = identifiability.trades(both)
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
    pairs = identifiability.trades(made)
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
    some = sensitivities.pick(blurred, np.flatnonzero(weight))
    alone = identify(Boat(), START, WIDE, some)
    left_out = identify(Boat(), START, WIDE, WindowSeries(wrong, *blurred[1:4], weight))
    assert left_out.values == pytest.approx(alone.values, rel=1e-9)
    assert left_out.covariance == pytest.approx(alone.covariance, rel=1e-6)
    assert left_out.loss == pytest.approx(alone.loss)
    assert left_out.noise == pytest.approx(alone.noise)


# ---------------------------------------------------------------- what diverges


@pytest.fixture(scope="module")
def growing() -> WindowSeries:
    data = driven(1)
    data.measured[:, 0, 1] = np.linspace(0.5, 1.0, COUNT)
    return measured(Growing(), [0.02], data)


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
    assert "drag" in tired.message and "push" in tired.message
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
    """u_k = u₀ + push Σ n dt. With J the sum, in the loss's cm/s and trapezoidal seconds:
    s² (w S + 1/f⁴) / (w s²JᵀJ/σ² + 1/f²)², S between the gradient's square and what is expected
    of it, f how many times the plausible spread s the ridge allows."""
    whole = measured(Straight(), (0.02, -0.01, 0.005), driven(2))
    data = noisy(sensitivities.pick(whole, [0]), seed=4)._replace(weight=np.array([weight]))
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
    fitted were three more windows, times n/(n - 1); the ridge is far too weak to be seen."""
    data = noisy(measured(Straight(), (0.02, -0.01, 0.005), driven(2)), seed=5)
    start, spread = np.array([0.03, 0.0, 0.0]), np.full(3, 100.0)
    one = identify(Straight(), start, spread, data)
    at = sensitivities.normal(Straight(), one.values, data)
    inverse = np.linalg.inv(at.gram)
    scatter = (COUNT * at.pull.T @ at.pull + 3.0 * one.noise * at.gram) / (COUNT + 3.0)
    wanted = COUNT / (COUNT - 1.0) * inverse @ scatter @ inverse
    assert one.covariance == pytest.approx(wanted, rel=1e-3, abs=1e-3 * np.abs(wanted).min())
    twice = identify(Straight(), start, spread, sensitivities.pick(data, [*range(COUNT)] * 2))
    assert twice.values == pytest.approx(one.values, rel=1e-6)
    weighed = identify(Straight(), start, spread, data._replace(weight=np.full(COUNT, 2.0)))
    assert weighed.covariance == pytest.approx(twice.covariance, rel=1e-6)
    assert (np.diag(twice.covariance) < np.diag(one.covariance)).all()


# ---------------------------------------------------------------- held-out voyages


def test_whole_groups_are_dealt_in_turn():
    groups = ["a", "a", "b", "c", "a", "d", "e", "f", "g", "f"]
    parts = folds(groups, 3)
    held = [{g for g, out in zip(groups, part, strict=True) if out} for part in parts]
    assert held == [{"a", "d", "g"}, {"b", "e"}, {"c", "f"}]
    assert np.sum(parts, axis=0).tolist() == [1] * len(groups)


@pytest.mark.parametrize(("names", "count"), [("ab", 2), ("abc", 3), ("abcde", 5), ("abcdefg", 5)])
def test_every_window_is_held_out_once(names, count):
    groups = [*names] * 3
    parts = folds(groups)
    assert len(parts) == count
    assert np.sum(parts, axis=0).tolist() == [1] * len(groups)
    for part in parts:
        inside = {g for g, out in zip(groups, part, strict=True) if out}
        outside = {g for g, out in zip(groups, part, strict=True) if not out}
        assert inside and outside and not inside & outside


def test_one_voyage_leaves_nothing_to_hold_out(exact):
    assert folds(["a"] * COUNT) == []
    assert cross_validate(lambda part: pytest.fail("fitted"), exact, ["a"] * COUNT) is None


def test_each_of_two_voyages_is_rolled_out_with_what_the_other_reported():
    """Boat a with one drag, boat b with another, windows in turns: each gets the other's."""
    groups = ["a", "b"] * (COUNT // 2)
    first, second = np.array([0.05, 0.02, 0.7]), np.array([0.15, 0.04, 0.7])
    plain = driven(1)
    is_a = np.array([g == "a" for g in groups])
    a, b = (measured(Boat(), theta, plain) for theta in (first, second))
    data = plain._replace(
        measured=np.where(is_a[:, None, None], a.measured, b.measured), weight=np.full(COUNT, 2.0)
    )
    observed = []

    def fit(part: WindowSeries) -> Simulator:
        observed.append(part.weight)
        done = identify(Boat(), START, WIDE, part)
        return Simulator(Boat(), done.values, np.diag([1e-4, 0.0, 0.0]))

    done = cross_validate(fit, data, groups)
    assert sorted(w.tolist() for w in observed) == [[0.0, 2.0] * 4, [2.0, 0.0] * 4]
    crossed = np.where(
        is_a[:, None, None],
        sensitivities.rollout(Boat(), second, data),
        sensitivities.rollout(Boat(), first, data),
    )
    assert done.states == pytest.approx(crossed, abs=1e-5)
    sure = np.where(
        is_a[:, None, None],
        sensitivities.spread(Boat(), second, np.diag([1e-4, 0, 0]), data),
        sensitivities.spread(Boat(), first, np.diag([1e-4, 0, 0]), data),
    )
    assert done.spread == pytest.approx(sure, abs=1e-5) and sure[:, 1:, 1].min() > 0.0
    error = 100.0 * (crossed - data.measured)[..., 1]
    wanted = np.trapezoid(error**2, axis=1)  # sway and yaw rate are the same for both
    assert done.loss == pytest.approx(wanted, rel=1e-3)
    assert wanted.min() > 10.0 and done.groups.tolist() == groups


def test_a_voyage_that_was_corrupted_spoils_every_fit_but_its_own(exact):
    groups = ["a", "a", "b", "b", "b", "c", "c", "c"]
    bad = exact.measured.copy()
    bad[5:, 1:, 1] += 50.0  # voyage c, but for where its rollouts begin

    def fit(part: WindowSeries) -> Simulator:
        done = identify(Boat(), START, WIDE, part)
        return Simulator(Boat(), done.values, done.covariance)

    done = cross_validate(fit, exact._replace(measured=bad), groups)
    truth = sensitivities.rollout(Boat(), TRUE, exact)
    assert done.states[5:] == pytest.approx(truth[5:], abs=1e-4)
    assert np.abs(done.states - truth)[:5, :, 1].max((1,)).min() > 1.0


@pytest.mark.filterwarnings("ignore::RuntimeWarning")  # of squares that overflow
def test_a_held_out_window_that_runs_away_has_an_infinite_loss(growing):
    wild = growing.measured.copy()
    wild[0, :, 1] = 1e6
    data = growing._replace(measured=wild)
    done = cross_validate(
        lambda part: Simulator(Growing(), np.array([0.02]), np.zeros((1, 1))),
        data,
        [*"abcdefgh"],
    )
    assert done.loss[0] == np.inf and done.loss[1:].max() < 1e-9


# ---------------------------------------------------------------- the band


def walks(count: int, seed: int) -> np.ndarray:
    """Errors [N, 40, 6] that grow as √t, each channel with a size of its own, zero at first."""
    steps = np.random.default_rng(seed).normal(size=(count, 40, 6)) * (1, 0.1, 1, 0.1, 0.01, 0.01)
    steps[:, 0] = 0.0
    return np.cumsum(steps, axis=1)


def test_a_calibrated_band_holds_nine_in_ten_of_fresh_errors():
    old, new = walks(2000, 0), walks(2000, 1)
    for own in (np.zeros_like(old), np.full_like(old, 0.5) * np.abs(old).mean((0, 1))):
        learnt = prediction_interval.calibrate(old, own, groups=1000)
        shares = prediction_interval.coverage(new, learnt.half_width(own))
        assert shares == pytest.approx(np.full(6, 0.9), abs=0.03)
    plain = prediction_interval.calibrate(old, np.zeros_like(old), groups=1000)
    assert plain.growth[10:34, 0] == pytest.approx(np.sqrt(np.arange(10, 34)), rel=0.06)
    assert plain.factor == pytest.approx(np.full(6, 1.645), rel=0.05)  # Gaussian


@pytest.mark.parametrize(
    ("groups", "level", "wanted"),
    [(1, 0.9, 0.95), (18, 0.9, 0.95), (30, 0.9, 0.93), (900, 0.9, 0.901), (4, 0.5, 0.625)],
)
def test_few_voyages_ask_for_a_wider_quantile(groups, level, wanted):
    """level (1 + 1/groups), no further than 0.95, of the very errors it has seen."""
    errors = walks(500, 2)
    nothing = np.zeros_like(errors)
    learnt = prediction_interval.calibrate(errors, nothing, groups, level)
    inside = prediction_interval.coverage(errors, learnt.half_width(nothing))
    assert inside == pytest.approx(np.full(6, wanted), abs=2e-4)


def test_more_spread_of_its_own_is_a_wider_band():
    errors = walks(200, 3)
    learnt = prediction_interval.calibrate(errors, np.full_like(errors, 0.05), groups=20)
    narrow, wide = (learnt.half_width(np.full((3, 40, 6), s)) for s in (0.0, 0.2))
    assert (wide > narrow).all()
    assert narrow == pytest.approx(np.broadcast_to(learnt.factor * learnt.growth, (3, 40, 6)))
    wanted = learnt.factor * np.sqrt(0.04 + learnt.growth**2)
    assert wide[1] == pytest.approx(wanted)


def test_what_the_spread_explains_is_not_counted_twice():
    """Errors as large as the model says: the growth left over is the least, 5 % of the square."""
    errors = walks(2000, 4)
    size = np.sqrt((errors**2).mean(0))
    learnt = prediction_interval.calibrate(errors, np.broadcast_to(size, errors.shape), groups=1000)
    assert learnt.growth[10:34] == pytest.approx(np.sqrt(0.05) * size[10:34], rel=0.05)


def test_rollouts_that_diverged_widen_no_band():
    errors = walks(100, 5)
    own = np.full_like(errors, 0.01)
    wild = np.concatenate((errors, np.full((1, 40, 6), np.inf), np.full((1, 40, 6), np.nan)))
    plain = prediction_interval.calibrate(errors, own, 20)
    same = prediction_interval.calibrate(wild, np.concatenate((own, own[:2])), 20)
    assert same.growth.tolist() == plain.growth.tolist()
    assert same.factor.tolist() == plain.factor.tolist()


def test_the_share_inside_is_counted_without_the_first_samples():
    error = np.zeros((2, 3, 6))
    error[:, 0] = 9.0  # where a rollout begins there is no error to speak of
    error[0, 1, 0], error[1, 1:, 0] = -2.0, (0.5, np.nan)
    error[:, 1:, 1] = -1.0
    half = np.ones((2, 3, 6))
    assert prediction_interval.coverage(error, half).tolist() == [0.5, 1.0, 1.0, 1.0, 1.0, 1.0]


def test_the_spread_of_seeds():
    one = np.zeros((1, 2, 6))
    assert not prediction_interval.seeds_spread([one]).any()
    assert prediction_interval.seeds_spread([one, one + 2.0, one + 4.0]) == pytest.approx(one + 2.0)
    assert np.isinf(prediction_interval.seeds_spread([one, one * np.nan])).all()


# ---------------------------------------------------------------- how much a network may say


def judged(**gain: float) -> dict[float, np.ndarray]:
    """Made-up losses of 50 windows: s03=10 is a mean 10 below the physics, ± 20 a window."""
    rng = np.random.default_rng(6)
    physics = rng.gamma(2.0, 50.0, 50) + 200.0
    table = {"s0": 0.0, "s01": 0.1, "s03": 0.3, "s1": 1.0}
    losses = {0.0: physics}
    for name, less in gain.items():
        noise = rng.normal(size=50)
        losses[table[name]] = physics - less + 20.0 * (noise - noise.mean())
    return losses


@pytest.mark.parametrize(
    ("gain", "wanted"),
    [
        (dict(s01=0.5, s03=1.0, s1=0.2), 0.0),  # a gain of 1 ± 20/√50 = 2.8 is chance
        (dict(s01=5.0, s03=60.0, s1=20.0), 0.3),
        (dict(s01=59.0, s03=60.0, s1=20.0), 0.1),  # as good as the best, and less of it
        (dict(s01=45.0, s03=60.0, s1=20.0), 0.3),  # 15 ± 28/√50 = 4 is no chance
        (dict(s01=20.0, s03=59.0, s1=60.0), 0.3),
        (dict(s01=10.0, s03=20.0, s1=60.0), 1.0),
        (dict(s01=-50.0, s03=-60.0, s1=-70.0), 0.0),
    ],
)
def test_the_least_strength_within_one_standard_error_is_chosen(gain, wanted):
    assert hybrid_training.choose(judged(**gain)) == wanted


def test_windows_are_compared_in_pairs():
    """Windows differ by hundreds; a network that takes 5 from every one of them is no chance."""
    physics = np.linspace(100.0, 900.0, 40)
    better = physics - 5.0 + 0.1 * np.cos(np.arange(40.0))
    assert hybrid_training.choose({0.0: physics, 0.1: better}) == 0.1
