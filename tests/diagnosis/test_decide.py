"""Verdicts of posteriors that are made by hand."""

from dataclasses import replace

import numpy as np
import pytest
import straight
import weighed

from shiplog.diagnosis import thresholds
from shiplog.diagnosis.hypotheses import fits
from shiplog.diagnosis.hypotheses.unrecorded_thruster import SideForce
from shiplog.diagnosis.noise.remainder import INTERMITTENT, NOMINAL, RAISED
from shiplog.diagnosis.verdict import posterior as posteriors
from shiplog.diagnosis.verdict.decide import decide
from shiplog.diagnosis.verdict.result import PATTERN, REFUTED
from shiplog.report.diagnosis.sections import causes

DRAG, LOAD, TWO = ("drag",), ("load",), ("two",)
WIND, GNSS = ("clock:wind",), ("clock:gnss",)
SIDE_THRUST = SideForce(0.0, 60.0, 0.3, 4.0, np.array([0.0, 0.01, 0.004]))


@pytest.fixture(scope="module")
def trial():
    return weighed.trial()


def verdict(trial, probability, **more):
    return decide(weighed.search(trial, probability, **more))[0]


def named(decision) -> list[str]:
    return [one.cause.label for one in decision.named]


def test_one_name(trial):
    found = verdict(trial, {(DRAG, NOMINAL): 0.95, ((), NOMINAL): 0.05})
    assert (found.verdict, named(found)) == ("named", ["drag"])
    (one,) = found.named
    assert one.probability == pytest.approx(0.95)
    assert one.numbers == pytest.approx([weighed.SIZE])
    assert one.covariance.shape == (1, 1)
    assert found.structure is None and found.side_force is None
    assert found.fit.included == ("drag",)


def test_of_two_causes_that_cannot_be_told_apart_one_acts_in_addition(trial):
    """Neither has 0.9, but one or the other is in hypotheses of 0.97."""
    either = {(("drag", "load"), NOMINAL): 0.7, (("drag", "two"), NOMINAL): 0.2,
              (("drag", "load", "two"), NOMINAL): 0.07, (DRAG, NOMINAL): 0.03}  # fmt: skip
    found = verdict(trial, either)
    assert named(found) == ["drag"] and found.one_of == ("load", "two")
    # 0.87 is too little, and nothing is stated in addition to a verdict without a name
    less = {**either, (DRAG, NOMINAL): 0.145}
    assert verdict(trial, less).one_of == ()
    alone = {(LOAD, NOMINAL): 0.7, (TWO, NOMINAL): 0.3}
    assert (verdict(trial, alone).verdict, verdict(trial, alone).one_of) == ("undecided", ())


def test_what_a_remainder_could_do_is_not_stated_in_addition(trial):
    """It explains 50 of 400 nats, which is not slight; 2 are."""
    kinds = {(("drag", "load"), "position"): 0.7, (("drag", "two"), "position"): 0.3}
    plain = {(("drag", "load"), NOMINAL): 1e-9, (("drag", "two"), NOMINAL): 1e-9}
    for explained, expected in ((50.0, ()), (2.0, ("load", "two"))):
        evidence = dict.fromkeys(kinds, 400.0) | dict.fromkeys(plain, 400.0 - explained)
        found = verdict(trial, {**kinds, **plain}, evidence=evidence)
        assert (named(found), found.one_of) == (["drag"], expected)


def test_two_names_each_with_its_own_part_of_the_covariance(trial, monkeypatch):
    """And with the form error of its own numbers, 2 % of them unless it is said to be none."""
    made = weighed.search(trial, {(("drag", "two"), NOMINAL): 1.0})
    whole = np.array([[4.0, 1.0, 2.0], [1.0, 9.0, 3.0], [2.0, 3.0, 16.0]])
    made.table.found[("drag", "two"), NOMINAL].estimate.covariance[:] = whole
    decision, _ = decide(made)
    assert named(decision) == ["drag", "two"]
    drag, two = decision.named
    form = [np.square(0.02 * one.numbers) for one in (drag, two)]
    assert drag.covariance == pytest.approx(4.0 + np.diag(form[0]))
    assert two.covariance == pytest.approx(whole[1:, 1:] + np.diag(form[1]))
    monkeypatch.setattr(thresholds, "FORM_ERROR", 0.0)
    drag, two = decide(made)[0].named
    assert drag.covariance.tolist() == [[4.0]]
    assert two.covariance.tolist() == whole[1:, 1:].tolist()
    # both numbers of one cause are measured in one unit
    monkeypatch.setattr(type(two.cause), "unit_error", 0.1)
    _, two = decide(made)[0].named
    assert two.covariance == pytest.approx(
        whole[1:, 1:] + 0.01 * np.outer(two.numbers, two.numbers)
    )


