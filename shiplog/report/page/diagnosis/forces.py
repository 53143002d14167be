"""The missing force along the voyage that tells most, and that of the named causes."""

from __future__ import annotations

import polars as pl

from shiplog.report.figures.picture_data import AFTER
from shiplog.report.page.blocks import Block, Gallery, Paragraph
from shiplog.report.page.diagnosis.source import Source

PICTURES = ("surge_force", "sway_force", "yaw_moment")


def blocks(source: Source) -> list[Block]:
    names = telling(source)
    drawn = source.gallery(PICTURES, names[0]) if names else []
    if not drawn:
        return [Paragraph(["No missing force was computed."])]
    found: list[Block] = [Gallery(drawn)]
    if len(names) > 1:
        found.append(Paragraph([
            f"Of {len(names)} voyages, the one whose error fell most is drawn. "
            "`shiplog report FOLDER --figures DIR` draws them all.",
        ]))  # fmt: skip
    return found


def telling(source: Source) -> list[str]:
    """The voyages, those first whose error fell most."""
    data = source.content.data
    sign = pl.when(pl.col("model") == AFTER).then(-1.0).otherwise(1.0)
    fell = (sign * pl.col("loss")).sum()
    rank = dict(data.errors.group_by("voyage").agg(fell).iter_rows())
    return sorted(data.names, key=lambda name: -(rank.get(name) or 0.0))
