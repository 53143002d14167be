"""Every picture of a diagnosis by its name: a line each."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import polars as pl

from shiplog.machine import files
from shiplog.report.figures import (
    bars,
    chart,
    conditions,
    errors,
    forces,
    onset,
    style,
    tables,
    timeline,
    windows,
)
from shiplog.report.figures.content import Content, Picture

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

PICTURES: Mapping[str, Picture] = {
    "closeup": chart.CLOSEUP,
    "position_error": errors.OF_POSITION,
    "heading_error": errors.OF_HEADING,
    "channels": bars.CHANNELS,
    "windows": windows.OF_WINDOWS,
    "ranking": bars.RANKING,
    "limits": bars.LIMITS,
    "onset": onset.OF_ONSET,
    "stretches": timeline.OF_STRETCHES,
    "wind": conditions.WIND,
    "drift": conditions.DRIFT,
    "track": chart.VOYAGE,
    "surge_force": forces.OF_SURGE,
    "sway_force": forces.OF_SWAY,
    "yaw_moment": forces.OF_YAW,
}
ACROSS = 2  # pictures next to each other, where all are in one figure


def of_voyage(content: Content, voyage: str) -> Content:
    """The same with the rows of one voyage."""
    return replace(content, data=content.data.of(voyage))


def figure(name: str, content: Content, ax: Axes | None = None) -> Figure:
    """One picture as a matplotlib figure, or on axes that are given: polar ones for `wind`."""
    picture = PICTURES[name]
    table = picture.table(content)
    if ax is not None:
        _draw(picture, ax, table, content)
        found = ax.get_figure(root=True)
        assert found is not None
        return found
    with style.drawing(height=picture.tall(table)) as made:
        axes = made.add_subplot(projection="polar" if picture.polar else None)
        _draw(picture, axes, table, content)
    return made


def every(content: Content) -> Figure:
    """All pictures of the whole campaign in one figure; those with nothing to draw are left out."""
    whole = [(p, t) for p in PICTURES.values() if not p.voyage and len(t := p.table(content))]
    rows = -(-len(whole) // ACROSS)
    height = max([p.tall(t) for p, t in whole], default=style.HEIGHT)
    with style.drawing(ACROSS * style.WIDTH, max(rows, 1) * height) as made:
        for i, (picture, table) in enumerate(whole):
            axes = made.add_subplot(
                rows, ACROSS, i + 1, projection="polar" if picture.polar else None
            )
            axes.set_title(picture.title)
            _draw(picture, axes, table, content)
    return made


def _draw(picture: Picture, axes: Axes, table: pl.DataFrame, content: Content) -> None:
    if table.is_empty():
        style.empty(axes, picture.words(table, content))
        return
    picture.draw(axes, table, content)


def named(content: Content) -> Iterator[tuple[str, Picture, Content]]:
    """Each picture that has something to draw, with a name of its own and what it is drawn from."""
    for name, picture in PICTURES.items():
        if not picture.voyage:
            yield name, picture, content
            continue
        for i, voyage in enumerate(content.data.names, 1):
            yield f"{name}-{i}", picture, of_voyage(content, voyage)


def save(content: Content, folder: Path) -> list[Path]:
    """Each picture as SVG, PDF and PNG, and its rows as Parquet; tables as CSV and LaTeX."""
    folder.mkdir(parents=True, exist_ok=True)
    made = []
    for name, picture, own in named(content):
        table = picture.table(own)
        if table.is_empty():
            continue
        kind = name.partition("-")[0]
        made += style.write(figure(kind, own), folder / name)
        files.write_frame(folder / f"{name}.parquet", table)
        made.append(folder / f"{name}.parquet")
    return made + tables.save(content, folder)
