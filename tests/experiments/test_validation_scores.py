"""The scores of the validation page against values worked by hand or published; and that a page is
of one program."""

import itertools
import math
import statistics
from dataclasses import replace

import pytest

from pipelines.experiments.hidden_effects import (
    goals,
    methods,
    parameters,
    score,
    score_tables,
    scores,
    validation,
)
from pipelines.experiments.hidden_effects.plan import Planned
from pipelines.experiments.hidden_effects.score import Answer, clopper_pearson
from pipelines.experiments.other_families import cases as other_cases
from pipelines.experiments.simulated_ship.cases import CATALOGUE, DEVICES

COMMIT = {"step": "diagnose", "rc": 0, "commit": "a" * 40, "dirty": False,
          "cpu_s": 9.0, "wall_s": 10.0, "peak_mb": 900.0}  # fmt: skip


def key(*names, family=None, size=1.0):
    causes = [{"name": name, "size": size, "parameters": {}} for name in names]
    verdict = "unknown" if family else "named" if names else "none"
    return {"verdict": verdict, "causes": causes,
            "structure": {"family": family} if family else None}  # fmt: skip


def named(*names, group=(), p=0.95):
    causes = [{"name": n, "probability": p, "indistinguishable_from": list(group)} for n in names]
    return {"verdict": "named", "causes": causes, "ranking": ranked(**{names[0]: p})}


def ranked(**shares):
    """`unknown_position` stands for `unknown:position`."""
    names = {n: n.replace("unknown_", "unknown:") for n in shares}
    return [{"name": names[n], "probability": p} for n, p in shares.items()]


def undecided(**shares):
    return {"verdict": "undecided", "causes": [], "ranking": ranked(**shares)}


def none(**shares):
    return {"verdict": "none", "causes": [], "ranking": ranked(**shares)}


def unknown(family, **shares):
    structure = {"family": family}
    return {"verdict": "unknown", "causes": [], "structure": structure, "ranking": ranked(**shares)}


FAILED = {"verdict": "failed", "step": "diagnose", "rc": 1}


def answer(hidden, verdict, seed=1, family="", **more):
    planned = Planned(str(seed), seed, None, None, 7000, family=family)
    return Answer(planned, verdict, hidden, [COMMIT], **more)


CURRENT = key("current")
TETHER = key("tether", family="position")


# --- shares ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("hits", "count", "low", "high"),
    [(81, 263, 0.2527, 0.3676), (15, 148, 0.0578, 0.1617), (0, 20, 0.0, 0.1684),
     (1, 29, 0.0009, 0.1776)],
)  # fmt: skip
def test_clopper_pearsons_intervals_as_published(hits, count, low, high):
    """Newcombe 1998, Statistics in Medicine 17, table I, method 5, 95 %."""
    assert clopper_pearson(hits, count, 0.95) == pytest.approx((low, high), abs=5e-5)


def test_the_ends_of_a_share_are_in_closed_form():
    """None of n: 1 - tail^(1/n). All of n: tail^(1/n)."""
    assert clopper_pearson(0, 10) == pytest.approx((0.0, 1.0 - 0.05**0.1))
    assert clopper_pearson(10, 10) == pytest.approx((0.05**0.1, 1.0))


# --- undecided, and the group ---------------------------------------------------------------------


