"""How wrong a simulation is: the paper's error d and evaluation function L, and what a navigator
asks: how far off it ends, and by how many degrees.

d and L are of an error: simulated less measured states [N, I, 6], in the order of channels.STATE.
Gradients need bodies of their own, in `training.network_gradient` and in `sensitivities`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import polars as pl

from shiplog.models.base import Dynamics
from shiplog.nomenclature import channels
from shiplog.simulation.rollout import Simulates, simulate
from shiplog.voyages.windows.windows import Windows

ERRORS = ("loss", "rmse_surge", "rmse_sway", "rmse_yaw_rate", "end_position_m", "end_heading_deg")


def weighted_squares(error: np.ndarray) -> np.ndarray:
    """What surge, sway and yaw rate (in deg/s) add to d of Eq. 5: [..., 3]."""
    with np.errstate(over="ignore", invalid="ignore"):
        velocity = error[..., list(channels.VELOCITY_IN_STATE)]
        return (velocity * np.array(channels.VELOCITY_WEIGHTS)) ** 2


def prediction_error(error: np.ndarray) -> np.ndarray:
    """d of Eq. 5 [N, I]; infinite where the rollout has diverged."""
    with np.errstate(over="ignore"):
        d = weighted_squares(error).sum(-1)
    return np.where(np.isfinite(d), d, np.inf)


def trapezoid(dt: np.ndarray) -> np.ndarray:
    """Weights of the samples [N, I] in s, in the time integral of Eq. 8, from dt [N, I - 1]."""
    half = 0.5 * dt
    return np.pad(half, ((0, 0), (1, 0))) + np.pad(half, ((0, 0), (0, 1)))


def loss_shares(error: np.ndarray, dt: np.ndarray) -> np.ndarray:
    """What each sample and velocity adds to L of its window [N, I, 3]."""
    with np.errstate(over="ignore"):
        return trapezoid(dt)[..., None] * weighted_squares(error)


def window_loss(error: np.ndarray, dt: np.ndarray) -> np.ndarray:
    """L of each window [N], the inner sum of Eq. 8; infinite where the rollout has diverged."""
    with np.errstate(over="ignore"):
        return (trapezoid(dt) * prediction_error(error)).sum(1)


def loss_of_deviations(deviation: Sequence[float], seconds: float) -> float:
    """E L = T Σ_c (w_c σ_c)²: L of a window of T `seconds` of a perfect model, where surge, sway
    and yaw rate are known to σ [3] (m/s, m/s, rad/s)."""
    square = (np.asarray(deviation) * np.array(channels.VELOCITY_WEIGHTS)) ** 2
    return seconds * float(square.sum())


@dataclass(frozen=True)
class Scores:
    """One model on N windows: simulated states [N, I, 6], d [N, I], and ERRORS per window."""

    simulated: np.ndarray
    d: np.ndarray
    errors: pl.DataFrame


def score(dynamics: Dynamics | Simulates, windows: Windows) -> Scores:
    """Roll a model out over the windows and compare. A rollout that diverges scores infinity."""
    simulated = simulate(dynamics, windows)
    with np.errstate(over="ignore", invalid="ignore"):
        error = simulated - windows.state
        turned = np.remainder(error[:, -1, 4] + math.pi, 2.0 * math.pi) - math.pi
        root = {
            f"rmse_{c.name}": np.sqrt((error[..., i] ** 2).mean(1))
            for c, i in zip(channels.VELOCITY, channels.VELOCITY_IN_STATE, strict=True)
        }
        far = np.linalg.norm(error[:, -1, [0, 2]], axis=-1)
    columns = {
        "loss": window_loss(error, windows.dt),
        **root,
        "end_position_m": far,
        "end_heading_deg": np.degrees(np.abs(turned)),
    }
    whole = {name: np.where(np.isnan(one), np.inf, one) for name, one in columns.items()}
    return Scores(simulated, prediction_error(error), pl.DataFrame(whole))
