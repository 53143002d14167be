"""One limit against what was measured: it holds, it is broken, or it was not assessed."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal

from shiplog.nomenclature.numbers import figure
from shiplog.report.evaluation.text_table import one_line

State = Literal["holds", "broken", "not assessed"]
DIGITS = 3  # significant ones of a figure, unless it needs more to differ from the limit
MOST_DIGITS = 12


@dataclass(frozen=True, slots=True)
class Measured:
    """A figure, or a word, that a limit is held against.

    value      None where it was not assessed; infinite where a simulation diverged
    low, high  its 90 % interval; None where there is none
    words      in place of the figure, such as "not found, detectable from 0.02 m/s"
    reason     why it was not assessed, or what explains it
    """

    value: float | None = None
    low: float | None = None
    high: float | None = None
    words: str = ""
    reason: str = ""


@dataclass(frozen=True, slots=True)
class Outcome:
    """What became of one limit.

    section  of limits.toml, with the voyage where it is of one
    key      of limits.toml
    name     in words
    bound    "at most", "at least", "allowed" or "not allowed"
    limit    a number in `unit`, or words
    """

    section: str
    key: str
    name: str
    bound: str
    limit: float | tuple[str, ...] | None
    unit: str
    measured: Measured
    state: State

    @property
    def expected(self) -> str:
        """The limit, as in `at most 4 m`."""
        if self.limit is None:
            return self.bound
        if isinstance(self.limit, tuple):
            return f"{self.bound} {', '.join(self.limit)}"
        return f"{self.bound} {self.limit:g} {self.unit}".rstrip()

    @property
    def found(self) -> str:
        """The figure with its interval, as in `5.2 m (4.1 to 6.4)`; or the words."""
        m = self.measured
        if m.words or m.value is None:
            return m.words
        limit = self.limit if isinstance(self.limit, float) else None
        text = f"{_in_words(m.value, limit)} {self.unit}".rstrip()
        if m.low is None or m.high is None:
            return text
        return f"{text} ({_in_words(m.low, None)} to {_in_words(m.high, limit)})"

    @property
    def line(self) -> str:
        """State, name, what was measured, limit; with a reason where there is one."""
        head = f"{self.state:<6} {self.name}"
        found = self.found or "no figure"
        text = f"{head}: {found}, {self.expected}"
        if self.state == "not assessed" and not self.found:
            text = f"{head}, {self.expected}"
        why = f": {self.measured.reason}" if self.measured.reason else ""
        return one_line(f"{text}{why}")

    def as_json(self) -> dict:
        m = self.measured
        return {
            "section": self.section, "key": self.key, "name": self.name, "bound": self.bound,
            "limit": list(self.limit) if isinstance(self.limit, tuple) else self.limit,
            "unit": self.unit, "measured": m.value, "low": m.low, "high": m.high,
            "words": m.words, "outcome": self.state, "reason": m.reason,
            "expected": self.expected, "found": self.found,
        }  # fmt: skip


def of_number(
    section: str, key: str, name: str, unit: str, limit: float, measured: Measured,
    at_least: bool = False, far_end: bool = False,
) -> Outcome:  # fmt: skip
    """A limit on a figure.

    far_end   whether the far end of the interval is compared: the figure is an estimate of what may
              be larger. Else the figure itself, which was measured on these very windows
    """
    bound = "at least" if at_least else "at most"
    value = measured.value
    if far_end and measured.high is not None:
        value = measured.high
    if value is None:
        state: State = "not assessed"
    elif at_least:
        state = "holds" if value >= limit else "broken"
    else:
        state = "holds" if value <= limit else "broken"
    if state == "broken" and measured.value is not None and measured.value <= limit and far_end:
        why = f"the far end of the interval counts. {measured.reason}".strip()
        measured = replace(measured, reason=why)
    return Outcome(section, key, name, bound, limit, unit, measured, state)


def _in_words(value: float, limit: float | None) -> str:
    """With as many digits as tell it from the limit: 4.002 is not `4` where 4 is the limit."""
    if not math.isfinite(value):
        return "diverged"
    for digits in range(DIGITS, MOST_DIGITS):
        text = figure(value, digits)
        if limit is None or value == limit or float(text) != limit:
            return text
    return repr(value)
