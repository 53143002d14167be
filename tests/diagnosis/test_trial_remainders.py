"""Families of change and levels of process noise, against dense Gaussians."""

import math
from dataclasses import replace

import numpy as np
import pytest
import straight
from dense_trial import SHARE, gaussian, level, nats, of_noise
from scipy.stats import multivariate_normal, norm
from searchable import search_of
from straight import CAUSES, PROCESS_NOISE

from shiplog.diagnosis.hypotheses import as_it_stands, evidence, fits, weighing
from shiplog.diagnosis.noise import remainder
from shiplog.diagnosis.noise.discrepancy import EVEN
from shiplog.diagnosis.noise.remainder import INTERMITTENT, NOMINAL, RAISED, Remainder
from shiplog.diagnosis.trial.fitted import Fit, Level

# --- changes


@pytest.mark.parametrize("family", ("motion", "position", "heading", "time"))
@pytest.mark.parametrize("included", ((), ("drag",)))
def test_the_factor_of_a_change_is_the_difference_of_two_evidences(trial, family, included):
    point = trial.linearise({})
    base = level(trial, point, 1.4, included)
    gained, size = evidence.family_change(trial, point, base, included, family, Remainder())
    each = [level(trial, point, 1.4, included, family, s).value for s in remainder.CHANGE_SIZES]
    assert gained == pytest.approx(max(each) - base.value, abs=1e-6)
    assert size == remainder.CHANGE_SIZES[int(np.argmax(each))]
    with_it = nats(trial, point, 1.4, included, (family,), size)
    assert gained == pytest.approx(with_it - nats(trial, point, 1.4, included), abs=1e-3)


def test_a_change_that_is_there_is_found_at_its_size(made):
    """In the trial alone, an acceleration by place, three times the process noise."""
    nominal, record, _ = made
    plain = straight.trial(*made)
    family = next(f for f in plain.omitted.families if f.name == "position")
    rng = np.random.default_rng(5)
    weights = np.zeros(plain.omitted.count)
    first = plain.omitted.families[0].columns[0]
    weights[family.columns - first] = 9.0 * rng.standard_normal(len(family.columns))
    accelerations = (
        plain.omitted.accelerations(plain.linearise({}).linear.cut, plain.grid) @ weights
    )
    columns = straight.columns_of(CAUSES)
    given = straight.passed(record, columns, seed=2, sensitivity=0.3, accelerations=accelerations)
    trial = straight.trial(nominal, record, given)
    point = trial.linearise({})
    base = level(trial, point, 1.0)
    gained = {
        name: evidence.family_change(trial, point, base, (), name, Remainder())
        for name in trial.families
    }
    best = max(gained, key=lambda name: gained[name][0])
    assert best == "position"
    assert gained[best][0] > 50.0
    assert gained[best][1] == 9.0


def test_a_change_acts_on_the_channels_of_its_acceleration(made):
    nominal, record, _ = made
    plain = straight.trial(*made)
    family = next(f for f in plain.omitted.families if f.name == "time")
    weights = np.zeros(plain.omitted.count)
    at = (family.columns - plain.omitted.families[0].columns[0])[3 * EVEN["time"] :]
    each = len(at) // 3  # channel by channel: sway's are in the middle
    weights[at[each : 2 * each]] = 20.0
    accelerations = (
        plain.omitted.accelerations(plain.linearise({}).linear.cut, plain.grid) @ weights
    )
    given = straight.passed(
        record, straight.columns_of(CAUSES), seed=2, sensitivity=0.3, accelerations=accelerations
    )
    trial = straight.trial(nominal, record, given)
    point = trial.linearise({})
    base, _ = evidence.scan(trial, point, (), (), 1.0)
    assert fits.acts_on(trial, Fit(point, base, Remainder(RAISED)), "time") == ("sway",)


@pytest.mark.parametrize(
    ("own", "low", "high"), [(0.0, 0.98, 1.0), (0.045, 0.3, 0.7), (1.0, 0.0, 0.01)]
)
def test_what_a_family_does_as_well_is_the_share_that_lies_in_its_columns(made, own, low, high):
    """A cause that acts as a function of time does, and in addition as nothing else does. What does
    not act at the nodes, as process noise does, weighs far more."""
    nominal, record, given = made
    plain = straight.trial(*made)
    family = next(f for f in plain.omitted.families if f.name == "time")
    at = family.columns - plain.omitted.families[0].columns[0]
    accelerations = plain.omitted.accelerations(given.cut, plain.grid)[..., at[3 * EVEN["time"]]]
    does = np.einsum("sbcz,sz->sbc", given.z[..., 6:], accelerations)
    weight = does.std((0, 1)) + 1e-12
    rest = np.random.default_rng(11).standard_normal(does.shape) * weight
    j, columns = given.j.copy(), straight.columns_of(CAUSES)
    j[..., columns.indices["drag"][0]] = 30.0 * (does + own * rest)
    trial = straight.trial(nominal, record, replace(given, j=j))
    point = trial.linearise({})
    base, _ = evidence.scan(trial, point, (), ("drag",), 1.0)
    base.numbers["drag"] = np.ones(1)
    share = fits.imitated(trial, Fit(point, base, Remainder("time")), "drag", 1e4)
    assert low <= share <= high
    assert fits.imitated(trial, Fit(point, base, Remainder("time")), "drag", 1e-4) < 0.01
    assert fits.imitated(trial, Fit(point, base, Remainder(RAISED)), "drag", 1e4) == 0.0