def test_neither_of_two_is_named(trial):
    found = verdict(trial, {(DRAG, NOMINAL): 0.5, (LOAD, NOMINAL): 0.45, ((), NOMINAL): 0.05})
    assert (found.verdict, named(found)) == ("undecided", [])
    assert list(found.ranking)[:2] == ["drag", "load"]
    # neither is reported: the numbers are of nothing
    assert found.fit.included == ()


def test_a_name_that_is_sure_with_one_that_is_not(trial):
    found = verdict(trial, {(DRAG, NOMINAL): 0.5, (("drag", "load"), NOMINAL): 0.5})
    assert named(found) == ["drag"]


def test_nothing(trial):
    sure, unsure = thresholds.STATED + 0.01, thresholds.STATED - 0.01
    found = verdict(trial, {((), NOMINAL): sure, (DRAG, NOMINAL): 1.0 - sure})
    assert (found.verdict, named(found), found.traces) == ("none", [], ())
    found = verdict(trial, {((), NOMINAL): unsure, (DRAG, NOMINAL): 1.0 - unsure})
    assert found.verdict == "undecided"


@pytest.mark.parametrize(
    ("hidden", "weight", "nats", "expected"),
    [(0, 0.0, 1.0, "none"), (1, 0.05, 1.0, "none"), (2, 0.05, 1.0, "undecided"),
     (2, 0.05, -1.0, "none"), (2, 0.2, -1.0, "none"), (2, 0.3, -1.0, "undecided")],
)  # fmt: skip
def test_nothing_is_not_said_where_too_much_could_not_have_shown(
    trial, hidden, weight, nats, expected
):
    """Each of the causes that were only scanned keeps a weight of what nothing has. Where the data
    favour them, 0.98/1.05 is stated, and 0.98/1.1, with 0.89, is not. Where they do not, half of
    what causes had may be left: 0.98/1.39 is 0.70, and 0.98/1.59 is 0.62, below two thirds."""
    made = weighed.search(trial, {((), NOMINAL): 0.98, (DRAG, NOMINAL): 0.02})
    score = made.table.found[(), NOMINAL].score
    for label in [c.label for c in made.table.catalogue if c.label != "drag"][:hidden]:
        made.scanned[label] = score + float(np.log(weight))
        made.table.alone[label] = nats
    found, posterior = decide(made)
    assert found.verdict == expected
    assert posterior.none_of_all == pytest.approx(0.98 / (1.0 + 0.98 * weight * hidden), rel=1e-3)
    assert found.ranking["none"] == pytest.approx(posterior.none_of_all)


def test_a_cause_that_promises_far_more_than_what_was_weighed_leaves_nothing_sure(trial):
    """As after a ban: its share is all there is, however many nats, and no number overflows."""
    made = weighed.search(trial, {((), NOMINAL): 0.98, (DRAG, NOMINAL): 0.02})
    (label, *_) = [c.label for c in made.table.catalogue if c.label != "drag"]
    made.scanned[label] = made.table.found[(), NOMINAL].score + 40_000.0
    found, _ = decide(made)
    assert found.verdict == "undecided"
    assert next(iter(found.ranking)) == label.partition(":")[0]
    assert found.ranking[label.partition(":")[0]] == pytest.approx(1.0)


def test_noise_as_on_an_ordinary_day_is_nothing_and_its_factor_is_reported(trial):
    found = verdict(trial, {((), RAISED): 0.96, ((), NOMINAL): 0.04}, raised=1.3)
    assert (found.verdict, found.structure, found.fit.noise_factor) == ("none", None, 1.3)
    assert verdict(trial, {((), RAISED): 0.96, ((), NOMINAL): 0.04}).verdict == "unknown"


