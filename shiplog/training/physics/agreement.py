"""Whether parts of the data agree on a coefficient: a jackknife over groups of windows.

A model of the right form has the same coefficients in every part of its data, but for chance. One
that lacks a term has others at low speed than at high, and others in gentle turns than in hard
ones; no standard error of the whole shows that. The training windows are cut by voyage, by speed
and by turning into K groups each. Without group k, one Gauss-Newton step gives (Pregibon 1981), in
units of the plausible spreads, with the information H, the prior's F = 1 and the half gradient g
of the misfit (symbols as in the room's opening),

    θ̂_(-k) = θ̂ + (H - H_k + F)⁻¹ g_k
    D = (K - 1)/K Σ_k (θ̂_(-k) - θ̂)²         (Quenouille 1956, Tukey 1958)

The variance of a coefficient is that of its sampling plus the largest D of the three partitions.
For a model of the right form D is a sampling variance once more, so that such an interval is
wider than it need be by up to √2.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from shiplog.nomenclature.channels import VELOCITY_IN_STATE
from shiplog.simulation.window_series import Normal, WindowSeries, pick

GROUPS = 4  # of equal size, by speed and by turning: fewer are too alike, more are too few windows
LEAST_WINDOWS = 2  # in a group
VOYAGES, SPEED, TURNING = "voyages", "slow and fast windows", "gentle and hard turns"
SLOWEST = 1e-3  # of the mean speed of all windows, below which one counts as that slow


@dataclass(frozen=True)
class Group:
    """H_k [P, P] and g_k [P] of some windows, per σ², before units."""

    gram: np.ndarray
    pull: np.ndarray


def partitions(data: WindowSeries, voyages: Sequence[str]) -> dict[str, np.ndarray]:
    """How the windows are cut: a number of its group for each window [N].

    speed     mean of |U|
    turning   mean of |r| over that of U: the curvature of the path
    """
    u, v, r = (data.measured[..., column] for column in VELOCITY_IN_STATE)
    speed = np.hypot(u, v).mean(1)
    curved = np.abs(r).mean(1) / np.maximum(speed, SLOWEST * speed.mean())
    found = {}
    order = list(dict.fromkeys(voyages))
    if len(order) > 1:
        found[VOYAGES] = np.array([order.index(one) for one in voyages])
    if len(speed) >= GROUPS * LEAST_WINDOWS:
        found |= {SPEED: _quarters(speed), TURNING: _quarters(curved)}
    return found


def _quarters(values: np.ndarray) -> np.ndarray:
    """Groups of equal size by rank."""
    return np.argsort(np.argsort(values, kind="stable")) * GROUPS // len(values)


def groups(
    data: WindowSeries, cut: Mapping[str, np.ndarray], normal: Callable[[WindowSeries], Normal]
) -> dict[str, list[Group]]:
    """H_k and g_k of each group of each partition; `normal`: those of some windows."""
    found = {}
    for name, of in cut.items():
        each = [normal(pick(data, of == k)) for k in range(int(of.max()) + 1)]
        found[name] = [Group(one.gram, one.pull.sum(0)) for one in each]
    return found


@dataclass(frozen=True)
class Agreement:
    """apart   [P] D^½ of the partition that agrees least, in units of the spreads
    worst   which partition that is, for each coefficient
    """

    apart: np.ndarray
    worst: tuple[str, ...]


def agreement(
    parts: Mapping[str, Sequence[Group]], variance: float, scale: np.ndarray, free: np.ndarray
) -> Agreement:
    """Of groups before units. Zero where nothing can be left out, and where a coefficient was held.

    variance   σ², as the fit has it
    scale      s [P]; free   [P]
    """
    largest, worst = np.zeros(len(scale)), [""] * len(scale)
    unit = np.outer(scale[free], scale[free]) / variance
    for name, each in parts.items():
        H = [one.gram[np.ix_(free, free)] * unit for one in each]
        g = [one.pull[free] * scale[free] / variance for one in each]
        D = np.zeros(len(scale))
        D[free] = jackknife(H, g)
        for i in np.flatnonzero(largest < D):
            largest[i], worst[i] = D[i], name
    return Agreement(np.sqrt(largest), tuple(worst))


def jackknife(H: Sequence[np.ndarray], g: Sequence[np.ndarray]) -> np.ndarray:
    """D [P] of K groups' H_k [P, P] and g_k [P], in units of the spreads."""
    count, whole = len(H), np.sum(H, axis=0)
    if count < 2:
        return np.zeros(len(whole))
    moved = [
        np.linalg.solve(whole - one + np.eye(len(whole)), pull)
        for one, pull in zip(H, g, strict=True)
    ]
    return (count - 1) / count * np.square(moved).sum(0)
