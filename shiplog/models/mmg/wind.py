"""Wind force: the harmonics of Fujiwara, Ueno & Nimura 1998 on the apparent wind."""

from __future__ import annotations

from collections.abc import Mapping

from shiplog.machine.arrays import Array, jnp
from shiplog.models.mmg.geometry import AIR, Geometry
from shiplog.models.mmg.safe_root import root
from shiplog.nomenclature.frames import in_body_axes


def apparent(true_wind: Array, heading: Array, u: Array, v: Array) -> tuple[Array, Array]:
    """U_A (cos γ_A, sin γ_A): where the wind comes from, ahead and to starboard [m/s].

    true_wind   [..., 2] where it comes FROM, along x₀ and y₀ [m/s]

    U_A cos γ_A = U_T cos(γ_T - ψ) + u,  U_A sin γ_A = U_T sin(γ_T - ψ) + v
    """
    c, s = jnp.cos(heading), jnp.sin(heading)
    ahead, starboard = in_body_axes(true_wind[..., 0], true_wind[..., 1], c, s)
    return ahead + u, starboard + v


def wind(p: Mapping[str, Array], g: Geometry, ahead: Array, starboard: Array) -> Array:
    """X_A, Y_A, N_A [..., 3]; g = -γ_A, q_A = ½ρ_A U_A².

    X_A = q_A A_T (X₀ + X₁ cos g + X₃ cos 3g + X₅ cos 5g)
    Y_A = q_A A_L (Y₁ sin g + Y₃ sin 3g + Y₅ sin 5g)
    N_A = q_A A_L L (N₁ sin g + N₂ sin 2g + N₃ sin 3g)
    """
    square = ahead * ahead + starboard * starboard
    total = root(square)
    c, s = ahead / total, -starboard / total
    pressure = 0.5 * AIR * square
    cos3, cos5 = c * (4.0 * c**2 - 3.0), c * (16.0 * c**4 - 20.0 * c**2 + 5.0)
    sin3, sin5 = s * (4.0 * c**2 - 1.0), s * (16.0 * c**4 - 12.0 * c**2 + 1.0)
    x = p["wind.x0"] + p["wind.x1"] * c + p["wind.x3"] * cos3 + p["wind.x5"] * cos5
    y = p["wind.y1"] * s + p["wind.y3"] * sin3 + p["wind.y5"] * sin5
    n = p["wind.n1"] * s + p["wind.n2"] * 2.0 * s * c + p["wind.n3"] * sin3
    area = pressure * g.lateral_area
    return jnp.stack((pressure * g.frontal_area * x, area * y, area * g.length * n), axis=-1)
