"""The error of a ship's MMG as a smooth function of a network's inputs, the same on all voyages.

The error lasts as long as a manoeuvre, so that process noise of seconds cannot represent it.
Without it, a cause that resembles it gains a few hundred nats. It is part of every hypothesis
(Kennedy & O'Hagan 2001: the discrepancy as a function of the inputs). It cannot explain a
dependence on heading, place or time. Where the network is fitted again, this function is added to
it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np

from shiplog.diagnosis.linear import segment_nodes
from shiplog.diagnosis.linear.linear_segments import Linear
from shiplog.diagnosis.linear.segment_nodes import Nodes
from shiplog.diagnosis.linear.segments import Cut, SegmentGrid
from shiplog.diagnosis.noise import part_products
from shiplog.diagnosis.noise.likelihood import ProcessNoise
from shiplog.models.compiled_network import Network

INPUT_SIZES = (1.0, 3.0, 9.0, 27.0)  # of the accelerations, in units of the ordinary process noise
SUMS = 200  # of the features in a channel, of which others hardly differ where ships go
FELT = 1.0  # least that voyages say of a weight, in units of what was known of it


@dataclass(frozen=True)
class Misfit:
    """a_c = Σ_f φ_f(x) (A_c w)_f: the network's smooth features φ [F], and the sums of them that
    these voyages say something of, w ~ N(0, I) [W].

    axes   A [3, F, W], weights of the features of each channel, in m/s² and rad/s²
    """

    network: Network
    axes: np.ndarray

    @property
    def count(self) -> int:
        return self.axes.shape[-1]

    def accelerations(self, cut: Cut, g: SegmentGrid) -> np.ndarray:
        """Φ = φᵀ A_c [S, 3J, W]: acceleration of each weight at the nodes, channel by channel."""
        waves = _features(self.network, segment_nodes.conditions_at_nodes(cut, g))
        return np.concatenate([waves @ axes for axes in self.axes], axis=1)

    def bends(self, weights: np.ndarray) -> np.ndarray:
        """(A_c w)_c [F, 3] of weights w [W], as `Network.bend` takes them."""
        return (self.axes @ weights).T


def estimate(
    network: Network, linear: Linear, g: SegmentGrid, process_noise: ProcessNoise,
    known: np.ndarray, unit: np.ndarray,
) -> Misfit:  # fmt: skip
    """The misfit with the most probable size s, the numbers d [C] integrated out (`_likelihood`).

    A_c = s q_c B U_c. B [F, SUMS] are the axes of Σ φ φᵀ over the voyages with the largest
    eigenvalues; U [3 SUMS, W], of rows U_c, the eigenvectors of s² M_ww, the information of these
    voyages on the weights, with eigenvalues above FELT.

    linear  of these voyages
    process_noise  theirs; its accelerations q [3] are the unit of size
    known  K [C], prior information of d, in `unit`s [C]
    """
    waves = _features(network, segment_nodes.conditions_at_nodes(linear.cut, g))
    sums = np.linalg.eigh(np.tensordot(waves, waves, ((0, 1), (0, 1))))[1][:, -SUMS:]
    count = sums.shape[1]
    axes = np.zeros((3, len(sums), 3 * count))
    for channel, size in enumerate(process_noise.acceleration):
        axes[channel][:, channel * count : (channel + 1) * count] = size * sums
    whole = Misfit(network, axes)
    total = part_products.whole(
        linear, process_noise, np.append(unit, np.ones(3 * count)),
        accelerations=partial(whole.accelerations, g=g),
    ).G  # fmt: skip
    size = max(INPUT_SIZES, key=lambda one: _likelihood(total, known, one))
    information = total[1 + len(known) :, 1 + len(known) :]
    felt, turned = np.linalg.eigh(size**2 * information)
    return Misfit(network, axes @ (size * turned[:, felt > FELT]))


def _features(network: Network, nodes: Nodes) -> np.ndarray:
    """φ [S, J, F] of the network at the nodes."""
    actuator, wind = nodes.driven[..., :-3], nodes.driven[..., -2:]
    return np.asarray(network.features(nodes.state, actuator, wind))


def _likelihood(total: np.ndarray, known: np.ndarray, size: float) -> float:
    """½ (gᵀ (M + Λ)⁻¹ g - log|M + Λ|), Λ = diag(K, I): log evidence of a campaign's products G
    together with weights of one size s (rows and columns of w times s), up to what no size changes.

    total   G [1 + C + W, 1 + C + W], of blocks g₀₀, g and M; known   K [C]; size   s
    """
    count = len(total) - 1 - len(known)
    by = np.concatenate((np.ones(1 + len(known)), np.full(count, size)))
    G = total * np.outer(by, by)
    M_Lambda = G[1:, 1:] + np.diag(np.concatenate((known, np.ones(count))))
    explained = G[1:, 0] @ np.linalg.solve(M_Lambda, G[1:, 0])
    return 0.5 * float(explained - np.linalg.slogdet(M_Lambda)[1])
