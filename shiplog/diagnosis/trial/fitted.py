"""What a fit of a hypothesis gives: where a trial was linearised, numbers, evidence."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from shiplog.diagnosis.linear.linear_segments import Linear, Path
from shiplog.diagnosis.noise.remainder import Remainder


@dataclass(frozen=True)
class Estimate:
    """One hypothesis.

    evidence       of a base hypothesis its log marginal likelihood [nats]; of a candidate or a
                   structure its log Bayes factor over the base hypothesis
    noise_factor   λ, the most probable factor of the process noise
    numbers        of each cause, as a change from nominal, with their covariance
    density        of a base hypothesis the log density of the data and of the numbers where it was
                   linearised
    bend           of the evidence over the logarithm of λ, as of `Level`
    expected       of a candidate: the log Bayes factor to expect of it, by its size
    """

    name: str
    evidence: float
    noise_factor: float
    numbers: Mapping[str, np.ndarray] = field(default_factory=dict)
    covariance: np.ndarray | None = None
    expected: ExpectedEvidence | None = None
    density: float = -np.inf
    bend: float = 0.0


@dataclass(frozen=True)
class ExpectedEvidence:
    """Expected log Bayes factor of a cause: ½ Σ each s² - cost, for numbers s in units of their
    realistic size."""

    each: np.ndarray
    cost: float

    def least(self, nats: float) -> np.ndarray:
        """Of each number alone, the size with this expected log Bayes factor [realistic sizes]."""
        return np.sqrt(2.0 * (nats + self.cost) / np.maximum(self.each, 1e-12))

    def common_size(self, nats: float) -> float:
        """The size with this expected log Bayes factor, if all its numbers have that size."""
        return float(np.sqrt(2.0 * (nats + self.cost) / max(self.each.sum(), 1e-12)))


@dataclass(frozen=True)
class Point:
    """A trial linearised where some causes' numbers stand."""

    numbers: Mapping[str, np.ndarray]
    path: Path
    linear: Linear


@dataclass(frozen=True)
class Start:
    """Where a fit of causes begins.

    numbers       label → numbers, SI
    path          to start from, or a point whose linearisation predicts it; None without any
    noise_factor  λ at which an earlier fit of them converged; None without any
    bend          of the evidence over log λ in a fit that this one follows; zero without any
    """

    numbers: Mapping[str, np.ndarray]
    path: Path | Point | None
    noise_factor: float | None = None
    bend: float = 0.0


@dataclass(frozen=True)
class Fit:
    """A hypothesis with the trial linearised where it was found, and what remains with it."""

    point: Point
    estimate: Estimate
    remainder: Remainder

    @property
    def included(self) -> tuple[str, ...]:
        """Labels of the causes that it holds, those of the model with them."""
        return tuple(self.estimate.numbers)

    @property
    def start(self) -> Start:
        """Where a further fit of the same hypothesis begins."""
        return Start(self.estimate.numbers, self.point.path, self.estimate.noise_factor)

    @property
    def diverged(self) -> bool:
        """Whether it has no evidence: its numbers are then of no use."""
        return not math.isfinite(self.estimate.evidence)

    @property
    def noise_factor(self) -> float:
        """Of the process noise on its nominal one, a geometric mean over the channels."""
        return self.remainder.overall(self.estimate.noise_factor)


@dataclass(frozen=True)
class Level:
    """Posterior of a base hypothesis at one factor λ of the process noise.

    It holds N numbers, in units: all nominal ones, then those of the included causes, then the
    weights of its remainder's family.

    noise_factor  λ
    G             [1 + N, 1 + N]  [r H]ᵀ R⁻¹ [r H], segments weighted
    covariance    [N, N]  P - K S Kᵀ = A⁻¹
    mean          [N]     μ + K v = A⁻¹ b
    value         log evidence
    share         of it, what the bounds of numbers add
    bend          second difference of the log evidence over three levels, one step apart; zero of a
                  level by itself
    """

    noise_factor: float
    G: np.ndarray
    covariance: np.ndarray
    mean: np.ndarray
    value: float
    share: float = 0.0
    bend: float = 0.0
