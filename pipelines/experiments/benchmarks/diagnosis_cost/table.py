"""Rows of the table: what was measured on both builds, whether it is equal, what is asked."""

from __future__ import annotations

import statistics
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class Row:
    """A line of the table.

    ours, theirs   a value a round, in `unit`; `theirs` is empty where only a limit is asked
    peer           whose the other values are
    least          ratio theirs / ours that is asked; None for none
    most           greatest value of ours that is asked, in `unit`; None for none
    apart          largest difference of the results, of the largest of them; None: not comparable
    alike          largest difference at which they count as equal
    reason         why it was not measured; empty where it was
    """

    what: str
    unit: str
    ours: Sequence[float] = ()
    theirs: Sequence[float] = ()
    peer: str = "older build"
    least: float | None = None
    most: float | None = None
    apart: float | None = None
    alike: float | None = None
    worst: bool = False  # the largest value decides, not the median
    reason: str = ""
    facts: dict[str, Any] = field(default_factory=dict)

    @property
    def equal(self) -> bool:
        return self.apart is None or self.alike is None or self.apart <= self.alike

    @property
    def ratios(self) -> list[float]:
        """Theirs over ours, round by round."""
        return [b / a for a, b in zip(self.ours, self.theirs, strict=True)] if self.theirs else []

    @property
    def ratio(self) -> float | None:
        """Of the medians' rounds; of the worst values where those decide."""
        if not self.ratios or not self.equal:
            return None
        return max(self.theirs) / max(self.ours) if self.worst else statistics.median(self.ratios)

    @property
    def value(self) -> float | None:
        if not self.ours:
            return None
        return max(self.ours) if self.worst or self.most else statistics.median(self.ours)

    @property
    def holds(self) -> bool | None:
        """Whether what is asked is there; None where nothing is, or nothing was measured."""
        if self.reason or not self.equal:
            return None if self.reason else False
        if self.least is not None and self.ratio is not None:
            return self.ratio >= self.least
        if self.most is not None and self.value is not None:
            return self.value <= self.most
        return None

    def as_json(self) -> dict[str, Any]:
        return {
            "what": self.what, "unit": self.unit, "ours": list(self.ours), "peer": self.peer,
            "theirs": list(self.theirs), "ratio": self.ratio, "ratios": self.ratios,
            "asked_ratio": self.least, "asked_at_most": self.most, "apart": self.apart,
            "alike": self.alike, "equal": self.equal, "holds": self.holds, "reason": self.reason,
            **self.facts,
        }  # fmt: skip


HEAD = (
    "what",
    "this build",
    "other",
    "peer",
    "ratio (least to most)",
    "asked",
    "holds",
    "equal to",
)


def lines(rows: Sequence[Row]) -> list[str]:
    """Markdown, a line a row; below them why some were not measured."""
    found = [f"| {' | '.join(HEAD)} |", "| --- | ---: | ---: | --- | ---: | ---: | --- | ---: |"]
    for row in rows:
        if row.reason:
            continue
        found.append(f"| {' | '.join(_cells(row))} |")
    left = [f"not measured: {row.what}: {row.reason}" for row in rows if row.reason]
    return [*found, *([""] if left else []), *left]


def _cells(row: Row) -> list[str]:
    other = (max if row.worst else statistics.median)(row.theirs) if row.theirs else None
    ratio = "-" if row.ratio is None else f"{row.ratio:.2f}"
    if len(row.ratios) > 1 and row.ratio is not None:
        ratio += f" ({min(row.ratios):.2f} to {max(row.ratios):.2f})"
    asked = "-"
    if row.least is not None:
        asked = f"≥ {row.least:g}"
    elif row.most is not None:
        asked = f"≤ {row.most:g} {row.unit}"
    said = {True: "yes", False: "no", None: "-"}[row.holds]
    apart = "-" if row.apart is None else f"{row.apart:.1e}" + ("" if row.equal else ", NOT EQUAL")
    own, their = (_value(one, row.unit) for one in (row.value, other))
    return [row.what, own, their, row.peer if row.theirs else "-", ratio, asked, said, apart]


def _value(value: float | None, unit: str) -> str:
    if value is None:
        return "-"
    if unit == "s" and value < 1.0:
        return f"{1e3 * value:.3g} ms"
    return f"{value:.4g} {unit}" if value < 1000 else f"{value:.0f} {unit}"
