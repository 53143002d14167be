"""A small naval vessel with two screws and two rudders, in four degrees of freedom.

Hull: Blanke & Christensen (1993), as Perez (2005) has it and Fossen's MSS (`navalvessel.m`):
modulus forms in dimensions, 51.5 m at 8 m/s. They hold ahead (`roll.ahead_share`); at no speed a
cross-flow drag takes over. Its screws and rudders are not in that source. A screw has
T = k n|n| - a |n| u (Blanke 1981). A rudder has the lift slope and the stall of the source,
½ρ A C_L V², V² = u² + c 2T/(ρ A_0) with a share c of its screw's race (momentum theory).
"""

from __future__ import annotations

import math
from collections import namedtuple

import numpy as np
from numba import njit

from pipelines.experiments.other_families.roll import Roll, ahead_share, cross_flow
from pipelines.experiments.other_families.ship import (
    WATER,
    Actuator,
    Body,
    Ship,
    Windage,
    about,
    draw_noise,
    draw_sensors,
    stream,
)

LENGTH, BREADTH, DRAUGHT = 51.5, 8.6, 2.3  # m
MASS = 357.0 * 1014.0  # kg
INERTIA_Z, INERTIA_X = 47.934e6, 2.3763e6  # kg m²
GRAVITY = (-3.38, -1.06)  # m, x_G and z_G
METACENTRIC = 1.1  # m, GM
ADDED = {  # kg, kg m, kg m²
    "x_du": -17400.0, "y_dv": -393000.0, "y_dp": -296000.0, "y_dr": -1400000.0,
    "k_dv": 296000.0, "k_dp": -774000.0, "n_dv": 538000.0, "n_dr": -38.7e6,
}  # fmt: skip
HULL = {  # N, N m over the motions' products, in m/s and rad/s; f is φ
    "x_uu": -1960.0, "x_vr": 0.33 * MASS,
    "y_v": -11800.0, "y_r": 131000.0, "y_vv": -3700.0, "y_vr": -794000.0, "y_rv": -182000.0,
    "y_fv": 10800.0, "y_fr": 251000.0, "y_fu": -74.0,
    "k_v": 9260.0, "k_r": -102000.0, "k_vv": 29300.0, "k_vr": 621000.0, "k_rv": 142000.0,
    "k_fv": -8400.0, "k_fr": -196000.0, "k_fu": -1180.0, "k_up": -15500.0, "k_pp": -416000.0,
    "k_p": -500000.0, "k_fff": -0.325 * MASS * 9.81,
    "n_v": -92000.0, "n_r": -4710000.0, "n_rr": -202e6, "n_rv": -15.6e6, "n_fr": -4980000.0,
    "n_fu": -8000.0,
}  # fmt: skip
LIFT_SLOPE, STALL = 0.054 * 180.0 / math.pi, math.radians(23.0)  # 1/rad, rad
RUDDER_AREA, RUDDER_SPAN, DIAMETER = 1.5, 1.5, 1.6  # m², m, m, of each
HARBOUR, TOP = 3.2, 5.8  # m/s, of the published ship: typical, and full ahead in a harbour

Coefficients = namedtuple(
    "Coefficients",
    [*HULL, "length", "draught", "righting", "drag", "screw", "advance", "reverse", "full", "disc",
     "race", "area", "at", "apart", "below"],
)  # fmt: skip


@njit
def lift(attack):
    """C_L: straight to the stall, and as the sine of twice the angle beyond."""
    steep = abs(attack)
    if steep <= STALL:
        return LIFT_SLOPE * attack
    most = LIFT_SLOPE * STALL
    fade = max(math.sin(2.0 * min(steep, 0.5 * math.pi)) / math.sin(2.0 * STALL), 0.0)
    return math.copysign(most * min(fade, 1.0), attack)


