"""Tables as Markdown, and the list of a store's voyages. Loads nothing heavy."""

from __future__ import annotations

import math
import unicodedata
from collections.abc import Sequence

from shiplog.nomenclature.channels import WINDOW
from shiplog.voyages.store.catalogue import UNSHOWN, CatalogueEntry


def table(head: Sequence[str], rows: Sequence[Sequence[object]]) -> str:
    """A Markdown table with aligned columns."""
    head = [_cell(title) for title in head]
    text = [[_cell(value) for value in row] for row in rows]
    widths = [
        max(len(h), *(len(r[i]) for r in text), 3) if text else max(len(h), 3)
        for i, h in enumerate(head)
    ]
    numeric = [
        bool(rows) and all(isinstance(r[i], (int, float)) for r in rows) for i in range(len(head))
    ]

    def line(cells: Sequence[str]) -> str:
        padded = [
            c.rjust(w) if n else c.ljust(w) for c, w, n in zip(cells, widths, numeric, strict=True)
        ]
        return f"| {' | '.join(padded)} |"

    rule = [("-" * (w - 1) + ":") if n else "-" * w for w, n in zip(widths, numeric, strict=True)]
    return "\n".join([line(head), line(rule), *map(line, text)])


def _cell(value: object) -> str:
    if isinstance(value, bool) or not isinstance(value, float):
        return one_line(str(value)).replace("|", "\\|")
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


def catalogue(entries: Sequence[CatalogueEntry]) -> str:
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
