"""The causes that are named."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from shiplog.diagnosis.hypotheses.hypothesis import name_of
from shiplog.diagnosis.onset.onsets import Course
from shiplog.diagnosis.residual.next_manoeuvre import Advice
from shiplog.diagnosis.season.trends import OfVoyage
from shiplog.diagnosis.verdict.result import SIDE_THRUST, Decision, Named
from shiplog.exceptions import listed
from shiplog.models.causes import ParameterEstimate
from shiplog.nomenclature.numbers import NINETY_SPREADS, figure
from shiplog.report.diagnosis.sections import onset as onsets
from shiplog.report.diagnosis.sections import season
from shiplog.report.diagnosis.sections.onset import Dated, Off, Onset, Slope
from shiplog.report.diagnosis.sections.season import InVoyage
from shiplog.report.evaluation.text_table import table

# Of what it is: the part of a cause's label after the colon, by one or two words
WHICH = ("channel", "actuator", "of", "other")
SIDE_REMEDY = (
    "Find out what pushed at these times. If it is a thruster of the ship, record its order or its "
    "revolutions, and add it to the profile."
)
UNADVISED = "the same manoeuvres again, with turns both ways and stops"


@dataclass(frozen=True, slots=True)
class Estimate:
    """One parameter of a cause, in its unit. A channel or an actuator is a word.

    low   of the 90 % interval
    high  of it
    """

    value: float | str
    low: float | str
    high: float | str
    unit: str


@dataclass(frozen=True, slots=True)
class NextTest:
    """A simulated manoeuvre, and what it is expected to bring.

    seconds  that it takes
    nats     log Bayes factor between the cause and its alternatives
    """

    manoeuvre: str
    seconds: float
    nats: float


@dataclass(frozen=True, slots=True)
class Active:
    """When an unrecorded thruster worked; `force_N` is the strongest.

    start_s  from the voyage's first row, s
    sd_N     standard deviation of `force_N`
    """

    voyage: str
    start_s: float
    end_s: float
    force_N: float
    sd_N: float


@dataclass(frozen=True, slots=True, kw_only=True)
class NamedCause:
    """The causes of a verdict `named`.

    probability             0 to 1
    parameters              each with `value`, `low`, `high`, `unit`; 90 % interval
    times                   of an unrecorded thruster, with `voyage`, `start_s`, `end_s`,
                            `force_N`, `sd_N`
    equation                with its numbers
    remedy                  what to do about it
    indistinguishable_from  causes that these data cannot tell from it
    evidence_nats           log Bayes factor; none of what was chosen on whole windows
    next_test               what tells them apart
    next_test_expected      of the simulated manoeuvres the best, with `manoeuvre`, `seconds`,
                            `nats`
    user                    true of a cause of your own
    onset                   since when it acts: `elapsed_s`, `low`, `high`, `from_start`, `voyage`,
                            `start_s`
    off                     until when, where it ends: the same with `probability`
    slope                   of a cause that grows, instead: `parameter`, `value`, `low`, `high`,
                            `unit`, `days`
    while_on                `parameters` while it acts, where that is not all the time
    voyages                 of two voyages or more: `voyage`, `date`, `parameters` and, of what
                            wears, `calm_speed_change` (%), by partial pooling
    """

    name: str
    probability: float
    parameters: Mapping[str, Estimate]
    times: tuple[Active, ...] | None = None
    sentence: str
    equation: str
    remedy: str | None = None
    indistinguishable_from: tuple[str, ...] = ()
    evidence_nats: float | None = None
    next_test: str | None = None
    next_test_expected: NextTest | None = None
    user: bool | None = None
    onset: Onset | None = None
    off: Off | None = None
    slope: Slope | None = None
    while_on: Mapping[str, Estimate] | None = None
    voyages: tuple[InVoyage, ...] | None = None


def of_named(
    named: Named, advice: Advice | None = None, course: Course | None = None,
    voyages: Sequence[OfVoyage] = (),
) -> NamedCause:  # fmt: skip
    alike = tuple(dict.fromkeys(name_of(label) for label in named.alike))
    tests = [named.cause.separated_by[n] for n in alike if n in named.cause.separated_by]
    advised = advice.words if advice else UNADVISED
    dated = onsets.of(course)
    return NamedCause(
        name=named.cause.name,
        probability=min(max(named.probability, 0.0), 1.0),
        parameters=parameters(named),
        sentence=named.cause.sentence(named.estimates),
        equation=equation(named),
        remedy=named.cause.remedy or None,
        indistinguishable_from=alike,
        evidence_nats=named.evidence if math.isfinite(named.evidence) else None,
        next_test=("; ".join(dict.fromkeys(tests)) or advised) if alike else None,
        next_test_expected=advice and NextTest(advice.words, advice.seconds, advice.nats),
        user=named.cause.user or None,
        onset=dated.onset,
        off=dated.off,
        slope=dated.slope,
        while_on=_estimates(dated.while_on),
        voyages=season.of(voyages),
    )


def _estimates(found: Mapping[str, ParameterEstimate] | None) -> dict[str, Estimate] | None:
    if found is None:
        return None
    return {k: Estimate(one.value, one.low, one.high, one.unit) for k, one in found.items()}


def parameters(named: Named) -> dict[str, Estimate]:
    """The contract's parameters, and of which channel or actuator they are."""
    sizes = _estimates(named.estimates) or {}
    words = {key: getattr(named.cause, key, "") for key in WHICH}
    return sizes | {key: Estimate(one, one, one, "") for key, one in words.items() if one}