@njit
def forces(c, u, v, r, phi, p, acting, gain, grow, cross, aside, out):
    """X, Y, N, K at midship into `out` [4]. Acting: rudders port and starboard, then screws."""
    near = ahead_share(u, v, c.length * r)
    ahead = abs(u)
    x = grow[0] * c.x_uu * u * ahead + c.x_vr * v * r
    y = grow[1] * c.y_v * ahead * v + c.y_r * u * r
    y += near * (c.y_vv * v * abs(v) + c.y_vr * v * abs(r) + c.y_rv * r * abs(v))
    y += near * phi * (c.y_fv * abs(u * v) + c.y_fr * abs(u * r) + c.y_fu * u * u)
    k = c.k_v * ahead * v + c.k_r * u * r
    k += near * (c.k_vv * v * abs(v) + c.k_vr * v * abs(r) + c.k_rv * r * abs(v))
    k += near * phi * (c.k_fv * abs(u * v) + c.k_fr * abs(u * r) + c.k_fu * u * u)
    k += c.k_up * ahead * p + c.k_pp * p * abs(p) + c.k_p * p + c.k_fff * phi**3
    k -= c.righting * phi
    n = c.n_v * u * v + grow[2] * (c.n_r * ahead * r + near * c.n_rr * r * abs(r))
    n += near * (c.n_rv * r * abs(v) + phi * u * (c.n_fr * abs(r) + c.n_fu * ahead))
    drag_y, drag_n = cross_flow(c.length, c.draught, c.drag, v, r)
    beyond = (1.0 - near) * grow[3] * cross
    y, n = y + beyond * drag_y, n + beyond * drag_n
    for i in range(2):
        side = -c.apart if i == 0 else c.apart
        turns = acting[2 + i] / c.full
        thrust = c.screw * turns * abs(turns) - c.advance * abs(turns) * u
        if turns < 0.0:
            thrust *= c.reverse
        thrust *= gain[i]
        flow = u * abs(u) + c.race * max(thrust, 0.0) * 2.0 / (WATER * c.disc)
        drift = math.atan2(v + c.at * r, math.sqrt(abs(flow)) + 1e-3) if flow > 0.0 else 0.0
        attack = acting[i] + 0.5 * drift
        push = -0.5 * WATER * c.area * flow * lift(attack)
        induced = 0.25 * 0.5 * WATER * c.area * abs(flow) * lift(attack) ** 2
        x += thrust - math.copysign(induced, u)
        push += aside * thrust
        y += push
        n += c.at * push - side * thrust
        k -= c.below * push
    out[0], out[1], out[2], out[3] = x, y, n, k


def draw(seed: int) -> Ship:
    """35 to 80 m by Froude's law; its derivatives within 12 % of the published ones."""
    rng = stream(seed, "naval_vessel")
    return sister(rng, float(rng.uniform(35.0, 80.0)), 0.12)


