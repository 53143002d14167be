"""What the pictures of a diagnosis consist of: tables that `diagnose` fills and `viewer` draws.

SI and radians throughout; the viewer converts when it labels an axis.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import polars as pl

from shiplog.nomenclature.channels import STATE
from shiplog.report.viewer.comparison_data import Current, MadeFast

BEFORE, AFTER = "before", "after"
TRACKS = {
    "model": pl.String, "voyage": pl.String, "window": pl.Int64, "time": pl.Float64,
    **{channel.name: pl.Float64 for channel in STATE},
}  # fmt: skip
ACTING = {
    "cause": pl.String, "voyage": pl.String, "time": pl.Float64, "probability": pl.Float64,
}  # fmt: skip
ERROR_COLUMNS = {
    "voyage": pl.String, "window": pl.Int64, "time": pl.Float64, "seconds": pl.Float64,
    BEFORE: pl.Float64, AFTER: pl.Float64,
}  # fmt: skip


@dataclass(frozen=True)
class Exhibit:
    """The residual of a model, the named causes, and their gain.

    measured   voyage, time [s from the voyage's start], the six states; wind_speed and wind_angle
               where the ship measures them
    residual   voyage, time, channel (surge, sway, yaw_rate), force, sd, named [N, N, N m]: the
               missing force, its standard deviation, and the force of the named causes at the
               same instant; null without a named cause that exerts a force
    named      names of the causes of that force
    extended   names of all causes in the extended model
    tracks     model (BEFORE or AFTER), voyage, window, time, the six states: every held-out window
    errors     voyage, window, time (its start), seconds (its length), before, after: L (Eq. 8) of
               each held-out window; null after where nothing was named, and both null where the
               model diverges and the window is in none of the figures
    report     Markdown
    run        the name of the model's run, by which it has its colour
    acting     cause, voyage, time, probability: that each named cause acts, a row a stretch at its
               begin and one at its end
    banks, ship_outline, datums, current, made_fast   as a comparison has them
    """

    title: str
    ship_length: float  # m
    ship_breadth: float  # m
    measured: pl.DataFrame
    residual: pl.DataFrame
    named: tuple[str, ...]
    extended: tuple[str, ...]
    tracks: pl.DataFrame
    errors: pl.DataFrame
    report: str
    ship_outline: tuple[tuple[float, float], ...] = ()
    banks: tuple[tuple[tuple[float, float], ...], ...] = ()
    run: str = ""
    datums: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    current: Current | None = None
    made_fast: MadeFast | None = None
    acting: pl.DataFrame = field(default_factory=lambda: pl.DataFrame(schema=ACTING))

    @property
    def voyages(self) -> list[str]:
        """The voyages in the order in which they were given."""
        return self.measured["voyage"].unique(maintain_order=True).to_list()

    @property
    def telling(self) -> pl.DataFrame:
        """Of each voyage the row of `errors` whose error fell most, or, where none fell, was
        largest; the most telling voyage first."""
        fell = pl.col("before") - pl.col("after")
        improved = pl.when(fell > 0.0).then(fell)  # null where it did not
        return (
            self.errors.with_columns(fell=improved)
            .sort("fell", "before", descending=True, nulls_last=True, maintain_order=True)
            .group_by("voyage", maintain_order=True)
            .first()
            .select(self.errors.columns)
        )

    @property
    def improved(self) -> set[str]:
        """The voyages of which the most telling window has a smaller error after than before."""
        return set(self.telling.filter(pl.col("after") < pl.col("before"))["voyage"])
