"""Rows of bars: the ranking, the smallest detectable sizes, the error by channel."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import polars as pl

from shiplog.diagnosis.thresholds import STATED
from shiplog.report import colours
from shiplog.report.figures import style
from shiplog.report.figures.chart import legend
from shiplog.report.figures.content import Content, Picture
from shiplog.report.figures.picture_data import AFTER, BEFORE

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MOST_RANKED = 8
FEWEST_ROWS = 2  # for which there is room: a bar alone is no thicker than one of two
HOPELESS = 30.0  # realistic sizes, beyond which a cause counts as undetectable


def spoken(name: str, of: str | None = None) -> str:
    """`unknown:motion` as "outside the catalogue (motion)", `clock_offset` of gnss as "clock offset
    (gnss)"."""
    kind, _, family = name.partition(":")
    if kind == "none":
        return "no change"
    if kind == "unknown":
        return f"outside the catalogue ({family})" if family else "outside the catalogue"
    words = kind.replace("_", " ")
    unit = (of or family).replace("_", " ")
    return f"{words} ({unit})" if unit else words


# --- ranking --------------------------------------------------------------------------------------


def ranking_table(content: Content) -> pl.DataFrame:
    """name, probability, likeliest first."""
    rows = [(spoken(r["name"]), float(r["probability"])) for r in content.verdict["ranking"]]
    schema = {"name": pl.String, "probability": pl.Float64}
    return pl.DataFrame(rows[:MOST_RANKED], schema, orient="row")


def draw_ranking(axes: Axes, rows: pl.DataFrame, content: Content) -> None:
    values = rows["probability"].to_numpy()
    ink = [colours.web(colours.MEASURED if v >= STATED else colours.TRAINING) for v in values]
    bars = axes.barh(np.arange(len(rows)), values, color=ink, height=0.6)
    axes.bar_label(bars, [f"{v:.2f}" for v in values], padding=3, fontsize=7.5)
    axes.axvline(STATED, color=colours.web(colours.TEXT), linestyle=":", linewidth=1.0)
    axes.annotate(f"named from {STATED:g}", (STATED, 1.0), (-3, 2), ha="right", va="bottom",
                  xycoords=("data", "axes fraction"), textcoords="offset points",
                  fontsize=7.0)  # fmt: skip
    _names(axes, rows["name"].to_list())
    axes.set_xlim(0.0, 1.15)
    axes.set_xticks([0.0, 0.25, 0.5, 0.75, 1.0])
    axes.set_xlabel("probability, calibrated")


def ranking_words(rows: pl.DataFrame, content: Content) -> str:
    if rows.is_empty():
        return "No answer was weighed."
    text = ", ".join(f"{name} {p:.2f}" for name, p in rows.iter_rows())
    return f"Probability of each answer: {text}."


# --- smallest detectable sizes --------------------------------------------------------------------


def limits_table(content: Content) -> pl.DataFrame:
    """name, share: the smallest size that these data would show over the realistic size; size: in
    words."""
    rows = [
        (spoken(one["name"], one.get("channel") or one.get("actuator")), float(one["share"]),
         size_in_words(one["parameters"]))
        for one in content.verdict["limits"]
    ]  # fmt: skip
    schema = {"name": pl.String, "share": pl.Float64, "size": pl.String}
    return pl.DataFrame(rows, schema, orient="row")


def size_in_words(parameters: dict) -> str:
    """{"speed": {"value": 0.012, "unit": "m/s"}} as "0.012 m/s"; of several, each with its name."""
    from shiplog.nomenclature.numbers import figure

    found = []
    for name, size in parameters.items():
        value, unit = size["value"], size["unit"]
        text = f"{figure(100 * value)} %" if unit == "1" else f"{figure(value)} {unit}"
        found.append(text if len(parameters) == 1 else f"{name.replace('_', ' ')} {text}")
    return ", ".join(found)