# --- levels of process noise


def test_what_is_expected_of_the_process_noise_is_a_log_density_ratio(trial):
    nominal = max(trial.campaign.noise, remainder.LEAST_SPREAD)
    top = norm(0.0, nominal).logpdf(0.0)
    for noise in (0.5, 1.0, 1.3, 4.0):
        at = math.log(noise)
        wanted = norm(0.0, nominal).logpdf(at) - top
        for remaining in (Remainder(), Remainder("wind", 3.0)):
            assert of_noise(trial, noise, remaining) == pytest.approx(wanted)
        wanted = norm(0.0, remainder.RAISED_SPREAD).logpdf(at) - top
        for remaining in (Remainder(RAISED), Remainder(INTERMITTENT), Remainder("wind", 3.0, True)):
            assert of_noise(trial, noise, remaining) == pytest.approx(wanted)


def test_campaigns_are_never_quite_alike(made):
    nominal, record, given = made
    trial = straight.trial(replace(nominal, noise=0.0), record, given)
    wanted = -0.5 * (math.log(1.2) / remainder.LEAST_SPREAD) ** 2
    assert of_noise(trial, 1.2) == pytest.approx(wanted)


def test_levels_of_noise_differ_as_dense_gaussians_do(made):
    """With starts that are known, since what a start is felt by is restricted likelihood."""
    nominal, record, given = made
    sure = replace(PROCESS_NOISE, start=np.full(6, 1e-5))
    ref = replace(nominal.reference, process_noise=sure)
    trial = straight.trial(replace(nominal, reference=ref), record, given)
    point = trial.linearise({})
    found, wanted = [], []
    for noise in (1.0, 1.4):
        one = level(trial, point, noise)
        found.append(one.value - of_noise(trial, noise))
        e, j, _, _, c, mean, nominal_covariance, *_ = gaussian_of(trial, point, noise, sure)
        # of a power of the likelihood log|C| counts for its share, log|C + share·JUJᵀ| whole
        whole = c / SHARE + j @ nominal_covariance @ j.T
        power = 0.5 * (1.0 - SHARE) * np.linalg.slogdet(c)[1]
        wanted.append(multivariate_normal(j @ mean, whole).logpdf(e) + power)
    assert abs(wanted[1] - wanted[0]) > 5.0
    assert found[1] - found[0] == pytest.approx(wanted[1] - wanted[0], abs=0.05)


def gaussian_of(trial, point, noise, process_noise):
    kept = straight.dense
    try:
        straight.dense = lambda linear, _: kept(linear, process_noise.times(noise))
        return gaussian(trial, point, noise)
    finally:
        straight.dense = kept


def test_the_best_level_is_the_one_that_was_drawn(made):
    """Twice the process noise in the trial: found under a raised remainder, between the steps."""
    nominal, record, _ = made
    rng = np.random.default_rng(8)
    plain = straight.trial(*made)
    kernel = np.linalg.cholesky(PROCESS_NOISE.kernel(plain.grid.nodes))
    more = math.sqrt(3.0) * rng.standard_normal((8, 3 * plain.grid.nodes)) @ kernel.T
    given = straight.passed(
        record, straight.columns_of(CAUSES), seed=2, sensitivity=0.3, accelerations=more
    )
    trial = straight.trial(nominal, record, given)
    raised = Remainder(RAISED)
    levels = evidence.levels(trial, trial.linearise({}), remainder=raised)
    best = max(levels, key=lambda one: one.value)
    assert best.noise_factor == pytest.approx(2.0, rel=0.12)
    again = evidence.levels(trial, trial.linearise({}), (), best.noise_factor, raised)
    near = max(again, key=lambda one: one.value)
    assert near.noise_factor == pytest.approx(best.noise_factor, rel=0.02)


