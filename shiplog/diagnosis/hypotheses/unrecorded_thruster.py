"""An unrecorded intermittent side force: its likelihood, its place and its course.

A force of F newtons, rms, at the lever ℓ ahead of midship adds to the covariance of the
acceleration at the nodes (equation (1) of `intermittent`):

    Q_f = F² u uᵀ ⊗ C(T),   u = u_Y + ℓ u_N,   C_ij = exp(-|t_i - t_j| / T)

    u_Y, u_N [3]  accelerations ν̇ that 1 N to starboard and 1 N m make of a ship at rest
    T             correlation time: `lasts` times that of bursts
    C [J, J]      over the times of the nodes; of a force that is on or off, within a run only

ℓ, log F and log T are those of the largest log likelihood of the residual:

    -½ c (rᵀ S⁻¹ r + log|S|),   S = R + Z (λ² Q_n + Q_f) Zᵀ
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.optimize import minimize

from shiplog.diagnosis.noise import on_off
from shiplog.diagnosis.noise.on_off import Course
from shiplog.diagnosis.noise.raised_noise import Residual, Residuals, raise_channels
from shiplog.diagnosis.noise.remainder import INTERMITTENT, Remainder
from shiplog.diagnosis.nominal.nominal_reference import Reference
from shiplog.models.mmg import MMG, body

REACH_LENGTHS = 0.5  # ship lengths from midship: a force acts on the ship
# To start from: places in ship lengths; forces in multiples of the one that accelerates the ship
# sideways as much as the nominal process noise does
LEVERS = np.linspace(-0.45, 0.45, 7)
STEPS = (0.05, 0.3, 0.3)  # the first ones, of place and logarithms of force and correlation time
LASTS = math.log(4.0)  # of its correlation time over that of bursts, at most: it comes and goes
MOST_STEPS = 10.0  # like the last one, that an extrapolation may go on
SIZES = np.array([1.0, 2.0, 4.0, 8.0, 16.0])


@dataclass(frozen=True)
class SideForce:
    """An intermittent side force at one place, such as an unrecorded thruster's.

    value   log likelihood, nats; of a course that is on or off with its log probability
    gain    nats over process noise that is raised in each channel by itself
    lever   its place [m ahead of midship]
    force   root mean square [N], while it is on
    unit    [3] acceleration of 1 N
    device  probability, by its pattern, that it is the force of one device
    lasts   its correlation time, over the usual one
    turning  [3] acceleration of 1 N m
    reach   how far from midship it may act [m]
    course  when it is on, if it is either on or off
    """

    value: float
    gain: float
    lever: float
    force: float
    unit: np.ndarray
    device: float = 0.0
    lasts: float = 1.0
    turning: np.ndarray = field(default_factory=lambda: np.zeros(3))
    reach: float = math.inf
    course: Course | None = None

    @property
    def _coordinates(self) -> np.ndarray:
        """[3] lever, logarithms of force and correlation time."""
        return np.array([self.lever, math.log(self.force), math.log(self.lasts)])

    def _moved(self, coordinates: np.ndarray) -> SideForce:
        """The same force there, within its reach and its longest and shortest time."""
        lever = float(np.clip(coordinates[0], -self.reach, self.reach))
        force, lasts = np.exp([coordinates[1], np.clip(coordinates[2], -LASTS, LASTS)]).tolist()
        unit = self.unit + (lever - self.lever) * self.turning
        return replace(self, lever=lever, force=force, unit=unit, lasts=lasts)

    @property
    def remainder(self) -> Remainder:
        surge, sway, yaw = map(float, self.unit * self.force)
        of = (surge, sway, yaw)
        return Remainder(
            INTERMITTENT, intermittent=of, force_lasts=self.lasts, course=self.course
        )  # fmt: skip


Step = tuple[SideForce, SideForce]


def extrapolated(last: Step, this: Step) -> SideForce:
    """Limit of estimating force and numbers in turn, by the secant method on the lever (Aitken's Δ²
    process): the limit is Δ₂ / (Δ₁ - Δ₂) steps beyond the last one, for steps Δ₁
    and Δ₂ of the lever. The numbers make up for a wrong place: the lever converges slowest. Force
    and correlation time go as far on; MOST_STEPS limits how far, and the ship's ends the lever.

    last, this  the force that the numbers were fitted with, and the estimate that followed
    """
    (first, to_first), (second, to_second) = last, this
    if len({one.course is None for one in (*last, *this)}) > 1:  # sizes of another kind
        return to_second
    before, now = to_first.lever - first.lever, to_second.lever - second.lever
    if before * now > 0.0 and abs(now) >= abs(before):  # they do not get shorter
        further = MOST_STEPS
    else:
        further = min(now / (before - now), MOST_STEPS) if before != now else 0.0
    step = to_second._coordinates - to_first._coordinates
    return to_second._moved(to_second._coordinates + further * step)


def estimate_side_force(
    left: Residual | Residuals, ref: Reference, at_one_place: Remainder | None = None
) -> SideForce:
    """The most probable intermittent side force at one place along the ship, from the residual.
    It accelerates sway and yaw together, as no other process noise does. `at_one_place` as
    `raised_noise.raise_channels` has it."""
    raised, _ = raise_channels(left, at_one_place)
    likelihood = _Likelihood(left, ref)
    sizes = left.nominal.acceleration[1] / abs(likelihood.across[1]) * SIZES  # N
    lever, force = max(itertools.product(LEVERS, sizes), key=lambda tried: likelihood.log(*tried))
    return likelihood.most_probable(np.array([lever, math.log(force), 0.0]), raised)


def estimate_on_off_force(
    left: Residual | Residuals,
    ref: Reference,
    stationary: SideForce,
    course: Course,
    rows: np.ndarray,
) -> SideForce:
    """The most probable force of a device with this course, from one that may act at any time.

    stationary  that one
    rows        [S, J] of the record at the nodes of the segments that are `left`
    """
    runs = on_off.runs(course.on, rows)
    likelihood = _Likelihood(replace(left, nominal=replace(left.nominal, runs=runs)), ref)
    duty = max(float(np.diagonal(runs, axis1=1, axis2=2).mean()), 1.0 / runs.shape[1])
    first = stationary._coordinates / np.array([likelihood.length, 1.0, 1.0])
    first[1] -= 0.5 * math.log(duty)  # all of it acts while it is on
    found = likelihood.most_probable(first, stationary.value - stationary.gain)
    value, gain = found.value + course.prior, found.gain + course.prior
    return replace(found, value=value, gain=gain, device=stationary.device, course=course)


class _Likelihood:
    """Of a side force, by its lever in ship lengths, size [N] and correlation time over the usual
    one."""

    def __init__(self, left: Residual | Residuals, ref: Reference) -> None:
        self._left, self.length = left, ref.setting.scale["length"]
        self.across, self._turning = accelerations(  # of 1 N, of 1 N m
            ref.model.stand_in, ref.coefficients, np.eye(3)[1:]
        )

    def log(self, lever: float, force: float, lasts: float = 1.0) -> float:
        """Log likelihood, nats."""
        unit, nominal = self.across + lever * self.length * self._turning, self._left.nominal
        time = lasts * nominal.intermittent_time
        return self._left.likelihood(
            replace(nominal, intermittent=unit * force, intermittent_time=time)
        )

    def most_probable(self, first: np.ndarray, raised: float) -> SideForce:
        """The most probable force, its place with it: at a wrong place it would leave a part of
        itself to other causes.

        first    [3] lever and logarithms of size and correlation time, to start from
        raised   log likelihood of raised noise, nats
        """
        finer = minimize(
            lambda at: -self.log(at[0], *np.exp(at[1:])), first, method="Nelder-Mead",
            bounds=((-REACH_LENGTHS, REACH_LENGTHS), (None, None), (-LASTS, LASTS)),
            options={"initial_simplex": first + STEPS * np.eye(4, 3), "xatol": 0.005,
                     "fatol": 0.1},
        )  # fmt: skip
        lever, (force, lasts) = float(finer.x[0]) * self.length, map(float, np.exp(finer.x[1:]))
        one = -float(finer.fun)
        unit, reach = self.across + lever * self._turning, REACH_LENGTHS * self.length
        return SideForce(one, one - raised, lever, force, unit, 0.0, lasts, self._turning, reach)


def accelerations(ship: MMG, coefficients: Mapping, force: np.ndarray) -> np.ndarray:
    """ν̇ [n, 3] that forces X, Y, N [n, 3] make of a ship at rest."""
    zero = np.zeros(())
    return body.accelerations(coefficients, ship.geometry, zero, zero, zero, force)
