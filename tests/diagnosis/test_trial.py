"""What a trial says of a hypothesis, against dense Gaussians of all its numbers."""

import gc
import math
from dataclasses import replace

import numpy as np
import pytest
import straight
from dense_trial import DRAG, SHARE, gaussian, level, nats, of_noise
from straight import PROCESS_NOISE

from shiplog.diagnosis.hypotheses import as_it_stands, evidence, fits
from shiplog.diagnosis.linear.parameter_layout import HELD_INFORMATION
from shiplog.diagnosis.noise import bounds, campaign_parts
from shiplog.diagnosis.noise.remainder import NOMINAL, Remainder
from shiplog.diagnosis.trial.fitted import Fit

HYPOTHESES = (
    ((), NOMINAL, 1.0), (("drag",), NOMINAL, 1.0), (("load", "two"), NOMINAL, 1.0),
    ((), "motion", 3.0), (("drag",), "position", 3.0), (("two",), "time", 1.0),
)  # fmt: skip


@pytest.mark.parametrize("noise", (1.0, 2.0))
def test_hypotheses_differ_as_dense_gaussians_do(trial, noise):
    """Log marginal likelihoods of 8 segments of 90 observations, nothing subtracted but that of
    nothing; every part has numbers of its own."""
    point = trial.linearise({})
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
    here, there = trial.linearise({}), trial.linearise({"drag": np.array([0.7])})
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
    point, included = trial.linearise({}), ("two", "drag")
    found, covariance = evidence.numbers_of(
        trial, level(trial, point, 1.0, included), point, included
    )
    e, j, x, _, c, mean, nominal, _, _, _ = gaussian(trial, point, 1.0, included)
    whole = c / SHARE + j @ nominal @ j.T + x @ x.T
    gain = np.linalg.solve(whole, x).T
    unit = trial.reference.columns.unit
    unit = np.concatenate([unit[trial.reference.columns.indices[n]] for n in included])
    assert np.concatenate(list(found.values())) == pytest.approx(
        unit * (gain @ (e - j @ mean)), rel=1e-5
    )
    wanted = (np.eye(3) - gain @ x) * np.outer(unit, unit)
    assert covariance == pytest.approx(wanted, rel=1e-5, abs=1e-12)
    assert found["drag"][0] == pytest.approx(DRAG, abs=4.0 * math.sqrt(covariance[2, 2]))


