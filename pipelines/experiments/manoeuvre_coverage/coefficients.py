"""Coefficients of the truths, in the model's names and units, where a truth has them.

Two kinds. Of the *same law*: masses, a screw's open water, wake, thrust deduction, and a rudder of
the MMG: the truth's equation has the same number in the same place. Of the *same derivative*: the
linear terms of a hull whose truth goes on with cubic terms, moduli or heel where the model has a
cross-flow drag. The number that makes the model's motion the truth's is then not exactly the
truth's derivative, and the tables keep these apart.

Primes of the truths are divided by ½ρL² or ½ρLd; the model's are by ½ρLd and ½ρL²d, with its own ρ.
"""

from __future__ import annotations

from collections.abc import Callable

from pipelines.experiments.other_families.ship import WATER, Ship
from pipelines.experiments.other_families.shipmmg_kvlcc2 import DENSITY

SAME_LAW, SAME_DERIVATIVE = "same law", "same derivative"


def true_coefficients(ship: Ship, density: float) -> dict[str, tuple[float, str]]:
    """name → value and kind. `density` of the model's water, kg/m³."""
    b = ship.body
    unit = 0.5 * density * b.length**2 * b.draught
    inertia = b.inertia + b.j_z - b.mass * b.gravity**2  # about the centre of gravity
    law = {"body.m_x": b.m_x / unit, "body.m_y": b.m_y / unit,
           "body.i_j": inertia / (unit * b.length**2)}  # fmt: skip
    more, derivative = OF_FAMILY[ship.family](ship, density)
    found = {name: (value, SAME_LAW) for name, value in (law | more).items()}
    return found | {name: (value, SAME_DERIVATIVE) for name, value in derivative.items()}


Two = tuple[dict[str, float], dict[str, float]]


def _abkowitz(ship: Ship, density: float) -> Two:
    """Its Coriolis terms have no added mass: the model's do, so that its derivatives have it."""
    c, b = ship.c, ship.body
    more = WATER / density * b.length / b.draught
    unit = 0.5 * density * b.length**2 * b.draught
    speed = ship.speed
    resistance = 0.5 * c.x_u * (speed / c.speed) ** (c.surge_power - 2.0)
    return {}, {
        "hull.x_0f": resistance * more, "hull.x_vr": -b.m_y / unit,
        "hull.y_v": c.y_v * more, "hull.y_r": c.y_r * more + b.m_x / unit,
        "hull.n_v": c.n_v * more, "hull.n_r": c.n_r * more,
    }  # fmt: skip


def _container(ship: Ship, density: float) -> Two:
    c, b = ship.c, ship.body
    more = WATER / density * b.length / b.draught
    lift = 6.13 * 1.8219 / (1.8219 + 2.25)  # of the source, at its aspect ratio
    law = {
        "propeller.k0": c.k_t0, "propeller.k1": c.k_t1, "propeller.k2": 0.0, "propeller.t": c.t,
        "propeller.w_p0": c.wake, "rudder.a_h": c.a_h, "rudder.x_h": c.x_h,
        "rudder.t_r": 1.0 - c.c_x, "rudder.eps": c.epsilon, "rudder.f_alpha": lift,
    }  # fmt: skip
    return law, {
        "hull.x_0f": c.x_uu * more, "hull.x_vr": c.x_vr * more, "hull.y_v": c.y_v * more,
        "hull.y_r": c.y_r * more, "hull.n_v": c.n_v * more, "hull.n_r": c.n_r * more,
    }  # fmt: skip


def _naval_vessel(ship: Ship, density: float) -> Two:
    """Its hull is in dimensions; its Coriolis terms have no added mass."""
    c, b = ship.c, ship.body
    force = 0.5 * density * b.length * b.draught
    unit = force * b.length
    return {}, {
        "hull.x_0f": c.x_uu / force, "hull.x_vr": (c.x_vr - b.m_y) / unit,
        "hull.y_v": c.y_v / force, "hull.y_r": (c.y_r + b.m_x) / unit,
        "hull.n_v": c.n_v / unit, "hull.n_r": c.n_r / (unit * b.length),
    }  # fmt: skip


def _shipmmg(ship: Ship, density: float) -> Two:
    p, h = ship.c.basic, ship.c.hull
    share = DENSITY / density
    law = {
        "propeller.k0": h["k_0"] * share, "propeller.k1": h["k_1"] * share,
        "propeller.k2": h["k_2"] * share, "propeller.t": p["t_P"], "propeller.w_p0": p["w_P0"],
        "rudder.t_r": p["t_R"], "rudder.a_h": p["a_H"], "rudder.x_h": p["x_H"] / p["L_pp"],
        "rudder.l_r": p["l_R"], "rudder.eps": p["ε"], "rudder.k_x": p["κ"] * p["ε"],
        "rudder.gamma_p": p["γ_R_minus"], "rudder.gamma_n": p["γ_R_plus"],
        "rudder.f_alpha": p["f_α"] * share,
    }  # fmt: skip
    return law, {
        "hull.x_0f": -h["R_0_dash"] * share, "hull.x_vr": h["X_vr_dash"] * share,
        "hull.y_v": h["Y_v_dash"] * share, "hull.y_r": h["Y_r_dash"] * share,
        "hull.n_v": h["N_v_dash"] * share, "hull.n_r": h["N_r_dash"] * share,
    }  # fmt: skip


OF_FAMILY: dict[str, Callable[[Ship, float], Two]] = {
    "abkowitz": _abkowitz, "container": _container, "naval_vessel": _naval_vessel,
    "shipmmg": _shipmmg,
}  # fmt: skip
