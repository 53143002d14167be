"""What disturbs a ship and what its sensors add, as a run's training voyages show both.

The residual of one second, e_t = ν_{t+1} - ν̂(x_t, u_t), is the process noise of that second and
the noise of the velocity sensor twice. Of its autocovariances γ_k, with Bartlett's taper over m:

    σ_v² = max(0, -γ₁)                                 sensor: it enters e_t and -e_{t+1}
    q² Δt = max(γ₀ - 2σ_v², γ₀ + 2 Σ_k (1 - k/m) γ_k)  process, as white noise of the level that
                                                       the residuals have at low frequency

A missing force lasts, and white noise of γ₀ alone would average it out in a minute.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import polars as pl

from shiplog.nomenclature.channels import STATE, VELOCITY_IN_STATE
from shiplog.simulation.residual_tests import MOST_ROWS
from shiplog.simulation.rollout import simulate
from shiplog.simulation.window_series import true_wind
from shiplog.training.runs.load_model import Run
from shiplog.voyages.windows import windows

MEMORY = 30  # s over which residuals are summed, as rollout errors are one observation for so long
PLACE, HEADING = 1.0, np.radians(0.5)  # m, rad: a satellite receiver, a compass; of no stated sigma
PLACE_SHARE = 0.02  # of L: a receiver's noise is not more than that on a ship that it is meant for


@dataclass(frozen=True)
class Noise:
    """process   [3] variance of a second's random change of u, v, r, (m/s)² and (rad/s)² per s
    sensors   [6] variance of one row of channels.STATE
    """

    process: np.ndarray
    sensors: np.ndarray


def of_run(run: Run) -> Noise:
    """By the residuals of its training rows; place and heading by the profile."""
    rows, profile = run.training(), run.profile
    pairs = windows.plan(rows.lazy(), 2, 1).head(MOST_ROWS).collect()
    cut = windows.cut(rows, pairs, 2, profile.actuator_names, profile.wind_names)
    simulated = simulate(run.models()[run.config.seeds[0]], cut)
    errors = (cut.state - simulated)[:, 1, list(VELOCITY_IN_STATE)]
    stretch = pairs.select(pl.struct("voyage", "segment").rank("dense"))["voyage"].to_numpy()
    apart = np.flatnonzero(np.diff(stretch)) + 1
    step = float(np.median(cut.dt))
    process, velocity = np.empty(3), np.empty(3)
    for j in range(3):
        process[j], velocity[j] = _variances(np.split(errors[:, j], apart))
    place = profile.sensors.noise("position") or min(PLACE, PLACE_SHARE * profile.ship.length_m)
    heading = profile.sensors.noise("heading") or HEADING
    sensors = np.array([place**2, velocity[0], place**2, velocity[1], heading**2, velocity[2]])
    return Noise(process / step, sensors)


def usual_wind(run: Run) -> tuple[float, float]:
    """The training voyages' wind, where it comes from along x₀ and y₀, m/s: of their mean direction
    and mean speed, since winds from all sides cancel in a mean vector. A manoeuvre is planned in
    it, unless another wind is expected."""
    if not run.profile.has_wind:
        return 0.0, 0.0
    rows = run.training()
    state = rows.select(c.name for c in STATE).to_numpy()
    blowing = true_wind(state, rows.select(run.profile.wind_names).to_numpy())
    north, east = blowing.mean(0)
    size = float(np.hypot(*blowing.T).mean()) / max(float(np.hypot(north, east)), 1e-9)
    return size * float(north), size * float(east)


def _variances(parts: Sequence[np.ndarray]) -> tuple[float, float]:
    """q² Δt and σ_v² of the residuals of one channel."""
    count = max(sum(map(len, parts)), 1)
    gamma = np.array(
        [sum(float(p[k:] @ p[: len(p) - k]) for p in parts if len(p) > k) for k in range(MEMORY)]
    ) / count  # fmt: skip
    sensor = max(-gamma[1], 0.0)
    taper = 1.0 - np.arange(1, MEMORY) / MEMORY
    low = gamma[0] + 2.0 * float(taper @ gamma[1:])
    return max(gamma[0] - 2.0 * sensor, low, 1e-18), max(sensor, 1e-12)