@pytest.mark.parametrize(
    ("hidden", "verdict", "found", "misnamed"),
    [
        (CURRENT, undecided(fouling=0.5, current=0.4, bank=0.1), True, False),
        (CURRENT, undecided(fouling=0.5, bank=0.3, current=0.2), False, False),
        (CURRENT, undecided(**{"fouling": 0.6, "current": 0.2}), True, False),
        (CURRENT, named("fouling", group=["current"]), True, True),
        (CURRENT, named("fouling", group=["bank"]), False, True),
        (CURRENT, named("fouling", "bank", group=["current"]), False, True),
        (key("current", "bank"), named("bank", "fouling", group=["current"]), True, True),
        (key("current", "bank"), named("fouling", group=["current", "bank"]), False, True),
        # each answer is one cause, and both are hidden
        (key("current", "bank"), undecided(bank=0.6, current=0.3), False, False),
        # of three that are as probable none is among the first two; of two both are
        (CURRENT, undecided(current=0.3, bank=0.3, fouling=0.3), False, False),
        (CURRENT, undecided(bank=0.5, current=0.25, fouling=0.25), False, False),
        (CURRENT, undecided(bank=0.5, current=0.5), True, False),
        (TETHER, undecided(current=0.5, unknown_position=0.4), True, False),
        (TETHER, undecided(unknown_controls=0.5, current=0.4), False, False),
        (TETHER, unknown("position"), True, False),
        (TETHER, unknown("controls"), False, False),
        (key(), undecided(current=0.5, none=0.4), True, False),
        (key(), none(none=0.9), True, False),
        (CURRENT, none(none=0.9), False, False),
        (CURRENT, FAILED, False, False),
    ],
)
def test_found_is_right_or_in_the_group_or_among_the_first_two(hidden, verdict, found, misnamed):
    one = answer(hidden, verdict)
    assert (one.found, one.misnamed) == (found, misnamed)


def test_an_undecided_verdict_is_an_alarm_and_no_name():
    clean, effect = answer(key(), undecided(current=0.5)), answer(CURRENT, undecided(current=0.5))
    assert scores.alarms_on_clean([clean]) == [True] and scores.alarms_on_effects([effect]) == [
        True
    ]
    assert not clean.right and not effect.right and not effect.named
    assert effect.statements == ((0.5, True),)
    assert "undecided current" in score_tables.reported(effect)


# --- the goals' table -----------------------------------------------------------------------------

ANSWERS = [
    answer(CURRENT, named("current"), 1),
    answer(CURRENT, named("fouling", group=["current"]), 2),
    answer(CURRENT, undecided(bank=0.5, current=0.4), 3),
    answer(CURRENT, FAILED, 4),
    answer(key(), none(none=0.8, current=0.2), 5),
    answer(key(), undecided(none=0.6, current=0.4), 6),
    answer(TETHER, unknown("position", unknown_position=0.7), 7),
    answer(TETHER, undecided(current=0.6, unknown_position=0.3), 8),
    answer(TETHER, unknown("wind", unknown_wind=1.0), 9),
    answer(key("current", "bank"), named("bank"), 10),
]


def test_the_rows_of_the_goals_count_by_hand():
    found = {what: share for what, (share, _) in goals.figures(ANSWERS).items()}
    assert found["named but wrong, any size"] == pytest.approx(1 / 10)
    assert found["named but wrong, and the truth not among its alternatives"] == 0.0
    assert found["nothing hidden: any alarm"] == pytest.approx(1 / 2)
    assert found["one cause, size 1, 7000 s: named right"] == pytest.approx(1 / 4)
    assert found[
        "the same: right among its alternatives, or undecided and among the first two"
    ] == pytest.approx(3 / 4)
    assert found["outside, size 1: unknown or undecided, right remainder"] == pytest.approx(2 / 3)
    assert found["two at once, size 1: both, no third"] == 0.0
    assert found["traceback, or no verdict in time"] == pytest.approx(1 / 10)
    # stated with 0.9 and more: current and one of two (both hidden), fouling, and another family
    assert found[goals.CERTAIN] == pytest.approx(2 / 4)
    assert found["outside, size 1: position"] == pytest.approx(2 / 3)
    assert "outside, size 1: wind" not in found  # an answer, and never the truth here
    # 0.95 twice true and once not, 1.0 not; 0.8 and 0.7 true; of 0.5 to 0.6 one, of 0.6 one of two
    apart = (2 - 3.85) + 0.0  # of 0.9 to 1.0, and the others one by one
    others = abs(1 - 0.8) + abs(1 - 0.7) + abs(0 - 0.5) + abs(1 - 1.2)
    assert found[goals.CALIBRATION] == pytest.approx((abs(apart) + others) / 9)
    assert goals.cell([True, False]) == "50 % (1/2) [2.5, 97.5]"  # 1 - √0.95 = 2.5 %


