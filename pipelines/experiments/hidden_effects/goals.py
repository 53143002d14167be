"""The goals' table: shares of cases with their intervals, and what is asked of each, on ships of
the model's own family of equations ("home" in the code) and of other families ("abroad")."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain

from pipelines.experiments.hidden_effects.parameters import (
    ABSORBED,
    ACTUATORS,
    LINES,
    NAMES,
    OTHER_FORM,
    SURVIVE,
)
from pipelines.experiments.hidden_effects.score import (
    FAILED,
    Answer,
    Statement,
    calibration,
    clopper_pearson,
)
from shiplog.report.evaluation import tables

Test = Callable[[Answer], bool]
Limits = tuple[float | None, float | None]  # at least, at most
FREE: Limits = (None, None)
FULL, SMALL = 1.0, 0.3
STATED = 0.9
NOT_MEASURED = "not measured"
SAME, OTHER = "same family", "other families"  # of the ships' equations


def full(answer: Answer) -> bool:
    return answer.size > FULL - 1e-9


def small(answer: Answer) -> bool:
    return answer.size > SMALL - 1e-9 and not full(answer)


def tiny(answer: Answer) -> bool:
    return not full(answer) and not small(answer)


def physics(answer: Answer) -> bool:
    return answer.planned.model == "mmg"


def among(kind: str, sized: Test = lambda answer: True, seconds: int | None = 7000) -> Test:
    def test(answer: Answer) -> bool:
        there = seconds is None or answer.planned.seconds == seconds
        return there and physics(answer) and answer.kind == kind and sized(answer)

    return test


def _network(causes: Sequence[str]) -> Test:
    return lambda answer: not physics(answer) and set(answer.hidden) <= set(causes)


def right(answer: Answer) -> bool:
    return answer.right


def alarmed(answer: Answer) -> bool:
    """Anything but `none`: a name, unknown, undecided, coverage, external, or no verdict at all."""
    return answer.word != "none"


def outside_found(answer: Answer) -> bool:
    """Unknown with the right family, or undecided with that as the first or second answer; or the
    name that it has since."""
    return answer.found


def outside_its_group(answer: Answer) -> bool:
    """Something is named that is not there, and all that is there is in no group that is
    reported."""
    return answer.misnamed and not answer.found


@dataclass(frozen=True, slots=True)
class Rate:
    """A share of cases, and the limits asked of it at home and abroad."""

    what: str
    among: Test
    hit: Test
    home: Limits = FREE
    abroad: Limits = FREE

    def hits(self, answers: Iterable[Answer]) -> list[bool]:
        """A case without a verdict counts: it is neither right nor `none`."""
        return [self.hit(answer) for answer in answers if self.among(answer)]


def _remainder(family: str) -> Test:
    """Outside the catalogue, of full size, with that family as the truth."""
    return lambda answer: OUTSIDE(answer) and answer.truths == (f"unknown:{family}",)


def _of(names: Sequence[str]) -> Test:
    """One cause of these, of full size."""
    return lambda answer: among("one", full)(answer) and answer.hidden[0] in names


# actuators and lines have rows of their own
ONE = _of([name for name in NAMES if name not in (*ACTUATORS, *LINES)])
OUTSIDE = among("outside", full)
REMAINDERS = (  # of what is outside the catalogue
    "position", "heading", "time", "motion", "controls", "wind", "stochastic", "intermittent",
)  # fmt: skip
RATES = (
    Rate("named but wrong, any size", physics, lambda answer: answer.misnamed,
         (None, 0.01), (None, 0.015)),
    Rate("named but wrong, and the truth not among its alternatives", physics, outside_its_group),
    Rate("nothing hidden: any alarm", among("none", seconds=None), alarmed,
         (None, 0.03), (None, 0.03)),
    Rate("nothing hidden: a cause named", among("none", seconds=None),
         lambda answer: bool(answer.named)),
    Rate("one cause, size 1, 7000 s: named right", ONE, right, (0.97, None), (0.85, None)),
    Rate("actuators, size 1: named right", _of(ACTUATORS), right, (0.95, None), (0.85, None)),
    Rate("lines, tows and contact, size 1: named right", _of(LINES), right),
    Rate("the same: right among its alternatives, or undecided and among the first two", ONE,
         lambda answer: answer.found, (0.98, None), (0.90, None)),
    Rate("one cause, size 0.3 to 1, 7000 s", among("one", small), right, (0.90, None)),
    Rate("one cause, size below 0.3, 7000 s", among("one", tiny), right),
    Rate("one cause, size 1, 500 s", among("one", full, 500), right, (0.88, None)),
    Rate("outside, size 1: unknown or undecided, right remainder", OUTSIDE,
         outside_found, (0.95, None), (0.85, None)),
    *(Rate(f"outside, size 1: {name}", _remainder(name), outside_found) for name in REMAINDERS),
    Rate("outside, size below 1", among("outside", lambda answer: not full(answer)),
         outside_found),
    Rate("two at once, size 1: both, no third", among("two", full), right, (0.90, None)),
    Rate("two at once, size below 1", among("two", lambda answer: not full(answer)), right),
    Rate("traceback, or no verdict in time", physics, lambda answer: answer.word == FAILED,
         (None, 0.0), (None, 0.0)),
)  # fmt: skip
NETWORK = (
    Rate("network on affected data: what it cannot absorb", _network(SURVIVE), right,
         (0.90, None)),
    Rate("network on affected data: what it has absorbed, named", _network(ABSORBED),
         lambda answer: not answer.misnamed and bool(answer.named), (None, 0.0)),
    Rate("network on affected data: named but wrong", lambda answer: not physics(answer),
         lambda answer: answer.misnamed, (None, 0.02)),
)  # fmt: skip
INTERVALS = "90 % intervals that hold the truth"
ALL_INTERVALS = "the same, with bank, shallow water and side thrust"
CALIBRATION = "expected calibration error, 10 bins"
CERTAIN = f"reported with {STATED} or more: right"
LIMITS: dict[str, tuple[Limits, Limits]] = {  # what is not a share of cases: home, abroad
    INTERVALS: ((0.85, 0.95), (0.80, 0.95)),
    ALL_INTERVALS: (FREE, FREE),
    CALIBRATION: ((None, 0.03), (None, 0.05)),
    CERTAIN: ((0.98, None), (0.95, None)),
}


def intervals(answers: Iterable[Answer], every: bool = False) -> list[bool]:
    """Of causes that were named; those whose form differs in the simulator have no goal, and are
    there with `every` only."""
    compared = chain.from_iterable(answer.compared.items() for answer in answers)
    return [hit for name, one in compared if every or name not in OTHER_FORM for hit in one.covered]


def statements(answers: Iterable[Answer]) -> list[Statement]:
    """All that is stated with a probability, and whether it is true."""
    return [*chain.from_iterable(answer.statements for answer in answers)]


def certain(answers: Iterable[Answer]) -> list[bool]:
    return [true for probability, true in statements(answers) if probability >= STATED]


# --- cells ----------------------------------------------------------------------------------------


def percent(share: float) -> str:
    return f"{100.0 * share:.1f} %".replace(".0 %", " %")


def asked(limits: Limits) -> str:
    signed = zip((">=", "<="), limits, strict=True)
    return " and ".join(f"{sign} {percent(limit)}" for sign, limit in signed if limit is not None)


def met(share: float, limits: Limits) -> str:
    """yes or no; empty where nothing is asked. What was named may gain more than the truth does: a
    share of that is above 1."""
    least, most = limits
    if least is None and most is None:
        return ""
    enough, little = least is None or share >= least, most is None or share <= most
    return "yes" if enough and little else "no"


def cell(hits: Sequence[bool]) -> str:
    """Share, count and Clopper-Pearson interval at 90 %; empty without cases."""
    if not hits:
        return ""
    low, high = clopper_pearson(sum(hits), len(hits))
    ends = f"[{100.0 * low:.1f}, {100.0 * high:.1f}]"
    return f"{percent(sum(hits) / len(hits))} ({sum(hits)}/{len(hits)}) {ends}"


# --- tables ---------------------------------------------------------------------------------------

Figure = tuple[float, str]  # the number that is held against the limits, and its cell


def figures(answers: Sequence[Answer]) -> dict[str, Figure]:
    """Row of the goals' table → what was measured; rows without a case are left out."""
    shares = {rate.what: rate.hits(answers) for rate in RATES}
    shares |= {INTERVALS: intervals(answers), CERTAIN: certain(answers)}
    if (every := intervals(answers, every=True)) != shares[INTERVALS]:
        shares[ALL_INTERVALS] = every
    found = {what: (sum(h) / len(h), cell(h)) for what, h in shares.items() if h}
    if pairs := statements(answers):
        error = calibration(pairs)
        found[CALIBRATION] = (error, f"{percent(error)} ({len(pairs)})")
    return found


