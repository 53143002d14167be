"""The rigid body with added mass: forces to accelerations (Yasukawa & Yoshimura 2015)."""

from __future__ import annotations

from collections.abc import Mapping

from shiplog.machine.arrays import Array, jnp
from shiplog.models.mmg.geometry import Geometry


def masses(p: Mapping[str, Array], g: Geometry) -> tuple[Array, Array, Array]:
    """m_x, m_y [kg] and I + J [kg m²] about the centre of gravity."""
    unit = 0.5 * g.density * g.length**2 * g.draught
    return p["body.m_x"] * unit, p["body.m_y"] * unit, p["body.i_j"] * unit * g.length**2


def accelerations(
    p: Mapping[str, Array], g: Geometry, u: Array, v: Array, r: Array, force: Array
) -> Array:
    """u̇, v̇_m, ṙ [..., 3] of the force X, Y, N [..., 3] at midship.

    (m + m_x) u̇ - (m + m_y) v r - x_G m r² = X
    (m + m_y) v̇ + (m + m_x) u r + x_G m ṙ = Y
    (I + J + x_G² m) ṙ + x_G m (v̇ + u r) = N
    """
    m, moment = g.mass, g.x_g * g.mass
    m_x, m_y, yaw = masses(p, g)
    c = yaw + g.x_g**2 * m
    if "load.mass" in p:  # a load that stands at moment/mass; smooth where there is none
        load, turning = p["load.mass"], p["load.moment"]
        m, moment = m + load, moment + turning
        c = c + turning**2 * load / (load**2 + 1e-6 * g.mass**2)
    surge = (force[..., 0] + (m + m_y) * v * r + moment * r * r) / (m + m_x)
    a, b = m + m_y, moment
    across = force[..., 1] - (m + m_x) * u * r
    turning = force[..., 2] - b * u * r
    determinant = a * c - b * b
    sway = (c * across - b * turning) / determinant
    return jnp.stack((surge, sway, (a * turning - b * across) / determinant), axis=-1)


def forces_of(p: Mapping[str, Array], g: Geometry, acceleration: Array) -> Array:
    """The force X, Y, N [..., 3] at midship that adds this ν̇ [..., 3]: mass with added mass."""
    m, x_g = g.mass, g.x_g
    m_x, m_y, yaw = masses(p, g)
    du, dv, dr = (acceleration[..., i] for i in range(3))
    return jnp.stack(
        (
            (m + m_x) * du,
            (m + m_y) * dv + x_g * m * dr,
            x_g * m * dv + (yaw + x_g**2 * m) * dr,
        ),
        axis=-1,
    )
