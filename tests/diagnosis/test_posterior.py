"""Sums of probabilities over hypotheses that are made by hand."""

from dataclasses import replace

import numpy as np
import pytest
import weighed

from shiplog.diagnosis import thresholds
from shiplog.diagnosis.hypotheses.hypothesis import name_of
from shiplog.diagnosis.hypotheses.unrecorded_thruster import SideForce
from shiplog.diagnosis.noise.remainder import INTERMITTENT, NOMINAL, RAISED
from shiplog.diagnosis.verdict import posterior as posteriors
from shiplog.diagnosis.verdict.posterior import best_with, posterior, share_of_causes
from shiplog.models import causes
from shiplog.models.causes import Setting
from shiplog.ship_profile import file as profiles

DRAG, LOAD = ("drag",), ("load",)
WIND, GNSS = ("clock:wind",), ("clock:gnss",)
MIXED = {
    ((), NOMINAL): 0.05, (DRAG, NOMINAL): 0.4, (DRAG, RAISED): 0.1, (LOAD, NOMINAL): 0.05,
    (("drag", "load"), NOMINAL): 0.2, (WIND, NOMINAL): 0.08, (GNSS, "position"): 0.07,
    (("clock:gnss", "clock:wind"), NOMINAL): 0.03, ((), INTERMITTENT): 0.02,
}  # fmt: skip


@pytest.fixture(scope="module")
def trial():
    return weighed.trial()


def test_probabilities_are_sums_by_name_and_by_kind(trial):
    found = posterior(weighed.search(trial, MIXED))
    assert found.probability.sum() == pytest.approx(1.0)
    assert (np.diff(found.probability) <= 0.0).all()
    assert found.names == pytest.approx({"drag": 0.7, "load": 0.25, "clock": 0.18})
    assert list(found.names) == ["drag", "load", "clock"]
    assert found.labels == pytest.approx(
        {"drag": 0.7, "load": 0.25, "clock:wind": 0.11, "clock:gnss": 0.10}
    )
    assert found.kinds == pytest.approx(
        {NOMINAL: 0.81, RAISED: 0.1, "position": 0.07, INTERMITTENT: 0.02}
    )
    assert found.none == pytest.approx(0.05)
    ranking = found.ranking()
    assert ranking == pytest.approx({
        "drag": 0.7, "load": 0.25, "clock": 0.18, "unknown:stochastic": 0.1,
        "unknown:position": 0.07, "none": 0.05, "unknown:intermittent": 0.02,
    })  # fmt: skip
    assert list(ranking.values()) == sorted(ranking.values(), reverse=True)


def test_a_factor_of_all_scores_changes_nothing(trial):
    """Scores are known up to a constant, and thousands of nats below nothing."""
    made = weighed.search(trial, {key: 1e-300 * p for key, p in MIXED.items()})
    assert posterior(made).names == pytest.approx(
        posterior(weighed.search(trial, MIXED)).names, rel=1e-6
    )


def test_what_is_below_practical_size_is_no_change(trial):
    """`drag` at 0.09 of 0.1; together with `load`, which is large, only that is there."""
    made = weighed.search(trial, MIXED, sizes={"drag": 0.09}, spread=0.001)
    found = posterior(made)
    assert found.names == pytest.approx({"load": 0.25, "clock": 0.18})
    assert found.none == pytest.approx(0.45)  # its hypotheses with a remainder are not nothing
    both = posteriors.practical(made.table, made.table.found[("drag", "load"), NOMINAL])
    assert both == {"drag": 0.0, "load": 1.0}
    larger = weighed.search(trial, MIXED, sizes={"drag": -0.11}, spread=0.001)
    assert posterior(larger).none == pytest.approx(0.05)


