"""Process noise that is raised in each channel by itself: rougher weather, with nothing at work.

Waves and gusts do not raise the noise of surge, sway and yaw rate alike. Were all three raised by
one factor, whatever acts on one of them more than on the others would look like a force. So would
noise that lasts longer than that of the nominal voyages: swell and squalls do.

    q → (c_u q_u, c_v q_v, c_r q_r),  τ → c_τ τ:   max over c of  log p(r | c),  r = e - J d
    log p(r | c) = -½ κ (Σ_s w_s r_sᵀ C_s(c)⁻¹ r_s + Σ_s log|C_s(c)|)

κ is the share of itself that a trial counts (`Reference.counts`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import minimize

from shiplog.diagnosis.linear.linear_segments import Linear
from shiplog.diagnosis.noise import likelihood
from shiplog.diagnosis.noise.likelihood import ProcessNoise, Startless
from shiplog.diagnosis.noise.remainder import RAISED, Remainder

FACTORS = (1.0, 1.4, 2.0, 2.8, 4.0, 5.6, 8.0, 11.0, 16.0)  # of the process noise, to start from


@dataclass(frozen=True)
class Residual:
    """What a hypothesis leaves of a trial, to be explained by noise.

    nominal   process noise of the nominal campaign
    weight    [S] of the segments
    counts    as `Reference.counts`
    """

    startless: Startless
    nominal: ProcessNoise
    weight: np.ndarray
    counts: float

    def likelihood(self, process_noise: ProcessNoise) -> float:
        """-½ κ (Σ_s w_s r_sᵀ C_s⁻¹ r_s + Σ_s log|C_s|): log likelihood, nats, up to a constant."""
        return -0.5 * self.counts * self.misfit(process_noise)

    def misfit(self, process_noise: ProcessNoise) -> float:
        """Σ_s w_s r_sᵀ C_s⁻¹ r_s + Σ_s log|C_s|."""
        if not len(self.weight):
            return 0.0
        each, volume = self.startless.square(process_noise)
        return float(self.weight @ each) + volume


Misfits = Callable[[ProcessNoise, Sequence[np.ndarray] | None], Sequence[float]]


@dataclass(frozen=True)
class Residuals:
    """A residual in blocks of voyages, added block by block: the same to the last bit wherever they
    are worked out.

    nominal, counts  as of a `Residual`
    sizes            segments of each block
    misfits          process noise without its runs, and the runs of each block → of each block its
                     `Residual.misfit`
    """

    nominal: ProcessNoise
    counts: float
    sizes: tuple[int, ...]
    misfits: Misfits

    def likelihood(self, process_noise: ProcessNoise) -> float:
        """As of a `Residual`."""
        runs = process_noise.runs
        each = None if runs is None else np.split(runs, np.cumsum(self.sizes)[:-1])
        return -0.5 * self.counts * sum(self.misfits(replace(process_noise, runs=None), each))


def in_blocks(blocks: Sequence[Residual]) -> Residual | Residuals:
    """The residual of all blocks, which are here."""
    if len(blocks) == 1:
        return blocks[0]

    def misfits(process_noise: ProcessNoise, runs: Sequence[np.ndarray] | None) -> Sequence[float]:
        each = [None] * len(blocks) if runs is None else runs
        return [
            block.misfit(replace(process_noise, runs=own))
            for block, own in zip(blocks, each, strict=True)
        ]

    sizes = tuple(len(block.weight) for block in blocks)
    return Residuals(blocks[0].nominal, blocks[0].counts, sizes, misfits)


def residual(
    linear: Linear, d: np.ndarray, nominal: ProcessNoise, weight: np.ndarray, counts: float
) -> Residual:
    """r = e - J d: what numbers d [C], SI, leave of a pass; weight w [S] of its segments. Raises
    np.linalg.LinAlgError where its path diverged."""
    # subtracted before it is squared: of products small differences of large numbers would be left
    alone = replace(linear, e=linear.e - linear.j @ d, j=linear.j[..., :0])
    kept = weight > 0.0  # a segment that says nothing has no likelihood
    if not kept.all():
        alone, weight = alone.pick(kept), weight[kept]
    startless = likelihood.startless(likelihood.weighed(alone, nominal), nominal)
    return Residual(startless, nominal, weight, counts)


def raise_channels(
    left: Residual | Residuals, at_one_place: Remainder | None = None
) -> tuple[float, Remainder]:
    """max over (log c_u, log c_v, log c_r, log c_τ) of log p(r | c), nats, and the factors c of
    surge, sway, yaw rate and correlation time (Nelder & Mead 1965, from the best common factor).

    at_one_place  nominal process noise that acts at one place: it is raised, and lasts longer, with
                  the others; None without any
    """

    def raised(factors: np.ndarray) -> Remainder:
        surge, sway, yaw_rate, lasts = map(float, np.exp(factors))
        found = Remainder(RAISED, channels=(surge, sway, yaw_rate), noise_lasts=lasts)
        if at_one_place is None or at_one_place.intermittent is None:
            return found
        ahead, across, turning = at_one_place.intermittent
        by, force_lasts = math.sqrt(sway * yaw_rate), lasts * at_one_place.force_lasts
        force = (by * ahead, by * across, by * turning)
        return replace(found, intermittent=force, force_lasts=force_lasts)

    def value(factors: np.ndarray) -> float:
        return left.likelihood(raised(factors).apply_to(left.nominal))

    alike = max(FACTORS, key=lambda factor: left.likelihood(left.nominal.times(factor)))
    first = np.append(np.full(3, math.log(alike)), 0.0)
    found = minimize(
        lambda at: -value(at), first, method="Nelder-Mead",
        options={"initial_simplex": first + 0.3 * np.eye(5, 4), "xatol": 0.02, "fatol": 0.1},
    )  # fmt: skip
    return -float(found.fun), raised(found.x)
