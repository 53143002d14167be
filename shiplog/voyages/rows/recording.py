"""Voyages at 10 Hz for the diagnosis: rows of arrays, unbroken stretches, measured rows.

A rollout of 1 Hz averages knows an instant to half a second; a delay of a rudder or of a clock is
smaller than that. So the diagnosis reads the recorded rows themselves.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
import polars as pl

from shiplog.nomenclature import channels, frames
from shiplog.nomenclature.channels import Quality
from shiplog.nomenclature.frames import Axes
from shiplog.ship_profile.profile import Profile
from shiplog.voyages.rows import instruments
from shiplog.voyages.rows.fault_detection import stretches
from shiplog.voyages.rows.instruments import Sighted
from shiplog.voyages.rows.resampling import RATE_HZ
from shiplog.voyages.rows.timescale import THREE_METRES, Timescale

STEP_S = 1.0 / RATE_HZ
FILLED = 20  # rows: a shorter gap is bridged for the inputs, and not scored


class _Ends(NamedTuple):
    """Where the stretches that begin at `starts` [n] begin and end, for each row [n]."""

    starts: np.ndarray
    firsts: np.ndarray
    lasts: np.ndarray


@dataclass(frozen=True)
class Record:
    """Rows [n] of several voyages one after another, SI.

    names      voyages; `voyage` [n] counts in them
    time       [n]     s into the voyage
    share      [n]     of the campaign's running time, 0 to 1
    starts     [n]     bool: begins an unbroken stretch
    measured   [n]     bool; the other rows are bridged
    state      [n, 6]  channels.STATE at midship, heading unwrapped within a stretch
    actuator   [n, A]
    wind       [n, 2]  apparent wind, where it comes from: ahead and to starboard [m/s]
    timescale          of the ship: how long its segments are
    """

    profile: Profile
    names: tuple[str, ...]
    voyage: np.ndarray
    time: np.ndarray
    share: np.ndarray
    starts: np.ndarray
    measured: np.ndarray
    state: np.ndarray
    actuator: np.ndarray
    wind: np.ndarray
    step: float = STEP_S
    timescale: Timescale = THREE_METRES
    _ends: _Ends | None = field(default=None, repr=False)  # of `starts`, computed at first use

    def __len__(self) -> int:
        return len(self.time)

    @property
    def seconds(self) -> float:
        return float(self.measured.sum()) * self.step

    @property
    def firsts(self) -> np.ndarray:
        """[n] the row at which each row's stretch begins."""
        return self._stretches.firsts

    @property
    def lasts(self) -> np.ndarray:
        """[n] the row at which each row's stretch ends."""
        return self._stretches.lasts

    @property
    def _stretches(self) -> _Ends:
        """Worked out once for all records that differ in their values alone."""
        if self._ends is None or self._ends.starts is not self.starts:
            at = np.flatnonzero(self.starts)
            lengths = np.diff(np.append(at, len(self)))
            ends = _Ends(self.starts, np.repeat(at, lengths), np.repeat(at + lengths - 1, lengths))
            object.__setattr__(self, "_ends", ends)
            return ends
        return self._ends

    def later(self, values: np.ndarray, seconds: float) -> np.ndarray:
        """Values [n, ...] as they stand `seconds` later; at the ends of a stretch they stay."""
        if seconds == 0.0:
            return values
        whole, part = divmod(seconds / self.step, 1.0)
        rows = np.arange(len(self)) + int(whole)
        firsts, lasts = self.firsts, self.lasts
        low, high = (np.clip(at, firsts, lasts) for at in (rows, rows + 1))
        return values[low] * (1.0 - part) + values[high] * part

    def smoothed(self, seconds: float) -> Record:
        """The state averaged twice over so many seconds about each row, over fewer at the ends of a
        stretch."""
        most = round(0.5 * seconds / self.step)
        state = np.empty_like(self.state)
        edges = np.append(np.flatnonzero(self.starts), len(self))
        for first, end in itertools.pairwise(edges):
            # sums of each stretch alone: what was recorded before it does not round it
            values, at = self.state[first:end], np.arange(end - first)
            half = np.minimum(np.minimum(most, at), at[::-1])
            count = (2 * half + 1)[:, None]
            for _ in range(2):
                upto = np.cumsum(np.pad(values, ((1, 0), (0, 0))), axis=0)
                values = (upto[at + half + 1] - upto[at - half]) / count
            state[first:end] = values
        return replace(self, state=state)

    @cached_property
    def axes(self) -> Axes:
        return frames.axes(self.state[:, 4])

    @property
    def true_wind(self) -> np.ndarray:
        """[n, 2] where the wind over ground comes from, along x₀ and y₀ [m/s]."""
        return frames.to_body(self.wind - self.state[:, [1, 3]], self.axes.back)

    @cached_property
    def sighted(self) -> Sighted:
        """What the instruments measured."""
        return instruments.sighted(self.state, self.axes, self.profile.sensors)

    def measured_as(self, readings: Sighted, moved: tuple[float, float] = (0.0, 0.0)) -> Record:
        """The record of these sights. `moved`: the antenna, from where the profile has it [m]."""
        state = instruments.at_midship(readings, self.profile.sensors, moved)
        found = replace(self, state=state)
        found.__dict__["axes"] = readings.axes  # of its heading: not to be worked out again
        return found

    def pick(self, voyages: Sequence[str]) -> Record:
        """The rows of these voyages, shares of the campaign as they were."""
        keep = np.isin(self.voyage, [self.names.index(v) for v in voyages])
        arrays = {
            name: getattr(self, name)[keep]
            for name in (
                "voyage",
                "time",
                "share",
                "starts",
                "measured",
                "state",
                "actuator",
                "wind",
            )
        }
        return replace(self, **arrays)