def equation(named: Named) -> str:
    """The equation with its numbers, of the fit and of the contract's parameters."""
    values = {p.name: float(v) for p, v in zip(named.cause.parameters, named.numbers, strict=False)}
    values |= {k: v.value for k, v in named.estimates.items()}
    return named.cause.equation.format(**values)


def of_side_force(decision: Decision, times: Iterable[Mapping]) -> NamedCause:
    """An unrecorded thruster. `times`: voyage, start_s, end_s, force_N, sd_N."""
    found = decision.side_force
    assert found is not None
    active = tuple(Active(**one) for one in times)
    strongest = max(active, key=lambda one: abs(one.force_N), default=None)
    peak, sd = (found.force, found.force) if strongest is None else (
        abs(strongest.force_N), strongest.sd_N,
    )  # fmt: skip
    low, high = max(peak - NINETY_SPREADS * sd, 0.0), peak + NINETY_SPREADS * sd
    where = "ahead of" if found.lever >= 0.0 else "abaft"
    return NamedCause(
        name=SIDE_THRUST,
        probability=min(decision.ranking[SIDE_THRUST], 1.0),
        parameters={"force": Estimate(peak, low, high, "N")},
        times=active,
        sentence=(
            f"An intermittent side force of up to {figure(peak)} N acts "
            f"{figure(abs(found.lever))} m {where} midship and is not recorded: a thruster, or an "
            "external force."
        ),
        equation="Y + F(t), N + x F(t)",
        remedy=SIDE_REMEDY,
        evidence_nats=found.gain,
    )


def markdown(causes: Sequence[NamedCause]) -> list[str]:
    return [line for one in causes for line in _lines(one)]


def _lines(cause: NamedCause) -> list[str]:
    rows = [(name, *_row(one)) for name, one in cause.parameters.items()]
    lines = [
        f"## {cause.name} (probability {cause.probability:.2f})", "",
        cause.sentence, "", f"    {cause.equation}", "",
        table(("parameter", "value", "90 % interval", "unit"), rows, ("value",)),
    ]  # fmt: skip
    for line in onsets.lines(Dated(cause.onset, cause.off, cause.slope, cause.while_on)):
        lines += ["", line]
    lines += season.lines(cause.voyages)
    if cause.indistinguishable_from:
        lines += [
            "", f"These data cannot tell it from {listed(cause.indistinguishable_from)}. "
            f"A test that can: {cause.next_test}.",
        ]  # fmt: skip
    if (expected := cause.next_test_expected) is not None:
        lines.append(
            f"Of the simulated manoeuvres, {expected.manoeuvre} separates them best: "
            f"{figure(expected.nats, 3)} nats in {expected.seconds:.0f} s."
        )
    return [*lines, ""]


def _row(one: Estimate) -> tuple[str, str, str]:
    """Value, interval and unit; a channel or an actuator has no interval."""
    if isinstance(one.value, str) or isinstance(one.low, str) or isinstance(one.high, str):
        return str(one.value), "-", "-"
    return figure(one.value, 4), f"{figure(one.low, 4)} to {figure(one.high, 4)}", one.unit
