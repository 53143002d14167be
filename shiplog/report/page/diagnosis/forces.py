"""The missing force along the voyages that tell most, and that of the named causes."""

from __future__ import annotations

import polars as pl

from shiplog.report.figures.picture_data import AFTER
from shiplog.report.page.blocks import Block, Fold, Gallery, Paragraph
from shiplog.report.page.diagnosis.source import Source

PICTURES = ("surge_force", "sway_force", "yaw_moment")
MOST_VOYAGES = 3  # with pictures on the page; `--figures` writes those of all


def blocks(source: Source) -> list[Block]:
    names = telling(source)
    galleries = [(n, drawn) for n in names[:MOST_VOYAGES] if (drawn := source.gallery(PICTURES, n))]
    if not galleries:
        return [Paragraph(["No missing force was computed."])]
    first, *others = galleries
    found: list[Block] = [Gallery(first[1])]
    found += [Fold(f"The same of {name}", [Gallery(drawn)]) for name, drawn in others]
    if len(names) > MOST_VOYAGES:
        found.append(Paragraph([
            f"Of {len(names)} voyages the {MOST_VOYAGES} whose error fell most are drawn. "
            "`shiplog report … --figures DIR` draws them all.",
        ]))  # fmt: skip
    return found


def telling(source: Source) -> list[str]:
    """The voyages, those first whose error fell most."""
    data = source.content.data
    sign = pl.when(pl.col("model") == AFTER).then(-1.0).otherwise(1.0)
    fell = (sign * pl.col("loss")).sum()
    rank = dict(data.errors.group_by("voyage").agg(fell).iter_rows())
    return sorted(data.names, key=lambda name: -(rank.get(name) or 0.0))