def read(tables: Sequence[pl.DataFrame], names: Sequence[str], profile: Profile) -> Record:
    """Voyages' 10 Hz tables, in order of their time, as one record."""
    order = np.argsort([t["time"][0].timestamp() for t in tables], kind="stable")
    parts = [_voyage(tables[i], profile) for i in order]
    lengths = [len(p["time"]) for p in parts]
    whole: dict[str, Any] = {n: np.concatenate([p[n] for p in parts]) for n in parts[0]}
    voyage = np.repeat(np.arange(len(parts)), lengths)
    share = (np.arange(sum(lengths)) + 0.5) / max(sum(lengths), 1)
    return Record(
        profile=profile,
        names=tuple(str(names[i]) for i in order),
        voyage=voyage,
        share=share,
        **whole,
    )


def _voyage(table: pl.DataFrame, profile: Profile) -> dict[str, np.ndarray]:
    mark = table["quality"].to_numpy()
    time = table["time"].to_physical().to_numpy()
    names = [*(c.name for c in channels.STATE), *profile.actuator_names, *profile.wind_names]
    values = table.select(pl.col(names).cast(pl.Float64).fill_null(np.nan)).to_numpy().copy()
    measured = ((mark & int(channels.UNUSABLE)) == 0) & np.isfinite(values).all(1)
    starts = (mark & int(Quality.JUMP)) != 0
    keep = measured.copy()
    for a, b in stretches(~measured):
        keep[a : b + 1] = b - a < FILLED and a > 0 and b < len(measured) - 1
    count = len(profile.actuator_names)
    angles = [4, *(6 + i for i, a in enumerate(profile.actuators) if a.kind == "azimuth")]
    if profile.has_wind:
        speed, angle = values[:, 6 + count].copy(), values[:, 7 + count].copy()
        values[:, 6 + count], values[:, 7 + count] = speed * np.cos(angle), speed * np.sin(angle)
    rows = np.flatnonzero(keep)
    begins = np.diff(rows, prepend=-2) != 1
    begins |= starts[rows]
    known = np.flatnonzero(measured)
    for column in angles:
        values[known, column] = np.unwrap(values[known, column])
    filled = np.stack(
        [np.interp(rows, known, values[known, i]) for i in range(values.shape[1])], axis=1
    ) if len(known) else values[rows]  # fmt: skip
    wind = filled[:, 6 + count :] if profile.has_wind else np.zeros((len(rows), 2))
    return {
        "time": (time[rows] - time[0]) * 1e-9 if len(time) else time[rows].astype(float),
        "starts": begins,
        "measured": measured[rows],
        "state": filled[:, :6],
        "actuator": filled[:, 6 : 6 + count],
        "wind": wind,
    }
