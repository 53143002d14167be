"""Pictures of a season: a cause's parameters, and the speed loss, by voyage or date."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from datetime import datetime
from typing import TYPE_CHECKING, Any

from shiplog.diagnosis.season.trends import Trend
from shiplog.report import colours
from shiplog.report.figures import style
from shiplog.report.figures.bars import spoken
from shiplog.report.page.blocks import Drawn
from shiplog.report.season.season import Season

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MOST_NAMES = 8  # voyages whose names stand at the axis, where there are no dates
LONGEST = 14  # letters of a voyage's name


def pictures(season: Season) -> Iterator[tuple[Trend | None, str, Drawn]]:
    """Cause and parameter with its picture; None is the speed loss."""
    for number, trend in enumerate(season.trends):
        for place, name in enumerate(_parameters(trend)):
            with style.drawing() as figure:
                draw_size(figure.add_subplot(), trend, name)
                svg = style.svg(figure, f"size-{number}-{place}")
            title = f"{spoken(trend.label).capitalize()}, {name.replace('_', ' ')}"
            yield trend, name, Drawn(svg, SIZE_WORDS, title)
    if any(one.value is not None for one in season.losses.values()):
        with style.drawing() as figure:
            draw_loss(figure.add_subplot(), season)
            svg = style.svg(figure, "speed-loss")
        title = "Speed loss at equal revolutions"
        yield None, "", Drawn(svg, LOSS_WORDS, title)


SIZE_WORDS = (
    "Black: 90 % interval by partial pooling; grey: without pooling. A dotted "
    "line is an event, an orange one the limit."
)
LOSS_WORDS = "Mean of the blocks that pass the filters, with its 90 % interval."


def _parameters(trend: Trend) -> list[str]:
    return list(trend.voyages[0].pooled) if trend.voyages else []


def draw_size(axes: Axes, trend: Trend, name: str) -> None:
    """A parameter of a cause in each voyage."""
    dates = [one.date for one in trend.voyages]
    at = _places(dates)
    pooled = [one.pooled[name] for one in trend.voyages]
    alone = [one.alone[name] for one in trend.voyages]
    _bars(axes, at, alone, colours.TRAINING, "without pooling", 3.0, alpha=0.55)
    _bars(axes, at, pooled, colours.MEASURED, "pooled", 1.4, marker="o")
    for event in trend.events:
        if None not in dates:
            axes.axvline(_number(event.date), color=colours.web(colours.TEXT), linestyle=":")
    limit = trend.limit
    if limit is not None and limit.parameter == name:
        axes.axhline(limit.limit, color=colours.web(colours.ORANGE), linewidth=1.0, label="limit")
    unit = pooled[0].unit
    axes.set_ylabel(f"{name.replace('_', ' ')}{'' if unit == '1' else f' [{unit}]'}")
    _axis(axes, dates, [one.voyage for one in trend.voyages])
    axes.legend(loc="best")


def draw_loss(axes: Axes, season: Season) -> None:
    """V_d of each voyage."""
    dates = [season.dates.get(name) for name in season.voyages]
    at = _places(dates)
    axes.axhline(0.0, color=colours.web(colours.TEXT), linewidth=0.6)
    for x, name in zip(at, season.voyages, strict=True):
        one = season.losses[name]
        if one.value is None:
            continue
        axes.plot(x, one.value, "o", color=colours.web(colours.MEASURED), markersize=4.0)
        if one.low is not None and one.high is not None:
            axes.plot([x, x], [one.low, one.high], color=colours.web(colours.MEASURED))
    axes.set_ylabel("speed loss [%]")
    _axis(axes, dates, season.voyages)


def _bars(
    axes: Axes, at: Sequence[float], sizes: Sequence[Any], colour: colours.Colour, label: str,
    width: float, marker: str = "", alpha: float = 1.0,
) -> None:  # fmt: skip
    ink = colours.web(colour)
    for i, (x, one) in enumerate(zip(at, sizes, strict=True)):
        axes.plot(
            [x, x], [one.low, one.high], color=ink, linewidth=width, alpha=alpha,
            label=label if i == 0 else None, solid_capstyle="butt",
        )  # fmt: skip
    if marker:
        axes.plot(at, [one.value for one in sizes], marker, color=ink, markersize=4.0)


def _number(date: datetime) -> float:
    from matplotlib.dates import date2num

    return float(date2num(date))


def _places(dates: Sequence[datetime | None]) -> list[float]:
    known = [one for one in dates if one is not None]
    if len(known) < len(dates):
        return [float(i) for i in range(len(dates))]
    return [_number(one) for one in known]


def _axis(axes: Axes, dates: Sequence[datetime | None], names: Sequence[str]) -> None:
    if None not in dates:
        from matplotlib.dates import AutoDateLocator, ConciseDateFormatter

        locator = AutoDateLocator(minticks=3)
        axes.xaxis.set_major_locator(locator)
        axes.xaxis.set_major_formatter(ConciseDateFormatter(locator))
        return
    step = max(-(-len(names) // MOST_NAMES), 1)
    shown = range(0, len(names), step)
    axes.set_xticks(shown, [style.short(names[i], most=LONGEST) for i in shown], rotation=30,
                    ha="right", fontsize=7.0)  # fmt: skip


class Plots:
    """`result.plot("fouling", "factor")` draws a parameter of a cause, the first ones unless given;
    `result.plot.loss()` the speed loss."""

    def __init__(self, season: Season) -> None:
        self._season = season

    def __call__(self, label: str = "", parameter: str = "") -> Figure:
        with style.drawing() as figure:
            axes = figure.add_subplot()
            chosen = [one for one in self._season.trends if not label or one.label == label]
            if chosen:
                draw_size(axes, chosen[0], parameter or _parameters(chosen[0])[0])
            else:
                draw_loss(axes, self._season)
            return figure

    def loss(self) -> Figure:
        with style.drawing() as figure:
            draw_loss(figure.add_subplot(), self._season)
            return figure
