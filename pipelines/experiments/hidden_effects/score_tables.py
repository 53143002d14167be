"""What a score comes to: the goals' table, a line a cause, and what was mistaken for what."""

from __future__ import annotations

import math
import statistics
from collections.abc import Sequence
from itertools import chain

from pipelines.experiments.hidden_effects import program
from pipelines.experiments.hidden_effects.goals import (
    CALIBRATION,
    CERTAIN,
    INTERVALS,
    LIMITS,
    NETWORK,
    NOT_MEASURED,
    RATES,
    Limits,
    Rate,
    Test,
    among,
    asked,
    certain,
    full,
    met,
    percent,
    right,
    small,
    statements,
    tiny,
)
from pipelines.experiments.hidden_effects.open_answers import Open
from pipelines.experiments.hidden_effects.parameters import OTHER_FORM, PRECISE, Comparison
from pipelines.experiments.hidden_effects.score import (
    ALIKE,
    FIRST,
    Answer,
    Score,
    calibration,
    clopper_pearson,
)
from shiplog.report.evaluation import tables

LENGTHS = 170.0  # as in `other_families.cases`, which needs a simulator to be imported
Row = tuple[str, str, str, str, str, str]  # what, measured, of, 90 % interval, goal, met
HEAD = ("", "measured", "of", "90 % interval", "goal", "met")
RIVALS = {  # as `rivals` calls them → as a table does
    "regression": "regression of accelerations, BIC",
    "glr": "likelihood ratio of rollouts, white noise",
    "linear": "our evidence, linearised once",
}


def text(score: Score) -> str:
    """All of it, for a screen."""
    cases = len(score.answers) + len(score.pending) + len(score.unmade)
    failed = [a for a in score.answers if a.word == "failed"]
    line = f"{score.suite}: {len(score.answers)} of {cases} cases scored"
    line += f", {sum(a.right for a in score.answers)} right" if score.answers else ""
    line += f", {len(failed)} of them without a verdict" if failed else ""
    line += f"; {len(score.pending)} not run yet" if score.pending else ""
    line += f"; {len(score.unmade)} whose logs could not be written" if score.unmade else ""
    if not score.answers:
        return f"{line}."
    programs = dict.fromkeys(name for a in score.answers for name in program.of_answers(a.steps))
    if len(programs) > 1:
        line += (
            f"; their answers are of several programs, {', '.join(programs)}, and so mean little"
        )
    parts = [f"{line}.", tables.table(HEAD, goals(score.answers)), per_cause(score.answers)]
    if any(answer.rivals for answer in score.answers):
        parts.append(methods(score.answers))
    return "\n\n".join((*parts, mistakes(score.answers)))


# --- the goals ------------------------------------------------------------------------------------


def goals(answers: Sequence[Answer]) -> list[Row]:
    """Held against the goals of the place where the cases are from."""
    away = bool(answers) and all(answer.abroad for answer in answers)
    rows = [row for rate in (*RATES, *NETWORK) if (row := _rate(rate, answers, away))]
    rows += [*_parameters(answers, away), *_gain(answers), *_calibration(answers, away)]
    return rows + times(answers)


def _rate(rate: Rate, answers: Sequence[Answer], away: bool) -> Row | None:
    hits = rate.hits(answers)
    return _share(rate.what, hits, rate.abroad if away else rate.home) if hits else None


def _share(what: str, hits: Sequence[bool], limits: Limits) -> Row:
    share, (low, high) = sum(hits) / len(hits), clopper_pearson(sum(hits), len(hits))
    return (
        what, percent(share), f"{sum(hits)}/{len(hits)}", f"{percent(low)} to {percent(high)}",
        asked(limits), met(share, limits),
    )  # fmt: skip


def _parameters(answers: Sequence[Answer], away: bool) -> list[Row]:
    """Of causes that were named, as no other has parameters. The goal is for one at full size."""
    alone = among("one", full)
    rows: list[Row] = []
    for what, test, goal in (
        ("size 1, 7000 s", alone, True),
        ("the other cases", lambda answer: not alone(answer), False),
    ):
        found = [pair for answer in answers if test(answer) for pair in answer.compared.items()]
        found = [(name, one) for name, one in found if name not in OTHER_FORM]
        precise = [one for name, one in found if name in PRECISE]
        rest = [one for name, one in found if name not in PRECISE]
        for group, most, each in (("zeros, clocks, current", 0.03, precise), ("rest", 0.10, rest)):
            if errors := [one.error for one in each if one.error is not None]:
                measured = statistics.median(errors)
                limits = (None, most) if goal else (None, None)
                name = f"parameters, {what}: {group}, median error"
                rows.append((
                    name, percent(measured), str(len(errors)), "",
                    asked(limits), met(measured, limits),
                ))  # fmt: skip
        if covered := [*chain.from_iterable(one.covered for _, one in found)]:
            name = f"parameters, {what}: {INTERVALS}"
            rows.append(_share(name, covered, LIMITS[INTERVALS][away]))
    return rows


