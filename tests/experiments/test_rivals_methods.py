"""The rivals' regression and likelihood ratios, against textbooks and least squares."""

import math
from dataclasses import dataclass
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import straight
from jax.typing import ArrayLike

from pipelines.experiments.hidden_effects import rivals
from shiplog.diagnosis.linear.linear_segments import Linear
from shiplog.diagnosis.linear.linear_segments import Path as Along
from shiplog.diagnosis.linear.parameter_layout import Columns
from shiplog.diagnosis.linear.segments import BIN, Cut

START = np.array([2.0, 0.5, 2.0, 0.5, 0.3, 0.2])
NOISE = np.array([0.02, 0.01, 0.03, 0.015, 0.004, 0.002])


# --- an answer ------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("scores", "wanted", "answer"),
    [
        ({"a": 3.0, "b": 5.0}, 0.0, "b"),
        ({"a": -3.0, "b": -0.1}, 0.0, None),
        ({"a": 3.0, "b": 5.0}, 8.0, None),
        ({"a": 3.0, "b": 5.0}, {"a": 1.0, "b": 6.0}, None),  # the first alone counts
        ({}, 0.0, None),
    ],
)
def test_the_first_is_the_answer_or_none(scores, wanted, answer):
    one = rivals.reported(scores, wanted)
    assert one.answer == answer
    assert list(one.scores.values()) == sorted(scores.values(), reverse=True)


# --- regression -----------------------------------------------------------------------------------


def regressed(size: float, noise: float = 1.0, seed: int = 0):
    rng = np.random.default_rng(seed)
    sd = np.array([0.01, 0.02, 1.0])
    columns = {name: rng.standard_normal((400, 3, k)) * sd[:, None] for name, k in
               (("right", 2), ("other", 1), ("third", 12))}  # fmt: skip
    columns["unseen"] = np.zeros((400, 3, 2))
    rest = columns["right"] @ np.array([size, -size]) + noise * sd * rng.standard_normal((400, 3))
    return rivals.bic(rest, columns, sd)


def test_what_was_added_is_found_and_nothing_is_not():
    """RSS falls from n (1 + 2 · 0.5²) to n: ½ n log 1.5 of BIC, give or take noise."""
    found = regressed(0.5)
    assert rivals.reported(found).answer == "right"
    wanted = 0.5 * (1200 * math.log(1.5) - 2 * math.log(1200))
    assert found["right"] == pytest.approx(wanted, rel=0.15)
    assert found["unseen"] == pytest.approx(-math.log(1200))  # ½ k log n with k = 2
    alarms = sum(
        rivals.reported(regressed(0.0, seed=seed)).answer is not None for seed in range(40)
    )
    assert alarms <= 3  # P(χ²₁ > log 1200) = 0.8 % for one number, less for more: 0.35 expected


def test_bic_is_that_of_the_textbook_in_any_unit():
    """y = (1, 2, 3, 4, 5, 6) on a constant: RSS 91 and 17.5."""
    rest = np.arange(1.0, 7.0).reshape(2, 3)
    constant = {"constant": np.full((2, 3, 1), 1e-9)}
    found = rivals.bic(rest, constant, np.ones(3))
    wanted = 0.5 * (6 * math.log(91.0 / 17.5) - math.log(6))
    assert found["constant"] == pytest.approx(wanted)


@partial(jax.tree_util.register_dataclass, data_fields=["drag"], meta_fields=[])
@dataclass(frozen=True)
class Sled:
    """ν̇ = -drag ν + p + rudder: straight, and no wind."""

    drag: ArrayLike

    def acceleration(self, theta, state, actuator, true_wind):
        velocity = state[..., jnp.array([1, 3, 5])]
        return -self.drag * velocity + theta + actuator[..., :1]


def test_the_acceleration_of_a_known_motion_is_the_models_and_what_was_added_is_left():
    """ν = exp(-t/τ) ν₀, averaged over 2 s exactly; a decay slow against the bins."""
    drag, added = 0.02, np.array([0.03, -0.02, 0.01])
    edge = BIN * np.arange(16)
    start = np.array([1.0, -0.5, 0.2]) - added / drag
    mean = -np.diff(np.exp(-drag * edge)) / (drag * BIN)
    y = np.zeros((1, 15, 6))
    y[0][:, rivals.VELOCITY] = mean[:, None] * start + added / drag
    driven = np.zeros((1, 15, 4))
    found = rivals.beyond(Sled(drag), np.zeros(3), y, driven)
    assert found.shape == (1, 13, 3)
    assert found[0] == pytest.approx(np.broadcast_to(added, (13, 3)), abs=2e-5)
    known = rivals.beyond(Sled(drag), added, y, driven)
    assert known == pytest.approx(np.zeros((1, 13, 3)), abs=2e-5)


def test_both_sides_are_averaged_alike():
    """A rudder that jumps and acts at once: nothing is left, though no bin shows when."""
    accelerated = np.zeros((1, 151))
    accelerated[0, 70:] = 0.1  # at the nodes, every 0.2 s
    accelerated[0, 70] = 0.05
    steps = 0.1 * (accelerated[0, 1:] + accelerated[0, :-1])
    velocity = np.concatenate(([0.0], np.cumsum(steps)))
    y = np.zeros((1, 15, 6))
    y[0, :, 1] = rivals.of_bins(velocity[None], 15)[0]
    driven = np.zeros((1, 151, 4))
    driven[..., 0] = accelerated
    left = rivals.beyond(Sled(0.0), np.zeros(3), y, rivals.of_bins(driven, 15))
    assert left[..., 0] == pytest.approx(np.zeros((1, 13)), abs=0.004)  # of 0.1


