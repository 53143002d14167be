"""Parts of the decision that are left out: what each decides is then decided without it."""

from dataclasses import replace

import numpy as np
import pytest
import weighed

from shiplog.diagnosis.decision_parts import Parts
from shiplog.diagnosis.hypotheses.unrecorded_thruster import SideForce
from shiplog.diagnosis.noise.remainder import INTERMITTENT, NOMINAL, RAISED
from shiplog.diagnosis.verdict import posterior as posteriors
from shiplog.diagnosis.verdict.decide import decide

DRAG = ("drag",)


@pytest.fixture(scope="module")
def trial():
    return weighed.trial()


@pytest.mark.parametrize(("acts", "probability"), [(True, 0.0), (False, 0.9)])
def test_without_practical_sizes_every_size_counts(trial, acts, probability):
    given = {(DRAG, NOMINAL): 0.9, ((), NOMINAL): 0.1}
    made = weighed.search(trial, given, sizes={"drag": 0.01}, spread=1e-4)
    made.table.parts = Parts(practical_size=acts)
    assert posteriors.posterior(made).names.get("drag", 0.0) == pytest.approx(probability)


@pytest.mark.parametrize(("acts", "verdict"), [(True, "none"), (False, "named")])
def test_a_cause_that_is_there_but_does_not_matter_is_a_trace(trial, acts, verdict):
    """Its number is known a hundred times better than it has to be to matter: a tenth of what does
    is certain to be there, and is nothing to act on."""
    given = {(DRAG, NOMINAL): 0.99, ((), NOMINAL): 0.01}
    made = weighed.search(trial, given, sizes={"drag": 0.01}, spread=1e-4)
    made.table.parts = Parts(practical_size=acts)
    decision = decide(made)[0]
    assert decision.verdict == verdict
    told = decision.traces if acts else decision.named
    assert [one.cause.name for one in told] == ["drag"]


@pytest.mark.parametrize(("acts", "verdict"), [(True, "none"), (False, "unknown")])
def test_voyages_of_all_weathers_make_a_trial_of_any_of_them_an_ordinary_one(trial, acts, verdict):
    """Process noise differs by a factor of e^0.6 = 1.8 from nominal voyage to nominal voyage: a
    trial with twice the nominal noise is as they are."""
    of = replace(trial, campaign=replace(trial.campaign, noise=0.6))
    made = weighed.search(of, {((), RAISED): 1.0}, raised=2.0)
    made.table.parts = Parts(ordinary_spreads=acts)
    assert decide(made)[0].verdict == verdict


@pytest.mark.parametrize(
    ("raised", "parts", "kind"),
    [
        (1.3, Parts(), NOMINAL), (1.3, Parts(ordinary_noise=False), RAISED),
        (1.2, Parts(ordinary_noise=False), NOMINAL),  # exp(2 · 0.1) = 1.22, from voyage to voyage
        (1.2, Parts(ordinary_noise=False, ordinary_spreads=False), RAISED),
        (1.6, Parts(), RAISED),
    ],
)  # fmt: skip
def test_noise_of_an_ordinary_day_is_nominal(trial, raised, parts, kind):
    made = weighed.search(trial, {((), RAISED): 1.0}, raised=raised)
    made.table.parts = parts
    assert posteriors.practical_kind(made.table, made.table.found[(), RAISED]) == kind


@pytest.mark.parametrize("acts", [True, False])
def test_a_remainder_is_slight_where_that_counts(trial, acts):
    given = {(DRAG, "time"): 0.9, (DRAG, NOMINAL): 0.1}
    made = weighed.search(
        trial, given, evidence={(DRAG, "time"): 101.0, (DRAG, NOMINAL): 100.0}
    )  # fmt: skip
    made.table.parts = Parts(slight=acts)
    assert posteriors.slight(made.table, made.table.found[DRAG, "time"]) == acts


@pytest.mark.parametrize(("parts", "verdict"), [(Parts(), "unknown"), (
    Parts(share_of_causes=False, imitation=False), "named")])  # fmt: skip
def test_a_cause_that_explains_a_tenth_is_named_where_no_share_is_asked(trial, parts, verdict):
    given = {(DRAG, "time"): 0.99, (DRAG, NOMINAL): 0.001}
    evidence = {(DRAG, "time"): 1000.0, (DRAG, NOMINAL): 100.0}
    made = weighed.search(trial, given, evidence=evidence)
    made.table.parts = parts
    assert decide(made)[0].verdict == verdict


@pytest.mark.parametrize(("acts", "verdict"), [(True, "named"), (False, "unknown")])
def test_without_its_pattern_a_force_is_a_device_by_its_course_alone(trial, acts, verdict):
    """Its pattern is that of a device, and a course that is on or off was not more probable."""
    force = SideForce(0.0, 40.0, 0.0, 2.0, np.array([0.0, 0.3, 0.2]), device=1.0)
    made = weighed.search(trial, {((), INTERMITTENT): 1.0}, side_force=force)
    made.table.parts = Parts(pattern=acts)
    assert decide(made)[0].verdict == verdict
