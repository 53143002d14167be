"""What a trial says of a hypothesis, against dense Gaussians of all its numbers."""

import gc
import math
from dataclasses import replace

import numpy as np
import pytest
import straight
from scipy.stats import multivariate_normal, norm
from straight import CAUSES, PROCESS_NOISE

from shiplog.diagnosis import campaign_parts, evidence, fits, remainder
from shiplog.diagnosis.discrepancy import EVEN
from shiplog.diagnosis.fitted import Fit
from shiplog.diagnosis.parameter_layout import HELD_INFORMATION
from shiplog.diagnosis.remainder import INTERMITTENT, NOMINAL, RAISED, Remainder

SHARE = 0.5  # of itself that the trial counts
DRAG = 1.5  # three realistic sizes, in the trial


@pytest.fixture(scope="module")
def made():
    """A campaign of 12 segments, a trial of 8 in two voyages, and their columns."""
    columns = straight.columns_of(CAUSES)
    nominal, record = straight.sailed(12), straight.sailed(8, seed=3)
    nominal = straight.campaign(
        nominal, straight.passed(nominal, columns, sensitivity=0.3), columns, share=SHARE
    )
    numbers = np.zeros(columns.linearised)
    numbers[columns.of["drag"]] = DRAG
    given = straight.passed(record, columns, numbers, seed=2, sensitivity=0.3)
    return nominal, record, given


@pytest.fixture
def trial(made):
    return straight.trial(*made)


def gaussian(trial, point, noise, included=(), families=(), size=1.0, parts=None):
    """[N, C] columns, prior mean and covariance of them, e and its covariance, all dense: usual
    numbers, then each part's own, then the included causes', then weights of a family's change."""
    ref = trial.reference
    columns, count = ref.columns, len(ref.pull)
    covariance_of_usual = np.linalg.inv(ref.information)
    mean = covariance_of_usual @ ref.pull
    parts = trial.parts if parts is None else parts
    e, nominal, extra, change, blocks = [], [], [], [], []
    cut, linear = point.linear.cut, point.linear
    observed = ref.misfit.accelerations(cut, trial.grid)
    unseen = trial.unseen.accelerations(cut, trial.grid)
    for s, (error, j, z, c) in enumerate(straight.dense(linear, PROCESS_NOISE.times(noise))):
        unit = columns.unit[: j.shape[1]]
        both = np.concatenate((j * unit, z @ observed[s]), 1)
        every = np.concatenate((both, z @ unseen[s]), 1)
        e.append(error)
        nominal.append(both)
        extra.append(both[:, [i for n in included for i in columns.of[n]]])
        change.append(every[:, [i for n in families for i in trial.families[n]]])
        blocks.append(c)
    whole_e, j = np.concatenate(e), np.concatenate(nominal)
    rows = len(e[0])
    covariance = np.zeros((len(whole_e),) * 2)
    for s, c in enumerate(blocks):
        covariance[s * rows : (s + 1) * rows, s * rows : (s + 1) * rows] = c
    deviation = trial.campaign.effects.deviation
    for part in parts:
        inside = np.concatenate([np.arange(s * rows, (s + 1) * rows) for s in part])
        covariance[np.ix_(inside, inside)] += (j[inside] * deviation**2) @ j[inside].T
    x, d = np.concatenate(extra), np.concatenate(change)
    stood = [-np.asarray(point.numbers.get(n, np.zeros(len(columns.of[n]))))
             / columns.unit[columns.of[n]] for n in included]  # fmt: skip
    before = np.concatenate([*stood, np.zeros(0)])
    return (
        whole_e, j, x, d, covariance, mean, covariance_of_usual, before, size, count,
    )  # fmt: skip


def nats(trial, point, noise, included=(), families=(), size=1.0) -> float:
    """log of a power of the likelihood, times the prior, integrated: a Gaussian whose covariance
    is 1/share as large. Constants that no hypothesis changes are left out."""
    e, j, x, d, c, mean, nominal, before, size, _ = gaussian(
        trial, point, noise, included, families, size
    )
    share = trial.reference.counts
    whole = c / share + j @ nominal @ j.T + x @ x.T + size**2 * d @ d.T
    return float(multivariate_normal(j @ mean + x @ before, whole).logpdf(e))