def test_home_and_abroad_have_goals_of_their_own():
    away = [replace(a, planned=replace(a.planned, family="catamaran")) for a in ANSWERS[:1]]
    lines = goals.table(ANSWERS[:1], away).splitlines()
    row = next(line for line in lines if "named right" in line)
    assert [cell.strip() for cell in row.strip("|").split("|")][1:] == [
        "100 % (1/1) [5.0, 100.0]", ">= 97 %", "yes",
        "100 % (1/1) [5.0, 100.0]", ">= 85 %", "yes",
    ]  # fmt: skip
    assert goals.ROWS["named but wrong, any size"] == ((None, 0.01), (None, 0.015))
    lines = score_tables.goals(away)
    assert next(r for r in lines if "named right" in r[0])[-2] == ">= 85 %"


# --- scores of the literature ---------------------------------------------------------------------


def test_the_repair_utility_by_hand():
    """Four components: one missed among three takes 1 · 4/2 tests, one false among one 1 · 2/2."""
    assert scores.repair_utility({"b"}, {"a"}, 4) == pytest.approx(1.0 - (2.0 + 1.0) / 4.0)
    assert scores.repair_utility({"a"}, {"a"}, 4) == 1.0
    assert scores.repair_utility(set(), {"a"}, 4) == pytest.approx(1.0 - 2.5 / 4.0)
    assert scores.repair_utility({"b", "c", "d"}, {"a"}, 4) == pytest.approx(0.0)


def test_the_repair_utility_is_the_mean_over_all_orders_of_testing():
    """Components tested one after another until the last missed, and the last false, is found."""
    everything, true, reported = "abcde", {"a", "b"}, {"b", "c", "d"}

    def tests(wanted, pool):
        orders = [*itertools.permutations(sorted(pool))]
        return statistics.mean(
            max((order.index(one) + 1 for one in wanted), default=0) for order in orders
        )

    vain = tests(true - reported, set(everything) - reported) + tests(reported - true, reported)
    assert scores.repair_utility(reported, true, 5) == pytest.approx(1.0 - vain / 5.0)


def test_the_group_score_is_the_mean_of_what_is_left_open():
    f = scores.COMPONENTS
    assert f == len(parameters.NAMES) + 1 == 31
    wrong = 1.0 - (31 / 2 + 1) / f  # one missed of 30 not reported, one false of one
    silent = 1.0 - (32 / 2) / f
    expected = {
        (1.0 + wrong) / 2: (CURRENT, named("fouling", group=["current"])),
        wrong: (CURRENT, named("fouling")),
        silent: (CURRENT, none()),
        1.0: (key(), none()),
        0.6 * wrong + 0.3 + 0.1 * silent: (
            CURRENT, undecided(fouling=0.6, current=0.3, none=0.1)
        ),
        0.0: (CURRENT, FAILED),
    }  # fmt: skip
    for value, case in expected.items():
        assert scores.group_utility(answer(*case)) == pytest.approx(value)
    assert (
        scores.group_utility(answer(TETHER, unknown("wind"))) == 1.0
    )  # the component is `outside`
    halves = scores.candidates(answer(CURRENT, named("fouling", "bank", group=["current"])))
    assert sum(halves.values()) == len(halves) == 4


def test_isolation_is_the_mean_probability_of_the_truth_where_there_was_an_alarm():
    given = [
        answer(CURRENT, named("current", p=0.9)),
        answer(CURRENT, undecided(bank=0.7, current=0.2)),
        answer(CURRENT, none(none=0.9, current=0.1)),  # not detected
        answer(CURRENT, FAILED),  # nor this
        answer(key(), undecided(current=0.9)),  # nothing to isolate
        answer(TETHER, unknown("position", unknown_position=0.6, unknown_wind=0.4)),
        # it says `motion`, so that what it ranks is not what it gives the truth
        answer(TETHER, unknown("motion", unknown_position=1.0)),
        answer(key("current", "bank"), named("bank", p=0.8)),  # current has nothing
    ]
    assert scores.isolation(given) == pytest.approx((0.9 + 0.2 + 0.6 + 0.0 + 0.4) / 5)
    assert scores.isolation(given[2:5]) is None
    assert scores.alarms_on_effects(given) == [True, True, False, False, True, True, True]
    assert scores.right_among_alarms(given) == [True, False, False, True, False, False]


