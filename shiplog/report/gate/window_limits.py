"""Limits on a simulation against measured voyages: L, errors at the end of a window, RMSE,
coverage. A kind of limit is a line in `KINDS`."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import polars as pl

from shiplog.nomenclature.numbers import counted
from shiplog.report.evaluation.evaluation import Evaluation
from shiplog.report.evaluation.judgement import BASELINES, FEWEST_WINDOWS, Judgement, judge
from shiplog.report.evaluation.tables import summary
from shiplog.report.gate.outcome import Measured
from shiplog.simulation import error_reduction


@dataclass(frozen=True)
class Scored:
    """One run on N windows: of all chosen voyages, or of one.

    seconds    length of a window
    errors     one row a seed and window, as in `Evaluation`
    covered    [N] share of each window's seconds inside the training data
    voyages    [N] the voyage of each window
    judgement  against both baselines
    """

    seconds: int
    errors: pl.DataFrame
    covered: np.ndarray
    voyages: Sequence[str]
    judgement: Judgement

    @classmethod
    def of(cls, found: Evaluation, voyage: str | None = None) -> Scored | None:
        """Of an evaluation of one run; None where there is no window."""
        run = found.runs[0]
        errors, coverage, baselines = found.errors, found.coverage, found.baseline_losses
        if voyage is not None:
            here = (
                errors.filter(pl.col("seed") == errors["seed"][0])["voyage"] == voyage
            ).to_numpy()
            errors = errors.filter(pl.col("voyage") == voyage)
            coverage = coverage.filter(pl.col("voyage") == voyage)
            baselines = {name: values[here] for name, values in baselines.items()}
        if errors.is_empty():
            return None
        length, seconds = run.profile.ship.length_m, run.config.window
        judged = judge(run.name, errors, baselines, length, seconds)
        shares, names = coverage["coverage"].to_numpy(), coverage["voyage"].to_list()
        return cls(seconds, errors, shares, names, judged)

    def per_window(self, column: str, power: float = 1.0) -> np.ndarray:
        """[N] the mean over seeds of a column of `scoring.ERRORS`, to this power."""
        each = self.errors.group_by("voyage", "window", maintain_order=True)
        return each.agg(pl.col(column).pow(power).mean())[column].to_numpy()


@dataclass(frozen=True)
class Kind:
    """A kind of limit on one figure.

    key        of limits.toml
    words      what it is called; `{window}` is the length of a window
    measure    the figure
    at_least   a lower limit; else an upper one
    most       the largest limit that can be meant
    """

    key: str
    words: str
    unit: str
    measure: Callable[[Scored], Measured]
    at_least: bool = False
    most: float = math.inf


def _with_interval(value: float, each: np.ndarray, voyages: Sequence[str]) -> Measured:
    """A mean over windows [N] with its 90 % interval: the bootstrap of `error_reduction.shares`,
    in which the other term of the ratio is 1."""
    if not math.isfinite(value):
        diverged = int((~np.isfinite(each)).sum())
        return Measured(math.inf, reason=f"{counted(diverged, 'window')} diverged")
    if len(each) < FEWEST_WINDOWS:
        return Measured(value)
    low, high = error_reduction.shares(np.ones(len(each)), each, voyages)
    return Measured(value, min(low, value), max(high, value))


def _mean(column: str) -> Callable[[Scored], Measured]:
    """The mean over windows and seeds."""

    def measure(of: Scored) -> Measured:
        value = summary(of.errors)[column]
        return _with_interval(value, of.per_window(column), of.voyages)

    return measure


def _rmse(channel: str, scale: float = 1.0) -> Callable[[Scored], Measured]:
    """√(mean of e²) over the windows of a seed, then the mean over seeds: as `evaluate` has it.
    The interval is that of the mean of e² in relation to it, so that of its root is the root."""

    def measure(of: Scored) -> Measured:
        value = scale * summary(of.errors)["rmse"][channel]
        squares = of.per_window(f"rmse_{channel}", 2.0)
        mean = float(squares.mean())
        found = _with_interval(mean, squares, of.voyages)
        if not math.isfinite(mean):
            return found
        if found.low is None or found.high is None or mean <= 0.0:
            return Measured(value)
        return Measured(
            value, value * math.sqrt(found.low / mean), value * math.sqrt(found.high / mean)
        )

    return measure


def _loss_of(baseline: str) -> Callable[[Scored], Measured]:
    """L as a share of a baseline's. A window that diverged is in neither mean: the limit is then
    broken, whatever the others say."""

    def measure(of: Scored) -> Measured:
        if of.judgement.lost:
            count = counted(of.judgement.lost, "window")
            return Measured(math.inf, reason=f"{count} diverged")
        one = next((a for a in of.judgement.against if a.baseline == baseline), None)
        if one is None:
            return Measured(reason=f"{BASELINES[baseline]} has no finite L here")
        return Measured(one.share, one.low, one.high)

    return measure


def _covered(of: Scored) -> Measured:
    found = _with_interval(float(of.covered.mean()), of.covered, of.voyages)
    if found.low is None or found.high is None:
        return found
    return Measured(found.value, max(found.low, 0.0), min(found.high, 1.0))


KINDS = (
    Kind("loss", "L", "", _mean("loss")),
    Kind("loss_of_hold", "L / L of holding the velocity", "", _loss_of("hold")),
    Kind("loss_of_least_squares", "L / L of least squares", "", _loss_of("least_squares")),
    Kind("end_position_m", "end position after {window} s", "m", _mean("end_position_m")),
    Kind("end_heading_deg", "end heading after {window} s", "deg", _mean("end_heading_deg")),
    Kind("rmse_surge_mps", "RMSE of surge", "m/s", _rmse("surge")),
    Kind("rmse_sway_mps", "RMSE of sway", "m/s", _rmse("sway")),
    Kind("rmse_yaw_rate_degps", "RMSE of yaw rate", "deg/s", _rmse("yaw_rate", math.degrees(1.0))),
    Kind("covered", "share covered by training data", "", _covered, at_least=True, most=1.0),
)  # fmt: skip


def inside_band(found: Evaluation, channel: str) -> Measured:
    """Share of the samples of a channel of the state inside the run's 90 % band."""
    run = found.runs[0]
    shares = dict(found.inside.select("channel", "share").iter_rows())
    if channel in shares:
        return Measured(shares[channel])
    return Measured(reason=f"{run.name} has no 90 % band: nothing was held out to learn it from")
