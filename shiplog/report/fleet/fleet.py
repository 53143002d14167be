"""The result of `shiplog diagnose --list`: a row a ship, as text, JSON and CSV."""

from __future__ import annotations

import csv
import io
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import polars as pl

from shiplog.exceptions import ShiplogError
from shiplog.machine import files
from shiplog.nomenclature.contract import CONTRACT
from shiplog.nomenclature.numbers import counted, percent
from shiplog.report.diagnosis.diagnosis import PAGE
from shiplog.report.evaluation.text_table import inert, one_line, table
from shiplog.report.result import Printed

TABLE = "verdicts"  # .csv, .json and .md in the folder of a fleet
FAILED = "failed"
VERDICTS = ("named", "none", "undecided", "unknown", "coverage", "external", FAILED)  # as counted
FORMULA = ("=", "+", "-", "@")  # how a cell begins that a spreadsheet would work out
OF_GAIN = ("reduction", "low", "high", "held_out_windows")
NOT_DRAWN = (
    "its pictures and its page could not be drawn; verdict.json and report.md are there. Give the "
    "same command again."
)
AGAIN = "the same command does what is missing, with a smaller --jobs where memory was short."


@dataclass(frozen=True)
class Row:
    """A ship of the list and its verdict, or why there is none.

    line      of the list
    run, store, voyages   as the list has them
    folder    of its diagnosis, in that of the fleet; empty where there is none
    verdict   as --json of one diagnosis; None where it failed
    kept      whether it was there already, from the same inputs
    drawn     whether its pictures and its page could be drawn
    error     what was found and expected, and what to do next; empty where it is done
    warnings  of its diagnosis
    """

    line: int
    run: str
    store: str
    voyages: str
    folder: str = ""
    verdict: Mapping[str, Any] | None = None
    kept: bool = False
    drawn: bool = True
    error: str = ""
    warnings: tuple[str, ...] = ()

    @property
    def said(self) -> str:
        """Its verdict in one word, or that it failed."""
        return FAILED if self.verdict is None else str(self.verdict["verdict"])

    @property
    def ship(self) -> str:
        found = (self.verdict or {}).get("subject")
        return str(found.get("ship", "")) if isinstance(found, dict) else ""

    @property
    def sentence(self) -> str:
        return str((self.verdict or {}).get("sentence", ""))

    @property
    def causes(self) -> list[dict[str, Any]]:
        """Named causes: name, probability, parameters, sentence."""
        every = (self.verdict or {}).get("causes")
        kept = ("name", "probability", "parameters", "sentence")
        known = [one for one in every if isinstance(one, dict)] if isinstance(every, list) else []
        return [{key: one[key] for key in kept if key in one} for one in known]

    @property
    def explained(self) -> float | None:
        return _number(self.verdict, "explained")

    @property
    def gain(self) -> dict[str, float | None]:
        """Of the error on held-out windows: reduction, its 90 % interval, their number."""
        return {key: _number((self.verdict or {}).get("gain"), key) for key in OF_GAIN}

    @property
    def page(self) -> str:
        """In the folder of the fleet; empty without one."""
        return f"{self.folder}/{PAGE}" if self.verdict is not None and self.drawn else ""

    @property
    def done(self) -> bool:
        """Whether nothing of it is missing."""
        return self.verdict is not None and self.drawn

    def as_json(self) -> dict[str, Any]:
        return {
            "line": self.line, "run": self.run, "store": self.store, "voyages": self.voyages,
            "ship": self.ship, "verdict": self.said, "sentence": self.sentence,
            "causes": self.causes, "explained": self.explained, "gain": self.gain,
            "folder": self.folder, "page": self.page, "kept": self.kept, "error": self.error,
            "warnings": list(self.warnings),
        }  # fmt: skip


def _number(of: Any, key: str) -> float | None:
    found = of.get(key) if isinstance(of, Mapping) else None
    return found if isinstance(found, int | float) and not isinstance(found, bool) else None