@pytest.mark.parametrize("failing", [1, 2])
def test_a_fit_that_diverges_with_raised_noise_leaves_no_noise_to_explain(
    made, monkeypatch, failing
):
    """The first or the second fit of a set diverges, with numbers that are not finite: neither a
    factor of each channel nor a force is asked of it, and the set stays with raised noise."""
    trial, point = as_it_stands.begin(straight.trial(*made), {})
    real, count = weighing.resume, 0
    monkeypatch.setattr(weighing, "RAISED_FROM", 0.0)

    def diverges(trial, included, remainder, *more, **others):
        nonlocal count
        count += remainder != weighing.RAISING  # not the fit that a set begins with
        fit = real(trial, included, remainder, *more, **others)
        if count < failing:
            return fit
        gone = {"drag": np.array([np.nan])}
        return replace(fit, estimate=replace(fit.estimate, evidence=-math.inf, numbers=gone))

    def asked(fit):
        assert np.isfinite([*fit.estimate.numbers.values()]).all()
        return straight.no_hull(fit)

    search = search_of(trial, point, estimate=asked)
    search.weigh((), {}, point)
    monkeypatch.setattr(weighing, "resume", diverges)
    search.weigh(("drag",), {"drag": np.zeros(1)}, point)
    table = search.table
    assert count >= failing
    assert np.isfinite(table.found[("drag",), RAISED].evidence)
    assert (("drag",), INTERMITTENT) not in table.found


@pytest.mark.parametrize("kind", (NOMINAL, RAISED))
@pytest.mark.parametrize("more", (0.0, 3.0))
def test_evidence_is_that_of_the_best_of_a_fine_grid_of_noise_levels(made, kind, more):
    """Levels are eight per cent apart: the value is that of the parabola's top, and with two levels
    and the bend of another hypothesis it is nearly that."""
    nominal, record, _ = made
    plain = straight.trial(*made)
    kernel = np.linalg.cholesky(PROCESS_NOISE.kernel(plain.grid.nodes))
    rng = np.random.default_rng(8)
    drawn = math.sqrt(more) * rng.standard_normal((8, 3 * plain.grid.nodes)) @ kernel.T
    given = straight.passed(
        record, straight.columns_of(CAUSES), seed=2, sensitivity=0.3, accelerations=drawn
    )
    trial, remaining = straight.trial(nominal, record, given), Remainder(kind)
    point = trial.linearise({})
    found, _ = evidence.scan(trial, point, (), remainder=remaining)
    fine = np.exp(np.linspace(-0.12, 0.12, 49))
    values = [
        evidence.level(trial, point, found.noise_factor * by, (), remaining).value for by in fine
    ]
    assert 0 < int(np.argmax(values)) < 48
    assert found.evidence == pytest.approx(max(values), abs=0.05)
    at_level = evidence.level(trial, point, found.noise_factor, (), remaining).value
    assert at_level <= found.evidence < at_level - found.bend / 8.0 + 0.05
    again, _ = evidence.scan(
        trial, point, (), (), found.noise_factor, remaining, bend=0.95 * found.bend
    )
    assert again.evidence == pytest.approx(max(values), abs=0.1)


def test_the_top_between_levels_by_hand():
    """Of a curve whose second difference falls by a step's logarithm: between levels, from one side
    with three levels, and from two with its bend; of levels far apart the best is all that is
    known."""
    step, b, s = evidence.FINE_STEP, -20.0, 6.0
    c = -math.log(step) * b

    def value(x):
        return s * x + 0.5 * b * x**2 + c * (x**3 - x) / 6.0

    def of(*powers, bend=0.0):
        return evidence.top_of([step**x for x in powers], [value(x) for x in powers], bend)

    wanted = max(value(x) for x in np.linspace(0.0, 0.5, 5001))
    for given, place in ((of(1, 0, -1, 7), 1), (of(0, 1, 2), 0), (of(0, 1, bend=b), 0)):
        assert given == (place, pytest.approx(wanted, abs=1e-6), pytest.approx(b))
    assert abs(s**2 / (-2.0 * b) - wanted) > 0.05  # as a parabola has it
    assert of(4, 0, 8) == (1, 0.0, 0.0)
    _, gain, _ = of(5, 6, 7)  # the top is 4.7 steps away: one step is as far as it is trusted
    assert gain == pytest.approx(value(4) - value(5), rel=0.02)


@pytest.mark.parametrize("power", (-17, -3, 0, 1, 6, 17))
def test_the_noise_of_many_observations_is_reached_in_one_move(monkeypatch, power):
    """Of -n log λ - S/(2 λ²): three levels, then three about the greatest."""
    step, n = evidence.FINE_STEP, 1000.0
    asked: list[float] = []

    def level(_, __, noise, *___):
        asked.append(noise)
        value = -n * math.log(noise) - 0.5 * n * (step**power / noise) ** 2
        return Level(noise, np.zeros((1, 1)), np.zeros((0, 0)), np.zeros(0), value)

    monkeypatch.setattr(evidence, "level", level)
    found = evidence.top(evidence.levels(None, None))
    assert found.noise_factor == pytest.approx(step**power)
    assert len(asked) <= 6
    assert found.value == pytest.approx(-n * power * math.log(step) - 0.5 * n, abs=0.02)
