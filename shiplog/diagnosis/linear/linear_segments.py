"""Linearised segments: e_s = J_s d + Z_s z_s + ε_s, and the path that each is linear about."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from shiplog.diagnosis.linear.segments import Cut, SegmentGrid

AT_A_TIME = 32  # segments, whose accelerations by weights are a few megabytes

# Φ [S, 3J, W], acceleration at the nodes by each weight, SI, of all segments that were linearised;
# or how to make that of some of them
Accelerations = np.ndarray | Callable[[Cut], np.ndarray]


@dataclass(frozen=True)
class Path:
    """Where each segment was linearised: start ξ* [S, 6] and acceleration a* [S, 3, J] at the
    nodes, m/s² and rad/s²."""

    start: np.ndarray
    acceleration: np.ndarray

    def interpolate(self, g: SegmentGrid) -> np.ndarray:
        """Σⱼ hⱼ(tₖ) aⱼ*: the acceleration at the K instants of the steps [S, K, 3]."""
        return np.einsum("scj,kj->skc", self.acceleration, g.weights)

    @property
    def coordinates(self) -> np.ndarray:
        """z* = (0, a*) [S, 6 + 3J]: the start counts from ξ*, the acceleration from zero."""
        return np.concatenate(
            (np.zeros_like(self.start), self.acceleration.reshape(len(self.acceleration), -1)), 1
        )


@dataclass(frozen=True)
class Linear:
    """Segments linearised: e = J d + Z z + ε.

    e   [S, B, 6]           y - y* + Z z*: measured less simulated, with the path's own z* put back
    z   [S, B, 6, 6 + 3J]   Z: by the start (6), then by the accelerations, channel by channel (3J)
    j   [S, B, 6, C]        J: by θ, of the simulation less of the measurement
    lost [S]                bool: the model diverges there; rows of zeros, nothing of it is used

    Rows have the units of `channels.STATE`: m, m/s, rad, rad/s.
    """

    cut: Cut
    path: Path
    e: np.ndarray
    z: np.ndarray
    j: np.ndarray
    lost: np.ndarray = field(default_factory=lambda: np.zeros(0, dtype=bool))

    def __post_init__(self) -> None:
        if len(self.lost) != len(self.cut):
            object.__setattr__(self, "lost", np.zeros(len(self.cut), dtype=bool))

    @property
    def farthest(self) -> float:
        """max |e| over all observations."""
        return float(np.abs(self.e).max())

    def pick(self, keep: np.ndarray | slice) -> Linear:
        """Some of the segments."""
        path = Path(self.path.start[keep], self.path.acceleration[keep])
        parts = (getattr(self, name)[keep] for name in ("e", "z", "j", "lost"))
        return Linear(self.cut.pick(keep), path, *parts)

    def less(self, accelerations: np.ndarray) -> Linear:
        """e - Zₐ a: without what `accelerations` a [S, 3J] at the nodes do to the observations."""
        return replace(self, e=self.e - np.einsum("sbcz,sz->sbc", self.z[..., 6:], accelerations))

    def less_numbers(self, numbers: np.ndarray, accelerations: Accelerations) -> Linear:
        """e - J d - Zₐ Φ w, with other numbers (d, w) [S, C + W] in each segment, SI."""
        count = self.j.shape[-1]
        e = self.e - np.einsum("sbnc,sc->sbn", self.j, numbers[:, :count])
        return replace(self, e=e).less(acting(accelerations, self.cut, numbers[:, count:]))

    def joined(self, other: Linear) -> Linear:
        """These segments and others of the same record."""
        path = Path(*(_both(self.path, other.path, name) for name in ("start", "acceleration")))
        parts = (_both(self, other, name) for name in ("e", "z", "j", "lost"))
        return Linear(self.cut.joined(other.cut), path, *parts)


def acting(accelerations: Accelerations, cut: Cut, weights: np.ndarray) -> np.ndarray:
    """Φ w [S, 3J] of weights [W], or of others in each segment [S, W]. Where Φ is made, that of
    AT_A_TIME segments is held at a time."""
    if not callable(accelerations):
        return _times(accelerations, weights)
    own = weights.ndim > 1
    parts = [slice(at, at + AT_A_TIME) for at in range(0, max(len(cut), 1), AT_A_TIME)]
    each = (
        _times(accelerations(cut.pick(part)), weights[part] if own else weights) for part in parts
    )
    return np.concatenate(list(each))


def _times(phi: np.ndarray, weights: np.ndarray) -> np.ndarray:
    return phi @ weights if weights.ndim == 1 else np.einsum("szw,sw->sz", phi, weights)


def _both(one: object, other: object, name: str) -> np.ndarray:
    return np.concatenate((getattr(one, name), getattr(other, name)))


@dataclass(frozen=True)
class Wide:
    """How freely a path may be fitted to its measurement: standard deviations of one observation
    [6], of the start [6], and of the acceleration at each node [3], SI."""

    noise: np.ndarray
    start: np.ndarray
    acceleration: np.ndarray
