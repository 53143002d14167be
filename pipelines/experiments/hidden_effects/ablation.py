"""What each part of the decision is for: the answers without it, next to those of all parts.

Written by `python -m pipelines.experiments.hidden_effects.without --page`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from pipelines.experiments.hidden_effects import goals, score, score_tables
from pipelines.experiments.hidden_effects.score import Answer
from pipelines.experiments.hidden_effects.validation import heading, one_program
from shiplog.exceptions import ShiplogError
from shiplog.nomenclature.numbers import counted
from shiplog.report.evaluation import tables

WHOLE = "nothing"  # taken out: the decision as it is
TITLE = "# The decision without one of its parts"
COMMAND = """\
    tar -xf docs/evidence/validation-answers.tar.xz -C test
    python -m pipelines.experiments.hidden_effects remake test/goals --share --jobs 2
    python -m pipelines.experiments.hidden_effects remake test/abroad --jobs 2
    python -m pipelines.experiments.hidden_effects.without --ablate test/goals --every 2 \\
        --only after-search
    python -m pipelines.experiments.hidden_effects.without --ablate test/abroad --every 2 \\
        --only after-search
    python -m pipelines.experiments.hidden_effects.without --ablate test/goals --every 17 \\
        --only before-search
    python -m pipelines.experiments.hidden_effects.without --ablate test/abroad --every 20 \\
        --only before-search
    python -m pipelines.experiments.hidden_effects.without --page test/goals-without \\
        test/abroad-without --markdown docs/evidence/ablation.md"""
INTRODUCTION = """\
Cases of [validation](validation.md) were diagnosed once as they are, and again without a part of
the decision, one part after the other. The cases are every so many of the test, not chosen by what
was answered. A part that acts after the search is taken out of that same search; the other parts
need a search of their own, and were tested on fewer cases. With so few, a part that changes no
answer may still be needed elsewhere. `remake` makes the logs and models of the cases again."""
MEANING = {
    WHOLE: "the decision as it is",
    "placebo": "what a cause gains on nominal voyages is not subtracted",
    "form-error": "a cause's equations count as exact",
    "discrepancy": "the model's discrepancy is not learned",
    "voyage-effects": "voyages and their parts count as alike",
    "share-of-trial": "a trial counts all of itself",
    "robust-weights": "segments with errors far beyond the others count as much",
    "baseline": "a model that lacks a force is not noticed",
    "spectrum": "a change of the discrepancy counts however little noise it explains",
    "time-scale": "segments of 30 s whatever the ship",
    "refutation": "held-out voyages refute nothing",
    "practical-size": "a cause counts however small it is",
    "share-of-causes": "causes are named however little they explain",
    "imitation": "causes are named though the remainder could imitate them",
    "slight": "a remainder that explains little puts names in doubt, too",
    "ordinary-noise": "process noise that is raised by anything is a remainder",
    "ordinary-spreads": "how far noise differs between voyages does not count",
    "pattern": "a force is one device where an on/off course is more probable",
}


@dataclass(frozen=True, slots=True)
class Pair:
    """One case with all parts of the decision, and without one of them."""

    whole: Answer
    without: Answer

    @property
    def differ(self) -> bool:
        return _answer(self.whole) != _answer(self.without)


def _answer(answer: Answer) -> tuple[str, frozenset[str], str | None]:
    family = answer.family if answer.word == "unknown" else None
    return answer.word, frozenset(answer.named), family


def answers_in(folder: Path) -> dict[str, tuple[Answer, ...]]:
    """Part → the answers without it that an ablation has left there. Raises ShiplogError where
    there are none of the decision as it is."""
    found = {
        part: score.read(folder / part).answers for part in MEANING if (folder / part).exists()
    }
    if not found.get(WHOLE):
        raise ShiplogError(
            f"{folder} has no answers of the decision as it is.",
            hint="give the folder that --ablate writes, DIR-without.",
        )
    return found


def page(tests: Sequence[Mapping[str, Sequence[Answer]]]) -> str:
    """Markdown; of each test the answers without each part, those of `WHOLE` among them. Raises
    `validation.Mixed` where those are of several programs."""
    parts = [TITLE, COMMAND, INTRODUCTION]
    for found in tests:
        whole = {answer.planned: answer for answer in found[WHOLE]}
        pairs = {
            part: [Pair(whole[a.planned], a) for a in answers if a.planned in whole]
            for part, answers in found.items()
        }
        place = heading(goals.OTHER if all(a.abroad for a in found[WHOLE]) else goals.SAME)
        parts += [
            f"## {place}: {counted(len(whole), 'case')}",
            f"Answered by {one_program(found[WHOLE])}.",
            _counts(pairs),
            "### Where an answer becomes another",
            _changes(pairs),
        ]
    return "\n\n".join(parts)


def _counts(pairs: Mapping[str, Sequence[Pair]]) -> str:
    rows = [
        (
            part, MEANING[part], len(given), sum(pair.without.right for pair in given),
            sum(pair.without.misnamed for pair in given), sum(pair.differ for pair in given),
        )
        for part, given in pairs.items()
    ]  # fmt: skip
    return tables.table(
        ("without", "that is", "cases", "right", "named but wrong", "other answer"), rows
    )


def _changes(pairs: Mapping[str, Sequence[Pair]]) -> str:
    rows = [
        (
            part, pair.without.planned.label, score_tables.hidden(pair.without),
            score_tables.marked(pair.whole), score_tables.marked(pair.without),
        )
        for part, given in pairs.items() for pair in given if pair.differ
    ]  # fmt: skip
    if not rows:
        return "Nowhere."
    return tables.table(("without", "case", "hidden", "as it is", "without it"), rows)
