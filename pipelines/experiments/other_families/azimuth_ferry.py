"""A small double-ended ferry with two or four azimuth thrusters, with wind.

Masses and damping: milliAmpere as identified by Pedersen (2019), a polynomial to the third order.
Own to each ferry: the exponents, the thrusters' law and how they lose with inflow.
"""

from __future__ import annotations

import math
from collections import namedtuple

import numpy as np
from numba import njit

from pipelines.experiments.other_families.ship import (
    Actuator,
    Body,
    Ship,
    Windage,
    about,
    draw_noise,
    draw_sensors,
    stream,
)

LENGTH, BREADTH, DRAUGHT = 5.0, 2.8, 0.45  # m, of milliAmpere
MASS = 1667.0  # kg, weighed
MASSES = {"m11": 2389.657, "m22": 2533.911, "m23": 45.3, "m33": 5068.910}  # m23: mean of 62.4, 28.1
DAMPING = {  # Pedersen (2019): X_u, X_|u|u, X_uuu, ...; N, m/s, rad/s
    "x_u": -27.632, "x_uu": -110.064, "x_uuu": -13.965,
    "y_v": -52.947, "y_vv": -116.486, "y_vvv": -24.313, "y_rv": -1540.383,
    "y_r": 24.732, "y_vr": 572.141, "y_rr": -115.457,
    "n_v": 3.525, "n_vv": -0.833, "n_rv": 336.827,
    "n_r": -122.860, "n_rr": -874.428, "n_vr": -121.957,
}  # fmt: skip
FULL_THRUST = 500.0  # N, of one of two thrusters
FULL_REVOLUTIONS = 16.0  # rev/s

Coefficients = namedtuple(
    "Coefficients",
    "x_u x_uu x_uuu y_v y_vv y_vvv y_rv y_r y_vr y_rr n_v n_vv n_rv n_r n_rr n_vr "
    "power scale half units thrust thrust_power reverse inflow full ahead starboard",
)


@njit
def forces(c, u, v, r, acting, gain, grow, cross, aside, out):
    """Acting: azimuth and revolutions of each unit in turn. A thruster pushes along its azimuth
    with k |n|^p, less with the inflow along it."""
    bend = (math.sqrt(u * u + v * v) / c.scale + 1e-9) ** (c.power - 2.0)
    turns = (abs(r) * c.half / c.scale + 1e-9) ** (c.power - 2.0)
    x = grow[0] * (c.x_u + bend * c.x_uu * abs(u) + c.x_uuu * u * u) * u
    k, k_yaw = bend * grow[3] * cross, turns * grow[3] * cross
    y = grow[1] * (c.y_v + c.y_vvv * v * v) * v + k * c.y_vv * abs(v) * v
    y += k_yaw * c.y_rv * abs(r) * v + c.y_r * r + k * (c.y_vr * abs(v) + c.y_rr * abs(r)) * r
    n = grow[2] * c.n_r * r + k_yaw * c.n_rr * abs(r) * r + c.n_v * v + k * c.n_vv * abs(v) * v
    n += k * (c.n_rv * abs(r) * v + c.n_vr * abs(v) * r)
    for i in range(len(c.ahead)):
        angle, share = acting[2 * i], acting[2 * i + 1] / c.full
        cos, sin = math.cos(angle), math.sin(angle)
        flow = (u - c.starboard[i] * r) * cos + (v + c.ahead[i] * r) * sin
        thrust = abs(share) ** (c.thrust_power - 1.0) * share * c.thrust
        if share < 0.0:
            thrust *= c.reverse
        thrust = (thrust - c.inflow * abs(share) * flow) * gain[i]
        along, athwart = thrust * (cos - aside * sin), thrust * (sin + aside * cos)
        x += along
        y += athwart
        n += c.ahead[i] * athwart - c.starboard[i] * along
    out[0], out[1], out[2] = x, y, n


