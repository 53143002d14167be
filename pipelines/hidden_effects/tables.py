"""What a score comes to: the goals' table, a line a cause, and what was mistaken for what."""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import chain

from pipelines.hidden_effects.parameters import (
    ABSORBED,
    OTHER_FORM,
    PRECISE,
    SURVIVE,
    Comparison,
)
from pipelines.hidden_effects.score import Answer, Score, calibration, wilson
from shiplog import report

Test = Callable[[Answer], bool]
Row = tuple[str, str, str, str, str, str]  # what, measured, of, 90 % interval, goal, met
HEAD = ("", "measured", "of", "90 % interval", "goal", "met")
NOT_MEASURED = "not measured"
FULL, SMALL = 1.0, 0.3
SURE = 0.9
RIVALS = {  # as `rivals` calls them → as a table does
    "regression": "regression of accelerations, BIC",
    "glr": "likelihood ratio of rollouts, white noise",
    "linear": "our evidence, linearised once",
}


def _full(answer: Answer) -> bool:
    return answer.size > FULL - 1e-9


def _small(answer: Answer) -> bool:
    return answer.size > SMALL - 1e-9 and not _full(answer)


def _among(kind: str, sized: Test = lambda answer: True, seconds: int | None = 7000) -> Test:
    def test(answer: Answer) -> bool:
        there = seconds is None or answer.planned.seconds == seconds
        return there and _physics(answer) and answer.kind == kind and sized(answer)

    return test


def _physics(answer: Answer) -> bool:
    return answer.planned.model == "mmg"


def _network(causes: Sequence[str]) -> Test:
    return lambda answer: not _physics(answer) and set(answer.hidden) <= set(causes)


def _tiny(answer: Answer) -> bool:
    return not _full(answer) and not _small(answer)


def _right(answer: Answer) -> bool:
    return answer.right


@dataclass(frozen=True, slots=True)
class Rate:
    """A share of cases, and the goal for it: at least, at most, or none."""

    what: str
    among: Test
    hit: Test
    least: float | None = None
    most: float | None = None


RATES = (
    Rate("one cause, size 1, 7000 s: named right", _among("one", _full), _right, least=0.97),
    Rate("one cause, size 0.3 to 1, 7000 s", _among("one", _small), _right, least=0.92),
    Rate("one cause, size below 0.3, 7000 s", _among("one", _tiny), _right),
    Rate("one cause, size 1, 500 s", _among("one", _full, 500), _right, least=0.90),
    Rate(
        "nothing hidden: a cause named", _among("none", seconds=None),
        lambda answer: bool(answer.named), most=0.01,
    ),
    Rate(
        "nothing hidden: any alarm", _among("none", seconds=None),
        lambda answer: answer.word != "none", most=0.05,
    ),
    Rate(
        "named but wrong, any size", _physics, lambda answer: answer.misnamed, most=0.02
    ),
    Rate("outside, size 1: unknown, right family", _among("outside", _full), _right, least=0.95),
    Rate(
        "outside, size below 1", _among("outside", lambda answer: not _full(answer)), _right
    ),
    Rate("two at once, size 1: both, no third", _among("two", _full), _right, least=0.90),
    Rate("two at once, size below 1", _among("two", lambda answer: not _full(answer)), _right),
    Rate("network on affected data: what it cannot take in", _network(SURVIVE), _right, least=0.90),
    Rate(
        "network on affected data: what it has taken in, named", _network(ABSORBED),
        lambda answer: not answer.misnamed and bool(answer.named), most=0.0,
    ),
    Rate(
        "network on affected data: named but wrong", lambda answer: not _physics(answer),
        lambda answer: answer.misnamed, most=0.02,
    ),
)  # fmt: skip


def text(score: Score) -> str:
    """All of it, for a screen."""
    cases = len(score.answers) + len(score.pending) + len(score.unmade)
    failed = [a for a in score.answers if a.word == "failed"]
    said = f"{score.suite}: {len(score.answers)} of {cases} cases scored"
    said += f", {sum(a.right for a in score.answers)} right" if score.answers else ""
    said += f", {len(failed)} of them without a verdict" if failed else ""
    said += f"; {len(score.pending)} not run yet" if score.pending else ""
    said += f"; {len(score.unmade)} whose logs could not be written" if score.unmade else ""
    if not score.answers:
        return f"{said}."
    parts = [f"{said}.", report.table(HEAD, goals(score.answers)), per_cause(score.answers)]
    if any(answer.rivals for answer in score.answers):
        parts.append(methods(score.answers))
    return "\n\n".join((*parts, mistakes(score.answers)))


# --- the goals ------------------------------------------------------------------------------------


def goals(answers: Sequence[Answer]) -> list[Row]:
    rows = [row for rate in RATES if (row := _rate(rate, answers))]
    rows += [*_parameters(answers), *_gain(answers), *_calibration(answers)]
    return rows + _times(answers)


def _rate(rate: Rate, answers: Sequence[Answer]) -> Row | None:
    """A case without a verdict counts: it is neither right nor `none`."""
    hits = [rate.hit(answer) for answer in answers if rate.among(answer)]
    return _share(rate.what, hits, rate.least, rate.most) if hits else None