def test_a_trace_is_reported_and_is_no_name(trial):
    """There for sure, and too small to matter."""
    probability = {(DRAG, NOMINAL): 0.97, ((), NOMINAL): 0.03}
    found = verdict(trial, probability, sizes={"drag": 0.05}, spread=0.01)
    assert (found.verdict, named(found)) == ("none", [])
    assert [one.cause.label for one in found.traces] == ["drag"]


@pytest.mark.parametrize(
    ("kind", "family"), ((RAISED, "stochastic"), ("time", "time"), (INTERMITTENT, "intermittent"))
)
def test_a_kind_of_remainder_is_unknown_and_says_its_family(trial, kind, family):
    found = verdict(
        trial, {((), kind): 0.93, (DRAG, kind): 0.03, ((), NOMINAL): 0.04},
        evidence={((), kind): 40.0, ((), NOMINAL): 3.0},
    )  # fmt: skip
    assert (found.verdict, named(found)) == ("unknown", [])
    assert found.structure.family == family
    assert found.structure.evidence == pytest.approx(37.0)
    assert set(found.structure.acts_on) <= {"surge", "sway", "yaw_rate"}
    # what is drawn afterwards includes it
    assert found.fit.remainder == found.nothing.remainder
    assert found.fit.remainder.kind == kind


def test_a_name_has_to_explain_more_than_the_remainder_with_it(trial):
    """Of 80 nats together it must have the share MOST by itself: with less, unknown."""
    least = 80.0 * thresholds.MOST
    sure = {(DRAG, "time"): 0.96, (DRAG, NOMINAL): 0.02, ((), NOMINAL): 0.02}
    evidence = {(DRAG, "time"): 80.0, (DRAG, NOMINAL): least - 5.0}
    little = verdict(trial, sure, evidence=evidence)
    assert (little.verdict, named(little)) == ("unknown", [])
    assert little.structure.family == "time"
    much = verdict(trial, sure, evidence=evidence | {(DRAG, NOMINAL): least + 5.0})
    assert (much.verdict, named(much)) == ("named", ["drag"])


@pytest.mark.parametrize(
    ("alone", "word", "share"), [(25.0, "undecided", 0.5), (15.0, "unknown", 1.0)]
)
def test_a_cause_that_alone_explains_more_than_the_remainder_alone_may_be_it(
    trial, alone, word, share
):
    """Of 80 nats together the drag has too few to be named. The remainder alone has 20: where the
    drag alone has more, the rest may be an error of its equations."""
    sure = {(DRAG, "time"): 0.94, (DRAG, NOMINAL): 0.02, ((), "time"): 0.02, ((), NOMINAL): 0.02}
    evidence = {(DRAG, "time"): 80.0, (DRAG, NOMINAL): alone, ((), "time"): 20.0}
    found = verdict(trial, sure, evidence=evidence)
    assert (found.verdict, named(found)) == (word, [])
    assert found.either == (("drag",) if word == "undecided" else ())
    assert found.structure.family == "time"
    assert found.ranking["unknown:time"] == pytest.approx(share * 0.96)
    assert found.ranking["drag"] == pytest.approx(share * 0.96)
    assert found.ranking["none"] == pytest.approx(0.02)


@pytest.mark.parametrize(("share", "word"), [(0.3, "named"), (0.7, "unknown")])
def test_a_cause_that_the_remainder_imitates_is_not_named_with_it(trial, monkeypatch, share, word):
    """What acts through the same inputs may be a part of the unknown force: then that is
    reported."""
    asked = []

    def imitated(of, fit, label, size):
        asked.append((label, fit.remainder.kind))
        return share

    monkeypatch.setattr(fits, "imitated", imitated)
    sure = {(DRAG, "time"): 0.96, (DRAG, NOMINAL): 0.02, ((), NOMINAL): 0.02}
    found = verdict(trial, sure, evidence={(DRAG, "time"): 80.0, (DRAG, NOMINAL): 70.0})
    assert found.verdict == word
    assert asked == [("drag", "time")]
    assert word == "named" or found.structure.family == "time"