def draw(seed: int) -> Ship:
    """4 to 12 m, scaled by Froude's law; two units on the centreline or four at the corners."""
    rng = stream(seed, "azimuth_ferry")
    length = float(rng.uniform(4.0, 12.0))
    s = length / LENGTH
    root = math.sqrt(s)
    four = bool(rng.random() < 0.5)
    # Froude: force s³, moment s⁴, speed √s, yaw rate 1/√s
    power = {"u": root, "v": root, "r": 1.0 / root}
    damping = {}
    for name, value in DAMPING.items():
        axis, _, terms = name.partition("_")
        unit = s**4 if axis == "n" else s**3
        for letter in terms:
            unit /= power[letter]
        damping[name] = about(rng, value) * unit
    mass = about(rng, MASS, 0.05) * s**3
    m = {k: about(rng, v, 0.08) for k, v in MASSES.items()}
    inertia = mass * (0.27 * length) ** 2
    gravity = rng.uniform(-0.01, 0.01) * length
    body = Body(
        mass=mass, gravity=gravity, inertia=inertia, m_x=m["m11"] * s**3 - mass,
        m_y=m["m22"] * s**3 - mass, m_yr=m["m23"] * s**4 - mass * gravity,
        j_z=m["m33"] * s**5 - inertia, added=1.0, munk=1.0, length=length, breadth=BREADTH * s,
        draught=DRAUGHT * s,
    )  # fmt: skip
    at, apart = 0.36 * length, 0.16 * length
    ahead = (at, at, -at, -at) if four else (at, -at)
    starboard = (-apart, apart, apart, -apart) if four else (0.0, 0.0)
    full, harbour = FULL_REVOLUTIONS / root, rng.uniform(0.9, 1.2) * root
    thrust = about(rng, FULL_THRUST) * s**3 * (0.5 if four else 1.0)
    c = Coefficients(
        power=rng.uniform(1.8, 2.05), scale=harbour, half=0.5 * length,
        units=float(len(ahead)), thrust=thrust, thrust_power=rng.uniform(1.7, 2.0),
        reverse=rng.uniform(0.6, 0.9), inflow=rng.uniform(0.08, 0.2) * thrust / harbour,
        full=full, ahead=np.array(ahead), starboard=np.array(starboard), **damping,
    )  # fmt: skip
    lateral = rng.uniform(1.4, 2.2) * length * 1.0 * s
    windage = Windage(
        rng.uniform(0.5, 0.6) * lateral, lateral, rng.uniform(0.55, 0.75), rng.uniform(0.85, 1.0),
        rng.uniform(0.3, 0.6), rng.uniform(-0.04, 0.04) * length, length,
    )  # fmt: skip
    return Ship(
        family="azimuth_ferry", name="Double-ended ferry", body=body, speed=harbour,
        radius=9.0 * length, step=0.05, actuators=_actuators(c, rng), mixer=_mixer(c),
        noise=draw_noise(rng, length, harbour), sensors=draw_sensors(rng, length), forces=forces,
        c=c, windage=windage, crabs=True, spins=True, cross_flow=True,
    )  # fmt: skip


def _actuators(c: Coefficients, rng: np.random.Generator) -> tuple[Actuator, ...]:
    found = []
    swing, slow = math.radians(rng.uniform(25.0, 60.0)), rng.uniform(0.3, 0.8)
    for i, at in enumerate(zip(c.ahead, c.starboard, strict=True)):
        place = (round(at[0], 2), round(at[1], 2))
        found += [
            Actuator(f"azimuth_{i + 1}", "azimuth", -math.pi, math.pi, place, 0.3, swing),
            Actuator(
                f"thruster_{i + 1}", "thruster", -c.full, c.full, place, slow, c.full, drive=i
            ),
        ]
    return tuple(found)


def _mixer(c: Coefficients):
    """The wanted force at each end, as azimuth and revolutions of the units there."""

    def mixer(surge: float, turn: float, side: float) -> np.ndarray:
        order = []
        for ahead in c.ahead:
            along = 0.35 * surge
            athwart = 0.45 * side + 0.16 * turn * math.copysign(1.0, ahead)
            share = min(math.hypot(along, athwart), 1.0)
            angle = math.atan2(athwart, along) if share > 0.02 else 0.0
            order += [angle, c.full * math.sqrt(share)]
        return np.array(order)

    return mixer
