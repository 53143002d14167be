"""The validation page: what went wrong, then every score, of all cases of one program.

Written by `python -m pipelines.experiments.hidden_effects scores DIR [DIR ...]
--markdown docs/validation.md`.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from pipelines.experiments.hidden_effects import (
    goals,
    methods,
    program,
    ranks,
    reliability,
    score_tables,
    scores,
)
from pipelines.experiments.hidden_effects.score import FAILED, LEVEL, Answer, Score
from shiplog.exceptions import ShiplogError
from shiplog.report import tables

PLACES = ("home", "abroad")


class Mixed(ShiplogError):
    """Verdicts of several programs, or the same case twice: they have no table in common."""


@dataclass(frozen=True, slots=True)
class Page:
    text: str
    picture: str  # SVG

    def write(self, path: Path) -> None:
        """Page and, next to it, its picture."""
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(self.text + "\n", encoding="utf-8")
        picture_of(path).write_text(self.picture, encoding="utf-8")


def picture_of(path: Path) -> Path:
    return path.with_name(f"{path.stem}-reliability.svg")


def page(found: Sequence[Score], path: Path | None = None) -> Page:
    """Raises Mixed where the cases' verdicts are not all of one program, or one is there twice."""
    answers = [answer for score in found for answer in score.answers]
    if not answers:
        raise ShiplogError("No case has a sealed verdict.", hint="run a suite first.")
    of = one_program(answers)
    _once(answers)
    by_place = {
        "home": [answer for answer in answers if not answer.abroad],
        "abroad": [answer for answer in answers if answer.abroad],
    }
    there = {place: by_place[place] for place in PLACES if by_place[place]}
    beliefs = {place: goals.beliefs(given) for place, given in there.items()}
    standing = {place: ranks.standings(given) for place, given in there.items()}
    picture = picture_of(path).name if path else ""
    parts = [
        "# Validation on hidden effects",
        _head(found, answers, of),
        LEGEND,
        "## What went wrong",
        *(part for place, given in there.items() for part in (f"### {place.capitalize()}",
                                                              misses(given))),
        "## Goals, this program",
        INTERVAL,
        goals.table(by_place["home"], by_place["abroad"]),
        *(part for place, given in there.items() for part in _methods(place, given)),
        "## Reliability",
        *([f"![Share right over the probability said]({picture})"] if picture else []),
        reliability.table(beliefs),
        "## Parameters: coverage and ranks",
        PARAMETERS,
        ranks.coverage_table(standing),
        ranks.rank_table(standing),
        *(part for place, given in there.items() for part in _cost(place, given)),
    ]  # fmt: skip
    return Page("\n\n".join(parts), reliability.svg(beliefs))


LEGEND = """\
- **Home** is the simulator's MMG ship; **abroad** are ships of other equations, by family.
- **Cases of one seed** at home share ship, weather and noise: intervals over them are too narrow.
- **x1** is a realistic size of what is hidden; **x0.3** is three tenths of it.
- **Named but wrong**: the verdict names a cause that is not hidden in the case.
- **Null** is a method that always answers `none`.
- **Random** is a method that draws `none` or a cause of the catalogue, all equally likely.
- **FIA** is the mean probability that a method gives to the true cause in cases that it detects.
- **m_utl** is 1 less the share of all components that a repair by the answer tests in vain."""
INTERVAL = (
    "Shares with counts and, in brackets, their Clopper-Pearson interval in %, "
    f"at {100 * LEVEL:.0f} %."
)
PARAMETERS = (
    "Intervals of causes that are hidden and named, taken as Gaussians on each side of the value; "
    "those of one case are not independent. Coverage at other levels than 90 % is implied by them. "
    "A rank is the truth's quantile (simulation-based calibration)."
)


def one_program(answers: Sequence[Answer]) -> str:
    """The program of all verdicts. Raises Mixed where there are several."""
    counts = Counter(name for answer in answers for name in program.of_answers(answer.steps))
    if len(counts) > 1:
        reported = ", ".join(f"{name} ({count} cases)" for name, count in counts.most_common())
        raise Mixed(
            f"The answers are of several programs: {reported}. One table is of one program.",
            hint="replay the cases with one commit, or give the folders of one.",
        )
    return next(iter(counts))


