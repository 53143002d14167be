"""The pages of validation, of all cases of one program: three numbers, the reliability diagram
and the goals; what went wrong; and other methods, intervals of parameters and cost.

Written by `python -m pipelines.experiments.hidden_effects scores DIR [DIR ...]
--markdown docs/evidence/validation.md`.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
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
from pipelines.experiments.hidden_effects.score import FAILED, LEVEL, Answer, Score, attempt
from shiplog.diagnosis.thresholds import STATED
from shiplog.exceptions import ShiplogError, listed
from shiplog.nomenclature.numbers import counted
from shiplog.report.evaluation import tables

MACHINE = "an Intel Xeon"  # of docs/evidence/validation-answers.tar.xz
SHIPMMG = "shipmmg"  # a type of ship of another package, and an MMG too
PLACES = (goals.SAME, goals.OTHER)
SUITES = {
    "goals": goals.SAME,
    "abroad": goals.OTHER,
    "devices": goals.SAME,
    "devices-abroad": goals.OTHER,
}  # which ships a suite is of


class Mixed(ShiplogError):
    """Verdicts of several programs, or the same case twice: they have no table in common."""


MISSES, METHODS = "_misses", "_methods"  # behind the page's name


@dataclass(frozen=True, slots=True)
class Page:
    """What stands behind the page's name → a page; and the picture of the first one, SVG."""

    pages: Mapping[str, str]
    picture: str

    @property
    def text(self) -> str:
        """All pages, one after the other."""
        return "\n\n".join(self.pages.values())

    def write(self, path: Path) -> None:
        """The page and, next to it, the others and the picture."""
        path.parent.mkdir(parents=True, exist_ok=True)
        for behind, text in self.pages.items():
            page_of(path, behind).write_text(text + "\n", encoding="utf-8")
        picture_of(path).write_text(self.picture, encoding="utf-8")


def page_of(path: Path, behind: str) -> Path:
    return path.with_name(f"{path.stem}{behind}{path.suffix}")


def picture_of(path: Path) -> Path:
    return path.with_name(f"{path.stem}-reliability.svg")


def page(found: Sequence[Score], path: Path | None = None, machine: str = MACHINE) -> Page:
    """The pages; `machine` is that on which the cases were run: answers do not record it. Raises
    Mixed where the cases' verdicts are not all of one program, or one is there twice."""
    answers = [answer for score in found for answer in score.answers]
    if not answers:
        raise ShiplogError("No case has a sealed verdict.", hint="run a suite first.")
    of = one_program(answers)
    _once(answers)
    by_place = {
        goals.SAME: [answer for answer in answers if not answer.abroad],
        goals.OTHER: [answer for answer in answers if answer.abroad],
    }
    there = {place: by_place[place] for place in PLACES if by_place[place]}
    stated = {place: goals.statements(given) for place, given in there.items()}
    standing = {place: ranks.standings(given) for place, given in there.items()}
    at = path or PAGE
    others = {behind: page_of(at, behind).name for behind in (MISSES, METHODS)}
    diagram = f"![Share true over the reported probability]({picture_of(at).name})"
    first = [
        _title(found),
        THREE,
        three_numbers(there),
        *([diagram] if path else []),
        OTHERS.format(misses=others[MISSES], methods=others[METHODS]),
        "## What was run",
        _head(found, answers, of, at),
        "## Goals, this program",
        INTERVAL,
        goals.table(by_place[goals.SAME], by_place[goals.OTHER]),
        *(["### Each type of ship", types(by_place[goals.OTHER])] if by_place[goals.OTHER] else []),
        "## Reliability",
        reliability.table(stated),
    ]
    second = [
        "# What went wrong",
        f"Every case of the [validation]({at.name}) whose verdict is not right, the worst first.",
        *(part for place, one in there.items() for part in (f"## {heading(place)}", misses(one))),
        "## Words of the tables",
        _legend(answers),
    ]
    third = [
        "# Validation: other methods, intervals, cost",
        f"Of the cases of the [validation]({at.name}); its words are [listed]({others[MISSES]}"
        "#words-of-the-tables).",
        *(part for place, given in there.items() for part in _methods(place, given)),
        "## Parameters: intervals and ranks",
        PARAMETERS,
        ranks.coverage_table(standing),
        ranks.rank_table(standing),
        *(part for place, given in there.items() for part in _cost(place, given, machine)),
    ]
    pages = {"": first, MISSES: second, METHODS: third}
    return Page(
        {behind: "\n\n".join(parts) for behind, parts in pages.items()}, reliability.svg(stated)
    )


