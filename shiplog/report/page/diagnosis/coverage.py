"""Where the model was trained and where it is judged."""

from __future__ import annotations

from shiplog.report.page.blocks import Block, Gallery, Paragraph
from shiplog.report.page.diagnosis.source import Source


def blocks(source: Source) -> list[Block]:
    drawn = source.gallery(("wind", "drift"))
    if not drawn:
        return [Paragraph(["Neither motion nor wind is recorded."])]
    return [Gallery(drawn)]
