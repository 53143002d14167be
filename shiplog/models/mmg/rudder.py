"""A rudder in the slipstream: MMG's interaction form (Yasukawa & Yoshimura 2015), Kitagawa's
inflow for a reversed screw, Fujii's normal-force slope."""

from __future__ import annotations

from collections.abc import Mapping

from shiplog.machine.arrays import Array, jnp
from shiplog.models.mmg.geometry import Geometry, Propeller, Rudder
from shiplog.models.mmg.propeller import slipstream
from shiplog.models.mmg.safe_root import root


def ahead_inflow(
    p: Mapping[str, Array],
    blade: Rudder,
    screw: Propeller | None,
    u: Array,
    arriving: Array,
    k_t: Array,
    n: Array,
) -> Array:
    """u_R: what meets the blade from ahead [m/s].

    n > 0, K_T > 0:  ε √(η [u_P + κ (√(u_P² + 8K_T n²D²/π) - u_P)]² + (1 - η) u_P²),  κ = k_x/ε
    else, u ≥ 0:     sign(s) √|s|,  s = η sign(u_a) u_a² + (1 - η) u_b² + C_PR u²
    else:            u
    """
    eps = p["rudder.eps"]
    if screw is None:
        return jnp.where(u >= 0.0, eps * arriving * u, u)
    eta = jnp.minimum(screw.diameter / blade.span, 1.0)
    u_p = u * arriving
    jet = slipstream(screw, k_t, n)
    far = root(u_p**2 + jnp.maximum(jet, 0.0))
    inside = u_p + p["rudder.k_x"] / eps * (far - u_p)
    driven = eps * root(eta * inside**2 + (1.0 - eta) * u_p**2)
    u_b = eps * u_p
    u_a = u_b + jnp.sign(n) * p["rudder.k_xr"] * root(jnp.abs(jet))
    s = eta * jnp.sign(u_a) * u_a**2 + (1.0 - eta) * u_b**2 + p["rudder.c_pr"] * u * u
    coasting = jnp.sign(s) * root(jnp.abs(s))
    return jnp.where((n > 0.0) & (k_t > 0.0), driven, jnp.where(u >= 0.0, coasting, u))


def rudder(
    p: Mapping[str, Array],
    g: Geometry,
    blade: Rudder,
    u_r: Array,
    v: Array,
    r: Array,
    angle: Array,
) -> Array:
    """X_R, Y_R, N_R [..., 3] at midship.

    v_R = -γ (v + ℓ'_R L r), γ = γ_P where v + x_R r ≥ 0, else γ_N;  α_R = δ - atan2(v_R, u_R)
    F_N = ½ρA_R (u_R² + v_R²) f_α (1 + f₃ sin²α_R) sin α_R
    F_T = ½ρA_R (u_R² + v_R²) f_T (1 - cos α_R)
    X_R = (1 - t_R) (F_T cos δ - F_N sin δ), Y_R = -(1 + a_H) (F_N cos δ + F_T sin δ),
    N_R = (x_R + a_H x_H) Y_R / (1 + a_H)

    f₃, F_T and f_i are ours, without effect in the MMG. A fish-tail blade (Schilling, VecTwin)
    turns the jet until it leaves along its chord; by the balance of momentum J (Rankine) its
    force is then J sin α across and J (1 - cos α) along the chord. Of two blades, the one turned
    inboard works next to the other: its force is f_i times that of the one turned outboard.
    """
    gamma = jnp.where(v + blade.ahead * r >= 0.0, p["rudder.gamma_p"], p["rudder.gamma_n"])
    v_r = -gamma * (v + p["rudder.l_r"] * g.length * r)
    attack = angle - jnp.arctan2(v_r, jnp.where((u_r == 0.0) & (v_r == 0.0), 1.0, u_r))
    s, c = jnp.sin(attack), jnp.cos(attack)
    pressure = 0.5 * g.density * blade.area * (u_r**2 + v_r**2)
    if "rudder.inboard" in p:
        pressure = pressure * jnp.where(angle * blade.starboard < 0.0, p["rudder.inboard"], 1.0)
    normal = pressure * p["rudder.f_alpha"] * (1.0 + p["rudder.f_3"] * s * s) * s
    along = pressure * p["rudder.f_t"] * (1.0 - c)
    x = (1.0 - p["rudder.t_r"]) * (along * jnp.cos(angle) - normal * jnp.sin(angle))
    across = -(normal * jnp.cos(angle) + along * jnp.sin(angle))
    y = (1.0 + p["rudder.a_h"]) * across
    at = blade.ahead + p["rudder.a_h"] * p["rudder.x_h"] * g.length
    return jnp.stack((x, y, at * across - blade.starboard * x), axis=-1)