def _once(answers: Sequence[Answer]) -> None:
    twice = [p for p, count in Counter(answer.planned for answer in answers).items() if count > 1]
    if twice:
        raise Mixed(
            f"Case {twice[0].label} and {len(twice) - 1} more are there twice.",
            hint="give every test once: a replay holds the cases of the test it replays.",
        )


def _head(found: Sequence[Score], answers: Sequence[Answer], of: str) -> str:
    lines = [
        f"Program: `{of}`. Output of `python -m pipelines.experiments.hidden_effects scores DIR "
        "[DIR ...] --markdown docs/validation.md`; every verdict was sealed before its key was "
        "opened.",
        "",
    ]
    for score in found:
        done = len(score.answers)
        line = f"- {score.suite}: {done} of {done + len(score.pending) + len(score.unmade)} cases"
        line += f"; {len(score.pending)} not run" if score.pending else ""
        line += f"; {len(score.unmade)} whose logs could not be written" if score.unmade else ""
        lines.append(line)
    trained = program.names((s for a in answers for s in a.steps), ("train",))
    if trained and trained != (of,):
        lines.append(f"- models identified by {', '.join(f'`{one}`' for one in trained)}")
    if of == program.UNRECORDED:
        lines.append("- which program it was is not recorded: these figures stand for no commit")
    elif of.endswith("+changes"):
        lines.append("- the source held changes that this commit does not")
    return "\n".join(lines)


def _methods(place: str, given: Sequence[Answer]) -> list[str]:
    by = methods.answers(given)
    asked = [f"{method} {len(of)}" for method, of in by.items() if len(of) < len(given)]
    fewer = f" Asked of fewer cases: {', '.join(asked)}." if asked else ""
    return [
        f"## All methods, {place}",
        f"{len(given)} cases; prevalence: {scores.prevalence(given)}.{fewer}",
        goals.by_method(by, place == "abroad"),
        scores.table(by),
    ]


def _cost(place: str, given: Sequence[Answer]) -> list[str]:
    rows = score_tables.times(given)
    return [f"## Cost, {place}", tables.table(score_tables.HEAD, rows)] if rows else []


# --- misses ---------------------------------------------------------------------------------------

WORST = (
    "wrong name", "wrong name, the truth in its group", "false alarm", "no verdict",
    "wrong family", "not all of it", "missed", "undecided", "undecided, the truth among the first",
    "other",
)  # fmt: skip


def misses(answers: Sequence[Answer]) -> str:
    """A line a case that is not right, the worst first."""
    wrong = [answer for answer in answers if not answer.right]
    if not wrong:
        return "Nothing."
    wrong.sort(key=lambda a: (WORST.index(how(a)), a.planned.family, a.planned.label))
    rows = [
        (a.planned.label, *([a.planned.family] if a.abroad else []), f"{a.planned.seconds} s",
         score_tables.hidden(a), score_tables.reported(a), _probability(a), how(a))
        for a in wrong
    ]  # fmt: skip
    family = ["family"] if wrong[0].abroad else []
    return tables.table(
        ("case", *family, "trial", "hidden", "said", "probability", "what went wrong"), rows
    )


def how(answer: Answer) -> str:
    """In which way a case is not right, as `WORST` lists them."""
    if answer.word == FAILED:
        return "no verdict"
    if answer.misnamed:
        return "wrong name, the truth in its group" if answer.found else "wrong name"
    if answer.kind == "none":
        return "false alarm"
    if answer.word == "undecided":
        return "undecided, the truth among the first" if answer.found else "undecided"
    if answer.named:
        return "not all of it"
    if answer.word == "none":
        return "missed"
    return "wrong family" if answer.kind == "outside" and answer.word == "unknown" else "other"


def _probability(answer: Answer) -> str:
    return "" if answer.belief is None else f"{answer.belief[0]:.2f}"