def _gain(answers: Sequence[Answer]) -> list[Row]:
    """Of causes at full size that were named."""
    name = "held-out gain over the oracle's: "
    shares = [a.recovered for a in answers if a.recovered is not None and full(a)]
    if not shares:
        return [(f"{name}median", NOT_MEASURED, "0", "", ">= 98 %", "")]
    of = (("median", statistics.median(shares), 0.98), ("worst tenth", _tenth(shares), 0.95))
    return [
        (f"{name}{what}", percent(share), str(len(shares)), "", f">= {percent(least)}",
         met(share, (least, None)))
        for what, share, least in of
    ]  # fmt: skip


def _tenth(shares: Sequence[float]) -> float:
    """What nine of ten exceed."""
    return sorted(shares)[len(shares) // 10]


def _calibration(answers: Sequence[Answer], away: bool) -> list[Row]:
    pairs, limits = statements(answers), LIMITS[CALIBRATION][away]
    if not pairs:
        return [(CALIBRATION, NOT_MEASURED, "0", "", asked(limits), "")]
    error = calibration(pairs)
    rows: list[Row] = [
        (CALIBRATION, percent(error), str(len(pairs)), "", asked(limits), met(error, limits))
    ]
    if sure := certain(answers):
        rows.append(_share(CERTAIN, sure, LIMITS[CERTAIN][away]))
    return rows


def times(answers: Sequence[Answer]) -> list[Row]:
    """Of diagnoses of whole trials that came to an end. CPU time is what one core would take.

    What is not the same work has rows of its own: trials that are longer, and the first case of a
    ship, which fits its nominal campaign. The program keeps that fit for the later ones.
    """
    rows: list[Row] = []
    for model, limit in (("mmg", 10.0), ("feedforward", 60.0)):
        mine = [a for a in answers if a.planned.seconds == 7000 and a.planned.model == model]
        groups: dict[tuple[bool, bool], list[Answer]] = {}
        for answer in mine:
            if answer.step("diagnose"):
                long = trial_seconds(answer) > answer.planned.seconds
                groups.setdefault((long, not answer.step("train")), []).append(answer)
        for (long, later), given in sorted(groups.items()):
            longest = max(map(trial_seconds, given))
            length = f"of more, to {longest:.0f} s" if long else "7000 s"
            case = "later case of a ship" if later else "first case of a ship"
            rows += _times(f"diagnose {length}, {model}, {case}", given, None if long else limit)
    return rows


def _times(what: str, answers: Sequence[Answer], limit: float | None) -> list[Row]:
    steps = [step for answer in answers if (step := answer.step("diagnose"))]
    cpu, wall, peak = ([step[k] for step in steps] for k in ("cpu_s", "wall_s", "peak_mb"))
    middle, count = statistics.median(cpu), str(len(steps))
    goal = "" if limit is None else f"<= {limit:.0f} s"
    reached = "" if limit is None else "yes" if middle <= limit else "no"
    return [
        (
            f"{what}: CPU time, median (worst)", f"{middle:.1f} s ({max(cpu):.1f} s)", count, "",
            goal, reached,
        ),
        (
            f"{what}: wall time, median (worst)",
            f"{statistics.median(wall):.1f} s ({max(wall):.1f} s)", count, "", "", "",
        ),
        (
            f"{what}: peak memory, median (worst)",
            f"{statistics.median(peak):.0f} MB ({max(peak):.0f} MB)", count, "", "", "",
        ),
    ]  # fmt: skip


def trial_seconds(answer: Answer) -> float:
    """How long a trial of 7000 s is: a large ship's takes 170 times its L/U
    (`other_families.cases.LENGTHS`), where that is more."""
    ship = answer.key.get("ship") or {}
    if not answer.abroad or "length" not in ship:
        return float(answer.planned.seconds)
    unit = ship["length"]["value"] / ship["speed"]["value"]
    return max(float(answer.planned.seconds), LENGTHS * unit)


# --- simpler methods ------------------------------------------------------------------------------


def methods(answers: Sequence[Answer]) -> str:
    """Each on the cases that every one of them was asked: right of n for one cause hidden, and
    false names of n for nothing hidden."""
    asked = [answer for answer in answers if answer.rivals]
    names = [n for n in dict.fromkeys((*RIVALS, *chain.from_iterable(a.rivals for a in asked)))
             if all(n in a.rivals for a in asked)]  # fmt: skip
    columns: dict[str, tuple[Test, Test]] = {
        "size 1": (among("one", full), right),
        "0.3 to 1": (among("one", small), right),
        "500 s": (among("one", full, 500), right),
        "nothing hidden: a cause named": (
            among("none", seconds=None), lambda answer: bool(answer.named)
        ),
    }  # fmt: skip
    rows = []
    each = {RIVALS.get(name, name): [a.by(name) for a in asked] for name in names}
    for title, given in (each | {"shiplog diagnose": asked}).items():
        cells = []
        for test, hit in columns.values():
            hits = [hit(answer) for answer in given if test(answer)]
            share = f" ({percent(sum(hits) / len(hits))})" if hits else ""
            cells.append(f"{sum(hits)}/{len(hits)}{share}" if hits else "")
        rows.append((title, *cells))
    table = tables.table((f"method, {len(asked)} cases", *columns), rows)
    failed = sum(step["step"] == "rivals" and step["rc"] != 0 for a in answers for step in a.steps)
    return table + (f"\n{failed} more where the simpler methods failed" if failed else "")


# --- by cause, and mistakes -----------------------------------------------------------------------


def per_cause(answers: Sequence[Answer]) -> str:
    """Right of n for what is hidden alone, named of n next to another, errors wherever named."""
    columns = {
        "size 1": among("one", full), "0.3 to 1": among("one", small),
        "below": among("one", tiny), "500 s": among("one", seconds=500),
        "outside": among("outside", seconds=None),
    }  # fmt: skip
    names = dict.fromkeys(chain.from_iterable(a.hidden for a in answers))
    rows = []
    for name in sorted(names):
        mine = [answer for answer in answers if name in answer.hidden]
        cells = []
        for test in columns.values():
            right = [answer.right for answer in mine if test(answer)]
            cells.append(f"{sum(right)}/{len(right)}" if right else "")
        beside = [name in answer.named for answer in mine if answer.kind == "two"]
        cells.append(f"{sum(beside)}/{len(beside)}" if beside else "")
        compared = [answer.compared[name] for answer in mine if name in answer.compared]
        star = " *" if name in OTHER_FORM else ""
        rows.append((name + star, *cells, *_compared(compared)))
    head = ("hidden", *columns, "of two", "median error", "90 % intervals")
    return tables.table(head, rows) + "\n* another form in the simulator: no goal for its numbers"


def _compared(compared: Sequence[Comparison]) -> tuple[str, str]:
    errors = [one.error for one in compared if one.error is not None]
    covered = [*chain.from_iterable(one.covered for one in compared)]
    return (
        percent(statistics.median(errors)) if errors else "",
        f"{sum(covered)}/{len(covered)}" if covered else "",
    )


def mistakes(answers: Sequence[Answer]) -> str:
    """One line a case that is not right, and how to make its logs again."""
    wrong = [answer for answer in answers if not answer.right]
    if not wrong:
        return "Nothing was mistaken."
    rows = [
        (a.planned.label, hidden(a), reported(a), _margin(a), _again(a))
        for a in sorted(wrong, key=lambda a: (a.kind, a.hidden))
    ]
    away = all(answer.abroad for answer in wrong)
    simulator = (
        "pipelines.experiments.other_families" if away else "pipelines.experiments.simulated_ship"
    )
    head = ("case", "hidden", "reported", "margin", f"python -m {simulator} case")
    return tables.table(head, rows)


def hidden(answer: Answer) -> str:
    """What the key says, with sizes."""
    if not answer.hidden:
        return "nothing"
    causes = [f"{one['name']} x{one['size']:.2g}" for one in answer.key["causes"]]
    family = (answer.key.get("structure") or {}).get("family")
    return " + ".join(causes) + (f" ({family})" if family else "")


def marked(answer: Answer) -> str:
    """What the verdict says, and whether it is wrong or not right."""
    mark = "" if answer.right else " (wrong name)" if answer.misnamed else " (not right)"
    return reported(answer) + mark


def reported(answer: Answer) -> str:
    """What the verdict says."""
    if answer.word == "failed":
        return f"failed: {answer.verdict.get('step')} ended with {answer.verdict.get('rc')}"
    words = [answer.word, " + ".join(answer.named), f"({answer.family})" if answer.family else ""]
    others = chain.from_iterable(c.get("indistinguishable_from") or () for c in answer.reported)
    alike = list(dict.fromkeys(others)) if answer.named else []
    if alike:
        words.append(f"or {', '.join(alike)}")
    if answer.word == "undecided":
        words.append(" or ".join(_together(labels) for labels in _first(answer.open)))
    if traces := [one["name"] for one in answer.verdict.get("traces") or ()]:
        words.append(f"[trace: {', '.join(traces)}]")
    return " ".join(word for word in words if word)


def _first(answers: Sequence[Open]) -> list[frozenset[str]]:
    """The first two answers, and what is as probable as the second."""
    return [
        labels for labels, p in answers if sum(other > p + ALIKE for _, other in answers) < FIRST
    ]


def _together(labels: frozenset[str]) -> str:
    return " + ".join(sorted(labels))


def _margin(answer: Answer) -> str:
    """Over the runner-up in nats, where the verdict gives one; the contract does not ask for it."""
    for place in (answer.verdict, *answer.reported, answer.verdict.get("structure") or {}):
        if isinstance(margin := place.get("margin"), int | float) and math.isfinite(margin):
            return f"{margin:.1f}"
    return ""


def _again(answer: Answer) -> str:
    return " ".join((str(answer.planned.seed), "LOGS --key KEY", *answer.planned.options))
