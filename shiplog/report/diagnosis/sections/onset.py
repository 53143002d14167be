"""Since when a named cause acts, or how fast it grows."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from shiplog.diagnosis.onset import onsets
from shiplog.diagnosis.onset.onsets import Course
from shiplog.nomenclature.numbers import figure

HALF = 0.5  # probability, from which "from the start" is the likelier answer


@dataclass(frozen=True, slots=True, kw_only=True)
class Onset:
    """When a named cause begins to act, in seconds of recorded time: the voyages one after another,
    in the order of their start, without what lies between them. 0 is the start of the trial.

    elapsed_s   median
    low         of the 90 % interval
    high        of it
    from_start  probability that it is present from the start
    voyage      in which the median lies
    start_s     the median, from that voyage's first row
    """

    elapsed_s: float
    low: float
    high: float
    from_start: float
    voyage: str
    start_s: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Off:
    """When a named cause ends, where it is more probable than not that it ends within the trial.

    probability  of that; the rest as of `onset`
    """

    elapsed_s: float
    low: float
    high: float
    probability: float
    voyage: str
    start_s: float


@dataclass(frozen=True, slots=True)
class Slope:
    """How a cause that grows changes in a day, where it has a slope and no onset.

    parameter  whose change it is
    value      in `unit`, with the 90 % interval `low` to `high`
    days       from the first row of the trial to its last one
    """

    parameter: str
    value: float
    low: float
    high: float
    unit: str
    days: float


@dataclass(frozen=True)
class Dated:
    """A course in the contract's words; what does not apply is None.

    while_on  the parameters while the cause acts, where that is not all the time
    """

    onset: Onset | None = None
    off: Off | None = None
    slope: Slope | None = None
    while_on: Mapping[str, Any] | None = None


def of(course: Course | None) -> Dated:
    if course is None:
        return Dated()
    slope = None
    if (grows := course.slope) is not None:
        slope = Slope(
            grows.parameter, grows.value, grows.low, grows.high, grows.unit, grows.days
        )  # fmt: skip
    if (found := course.onset) is None:
        return Dated(slope=slope)
    off = None if found.off is None else Off(**_moment(found.off), probability=found.ends)
    return Dated(Onset(**_moment(found.begin), from_start=found.from_start), off, slope,
                 dict(found.while_on) or None)  # fmt: skip


def _moment(one: onsets.Moment) -> dict[str, Any]:
    return {"elapsed_s": one.elapsed_s, "low": one.low, "high": one.high, "voyage": one.voyage,
            "start_s": one.start_s}  # fmt: skip


def lines(dated: Dated) -> list[str]:
    """Sentences of the text and the report."""
    found = []
    if (onset := dated.onset) is not None:
        found.append(f"Since when: {since(onset, dated.off)}.")
    if (slope := dated.slope) is not None:
        found.append(
            f"Change of its {slope.parameter}: {_per_day(slope.value, slope.unit)} "
            f"(90 %: {figure(slope.low, 3)} to {figure(slope.high, 3)}) over "
            f"{figure(slope.days, 3)} days."
        )
    if dated.while_on:
        sizes = ", ".join(
            f"{name.replace('_', ' ')} {figure(one.value, 3)} ({figure(one.low, 3)} to "
            f"{figure(one.high, 3)}) {one.unit}".rstrip()
            for name, one in dated.while_on.items()
        )
        found.append(f"While it acts: {sizes}.")
    return found


def since(onset: Onset, off: Off | None) -> str:
    """present from the start, or the recorded time at which it began; and until when."""
    if onset.from_start >= HALF:
        text = f"present from the start (probability {onset.from_start:.2f})"
    else:
        text = (
            f"from {onset.start_s:.0f} s of {onset.voyage} on; in recorded time "
            f"{onset.elapsed_s:.0f} s, 90 %: {onset.low:.0f} to {onset.high:.0f} s "
            f"(from the start: probability {onset.from_start:.2f})"
        )
    if off is not None:
        text += (
            f"; it ends at {off.start_s:.0f} s of {off.voyage}, in recorded time "
            f"{off.elapsed_s:.0f} s, 90 %: {off.low:.0f} to {off.high:.0f} s"
        )
    return text


def _per_day(value: float, unit: str) -> str:
    return f"{figure(value, 3)} {'a day' if unit == '1/day' else unit}"