@pytest.mark.parametrize(
    ("alone", "word", "names"), [(60.0, "named", ["drag"]), (10.0, "unknown", [])]
)
def test_a_cause_that_the_remainder_imitates_puts_no_other_in_doubt(
    trial, monkeypatch, alone, word, names
):
    """The other is named where it explains most by itself, without the one in doubt."""
    both = ("drag", "load")
    shares = {"drag": 0.1, "load": 0.8}
    monkeypatch.setattr(fits, "imitated", lambda trial, fit, label, size: shares[label])
    sure = {(both, "time"): 0.96, (DRAG, NOMINAL): 0.02, (both, NOMINAL): 0.02}
    evidence = {(both, "time"): 80.0, (both, NOMINAL): 70.0, (DRAG, NOMINAL): alone}
    found = verdict(trial, sure, evidence=evidence)
    assert (found.verdict, named(found)) == (word, names)
    assert "could do 80% of it" in found.rejected["load"]
    assert "drag" not in found.rejected or word == "unknown"


@pytest.mark.parametrize(("alone", "names"), [(8.0, ["drag", "load"]), (97.0, ["drag"])])
def test_a_slight_remainder_may_do_the_work_of_a_slight_cause(trial, monkeypatch, alone, names):
    """It adds 1.5 nats to 100, of which the load alone explains 92, or 3. Both could be a part of
    it, by their form."""
    both = ("drag", "load")
    shares = {"drag": 0.9, "load": 0.9}
    monkeypatch.setattr(fits, "imitated", lambda trial, fit, label, size: shares[label])
    sure = {(both, "time"): 0.96, (both, NOMINAL): 0.03, (DRAG, NOMINAL): 0.01}
    evidence = {(both, "time"): 101.5, (both, NOMINAL): 100.0, (DRAG, NOMINAL): alone}
    assert named(verdict(trial, sure, evidence=evidence)) == names


def test_the_remainder_is_as_large_as_it_would_be_without_the_cause(trial, monkeypatch):
    """Next to the cause it is only what the cause leaves of an unknown force."""
    asked = []
    monkeypatch.setattr(fits, "imitated", lambda trial, fit, label, size: asked.append(size) or 0.0)
    sure = {(DRAG, "time"): 0.97, (DRAG, NOMINAL): 0.02, ((), "time"): 0.01}
    made = weighed.search(trial, sure, evidence={(DRAG, "time"): 80.0, (DRAG, NOMINAL): 70.0})
    found = made.table.found
    alone = found[(), "time"]
    for size, wanted in ((9.0, 9.0), (0.5, found[DRAG, "time"].remainder.size)):
        found[(), "time"] = replace(alone, remainder=replace(alone.remainder, size=size))
        decide(made)
        assert asked[-1] == wanted


def test_a_name_of_two_kinds_is_reported_in_the_likelier(trial):
    """A verdict that names a clock says which."""
    found = verdict(trial, {(WIND, NOMINAL): 0.36, (GNSS, NOMINAL): 0.32, (GNSS, RAISED): 0.32})
    assert (found.verdict, named(found)) == ("named", ["clock:gnss"])


def test_an_intermittent_force_is_a_device_only_where_it_is_on_or_off(trial):
    sure = {((), INTERMITTENT): 0.98, ((), NOMINAL): 0.02}
    for device, wanted in ((True, "named"), (False, "unknown")):
        force = replace(SIDE_THRUST, device=float(device))
        found = verdict(trial, sure, side_force=force)
        assert found.verdict == wanted
        assert (found.side_force is force) == device
        assert (found.structure is None) == device
        intermittent = (
            SIDE_THRUST.unit * SIDE_THRUST.force
        )  # that the process noise has from then on
        assert (found.fit.remainder.intermittent == tuple(intermittent)) == device
        assert found.nothing.remainder == found.fit.remainder
        if device:  # it is reported with the probability of the force
            reported = causes.of_side_force(found, [])
            assert (reported.name, reported.probability) == ("side_thrust", 0.98)