PAGE = Path("validation.md")  # where none is given
THREE = """\
How often a verdict of `shiplog diagnose` is right, measured on simulated ships. Each verdict was
stored before the hidden answer was read. Three numbers:"""
OTHERS = """\
*The diagram: of all that was reported with a probability, the share that is true. On the diagonal a
probability says what it means.* [What went wrong]({misses}) lists every case that is not right, and
the words of the tables. [Other methods, intervals, cost]({methods}) compares simpler methods on the
same cases."""


def three_numbers(answers: Mapping[str, Sequence[Answer]]) -> str:
    """Of each family of ships: a wrong name, a certain statement, a false alarm."""
    rows = [
        (what, *(goals.figures(given).get(row, (0.0, goals.NOT_MEASURED))[1]
                 for given in answers.values()))
        for what, row in (
            ("a cause is named that is not there", goals.RATES[0].what),
            (f"what is reported with {goals.STATED:g} or more is true", goals.CERTAIN),
            ("nothing has changed, and the verdict is not `none`", goals.RATES[2].what),
        )
    ]  # fmt: skip
    return tables.table(("", *(f"{place} of equations" for place in answers)), rows)


COMMAND = """\
    python -m pipelines.experiments.hidden_effects scores docs/evidence/{stem}-answers.tar.xz \\
        --markdown docs/evidence/{stem}.md"""
INTRODUCTION = """\
In each case a ship makes a nominal campaign, from which a model is identified (`train --model
mmg`). In a later trial of 7000 or 500 s (longer for a large ship) nothing is hidden, or one cause
of the [catalogue](../reference/catalogue.md), or two causes, or an effect outside the catalogue.
Each verdict was stored with its hash before the hidden answer was read. The
[glossary](../science/glossary.md) defines the terms of a verdict.

*Same family of equations*: a ship of MMG form, as the model is. The simulator shares no code with
shiplog but the writer of the logs, and all coefficients have to be identified. Its hull, wind, wake
and inflow to the rudders have formulas of their own, of the same published families. Two forms are
the model's: thrust is a parabola of the advance ratio, and the force of a rudder over its angle is
a balance of momentum in both.

*Other families of equations*: a merchant ship with Abkowitz's polynomials (`abkowitz`), a supply
vessel with linear damping (`linear_dp`), a catamaran with two fixed thrusters (`catamaran`), a
ferry with azimuth thrusters (`azimuth_ferry`), and the KVLCC2 of the package shipmmg (`shipmmg`).
Of these, `shipmmg` is an MMG too: its equations of motion, propeller and rudder are those of the
model, written by another author; its hull polynomials and its wake are not. It has no wind, no bank
and no shallow water. A [table](#each-type-of-ship) has the figures of each type, and those without
`shipmmg`."""
HEEL = ("container", "naval_vessel")
HEELING = """\
Two further ships heel, which the model does not: a container ship (`container`) and a naval vessel
(`naval_vessel`), each with equations of its own from the literature."""
CASES = "Cases that were run:"
LEGEND = """\
- **x1** is a realistic size of what is hidden; **x0.3** is three tenths of it. *Size 1* and *size
  0.3* are the same.
- **Right**: the verdict names all that is hidden and nothing else; where nothing is hidden, it is
  `none`; outside the catalogue it is `unknown` with the right remainder (position, heading, time,
  motion, controls, wind, stochastic or intermittent).
- **Named but wrong**: the verdict names a cause that is not hidden in the case. Its *alternatives*
  are the causes that the verdict lists after "or it is".
- **An alarm** is any verdict other than `none`.
- **Undecided** leaves answers open, which its sentence lists; causes that it joins are one answer.
  *Among the first two*: all that is hidden, and nothing else, is one of the two most probable
  answers. Equally probable answers share the last of their places.
- **A statement** is what a verdict gives a probability to. `named` makes one for each cause: that
  it is hidden. `unknown` makes one, its remainder; `none` one, that nothing is hidden; any other
  verdict one, that all of its most probable answer is hidden, or one for each of several equally
  probable ones. Calibration error, *reported with 0.9 or more* and the reliability diagram are over
  statements. A statement can be true in a case whose verdict is not right.
- **Probability** in the lists of what went wrong is that of the first statement. It is 0.00 where
  the remainder is not in the ranking: by [rule 10](../science/rules.md) a wrong sign, or a model
  worse than constant velocities, is answered `unknown`, whatever the ranking is.
- **Outside the catalogue**, with the right remainder: `tether`, a line to a fixed point (position);
  `tow`, a force in one direction that grows during the trial (time); `propeller_side_force`, a
  share of the thrust acts athwart (controls); `rudder_limit`, the rudders turn no farther than a
  limit (controls); `cross_coupling`, a unit also follows a share of another one's command
  (controls); `turbulence`, process noise 4 to 9 times as large (stochastic). Each of these four
  remainders has a row of the goals' table. The other four (heading, motion, wind, intermittent) are
  answers of the program, and nothing that is hidden here has them.
- **Always none** always answers `none`. **Random answer** draws `none` or a cause of the catalogue,
  all equally likely.
- **Isolation** (FIA) is the mean probability that a method gives to the truth, in the cases in
  which something is hidden and that it answers with an alarm. Of remainders, `unknown` gives a
  probability to its own alone.
- **Repair utility** (m_utl, Feldman et al. 2010) is 1 less the share of all components that a
  repair tests in vain if it follows the answer. Each cause is a component; what is outside the
  catalogue is one more.
- **Log score** is the mean logarithm of the probability that is given to the truth; 0 is perfect.
- **Expected calibration error** is the mean difference between the probability of statements and
  the share of them that are true.
- Cases with the same number before the hyphen have the same ship, weather and noise: intervals
  over them are too narrow."""