# --- likelihood ratios ----------------------------------------------------------------------------


def rolled(segments: int, numbers, seed: int = 0, columns: int = 5, noise=NOISE) -> Linear:
    """Random columns; what was measured is a free start, those numbers and white noise, as if no
    acceleration at the nodes had ever been there."""
    rng = np.random.default_rng(seed)
    shape = (segments, 8, 6)
    used = np.ones(shape, dtype=bool)
    used[0, 1] = False
    cut = Cut(np.arange(segments), np.zeros(shape), used, np.zeros((segments, 1, 1)),
              np.zeros(segments, dtype=int), 0.2)  # fmt: skip
    z = rng.standard_normal((*shape, 15)) * noise[:, None] * 5.0
    j = rng.standard_normal((*shape, columns)) * noise[:, None]
    e = j @ np.asarray(numbers) + noise * rng.standard_normal(shape)
    e += np.einsum("sbcz,sz->sbc", z[..., :6], rng.standard_normal((segments, 6)))
    along = Along(np.zeros((segments, 6)), np.zeros((segments, 3, 3)))
    return Linear(cut, along, e, z, j)


def chi2_of(given: Linear, chosen, information, pull) -> float:
    """Least squares over all starts and numbers at once, written out row by row."""
    rows, right = [], []
    count = len(given.e)
    width = 6 * count + len(chosen)
    for s in range(count):
        used = given.cut.used[s]
        block = np.zeros((int(used.sum()), width))
        scale = np.broadcast_to(NOISE, used.shape)[used]
        block[:, 6 * s : 6 * s + 6] = given.z[s][used][:, :6] / scale[:, None]
        block[:, 6 * count :] = given.j[s][used][:, chosen] / scale[:, None]
        rows.append(block)
        right.append(given.e[s][used] / scale)
    held = np.zeros((6 * count, width))
    held[:, : 6 * count] = np.diag(np.tile(1.0 / START, count))
    root = np.linalg.cholesky(information)
    prior = np.zeros((len(pull), width))
    prior[:, 6 * count : 6 * count + len(pull)] = root.T
    rows += [held, prior]
    right += [np.zeros(6 * count), np.linalg.solve(root, pull)]
    x, y = np.concatenate(rows), np.concatenate(right)
    left = y - x @ np.linalg.lstsq(x, y, rcond=None)[0]
    return float(left @ left)


def test_ratios_are_those_of_least_squares_over_everything():
    given = rolled(4, [0.3, -0.2, 0.5, 0.0, 0.1])
    unit = np.array([1.0, 0.1, 5.0, 1.0, 2.0])
    information, pull = np.array([[9.0, 1.0], [1.0, 4.0]]), np.array([2.0, -1.0])
    tried = {"one": np.array([2]), "two": np.array([3, 4])}
    total = rivals.white_total(given, NOISE, START, unit)
    found = rivals.ratios(total, information, pull, tried)
    by = np.diag(1.0 / unit[:2])  # dense, numbers as they are
    dense = by @ information @ by, by @ pull
    none = chi2_of(given, [0, 1], *dense)
    for label, at in tried.items():
        wanted = none - chi2_of(given, [0, 1, *at], *dense)
        assert found[label] == pytest.approx(wanted, rel=1e-6)


def test_numbers_that_change_nothing_have_no_ratio():
    given = rolled(4, [0.3, 0.0, 0.0, 0.0, 0.0])
    given.j[..., 2] = given.j[..., 1]  # two numbers, one effect
    total = rivals.white_total(given, NOISE, START, np.ones(5))
    tried = {"once": np.array([1]), "twice": np.array([1, 2])}
    found = rivals.ratios(total, np.eye(1), np.zeros(1), tried)
    assert found["twice"] == pytest.approx(found["once"])


def test_noise_and_coefficients_of_the_nominal_voyages_are_learnt():
    true = np.array([0.8, -0.6, 0.0, 0.0, 0.0])
    given = rolled(150, true)
    columns = Columns(2, (), np.array([1.0, 0.5, 1.0, 1.0, 1.0]))
    white = rivals.learnt(given, columns, START, 10.0 * NOISE)
    assert white.noise == pytest.approx(NOISE, rel=0.08)
    solved = np.linalg.solve(white.information, white.pull) * columns.unit[:2]
    assert solved == pytest.approx(true[:2], abs=0.05)
    sd = np.sqrt(np.diag(np.linalg.inv(white.information))) * columns.unit[:2]
    assert (sd < 0.02).all()  # 7200 numbers less 900 starts, each as large as its noise


def test_a_trial_whose_model_has_a_discrepancy_is_compared_without_it():
    """Its columns are of no simpler method: what was hidden is found by the ratio all the same."""
    columns = straight.columns_of(straight.CAUSES)
    nominal, record = straight.sailed(12), straight.sailed(8, seed=3)
    passed = straight.passed(nominal, columns, noise=0.3, sensitivity=0.3)
    campaign = straight.campaign(nominal, passed, columns)
    assert campaign.reference.columns.misfit > 0
    hidden = np.zeros(columns.linearised)
    hidden[columns.indices["drag"]] = 1.5
    given = straight.passed(record, columns, hidden, seed=2, noise=0.3, sensitivity=0.3)
    trial = straight.trial(campaign, record, given)
    found = rivals.likelihood_ratio(trial, trial.linearise({}))
    assert found.answer == "drag"
    assert set(found.scores) == {c.label for c in straight.CAUSES}