def level(trial, point, noise, included=(), kind=NOMINAL, size=1.0):
    return evidence.level(trial, point, noise, included, Remainder(kind, size))


def of_noise(trial, noise, beside=Remainder()):  # noqa: B008
    return remainder.noise_prior(noise, trial.nominal_spread, beside)


HYPOTHESES = (
    ((), NOMINAL, 1.0), (("drag",), NOMINAL, 1.0), (("load", "two"), NOMINAL, 1.0),
    ((), "motion", 3.0), (("drag",), "position", 3.0), (("two",), "time", 1.0),
)  # fmt: skip


@pytest.mark.parametrize("noise", (1.0, 2.0))
def test_hypotheses_differ_as_dense_gaussians_do(trial, noise):
    """Log marginal likelihoods of 8 segments of 90 observations, nothing subtracted but that of
    nothing; every part has numbers of its own."""
    point = trial.at({})
    nothing, nominal = level(trial, point, noise), nats(trial, point, noise)
    differences = []
    for included, kind, size in HYPOTHESES[1:]:
        found = level(trial, point, noise, included, kind, size).value - nothing.value
        found -= of_noise(trial, noise, Remainder(kind)) - of_noise(trial, noise)
        families = () if kind == NOMINAL else (kind,)
        wanted = nats(trial, point, noise, included, families, size) - nominal
        assert found == pytest.approx(wanted, abs=1e-5 * abs(nominal) / 100.0)
        differences.append(found)
    if noise == 1.0:
        assert differences[0] > 5.0 > differences[1]  # the hidden one, and another


def test_a_hypothesis_that_was_linearised_elsewhere_has_the_same_evidence(trial):
    """All is linear: numbers that the path stands at already are counted from there, with a prior
    about nothing."""
    here, there = trial.at({}), trial.at({"drag": np.array([0.7])})
    one = level(trial, here, 1.0, ("drag",))
    other = level(trial, there, 1.0, ("drag",))
    assert other.value == pytest.approx(one.value, abs=1e-6)
    wanted = nats(trial, there, 1.0, ("drag",)) - nats(trial, here, 1.0)
    assert other.value - level(trial, here, 1.0).value == pytest.approx(wanted, abs=1e-4)
    moved, _ = evidence.numbers_of(trial, other, there, ("drag",))
    stood, _ = evidence.numbers_of(trial, one, here, ("drag",))
    assert moved["drag"] == pytest.approx(stood["drag"], rel=1e-6)


def test_numbers_are_the_dense_posteriors(trial):
    """Mean and covariance of drag and of both numbers of `two`, by conditioning."""
    point, included = trial.at({}), ("two", "drag")
    found, covariance = evidence.numbers_of(
        trial, level(trial, point, 1.0, included), point, included
    )
    e, j, x, _, c, mean, nominal, _, _, _ = gaussian(trial, point, 1.0, included)
    whole = c / SHARE + j @ nominal @ j.T + x @ x.T
    gain = np.linalg.solve(whole, x).T
    unit = trial.reference.columns.unit
    unit = np.concatenate([unit[trial.reference.columns.of[n]] for n in included])
    assert np.concatenate(list(found.values())) == pytest.approx(
        unit * (gain @ (e - j @ mean)), rel=1e-5
    )
    wanted = (np.eye(3) - gain @ x) * np.outer(unit, unit)
    assert covariance == pytest.approx(wanted, rel=1e-5, abs=1e-12)
    assert found["drag"][0] == pytest.approx(DRAG, abs=4.0 * math.sqrt(covariance[2, 2]))


