"""Tables as Markdown, and the list of a store's voyages. Loads nothing heavy."""

from __future__ import annotations

import math
import unicodedata
from collections.abc import Sequence

from shiplog.nomenclature.channels import WINDOW
from shiplog.voyages.store.catalogue import UNSHOWN, CatalogueEntry


class Table(str):
    """A table as Markdown, which is drawn from its cells where that reads better.

    right   of each column, whether it is flush right
    """

    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    right: tuple[bool, ...]


def table(
    head: Sequence[str], rows: Sequence[Sequence[object]], right: Sequence[str] = ()
) -> Table:
    """Cells as text, in aligned columns. Numbers are flush right, and the columns named `right`."""
    titles = tuple(_cell(title) for title in head)
    cells = tuple(tuple(_cell(value) for value in row) for row in rows)
    flush = tuple(
        title in right or (bool(rows) and all(isinstance(row[i], int | float) for row in rows))
        for i, title in enumerate(head)
    )
    found = Table(_markdown(titles, cells, flush))
    found.head, found.rows, found.right = titles, cells, flush
    return found


def _markdown(head: Sequence[str], rows: Sequence[Sequence[str]], right: Sequence[bool]) -> str:
    columns = []
    for flush, cells in zip(right, zip(head, *rows, strict=True), strict=True):
        title, *others = (cell.replace("|", "\\|") for cell in cells)
        width = max(3, len(title), *map(len, others))
        rule = "-" * (width - 1) + ":" if flush else "-" * width
        align = str.rjust if flush else str.ljust
        columns.append([align(title, width), rule, *(align(cell, width) for cell in others)])
    return "\n".join(f"| {' | '.join(row)} |" for row in zip(*columns, strict=True))


def _cell(value: object) -> str:
    if isinstance(value, bool) or not isinstance(value, float):
        return one_line(str(value))
    if not math.isfinite(value):
        return "diverged" if value > 0 else "-"
    if value != 0 and abs(value) < 0.001:
        return f"{value:.1e}"
    return f"{value:.0f}" if abs(value) >= 100 else f"{value:.3g}"


def one_line(text: str) -> str:
    """With line ends and control characters as escapes: a ship's name may be anything."""
    return "".join(
        c.encode("unicode_escape").decode() if unicodedata.category(c) in UNSHOWN else c
        for c in text
    )


def inert(markdown: str) -> str:
    """The same text, without what a viewer of Markdown would load or run: HTML, pictures and links
    can only come from the names of voyages, ships and topics, which strangers may have chosen."""
    return markdown.replace("<", "&lt;").replace("](", "]\\(")


def catalogue(entries: Sequence[CatalogueEntry]) -> Table:
    """What is in a store."""
    rows = [
        (
            e.name, e.ship, e.start[:19], e.seconds,
            "-" if e.rate_hz is None else e.rate_hz, e.usable_s, e.windows, e.findings,
        )
        for e in entries
    ]  # fmt: skip
    head = (
        "voyage", "ship", "start", "seconds", "slowest, Hz", "usable, s", f"windows of {WINDOW} s",
        "findings",
    )  # fmt: skip
    return table(head, rows)
