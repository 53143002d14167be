"""A screw in four quadrants: Hachii's thrust and side force astern, Ueno's training-ship data."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from shiplog.machine.arrays import Array, jnp
from shiplog.models.mmg.geometry import Geometry, Propeller
from shiplog.models.mmg.safe_root import speed

PITCH_RATIO = 0.7151  # of the screw whose side force the A and B with n > 0 were measured on
BREAKS = (-0.35, -0.06)  # J_s where the astern side force changes its branch (Hachii)
LEAST_INFLOW = 1e-9  # 1 - w_P stays above


def inflow(
    p: Mapping[str, Array], g: Geometry, screw: Propeller, u: Array, v: Array, r: Array
) -> Array:
    """1 - w_P: the share of u that arrives at the screw; 1 astern (Kobayashi-type wake).

    w_P = w_P0 - τ |v' + x'_P r'| - C_P (v' + x'_P r')²,  v' = v/U, r' = r L/U
    """
    total = speed(u, v)
    aside = (v + screw.ahead * r) / total
    wake = p["propeller.w_p0"] - p["propeller.tau"] * jnp.abs(aside)
    wake = wake - p["propeller.c_p"] * aside**2
    return jnp.clip(1.0 - jnp.where(u > 0.0, wake, 0.0), LEAST_INFLOW, 1.0)


def thrust_coefficient(
    p: Mapping[str, Array], screw: Propeller, u: Array, arriving: Array, n: Array
) -> tuple[Array, Array]:
    """K_T that the rudder's slipstream is made of, and X_P/(ρD⁴n²) with thrust deduction.

    n > 0:  K_T = k₀ + k₁J + k₂J²; X_P takes (1 - t) of it, J = J_s (1 - w_P) ahead, J_s astern
    n < 0:  C₆ + C₇J_s where J_s ≥ C₁₀, else C₃
    """
    advance = u / (jnp.where(n == 0.0, 1.0, n) * screw.diameter)
    j = jnp.where(u >= 0.0, advance * arriving, advance)
    ahead = p["propeller.k0"] + p["propeller.k1"] * j + p["propeller.k2"] * j * j
    astern = jnp.where(
        advance >= p["propeller.c10"],
        p["propeller.c6"] + p["propeller.c7"] * advance,
        p["propeller.c3"],
    )
    k_t = jnp.where(n > 0.0, ahead, astern)
    return k_t, jnp.where(n > 0.0, (1.0 - p["propeller.t"]) * ahead, astern)


def propeller(
    p: Mapping[str, Array],
    g: Geometry,
    screw: Propeller,
    u: Array,
    n: Array,
    effective: Array,
) -> Array:
    """X_P, Y_P, N_P [..., 3] at midship; `effective` is X_P/(ρD⁴n²). Nothing at n = 0."""
    nd = n * screw.diameter
    x = g.density * screw.diameter**2 * nd**2 * effective
    x = jnp.where(n == 0.0, 0.0, x)
    advance = u / jnp.where(n == 0.0, 1.0, nd)
    q = 0.5 * g.density * g.length * g.draught

    def side(letter: str) -> Array:
        c = [p[f"propeller.{letter}{i}"] for i in range(1, 9)]
        low, high = BREAKS
        astern = jnp.where(
            advance < low,
            c[2] + c[3] * advance,
            jnp.where(advance <= high, c[0] + c[1] * advance, c[4]),
        )
        braking = PITCH_RATIO**2 * (c[5] * advance**2 + c[6] * advance + c[7])
        return jnp.where(n < 0.0, astern, jnp.where((n > 0.0) & (u < 0.0), braking, 0.0))

    hand = jnp.where(screw.starboard < 0.0, -1.0, 1.0)  # screws of a pair turn against each other
    y = hand * q * nd**2 * side("a")
    turning = hand * q * g.length * nd**2 * side("b") - screw.starboard * x
    return jnp.stack((x, y, turning), axis=-1)


def slipstream(screw: Propeller, k_t: Array, n: Array) -> Array:
    """8 K_T n²D²/π [m²/s²], what momentum theory adds to the far jet's u²."""
    return 8.0 * k_t * (n * screw.diameter) ** 2 / np.pi
