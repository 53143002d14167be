"""The answers that an undecided verdict leaves open, as its sentence lists them, and what a name at
the wrong place says; their scores."""

import math

import pytest
from test_validation_scores import answer, key, named, ranked, undecided

from pipelines.experiments.hidden_effects import score_tables, scores
from pipelines.experiments.hidden_effects.open_answers import open_answers
from shiplog.report.diagnosis import verdict_sentence
from shiplog.report.diagnosis.sections.ranking import Ranked
from shiplog.report.diagnosis.sections.structure import Structure

POSITION = Structure("position", (), ("x0", "y0"), 0.0)


def rows_of(ranking):
    """As the program has them, and not its JSON."""
    return [Ranked(**one) for one in ranking]


def said(sentence, **shares):
    return undecided(**shares) | {"sentence": sentence}


BY_HALVES = said(
    "Undecided: rudder offset, thrust loss (50%), or something outside the catalogue (controls) "
    "(50%). Both together explain most, and alone rudder offset, thrust loss more.",
    payload=1.0, unknown_controls=0.5, thrust_loss=0.5, rudder_offset=0.5,
)  # fmt: skip
THREE = said(
    "Undecided: no change (78%) or wind force (7%) or wind direction offset (6%). No answer has a "
    "probability of 90%.",
    none=0.775, wind_force=0.069, wind_direction_offset=0.066, rudder_lag=0.03,
)  # fmt: skip


def test_an_undecided_verdict_leaves_open_what_its_sentence_lists():
    """Two causes that act together are one answer; what acts in every answer is none."""
    both, outside = frozenset({"rudder_offset", "thrust_loss"}), frozenset({"unknown:controls"})
    assert open_answers(BY_HALVES) == ((both, 0.5), (outside, 0.5))
    assert [labels for labels, _ in open_answers(THREE)] == [
        {"none"}, {"wind_force"}, {"wind_direction_offset"}
    ]  # fmt: skip
    limit, load = key("rudder_limit", family="controls"), key("payload")
    assert answer(limit, BY_HALVES).found
    assert answer(limit, BY_HALVES).statements == ((0.5, False), (0.5, True))
    assert not answer(load, BY_HALVES).found
    assert answer(key("thrust_loss", "rudder_offset"), BY_HALVES).found
    assert not answer(key("thrust_loss"), BY_HALVES).found  # with a second name it is not all of it
    assert score_tables.reported(answer(limit, BY_HALVES)) == (
        "undecided rudder_offset + thrust_loss or unknown:controls"
    )
    assert score_tables.reported(answer(key(), THREE)) == "undecided none or wind_force"
    # half the weight each: nothing right of two, or all of it
    missed = scores.repair_utility({"rudder_offset", "thrust_loss"}, {scores.OUTSIDE})
    assert scores.group_utility(answer(limit, BY_HALVES)) == pytest.approx((missed + 1.0) / 2)
    with pytest.raises(ValueError, match="'no wind' is no answer"):
        open_answers(said("Undecided: no wind (50%) or bank (40%). No answer", bank=0.4))


@pytest.mark.parametrize("why", ["explain more", "refuted", "pattern"])
def test_the_sentences_of_the_program_are_read(why):
    """What `report.verdict_sentence` writes of a set of names comes back as that set."""
    reasons = {
        "explain more": verdict_sentence.EXPLAIN_MORE,
        "refuted": verdict_sentence.REFUTED,
        "pattern": verdict_sentence.PATTERN,
    }
    either = () if why == "pattern" else ("shallow_water", "wind_force")
    shares = dict.fromkeys(either or ("side_thrust",), 0.5)
    ranking = ranked(**shares, unknown_position=0.5)
    text = verdict_sentence.sentence(
        "undecided", (), POSITION, None, 1.0, ranking=rows_of(ranking), either=either,
        why=reasons[why],
    )  # fmt: skip
    verdict = {"verdict": "undecided", "ranking": ranking, "sentence": text}
    assert [labels for labels, _ in open_answers(verdict)] == [
        set(either or ("side_thrust",)), {"unknown:position"}
    ]  # fmt: skip


def test_the_plain_sentences_of_the_program_are_read():
    """Below 0.9 its three most probable answers; what held-out voyages do not confirm acts as a
    whole."""

    def read(**shares):
        ranking = ranked(**shares)
        text = verdict_sentence.sentence("undecided", (), None, None, 1.0, ranking=rows_of(ranking))
        return open_answers({"verdict": "undecided", "ranking": ranking, "sentence": text})

    assert read(none=0.6, clock_offset=0.2, unknown_time=0.1, bank=0.05) == (
        ({"none"}, 0.6), ({"clock_offset"}, 0.2), ({"unknown:time"}, 0.1)
    )  # fmt: skip
    assert read(bank=0.95, current=0.91, payload=0.2) == (({"bank", "current"}, 0.91),)
    assert read(bank=0.95) == (({"bank"}, 0.95),)


def test_a_cause_at_the_wrong_place_is_no_score():
    """The port unit has lost thrust, and the starboard one is named: as wrong as another cause."""
    lost, blamed = key("thrust_loss"), named("thrust_loss")
    lost["causes"][0]["parameters"] = {"unit": {"value": "port", "unit": ""}}
    blamed["causes"][0]["parameters"] = {"actuator": {"value": "starboard"}}
    one, other = answer(lost, blamed), answer(lost, named("fouling"))
    assert scores.group_utility(one) == scores.group_utility(other) == 1.0 - (31 / 2 + 1) / 31
    assert scores.isolation([one]) == 0.0 and scores.log_score(one) == math.log(scores.FLOOR)
    blamed["causes"][0]["parameters"] = {"actuator": {"value": "port"}}
    right = answer(lost, blamed)
    assert scores.group_utility(right) == 1.0 and scores.isolation([right]) == 0.95