def test_a_fixed_cause_stays_where_it_is(made):
    """As an extended model has it: no prior of its own pulls it back, and no data move it."""
    trial = straight.trial(*made, ("drag",))
    stands = {"drag": np.array([0.7])}
    point = trial.at(stands)
    found, covariance = evidence.numbers_of(
        trial, level(trial, point, 1.0, ("drag",)), point, ("drag",)
    )
    assert found["drag"] == pytest.approx([0.7], abs=1e-5)
    assert covariance[0, 0] < 2.0 / HELD_INFORMATION
    nothing = level(trial, point, 1.0).value
    assert level(trial, point, 1.0, ("drag",)).value == pytest.approx(nothing, abs=1e-3)


# --- changes


@pytest.mark.parametrize("family", ("motion", "position", "heading", "time"))
@pytest.mark.parametrize("included", ((), ("drag",)))
def test_a_change_of_a_family_brings_the_difference_of_two_evidences(trial, family, included):
    point = trial.at({})
    base = level(trial, point, 1.4, included)
    gained, size = fits.changed(trial, point, base, included, family, Remainder())
    each = [level(trial, point, 1.4, included, family, s).value for s in remainder.CHANGE_SIZES]
    assert gained == pytest.approx(max(each) - base.value, abs=1e-6)
    assert size == remainder.CHANGE_SIZES[int(np.argmax(each))]
    with_it = nats(trial, point, 1.4, included, (family,), size)
    assert gained == pytest.approx(with_it - nats(trial, point, 1.4, included), abs=1e-3)


def test_a_change_that_is_there_is_found_at_its_size(made):
    """A push that depends on the place, three times the process noise, in the trial alone."""
    nominal, record, _ = made
    plain = straight.trial(*made)
    family = next(f for f in plain.unseen.families if f.name == "position")
    rng = np.random.default_rng(5)
    weights = np.zeros(plain.unseen.count)
    first = plain.unseen.families[0].columns[0]
    weights[family.columns - first] = 9.0 * rng.standard_normal(len(family.columns))
    accelerations = plain.unseen.accelerations(plain.at({}).linear.cut, plain.grid) @ weights
    columns = straight.columns_of(CAUSES)
    given = straight.passed(record, columns, seed=2, sensitivity=0.3, accelerations=accelerations)
    trial = straight.trial(nominal, record, given)
    point = trial.at({})
    base = level(trial, point, 1.0)
    gained = {
        name: fits.changed(trial, point, base, (), name, Remainder()) for name in trial.families
    }
    best = max(gained, key=lambda name: gained[name][0])
    assert best == "position"
    assert gained[best][0] > 50.0
    assert gained[best][1] == 9.0


def test_a_change_acts_on_the_channels_that_it_pushes(made):
    nominal, record, _ = made
    plain = straight.trial(*made)
    family = next(f for f in plain.unseen.families if f.name == "time")
    weights = np.zeros(plain.unseen.count)
    at = (family.columns - plain.unseen.families[0].columns[0])[3 * EVEN["time"] :]
    each = len(at) // 3  # channel by channel: sway's are in the middle
    weights[at[each : 2 * each]] = 20.0
    accelerations = plain.unseen.accelerations(plain.at({}).linear.cut, plain.grid) @ weights
    given = straight.passed(
        record, straight.columns_of(CAUSES), seed=2, sensitivity=0.3, accelerations=accelerations
    )
    trial = straight.trial(nominal, record, given)
    point = trial.at({})
    base, _ = evidence.scan(trial, point, (), (), 1.0)
    assert fits.acts_on(trial, Fit(point, base, Remainder(RAISED)), "time") == ("sway",)


