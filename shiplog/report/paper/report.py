"""The page on an experiment of several window sets, in Markdown."""

from __future__ import annotations

from dataclasses import dataclass

import polars as pl

from shiplog.exceptions import listed
from shiplog.nomenclature.numbers import counted
from shiplog.report.evaluation import tables
from shiplog.report.evaluation.evaluation import Evaluation
from shiplog.report.paper import statements
from shiplog.report.paper.style import named
from shiplog.training.runs.run_folder import RunFolder

SHOWN_VOYAGES = 4  # of a set


@dataclass(frozen=True)
class Results:
    """What the trainings came to.

    runs        of each set that is finished
    failures    training → why it did not end
    losses      set, seed, loss: L over the test windows
    histories   set, seed, epoch, training, validation, smoothed
    compared    see `statements.differences`
    """

    runs: dict[str, RunFolder]
    failures: dict[str, str]
    losses: pl.DataFrame
    histories: pl.DataFrame
    compared: pl.DataFrame
    evaluation: Evaluation


def summary(results: Results) -> pl.DataFrame:
    """set, seeds, and mean, least and greatest test L, best validation L (median)."""
    best = results.histories.group_by("set", "seed").agg(pl.col("validation").min())
    best = best.group_by("set").agg(validation=pl.col("validation").median())
    loss = pl.col("loss")
    return (
        results.losses.group_by("set", maintain_order=True)
        .agg(seeds=pl.len(), mean=loss.mean(), least=loss.min(), most=loss.max())
        .join(best, on="set", how="left", maintain_order="left")
    )


def lines(results: Results, chosen_by: str, sizes: pl.DataFrame) -> list[str]:
    """Markdown: sets, losses, what the paper states and what these data say."""
    run = next(iter(results.runs.values()))
    baselines = results.evaluation.means
    count = results.evaluation.errors.filter(
        pl.col("run") == run.name, pl.col("seed") == run.config.seeds[0]
    ).height
    figures_of = ("validation", "mean", "least", "most")
    losses = [
        (named(row["set"]), row["seeds"], *(f"{row[name]:.0f}" for name in figures_of))
        for row in summary(results).iter_rows(named=True)
    ]
    found = [
        f"# {run.profile.ship.name}: {counted(len(results.runs), 'window set')}",
        "",
        f"Recipe `{run.config.recipe}`, windows of {run.config.window} s; test on "
        f"{listed(results.evaluation.voyages)}, {counted(count, 'window')}. Split by {chosen_by}.",
        "",
        tables.table(tuple(sizes.columns), _sizes(sizes)),
        "",
        "L of the test windows; a baseline that holds the velocity has "
        f"{baselines['hold']:.0f}, quadratic least squares on the data of "
        f"{named(run.name)} {baselines['least_squares']:.0f}.",
        "",
        tables.table(("set", "seeds", "best validation L, median", "mean test L", "least", "most"),
                     losses),
        "",
        "## What the paper states, on these data",
        "",
        "Ratios are geometric means over pairs of one seed, with intervals that hold together at "
        "95 % (eight comparisons).",
        "",
        *[f"- {row['statement']} {statements.sentence(row)}"
          for row in results.compared.iter_rows(named=True)],
    ]  # fmt: skip
    if results.failures:
        found += ["", "## What could not be trained", ""]
        found += [f"- {name}: {why}" for name, why in results.failures.items()]
    return found


def _sizes(sizes: pl.DataFrame) -> list[tuple]:
    """Rows of the report's table of sets: of many voyages a few."""
    short = pl.col("voyages").str.split(", ").map_elements(
        lambda names: listed(names, SHOWN_VOYAGES), return_dtype=pl.String
    )  # fmt: skip
    return sizes.with_columns(voyages=short).rows()
