"""Drawings of the documentation: segments and nodes, the lattice of hypotheses, the house.

python -m pipelines.experiments.site.pictures --out docs/pictures

SVG, the same bytes every time.
"""

from __future__ import annotations

import argparse
import itertools
from collections.abc import Callable
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import FancyBboxPatch

INK, MEASURED, MODEL, FREE, QUIET = "#222222", "#000000", "#d9730d", "#2563a8", "#8a8f98"
GROUPS = ("#e8eef6", "#e9f3ea", "#fdf1e2", "#f3ebf6")  # of the house, from below


def segments() -> Figure:
    """One 30 s segment of surge: bins, smoothed path, residual; and nodes of the process noise."""
    figure = Figure(figsize=(9.0, 5.0), layout="constrained")
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(3, 2))
    random = np.random.default_rng(7)
    fine = np.linspace(0.0, 90.0, 901)
    true = 0.42 + 0.05 * np.sin(fine / 11.0) + 0.02 * np.sin(fine / 3.7)
    bins = np.arange(1.0, 90.0, 2.0)  # a fifteenth of 30 s each
    measured = np.interp(bins, fine, true) + random.normal(0.0, 0.006, bins.size)
    upper.plot(bins, measured, "o", color=MEASURED, ms=3.5, label="measured, mean of a bin of 2 s")
    nodes = np.arange(0.0, 90.1, 2.0)
    for start in (0.0, 30.0, 60.0):
        own = (fine >= start) & (fine <= start + 30.0)
        path = np.interp(fine[own], fine, np.convolve(true, np.ones(41) / 41, "same"))
        path[:25], path[-25:] = true[own][:25], true[own][-25:]
        words = "smoothed path y* of each segment" if start == 0.0 else None
        upper.plot(fine[own], path, color=MODEL, lw=1.8, label=words)
        upper.plot(start, path[0], "s", color=FREE, ms=7, zorder=5,
                   label="initial state, free" if start == 0.0 else None)  # fmt: skip
        inside = nodes[(nodes >= start) & (nodes <= start + 30.0)]
        noise = 3.0 * np.sin(inside / 11.0 + start) + random.normal(0.0, 1.0, inside.size)
        lower.plot(inside, noise, "-", color=FREE, lw=1.2)
        lower.plot(inside, noise, "D", color=FREE, ms=3.5,
                   label="process noise at the nodes, straight in between"
                   if start == 0.0 else None)  # fmt: skip
    for axes in (upper, lower):
        axes.spines[["top", "right"]].set_visible(False)
        for edge in (0.0, 30.0, 60.0, 90.0):
            axes.axvline(edge, color=QUIET, lw=0.8, ls=":")
    k = 19
    on_path = np.interp(bins[k], fine, true)
    upper.annotate("residual e of a bin:\nmeasured minus simulated", (bins[k], measured[k]),
                   (bins[k] + 3.0, on_path + 0.05), color=INK, ha="left",
                   arrowprops={"arrowstyle": "-", "color": QUIET})  # fmt: skip
    for number, start in enumerate((0.0, 30.0, 60.0), 1):
        upper.text(start + 15.0, 0.315, f"segment {number}", ha="center", color=QUIET)
    upper.set_ylim(0.305, 0.56)
    upper.set_ylabel("surge, m/s")
    upper.legend(loc="upper right", frameon=False, fontsize=8.5)
    lower.set_ylabel("acceleration,\n10⁻³ m/s²")
    lower.set_xlabel("time, s (a ship of 3 m: segments of 30 s)")
    lower.set_ylim(-6.5, 9.5)
    lower.legend(loc="upper right", frameon=False, fontsize=8.5)
    return figure


