"""Sentences of a verdict."""

from dataclasses import replace

from shiplog.diagnosis.verdict.result import EXPLAIN_MORE, PATTERN, REFUTED
from shiplog.report.diagnosis.sections.causes import NamedCause
from shiplog.report.diagnosis.sections.limits import NotShown
from shiplog.report.diagnosis.sections.ranking import Ranked
from shiplog.report.diagnosis.sections.structure import Structure
from shiplog.report.diagnosis.sections.wrong import ChannelError
from shiplog.report.diagnosis.verdict_sentence import sentence
from shiplog.simulation.error_reduction import Gain


def cause(
    words: str, probability: float, name: str = "one", alike: tuple[str, ...] = ()
) -> NamedCause:
    return NamedCause(
        name=name, probability=probability, sentence=words, equation="", parameters={},
        indistinguishable_from=alike,
    )  # fmt: skip


def test_what_it_may_be_instead_is_in_the_sentence():
    """A name alone would say more than is known; and a gain below nothing is a loss."""
    lag = cause("The rudders lag.", 0.9, alike=("rudder_delay",))
    output = sentence("named", [lag], None, Gain(500.0, 510.0, -0.05, 0.01, 18, {}), 1.0)
    assert output == (
        "No significant part of the error on 18 held-out windows is explained: it is 2.0% more "
        "(5.0% more to 1.0% less). The rudders lag; or it is rudder_delay: these data cannot tell."
    )
    sure = replace(lag, indistinguishable_from=())
    gained = Gain(500.0, 400.0, 0.1, 0.3, 18, {})
    assert sentence("named", [sure], None, gained, 1.0) == (
        "20% of the error on 18 held-out windows is explained (10% to 30%). The rudders lag."
    )
    for probability, begins in ((0.53, "Likely (53%): "), (0.4, "Perhaps (40%): ")):
        output = sentence("named", [replace(sure, probability=probability)], None, gained, 1.0)
        assert f"(10% to 30%). {begins}" in output and output.endswith("The rudders lag.")


def test_an_error_that_does_not_change_is_said_to_stay_the_same():
    """A fault of a sensor that only tells positions changes no error of the velocities."""
    late = cause("The position is late.", 1.0)
    for low, begins in ((-0.0004, "The error on 12 held-out windows stays the same."),
                        (-0.0006, "No significant part of the error on 12")):  # fmt: skip
        same = Gain(500.0, 499.9, low, 0.0004, 12, {})
        assert sentence("named", [late], None, same, 1.0).startswith(begins)


def test_one_window_is_one_window():
    lag = cause("The rudders lag.", 0.9)
    for after, low, high in ((400.0, 0.1, 0.3), (500.0, -0.1, 0.1)):
        output = sentence("named", [lag], None, Gain(500.0, after, low, high, 1, {}), 1.0)
        assert "of the error on 1 held-out window is explained" in output


def test_one_of_several_causes_that_acts_in_addition_is_in_the_sentence():
    sure = cause("The clock is late.", 1.0, "clock_offset")
    ranking = [Ranked("clock_offset", 1.0), Ranked("wind_force", 0.8),
               Ranked("wind_speed_scale", 0.17)]  # fmt: skip
    gained = Gain(500.0, 300.0, 0.3, 0.5, 18, {})
    one_of = ("wind_force", "wind_speed_scale")
    assert sentence("named", [sure], None, gained, 1.0, ranking=ranking, one_of=one_of).endswith(
        "is late. By the log Bayes factor, wind force (80%) or wind speed scale (17%) acts as "
        "well: these data cannot tell which."
    )
    assert sentence("named", [sure], None, gained, 1.0, ranking=ranking).endswith("is late.")


def test_the_largest_part_that_is_not_explained_is_in_the_sentence():
    """Of shares 0.6 and 0.3 before: nine tenths of the first are taken off, a third of the second,
    so that 0.06 and 0.2 are left."""
    sure = cause("The rudders lag.", 1.0)
    gained = Gain(500.0, 200.0, 0.5, 0.7, 18, {"sway": 0.9, "yaw_rate": 1.0 / 3.0})
    wrong = [
        ChannelError("sway", 0.6, ""), ChannelError("yaw_rate", 0.3, ""),
    ]  # fmt: skip
    assert sentence("named", [sure], None, gained, 1.0, wrong=wrong).endswith(
        "The rudders lag. The largest unexplained part is in yaw rate: 20% of the error."
    )


def test_the_gain_of_another_fit_alone_is_in_the_sentence():
    sure = cause("The wind is late.", 1.0)
    gained = Gain(500.0, 300.0, 0.3, 0.5, 18, {})
    assert sentence("named", [sure], None, gained, 1.0, 0.32).endswith(
        "(30% to 50%). The wind is late. Fitted again with nothing named, the model has an error "
        "32.0% less."
    )
    assert sentence("named", [sure], None, gained, 1.0, -0.1).endswith("has an error 10.0% more.")


