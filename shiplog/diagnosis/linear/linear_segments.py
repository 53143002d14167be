"""Linearised segments: what was measured less what was simulated, and how all numbers change it."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from shiplog.diagnosis.linear.segments import Cut, SegmentGrid


@dataclass(frozen=True)
class Path:
    """Where each segment was linearised: start [S, 6] and knots [S, 3, J] of acceleration."""

    start: np.ndarray
    acceleration: np.ndarray

    def at_nodes(self, g: SegmentGrid) -> np.ndarray:
        return np.einsum("scj,kj->skc", self.acceleration, g.weights)

    @property
    def known(self) -> np.ndarray:
        """[S, 6 + 3J] what a linearisation puts back: the start is free, and its own value its
        mean."""
        return np.concatenate(
            (np.zeros_like(self.start), self.acceleration.reshape(len(self.acceleration), -1)), 1
        )


@dataclass(frozen=True)
class Linear:
    """Segments linearised: residual = Z z + J d + noise.

    e   [S, B, 6]       measured less simulated, with the path's own z put back
    z   [S, B, 6, Z]    by initial state (6) and knots (3J)
    j   [S, B, 6, C]    by θ
    lost [S]            bool: the model diverges there; rows of zeros, nothing of it is used
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

    def pick(self, keep: np.ndarray) -> Linear:
        """Some of the segments."""
        path = Path(self.path.start[keep], self.path.acceleration[keep])
        parts = (getattr(self, name)[keep] for name in ("e", "z", "j", "lost"))
        return Linear(self.cut.pick(keep), path, *parts)

    def less(self, accelerations: np.ndarray) -> Linear:
        """Without what `accelerations` [S, 3J] at the knots does to the observations."""
        return replace(self, e=self.e - np.einsum("sbcz,sz->sbc", self.z[..., 6:], accelerations))

    def less_numbers(self, numbers: np.ndarray, accelerations: np.ndarray) -> Linear:
        """Residuals without the effect of the numbers [S, C + W] of each segment, SI: C of the
        columns of `j`, then W of accelerations [S, 3J, W] at the nodes."""
        count = self.j.shape[-1]
        e = self.e - np.einsum("sbnc,sc->sbn", self.j, numbers[:, :count])
        return replace(self, e=e).less(np.einsum("szw,sw->sz", accelerations, numbers[:, count:]))

    def joined(self, other: Linear) -> Linear:
        """These segments and others of the same record."""
        path = Path(*(_both(self.path, other.path, name) for name in ("start", "acceleration")))
        parts = (_both(self, other, name) for name in ("e", "z", "j", "lost"))
        return Linear(self.cut.joined(other.cut), path, *parts)


def _both(one: object, other: object, name: str) -> np.ndarray:
    return np.concatenate((getattr(one, name), getattr(other, name)))


@dataclass(frozen=True)
class Wide:
    """How freely a path may be pulled: noise of one observation [6], of the start [6], and of
    the acceleration's knots [3]."""

    noise: np.ndarray
    start: np.ndarray
    acceleration: np.ndarray
