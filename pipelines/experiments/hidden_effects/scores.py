"""Scores that the literature of fault diagnosis uses, of one method's answers.

Alarms and isolation as in the benchmarks of fault detection; the repair utility of the DX
competition; the logarithmic score of probability forecasts.
"""

from __future__ import annotations

import itertools
import math
import statistics
from collections import Counter
from collections.abc import Collection, Mapping, Sequence

from pipelines.experiments.hidden_effects.goals import alarmed, cell
from pipelines.experiments.hidden_effects.parameters import NAMES
from pipelines.experiments.hidden_effects.score import FAILED, Answer
from shiplog.report.evaluation import tables

OUTSIDE = "outside the catalogue"  # a component of its own, next to the names
COMPONENTS = len(NAMES) + 1
ELSEWHERE = "another unit or channel"  # what a cause at the wrong place blames: it is not at fault
FLOOR = 0.01  # least probability that the log score takes: a ranking lists nothing below it
KINDS = {"none": "nothing", "one": "one cause", "two": "two at once", "outside": "outside"}


# --- alarms and isolation -------------------------------------------------------------------------


def alarms_on_effects(answers: Sequence[Answer]) -> list[bool]:
    """Detection rate: of the cases with something hidden, those that anything was reported of. A
    case without a verdict is not detected."""
    return [alarmed(a) and a.word != FAILED for a in answers if a.kind != "none"]


def alarms_on_clean(answers: Sequence[Answer]) -> list[bool]:
    """False alarm rate: of the clean campaigns, those that were not called `none`. `undecided` is
    an alarm, and so is a case without a verdict."""
    return [alarmed(a) for a in answers if a.kind == "none"]


def isolation(answers: Sequence[Answer]) -> float | None:
    """FIA: mean probability of the true cause among those detected; None where none was.

    Of two causes at once the mean of both, of what is outside the catalogue that of `unknown` with
    the right family. A verdict without probabilities is sure of what it says.
    """
    shares = [
        statistics.mean(_given(one, label) for label in one.truths)
        for one in answers
        if one.kind != "none" and alarmed(one) and one.word != FAILED
    ]
    return statistics.mean(shares) if shares else None


def right_among_alarms(answers: Sequence[Answer]) -> list[bool]:
    """Of all alarms, also those on clean campaigns, those that say all that is hidden and no
    more."""
    return [a.right for a in answers if alarmed(a) and a.word != FAILED]


def _given(one: Answer, label: str) -> float:
    """Probability of a label; of a verdict that gives none, 1 for what it says and 0 otherwise. A
    cause that is named at the wrong place gives none to the truth."""
    if label in one.misplaced:
        return 0.0
    found = one.probability(label)
    return found if found is not None else float(label in _reported(one))


def _reported(one: Answer) -> tuple[str, ...]:
    if one.word == "unknown":
        return (f"unknown:{one.family}",)
    return one.named or ((one.word,) if one.word == "none" else ())


# --- the group score of the DX competition --------------------------------------------------------


def repair_utility(
    reported: Collection[str], true: Collection[str], components: int = COMPONENTS
) -> float:
    """m_utl of one diagnosis: 1 less the share of the components that a repair tests in vain.

        m_utl = 1 - n (N + 1) / (f (n + 1)) - n' (N' + 1) / (f (n' + 1))

    f components; n true ones that are not reported, to be found among the N = f - |reported| that
    are not reported; n' that are reported and not true, to be found among the N' = |reported|. n (N
    + 1) / (n + 1) is the expected number of tests, in random order, until the last of n among N is
    found. 1 where reported is true, 0 where all that is not true is reported. Kurtoglu et al. 2009;
    Feldman et al. 2010, "Empirical evaluation of diagnostic algorithm performance using a generic
    framework", metric "system repair utility".
    """
    missed, false = len(set(true) - set(reported)), len(set(reported) - set(true))
    tests = _tests(missed, components - len(set(reported))) + _tests(false, len(set(reported)))
    return 1.0 - tests / components


def _tests(wanted: int, among: int) -> float:
    return wanted * (among + 1) / (wanted + 1)


def group_utility(one: Answer) -> float:
    """m_utl of a verdict: the weighted mean over the diagnoses that it leaves open.

    A named verdict leaves one of {name + indistinguishable_from} for each of its names, all equally
    likely; `undecided` leaves its answers, as likely as it says; `none`, `coverage` and
    `external` say that no component is at fault; a case without a verdict has no utility.
    """
    if one.word == FAILED:
        return 0.0
    true = (OUTSIDE,) if one.kind == "outside" else one.sought
    open_ = candidates(one)
    total = sum(open_.values())
    return sum(w * repair_utility(reported, true) for reported, w in open_.items()) / total


def candidates(one: Answer) -> dict[frozenset[str], float]:
    """Sets of faulty components that the verdict leaves open, with their weights."""
    if one.word == "unknown":
        return {frozenset({OUTSIDE}): 1.0}
    if one.word == "undecided":
        found: dict[frozenset[str], float] = {}
        for labels, probability in one.open:
            reported = frozenset().union(*map(_component, labels))
            found[reported] = found.get(reported, 0.0) + probability
        return found if sum(found.values()) > 0.0 else {frozenset(): 1.0}
    groups = [group or {ELSEWHERE} for group in one.groups]
    return {frozenset(reported): 1.0 for reported in itertools.product(*groups)}


def _component(label: str) -> frozenset[str]:
    if label == "none":
        return frozenset()
    name = label.partition(":")[0]
    return frozenset({OUTSIDE if name == "unknown" else name})


# --- probabilities --------------------------------------------------------------------------------


def log_score(one: Answer) -> float:
    """ln of the probability that the verdict gave to the truth, at least ln FLOOR (Good 1952).

    Of two causes at once the product of both. 0 is the best; a case without a verdict has the
    floor.
    """
    if one.word == FAILED:
        return math.log(FLOOR)
    return math.log(max(math.prod(_given(one, label) for label in one.truths), FLOOR))


def prevalence(answers: Sequence[Answer]) -> str:
    """Which cases the means are over: they depend on it."""
    counts = Counter(one.kind for one in answers)
    parts = [f"{KINDS[k]} {counts[k]}/{len(answers)}" for k in KINDS if counts[k]]
    return ", ".join(parts)


# --- the table ------------------------------------------------------------------------------------


def table(answers: Mapping[str, Sequence[Answer]]) -> str:
    """A row a score, a column a method."""
    rows = {
        "alarms where something is hidden": alarms_on_effects,
        "alarms where nothing is hidden": alarms_on_clean,
        "right among alarms": right_among_alarms,
    }
    lines = [(what, *(cell(of(given)) for given in answers.values())) for what, of in rows.items()]
    means = {
        "isolation: mean probability of the truth among cases with an alarm": isolation,
        "repair utility, cases with something hidden": lambda given: _mean(
            [group_utility(a) for a in given if a.kind != "none"]
        ),
        "repair utility, all cases": lambda given: _mean([group_utility(a) for a in given]),
        f"log score, nats, at least ln {FLOOR}": lambda given: _mean([log_score(a) for a in given]),
    }
    for what, of in means.items():
        lines.append((what, *(_number(of(given)) for given in answers.values())))
    return tables.table(("", *answers), lines)


def _mean(values: Sequence[float]) -> float | None:
    return statistics.mean(values) if values else None


def _number(value: float | None) -> str:
    return "" if value is None else f"{value:.3f}"
