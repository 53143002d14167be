"""What a picture is, and what it is drawn from."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import polars as pl

from shiplog.report.figures import style
from shiplog.report.figures.picture_data import PictureData

if TYPE_CHECKING:
    from matplotlib.axes import Axes


@dataclass(frozen=True)
class Content:
    """A diagnosis on disk: its verdict as JSON has it, and the tables of its pictures."""

    verdict: Mapping[str, Any]
    data: PictureData


@dataclass(frozen=True)
class Picture:
    """A picture on one pair of axes.

    title    what it shows, as a heading
    table    of a content the rows that are drawn; empty where there is nothing to draw
    draw     those rows onto the axes
    words    what a reader who cannot see it is to know: kinds of lines, the numbers that matter
    voyage   whether it is of one voyage: there is one for each
    height   inches, and `by_row` more for each row of the table; of a column `rows_of`, for each
             of its values
    """

    title: str
    table: Callable[[Content], pl.DataFrame]
    draw: Callable[[Axes, pl.DataFrame, Content], None]
    words: Callable[[pl.DataFrame, Content], str]
    voyage: bool = False
    height: float = style.HEIGHT
    by_row: float = 0.0
    rows_of: str = ""
    polar: bool = False

    def tall(self, table: pl.DataFrame) -> float:
        """Inches, for these rows."""
        rows = table[self.rows_of].n_unique() if self.rows_of else len(table)
        return self.height + self.by_row * rows