@dataclass(frozen=True, repr=False)
class Fleet(Printed):
    """A verdict a ship, in the order of the list.

    source   the list
    folder   of the table, and of each diagnosis
    """

    rows: tuple[Row, ...]
    source: Path
    folder: Path

    def __repr__(self) -> str:
        return f"Fleet({self.sentence} {self.folder})"

    @property
    def failed(self) -> tuple[Row, ...]:
        """Those without a verdict."""
        return tuple(row for row in self.rows if row.verdict is None)

    @property
    def complete(self) -> bool:
        return all(row.done for row in self.rows)

    @property
    def sentence(self) -> str:
        """How many have which verdict."""
        of = Counter(row.said for row in self.rows)
        parts = [
            f"{of[word]} {word}" for word in [*VERDICTS, *sorted({*of} - {*VERDICTS})] if of[word]
        ]
        kept = sum(row.kept for row in self.rows)
        before = (
            f" {counted(kept, 'ship')} from an earlier call, with the same inputs." if kept else ""
        )
        return f"{counted(len(self.rows), 'ship')}: {', '.join(parts)}.{before}"

    @property
    def frame(self) -> pl.DataFrame:
        """One row per ship, as the CSV has them."""
        return pl.DataFrame([_cells(row) for row in self.rows], infer_schema_length=None)

    @property
    def lines(self) -> list[str]:
        """The counts, the table, what failed, and where the files are."""
        head = ("line", "ship", "run", "verdict", "causes", "explained")
        rows = [
            (
                str(row.line), row.ship or "-", row.run, row.said,
                ", ".join(str(cause.get("name", "")) for cause in row.causes) or "-",
                "-" if row.explained is None else percent(row.explained),
            )
            for row in self.rows
        ]  # fmt: skip
        found = [self.sentence, "", table(head, rows, right=("line", "explained"))]
        faults = [f"line {row.line}, {row.run}: {row.error}" for row in self.rows if row.error]
        found += ["", *map(one_line, faults)] if faults else []
        return [*found, "", f"Table: {self.folder / TABLE}.csv, .json, .md; each report is in its "
                f"folder there."]  # fmt: skip

    @property
    def json(self) -> dict[str, Any]:
        return {
            "contract": CONTRACT,
            "list": str(self.source),
            "folder": str(self.folder),
            "sentence": self.sentence,
            "ships": [row.as_json() for row in self.rows],
        }

    def save(self) -> None:
        """The table in the fleet's folder, each file whole."""
        self.folder.mkdir(parents=True, exist_ok=True)
        files.write_json(self.folder / f"{TABLE}.json", self.json)
        files.write_text(self.folder / f"{TABLE}.csv", csv_text(self.rows))
        files.write_text(self.folder / f"{TABLE}.md", inert("\n".join(self.lines)) + "\n")


def csv_text(rows: Sequence[Row]) -> str:
    """A head and a line a ship. Texts are inert: one line, and no formula of a spreadsheet."""
    out = io.StringIO()
    written = csv.writer(out, lineterminator="\n")
    for number, row in enumerate(rows):
        cells = _cells(row)
        if number == 0:
            written.writerow(cells)
        written.writerow([_inert(value) if isinstance(value, str) else value
                          for value in cells.values()])  # fmt: skip
    return out.getvalue()


def _cells(row: Row) -> dict[str, Any]:
    """Column → value of the table; None where it is not known."""
    gain = {f"reduction_{key}" if key in ("low", "high") else key: row.gain[key] for key in OF_GAIN}
    return {
        "line": row.line, "ship": row.ship, "run": row.run, "store": row.store,
        "voyages": row.voyages, "verdict": row.said, "sentence": row.sentence,
        "causes": "; ".join(_causes(row)), "explained": row.explained, **gain,
        "folder": row.folder, "page": row.page, "kept": row.kept, "error": one_line(row.error),
    }  # fmt: skip


def _causes(row: Row) -> Iterator[str]:
    """`current: speed 0.102 m/s (0.0955 to 0.107), direction 192 deg (191 to 193)`."""
    for cause in row.causes:
        numbers = cause.get("parameters")
        known = numbers.items() if isinstance(numbers, dict) else ()
        sizes = ", ".join(_size(name, of) for name, of in known if isinstance(of, dict))
        yield f"{cause.get('name', '')}: {sizes}" if sizes else str(cause.get("name", ""))


def _size(name: str, of: Mapping[str, Any]) -> str:
    value, low, high = (_figure(of.get(key)) for key in ("value", "low", "high"))
    unit = f" {unit}" if (unit := of.get("unit")) not in (None, "", "1") else ""
    span = f" ({low} to {high})" if low != value or high != value else ""
    return f"{name} {value}{unit}{span}"


def _figure(value: Any) -> str:
    return f"{value:.4g}" if isinstance(value, int | float) else str(value)


def _inert(text: str) -> str:
    """A spreadsheet would work out what begins as a formula does: an apostrophe before it makes it
    text."""
    line = one_line(text)
    return f"'{line}" if line.startswith(FORMULA) else line


def died(failure: str) -> str:
    """Why a ship has no verdict, and what to do next: a message of the diagnosis says both."""
    if not failure:
        return f"its verdict could not be read again: {AGAIN}"
    advised = "\n" in failure  # the hint of a ShiplogError stands on a line of its own
    words = " ".join(failure.split())
    return words if advised else f"{words.removesuffix('.')}: {AGAIN}"


def refuse_all_failed(fleet: Fleet) -> None:
    """Raises ShiplogError where no ship has a verdict."""
    if len(fleet.failed) == len(fleet.rows):
        raise ShiplogError(
            f"None of {counted(len(fleet.rows), 'ship')} of {fleet.source} has a verdict.",
            hint=f"see the errors above, which are in {fleet.folder / TABLE}.csv as well.",
        )
