"""What each part of the decision is for: the answers without it, next to those of all parts.

Written by `python -m pipelines.experiments.hidden_effects.without --ablate`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from pipelines.experiments.hidden_effects import goals, score_tables
from pipelines.experiments.hidden_effects.score import Answer
from pipelines.experiments.hidden_effects.two_programs import Pair
from pipelines.experiments.hidden_effects.validation import heading, one_program
from shiplog.numbers import counted
from shiplog.report import tables

WHOLE = "nothing"  # taken out: the decision as it is
TITLE = "# The decision without one of its parts"
COMMAND = """\
    tar -xf docs/validation-answers.tar.xz -C test
    python -m pipelines.experiments.hidden_effects remake test/goals --share --jobs 2
    python -m pipelines.experiments.hidden_effects.without --ablate test/goals --every {every} \\
        --jobs 2 --markdown docs/results/ablation.md"""
INTRODUCTION = """\
Some cases of [validation](../validation.md) were diagnosed once as they are, and again without each
part of the decision in turn: one case of each {every}, counted before any was diagnosed. `remake`
makes their logs and models again. With so few cases, a part that changes no answer may still be
needed elsewhere; one that changes an answer is needed there."""
MEANING = {
    WHOLE: "the decision as it is",
    "placebo": "what a cause gains on nominal voyages is not subtracted",
    "form-error": "a cause's equations count as exact",
    "discrepancy": "the model's discrepancy is not learned",
    "voyage-effects": "voyages and their parts count as alike",
    "share-of-trial": "a trial counts all of itself",
    "robust-weights": "segments with errors far beyond the others count as much",
    "refutation": "held-out voyages refute nothing",
    "baseline": "a model that lacks a force is not noticed",
    "practical-size": "a cause counts however small it is",
    "share-of-causes": "causes are named however little they explain",
    "imitation": "causes are named though the remainder could imitate them",
    "time-scale": "segments of 30 s whatever the ship",
}


def page(found: Mapping[str, Sequence[Answer]], every: int) -> str:
    """Markdown; `found` are the answers without each part, those of `WHOLE` among them. Raises
    `validation.Mixed` where the answers as they are are of several programs."""
    whole = {answer.planned: answer for answer in found[WHOLE]}
    of = one_program(found[WHOLE])
    pairs = {
        part: [Pair(whole[a.planned], a) for a in answers if a.planned in whole]
        for part, answers in found.items()
    }
    place = heading(goals.OTHER if all(a.abroad for a in found[WHOLE]) else goals.SAME)
    parts = [
        TITLE,
        COMMAND.format(every=every),
        INTRODUCTION.format(every=every),
        f"{place}: {counted(len(whole), 'case')}, answered by {of}.",
        _counts(pairs),
        "## Where an answer becomes another",
        _changes(pairs),
    ]
    return "\n\n".join(parts)


def _counts(pairs: Mapping[str, Sequence[Pair]]) -> str:
    rows = [
        (
            part, MEANING[part], len(given), sum(pair.present.right for pair in given),
            sum(pair.present.misnamed for pair in given), sum(pair.differ for pair in given),
        )
        for part, given in pairs.items()
    ]  # fmt: skip
    return tables.table(
        ("without", "that is", "cases", "right", "named but wrong", "other answer"), rows
    )


def _changes(pairs: Mapping[str, Sequence[Pair]]) -> str:
    rows = [
        (
            part, pair.present.planned.label, score_tables.hidden(pair.present),
            score_tables.marked(pair.former), score_tables.marked(pair.present),
        )
        for part, given in pairs.items() for pair in given if pair.differ
    ]  # fmt: skip
    if not rows:
        return "Nowhere."
    return tables.table(("without", "case", "hidden", "as it is", "without it"), rows)