def test_an_intermittent_force_of_unclear_pattern_may_be_a_device_or_not(trial):
    force = replace(SIDE_THRUST, device=0.5)
    found = verdict(trial, {((), INTERMITTENT): 0.98, ((), NOMINAL): 0.02}, side_force=force)
    assert (found.verdict, found.why, found.side_force) == ("undecided", PATTERN, None)
    assert found.ranking == pytest.approx(
        {"side_thrust": 0.49, "unknown:intermittent": 0.49, "none": 0.02}
    )


@pytest.mark.parametrize(("raised", "kind"), [(1.4, None), (1.6, "unknown")])
def test_a_force_that_varies_as_gusts_do_takes_no_name_away(trial, raised, kind):
    """Next to a cause, and with nothing: as process noise does that is raised by as much."""
    force, raised_by = replace(SIDE_THRUST, device=0.0), {"raised": raised}
    both = {(DRAG, INTERMITTENT): 0.98, ((), INTERMITTENT): 0.01, ((), RAISED): 1e-6}
    evidence = {(DRAG, INTERMITTENT): 80.0, ((), INTERMITTENT): 70.0, ((), RAISED): 40.0}
    found = verdict(trial, both, evidence=evidence, side_force=force, **raised_by)
    assert (found.verdict, named(found)) == ((kind, []) if kind else ("named", ["drag"]))
    alone = {((), INTERMITTENT): 0.98, ((), NOMINAL): 0.02}
    assert verdict(trial, alone, side_force=force, **raised_by).verdict == (kind or "none")


def test_what_is_refuted_leaves_a_remainder_in_doubt(trial):
    """Held-out voyages refute a model. Either it is not of this ship, or the cause is not there:
    what is left without the cause is no surer than the cause."""
    made = weighed.search(trial, {(DRAG, NOMINAL): 0.97, ((), "time"): 0.02, (LOAD, "time"): 0.01})
    made.table.banned.add(frozenset(("drag",)))
    decision, _ = decide(made, {"drag": "it is worse"})
    assert (decision.verdict, decision.why) == ("undecided", REFUTED)
    assert decision.either == ("drag",)
    assert set(list(decision.ranking)[:2]) == {"unknown:time", "drag"}
    assert decision.ranking["drag"] == 0.5
    assert decision.ranking["unknown:time"] == pytest.approx(0.5)
    assert decision.ranking["load"] == pytest.approx(0.5 / 3.0, rel=0.01)


def test_a_refuted_name_is_not_named_and_its_reason_is_kept(trial):
    made = weighed.search(trial, {(DRAG, NOMINAL): 0.97, (LOAD, NOMINAL): 0.03})
    made.table.banned.add(frozenset(("drag",)))
    decision, found = decide(made, {"drag": "it is worse"})
    assert named(decision) == ["load"]
    assert decision.rejected["drag"] == "it is worse"
    assert "drag" not in found.names


def test_what_may_stand_in_a_place_is_at_most_a_hundred_times_less_probable(trial):
    found = verdict(trial, {(DRAG, NOMINAL): 0.94, (LOAD, NOMINAL): 0.05, (TWO, NOMINAL): 1e-4})
    (one,) = found.named
    assert one.alike == ("load",)
    clock = ("clock:wind",)  # the label: what comes next asks for its columns
    (one,) = verdict(trial, {(DRAG, NOMINAL): 0.94, (clock, NOMINAL): 0.05}).named
    assert one.alike == clock
    assert causes.of_named(one).indistinguishable_from == ("clock",)


def test_why_a_special_case_is_not_named_is_not_said_by_itself(trial, monkeypatch):
    found = verdict(trial, {(DRAG, NOMINAL): 0.95, ((), NOMINAL): 0.05})
    assert {"clock:wind", "clock:gnss", "load", "two"} == set(found.rejected)
    special = property(lambda cause: cause.label == "clock:gnss")
    monkeypatch.setattr(straight.One, "special", special)
    found = verdict(trial, {(DRAG, NOMINAL): 0.95, ((), NOMINAL): 0.05})
    assert {"clock:wind", "load", "two"} == set(found.rejected)


@pytest.mark.parametrize(("place", "orders", "device"), [(-1.4, 0, False), (1.0, 0, True),
                                                         (-1.4, 2, True)])  # fmt: skip
