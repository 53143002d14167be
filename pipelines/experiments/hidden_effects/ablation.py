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

# Of a part that changes no answer of the cases: what happens without it elsewhere, and the test
# that fails without it.
CASES = {
    "placebo": (
        "a cause is named that one nominal voyage seems to have by as much",
        "tests/diagnosis/test_search.py", "test_a_placebo_is_taken_off",
    ),
    "form-error": (
        "next to a bank that explains 5000 nats a cause is named that makes up for the error of "
        "its equations: a fifth, which is 200 nats",
        "tests/experiments/test_ablation.py", "test_without_form_errors_no_cause_has_one",
    ),
    "robust-weights": (
        "one segment of eight has errors that no ship has, and decides",
        "tests/diagnosis/test_trial.py", "test_a_few_segments_do_not_decide",
    ),
    "baseline": (
        "a model that has no sway force of its rudder is diagnosed, and causes make up for that",
        "tests/diagnosis/test_baseline_check.py",
        "test_a_force_that_the_model_does_not_have_is_named_by_its_channel",
    ),
    "spectrum": (
        "a change that explains a twentieth of raised noise is taken for an unknown force",
        "tests/diagnosis/test_weighing.py",
        "test_what_explains_half_a_tenth_of_raised_noise_is_an_error_of_its_spectrum",
    ),
    "time-scale": (
        "a ship of L_pp/U = 76 s has segments of 30 s instead of 240 s; no answer is known that "
        "changes with it",
        "tests/voyages/test_timescale.py",
        "test_larger_and_slower_ships_have_longer_segments",
    ),
    "practical-size": (
        "a cause that is certainly there, at a tenth of the size that matters, is named instead of "
        "listed as a trace",
        "tests/diagnosis/test_decision_parts.py",
        "test_a_cause_that_is_there_but_does_not_matter_is_a_trace",
    ),
    "ordinary-spreads": (
        "where noise differs by a factor of 1.8 from nominal voyage to nominal voyage, a trial "
        "with twice the nominal noise is unknown instead of none",
        "tests/diagnosis/test_decision_parts.py",
        "test_voyages_of_all_weathers_make_a_trial_of_any_of_them_an_ordinary_one",
    ),
}  # fmt: skip
NEEDED = """\
## Parts that change none of these answers

The cases do not show what these parts are for. Each has a test that fails without it."""


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
    parts, changed, tried = [TITLE, COMMAND, INTRODUCTION], set(), {WHOLE: None}
    for found in tests:
        whole = {answer.planned: answer for answer in found[WHOLE]}
        pairs = {
            part: [Pair(whole[a.planned], a) for a in answers if a.planned in whole]
            for part, answers in found.items()
        }
        changed |= {part for part, given in pairs.items() if any(pair.differ for pair in given)}
        tried |= dict.fromkeys(pairs)
        place = heading(goals.OTHER if all(a.abroad for a in found[WHOLE]) else goals.SAME)
        parts += [
            f"## {place}: {counted(len(whole), 'case')}",
            f"Answered by {one_program(found[WHOLE])}.",
            _counts(pairs),
            "### Where an answer becomes another",
            _changes(pairs),
        ]
    idle = [part for part in tried if part not in changed and part in CASES]
    return "\n\n".join([*parts, *needed(idle)])


def needed(idle: Sequence[str]) -> list[str]:
    """Of parts that changed no answer, a section with what each is for."""
    rows = [(part, case, f"`{test}` in `{file}`") for part in idle
            for case, file, test in [CASES[part]]]  # fmt: skip
    return [NEEDED, tables.table(("without", "what happens then", "test"), rows)] if rows else []


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