def test_a_name_is_as_probable_as_a_practical_size_is(trial):
    """`drag` there for sure: 0.12 with a spread of 0.02 is beyond 0.1 in 84 of 100 draws, and below
    that there is no change."""
    made = weighed.search(trial, {(DRAG, NOMINAL): 1.0}, sizes={"drag": 0.12}, spread=0.02)
    found = posterior(made)
    assert found.names["drag"] == pytest.approx(0.841, abs=0.03)
    assert found.none == pytest.approx(1.0 - found.names["drag"])
    assert found.stated == ()


@pytest.mark.parametrize("raised", (1.49, 1.51))
def test_noise_as_on_an_ordinary_day_is_no_change(trial, raised):
    """A quarter more wind: no unknown remains, with a cause or without one."""
    made = weighed.search(trial, {((), RAISED): 0.6, (DRAG, RAISED): 0.4}, raised=raised)
    found = posterior(made)
    assert found.none == pytest.approx(0.6 if raised < 1.5 else 0.0)
    assert found.kinds.get(RAISED, 0.0) == pytest.approx(0.0 if raised < 1.5 else 1.0)
    assert found.names["drag"] == pytest.approx(0.4)


@pytest.mark.parametrize(
    ("raised", "device", "counts"),
    [(1.49, 0.0, False), (1.51, 0.0, True), (1.49, 0.5, True), (1.49, 1.0, True)],
)
def test_a_force_at_one_place_as_on_an_ordinary_day_is_no_change(trial, raised, device, counts):
    """Gusts act at one place. Not where its pattern may be a device's, be that ever so weak."""
    force = SideForce(0.0, 60.0, 0.3, 4.0, np.array([0.0, 0.01, 0.004]), device)
    kinds = {((), INTERMITTENT): 0.6, (DRAG, INTERMITTENT): 0.4}
    found = posterior(weighed.search(trial, kinds, side_force=force, raised=raised))
    assert found.none == pytest.approx(0.0 if counts else 0.6)
    assert found.kinds.get(INTERMITTENT, 0.0) == pytest.approx(float(counts))
    assert found.names["drag"] == pytest.approx(0.4)


def test_one_of_two_stated_names_is_not_enough(trial):
    """A or B: together sure, each by itself not."""
    found = posterior(weighed.search(trial, {(DRAG, NOMINAL): 0.55, (LOAD, NOMINAL): 0.45}))
    assert found.stated == ()
    assert sum(found.names.values()) == pytest.approx(1.0)
    assert found.none < 1e-6


@pytest.mark.parametrize(("more", "stated"), ((-0.001, False), (0.001, True)))
def test_a_name_is_stated_from_a_probability_on(trial, more, stated):
    p = thresholds.STATED + more
    found = posterior(weighed.search(trial, {(DRAG, NOMINAL): p, (LOAD, RAISED): 1.0 - p}))
    assert (found.stated == DRAG) is stated
    found = posterior(weighed.search(trial, {(DRAG, RAISED): p, (LOAD, NOMINAL): 1.0 - p}))
    assert (found.remainder == RAISED) is stated
    # the nominal misfit is no remainder that anybody asks for
    assert posterior(weighed.search(trial, {(DRAG, NOMINAL): 1.0})).remainder is None


def test_refuted_names_go_and_the_rest_is_sure_again(trial):
    """Every hypothesis with it, whatever else is in it; the others' ratios stay."""

    def without(*names):
        made = weighed.search(trial, MIXED)
        made.table.banned |= {frozenset((name,)) for name in names}
        return posterior(made)

    found = without("drag")
    whole = 0.05 + 0.05 + 0.08 + 0.07 + 0.03 + 0.02
    assert found.probability.sum() == pytest.approx(1.0)
    assert found.names == pytest.approx({"load": 0.05 / whole, "clock": 0.18 / whole})
    assert found.none == pytest.approx(0.05 / whole)
    # of a name with several labels all of them
    assert set(without("clock").names) == {"drag", "load"}
    assert set(without("drag", "load", "clock").names) == set()
    assert without("drag", "load", "clock").none == pytest.approx(5.0 / 7.0)


