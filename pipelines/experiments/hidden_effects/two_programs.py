"""The same cases, answered by two programs: whether a new decision is better than a former one.

Written by `python -m pipelines.experiments.hidden_effects compare`.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from math import comb

from pipelines.experiments.hidden_effects import goals, score_tables
from pipelines.experiments.hidden_effects.score import Answer, Score
from pipelines.experiments.hidden_effects.validation import PLACES, heading, one_program
from shiplog.exceptions import ShiplogError
from shiplog.nomenclature.numbers import counted
from shiplog.report.evaluation import tables

FORMER, PRESENT = "former", "present"
TITLE = "# Former and present decision on the same cases"
COMMAND = """\
    python -m pipelines.experiments.hidden_effects compare docs/evidence/former-answers.tar.xz \\
        docs/evidence/validation-answers.tar.xz --markdown docs/evidence/former_decision.md"""
INTRODUCTION = """\
The cases are those of [validation](validation.md) that both programs answered; its words and
goals hold here too. Both had the same logs and profiles. Each made its own store and identified its
own model.
The *former* decision is the one that this decision replaced: its rules had grown case by case.

A share has its count and, in brackets, its Clopper-Pearson interval at 90 %, in %. The two columns
of one row are of the same cases, so that they differ by less than their intervals suggest. What
counts is the second table: how often one of the two is right where the other is not. The
probability is that of a split as uneven, or more so, if both were equally good (McNemar's test in
its exact form)."""


@dataclass(frozen=True, slots=True)
class Pair:
    """One case as both programs answer it."""

    former: Answer
    present: Answer

    @property
    def differ(self) -> bool:
        return _answer(self.former) != _answer(self.present)


def page(former: Sequence[Score], present: Sequence[Score]) -> str:
    """Raises ShiplogError where no case was answered by both; `validation.Mixed` where the answers
    of one side are of several programs."""
    pairs = paired(former, present)
    for side in ([pair.former for pair in pairs], [pair.present for pair in pairs]):
        one_program(side)
    by_place = {
        goals.SAME: [pair for pair in pairs if not pair.present.abroad],
        goals.OTHER: [pair for pair in pairs if pair.present.abroad],
    }
    parts = [TITLE, COMMAND, INTRODUCTION]
    for place in PLACES:
        if given := by_place[place]:
            parts += _of_place(place, given)
    return "\n\n".join(parts)


def paired(former: Sequence[Score], present: Sequence[Score]) -> list[Pair]:
    """The cases that both answered, in the order of the present program."""
    before = {answer.planned: answer for score in former for answer in score.answers}
    pairs = [
        Pair(before[answer.planned], answer)
        for score in present
        for answer in score.answers
        if answer.planned in before
    ]
    if not pairs:
        raise ShiplogError(
            "No case was answered by both programs.",
            hint="replay the cases of the second folder with the first program.",
        )
    return pairs


def _of_place(place: str, pairs: Sequence[Pair]) -> list[str]:
    by = {
        FORMER: [pair.former for pair in pairs],
        PRESENT: [pair.present for pair in pairs],
    }
    different = [pair for pair in pairs if pair.differ]
    return [
        f"## {heading(place)}: {counted(len(pairs), 'case')}",
        goals.by_method(by, place == goals.OTHER),
        split_table(pairs),
        f"### Where the answers differ: {counted(len(different), 'case')}",
        _differences(different),
    ]


def split_table(pairs: Sequence[Pair]) -> str:
    """How often both, one or none of the two are right, and name something wrong."""
    rows = []
    for what, hit in (
        ("right", lambda a: a.right),
        ("right among the alternatives", lambda a: a.found),
        ("names something wrong", lambda a: a.misnamed),
    ):
        counts = Counter((bool(hit(p.former)), bool(hit(p.present))) for p in pairs)
        only_former, only_present = counts[True, False], counts[False, True]
        rows.append((
            what, counts[True, True], only_former, only_present, counts[False, False],
            f"{mcnemar(only_former, only_present):.2g}",
        ))  # fmt: skip
    return tables.table(
        ("", "both", f"only {FORMER}", f"only {PRESENT}", "neither", "probability of such a split"),
        rows,
    )


def mcnemar(one: int, other: int) -> float:
    """Probability that of one + other fair coins as few or fewer show the rarer side, both ways
    (McNemar 1947, exact)."""
    count, few = one + other, min(one, other)
    tail = sum(comb(count, k) for k in range(few + 1)) / 2**count
    return min(1.0, 2.0 * tail)


def _answer(answer: Answer) -> tuple[str, frozenset[str], str | None]:
    family = answer.family if answer.word == "unknown" else None
    return answer.word, frozenset(answer.named), family


def _differences(pairs: Sequence[Pair]) -> str:
    if not pairs:
        return "Nowhere."
    ordered = sorted(pairs, key=lambda pair: (pair.present.right, pair.present.planned.label))
    rows = [
        (
            pair.present.planned.label,
            f"{pair.present.planned.seconds} s",
            score_tables.hidden(pair.present),
            score_tables.marked(pair.former),
            score_tables.marked(pair.present),
        )
        for pair in ordered
    ]
    return tables.table(("case", "trial", "hidden", FORMER, PRESENT), rows)
