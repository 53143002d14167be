"""Limits on verdicts, causes and their sizes."""

import pytest
from gate_answers import CURRENT, FOULED, LATE, LIMITS, found

from shiplog.report.gate import verdict_limits
from shiplog.report.gate.verdict_limits import of_cause, of_named, of_size, of_verdict

RANKED = [{"name": "current", "probability": 0.6}, {"name": "fouling", "probability": 0.3}]


@pytest.mark.parametrize(
    ("word", "state"),
    [("none", "holds"), ("named", "broken"), ("unknown", "broken"), ("external", "broken"),
     ("undecided", "not assessed"), ("coverage", "not assessed")],
)  # fmt: skip
def test_the_verdict(word, state):
    assert of_verdict(("none",), found(word)).state == state
    assert of_verdict(("none", word), found(word)).state == "holds"


def test_its_line():
    assert of_verdict(("none", "named"), found("unknown")).line == (
        "broken verdict: unknown, allowed none, named"
    )
    assert of_verdict(("none",), found("undecided")).line == (
        "not assessed verdict: undecided, allowed none: no answer has a probability of 0.9"
    )


def test_a_cause_that_is_not_allowed():
    named = found("named", causes=[CURRENT])
    assert of_cause("current", named).line == (
        "broken current: named, not allowed: A steady current of 0.10 m/s."
    )
    assert of_cause("fouling", named).line == "holds  fouling: not named, not allowed"
    assert of_cause("fouling", found("none", traces=[FOULED])).state == "holds"


@pytest.mark.parametrize(
    ("label", "keys", "words"),
    [
        ("bank", {}, "no realistic size of it could have shown"),
        ("payload", {}, "it was not tested"),
        ("payload", {"unavailable": [{"name": "payload", "reason": "no mass is known"}]},
         "it could not be tested: no mass is known"),
        ("current", {"ranking": RANKED}, "its probability is 0.60"),
        ("fouling", {"causes": [CURRENT | {"indistinguishable_from": ["fouling"]}]},
         "these data cannot tell it from current, which is named"),
        ("current", {"limits": []}, "it was not tested"),
    ],
)  # fmt: skip
def test_a_cause_that_was_not_assessed_is_not_passed(label, keys, words):
    for one in (of_cause(label, found("undecided", **keys)),):
        assert one.state == "not assessed" and words in one.line


def test_a_channel_that_could_not_be_tested_counts_where_it_is_meant():
    """The receiver's heading is a special case of the compass's, which was tested."""
    limits = [{"name": "heading_offset", "share": 0.2, "parameters": {}}, *LIMITS[3:4]]
    why = [{"name": "heading_offset", "reason": "gnss: the velocity is over ground"},
           {"name": "clock_offset", "reason": "wind: no wind is recorded"}]  # fmt: skip
    verdict = found("none", limits=limits, unavailable=why)
    assert of_cause("heading_offset", verdict).state == "holds"
    assert of_cause("clock_offset:gnss", verdict).state == "holds"
    assert of_cause("clock_offset:wind", verdict).state == "not assessed"
    assert of_cause("clock_offset", verdict).line.endswith("wind: no wind is recorded")


def test_a_channel_is_told_from_the_others_of_its_cause():
    named = found("named", causes=[LATE], ranking=[{"name": "clock_offset", "probability": 0.95}])
    assert of_cause("clock_offset", named).state == "broken"
    assert of_cause("clock_offset:gnss", named).state == "broken"
    assert of_cause("clock_offset:wind", named).state == "holds"


def test_an_unrecorded_thruster_has_no_detectable_size():
    assert of_cause("side_thrust", found("none")).state == "holds"
    assert of_cause("side_thrust", found("undecided")).state == "not assessed"
    pushed = found("named", causes=[{"name": "side_thrust", "sentence": "Pushed.",
                                     "parameters": {}}])  # fmt: skip
    assert of_cause("side_thrust", pushed).state == "broken"


def test_only_those_causes_may_be_named():
    named = found("named", causes=[CURRENT, LATE])
    one = of_named(("current", "clock_offset:gnss"), named)
    assert (one.state, one.found) == ("holds", "current, clock_offset:gnss")
    assert of_named(("current", "clock_offset:wind"), named).state == "broken"
    assert of_named((), named).line == (
        "broken named causes: current, clock_offset:gnss, allowed none: "
        "A steady current of 0.10 m/s."
    )
    assert of_named((), found("none")).state == "holds"
    assert of_named((), found("undecided")).state == "not assessed"