RIVALS = {
    "regression": "- **Regression + BIC** regresses the accelerations on each cause's term and "
    "chooses by Schwarz's criterion. It names one cause or none: two at once and what is outside "
    "the catalogue are beyond it.",
    "glr": "- **Likelihood ratio** compares rollouts with and without each cause, the errors taken "
    "as white noise. It, too, names one cause or none.",
}
COST = """\
Processor time, elapsed time and memory of `shiplog diagnose`, a case, on {machine}, each
case on one core. Two cases ran at a time on two cores that also had other work: elapsed time is
longer than on a free machine. The first case of a ship includes the fit of its nominal campaign,
which is kept for the later ones; what is hidden differs, too."""
AGAIN_UNKNOWN = """\
- a case that fails is run again when the command is repeated; these answers do not record how often
  that happened"""
INTERVAL = (
    "Shares with counts and, in brackets, their Clopper-Pearson interval in %, "
    f"at {100 * LEVEL:.0f} %.\nA goal is what is asked of the program. "
    "*Met* compares the share itself, and the intervals\nare wide: most rows have too few cases to "
    "say on which side of its goal the program is."
)
PARAMETERS = """\
Intervals of causes that are hidden and named, taken as Gaussians on each side of the value; those
of one case are not independent. Bank, shallow water and side thrust are left out: the simulators
have other forms of them, so that numbers of one name are not the same quantity. A row of the goals'
table counts their intervals as well. The first table has the share of them that contain the truth;
levels other than 90 % are implied. A rank is the quantile of the truth in its interval
(simulation-based calibration, Talts et al. 2018)."""


def heading(place: str) -> str:
    """As a heading: "Same family of equations". Suites that have no such name keep their own."""
    return f"{place.capitalize()} of equations" if place in PLACES else place


def _legend(answers: Sequence[Answer]) -> str:
    """The words of the tables; of simpler methods those that were asked."""
    asked = {rival for answer in answers for rival in answer.rivals}
    return "\n".join((LEGEND, *(words for rival, words in RIVALS.items() if rival in asked)))


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
            f"{counted(len(twice), 'case')} there twice: {listed(p.label for p in twice)}.",
            hint="give every test once: a replay holds the cases of the test it replays.",
        )


def _title(found: Sequence[Score]) -> str:
    """Of the page: a third of the cases of these suites are actuators, lines and tows."""
    devices = all(score.suite.startswith("devices") for score in found)
    return (
        "# Validation on actuators, lines and tows" if devices else "# Validation on hidden effects"
    )


