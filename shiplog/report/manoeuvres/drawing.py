"""Pictures of manoeuvres: the path in lengths of the ship, and heading with rudder over time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from shiplog.manoeuvres.entry import Drawn, Entry
from shiplog.report import colours
from shiplog.report.figures import style
from shiplog.report.manoeuvres.sheet import head
from shiplog.report.page.blocks import Drawn as Picture

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLOURS = {
    "measured": colours.MEASURED, "simulated": colours.MODELS[0], "extended": colours.EXTENDED,
}  # fmt: skip
ON_A_PATH = ("turn", "stop")  # kinds whose path is the picture; of the others it is the heading


def picture(entry: Entry, name: str) -> Picture | None:
    """Of one manoeuvre; None where nothing moved."""
    if not entry.drawn:
        return None
    on_path = entry.kind in ON_A_PATH
    with style.drawing(height=style.WIDTH if on_path else style.HEIGHT) as figure:
        draw(figure.add_subplot(), entry)
        svg = style.svg(figure, name)
    words = (
        "The path from the order, in lengths of the ship; the approach is straight up."
        if on_path
        else "Heading against that of the approach, and the rudder."
    )
    return Picture(svg, words, head(entry))


def draw(axes: Axes, entry: Entry) -> None:
    """Of a turn or stop the path, of others the heading with the rudder of the first one drawn."""
    if entry.kind in ON_A_PATH:
        for one in entry.drawn:
            _path(axes, one)
        axes.set_aspect("equal", adjustable="datalim")
        axes.set_xlabel("to starboard [L]")
        axes.set_ylabel("ahead [L]")
    else:
        for one in entry.drawn:
            _heading(axes, one)
        quiet, first = colours.web(colours.TRIAL), entry.drawn[0]
        axes.plot(first.time, first.rudder, color=quiet, linewidth=0.8, linestyle=":",
                  label="rudder")  # fmt: skip
        axes.axhline(0.0, color=quiet, linewidth=0.4)
        axes.set_xlabel("time from the order [s]")
        axes.set_ylabel("heading, rudder [deg]")
    axes.legend(loc="best")


def _path(axes: Axes, one: Drawn) -> None:
    keep = one.time >= -1e-9
    axes.plot(one.path[keep, 1], one.path[keep, 0], color=colours.web(COLOURS[one.label]),
              label=one.label)  # fmt: skip


def _heading(axes: Axes, one: Drawn) -> None:
    axes.plot(one.time, one.heading, color=colours.web(COLOURS[one.label]), label=one.label)


class Plots:
    """`result.plot(n)` draws the n-th manoeuvre of the sheet, the first unless given."""

    def __init__(self, entries: Sequence[Entry]) -> None:
        self._entries = [entry for entry in entries if entry.drawn]

    def __call__(self, number: int = 0) -> Figure:
        with style.drawing(height=style.WIDTH) as figure:
            axes = figure.add_subplot()
            draw(axes, self._entries[number])
            return figure