@pytest.mark.parametrize(
    ("limit", "state"), [(0.13, "holds"), (0.12, "holds"), (0.11, "broken"), (0.09, "broken")]
)
def test_the_far_end_of_a_size_counts(limit, state):
    one = of_size("current", "speed", limit, found("named", causes=[CURRENT]))
    assert one.state == state
    assert one.found == "0.1 m/s (0.08 to 0.12)"
    assert ("the far end of the interval counts" in one.line) == (limit == 0.11)


def test_sizes_are_absolute_and_of_a_factor_from_one():
    late = of_size("clock_offset:gnss", "time", 0.35, found("named", causes=[LATE]))
    assert (late.measured.value, late.measured.low, late.measured.high) == (0.3, 0.2, 0.4)
    assert late.state == "broken"
    fouled = of_size("fouling", "factor", 0.3, found("named", causes=[FOULED])).measured
    assert (fouled.value, fouled.low, fouled.high) == pytest.approx((0.2, 0.1, 0.3))
    less = FOULED | {
        "parameters": {"factor": {"value": 0.9, "low": 0.7, "high": 1.05, "unit": "1"}}
    }
    around = of_size("fouling", "factor", 0.2, found("none", traces=[less]))
    assert (around.measured.low, around.measured.high) == pytest.approx((0.0, 0.3))
    assert around.state == "broken"


def test_a_wind_force_that_the_model_has_not_is_compared_with_none():
    wind = {"name": "wind_force", "sentence": "Wind.", "parameters": {
        "sway_factor": {"value": 0.9, "low": 0.8, "high": 1.0, "unit": "1"}}}  # fmt: skip
    verdict = found("named", causes=[wind])
    with_wind = of_size("wind_force", "sway_factor", 0.5, verdict)
    without = of_size("wind_force", "sway_factor", 0.5, verdict, windless=True)
    assert (with_wind.state, without.state) == ("holds", "broken")
    assert without.measured.high == 1.0


def test_a_size_that_was_not_found_holds_where_a_larger_one_would_have_shown():
    """A current is searched by its components: the larger of both sizes is what shows surely."""
    one = of_size("current", "speed", 0.03, found())
    assert one.state == "holds"
    assert one.line == (
        "holds  current.speed: not found (detectable from 0.03 m/s), at most 0.03 m/s"
    )
    strict = of_size("current", "speed", 0.025, found())
    assert strict.state == "not assessed"
    assert strict.line == (
        "not assessed current.speed, at most 0.025 m/s: not found, and only 0.03 m/s or more could "
        "have shown"
    )
    assert of_size("clock_offset", "time", 0.5, found()).state == "not assessed"  # the wind's
    assert of_size("clock_offset:gnss", "time", 0.5, found()).state == "holds"


def test_a_limit_on_every_channel_needs_each_of_them():
    """One is named, and small enough; of the other, 0.9 s might have stayed hidden."""
    named = found("named", causes=[LATE])
    one = of_size("clock_offset", "time", 0.5, named)
    assert one.line == (
        "not assessed clock_offset.time, at most 0.5 s: not found of wind, and only 0.9 s or more "
        "could have shown"
    )
    assert of_size("clock_offset", "time", 0.35, named).state == "broken"
    assert of_size("clock_offset", "time", 1.0, named).state == "holds"
    assert of_size("clock_offset:gnss", "time", 0.5, named).state == "holds"


def test_a_number_that_could_not_show_is_not_assessed():
    limits = [{"name": "payload", "share": 0.3, "parameters": {}}]
    one = of_size("payload", "mass", 9.0, found("none", limits=limits))
    assert one.line.endswith("no realistic mass could have shown")
    assert of_size("bank", "strength", 9.0, found()).state == "not assessed"
    offset = {"name": "rudder_offset", "parameters": {"port": FOULED["parameters"]["factor"]}}
    other = of_size("rudder_offset", "prot", 9.0, found("named", causes=[offset]))
    assert other.state == "not assessed" and "it has port" in other.line


def test_a_size_of_a_cause_that_is_not_excluded_is_not_assessed():
    one = of_size("current", "speed", 9.0, found("undecided", ranking=RANKED))
    assert one.state == "not assessed" and "0.60" in one.line


def test_words_for_every_verdict_that_decides_nothing():
    assert set(verdict_limits.UNDECIDED) == set(verdict_limits.OPEN)
