"""The hybrid's residual network: scaled on the training windows, fitted by the same rollouts.

    (u̇, v̇, ṙ) = f(x, u; θ̂) + n(x, u; W),   W = argmin Σ_w ω_w L_w(W)/σ² + Σ_i (W_i - W₀_i)²/s_i²

with the physics' θ̂ held, s_i the spread of a weight by `strength` (`hybrid.weight_spread`).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from shiplog.models.hybrid import Hybrid, Residual, anchored, first_weights, weight_spread
from shiplog.models.mmg import MMG
from shiplog.nomenclature.channels import VELOCITY_IN_STATE
from shiplog.simulation.coverage import independent_distance
from shiplog.simulation.window_series import WindowSeries, apparent_wind
from shiplog.training.physics.cross_validation import as_good
from shiplog.training.physics.output_error import Identified, identify

STRETCH = 5  # s over which an acceleration is differenced, so that noise does not set the bound
EVALUATIONS = 25  # a network's last per cent does not survive held-out voyages


def residual(physics: MMG, data: WindowSeries, width: int) -> Residual:
    """What is fixed of the network, from the windows with weight alone: mean and standard deviation
    of its inputs (u, v, r, actuators, U_A cos γ_A, U_A sin γ_A), its bound, the standard deviation
    of (ν(t + h) - ν(t))/h with h = STRETCH, and where it falls silent."""
    chosen = data.weight > 0
    state, actuator, wind = data.measured[chosen], data.actuator[chosen], data.wind[chosen]
    parts = [state[..., list(VELOCITY_IN_STATE)], actuator]
    if physics.geometry.wind:
        apparent = apparent_wind(state, wind)
        speed, angle = apparent[..., :1], apparent[..., 1:]
        parts += [speed * np.cos(angle), speed * np.sin(angle)]
    samples = np.concatenate(parts, -1).reshape(-1, sum(p.shape[-1] for p in parts))
    mean, std = samples.mean(0), samples.std(0)
    std = np.where(std > 1e-9, std, 1.0)
    standard = (samples - mean) / std
    anchors, radius = anchored(standard)
    velocity = state[..., list(VELOCITY_IN_STATE)]
    rate = (velocity[:, STRETCH:] - velocity[:, :-STRETCH]) / STRETCH
    return Residual(
        width=width,
        mean=mean,
        std=std,
        bound=rate.reshape(-1, 3).std(0),
        anchors=anchors,
        radius=radius,
        limit=independent_distance(standard),
    )


def fit(
    physics: MMG,
    found: Identified,
    data: WindowSeries,
    *,
    width: int,
    strength: float,
    rng: np.random.Generator,
) -> tuple[Hybrid, Identified]:
    """The network on top of identified physics, by the same sum of squares.

    The physics stay as they were identified alone: far from the training data, where the network
    is silent, the hybrid is them. The ridge holds the network's output to zero with `strength`.
    """
    net = residual(physics, data, width)
    hybrid, weights = Hybrid(physics, net), first_weights(net, rng)
    count = len(found.values)
    start = np.concatenate((found.values, weights))
    done = identify(
        hybrid,
        start,
        np.concatenate((np.ones(count), weight_spread(net, strength))),
        data,
        free=np.arange(len(start)) >= count,
        most=EVALUATIONS,
        rounds=1,
    )
    covariance = done.covariance.copy()
    covariance[:count, :count] = found.covariance
    return hybrid, replace(
        done,
        covariance=covariance,
        free=np.concatenate((found.free, done.free[count:])),
        loss=(found.loss[0], done.loss[1]),
    )


def choose(judged: dict[float, np.ndarray]) -> float:
    """min of the strengths that are not worse than the best by more than chance (`as_good`).

    judged   strength → L of each held-out window [N]; strength 0 is the physics alone, and the
             answer where fewer than two windows can be judged

    The one-standard-error rule on paired windows.
    """
    return min(as_good(judged), default=0.0)