def _share(what: str, hits: Sequence[bool], least: float | None, most: float | None) -> Row:
    share, (low, high) = sum(hits) / len(hits), wilson(sum(hits), len(hits))
    goal = [f"{sign} {_percent(v)}" for sign, v in ((">=", least), ("<=", most)) if v is not None]
    met = (least is None or share >= least) and (most is None or share <= most)
    return (
        what, _percent(share), f"{sum(hits)}/{len(hits)}", f"{_percent(low)} to {_percent(high)}",
        " and ".join(goal), _met(met) if goal else "",
    )  # fmt: skip


def _percent(share: float) -> str:
    return f"{100.0 * share:.1f} %".replace(".0 %", " %")


def _met(met: bool) -> str:
    return "yes" if met else "no"


def _parameters(answers: Sequence[Answer]) -> list[Row]:
    """Of causes that were named, as no other has parameters. The goal is for one at full size."""
    full = _among("one", _full)
    rows: list[Row] = []
    for what, among, goal in (
        ("size 1, 7000 s", full, True),
        ("the other cases", lambda answer: not full(answer), False),
    ):
        found = [pair for answer in answers if among(answer) for pair in answer.compared.items()]
        found = [(name, one) for name, one in found if name not in OTHER_FORM]
        precise = [one for name, one in found if name in PRECISE]
        rest = [one for name, one in found if name not in PRECISE]
        for group, most, each in (("zeros, clocks, current", 0.03, precise), ("rest", 0.10, rest)):
            if errors := [one.error for one in each if one.error is not None]:
                measured = statistics.median(errors)
                limit, met = f"<= {_percent(most)}", _met(measured <= most)
                name = f"parameters, {what}: {group}, median error"
                row = (name, _percent(measured), str(len(errors)), "")
                rows.append((*row, limit, met) if goal else (*row, "", ""))
        if covered := [*chain.from_iterable(one.covered for _, one in found)]:
            name = f"parameters, {what}: 90 % intervals right"
            rows.append(_share(name, covered, *((0.85, 0.95) if goal else (None, None))))
    return rows


def _gain(answers: Sequence[Answer]) -> list[Row]:
    """Of causes at full size that were named."""
    name = "held-out gain over the oracle's: "
    shares = [a.recovered for a in answers if a.recovered is not None and _full(a)]
    if not shares:
        return [(f"{name}median", NOT_MEASURED, "0", "", ">= 98 %", "")]
    of = (("median", statistics.median(shares), 0.98), ("worst tenth", _tenth(shares), 0.95))
    return [
        (f"{name}{what}", _percent(share), str(len(shares)), "", f">= {_percent(least)}",
         _met(share >= least))
        for what, share, least in of
    ]  # fmt: skip


