"""An unrecorded intermittent side force: its likelihood, its place and its course."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import jax.numpy as jnp
import numpy as np
from scipy.optimize import minimize

from shiplog.diagnosis import likelihood
from shiplog.diagnosis.likelihood import ProcessNoise
from shiplog.diagnosis.linear_segments import Linear
from shiplog.diagnosis.nominal_reference import Reference
from shiplog.jit_cache import traced
from shiplog.models.mmg import MMG, body

REACH_LENGTHS = 0.5  # lengths from midship
NOISE_FACTORS = (1.0, 1.4, 2.0, 2.8, 4.0, 5.6, 8.0, 11.0, 16.0)  # of process noise, to start from


@dataclass(frozen=True)
class SideForce:
    """The unrecorded thruster: log likelihood, its gain over process noise that is raised in each
    channel by itself, place [m ahead of midship], root mean square force [N], and acceleration of
    1 N [3]."""

    value: float
    gain: float
    lever: float
    force: float
    unit: np.ndarray


def estimate_side_force(
    linear: Linear, d: np.ndarray, ref: Reference, process_noise: ProcessNoise, weight: np.ndarray,
    nominal: np.ndarray | None = None,
) -> SideForce:  # fmt: skip
    """The most probable intermittent side force at one place along the ship, from the residual.
    It accelerates sway and yaw together, as no other process noise does.

    d       [C] numbers of the pass; weight [S] of its segments
    nominal acceleration [3] of nominal process noise at one place; None without any
    """
    kept = weight > 0.0  # a segment that says nothing has no likelihood
    linear, weight = linear.pick(kept), weight[kept]
    # subtracted before it is squared: of products small differences of large numbers would be left
    alone = replace(linear, e=linear.e - linear.j @ d, j=linear.j[..., :0])
    startless = likelihood.startless(likelihood.weighed(alone, process_noise), process_noise)
    plain = replace(process_noise, intermittent=None)

    def value(process_noise: ProcessNoise) -> float:
        each, volume = startless.square(process_noise)
        return -0.5 * ref.counts * (float(weight @ each) + volume)

    def raised(factors: np.ndarray) -> float:
        side = math.exp(0.5 * (factors[1] + factors[2]))
        intermittent = None if nominal is None else nominal * side
        return value(
            replace(
                plain, acceleration=plain.acceleration * np.exp(factors), intermittent=intermittent
            )
        )

    # from day to day one channel's noise is raised by more than another's, with no device at work,
    # and the nominal noise at one place is raised there
    first = np.full(3, math.log(max(NOISE_FACTORS, key=lambda v: value(plain.times(v)))))
    about = {"initial_simplex": first + 0.3 * np.eye(4, 3), "xatol": 0.02, "fatol": 0.1}
    by_channel = -float(minimize(lambda at: -raised(at), first, method="Nelder-Mead",
                                 options=about).fun)  # fmt: skip
    ship, length = ref.model.stand_in, ref.setting.scale["length"]
    across, turning = accelerations(ship, ref.coefficients, np.eye(3)[1:])  # of 1 N, of 1 N m

    def of(lever: float, force: float) -> float:
        unit = across + lever * length * turning
        return value(replace(plain, intermittent=unit * force))

    levers = np.linspace(-0.45, 0.45, 7)
    # in newtons that matter: from the nominal process noise upwards
    ordinary = plain.acceleration[1] / abs(across[1])
    sizes = ordinary * np.array([1.0, 2.0, 4.0, 8.0, 16.0])
    lever, force = max(itertools.product(levers, sizes), key=lambda tried: of(*tried))
    finer = minimize(  # together with the place itself a part of the force would be another cause's
        lambda at: -of(at[0], math.exp(at[1])), (lever, math.log(force)), method="Nelder-Mead",
        bounds=((-REACH_LENGTHS, REACH_LENGTHS), (None, None)),
        options={"xatol": 0.005, "fatol": 0.1},
    )  # fmt: skip
    lever, force = float(finer.x[0]) * length, math.exp(finer.x[1])
    one = -float(finer.fun)
    return SideForce(one, one - by_channel, lever, force, across + lever * turning)


def accelerations(ship: MMG, coefficients: Mapping, force: np.ndarray) -> np.ndarray:
    """ν̇ [n, 3] that forces X, Y, N [n, 3] make of a ship at rest."""
    return np.asarray(_accelerations(ship, dict(coefficients), force))


@traced
def _accelerations(ship, coefficients, force):
    zero = jnp.zeros(())
    return body.accelerations(coefficients, ship.geometry, zero, zero, zero, force)
