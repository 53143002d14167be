"""Priors of hypotheses are probabilities, and a form's error is worked out by hand."""

import math
from itertools import combinations
from types import SimpleNamespace
from typing import Any

import pytest
from straight import CAUSES, One

from shiplog.diagnosis import thresholds
from shiplog.diagnosis.hypotheses.hypothesis import Priors, form_error, name_of
from shiplog.diagnosis.hypotheses.table import Hypotheses
from shiplog.diagnosis.noise.remainder import INTERMITTENT, NOMINAL, RAISED
from shiplog.models import causes

FAMILIES = ("motion", "wind", "position")
KINDS = (NOMINAL, RAISED, INTERMITTENT, *FAMILIES)


@pytest.mark.parametrize("catalogue", (CAUSES, causes.CATALOGUE, CAUSES[:1]))
def test_priors_of_one_cause_at_most_sum_to_one(catalogue):
    priors = Priors(catalogue, FAMILIES)
    sets = [(), *((cause.label,) for cause in catalogue)]
    whole = sum(math.exp(priors.hypothesis(labels, kind)) for labels in sets for kind in KINDS)
    assert whole == pytest.approx(1.0, rel=1e-12)
    none = sum(math.exp(priors.hypothesis((), kind)) for kind in KINDS)
    assert none == pytest.approx(thresholds.NO_CHANGE, rel=1e-12)
    remains = sum(
        math.exp(priors.hypothesis(labels, k)) for labels in sets for k in KINDS if k != NOMINAL
    )
    assert remains == pytest.approx(thresholds.REMAINDER, rel=1e-12)


def test_kinds_of_remainder_share_what_remains():
    priors = Priors(CAUSES, FAMILIES)
    assert set(priors.kinds) == set(KINDS)
    for kind in KINDS[1:]:
        assert math.exp(priors.kinds[kind]) == pytest.approx(thresholds.REMAINDER / 5)


def test_each_further_cause_is_rarer_by_a_factor_and_by_its_own_prior():
    priors = Priors(CAUSES, FAMILIES)
    for one, other in combinations((c.label for c in CAUSES), 2):
        alone, other_alone = priors.causes((one,)), priors.causes((other,))
        some = math.log(1.0 - thresholds.NO_CHANGE)
        # each pair comes in two orders: of N causes, N²/2 pairs are one in ten together
        wanted = alone + other_alone - some + math.log(2.0 * thresholds.ANOTHER_CAUSE)
        assert priors.causes((one, other)) == pytest.approx(wanted)
        assert priors.causes((one, other)) == pytest.approx(priors.causes((other, one)))


def test_causes_of_one_name_share_that_names_prior():
    """Four names; the two clocks have half of theirs each."""
    priors = Priors(CAUSES, FAMILIES)
    each = {label: math.exp(value) for label, value in priors.each.items()}
    assert each == pytest.approx(
        {"two": 1 / 4, "drag": 1 / 4, "load": 1 / 4, "clock:wind": 1 / 8, "clock:gnss": 1 / 8}
    )
    assert [name_of(label) for label in ("clock:wind", "drag")] == ["clock", "drag"]
    # a third clock takes from the clocks, and from nothing else
    more = Priors((*CAUSES, One("clock", "gyro")), FAMILIES)
    assert math.exp(more.each["clock:gyro"]) == pytest.approx(1 / 12)
    assert more.each["drag"] == priors.each["drag"]


def test_what_a_form_leaves_over_by_hand():
    alone = {"drag": 300.0, "load": 40.0, "two": -5.0}
    share = thresholds.FORM_ERROR**2  # nats go with the square of a force
    by = {cause.label: cause for cause in CAUSES} | {"unseen": CAUSES[0]}
    assert form_error(alone, (), by) == form_error(alone, ("drag",), by) == 0.0
    assert form_error(alone, ("drag", "load"), by) == pytest.approx(300.0 * share)
    assert form_error(alone, ("load", "drag"), by) == pytest.approx(300.0 * share)
    assert form_error(alone, ("load", "two"), by) == pytest.approx(40.0 * share)
    assert form_error(alone, ("drag", "load", "two"), by) == pytest.approx(2 * 300.0 * share)
    assert form_error(alone, ("two", "unseen"), by) == 0.0  # nothing was explained
    by["load"] = type("Coarse", (One,), {"form_error": 0.2})("load")  # more than drag leaves
    assert form_error(alone, ("drag", "load"), by) == pytest.approx(40.0 * 0.04)


def test_what_an_intermittent_force_leaves_over_by_hand():
    """Two hundredths of it: every cause is a further one, the first as well."""
    alone, by = {"drag": 300.0}, {cause.label: cause for cause in CAUSES}
    assert form_error(alone, (), by, 5000.0) == 0.0
    assert form_error(alone, ("drag",), by, 5000.0) == pytest.approx(2.0)
    assert form_error(alone, ("drag", "load"), by, 5000.0) == pytest.approx(4.0)
    by["drag"] = type("Coarse", (One,), {"form_error": 0.2})("drag")  # leaves more than the force
    assert form_error(alone, ("drag", "load"), by, 500.0) == pytest.approx(300.0 * 0.04)
    assert form_error(alone, ("drag", "load"), by, -5.0) == pytest.approx(300.0 * 0.04)


@pytest.mark.parametrize("alone", [INTERMITTENT, RAISED])
def test_a_cause_next_to_an_intermittent_force_has_to_gain_more_than_the_force_leaves(alone):
    """The force has 1000 nats over nothing; where it is kept with causes only, raised noise has."""
    table: Any = Hypotheses.__new__(Hypotheses)
    table.priors, table.placebo, table.alone = Priors(CAUSES, FAMILIES), {}, {}
    table.by = {cause.label: cause for cause in CAUSES}
    evidence = {((), NOMINAL): -20.0, ((), alone): 980.0}
    table.found = {key: SimpleNamespace(evidence=value) for key, value in evidence.items()}
    for kind, left in ((INTERMITTENT, 0.4), (RAISED, 0.0), (NOMINAL, 0.0)):
        prior = table.priors.hypothesis(("drag",), kind)
        assert table.scale.score(990.0, ("drag",), kind) == pytest.approx(990.0 + prior - left)
