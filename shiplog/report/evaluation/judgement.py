"""A model's errors in a few words: against its baselines, and in ship lengths."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import polars as pl

from shiplog.nomenclature.numbers import counted, figure
from shiplog.simulation import error_reduction

FEWEST_WINDOWS = 6  # windows, fewer of which give no interval: three blocks of two are drawn from
BASELINES = {"hold": "holding the velocity", "least_squares": "quadratic least squares"}
MEANING = (
    "L is the time integral of the weighted squared errors of surge, sway and yaw rate over a "
    "window (Wakita et al., Eq. 8): 0 is perfect, and errors half as large give a quarter of it."
)


@dataclass(frozen=True)
class Against:
    """A model's mean L as a share of a baseline's, on the windows where neither diverged.

    low, high   its 90 % interval; None where there are too few windows for one
    """

    baseline: str
    share: float
    low: float | None
    high: float | None

    @property
    def word(self) -> str:
        if self.low is None or self.high is None or self.low <= 1.0 <= self.high:
            return "not significantly better or worse"
        return "better" if self.high < 1.0 else "worse"

    @property
    def sentence(self) -> str:
        name = BASELINES[self.baseline]
        if self.low is None or self.high is None:
            return f"{figure(self.share)} of the L of {name}"
        between = f"({figure(self.low)} to {figure(self.high)})"
        return f"{self.word} than {name}, with {figure(self.share)} of its L {between}"

    def as_json(self) -> dict:
        return {"share": self.share, "low": self.low, "high": self.high, "word": self.word}


@dataclass(frozen=True)
class Judgement:
    """One model on N windows of `seconds` s.

    lost      windows that diverged
    lengths   median distance at the end of a window, in lengths of the ship
    degrees   median error of the heading there
    """

    run: str
    windows: int
    seconds: int
    lost: int
    lengths: float
    degrees: float
    against: tuple[Against, ...]

    @property
    def sentence(self) -> str:
        found = f"{self.run}, on {counted(self.windows, 'window')} of {self.seconds} s"
        if self.lost == self.windows:
            return f"{found}: {'it' if self.windows == 1 else 'every one of them'} diverged."
        parts = [one.sentence for one in self.against]
        found = f"{found}: {'; '.join(parts)}." if parts else f"{found}."
        if self.windows - self.lost < FEWEST_WINDOWS:
            found += " Too few windows for an interval."
        if self.lost:
            found += f" Windows that diverged, in none of these figures: {self.lost}."
        return (
            f"{found} After {self.seconds} s it is {figure(self.lengths)} ship lengths and "
            f"{figure(self.degrees)} deg off (medians)."
        )

    def as_json(self) -> dict:
        return {
            "diverged": self.lost, "median_end_position_lengths": self.lengths,
            "median_end_heading_deg": self.degrees,
            "against": {one.baseline: one.as_json() for one in self.against},
        }  # fmt: skip


def judge(
    run: str, errors: pl.DataFrame, baselines: Mapping[str, np.ndarray], length: float,
    seconds: int,
) -> Judgement:  # fmt: skip
    """Of errors with one row a window and seed.

    errors      seed, voyage, window and `scoring.ERRORS`, windows in the baselines' order
    baselines   name → L of every window [N]
    length      of the ship [m]
    """
    names = ("loss", "end_position_m", "end_heading_deg")
    each = errors.group_by("voyage", "window", maintain_order=True).agg(pl.col(names).mean())
    loss = each["loss"].to_numpy()
    kept = np.isfinite(loss)
    found = [
        _against(name, values, loss, each["voyage"].to_list()) for name, values in baselines.items()
    ]
    at_end = each.filter(pl.Series(kept))
    return Judgement(
        run, len(loss), seconds, int((~kept).sum()),
        _median(at_end["end_position_m"]) / length, _median(at_end["end_heading_deg"]),
        tuple(one for one in found if one is not None),
    )  # fmt: skip


def _against(
    name: str, baseline: np.ndarray, loss: np.ndarray, voyages: Sequence[str]
) -> Against | None:
    kept = np.isfinite(loss) & np.isfinite(baseline)
    if not kept.any() or baseline[kept].sum() <= 0.0:
        return None
    low = high = None
    if kept.sum() >= FEWEST_WINDOWS:
        of = [voyage for voyage, keep in zip(voyages, kept, strict=True) if keep]
        low, high = error_reduction.shares(baseline[kept], loss[kept], of)
    return Against(name, float(loss[kept].sum() / baseline[kept].sum()), low, high)


def _median(values: pl.Series) -> float:
    return float(np.median(values.drop_nulls().to_numpy())) if len(values) else float("nan")


def force_line(forces: pl.DataFrame, voyage: str) -> str:
    """Root mean square of every part of the force along one voyage, largest first.

    forces   of `force_breakdown.break_down`
    """
    own = forces.filter(pl.col("voyage") == voyage, pl.col("part") != "total")
    size = (pl.col("surge").pow(2) + pl.col("sway").pow(2)).mean().sqrt()
    parts = own.group_by("part").agg(size=size).sort("size", descending=True)
    sizes = [f"{part} {figure(value)} N" for part, value in parts.iter_rows()]
    return f"Forces along {voyage}, root mean square: {', '.join(sizes)}."
