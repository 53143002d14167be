"""How far the model is from the ship just now: short rollouts that begin anew.

A rollout begins at a measured second and sees measured actuators and wind after it, as in
`evaluate`. It ends with the window of the run, or at a gap, and the next one begins there. The
error at a time is

    d = |p_sim - p|  [m],   ψ_sim - ψ  [deg],

and lies in its band where both parts of p and ψ lie in the run's calibrated 90 % band
(`prediction_interval`), of as many seconds since the beginning. The radius that is shown for the
band of d is √(h_x² + h_y²), of its half-widths along x₀ and y₀.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import polars as pl

from shiplog.nomenclature.channels import STATE, UNUSABLE
from shiplog.nomenclature.frames import wrap
from shiplog.nomenclature.units import SECOND_NS
from shiplog.simulation import rollout
from shiplog.simulation.prediction_interval import Band
from shiplog.training.runs.load_model import Run
from shiplog.voyages.rows import one_hertz
from shiplog.voyages.windows.windows import Windows

NAMES = [channel.name for channel in STATE]


@dataclass(frozen=True)
class Point:
    """The error at one time. Bands are None of a run that has none.

    since        s, since the rollout began
    measured, simulated   [6] STATE, SI
    provisional  the row that it is of may still change
    """

    time: int  # ns
    since: float
    measured: np.ndarray
    simulated: np.ndarray
    position_m: float
    heading_deg: float
    band_m: float | None
    band_deg: float | None
    inside: bool | None
    provisional: bool


class ErrorNow:
    """Rollouts of one run along rows as they come."""

    def __init__(self, run: Run) -> None:
        self.run, self.profile = run, run.profile
        self.models: Mapping[int, Any] = run.models()
        self.band: Band | None = run.band()
        self.longest = run.config.window - 1 if self.band is None else len(self.band.growth) - 1
        self._rows: pl.DataFrame | None = None  # 10 Hz, since the rollout began
        self._shown = 0  # ns, the latest point that was given of a whole second

    def look(self, final: pl.DataFrame, provisional: pl.DataFrame) -> list[Point]:
        """A point for each whole second that is new, and one for the latest row."""
        self._rows = final if self._rows is None else pl.concat((self._rows, final))
        found: list[Point] = []
        while True:
            both = pl.concat((self._rows, provisional))
            points, restart = self._rollout(both, final)
            found += points
            if restart is None:
                return found
            self._rows = self._rows.filter(pl.col("time").to_physical() >= restart)

    def _rollout(self, rows: pl.DataFrame, final: pl.DataFrame) -> tuple[list[Point], int | None]:
        """Points of the first stretch of these rows, and when the next rollout begins [ns]."""
        if rows.height < 2:
            return [], None
        named = rows.lazy().with_columns(voyage=pl.lit(""))
        seconds = one_hertz.segments(
            one_hertz.averages(named, self.profile.columns, self.profile.circular)
        )
        if not seconds.height:
            return [], None
        first = seconds.filter(pl.col("segment") == seconds["segment"][0])
        times = first["time"].to_physical().to_numpy()
        after = seconds["time"].to_physical().to_numpy()[first.height :]
        restart = int(after[0]) if len(after) else None
        if first.height > self.longest + 1:
            restart, first = int(times[self.longest]), first[: self.longest + 1]
            times = times[: self.longest + 1]
        latest = None
        if restart is None:
            latest = self._latest(rows, int(times[-1]))
        elif first.height < 2:
            return [], restart
        windows = self._windows(first, latest)
        if windows.state.shape[1] < 2:
            return [], restart
        return self._points(windows, times, latest, final), restart

    def _latest(self, rows: pl.DataFrame, after: int) -> pl.DataFrame | None:
        """The latest usable row, where it is later than the last whole second and near it."""
        last = rows[-1:]
        time = int(last["time"].to_physical()[0])
        usable = (int(last["quality"][0]) & int(UNUSABLE)) == 0
        near = 0 < time - after < 2 * SECOND_NS
        whole = not any(last[name][0] is None for name in self.profile.columns)
        return last if usable and near and whole else None

    def _windows(self, seconds: pl.DataFrame, latest: pl.DataFrame | None) -> Windows:
        columns = ["time", *self.profile.columns]
        rows = seconds.select(columns)
        if latest is not None:
            rows = pl.concat((rows, latest.select(columns)), how="vertical_relaxed")
        times = rows["time"].to_physical().to_numpy()
        state = rows.select(NAMES).to_numpy()[None].astype(float)
        state[..., 4] = np.unwrap(state[..., 4], axis=1)
        profile = self.profile
        drive = [
            rows.select(list(names)).to_numpy()[None].astype(float)
            if names else np.zeros((1, rows.height, 0))
            for names in (profile.actuator_names, profile.wind_names)
        ]  # fmt: skip
        plan = pl.DataFrame({"voyage": [""], "elapsed": [0.0]})
        return Windows(plan, state, *drive, dt=np.diff(times)[None] * 1e-9)

    def _points(
        self, windows: Windows, times: np.ndarray, latest: pl.DataFrame | None, final: pl.DataFrame
    ) -> list[Point]:
        simulated = [rollout.simulate(one, windows) for one in self.models.values()]
        half = self._half_widths(windows, simulated)
        settled = int(final["time"].to_physical()[-1]) if final.height else 0
        since = windows.since[0]
        at = list(enumerate(times.tolist()))[1:]
        at = [(i, time) for i, time in at if time > self._shown]
        if latest is not None:
            at.append((len(times), int(latest["time"].to_physical()[0])))
        found = []
        for i, time in at:
            provisional = time > settled
            if i < len(times) and not provisional:
                self._shown = max(self._shown, time)
            found.append(self._point(
                time, float(since[i]), windows.state[0, i], simulated[0][0, i],
                None if half is None else half[min(i, len(half) - 1)], provisional,
            ))  # fmt: skip
        return found

    def _half_widths(self, windows: Windows, simulated: list[np.ndarray]) -> np.ndarray | None:
        """[I, 6] of the band, as many seconds after the beginning."""
        if self.band is None:
            return None
        spread = self.run.spread(self.models, simulated, windows)[0]
        whole = np.minimum(np.rint(windows.since[0]).astype(int), len(self.band.growth) - 1)
        return self.band.factor * np.sqrt(spread**2 + self.band.growth[whole] ** 2)

    def _point(
        self, time: int, since: float, measured: np.ndarray, simulated: np.ndarray,
        half: np.ndarray | None, provisional: bool,
    ) -> Point:  # fmt: skip
        error = simulated - measured
        turned = float(np.degrees(_wrapped(error[4])))
        position = float(np.hypot(error[0], error[2]))
        if half is None:
            return Point(time, since, measured, simulated, position, turned, None, None, None,
                         provisional)  # fmt: skip
        inside = bool((np.abs(error[[0, 2]]) <= half[[0, 2]]).all() and
                      abs(np.radians(turned)) <= half[4])  # fmt: skip
        return Point(
            time, since, measured, simulated, position, turned,
            float(np.hypot(half[0], half[2])), float(np.degrees(half[4])), inside, provisional,
        )  # fmt: skip


def _wrapped(angle: float) -> float:
    """In (-π, π]."""
    return float(wrap(np.array([angle]))[0])