@pytest.mark.parametrize(("count", "sizes"), [(3, [3]), (7, [7]), (12, [6, 6]), (24, [12, 12])])
def test_parts_are_as_long_as_those_whose_differences_are_known(count, sizes):
    """The nominal parts have ten segments. Twelve in a voyage are one part, as six are; two
    voyages never share one."""
    columns = straight.columns_of(straight.CAUSES)
    record = straight.sailed(40)
    given = straight.passed(record, columns, np.zeros(len(columns.unit)))
    made = straight.campaign(record, given, columns, parts=4)
    later = straight.sailed(count, voyages=min(count // 6, 2) or 1, seed=1)
    found = straight.Straight.build(made, later)
    assert [len(part) for part in found.parts] == sizes


def test_a_fixed_cause_stays_where_it_is(made):
    """As an extended model has it: no prior of its own pulls it back, and no data move it."""
    trial = straight.trial(*made, ("drag",))
    stands = {"drag": np.array([0.7])}
    point = trial.linearise(stands)
    found, covariance = evidence.numbers_of(
        trial, level(trial, point, 1.0, ("drag",)), point, ("drag",)
    )
    assert found["drag"] == pytest.approx([0.7], abs=1e-5)
    assert covariance[0, 0] < 2.0 / HELD_INFORMATION
    nothing = level(trial, point, 1.0).value
    assert level(trial, point, 1.0, ("drag",)).value == pytest.approx(nothing, abs=1e-3)


def test_segments_left_out_say_nothing(made):
    """Numbers without some segments are those of a trial in which these show something else."""
    nominal, record, given = made
    out = np.zeros(8, dtype=bool)
    out[4:] = True
    spoilt = replace(given, e=np.where(out[:, None, None], 50.0 * given.e + 1.0, given.e))
    found = []
    for one in (given, spoilt):
        trial = straight.trial(nominal, record, one)
        point = trial.linearise({})
        fit = Fit(point, evidence.fit(trial, point, ("drag", "two"), 1.0, Remainder()), Remainder())
        found.append(fits.refitted(trial, fit, out))
    (numbers, coefficients), (again, others) = found
    for label in ("drag", "two"):
        assert again[label] == pytest.approx(numbers[label], rel=1e-9)
    assert others == pytest.approx(coefficients, rel=1e-9)
    trial = straight.trial(nominal, record, spoilt)
    whole = fits.refitted(trial, fit, np.zeros(8, dtype=bool))[0]
    assert whole["drag"] != pytest.approx(numbers["drag"], rel=0.1)


def test_a_few_segments_do_not_decide(made):
    """One of eight shows what no ship does: it counts for little, the others as they did."""
    nominal, record, given = made
    spoilt = given.e.copy()
    spoilt[3] += 40.0 * straight.NOISE * np.random.default_rng(1).standard_normal((15, 6))
    trial = straight.trial(nominal, record, replace(given, e=spoilt))
    weight = as_it_stands.robust(trial, trial.linearise({}))
    assert weight[3] < 0.05
    assert (np.delete(weight, 3) > 0.9).all()


def test_the_distance_of_a_segment_is_the_dense_one(made, monkeypatch):
    """The residual of each segment in units of its covariance: weights are by its median."""
    nominal, record, given = made
    trial = straight.trial(nominal, record, given)
    point = trial.linearise({})
    best = max(evidence.levels(trial, point), key=lambda one: one.value)
    left = best.mean[: len(trial.reference.pull)]
    ref, chi2 = trial.reference, []
    observed = ref.misfit.accelerations(given.cut, trial.grid)
    for s, (e, j, z, c) in enumerate(straight.dense(given, PROCESS_NOISE.times(best.noise_factor))):
        both = np.concatenate((j * ref.columns.unit[: j.shape[1]], z @ observed[s]), 1)
        r = e - both @ left
        chi2.append(r @ np.linalg.solve(c, r))
    wanted = np.minimum(1.0, 1.5 * np.median(chi2) / np.array(chi2))
    monkeypatch.setattr(campaign_parts, "ROBUST", 1.5)
    assert as_it_stands.robust(trial, point) == pytest.approx(wanted, rel=1e-5)


def test_products_of_a_point_that_is_gone_are_not_taken_for_anothers(trial):
    """Points come and go while a fit converges, and one may stand where another stood in memory."""
    first, there, last = (trial.linearise({"drag": np.array([size])}) for size in (0.1, 0.5, 0.7))
    here = trial.linearise({"drag": np.array([0.0])})
    products = straight.trial(trial.campaign, trial.record, trial.given).products

    def total(point):
        return products.total(point, 1.0, trial.weight, Remainder()).G

    assert total(first) is total(first)  # worked out once
    apart, wanted = total(here)[0, 0], total(there)
    assert abs(apart / wanted[0, 0] - 1.0) > 1e-3
    total(last)  # of points passes are kept, too: the first one's and two more
    stood, again = id(here.path), there.path
    del here
    gc.collect()
    others = []
    for _ in range(20000):
        others.append(replace(again))
        if id(others[-1]) == stood:
            break
    assert total(replace(there, path=others[-1])) == pytest.approx(wanted)


def test_a_point_that_is_linearised_again_has_the_products_that_it_had(trial):
    """Its linearisation may be gone in between: it is known by its path."""
    numbers = {"drag": np.array([0.3])}
    point = trial.linearise(numbers)
    before, path = trial.products.total(point, 1.0, trial.weight, Remainder()), point.path
    point = None
    gc.collect()
    again = trial.linearise_about(numbers, path)
    assert trial.products.total(again, 1.0, trial.weight, Remainder()) is before
    elsewhere = trial.linearise_about({"drag": np.array([0.4])}, replace(path))
    assert trial.products.total(elsewhere, 1.0, trial.weight, Remainder()) is not before


def test_segments_on_which_the_model_runs_away_carry_no_weight(made):
    """At the start they are left out; later it is the hypothesis that fails."""
    lost = np.zeros(8, dtype=bool)
    lost[2] = True
    nominal, record, given = made
    away = replace(given, lost=lost)
    trial, point = as_it_stands.begin(straight.Straight.build(nominal, record, given=away), {})
    assert (trial.weight > 0.0).tolist() == (~lost).tolist()
    assert trial.begun and point.linear.lost.tolist() == lost.tolist()
    trial.linearise({"drag": np.array([0.1])})  # the same one again is no failure
    worse = replace(away, lost=lost | (np.arange(8) == 5))
    with pytest.raises(np.linalg.LinAlgError, match="diverges"):
        replace(trial, given=worse).linearise({"drag": np.array([9.0])})
    assert trial.weight[5] > 0.0


def test_a_segment_that_only_raised_noise_keeps_is_left_out_from_the_start(made):
    """With errors of three times what the noise allows the path of nothing follows the measurement.
    That of the right hypothesis does not, and one segment on which it is lost refused them all."""
    nominal, record, given = made
    large = replace(given, e=4.0 * given.e)
    fragile = np.arange(8) == 5

    class Unstable(straight.Straight):
        def linearise(self, numbers, near=None, noise_factor=None, remainder=None):
            at = replace(self.given, lost=fragile) if noise_factor == 1.0 else self.given
            again = replace(self, given=at)
            return straight.Straight.linearise(again, numbers, near, noise_factor, remainder)

    trial, point = as_it_stands.begin(Unstable.build(nominal, record, given=large), {})
    base, _ = evidence.scan(trial, point, (), ())
    assert base.noise_factor > 1.5
    assert (trial.weight > 0.0).tolist() == (~fragile).tolist()
    trial.linearise({"drag": np.array([0.5])}, point, 1.0)  # no longer refused


def test_a_model_that_diverges_on_every_segment_has_no_evidence(made):
    """Of nothing the prior is left, in which no cause is the most probable answer."""
    nominal, record, given = made
    lost = replace(given, lost=np.ones(8, dtype=bool))
    with pytest.raises(np.linalg.LinAlgError, match="every segment"):
        as_it_stands.begin(straight.Straight.build(nominal, record, given=lost), {})


def test_the_model_as_it_stands_is_linearised_until_its_evidence_stays(made):
    """Else a cause gains by a path that converges with it. Each path is ten times as close."""
    nominal, record, given = made
    asked: list[float] = []

    class Closing(straight.Straight):
        def linearise(self, *more):
            asked.append(3.0 * 0.1 ** len(asked))
            off = given.e + asked[-1] * np.sin(np.arange(given.e.size)).reshape(given.e.shape)
            return straight.Straight.linearise(replace(self, given=replace(given, e=off)), *more)

    trial, point = as_it_stands.begin(Closing.build(nominal, record, given=given), {})
    at_end, _ = evidence.scan(trial, point, (), ())
    closest, _ = evidence.scan(trial, straight.Straight.linearise(trial, {}), (), ())
    assert 3 < len(asked) < as_it_stands.MOST_PATHS
    assert at_end.evidence == pytest.approx(closest.evidence, abs=evidence.LITTLE_NATS)


def test_what_is_left_out_is_left_out_of_a_trial_of_its_own(trial):
    out = np.arange(8) == 3
    less = trial.leave_out(out)
    assert less.weight.tolist() == (~out).astype(float).tolist()
    assert trial.weight.tolist() == [1.0] * 8
    assert less.first is trial.first and less.cache is trial.cache


@pytest.mark.parametrize("kind", (NOMINAL, "position"))
@pytest.mark.parametrize("out", ([0, 1, 2, 3], [4, 5, 6, 7], [2], [1, 2, 3, 4], range(8)))
def test_products_without_a_voyage_are_those_of_segments_of_no_weight(trial, kind, out):
    """Of whole voyages, of a part of one, of parts of both, and of all that there is."""
    left_out = np.isin(np.arange(8), out)
    point, remainder, products = trial.linearise({}), Remainder(kind), trial.products
    found = products.leave_out(point, 1.5, trial.weight, remainder, left_out)
    weight = np.where(left_out, 0.0, trial.weight)
    fresh = straight.trial(trial.campaign, trial.record, trial.given).products
    wanted = fresh.total(point, 1.5, weight, remainder).G
    assert found == pytest.approx(wanted, rel=1e-9, abs=1e-9 * np.abs(wanted).max())
    if len(out) < 8:
        assert (
            np.abs(found[0, 0] / products.total(point, 1.5, trial.weight, remainder).G[0, 0] - 1)
            > 0.01
        )


def test_stretches_of_one_segment_have_nothing_between_their_segments(made):
    """Four voyages of 30 s and one row: the pass is that of their own segments."""
    nominal, _, _ = made
    record = straight.sailed(4, voyages=4, seed=5)
    given = straight.passed(record, nominal.reference.columns)
    trial = straight.trial(nominal, record, given)
    assert trial.covering(trial.first) is trial.first.linear


def test_a_moment_is_no_larger_than_its_mass_can_make_it(trial, monkeypatch):
    """A load of 2 kg, 1.5 m from midship at most; other causes stay as they are."""
    monkeypatch.setattr(type(trial), "farthest", lambda _, name: 1.5 if name == "two" else math.inf)
    numbers = {"two": np.array([-2.0, 7.0]), "drag": np.array([9.0])}
    kept = trial.clipped(numbers)
    assert kept["two"].tolist() == [-2.0, 3.0] and kept["drag"].tolist() == [9.0]
    assert numbers["two"].tolist() == [-2.0, 7.0]
    assert trial.clipped({"two": np.array([2.0, 2.0])})["two"].tolist() == [2.0, 2.0]


def test_what_is_beyond_the_ship_costs_evidence_and_is_moved(trial, monkeypatch):
    """Evidence falls by the share of the posterior that is on board, over that of the prior."""
    monkeypatch.setattr(type(trial), "farthest", lambda _, name: math.inf)
    point, included = trial.linearise({}), ("two",)
    free = evidence.level(trial, point, 1.0, included)
    mean, covariance = evidence.numbers_of(trial, free, point, included)
    (first, second), size = mean["two"], trial.reference.columns.unit[
        trial.reference.columns.indices["two"]
    ]  # fmt: skip
    farthest = 0.5 * abs(second / first)
    monkeypatch.setattr(type(trial), "farthest", lambda _, name: farthest)
    bound = evidence.level(trial, point, 1.0, included)
    wanted = bounds.log_share_on_board(np.array([first, second]), covariance, size, farthest)
    assert bound.value - free.value == pytest.approx(wanted)
    moved, _ = evidence.numbers_of(trial, bound, point, included)
    assert abs(moved["two"][1]) == pytest.approx(farthest * abs(moved["two"][0]))


@pytest.mark.parametrize("kind", (NOMINAL, "position"))
def test_the_volume_of_the_first_point_is_that_of_its_products(made, kind):
    """Of the columns that deviate, some do not; asked before its products and after them."""
    nominal, record, given = made
    deviation = nominal.effects.deviation.copy()
    deviation[::3] = 0.0
    effects = replace(nominal.effects, deviation=deviation)
    trial = straight.trial(replace(nominal, effects=effects), record, given)
    weight, remainder = np.linspace(0.3, 1.0, 8), Remainder(kind)
    volume = trial.products.volume(trial.first, 1.5, weight, remainder)
    total = trial.products.total(trial.first, 1.5, weight, remainder)
    assert volume == pytest.approx(total.volume, rel=1e-12)
    after = trial.products.volume(trial.first, 2.0, weight, remainder)
    assert after == pytest.approx(
        trial.products.total(trial.first, 2.0, weight, remainder).volume, rel=1e-12
    )
    assert after - volume > 10.0


def test_what_was_let_go_is_made_again(trial):
    point, weight = trial.linearise({}), np.linspace(0.3, 1.0, 8)
    before = trial.products.total(point, 1.2, weight, Remainder())
    volume = trial.products.volume(trial.first, 1.2, weight, Remainder())
    trial.cache.release()
    assert trial.cache.passes is None and trial.cache.first is None
    trial.cache.totals.clear()
    trial.cache.volumes.clear()
    assert np.array_equal(trial.products.total(point, 1.2, weight, Remainder()).G, before.G)
    assert trial.products.volume(trial.first, 1.2, weight, Remainder()) == volume
