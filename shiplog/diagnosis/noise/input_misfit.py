"""The error of a ship's MMG as a smooth function of a network's inputs, the same on all voyages.

The error lasts as long as a manoeuvre, so that process noise of seconds cannot represent it.
Without it, a cause that resembles it gains a few hundred nats. It is part of every hypothesis
(Kennedy & O'Hagan 2001: the discrepancy as a function of the inputs). It cannot explain a
dependence on heading, place or time. Where the network is fitted again, this function is added to
it.
"""

from __future__ import annotations

from dataclasses import dataclass

import jax.numpy as jnp
import numpy as np

from shiplog.diagnosis.linear import segment_nodes
from shiplog.diagnosis.linear.segment_nodes import Knots
from shiplog.diagnosis.linear.segments import Cut, SegmentGrid
from shiplog.diagnosis.noise.likelihood import Modes
from shiplog.machine.jit_cache import double
from shiplog.models.compiled_network import Network

INPUT_SIZES = (1.0, 3.0, 9.0, 27.0)  # of the accelerations, in units of the ordinary process noise
SUMS = 200  # of the features in a channel, of which others hardly differ where ships go
FELT = 1.0  # least that voyages say of a weight, in units of what was known of it


@dataclass(frozen=True)
class Misfit:
    """The network's smooth features, and the sums of them that these voyages say something of.

    axes   [3, F, W]  weights of the features of each channel, in m/s² and rad/s²
    """

    network: Network
    axes: np.ndarray

    @property
    def count(self) -> int:
        return self.axes.shape[-1]

    def accelerations(self, cut: Cut, g: SegmentGrid) -> np.ndarray:
        """[S, 3J, W]: acceleration of each weight at the knots, channel by channel."""
        waves = _features(self.network, segment_nodes.at_knots(cut, g))
        return np.concatenate([waves @ axes for axes in self.axes], axis=1)

    def bends(self, weights: np.ndarray) -> np.ndarray:
        """[F, 3] weights [W] as `Network.bend` takes them."""
        return (self.axes @ weights).T


def of(
    network: Network, cut: Cut, g: SegmentGrid, modes: Modes, known: np.ndarray,
    unit: np.ndarray, acceleration: np.ndarray,
) -> Misfit:  # fmt: skip
    """With the most probable size, conditional on numbers [C] in `unit`s [C] with the prior
    information `known`.

    cut    of the voyages that `modes` are of
    acceleration  [3] unit of size
    """
    waves = _features(network, segment_nodes.at_knots(cut, g))
    sums = np.linalg.eigh(np.tensordot(waves, waves, ((0, 1), (0, 1))))[1][:, -SUMS:]
    count = sums.shape[1]
    axes = np.zeros((3, len(sums), 3 * count))
    for channel, size in enumerate(acceleration):
        axes[channel][:, channel * count : (channel + 1) * count] = size * sums
    whole = Misfit(network, axes)
    by = np.concatenate(([1.0], unit, np.ones(3 * count)))
    total = modes.joined(whole.accelerations(cut, g)).total(np.ones(len(cut)))
    total = total * np.outer(by, by)
    size = max(INPUT_SIZES, key=lambda one: _likelihood(total, known, one))
    information = total[1 + len(known) :, 1 + len(known) :]
    felt, turned = np.linalg.eigh(size**2 * information)
    return Misfit(network, axes @ (size * turned[:, felt > FELT]))


def _features(network: Network, knots: Knots) -> np.ndarray:
    """[S, J, F]"""
    actuator, wind = knots.driven[..., :-3], knots.driven[..., -2:]
    with double():
        return np.asarray(network.features(*map(jnp.asarray, (knots.state, actuator, wind))))


def _likelihood(total: np.ndarray, known: np.ndarray, size: float) -> float:
    """Log marginal likelihood of a campaign's products together with weights of one size, up to
    what no size changes."""
    count = len(total) - 1 - len(known)
    by = np.concatenate((np.ones(1 + len(known)), np.full(count, size)))
    scaled = total * np.outer(by, by)
    both = scaled[1:, 1:] + np.diag(np.concatenate((known, np.ones(count))))
    found = scaled[1:, 0] @ np.linalg.solve(both, scaled[1:, 0])
    return 0.5 * float(found - np.linalg.slogdet(both)[1])
