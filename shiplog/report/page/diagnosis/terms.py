"""Terms of the method, for who wants them."""

from __future__ import annotations

from shiplog.report.diagnosis.terms import TERMS
from shiplog.report.page.blocks import Block, Fold, Grid, Line
from shiplog.report.page.diagnosis.source import Source


def blocks(source: Source) -> list[Block]:
    rows: list[tuple[Line, Line]] = [([term], [text]) for term, text in TERMS]
    return [Fold("Terms of the method", [Grid(("term", "what it is"), rows)])]
