"""The hybrid's residual network: scaled on the training windows, fitted by the same rollouts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from shiplog.channels import VELOCITY_IN_STATE
from shiplog.coverage import independent_distance
from shiplog.identify import Identified, identify
from shiplog.models.hybrid import Hybrid, Residual, anchored, first_weights, weight_spread
from shiplog.models.mmg import MMG, Parameters
from shiplog.sensitivity import Series, apparent_wind

STRETCH = 5  # s over which an acceleration is differenced, so that noise does not set the bound
EVALUATIONS = 25  # a network's last per cent does not survive held-out voyages


def residual(physics: MMG, data: Series, width: int) -> Residual:
    """What is fixed of the network, from the windows with weight alone."""
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
    start: Parameters,
    found: Identified,
    data: Series,
    *,
    width: int,
    strength: float,
    rng: np.random.Generator,
) -> tuple[Hybrid, Identified]:
    """Physics and network together, from the identified physics and a silent network on.

    The ridge still holds the physics to its own start, and the network's output to zero with
    `strength`: the same sum of squares, so that both come with standard errors.
    """
    net = residual(physics, data, width)
    weights = first_weights(net, rng)
    endless = np.full(net.count, np.inf)
    done = identify(
        Hybrid(physics, net),
        np.concatenate((start.values, weights)),
        np.concatenate((start.spread, weight_spread(net, strength))),
        data,
        bounds=(np.concatenate((start.low, -endless)), np.concatenate((start.high, endless))),
        free=np.concatenate((found.free, np.ones(net.count, dtype=bool))),
        begin=np.concatenate((found.values, weights)),
        most=EVALUATIONS,
        rounds=1,
    )
    return Hybrid(physics, net), replace(done, loss=(found.loss[0], done.loss[1]))