def test_noise_of_rougher_weather_is_mentioned_where_nothing_changed():
    assert "noise" not in sentence("none", [], None, None, 1.1)
    assert "Process noise is 1.3 times its nominal" in sentence("none", [], None, None, 1.3)


def test_an_undecided_verdict_does_not_contradict_its_ranking():
    """Either nothing is probable enough, or held-out voyages do not confirm what is."""
    likely = [Ranked("fouling", 0.6), Ranked("none", 0.3)]
    assert sentence("undecided", [], None, None, 1.0, ranking=likely) == (
        "Undecided: fouling (60%) or no change (30%). No answer has a probability of 90%."
    )
    sure = [Ranked("rudder_delay", 0.99), Ranked("none", 0.01)]
    assert sentence("undecided", [], None, None, 1.0, ranking=sure) == (
        "Undecided: the log Bayes factor favours rudder delay (99%), which held-out voyages do not "
        "confirm."
    )


def test_what_is_not_stated_is_not_rounded_to_what_would_be():
    """0.897 is below 0.9, and 90 % of it would not be."""
    near = [Ranked("fouling", 0.897), Ranked("none", 0.1)]
    assert sentence("undecided", [], None, None, 1.0, ranking=near) == (
        "Undecided: fouling (89%) or no change (10%). No answer has a probability of 90%."
    )
    one = cause("It is.", 0.897)
    assert sentence("named", [one], None, None, 1.0) == "Likely (89%): It is."


def test_not_all_of_the_error_is_explained():
    sure = cause("The rudders lag.", 1.0)
    gained = Gain(500.0, 2.0, 0.993, 0.9991, 18, {"sway": 0.997})
    wrong = [ChannelError("sway", 1.0, "")]
    assert sentence("named", [sure], None, gained, 1.0, wrong=wrong) == (
        "99.6% of the error on 18 held-out windows is explained (99% to 99.9%). The rudders lag. "
        "The largest unexplained part is in sway: 0.3% of the error."
    )


def test_a_cause_or_something_outside_the_catalogue_is_undecided():
    ranking = [Ranked(n, 0.5) for n in ("unknown:motion", "fouling")]
    structure = Structure("motion", ("surge",), (), 0.0)
    assert sentence(
        "undecided",
        [],
        structure,
        None,
        1.0,
        ranking=ranking,
        either=("fouling",),
        why=EXPLAIN_MORE,
    ) == (
        "Undecided: fouling (50%), or something outside the catalogue (motion) (50%). Both "
        "together explain most, and alone fouling more. Either the equations of the catalogue are "
        "not those of this ship, or something unknown acts."
    )


def test_what_held_out_voyages_refute_leaves_both_open():
    ranking = [Ranked(n, 0.5) for n in ("unknown:motion", "payload")]
    structure = Structure("motion", ("surge",), (), 0.0)
    assert sentence(
        "undecided", [], structure, None, 1.0, ranking=ranking, either=("payload",), why=REFUTED
    ) == (
        "Undecided: payload (50%), or something outside the catalogue (motion) (50%). The log "
        "Bayes factor favours payload, and held-out voyages refute it. Either the equations of the "
        "catalogue are not those of this ship, or something unknown acts."
    )


def test_a_force_of_unclear_pattern_may_be_a_thruster():
    ranking = [Ranked(n, 0.5) for n in ("side_thrust", "unknown:intermittent")]
    structure = Structure("intermittent", ("sway",), (), 0.0)
    assert sentence("undecided", [], structure, None, 1.0, ranking=ranking, why=PATTERN) == (
        "Undecided: side thrust (50%), or something outside the catalogue (intermittent) (50%). A "
        "side force comes and goes: less clearly on or off than one device is, and more clearly "
        "than a force that varies."
    )


def test_no_change_says_how_many_causes_could_not_have_shown():
    names = ("fouling", "thrust_loss (port)", "payload")
    some = NotShown(3, 18, names)
    output = sentence("none", [], None, None, 1.0, hidden=some)
    assert output.startswith("No change found")
    assert output.endswith(
        "3 of 18 causes could not have shown: fouling, payload, thrust loss (port)."
    )
    none = NotShown(0, 18, ())
    assert sentence("none", [], None, None, 1.0, hidden=none).endswith(
        "Each of 18 causes could have shown."
    )
    ranking = [Ranked("none", 0.59), Ranked("fouling", 0.06)]
    output = sentence("undecided", [], None, None, 1.0, ranking=ranking, hidden=some)
    assert output.startswith("Undecided: no change (59%)") and "3 of 18 causes" in output
    likely = [Ranked("fouling", 0.59), Ranked("none", 0.3)]
    assert "could" not in sentence("undecided", [], None, None, 1.0, ranking=likely, hidden=some)
