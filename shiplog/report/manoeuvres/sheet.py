"""The sheet of manoeuvres as a command prints it: text, JSON and a frame."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import polars as pl

from shiplog.manoeuvres.conditions import beaufort
from shiplog.manoeuvres.entry import Entry, Line
from shiplog.manoeuvres.quantity import Estimate
from shiplog.manoeuvres.sheet import Sheet
from shiplog.nomenclature.contract import CONTRACT
from shiplog.nomenclature.numbers import counted, figure
from shiplog.report.evaluation.text_table import table
from shiplog.report.result import Shown, Shows

MOST_PARTS = 8  # manoeuvres without any quantity that are listed by name
NONE = "-"
MOST_DIGITS = 2  # decimals: a hundredth of a length, or of a degree, is no more than noise
SCHEMA = {
    "voyage": pl.String, "start_s": pl.Float64, "kind": pl.String, "manoeuvre": pl.String,
    "standard": pl.Boolean, "quantity": pl.String, "unit": pl.String,
    **{f"{side}{end}": pl.Float64 for side in ("measured", "simulated", "extended")
       for end in ("", "_low", "_high")},
    "limit": pl.Float64, "applies": pl.Boolean,
}  # fmt: skip


@dataclass(frozen=True, repr=False)
class ManoeuvreSheet(Shows):
    """`sheet` has everything; `frame` is a row a quantity of each manoeuvre."""

    sheet: Sheet
    shown: Shown | None = None

    @property
    def lines(self) -> list[str]:
        sheet, found = self.sheet, []
        ship = sheet.profile.ship
        sailed = [e for e in sheet.entries if e.voyage is not None]
        if sheet.voyages:
            there = counted(len(sailed), "manoeuvre")
            found.append(f"{ship.name}: {there} found in {counted(len(sheet.voyages), 'voyage')}.")
            found.append("")
        empty = [e for e in sheet.entries if not e.lines]
        full = [e for e in sheet.entries if e.lines]
        found += [_manoeuvres([e for e in full if e.voyage is not None]), ""] if sailed else []
        found += [_quantities(full, sheet.runs), ""] if full else []
        noted = [f"{_short(e)}: {note}." for e in full for note in e.notes]
        found += [*noted, ""] if noted else []
        found += [*not_applying(full)]
        if empty:
            named = [f"{_where(e)}{e.name}: {_why(e)}" for e in empty[:MOST_PARTS]]
            found += ["Recognised, and too short for any quantity:", *(f"- {n}" for n in named)]
            if len(empty) > MOST_PARTS:
                found.append(f"- and {len(empty) - MOST_PARTS} more; --json has them all.")
            found.append("")
        return [*found, *sheet.notes]

    @property
    def json(self) -> dict:
        sheet = self.sheet
        return {
            "contract": CONTRACT, "ship": sheet.profile.ship.name, "scale": sheet.scale,
            "runs": {"simulated": sheet.runs[0], "extended": sheet.runs[1]},
            "manoeuvres": [entry.json for entry in sheet.entries], "notes": list(sheet.notes),
        }  # fmt: skip

    @property
    def frame(self) -> pl.DataFrame:
        return pl.DataFrame(
            [_row(entry, line) for entry in self.sheet.entries for line in entry.lines],
            schema=SCHEMA,
            orient="row",
        )


def _row(entry: Entry, line: Line) -> tuple:
    values: list[float | None] = []
    for one in (line.measured, line.simulated, line.extended):
        values += [None] * 3 if one is None else [one.value, one.low, one.high]
    limit = line.limit
    return (
        entry.voyage, entry.start, entry.kind, entry.name, entry.standard, line.name,
        line.kind.unit, *values, None if limit is None else limit.value,
        None if limit is None else limit.applies,
    )  # fmt: skip


def _where(entry: Entry) -> str:
    return "" if entry.voyage is None else f"{entry.voyage}, {entry.start:.1f} s: "


def _why(entry: Entry) -> str:
    return "; ".join((*entry.why_not, *entry.notes))


def head(entry: Entry) -> str:
    """What it is, where: a title."""
    if entry.voyage is None:
        return f"By the model alone: {entry.name}"
    return f"{_where(entry)}{entry.name}"


def conditions(entry: Entry) -> str:
    """A sentence."""
    c = entry.conditions
    parts = [f"approach at {figure(c.speed, 3)} m/s"]
    if c.wind is not None and entry.voyage is not None:
        parts.append(f"wind {figure(c.wind)} m/s ({beaufort(c.wind)} Bft)")
    elif entry.voyage is None:
        parts.append("calm, still water")
    if c.depth is not None:
        parts.append(f"depth {figure(c.depth, 3)} m")
    if c.coverage is not None:
        parts.append(f"{c.coverage:.0%} of it inside the training data")
    if entry.drift is not None:
        speed, direction = entry.drift
        parts.append(f"drift of {figure(speed)} m/s to {direction:.0f} deg taken out")
    if c.unknown:
        parts.append(f"not recorded: {', '.join(c.unknown)}")
    return f"{'; '.join(parts)}."


def standing(entry: Entry) -> str:
    """Whether it is of the standard, in words."""
    if entry.voyage is None:
        return ""
    if entry.standard:
        return "Of the standard, as far as the log shows."
    return f"Not of the standard: {'; '.join(entry.why_not)}."


def _short(entry: Entry) -> str:
    where = "model alone" if entry.voyage is None else f"{entry.voyage}, {entry.start:.0f} s"
    return f"{where}, {entry.name}"


def _manoeuvres(entries: Sequence[Entry]) -> str:
    """A line a manoeuvre: conditions, and why it is not the standard's."""
    rows = []
    for e in entries:
        c = e.conditions
        wind = NONE if c.wind is None else f"{figure(c.wind)} m/s, {beaufort(c.wind)} Bft"
        inside = NONE if c.coverage is None else f"{c.coverage:.0%}"
        why = "; ".join(e.why_not) or "yes, as far as the log shows"
        drift = NONE if e.drift is None else f"{figure(e.drift[0])} m/s"
        speed = figure(c.speed, 3)
        rows.append((e.voyage, f"{e.start:.1f}", e.name, speed, wind, drift, inside, why))
    titles = (
        "voyage", "at, s", "manoeuvre", "approach, m/s", "wind", "drift taken out",
        "inside the training data", "of the standard",
    )  # fmt: skip
    return table(titles, rows, ("at, s", "approach, m/s"))