def _tenth(shares: Sequence[float]) -> float:
    """What nine of ten exceed."""
    return sorted(shares)[len(shares) // 10]


def _calibration(answers: Sequence[Answer]) -> list[Row]:
    name = "calibration: expected error, 10 bins"
    beliefs = [answer.belief for answer in answers if answer.belief is not None]
    if not beliefs:
        return [(name, NOT_MEASURED, "0", "", "<= 4 %", "")]
    error = calibration(beliefs)
    rows: list[Row] = [
        (name, _percent(error), str(len(beliefs)), "", "<= 4 %", _met(error <= 0.04))
    ]
    if sure := [right for probability, right in beliefs if probability >= SURE]:
        rows.append(_share(f"said with {SURE} and more: right", sure, 0.97, None))
    return rows


def _times(answers: Sequence[Answer]) -> list[Row]:
    """Of diagnoses of whole trials that came to an end. CPU time is what one core would take."""
    rows: list[Row] = []
    for model, limit in (("mmg", 10.0), ("feedforward", 60.0)):
        steps = [
            a.step("diagnose") for a in answers
            if a.planned.seconds == 7000 and a.planned.model == model
        ]  # fmt: skip
        done = [step for step in steps if step]
        if not done:
            continue
        cpu, wall, peak = ([step[k] for step in done] for k in ("cpu_s", "wall_s", "peak_mb"))
        middle, count, of = statistics.median(cpu), str(len(done)), f"diagnose 7000 s, {model}: "
        rows += [
            (
                f"{of}CPU time, median (worst)", f"{middle:.1f} s ({max(cpu):.1f} s)", count, "",
                f"<= {limit:.0f} s", _met(middle <= limit),
            ),
            (
                f"{of}wall time, median (worst)",
                f"{statistics.median(wall):.1f} s ({max(wall):.1f} s)", count, "", "", "",
            ),
            (
                f"{of}peak memory, median (worst)",
                f"{statistics.median(peak):.0f} MB ({max(peak):.0f} MB)", count, "", "", "",
            ),
        ]  # fmt: skip
    return rows


# --- simpler methods ------------------------------------------------------------------------------


def methods(answers: Sequence[Answer]) -> str:
    """Each on the cases that every one of them was asked: right of n for one cause hidden, and
    false names of n for nothing hidden."""
    asked = [answer for answer in answers if answer.rivals]
    names = [n for n in dict.fromkeys((*RIVALS, *chain.from_iterable(a.rivals for a in asked)))
             if all(n in a.rivals for a in asked)]  # fmt: skip
    columns: dict[str, tuple[Test, Test]] = {
        "size 1": (_among("one", _full), _right),
        "0.3 to 1": (_among("one", _small), _right),
        "500 s": (_among("one", _full, 500), _right),
        "nothing hidden: a cause named": (
            _among("none", seconds=None), lambda answer: bool(answer.named)
        ),
    }  # fmt: skip
    rows = []
    each = {RIVALS.get(name, name): [a.by(name) for a in asked] for name in names}
    for title, given in (each | {"shiplog diagnose": asked}).items():
        cells = []
        for among, hit in columns.values():
            hits = [hit(answer) for answer in given if among(answer)]
            share = f" ({_percent(sum(hits) / len(hits))})" if hits else ""
            cells.append(f"{sum(hits)}/{len(hits)}{share}" if hits else "")
        rows.append((title, *cells))
    table = report.table((f"method, {len(asked)} cases", *columns), rows)
    failed = sum(step["step"] == "rivals" and step["rc"] != 0 for a in answers for step in a.steps)
    return table + (f"\n{failed} more where the simpler methods failed" if failed else "")


# --- by cause, and mistakes -----------------------------------------------------------------------


def per_cause(answers: Sequence[Answer]) -> str:
    """Right of n for what is hidden alone, named of n beside another, errors wherever named."""
    columns = {
        "size 1": _among("one", _full), "0.3 to 1": _among("one", _small),
        "below": _among("one", _tiny), "500 s": _among("one", seconds=500),
        "outside": _among("outside", seconds=None),
    }  # fmt: skip
    names = dict.fromkeys(chain.from_iterable(a.hidden for a in answers))
    rows = []
    for name in sorted(names):
        mine = [answer for answer in answers if name in answer.hidden]
        cells = []
        for among in columns.values():
            right = [answer.right for answer in mine if among(answer)]
            cells.append(f"{sum(right)}/{len(right)}" if right else "")
        beside = [name in answer.named for answer in mine if answer.kind == "two"]
        cells.append(f"{sum(beside)}/{len(beside)}" if beside else "")
        compared = [answer.compared[name] for answer in mine if name in answer.compared]
        star = " *" if name in OTHER_FORM else ""
        rows.append((name + star, *cells, *_compared(compared)))
    head = ("hidden", *columns, "of two", "median error", "90 % intervals")
    return report.table(head, rows) + "\n* another form in the simulator: no goal for its numbers"


def _compared(compared: Sequence[Comparison]) -> tuple[str, str]:
    errors = [one.error for one in compared if one.error is not None]
    covered = [*chain.from_iterable(one.covered for one in compared)]
    return (
        _percent(statistics.median(errors)) if errors else "",
        f"{sum(covered)}/{len(covered)}" if covered else "",
    )


def mistakes(answers: Sequence[Answer]) -> str:
    """One line a case that is not right, and how to make its logs again."""
    wrong = [answer for answer in answers if not answer.right]
    if not wrong:
        return "Nothing was mistaken."
    rows = [
        (a.planned.label, _hidden(a), _said(a), _margin(a), _again(a))
        for a in sorted(wrong, key=lambda a: (a.kind, a.hidden))
    ]
    head = ("case", "hidden", "said", "margin", "python -m pipelines.known_ship case")
    return report.table(head, rows)


def _hidden(answer: Answer) -> str:
    if not answer.hidden:
        return "nothing"
    causes = [f"{one['name']} x{one['size']:.2g}" for one in answer.key["causes"]]
    family = (answer.key.get("structure") or {}).get("family")
    return " + ".join(causes) + (f" ({family})" if family else "")


def _said(answer: Answer) -> str:
    if answer.word == "failed":
        return f"failed: {answer.verdict.get('step')} ended with {answer.verdict.get('rc')}"
    words = [answer.word, " + ".join(answer.named), f"({answer.family})" if answer.family else ""]
    others = chain.from_iterable(c.get("indistinguishable_from") or () for c in answer.said)
    alike = list(dict.fromkeys(others)) if answer.named else []
    if alike:
        words.append(f"or {', '.join(alike)}")
    if traces := [one["name"] for one in answer.verdict.get("traces") or ()]:
        words.append(f"[trace: {', '.join(traces)}]")
    return " ".join(word for word in words if word)


def _margin(answer: Answer) -> str:
    """Over the runner-up in nats, where the verdict gives one; the contract does not ask for it."""
    for place in (answer.verdict, *answer.said, answer.verdict.get("structure") or {}):
        if isinstance(margin := place.get("margin"), int | float) and math.isfinite(margin):
            return f"{margin:.1f}"
    return ""


def _again(answer: Answer) -> str:
    return " ".join((str(answer.planned.seed), "LOGS --key KEY", *answer.planned.options))