@pytest.mark.parametrize(
    ("own", "low", "high"), [(0.0, 0.98, 1.0), (0.045, 0.3, 0.7), (1.0, 0.0, 0.01)]
)
def test_what_a_family_does_as_well_is_the_share_that_lies_in_its_columns(made, own, low, high):
    """A cause that pushes as a function of time does, and so much besides as nothing else does.
    What is not pushed at the knots, where process noise pushes too, is felt far more."""
    nominal, record, given = made
    plain = straight.trial(*made)
    family = next(f for f in plain.unseen.families if f.name == "time")
    at = family.columns - plain.unseen.families[0].columns[0]
    accelerations = plain.unseen.accelerations(given.cut, plain.grid)[..., at[3 * EVEN["time"]]]
    does = np.einsum("sbcz,sz->sbc", given.z[..., 6:], accelerations)
    weight = does.std((0, 1)) + 1e-12
    rest = np.random.default_rng(11).standard_normal(does.shape) * weight
    j, columns = given.j.copy(), straight.columns_of(CAUSES)
    j[..., columns.of["drag"][0]] = 30.0 * (does + own * rest)
    trial = straight.trial(nominal, record, replace(given, j=j))
    point = trial.at({})
    base, _ = evidence.scan(trial, point, (), ("drag",), 1.0)
    base.numbers["drag"] = np.ones(1)
    share = fits.imitated(trial, Fit(point, base, Remainder("time", 1e4)), "drag")
    assert low <= share <= high
    assert fits.imitated(trial, Fit(point, base, Remainder(RAISED)), "drag") == 0.0


# --- levels of process noise


def test_what_is_expected_of_the_process_noise_is_a_log_density_ratio(trial):
    nominal = max(trial.campaign.noise, remainder.LEAST_SPREAD)
    top = norm(0.0, nominal).logpdf(0.0)
    for noise in (0.5, 1.0, 1.3, 4.0):
        at = math.log(noise)
        wanted = norm(0.0, nominal).logpdf(at) - top
        for beside in (Remainder(), Remainder("wind", 3.0)):
            assert of_noise(trial, noise, beside) == pytest.approx(wanted)
        wanted = norm(0.0, remainder.RAISED_SPREAD).logpdf(at) - top
        for beside in (Remainder(RAISED), Remainder(INTERMITTENT), Remainder("wind", 3.0, True)):
            assert of_noise(trial, noise, beside) == pytest.approx(wanted)


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
    point = trial.at({})
    found, wanted = [], []
    for noise in (1.0, 1.4):
        one = level(trial, point, noise)
        found.append(one.value - of_noise(trial, noise))
        e, j, _, _, c, mean, usual_covariance, *_ = gaussian_of(trial, point, noise, sure)
        # of a power of the likelihood log|C| counts for its share, log|C + share·JUJᵀ| whole
        whole = c / SHARE + j @ usual_covariance @ j.T
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
    kernel = np.linalg.cholesky(PROCESS_NOISE.kernel(plain.grid.knots))
    more = math.sqrt(3.0) * rng.standard_normal((8, 3 * plain.grid.knots)) @ kernel.T
    given = straight.passed(
        record, straight.columns_of(CAUSES), seed=2, sensitivity=0.3, accelerations=more
    )
    trial = straight.trial(nominal, record, given)
    raised = Remainder(RAISED)
    levels = evidence.levels(trial, trial.at({}), remainder=raised)
    best = max(levels, key=lambda one: one.value)
    assert best.noise_factor == pytest.approx(2.0, rel=0.12)
    again = evidence.levels(trial, trial.at({}), (), best.noise_factor, raised)
    near = max(again, key=lambda one: one.value)
    assert near.noise_factor == pytest.approx(best.noise_factor, rel=0.02)


# --- segments


def test_segments_left_out_say_nothing(made):
    """Numbers without some segments are those of a trial in which these show something else."""
    nominal, record, given = made
    out = np.zeros(8, dtype=bool)
    out[4:] = True
    spoilt = replace(given, e=np.where(out[:, None, None], 50.0 * given.e + 1.0, given.e))
    found = []
    for one in (given, spoilt):
        trial = straight.trial(nominal, record, one)
        point = trial.at({})
        fit = Fit(point, evidence.fit(trial, point, ("drag", "two"), 1.0, Remainder()), Remainder())
        found.append(fits.without(trial, fit, out))
    (numbers, coefficients), (again, others) = found
    for label in ("drag", "two"):
        assert again[label] == pytest.approx(numbers[label], rel=1e-9)
    assert others == pytest.approx(coefficients, rel=1e-9)
    trial = straight.trial(nominal, record, spoilt)
    whole = fits.without(trial, fit, np.zeros(8, dtype=bool))[0]
    assert whole["drag"] != pytest.approx(numbers["drag"], rel=0.1)


