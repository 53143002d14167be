"""What remains together with the causes of a hypothesis, and how much process noise it expects."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from shiplog.diagnosis.noise import on_off
from shiplog.diagnosis.noise.likelihood import ProcessNoise
from shiplog.diagnosis.noise.on_off import Course

NOMINAL, RAISED, INTERMITTENT = "nominal", "raised", "intermittent"
CHANGE_SIZES = (1.0, 3.0, 9.0)  # of a change of a family's weights, in units of the process noise
LEAST_SPREAD = 0.05  # of the logarithm of the process noise: two campaigns are never alike
SHAPE_NUMBERS = 3  # of a noise of its own in each channel, or of a force, its place and λ
RAISED_SPREAD = 1.0  # the same where the process noise is raised: by e, either way
TIME_SPREAD = 1.0  # the same of its correlation time: other weather lasts longer or shorter by e


@dataclass(frozen=True)
class Remainder:
    """What remains together with the causes.

    kind          NOMINAL, RAISED, INTERMITTENT, or a family of the discrepancy
    size          of a change of that family's weights
    noisy         whether process noise is raised together with that change
    channels      factors of the process noise in surge, sway and yaw rate, in addition to the
                  common one
    noise_lasts   factor of the correlation time of the process noise
    intermittent  root mean square acceleration [m/s², m/s², rad/s²] of an intermittent force at one
                  place, in addition to the process noise
    force_lasts   factor of the correlation time of that force
    course        of that force, if it is on or off; None where it may act at any time
    """

    kind: str = NOMINAL
    size: float = 1.0
    noisy: bool = False
    channels: tuple[float, float, float] = (1.0, 1.0, 1.0)
    noise_lasts: float = 1.0
    intermittent: tuple[float, float, float] | None = None
    force_lasts: float = 1.0
    course: Course | None = None

    @property
    def shape(self) -> tuple:
        """What of it makes the process noise more than a multiple of the nominal one."""
        return self.channels, self.noise_lasts, self.intermittent, self.force_lasts, self.course

    @property
    def lasts(self) -> float:
        """Factor of the correlation time that is estimated: that of an intermittent force, else
        that of the process noise, whose part at one place lasts longer with it."""
        return self.force_lasts if self.kind == INTERMITTENT else self.noise_lasts

    @property
    def shaped(self) -> bool:
        return self.shape != Remainder().shape

    @property
    def raises(self) -> bool:
        """Whether the process noise is expected to be raised."""
        return self.noisy or self.kind in (RAISED, INTERMITTENT)

    def overall(self, noise_factor: float) -> float:
        """λ (c_u c_v c_r)^⅓: a common factor times the geometric mean of those of the channels."""
        return noise_factor * float(np.prod(self.channels)) ** (1.0 / len(self.channels))

    def factor_with_force(self, noise_factor: float, acceleration: np.ndarray) -> float:
        """Π_c (√((λ c_c q_c)² + p_c²)/q_c)^⅓: factor of the nominal process noise, of root mean
        square q = `acceleration` [3], that this noise and the force at one place p are together:
        geometric mean of the channels."""
        channels = noise_factor * np.array(self.channels) * acceleration
        force = np.zeros(3) if self.intermittent is None else np.array(self.intermittent)
        return float(np.prod(np.hypot(channels, force) / acceleration) ** (1.0 / len(channels)))

    def apply_to(self, process_noise: ProcessNoise, rows: np.ndarray | None = None) -> ProcessNoise:
        """(c_u q_u, c_v q_v, c_r q_r), c_τ τ, p, c_p τ_p: the process noise with the factors of its
        channels and of its time, and the intermittent force in it.

        rows   [S, J] of the record at the nodes of segments; without them a force that is on or off
               has its size only
        """
        if not self.shaped:
            return process_noise
        force = None if self.intermittent is None else np.array(self.intermittent)
        runs = None
        if self.course is not None and rows is not None:
            runs = on_off.runs(self.course.on, rows)
        acceleration = process_noise.acceleration * self.channels
        return replace(
            process_noise, acceleration=acceleration, time=self.noise_lasts * process_noise.time,
            intermittent=force, runs=runs,
            intermittent_time=self.force_lasts * process_noise.intermittent_time,
        )  # fmt: skip


def noise_prior(noise: float, nominal: float, remainder: Remainder) -> float:
    """Log prior density of a level λ of process noise together with a remainder, less the greatest
    one together with NOMINAL. The logarithms of the factors are Gaussian, with c_c those of the
    channels and c_τ that of a correlation time (S RAISED_SPREAD, S_τ TIME_SPREAD):

        nominal                       -½ (log λ/σ)²
        raised, one factor for all    -½ (log λ/S)² - log(S/σ)
        raised in each channel        -½ Σ_c (log(λ c_c)/S)² - 3 log(S/σ)
        and longer                    -½ (Σ_c (log(λ c_c)/S)² + (log c_τ/S_τ)²) - 4 log(S/σ)

    A course of a force that is on or off adds its own log p(s).

    noise     λ, factor of the nominal process noise
    nominal   σ, standard deviation of its logarithm from campaign to campaign
    """
    if not remainder.raises:
        return -0.5 * (math.log(noise) / nominal) ** 2
    course = 0.0 if remainder.course is None else remainder.course.prior
    by_channel = np.log(noise * np.array(remainder.channels)) / RAISED_SPREAD
    square, cost = by_channel @ by_channel, math.log(RAISED_SPREAD / nominal)
    if not remainder.shaped:  # one number for all three
        return float(-0.5 * square / len(by_channel) - cost)
    if remainder.lasts == 1.0:
        return float(-0.5 * square - SHAPE_NUMBERS * cost) + course
    square += (math.log(remainder.lasts) / TIME_SPREAD) ** 2
    return float(-0.5 * square - (SHAPE_NUMBERS + 1) * cost) + course