def draw_limits(axes: Axes, rows: pl.DataFrame, content: Content) -> None:
    share = np.minimum(rows["share"].to_numpy(), HOPELESS)
    ink = [colours.web(colours.TRAINING if v <= 1.0 else colours.ORANGE) for v in share]
    axes.barh(np.arange(len(rows)), share, color=ink, height=0.65)
    axes.axvline(1.0, color=colours.web(colours.TEXT), linewidth=1.0)
    axes.annotate("realistic size", (1.0, 1.0), (0, 2), ha="center", va="bottom",
                  xycoords=("data", "axes fraction"), textcoords="offset points",
                  fontsize=7.0)  # fmt: skip
    _names(axes, rows["name"].to_list(), size=6.5)
    axes.set_xscale("log")
    low = min(float(share.min()), 0.1) if len(share) else 0.1
    axes.set_xlim(0.7 * low, max(3.0, 1.2 * float(share.max())) if len(share) else 3.0)
    style.plain_log(axes.xaxis)
    axes.set_xlabel("smallest size that would show ÷ realistic size", loc="right")


def limits_words(rows: pl.DataFrame, content: Content) -> str:
    if rows.is_empty():
        return "No cause was tested."
    small = int((rows["share"] <= 1.0).sum())
    first = (
        f"{rows['name'][0]} shows best, from {100 * rows['share'][0]:.0f} % of its realistic size"
    )
    return f"{small} of {len(rows)} causes would show at their realistic size; {first}."


# --- error by channel -----------------------------------------------------------------------------


def channels_table(content: Content) -> pl.DataFrame:
    """channel, before, after: share of the error before any cause, L of it is 1 in all."""
    gain = (content.verdict.get("gain") or {}).get("channels", {})
    rows = [
        (one["channel"], float(one["share_of_error"]),
         float(one["share_of_error"]) * (1.0 - gain[one["channel"]])
         if one["channel"] in gain else None)
        for one in content.verdict["wrong"]
    ]  # fmt: skip
    schema = {"channel": pl.String, BEFORE: pl.Float64, AFTER: pl.Float64}
    return pl.DataFrame(rows, schema, orient="row")


def draw_channels(axes: Axes, rows: pl.DataFrame, content: Content) -> None:
    names = {key: (label, colour) for key, label, colour in legend(content.data)}
    place = np.arange(len(rows))
    both = rows[AFTER].null_count() < len(rows) and AFTER in names
    for key, shift in ((BEFORE, -0.2 if both else 0.0), (AFTER, 0.2)):
        if key not in names or (key == AFTER and not both):
            continue
        label, colour = names[key]
        values = rows[key].fill_null(0.0).to_numpy()
        bars = axes.barh(place + shift, values, color=colour, height=0.36, label=label)
        axes.bar_label(bars, [f"{100 * v:.0f} %" for v in values], padding=3, fontsize=7.0)
    _names(axes, [str(c).replace("_", " ") for c in rows["channel"].to_list()])
    axes.set_xlim(0.0, 1.25 * max(*rows[BEFORE].to_list(), 0.1))
    axes.xaxis.set_major_formatter(lambda v, _: f"{100 * v:.0f} %")
    axes.set_xlabel("share of the error L before")
    axes.legend(loc="lower right")


def channels_words(rows: pl.DataFrame, content: Content) -> str:
    if rows.is_empty():
        return "No window was simulated."
    text = ", ".join(
        f"{c.replace('_', ' ')} {100 * b:.0f} %"
        + ("" if a is None else f" before and {100 * a:.0f} % after")
        for c, b, a in rows.iter_rows()
    )
    return f"Share of the error by channel: {text}."


def _names(axes: Axes, names: list[str], size: float = 7.5) -> None:
    axes.set_yticks(np.arange(len(names)), names, fontsize=size)
    axes.set_ylim(max(len(names), FEWEST_ROWS) - 0.4, -0.6)
    axes.tick_params(axis="y", length=0)


RANKING = Picture("Ranking", ranking_table, draw_ranking, ranking_words, height=1.0, by_row=0.24)
LIMITS = Picture(
    "Smallest sizes that would show",
    limits_table,
    draw_limits,
    limits_words,
    height=0.7,
    by_row=0.14,
)
CHANNELS = Picture("Error by channel", channels_table, draw_channels, channels_words, height=2.3)