def test_the_log_score_by_hand_and_at_its_floor():
    given = {
        math.log(0.9): (CURRENT, named("current", p=0.9)),
        math.log(0.2): (CURRENT, undecided(bank=0.7, current=0.2)),
        math.log(0.8): (key(), none(none=0.8, current=0.2)),
        math.log(scores.FLOOR): (CURRENT, named("bank", p=1.0)),
        0.0: (key(), {"verdict": "none", "causes": []}),  # no probability: sure of what it says
        math.log(0.5 * 0.4): (key("current", "bank"), undecided(bank=0.5, current=0.4)),
    }
    for value, case in given.items():
        assert scores.log_score(answer(*case)) == pytest.approx(value)
    assert scores.log_score(answer(CURRENT, FAILED)) == math.log(0.01)
    reported = scores.prevalence(ANSWERS)
    assert reported == "nothing 2/10, one cause 4/10, two at once 1/10, outside 3/10"


# --- the other methods ---------------------------------------------------------------------------


def test_scores_in_nats_become_probabilities_over_none():
    rival = {"answer": "clock_offset:wind", "ranking": [
        {"name": "clock_offset:wind", "score": 2.0}, {"name": "clock_offset:gnss", "score": 1.0},
        {"name": "current", "score": -800.0},
    ]}  # fmt: skip
    one = answer(CURRENT, none(), rivals={"regression": rival}).by("regression")
    total = math.e**2 + math.e + 1.0
    assert one.statements == ((pytest.approx((math.e**2 + math.e) / total), False),)
    silent = replace(one, rivals={"regression": rival | {"answer": None}}).by("regression")
    assert silent.statements == ((pytest.approx(1.0 / total), False),)  # `none` is what it says
    assert one.probability("none") == pytest.approx(1.0 / total)
    assert one.probability("current") == pytest.approx(0.0, abs=1e-300)


def test_null_and_random_need_no_run():
    cases = [answer(key() if s % 4 == 0 else CURRENT, FAILED, seed=s) for s in range(2200)]
    found = methods.answers(cases)
    assert set(found) == {methods.PROGRAM, methods.NULL, methods.RANDOM}
    assert sum(a.right for a in found[methods.NULL]) == 550
    assert scores.isolation(found[methods.NULL]) is None
    silent = [a.word == "none" for a in found[methods.RANDOM]]
    low, high = clopper_pearson(sum(silent), len(silent), 0.9999)
    assert low < 1 / 31 < high
    assert methods.random(cases[7]).verdict == methods.random(cases[7]).verdict
    assert all(scores.log_score(a) == pytest.approx(-math.log(31)) for a in found[methods.RANDOM])
    devices = {name.partition(":")[0] for name in DEVICES} | {"actuators_exchanged"}
    assert set(parameters.NAMES) == set(CATALOGUE) | devices


def test_a_method_answers_the_cases_that_it_was_asked():
    broke = {"step": "rivals", "rc": 1, "commit": "a" * 40, "dirty": False}
    reported = {"regression": {"answer": None, "ranking": []}, "glr": {"answer": "current"}}
    given = [
        answer(CURRENT, none(), rivals=reported),
        replace(answer(CURRENT, none()), steps=[COMMIT, broke]),
        answer(CURRENT, none()),
    ]
    found = methods.answers(given)
    assert [a.word for a in found["likelihood ratio"]] == ["named", "failed"]
    assert len(found[methods.PROGRAM]) == 3


# --- one program a table --------------------------------------------------------------------------


def scored(*answers):
    return [score.Score("goals", tuple(answers), (), ())]


