"""What a verdict says of too little data, of untested causes, and of one unit or channel."""

from types import SimpleNamespace

import numpy as np
import pytest

from shiplog.diagnosis.trial.fitted import ExpectedEvidence
from shiplog.models.causes.environment import Bank, Current, WindForce
from shiplog.models.causes.sensors import HeadingOffset
from shiplog.models.causes.ship import Fouling
from shiplog.models.causes.steering import RudderDelay, RudderLag
from shiplog.report.diagnosis import answer, page
from shiplog.report.diagnosis.sections import causes as named_causes
from shiplog.report.diagnosis.sections import limits as smallest
from shiplog.report.diagnosis.sections.causes import Estimate, NamedCause
from shiplog.report.diagnosis.sections.limits import Limit, NotShown, Size
from shiplog.report.diagnosis.sections.reasons import Reason
from shiplog.report.diagnosis.verdict import Verdict
from shiplog.report.evaluation.text_table import Table


def table_of(lines):
    (found,) = (line for line in lines if isinstance(line, Table))
    return found


def run_of(*voyages, given=False):
    return SimpleNamespace(name="run", given=given, trained_on=voyages, judges_itself=True)


@pytest.mark.parametrize(
    ("run", "words"),
    [
        (run_of("home"), "fitted to earlier voyages"),  # which this store may not have
        (run_of("home", "trip"), "fitted to these very voyages"),
        (run_of("trip[0:100]"), "fitted to these very voyages"),
        (run_of(given=True), "with coefficients that were not fitted to these voyages"),
    ],
)
@pytest.mark.parametrize("before", [True, False])
def test_what_the_model_was_fitted_to_does_not_depend_on_the_store(monkeypatch, run, words, before):
    """`before`: whether the store has its voyages. A verdict of too little says it, too."""
    record = SimpleNamespace(seconds=9.0, timescale=SimpleNamespace(seconds=30.0), names=("trip",))
    monkeypatch.setattr(answer.segments, "begins", lambda record: np.zeros(0, dtype=int))
    for one in (answer.too_little(run, record, before), answer.runs_away(run, record, before)):
        assert f"Model: run, {words}." in page.markdown(one)
    notes = answer.of_own_voyages(run, SimpleNamespace(record=record), SimpleNamespace(adapted=0))
    assert bool(notes) == ("very" in words)


@pytest.mark.parametrize(
    ("seconds", "unbroken", "more"),
    [(600.0, 0, 120), (600.0, 3, 30), (100.0, 3, 140), (239.7, 4, 1)],
)
def test_too_little_says_how_much_more_is_needed(monkeypatch, seconds, unbroken, more):
    """240 s in all, and four segments of 30 s each: pieces of 25 s hold none, however many."""
    monkeypatch.setattr(answer.segments, "begins", lambda record: np.zeros(unbroken, dtype=int))
    record = SimpleNamespace(
        seconds=seconds, timescale=SimpleNamespace(seconds=30.0), names=("trip",)
    )
    found = answer.too_little(run_of("home"), record, True)
    assert not answer.enough(record)
    assert f"Log at least {more} s more" in found.sentence
    assert f" {int(seconds)} s can be used, and 240 s are needed" in found.sentence


def test_each_unit_and_channel_has_a_row_of_its_own():
    limits = [
        Limit("thrust_loss", 0.5, {}, actuator="port"),
        Limit("clock_offset", 0.5, {}, channel="wind"),
        Limit("fouling", 0.5, {}),
    ]
    assert [row[0] for row in table_of(smallest.markdown(limits)).rows] == [
        "thrust_loss (port)", "clock_offset (wind)", "fouling",
    ]  # fmt: skip


def test_sizes_of_a_large_ship_are_written_out():
    numbers = {"mass": Size(123456.0, "kg"), "factor": Size(1.5, "1")}
    for share, words in ((0.5, "50%"), (0.004, "0.4%")):
        (row,) = table_of(smallest.markdown([Limit("payload", share, numbers)])).rows
        assert row == ("payload", "mass 120000 kg, factor 150%", words)
    cause = NamedCause(
        name="side_thrust", probability=0.95, sentence="A side force.", equation="Y",
        parameters={"force": Estimate(12345.0, 11000.0, 14000.5, "N")},
    )  # fmt: skip
    (row,) = table_of(named_causes.markdown([cause])).rows
    assert row == ("force", "12340", "11000 to 14000", "N")


def test_a_number_that_no_data_would_reveal_is_left_out_of_the_limits():
    """5 nats of a number that has 10 at its realistic size: √(2 · 5 / 10) of it. A bank has two
    uncertain factors besides."""
    causes = [Bank(), Fouling()]
    seen, hidden = np.array([10.0, 1.0, 1.0]), np.array([1e-4, 1e-5, 1e-5])
    for each, strength in ((seen, Size(1.0, "1")), (hidden, None)):
        expected = {"bank": ExpectedEvidence(each, 0.0), "fouling": ExpectedEvidence(each[:1], 0.0)}
        limits = smallest.of(
            SimpleNamespace(expected=expected), causes, SimpleNamespace(prior=lambda p: p.prior)
        )
        by = {one.name: one.parameters for one in limits}
        assert by["bank"] == ({} if strength is None else {"strength": strength})
        assert bool(by["fouling"]) == (strength is not None)


def test_a_special_case_of_a_cause_has_no_limits_of_its_own():
    expected = ExpectedEvidence(np.array([10.0, 1.0, 1.0]), 0.0)
    (one,) = smallest.of(
        SimpleNamespace(expected={"wind_force": expected, "wind_force:alike": expected}),
        [WindForce(), WindForce(alike=True)], SimpleNamespace(prior=lambda p: p.prior),
    )  # fmt: skip
    assert (one.name, one.channel) == ("wind_force", None)
    assert one.parameters["surge_factor"].value == pytest.approx(0.3)


def test_the_report_says_what_was_not_tested_and_why():
    """A cause that no sensor shows is not one that these data exclude."""
    unavailable = (Reason("bank", "the profile's [site] shows no bank"),)
    text = page.markdown(Verdict("none", "No change.", "run", True, "", unavailable=unavailable))
    assert "## Not testable\n\n- bank: the profile's [site] shows no bank\n" in text
    assert "Not testable" not in page.markdown(Verdict("none", "No change.", "run", True, ""))


def test_an_undecided_verdict_says_which_test_separates_its_candidates():
    """A lag and a delay are alternatives; what is certain, or improbable, is none."""
    causes = [cls() for cls in (RudderLag, RudderDelay, Current, Fouling, HeadingOffset)]
    ranking = {
        "rudder_lag": 0.63, "rudder_delay": 0.35, "current": 0.99, "heading_offset": 0.02,
        "fouling": 0.3, "unknown:controls": 0.5,
    }  # fmt: skip
    assert answer.tests_of_open(ranking, causes) == [
        "A test that separates rudder_lag from rudder_delay: rudder doublets of 2 to 4 s at "
        "constant revolutions."
    ]
    assert not answer.tests_of_open({"rudder_lag": 0.95, "rudder_delay": 0.2}, causes)


def test_what_is_not_detectable_in_the_table_is_what_could_not_have_shown():
    limits = [
        Limit("thrust_loss", 31.0, {}, actuator="port"),
        Limit("clock_offset", 0.5, {}, channel="wind"),
        Limit("fouling", 1e3, {}),
    ]
    assert smallest.not_shown(limits) == NotShown(2, 3, ("thrust_loss (port)", "fouling"))
    rows = table_of(smallest.markdown(limits)).rows
    assert [row[2] for row in rows] == ["not detectable", "50%", "not detectable"]