def test_the_likeliest_hypothesis_with_some_names(trial):
    found = posterior(weighed.search(trial, MIXED))
    assert best_with(found, ()).causes == DRAG
    assert best_with(found, ("load",)).causes == ("drag", "load")
    assert best_with(found, ("load", "drag")).causes == ("drag", "load")
    assert best_with(found, ("clock",)).causes == WIND
    assert best_with(found, ("clock", "load")) is found.hypotheses[0]  # none has both


def test_a_stated_name_is_reported_in_its_likeliest_kind(trial):
    """The wind's clock has the likeliest hypothesis, GNSS's the larger sum."""
    found = posterior(weighed.search(
        trial, {(WIND, NOMINAL): 0.36, (GNSS, NOMINAL): 0.32, (GNSS, RAISED): 0.32}
    ))  # fmt: skip
    assert found.stated == ("clock",)
    assert found.states("clock:gnss") and not found.states("clock:wind")
    assert best_with(found, ("clock",)).causes == GNSS


def test_share_of_what_is_explained_by_causes(trial):
    """Of 50 nats with a change of position 4 are the cause's with nominal noise. With raised noise
    it has 10, of which the noise has 6 by itself: 4 of 44."""
    both = weighed.search(
        trial,
        {(DRAG, "position"): 0.9, (DRAG, NOMINAL): 0.04, (DRAG, RAISED): 0.04, ((), RAISED): 0.02},
        evidence={
            (DRAG, "position"): 50.0, (DRAG, NOMINAL): 4.0, (DRAG, RAISED): 10.0, ((), RAISED): 6.0,
        },
    )  # fmt: skip
    of = both.table.found
    assert share_of_causes(both.table, of[DRAG, "position"], DRAG) == pytest.approx(4.0 / 44.0)
    assert share_of_causes(both.table, of[DRAG, RAISED], DRAG) == pytest.approx(1.0)
    assert share_of_causes(both.table, of[(), NOMINAL], ()) == 1.0  # nothing is explained
    assert share_of_causes(both.table, of[DRAG, "position"], LOAD) == 0.0  # never weighed alone
    del of[DRAG, NOMINAL], of[DRAG, RAISED]
    assert share_of_causes(both.table, of[DRAG, "position"], DRAG) == 0.0


def test_a_causes_label_begins_with_its_name():
    """What is refuted is dropped by name: a label of another name would be refuted for ever."""
    for ship in ("esso-vectwin", "milliampere", "blueboat"):
        of = Setting(
            profiles.load(ship), {"speed": 0.5, "length": 3.0, "mass": 245.0}, np.zeros((1, 2)), 1.0
        )
        for cause in causes.CATALOGUE:
            for one in cause.each(of):
                assert name_of(one.label) == one.name == cause.name


@pytest.mark.parametrize(
    ("noise", "spread", "kind"),
    [(1.4, 0.1, NOMINAL), (1.6, 0.1, RAISED), (3.0, 0.6, NOMINAL), (3.5, 0.6, RAISED)],
)
def test_noise_that_no_ordinary_day_has_is_raised_under_whatever_prior(trial, noise, spread, kind):
    """A half more, or two standard deviations from voyage to voyage: e^1.2 is 3.3."""
    campaign = replace(trial.campaign, noise=spread)
    made = weighed.search(replace(trial, campaign=campaign), {(DRAG, NOMINAL): 1.0})
    one = made.table.found[DRAG, NOMINAL]
    made.table.found[DRAG, NOMINAL] = replace(
        one, estimate=replace(one.estimate, noise_factor=noise)
    )
    assert posterior(made).kinds[kind] == pytest.approx(1.0)
    made = weighed.search(replace(trial, campaign=campaign), {(DRAG, RAISED): 1.0}, raised=noise)
    assert posterior(made).kinds[kind] == pytest.approx(1.0)
