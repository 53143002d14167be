"""Hull force at low speed: Yoshimura, Nakao & Ishibashi 2009, with cross-flow drag, and the linear
damping of a ship that barely moves (Fossen 2011)."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from shiplog.machine.arrays import Array, jnp
from shiplog.models.mmg.estimate import GRAVITY
from shiplog.models.mmg.geometry import Geometry
from shiplog.models.mmg.safe_root import speed


def hull(p: Mapping[str, Array], g: Geometry, u: Array, v: Array, r: Array) -> Array:
    """X_H, Y_H, N_H [..., 3] in N and N m at midship, of velocities through the water.

    X_H = q [(X'₀F + (X'₀A - X'₀F) |β|/π) u U + X'_vr L v r],  q = ½ρLd
    Y_H = q [Y'_v v |u| + Y'_r L r u - C_D ∫ |w_Y| w_Y dξ]
    N_H = q L [N'_v v u + N'_r L r |u| - C_D ∫ |w_N| w_N ξ dξ],  w = v + C_r L r ξ

    Resistance from straight ahead to straight astern goes with the drift angle β; linear damping
    acts both ways; cross terms change sign astern. To these `linear` damping is added.
    """
    q = 0.5 * g.density * g.length * g.draught
    lr = g.length * r
    total = speed(u, v)
    drift = jnp.abs(jnp.arctan2(v, jnp.where((u == 0.0) & (v == 0.0), 1.0, u)))
    straight = p["hull.x_0f"] + (p["hull.x_0a"] - p["hull.x_0f"]) * drift / np.pi
    x = q * (straight * u * total + p["hull.x_vr"] * v * lr)
    across, _ = cross_flow(v, p["hull.c_ry"] * lr)
    _, turning = cross_flow(v, p["hull.c_rn"] * lr)
    y = q * (p["hull.y_v"] * v * jnp.abs(u) + p["hull.y_r"] * lr * u - p["hull.c_d"] * across)
    n = (
        q
        * g.length
        * (p["hull.n_v"] * v * u + p["hull.n_r"] * lr * jnp.abs(u) - p["hull.c_d"] * turning)
    )
    return jnp.stack((x, y, n), axis=-1) + linear(p, g, u, v, r)


def linear(p: Mapping[str, Array], g: Geometry, u: Array, v: Array, r: Array) -> Array:
    """Damping [..., 3] in N and N m that is proportional to velocity and does not need headway.

    X = q √(gL) X'_u u,  Y = q √(gL) (Y'_vL v + Y'_rL L r),  N = q L √(gL) (N'_vL v + N'_rL L r)

    Linear damping at low speed, as dynamic positioning has it (Fossen 2011, Sec. 6.4). The speed
    that makes it non-dimensional is the Bis system's √(gL), since the ship's own may be zero:
    X'_u = -m' D''₁₁ of the D'' in Fossen, Sagatun & Sørensen 1996, m' = m/(½ρL²d), and so on.
    """
    wave = jnp.sqrt(GRAVITY * g.length)
    q = 0.5 * g.density * g.length * g.draught * wave
    lr = g.length * r
    x = q * p["hull.x_u"] * u
    y = q * (p["hull.y_vl"] * v + p["hull.y_rl"] * lr)
    n = q * g.length * (p["hull.n_vl"] * v + p["hull.n_rl"] * lr)
    return jnp.stack((x, y, n), axis=-1)


def cross_flow(v: Array, a: Array) -> tuple[Array, Array]:
    """∫ |w| w dξ and ∫ |w| w ξ dξ over ξ from -½ to ½ of w = v + a ξ, in closed form.

    Where w keeps its sign along the hull the integrals are polynomials; where the ship turns
    faster than it drifts, w changes sign at ξ = -v/a and both sides are integrated.
    """
    turns = jnp.abs(a) > 2.0 * jnp.abs(v)
    slope = jnp.where(turns, a, 1.0)
    bow, stern = v + 0.5 * a, v - 0.5 * a
    bow3, stern3 = jnp.abs(bow) ** 3, jnp.abs(stern) ** 3
    moment = (bow * bow3 - stern * stern3) / 4.0 - v * (bow3 - stern3) / 3.0
    force = jnp.where(turns, (bow3 - stern3) / (3.0 * slope), _signed_square(v, a))
    return force, jnp.where(turns, moment / slope**2, jnp.abs(v) * a / 6.0)


def _signed_square(v: Array, a: Array) -> Array:
    return jnp.abs(v) * v + jnp.sign(v) * a * a / 12.0