def test_the_page_begins_with_three_numbers_and_the_misses_have_their_own_the_worst_first():
    page = validation.page(scored(*ANSWERS))
    text, first = page.text, page.pages[""]
    assert first.index("Three numbers") < first.index("## Goals") < first.index("## Reliability")
    assert page.pages[validation.MISSES].startswith("# What went wrong")
    assert text.index("# What went wrong") < text.index("## All methods")
    lines = [line for line in validation.misses(ANSWERS).splitlines() if line.startswith("|")][2:]
    assert [line.strip("| ").split("|")[0].strip() for line in lines] == [
        "2", "6", "4", "9", "10", "3", "8",
    ]  # fmt: skip
    assert "| wrong name, the truth among its alternatives " in lines[0] and "| 0.95 " in lines[0]
    assert "aaaaaaaaaaaa" not in text and "no version has" not in text
    assert "always none" in text and "random answer" in text


def test_each_family_of_ships_is_held_against_its_own_goals():
    away = [replace(a, planned=replace(a.planned, family="catamaran")) for a in ANSWERS]
    text = validation.page(scored(*away)).text
    methods_table = text.partition("## All methods: other families of equations")[2]
    row = next(line for line in methods_table.splitlines() if "named but wrong, any" in line)
    assert [cell.strip() for cell in row.strip("|").split("|")][1] == "<= 1.5 %"


def test_each_type_of_ship_has_a_line_and_those_without_shipmmg_one():
    """Two of three right abroad, and one of two without the package's ship; one wrong name."""
    found = [("shipmmg", "current"), ("abkowitz", "current"), ("abkowitz", "fouling")]
    given = [answer(CURRENT, named(n), i, family) for i, (family, n) in enumerate(found)]
    rows = [
        [cell.strip() for cell in line.strip("|").split("|")]
        for line in validation.types(given).splitlines()[2:]
    ]
    assert [(row[0], row[1][:11], row[2][:11], row[3]) for row in rows] == [
        ("abkowitz", "50 % (1/2) ", "50 % (1/2) ", "2"),
        ("shipmmg", "100 % (1/1)", "0 % (0/1) [", "1"),
        ("all but shipmmg", "50 % (1/2) ", "50 % (1/2) ", "2"),
    ]
    assert len(validation.types(given[1:]).splitlines()) == 3
    text = validation.page(scored(*given)).text
    assert "### Each type of ship" in text and "shipmmg` is an MMG too" in text
    assert "### Each type of ship" not in validation.page(scored(*ANSWERS)).text


def test_attempts_are_counted_where_they_were():
    second = replace(ANSWERS[0], steps=[COMMIT | {"attempt": 2}])
    first = replace(ANSWERS[1], steps=[COMMIT | {"attempt": 1}])
    assert "a case that fails is run again: 1 of these were" in (
        validation.page(scored(first, second)).text
    )
    assert "do not record how often" in validation.page(scored(first, ANSWERS[0])).text


def test_two_programs_are_not_put_into_one_table():
    other = replace(ANSWERS[0], steps=[COMMIT | {"commit": "b" * 40}])
    with pytest.raises(validation.Mixed, match=r"aaaaaaaaaaaa \(10 cases\), bbbbbbbbbbbb \(1 c"):
        validation.page(scored(*ANSWERS, other))
    dirty = replace(ANSWERS[0], steps=[COMMIT | {"dirty": True}])
    with pytest.raises(validation.Mixed, match=r"aaaaaaaaaaaa\+changes"):
        validation.page(scored(*ANSWERS, dirty))
    asked_later = COMMIT | {"step": "rivals", "commit": "b" * 40}
    with pytest.raises(validation.Mixed):
        validation.page(scored(replace(ANSWERS[0], steps=[COMMIT, asked_later])))
    with pytest.raises(validation.Mixed, match="there twice"):
        validation.page(scored(*ANSWERS, ANSWERS[0]))
    old = [
        replace(
            ANSWERS[0], steps=[{k: v for k, v in COMMIT.items() if k not in ("commit", "dirty")}]
        )
    ]
    assert "is not recorded" in validation.page(scored(*old)).text


def test_a_large_ships_trial_is_as_long_as_its_simulator_makes_it():
    assert score_tables.LENGTHS == other_cases.LENGTHS