def _quantities(entries: Sequence[Entry], runs: Sequence[str | None]) -> str:
    columns = [("measured", "measured")] if any(e.voyage is not None for e in entries) else []
    columns += [("simulated", "simulated")] if runs[0] else []
    columns += [("extended", "extended")] if runs[1] else []
    full = any(line.full_load is not None for e in entries for line in e.lines)
    columns += [("full load", "full_load")] if full else []
    rows = [
        (_short(e), line.kind.words, line.kind.unit,
         *(value(getattr(line, key)) for _, key in columns), limit(line))
        for e in entries for line in e.lines
    ]  # fmt: skip
    titles = [title for title, _ in columns]
    return table(("manoeuvre", "quantity", "unit", *titles, "limit"), rows, right=titles)


def not_applying(entries: Sequence[Entry]) -> list[str]:
    """Why limits in parentheses do not apply, each reason once."""
    reasons = {
        line.limit.why_not for e in entries for line in e.lines
        if line.limit is not None and not line.limit.applies
    }  # fmt: skip
    return [f"A limit in parentheses does not apply: {one}." for one in sorted(reasons)]


def columns_of(entry: Entry, runs: Sequence[str | None]) -> list[tuple[str, str]]:
    """Title and field of what there is."""
    found = [("measured", "measured")] if entry.voyage is not None else []
    found += [("simulated", "simulated")] if runs[0] else []
    found += [("extended", "extended")] if runs[1] else []
    full = any(line.full_load is not None for line in entry.lines)
    return found + ([("full load", "full_load")] if full else [])


def value(estimate: Estimate | None) -> str:
    """`2.74 (2.72 to 2.76)`; a star where the model left its training data."""
    if estimate is None:
        return NONE
    star = "*" if estimate.note else ""
    digits = _digits(estimate)
    low, high, middle = (f"{x:.{digits}f}" for x in (estimate.low, estimate.high, estimate.value))
    if low == high:
        return f"{middle}{star}"
    return f"{middle}{star} ({low} to {high})"


def _digits(estimate: Estimate) -> int:
    """Decimals that the interval's width deserves, two digits of it; no more than MOST_DIGITS."""
    width = estimate.high - estimate.low
    if width <= 0.0:
        return MOST_DIGITS
    return int(min(MOST_DIGITS, max(0, 1 - math.floor(math.log10(width)))))


def limit(line: Line) -> str:
    """`at most 4.5`; in parentheses where it does not apply."""
    if line.limit is None:
        return NONE
    text = f"at most {figure(line.limit.value, 3)}"
    return text if line.limit.applies else f"({text})"


def met(line: Line) -> bool | None:
    """Whether the limit is kept by what is measured, else simulated; None where it does not
    apply."""
    best = line.measured or line.extended or line.simulated
    if line.limit is None or not line.limit.applies or best is None:
        return None
    return best.value <= line.limit.value