def sister(rng: np.random.Generator, length: float, spread: float) -> Ship:
    """`spread` 0 and 51.5 m are the published hull."""
    s = length / LENGTH
    root = math.sqrt(s)
    units = {"u": root, "v": root, "r": 1.0 / root, "p": 1.0 / root, "f": 1.0}
    hull = {}
    for name, value in HULL.items():
        axis, _, terms = name.partition("_")
        unit = s**3 if axis in "xy" else s**4
        for letter in terms if len(terms) > 1 or name == "k_p" else f"u{terms}":
            unit /= units[letter]  # y_v is Y_|u|v; y_fv is Y_φ|uv|
        if name in ("y_fv", "y_fr", "k_fv", "k_fr", "n_fr", "y_fu", "k_fu", "n_fu"):
            unit /= units["u"]
        hull[name] = about(rng, value, spread) * unit
    mass = about(rng, MASS, 0.5 * spread) * s**3
    added = {k: about(rng, v, 0.5 * spread) for k, v in ADDED.items()}
    x_g, z_g = GRAVITY[0] * s, GRAVITY[1] * s
    inertia_x, inertia_z = INERTIA_X * s**5, INERTIA_Z * s**5
    three, four, five = s**3, s**4, s**5
    matrix = np.array([
        [mass - added["y_dv"] * three, -mass * z_g - added["y_dp"] * four,
         mass * x_g - added["y_dr"] * four],
        [-mass * z_g - added["k_dv"] * four, inertia_x - added["k_dp"] * five, 0.0],
        [mass * x_g - added["n_dv"] * four, 0.0, inertia_z - added["n_dr"] * five],
    ])  # fmt: skip
    top, harbour = TOP * root, HARBOUR * root
    resistance = -hull["x_uu"] * top**2
    bollard = 0.5 * resistance / about(rng, 0.6, 0.1)  # of each; 60 % are left at full speed
    full = float(rng.uniform(4.0, 6.0) / root)
    diameter = DIAMETER * s
    c = Coefficients(
        **hull, length=length, draught=DRAUGHT * s, righting=mass * 9.81 * METACENTRIC * s,
        drag=rng.uniform(0.6, 0.9), screw=bollard, advance=(bollard - 0.5 * resistance) / top,
        reverse=rng.uniform(0.6, 0.8), full=full, disc=0.25 * math.pi * diameter**2,
        race=rng.uniform(0.5, 0.8), area=RUDDER_AREA * s**2, at=-0.45 * length,
        apart=0.2 * BREADTH * s, below=1.4 * s,
    )  # fmt: skip
    body = Body(
        mass=mass, gravity=x_g, inertia=inertia_z, m_x=-added["x_du"] * three,
        m_y=-added["y_dv"] * three, m_yr=-added["y_dr"] * four, j_z=-added["n_dr"] * five,
        added=0.0, munk=0.0, length=length, breadth=BREADTH * s, draught=DRAUGHT * s,
    )  # fmt: skip
    lateral = rng.uniform(3.6, 5.0) * length * s
    windage = Windage(
        rng.uniform(0.2, 0.3) * lateral, lateral, rng.uniform(0.5, 0.7), rng.uniform(0.8, 0.95),
        rng.uniform(0.5, 0.7), rng.uniform(0.0, 0.08) * length, length,
    )  # fmt: skip
    return Ship(
        family="naval_vessel", name="Patrol vessel", body=body, speed=harbour,
        radius=14.0 * length, step=0.05, actuators=_actuators(c, s, diameter, rng),
        mixer=_mixer(full), noise=draw_noise(rng, length, harbour),
        sensors=draw_sensors(rng, length), forces=forces, c=c, windage=windage, spins=True,
        cross_flow=True, roll=Roll(matrix, z_g, 3.0 * s),
    )  # fmt: skip


def _actuators(
    c: Coefficients, s: float, diameter: float, rng: np.random.Generator
) -> tuple[Actuator, ...]:
    most, swing, slow = math.radians(35.0), rng.uniform(3.5, 8.0), rng.uniform(1.0, 3.0)
    blade = {"area_m2": round(c.area, 2), "span_m": round(RUDDER_SPAN * s, 2)}
    apart = round(c.apart, 2)
    sides = (("port", -apart), ("starboard", apart))
    rudders = tuple(
        Actuator(
            f"rudder_{side}", "rudder", -most, most, (round(-0.48 * c.length, 1), at), 1.0,
            math.radians(swing), particulars=blade,
        )
        for side, at in sides
    )  # fmt: skip
    screws = tuple(
        Actuator(
            f"propeller_{side}", "propeller", round(-c.full, 2), round(c.full, 2),
            (round(c.at, 1), at), slow, 0.3 * c.full, drive=i,
            particulars={"diameter_m": round(diameter, 2)},
        )
        for i, (side, at) in enumerate(sides)
    )  # fmt: skip
    return rudders + screws


def _mixer(full: float):
    """In a turn the inner screw turns less, and the outer rudder is laid less; at rest the screws
    alone turn the ship."""

    def mixer(surge: float, turn: float, side: float) -> np.ndarray:
        twist = 0.6 * turn * (1.0 - 0.7 * abs(surge))
        angle = turn * math.radians(35.0)
        outer = angle * (1.0 - 0.12 * abs(turn))
        return np.array([
            outer if turn > 0.0 else angle, angle if turn > 0.0 else outer,
            full * max(min(surge + twist, 1.0), -1.0), full * max(min(surge - twist, 1.0), -1.0),
        ])  # fmt: skip

    return mixer
