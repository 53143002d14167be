"""How wrong a simulation is: the paper's error d and evaluation function L, and what a navigator
asks: how far off it ends, and by how many degrees."""

from __future__ import annotations

import math
from dataclasses import dataclass

import polars as pl
import torch
from torch import Tensor

from shiplog import channels
from shiplog.models.base import Dynamics
from shiplog.simulation.rollout import Simulates, simulate
from shiplog.voyages.windows import Windows

ERRORS = ("loss", "rmse_surge", "rmse_sway", "rmse_yaw_rate", "end_position_m", "end_heading_deg")


def prediction_error(simulated: Tensor, measured: Tensor) -> Tensor:
    """d of Eq. 6, [N, I] from states [N, I, 6]: weighted velocities, yaw rate in deg/s."""
    rows = list(channels.VELOCITY_IN_STATE)
    error = simulated[..., rows] - measured[..., rows]
    weights = torch.tensor(channels.VELOCITY_WEIGHTS, dtype=error.dtype)
    return ((weights * error) ** 2).sum(-1)


def window_loss(d: Tensor, dt: Tensor) -> Tensor:
    """Trapezoidal time integral of d over each window [N], the inner sum of Eq. 8."""
    return (0.5 * (d[:, 1:] + d[:, :-1]) * dt).sum(1)


@dataclass(frozen=True)
class Scores:
    """One model on N windows: simulated states [N, I, 6], d [N, I], and ERRORS per window."""

    simulated: Tensor
    d: Tensor
    errors: pl.DataFrame


def score(dynamics: Dynamics | Simulates, windows: Windows) -> Scores:
    """Roll a model out over the windows and compare. A rollout that diverges scores infinity."""
    simulated = simulate(dynamics, windows)
    d = prediction_error(simulated, windows.state)
    d = torch.where(torch.isfinite(d), d, torch.inf)
    difference = simulated - windows.state
    turned = torch.remainder(difference[:, -1, 4] + math.pi, 2.0 * math.pi) - math.pi
    root = {
        f"rmse_{c.name}": difference[..., i].square().mean(1).sqrt()
        for c, i in zip(channels.VELOCITY, channels.VELOCITY_IN_STATE, strict=True)
    }
    columns = {
        "loss": window_loss(d, windows.dt),
        **root,
        "end_position_m": torch.linalg.vector_norm(difference[:, -1, [0, 2]], dim=-1),
        "end_heading_deg": turned.abs() * 180.0 / math.pi,
    }
    errors = pl.DataFrame({name: values.numpy() for name, values in columns.items()})
    return Scores(simulated, d, errors)
