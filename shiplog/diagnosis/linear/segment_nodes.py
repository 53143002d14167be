"""Motion, controls and accelerations at the nodes of segments, channel by channel.

The velocities are through the water, where it moves with V over ground: ν - Rᵀ(ψ) V.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from shiplog.diagnosis.linear.linearisation import resampled
from shiplog.diagnosis.linear.segments import Cut, SegmentGrid
from shiplog.nomenclature import frames


@dataclass(frozen=True)
class Nodes:
    """What went on at the nodes of S segments.

    state   [S, J, 6]      velocities through the water
    driven  [S, J, A + 3]  actuators, share of the campaign, wind over the water
    """

    state: np.ndarray
    driven: np.ndarray


def conditions_at_nodes(segments: Cut, g: SegmentGrid) -> Nodes:
    """State and what drives at the nodes, the measured means of bins straight in between. Through
    water that moves with V: (u, v) - Rᵀ(ψ) V, and the wind over the water W + V, where W is where
    the wind comes from."""
    centre = (np.arange(g.bins) + 0.5) * g.seconds / g.bins
    every = round(g.node_step / (g.step * g.every))
    state = resampled(centre, segments.y, np.arange(g.nodes) * g.node_step)
    driven = segments.driven[:, ::every]
    if segments.water.any():
        north, east = segments.water
        c, s = np.cos(state[..., 4]), np.sin(state[..., 4])
        ahead, starboard = frames.in_body_axes(north, east, c, s)
        state[..., 1] -= ahead
        state[..., 3] -= starboard
        driven = driven.copy()
        driven[..., -2:] += segments.water  # the apparent wind stays as it is
    return Nodes(state, driven)


def rows_of_nodes(begins: np.ndarray, g: SegmentGrid) -> np.ndarray:
    """Row of the record at each node [S, J], of segments that begin at these rows [S]."""
    return begins[:, None] + round(g.node_step / g.step) * np.arange(g.nodes)


def repeat_for_channels(waves: np.ndarray) -> np.ndarray:
    """I₃ ⊗ φᵀ at each node, [S, J, F] → [S, J, 3, 3F]: F features in each channel alone."""
    count = waves.shape[-1]
    out = np.zeros((*waves.shape[:2], 3, 3 * count))
    for channel in range(3):
        out[..., channel, channel * count : (channel + 1) * count] = waves
    return out


def accelerations(features: np.ndarray, acceleration: np.ndarray) -> np.ndarray:
    """Φ [S, 3J, W]: acceleration of each weight at the nodes, channel by channel, m/s² and rad/s²,
    of `features` [S, J, 3, W] times the unit of size `acceleration` [3]."""
    scaled = np.moveaxis(features * acceleration[:, None], 2, 1)
    return scaled.reshape(len(scaled), -1, scaled.shape[-1])
