"""The force that the model misses along a voyage, and that of the named causes."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import numpy as np
import polars as pl

from shiplog.nomenclature.numbers import NINETY_SPREADS
from shiplog.report import colours
from shiplog.report.figures import style
from shiplog.report.figures.content import Content, Picture

if TYPE_CHECKING:
    from matplotlib.axes import Axes

GAP_S = 5.0  # s between nodes, from which a line is broken
AXES = {  # channel → what pushes, its unit, what positive is
    "surge": ("surge force", "N", "ahead"),
    "sway": ("sway force", "N", "to starboard"),
    "yaw_rate": ("yaw moment", "N m", "bow to starboard"),
}


def table(content: Content, channel: str) -> pl.DataFrame:
    """voyage, time [s], force, sd, named [N or N m]."""
    rows = content.data.residual.filter(pl.col("channel") == channel)
    return rows.drop("channel").sort("voyage", "time", maintain_order=True)


def draw(axes: Axes, rows: pl.DataFrame, content: Content, channel: str) -> None:
    what, unit, positive = AXES[channel]
    time, force, sd, named = (
        rows[k].cast(pl.Float64).fill_null(np.nan).to_numpy()
        for k in ("time", "force", "sd", "named")
    )
    typical = float(np.nanquantile(np.abs(force), 0.95)) if np.isfinite(force).any() else 1.0
    factor, prefix = (1000.0, "k") if typical >= 1000.0 else (1.0, "")
    gaps = np.flatnonzero(np.diff(time) > np.maximum(GAP_S, 3.0 * np.median(np.diff(time))))
    at = [np.insert(v, gaps + 1, np.nan) for v in (force, sd, named)]
    time = np.insert(time, gaps + 1, time[gaps])
    time, force, sd, named = style.thinned(time, *(v / factor for v in at))
    half = NINETY_SPREADS * sd
    axes.axhline(0.0, color=colours.web(colours.ZERO), linewidth=0.8)
    axes.fill_between(
        time, force - half, force + half, color=colours.web(colours.MEASURED), alpha=0.15,
        linewidth=0, label="its 90 % band",
    )  # fmt: skip
    axes.plot(time, force, color=colours.web(colours.MEASURED), linewidth=1.0,
              label="missing force")  # fmt: skip
    if np.isfinite(named).any():
        axes.plot(time, named, color=colours.web(colours.NAMED_FORCE), linewidth=1.4,
                  label=f"force of {_spoken(content.data.named)}")  # fmt: skip
    middle = np.concatenate([force[np.isfinite(force)], named[np.isfinite(named)]])
    if len(middle):
        low, high = np.quantile(middle, (0.005, 0.995))
        span = high - low  # an extreme is shown, unless it is so far out that it flattens the rest
        low, high = max(middle.min(), low - span), min(middle.max(), high + span)
        room = 0.25 * max(high - low, 1e-9)
        axes.set_ylim(min(low, 0.0) - room, max(high, 0.0) + room)
    axes.set_xlabel("time since the start of the voyage [s]")
    axes.set_ylabel(f"{what} [{prefix}{unit}]\n+ {positive}")
    axes.legend(loc="lower center", bbox_to_anchor=(0.45, 1.0), ncols=3, columnspacing=1.0,
                handlelength=1.4)  # fmt: skip


def _spoken(names: tuple[str, ...]) -> str:
    """Causes in words; what one of them is of stands in brackets: "clock offset (gnss)"."""
    spoken = [name.replace("_", " ").partition(":") for name in names]
    return " and ".join(f"{cause} ({of})" if of else cause for cause, _, of in spoken)


def words(rows: pl.DataFrame, content: Content, channel: str) -> str:
    what, unit, _ = AXES[channel]
    if rows.is_empty():
        return f"No missing {what} could be computed."
    rms = float(np.sqrt(np.nanmean(rows["force"].to_numpy() ** 2)))
    found = f"Missing {what} along {rows['voyage'][0]}: root mean square {rms:.2g} {unit}."
    if rows["named"].null_count() == len(rows):
        return found
    left = rows["force"] - rows["named"]
    rest = float(np.sqrt(np.nanmean(left.drop_nulls().to_numpy() ** 2)))
    return f"{found} Without the force of {_spoken(content.data.named)}: {rest:.2g} {unit}."


def _picture(channel: str) -> Picture:
    what = AXES[channel][0]
    return Picture(
        f"Missing {what}", partial(table, channel=channel), partial(draw, channel=channel),
        partial(words, channel=channel), voyage=True, height=2.4,
    )  # fmt: skip


OF_SURGE, OF_SWAY, OF_YAW = (_picture(channel) for channel in AXES)