def _head(found: Sequence[Score], answers: Sequence[Answer], of: str, at: Path) -> str:
    more = [HEELING, ""] if any(a.planned.family in HEEL for a in answers) else []
    lines = [COMMAND.format(stem=at.stem), "", INTRODUCTION, "", *more, CASES, ""]
    for score in sorted(found, key=lambda one: SUITES.get(one.suite) != goals.SAME):
        done = len(score.answers)
        place = heading(SUITES.get(score.suite, score.suite))
        line = f"- {place}: {done} of {done + len(score.pending) + len(score.unmade)} cases"
        line += f"; {len(score.pending)} not run" if score.pending else ""
        line += f"; {len(score.unmade)} whose logs could not be written" if score.unmade else ""
        lines.append(line)
    trained = program.names((s for a in answers for s in a.steps), ("train",))
    if trained and trained != (of,):
        lines.append("- models identified by another version than that which diagnosed")
    lines.append(_attempts(answers))
    if unsure := [a for a in answers if _unsure_none(a)]:
        right = sum(a.right for a in unsure)
        lines.append(
            f"- {len(unsure)} of the answers `none` have a probability below {STATED:g}, {right} "
            "of them\n  right; since these answers were made, such a one is `undecided`"
        )
    if of == program.UNRECORDED:
        lines.append("- which version of the program it was is not recorded")
    elif of.endswith("+changes"):
        lines.append("- the program held changes that no version has")
    return "\n".join(lines)


def _unsure_none(answer: Answer) -> bool:
    """Whether "nothing is wrong" was said with less than what is now asked for."""
    ranking = {one["name"]: one["probability"] for one in answer.verdict.get("ranking") or ()}
    return answer.verdict.get("verdict") == "none" and ranking.get("none", 1.0) < STATED


def _attempts(answers: Sequence[Answer]) -> str:
    """How often a case was run again since it had failed."""
    if not all(any("attempt" in step for step in answer.steps) for answer in answers):
        return AGAIN_UNKNOWN
    again = sum(attempt(answer.steps) > 1 for answer in answers)
    return f"- a case that fails is run again: {again} of these were"


def _methods(place: str, given: Sequence[Answer]) -> list[str]:
    by = methods.answers(given)
    asked = [f"{method} {len(of)}" for method, of in by.items() if len(of) < len(given)]
    fewer = f" Asked of fewer cases: {', '.join(asked)}." if asked else ""
    return [
        f"## All methods: {place} of equations",
        f"{len(given)} cases; prevalence: {scores.prevalence(given)}.{fewer}",
        goals.by_method(by, place == goals.OTHER),
        scores.table(by),
    ]


def _cost(place: str, given: Sequence[Answer], machine: str) -> list[str]:
    rows = score_tables.times(given)
    if not rows:
        return []
    cost = COST.format(machine=machine)
    return [f"## Cost: {place} of equations", cost, tables.table(score_tables.HEAD, rows)]


def types(answers: Sequence[Answer]) -> str:
    """A line a type of ship, and one of all but those of the package shipmmg."""
    by = {family: [a for a in answers if a.planned.family == family]
          for family in sorted({a.planned.family for a in answers})}  # fmt: skip
    if (others := [a for a in answers if a.planned.family != SHIPMMG]) != answers and others:
        by[f"all but {SHIPMMG}"] = others
    rows = [
        (family, goals.cell([a.right for a in given]), goals.cell([a.misnamed for a in given]),
         len(given))
        for family, given in by.items()
    ]  # fmt: skip
    return tables.table(("type of ship", "right", "named but wrong", "cases"), rows)


# --- misses ---------------------------------------------------------------------------------------

WORST = (
    "wrong name", "wrong name, the truth among its alternatives", "false alarm", "no verdict",
    "wrong remainder", "not all of it", "missed", "undecided",
    "undecided, the truth among the first", "other",
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
    family = ["type of ship"] if wrong[0].abroad else []
    return tables.table(
        ("case", *family, "trial", "hidden", "reported", "probability", "what went wrong"), rows
    )


def how(answer: Answer) -> str:
    """In which way a case is not right, as `WORST` lists them."""
    if answer.word == FAILED:
        return "no verdict"
    if answer.misnamed:
        return "wrong name, the truth among its alternatives" if answer.found else "wrong name"
    if answer.kind == "none":
        return "false alarm"
    if answer.word == "undecided":
        return "undecided, the truth among the first" if answer.found else "undecided"
    if answer.named:
        return "not all of it"
    if answer.word == "none":
        return "missed"
    return "wrong remainder" if answer.kind == "outside" and answer.word == "unknown" else "other"


def _probability(answer: Answer) -> str:
    return f"{answer.statements[0][0]:.2f}" if answer.statements else ""