ROWS: dict[str, tuple[Limits, Limits]] = {
    **{rate.what: (rate.home, rate.abroad) for rate in RATES[:-1]},
    **LIMITS,
    RATES[-1].what: (RATES[-1].home, RATES[-1].abroad),
}


def table(home: Sequence[Answer], abroad: Sequence[Answer]) -> str:
    """The goals' table of one program: measured, asked and met, of both families."""
    measured = (figures(home), figures(abroad))
    rows = []
    for what, limits in ROWS.items():
        if not any(what in figures_ for figures_ in measured):
            continue
        cells = []
        for found, limit in zip(measured, limits, strict=True):
            share, text = found.get(what, (None, NOT_MEASURED if asked(limit) else ""))
            cells += [text, asked(limit), "" if share is None else met(share, limit)]
        rows.append((what, *cells))
    return tables.table(("", SAME, "goal", "met", OTHER, "goal", "met"), rows)


def by_method(answers: Mapping[str, Sequence[Answer]], abroad: bool) -> str:
    """The same rows with a column a method, of one place."""
    measured = {method: figures(given) for method, given in answers.items()}
    each = measured.values()
    rows = [
        (what, asked(limits[abroad]), *(found[what][1] if what in found else "" for found in each))
        for what, limits in ROWS.items()
        if any(what in found for found in each)
    ]
    return tables.table(("", "goal", *measured), rows)
