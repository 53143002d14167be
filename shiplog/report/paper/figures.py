"""The paper's figures from tables; every one says what it shows in its axes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import polars as pl

from shiplog.nomenclature import channels
from shiplog.report.figures.style import plain_log
from shiplog.report.paper.style import COLOURS, MEASURED, figure, named
from shiplog.voyages.windows.wind_histogram import ANGLE_BIN

if TYPE_CHECKING:
    from matplotlib.axes import Axes

COLUMNS = 3  # of histograms side by side
SETS = 4  # side by side
EPOCH_TICKS = 4  # at most, so that those of one set do not run into the next
LEAST_ERROR = 0.1  # of d, where its axis begins: a window begins with none
LABELS = {c.name: c.label for c in channels.VELOCITY} | {"d": "error d"}


def histograms(table: pl.DataFrame, units: dict[str, str], path: Path) -> None:
    """Fig. 3: how often each velocity and actuator was where, in each set.

    table   as sets.histograms gives it
    units   of the channels
    """
    names = table["channel"].unique(maintain_order=True).to_list()
    rows = math.ceil(len(names) / COLUMNS)
    with figure(0.4 + 1.5 * rows, path) as drawn:
        axes = drawn.subplots(rows, COLUMNS, squeeze=False).ravel()
        for axis, channel in zip(axes, names, strict=False):
            for (name,), own in table.filter(pl.col("channel") == channel).group_by(
                "set", maintain_order=True
            ):
                edges = [*own["low"].to_list(), own["high"][-1]]
                axis.stairs(own["seconds"].to_numpy(), edges, color=COLOURS[str(name)],
                            label=named(str(name)), linewidth=1.0)  # fmt: skip
            axis.set_yscale("log")
            plain_log(axis.yaxis)
            axis.set_ylim(bottom=0.7)
            axis.set_xlabel(LABELS.get(channel, f"{channel} [{units.get(channel, '1')}]"))
        for axis in axes[len(names) :]:
            axis.set_axis_off()
        for axis in axes[: len(names) : COLUMNS]:
            axis.set_ylabel("seconds")
        drawn.legend(*axes[0].get_legend_handles_labels(), loc="outside upper center", ncols=4)


def wind(table: pl.DataFrame, path: Path) -> None:
    """Fig. 4: the apparent wind of each set, table as sets.wind gives it."""
    from matplotlib.colors import LogNorm

    sets = table["set"].unique(maintain_order=True).to_list()
    width = float(table["speed_bin"][0])
    speeds = np.arange(0.0, table["speed"].to_numpy().max() + 1.5 * width, width)
    angles = np.arange(0.0, 360.0 + ANGLE_BIN, ANGLE_BIN)
    most = max(2, int(table["seconds"].to_numpy().max()))
    with figure(2.6, path) as drawn:
        axes = drawn.subplots(1, len(sets), sharey=True, squeeze=False)[0]
        for axis, name in zip(axes, sets, strict=True):
            counts = np.zeros((len(speeds) - 1, len(angles) - 1))
            for row in table.filter(pl.col("set") == name).iter_rows(named=True):
                counts[round(row["speed"] / width), int(row["angle"] // ANGLE_BIN)] = row["seconds"]
            mesh = axis.pcolormesh(
                angles, speeds, np.ma.masked_equal(counts, 0.0), norm=LogNorm(1, most),
                cmap="viridis", rasterized=True,
            )  # fmt: skip
            axis.set_title(named(name))
            axis.set_xticks([0, 90, 180, 270, 360])
        axes[0].set_ylabel("apparent wind speed [m/s]")
        drawn.supxlabel("apparent wind angle [deg from the bow]", fontsize=8)
        plain_log(drawn.colorbar(mesh, ax=axes, label="seconds").ax.yaxis)


def validation(histories: pl.DataFrame, path: Path) -> None:
    """Fig. 5: smoothed validation losses (Eq. 23) against epochs, every training.

    histories   set, seed, epoch, smoothed
    """
    from matplotlib.ticker import EngFormatter, MaxNLocator

    sets = histories["set"].unique(maintain_order=True).to_list()
    columns = min(SETS, len(sets))
    rows = math.ceil(len(sets) / columns)
    with figure(0.5 + 1.6 * rows, path) as drawn:
        axes = drawn.subplots(rows, columns, sharex=True, sharey=True, squeeze=False).ravel()
        for axis, name in zip(axes, sets, strict=False):
            own = histories.filter(pl.col("set") == name)
            for _, one in own.group_by("seed", maintain_order=True):
                axis.plot(one["epoch"], one["smoothed"], color=COLOURS[name], linewidth=0.6)
            axis.set_yscale("log")
            plain_log(axis.yaxis)
            axis.set_title(named(name), color=COLOURS[name])
        axes[0].xaxis.set_major_locator(MaxNLocator(EPOCH_TICKS))
        axes[0].xaxis.set_major_formatter(EngFormatter(sep=""))
        for axis in axes[len(sets) :]:
            axis.set_axis_off()
        drawn.supxlabel("epoch", fontsize=8)
        drawn.supylabel("validation L, moving average", fontsize=8)


def test(losses: pl.DataFrame, baselines: dict[str, float], path: Path) -> None:
    """Fig. 6: L of the test windows, every seed's point and the mean.

    losses      set, seed, loss
    baselines   name → L

    A seed that diverged has no point, and is counted below its set; the mean is of the others.
    """
    sets = losses["set"].unique(maintain_order=True).to_list()
    ticks = []
    with figure(2.8, path) as drawn:
        axis = drawn.subplots()
        for at, name in enumerate(sets):
            own = losses.filter(pl.col("set") == name)["loss"].to_numpy()
            spread = np.linspace(-0.18, 0.18, len(own)) if len(own) > 1 else np.zeros(1)
            axis.scatter(at + spread, own, s=9.0, color=COLOURS[name], alpha=0.75, linewidths=0)
            finite = own[np.isfinite(own)]
            lost = len(own) - len(finite)
            ticks.append(f"{named(name)}\n{lost} diverged" if lost else named(name))
            if len(finite):
                axis.hlines(finite.mean(), at - 0.3, at + 0.3, color=COLOURS[name], linewidth=1.6)
        for name, value in baselines.items():
            axis.axhline(value, color=MEASURED, linewidth=0.7, linestyle="--")
            axis.annotate(name, (1.0, value), xycoords=("axes fraction", "data"), ha="right",
                          va="bottom", fontsize=6.5, color="#555555")  # fmt: skip
        axis.set_yscale("log")
        plain_log(axis.yaxis)
        axis.set_xticks(range(len(sets)), ticks)
        axis.set_ylabel("test L (points: seeds, bar: mean)")


def inputs(rows: pl.DataFrame, units: dict[str, str], path: Path) -> None:
    """Fig. 7: actuators and apparent wind of a test voyage.

    rows    elapsed [s], the channels of `units`, angles in rad
    """
    recorded = [name for name in units if name in rows.columns]
    with figure(0.4 + 1.0 * len(recorded), path) as drawn:
        axes = drawn.subplots(len(recorded), 1, sharex=True, squeeze=False)[:, 0]
        for axis, name in zip(axes, recorded, strict=True):
            values = rows[name].to_numpy()
            if units[name] == "deg":
                values = values / channels.DEGREE
                if name == "wind_angle":
                    values = _broken(values % 360.0)
            axis.plot(rows["elapsed"], values, color=COLOURS["test"], linewidth=0.8)
            axis.set_ylabel(f"{name}\n[{units[name]}]", fontsize=6.5)
        axes[-1].set_xlabel("time into the voyage [s]")


def states(rollouts: pl.DataFrame, measured: pl.DataFrame, pair: Sequence[str], path: Path) -> None:
    """Figs. 8 to 11: velocities and the error d of two sets along a test voyage.

    rollouts   set, seed, window, time [s], surge, sway, yaw_rate [rad/s], d
    measured   elapsed [s] and the velocities

    A line is the median of the seeds, a band their range. Each window begins at what was measured.
    """
    rows = [c.name for c in channels.VELOCITY] + ["d"]
    with figure(5.6, path) as drawn:
        axes = drawn.subplots(len(rows), 1, sharex=True)
        for axis, name in zip(axes, rows, strict=True):
            factor = channels.YAW_RATE.to_display if name == channels.YAW_RATE.name else 1.0
            if name != "d":
                axis.plot(measured["elapsed"], measured[name] * factor, color=MEASURED,
                          linewidth=1.6, label="measured")  # fmt: skip
            for of in pair:
                _band(axis, rollouts.filter(pl.col("set") == of), name, factor, of)
            axis.set_ylabel(LABELS[name])
        axes[-1].set_yscale("log")
        plain_log(axes[-1].yaxis)
        axes[-1].set_ylim(bottom=LEAST_ERROR)
        starts = rollouts.group_by("window").agg(pl.col("time").min())["time"].to_list()
        for axis in axes:
            for start in starts:
                axis.axvline(start, color="#DDDDDD", linewidth=0.5, zorder=0)
        drawn.legend(*axes[0].get_legend_handles_labels(), loc="outside upper center", ncols=3)
        axes[-1].set_xlabel("time into the voyage [s]; lines where a window begins")


def _band(axis: Axes, own: pl.DataFrame, name: str, factor: float, of: str) -> None:
    """Median and range of the seeds, broken where a window ends."""
    value = pl.col(name) * factor
    spread = (
        own.group_by("window", "time")
        .agg(low=value.min(), middle=value.median(), high=value.max())
        .sort("window", "time")
    )
    label: str | None = named(of)
    for _, window in spread.group_by("window", maintain_order=True):
        axis.fill_between(window["time"], window["low"], window["high"], color=COLOURS[of],
                          alpha=0.18, linewidth=0)  # fmt: skip
        axis.plot(window["time"], window["middle"], color=COLOURS[of], linewidth=0.9, label=label)
        label = None


def _broken(angle: np.ndarray) -> np.ndarray:
    """An angle in degrees, not drawn across 0/360."""
    out = angle.astype(float).copy()
    out[1:][np.abs(np.diff(angle)) > 180.0] = np.nan
    return out
