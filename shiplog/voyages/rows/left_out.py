"""Values that are blank before anything is interpolated, since they are none: what was left out of
each source, the finding that says it, and the rows for which that finding is enough."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from shiplog.logs.health.health_report import Finding


@dataclass(frozen=True, slots=True)
class LeftOut:
    """Values of one source that are blank: their times [ns], and what to say of them."""

    kind: str
    name: str
    times: np.ndarray
    sentence: str  # with {first} and {last} for the seconds of the first one and of the last
    value: float
    unit: str
    low: float | None = None
    high: float | None = None

    def finding(self, start: int) -> Finding:
        """As a finding of a voyage whose first row is at `start` [ns]."""
        first, last = ((int(t) - start) * 1e-9 for t in (self.times.min(), self.times.max()))
        said = self.sentence.replace("{first}", f"{first:.1f} s").replace("{last}", f"{last:.1f} s")
        return Finding(
            self.kind, self.name, said, round(first, 3), round(last, 3), self.value, self.low,
            self.high, self.unit,
        )  # fmt: skip


def findings_of(left_out: Iterable[LeftOut], start: int) -> list[Finding]:
    """One of each, of a voyage whose first row is at `start` [ns]."""
    return [one.finding(start) for one in left_out if len(one.times)]


def times_of(left_out: Iterable[LeftOut]) -> dict[str, np.ndarray]:
    """Times [ns] of each source at which a value was left out, in order."""
    named: dict[str, list[np.ndarray]] = {}
    for one in left_out:
        named.setdefault(one.name, []).append(one.times)
    return {name: np.unique(np.concatenate(times)) for name, times in named.items()}


def rows_explained(times: np.ndarray, known: np.ndarray, left_out: np.ndarray) -> np.ndarray:
    """Grid rows [m] bool between whose neighbouring samples a value was left out.

    times [m] ns; known [n] ns: the samples that are left; left_out [k] ns, in order
    """
    if not len(left_out):
        return np.zeros(len(times), bool)
    after = np.searchsorted(known, times, side="left")
    ends = np.concatenate((known, [np.iinfo(np.int64).max]))
    begins = np.concatenate(([np.iinfo(np.int64).min], known))
    low = np.searchsorted(left_out, begins[after], side="right")
    return np.searchsorted(left_out, ends[after], side="left") > low