def lattice() -> Figure:
    """Sets of three causes as a lattice, each with its kinds of remainder; what a search visits."""
    figure = Figure(figsize=(9.0, 6.2), layout="constrained")
    axes = figure.subplots()
    axes.axis("off")
    causes = ("current", "clock", "load")
    at: dict[tuple[str, ...], tuple[float, float]] = {}
    for size in range(4):
        sets = list(itertools.combinations(causes, size))
        for i, one in enumerate(sets):
            at[one] = (3.4 * (i - 0.5 * (len(sets) - 1)), 2.0 * size)
    for one, (x, y) in at.items():
        for other, (x2, y2) in at.items():
            if len(other) == len(one) + 1 and set(one) < set(other):
                axes.plot((x, x2), (y + 0.45, y2 - 0.45), color=QUIET, lw=0.9, zorder=1)
    way = ((), ("current",), ("current", "clock"))
    for one, other in itertools.pairwise(way):
        (x, y), (x2, y2) = at[one], at[other]
        axes.annotate("", (x2, y2 - 0.47), (x, y + 0.47), zorder=2,
                      arrowprops={"arrowstyle": "-|>", "color": MODEL, "lw": 2.4})  # fmt: skip
    for one, (x, y) in at.items():
        chosen = one == way[-1]
        box = FancyBboxPatch(
            (x - 1.3, y - 0.42), 2.6, 0.84, boxstyle="round,pad=0.02,rounding_size=0.12", zorder=3,
            lw=2.0 if chosen else 1.0, ec=MODEL if chosen else INK,
            fc="#fff4e6" if chosen else "white",
        )  # fmt: skip
        axes.add_patch(box)
        words = ", ".join(one) if one else "no cause"
        axes.text(x, y + 0.13, f"{{{words}}}" if one else words, ha="center", va="center",
                  zorder=4, fontsize=10, fontweight="bold" if chosen else "normal")  # fmt: skip
        for i, kind in enumerate("nrimcw"):
            axes.text(x - 1.0 + 0.4 * i, y - 0.22, kind, ha="center", va="center", zorder=4,
                      fontsize=8.5, color=FREE if kind == "n" and chosen else QUIET,
                      fontweight="bold" if kind == "n" and chosen else "normal")  # fmt: skip
    words = (
        "Each set is weighed with every kind of remainder: n nominal, r raised process noise,\n"
        "i intermittent side force, m motion, c controls, w wind (and position, heading, time).\n"
        "A line upwards adds one cause. The arrows end at the answer of season 2."
    )
    axes.text(0.0, -1.1, words, fontsize=9, color=INK, va="center", ha="center")
    axes.set_xlim(-5.2, 5.2)
    axes.set_ylim(-1.4, 6.6)
    return figure


HOUSE = (  # package, what it holds; from below, which is what is imported by all others
    (("nomenclature", "channels, units, frames"), ("machine", "files, caches, limits"),
     ("ship_profile", "the profile")),
    (("logs", "MCAP, other formats"), ("voyages", "10 Hz table, 1 Hz rows"),
     ("drafting", "of profiles")),
    (("models", "mmg, networks, causes"), ("foreign", "FMU, callable, logged"),
     ("simulation", "rollouts, L, coverage"), ("training", "recipes, runs")),
    (("diagnosis", "segments to verdict"), ("manoeuvres", "found, measured, sailed"),
     ("planning", "what to sail next"), ("report", "page, figures, viewer")),
    (("export", "other programs' files"), ("live", "next to the ship"),
     ("commands", "steps of each command"), ("cli", "arguments, printing")),
)  # fmt: skip


def house() -> Figure:
    """Packages from below upwards: each imports from itself and from those before it only."""
    figure = Figure(figsize=(9.0, 5.4), layout="constrained")
    axes = figure.subplots()
    axes.axis("off")
    fills = (*GROUPS, "#f4f4f4")
    number = 0
    for floor, (packages, fill) in enumerate(zip(HOUSE, fills, strict=True)):
        width = 9.0 / len(packages)
        for i, (name, what) in enumerate(packages):
            number += 1
            x, y = i * width, 1.15 * floor
            axes.add_patch(FancyBboxPatch((x + 0.1, y + 0.1), width - 0.2, 0.9, fc=fill, ec=INK,
                           boxstyle="round,pad=0.0,rounding_size=0.08", lw=1.0))  # fmt: skip
            axes.text(x + 0.25, y + 0.68, f"{number}  {name}/", fontsize=11, fontweight="bold",
                      va="center")  # fmt: skip
            axes.text(x + 0.25, y + 0.34, what, fontsize=9, va="center", color=INK)
    axes.annotate("", (9.5, 5.6), (9.5, 0.2),
                  arrowprops={"arrowstyle": "-|>", "color": MODEL, "lw": 2.4})  # fmt: skip
    axes.text(9.65, 2.9, "may import from the left and below", rotation=90, va="center",
              fontsize=10, color=MODEL)  # fmt: skip
    axes.text(0.1, 5.95, "import shiplog  =  commands/api.py", fontsize=10, color=INK)
    axes.set_xlim(0.0, 10.0)
    axes.set_ylim(0.0, 6.2)
    return figure


PICTURES: dict[str, Callable[[], Figure]] = {
    "segments": segments,
    "lattice": lattice,
    "house": house,
}


def write(folder: Path) -> None:
    """All pictures into a folder."""
    settings: dict[Any, Any] = {
        "svg.hashsalt": "shiplog",
        "font.family": "DejaVu Sans",
        "font.size": 10,
    }
    with matplotlib.rc_context(settings):
        for name, picture in PICTURES.items():
            picture().savefig(folder / f"{name}.svg", metadata={"Date": None})


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, default=Path("docs/pictures"))
    write(parser.parse_args().out)


if __name__ == "__main__":
    main()