def test_a_force_at_the_place_of_a_unit_that_is_named_is_that_unit(
    trial, monkeypatch, place, orders, device
):
    """The port rudder is 1.5 m astern of midship. A force there, next to a cause in it, is what the
    cause's equations leave; a force at the bow is another thruster's. The propeller, unit 2, does
    not push athwart."""
    monkeypatch.setattr(straight.One, "orders", lambda cause, profile: frozenset({orders}))
    force = replace(SIDE_THRUST, lever=place, device=1.0)
    found = verdict(
        trial, {(DRAG, INTERMITTENT): 1.0, ((), INTERMITTENT): 1e-9}, side_force=force,
        evidence={(DRAG, INTERMITTENT): 400.0, ((), INTERMITTENT): 300.0},
    )  # fmt: skip
    assert (found.verdict, named(found)) == ("named", ["drag"])
    assert (found.side_force is not None) == device


@pytest.mark.parametrize(("more", "names"), [(15.0, ["drag"]), (25.0, ["drag", "load"])])
def test_a_slight_cause_on_the_unit_of_a_large_one_is_what_that_one_leaves(
    trial, monkeypatch, more, names
):
    """A limit of a screw explains a thousand nats, and 3 % of thrust of the same screw adds 15: a
    limit is not sharp. With 25 nats more it is a cause by itself."""
    monkeypatch.setattr(posteriors, "_units_of", lambda labels, _: {n: {"screw"} for n in labels})
    given = {(("drag", "load"), NOMINAL): 0.97, (DRAG, NOMINAL): 0.02, ((), NOMINAL): 1e-9}
    evidence = {(("drag", "load"), NOMINAL): 1000.0 + more, (DRAG, NOMINAL): 1000.0}
    found = verdict(trial, given, evidence=evidence)
    assert named(found) == names
    assert ("whose equations may leave as much" in found.rejected.get("load", "")) == (more < 20.0)
    # on units of their own they are two causes, whatever their sizes
    monkeypatch.setattr(posteriors, "_units_of", lambda labels, _: {n: {n} for n in labels})
    assert named(verdict(trial, given, evidence=evidence)) == ["drag", "load"]


@pytest.mark.parametrize(("place", "device"), [(1.0, False), (-0.9, False), (1.45, True)])
def test_a_force_between_the_fenders_next_to_a_contact_is_what_the_contact_leaves(
    trial, monkeypatch, place, device
):
    """A ship of 3 m that a wall pushes off 0.9 m ahead and astern of midship, a place known to
    0.3 m; a force at the very bow is another one."""
    monkeypatch.setattr(straight.One, "pushes_within", 0.3)
    monkeypatch.setattr(straight.One, "orders", lambda cause, profile: frozenset())
    force = replace(SIDE_THRUST, lever=place, device=1.0)
    found = verdict(
        trial, {(DRAG, INTERMITTENT): 1.0, ((), INTERMITTENT): 1e-9}, side_force=force,
        evidence={(DRAG, INTERMITTENT): 400.0, ((), INTERMITTENT): 300.0},
    )  # fmt: skip
    assert (found.verdict, named(found)) == ("named", ["drag"])
    assert (found.side_force is not None) == device


@pytest.mark.parametrize(("size", "word"), [(0.001, "none"), (0.5, "named")])
def test_a_remainder_that_is_there_only_next_to_traces_is_none(trial, size, word):
    """By itself the change in time is less probable than nothing. Next to a drag that does not
    matter it is an error of the drag's equations."""
    given = {(DRAG, "time"): 1.0, (DRAG, NOMINAL): 1e-3, ((), NOMINAL): 1e-4, ((), "time"): 1e-6}
    evidence = {(DRAG, "time"): 90.0, (DRAG, NOMINAL): 85.0, ((), "time"): 1.0}
    found = verdict(trial, given, sizes={"drag": size}, spread=1e-4, evidence=evidence)
    assert found.verdict == word
    # where the change is more probable than nothing by itself, too, it is stated
    given[(), "time"] = 1e-3
    found = verdict(trial, given, sizes={"drag": 0.001}, spread=1e-4, evidence=evidence)
    assert (found.verdict, found.structure.family) == ("unknown", "time")