def test_a_few_segments_do_not_decide(made):
    """One of eight shows what no ship does: it counts for little, the others as they did."""
    nominal, record, given = made
    spoilt = given.e.copy()
    spoilt[3] += 40.0 * straight.NOISE * np.random.default_rng(1).standard_normal((15, 6))
    trial = straight.trial(nominal, record, replace(given, e=spoilt))
    weight = evidence.robust(trial, trial.at({}))
    assert weight[3] < 0.05
    assert (np.delete(weight, 3) > 0.9).all()


def test_the_distance_of_a_segment_is_the_dense_one(made, monkeypatch):
    """The residual of each segment in units of its covariance: weights are by its median."""
    nominal, record, given = made
    trial = straight.trial(nominal, record, given)
    point = trial.at({})
    best = max(evidence.levels(trial, point), key=lambda one: one.value)
    left = best.solution[: len(trial.reference.pull)]
    ref, chi2 = trial.reference, []
    observed = ref.misfit.accelerations(given.cut, trial.grid)
    for s, (e, j, z, c) in enumerate(straight.dense(given, PROCESS_NOISE.times(best.noise_factor))):
        both = np.concatenate((j * ref.columns.unit[: j.shape[1]], z @ observed[s]), 1)
        r = e - both @ left
        chi2.append(r @ np.linalg.solve(c, r))
    wanted = np.minimum(1.0, 1.5 * np.median(chi2) / np.array(chi2))
    monkeypatch.setattr(campaign_parts, "ROBUST", 1.5)
    assert evidence.robust(trial, point) == pytest.approx(wanted, rel=1e-5)


def test_products_of_a_point_that_is_gone_are_not_taken_for_anothers(trial):
    """Points come and go while a fit converges, and one may stand where another stood in memory."""
    first, there, last = (trial.at({"drag": np.array([size])}) for size in (0.1, 0.5, 0.7))
    here = trial.at({"drag": np.array([0.0])})
    products = straight.trial(trial.campaign, trial.record, trial.given).products

    def total(point):
        return products.total(point, 1.0, trial.weight, Remainder())[0]

    assert total(first) is total(first)  # worked out once
    apart, wanted = total(here)[0, 0], total(there)
    assert abs(apart / wanted[0, 0] - 1.0) > 1e-3
    total(last)  # of points passes are kept, too: the first one's and two more
    stood, again = id(here.weighed), there.weighed
    del here
    gc.collect()
    others = []
    for _ in range(20000):
        others.append(replace(again))
        if id(others[-1]) == stood:
            break
    assert total(replace(there, weighed=others[-1])) == pytest.approx(wanted)


def test_segments_on_which_the_model_runs_away_carry_no_weight(made):
    """At the start they are left out; later it is the hypothesis that fails."""
    lost = np.zeros(8, dtype=bool)
    lost[2] = True
    nominal, record, given = made
    away = replace(given, lost=lost)
    trial, point = evidence.begin(straight.Straight.of(nominal, record, given=away), {})
    assert (trial.weight > 0.0).tolist() == (~lost).tolist()
    assert trial.begun and point.linear.lost.tolist() == lost.tolist()
    trial.at({"drag": np.array([0.1])})  # the same one again is no failure
    worse = replace(away, lost=lost | (np.arange(8) == 5))
    with pytest.raises(np.linalg.LinAlgError, match="diverges"):
        replace(trial, given=worse).at({"drag": np.array([9.0])})
    assert trial.weight[5] > 0.0


def test_what_is_left_out_is_left_out_of_a_trial_of_its_own(trial):
    out = np.arange(8) == 3
    less = trial.leaving_out(out)
    assert less.weight.tolist() == (~out).astype(float).tolist()
    assert trial.weight.tolist() == [1.0] * 8
    assert less.first is trial.first and less.products is trial.products
