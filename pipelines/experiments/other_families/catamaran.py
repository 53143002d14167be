"""A catamaran USV with two fixed thrusters and no rudder.

Masses, damping and thrusters after the Otter (Fossen 2021; Maritime Robotics): linear surge and yaw
damping, quadratic yaw, cross-flow drag by strip theory (Faltinsen 1990) on both hulls. Own to each
boat: the exponents of cross flow and thrust.
"""

from __future__ import annotations

import math
from collections import namedtuple

import numpy as np
from numba import njit

from pipelines.experiments.other_families.ship import (
    WATER,
    Actuator,
    Body,
    Ship,
    about,
    draw_noise,
    draw_sensors,
    stream,
)

LENGTH, BREADTH, MASS = 2.0, 1.08, 55.0  # of the Otter, m and kg, without its payload
PAYLOAD = 25.0  # kg
FULL_SPEED = 6.0 * 0.5144  # m/s
PULL = 24.4 * 9.81  # N, both thrusters at full
ADDED = {"m_x": 0.1, "m_y": 1.5, "j_z": 0.7}  # shares of mass and inertia
YAW_TIME = 1.0  # s
QUADRATIC_YAW = 10.0  # of the linear damping, per rad/s
REVERSE = 0.01289 / 0.02216  # thrust astern over ahead at the same revolutions
HULL_BREADTH = 0.25  # m, of one pontoon

Coefficients = namedtuple(
    "Coefficients",
    "length draught surge surge_quadratic surge_power sway yaw yaw_quadratic drag drag_power ends "
    "scale pull power reverse advance at apart full",
)


@njit
def forces(c, u, v, r, acting, gain, grow, cross, aside, out):
    """Thrusters: T = k |n|^p sign(n), other factors ahead and astern, less with inflow."""
    x = -grow[0] * (c.surge * u + c.surge_quadratic * abs(u) ** (c.surge_power - 1.0) * u)
    y = -grow[1] * c.sway * v
    n = -grow[2] * (c.yaw * r + c.yaw_quadratic * abs(r) * r)
    drag = 2.0 * 0.5 * WATER * c.draught * c.drag * grow[3] * cross * c.length / 12.0
    for i in range(12):
        xi = ((i + 0.5) / 12.0 - 0.5) * c.length
        across = v + xi * r
        one = drag * (1.0 - c.ends * (2.0 * xi / c.length) ** 4)
        one *= (
            (abs(across) / c.scale) ** (c.drag_power - 2.0) * abs(across) * across
            if (across != 0.0)
            else 0.0
        )
        y -= one
        n -= one * xi
    for i in range(2):
        side = -c.apart if i == 0 else c.apart
        share = acting[i] / c.full
        thrust = c.pull * abs(share) ** (c.power - 1.0) * share
        if share < 0.0:
            thrust *= c.reverse
        thrust = (thrust - c.advance * abs(share) * u) * gain[i]
        x += thrust
        y += aside * thrust
        n += -thrust * side + aside * thrust * c.at
    out[0], out[1], out[2] = x, y, n


def draw(seed: int) -> Ship:
    """1.4 to 6 m, the Otter scaled by Froude's law."""
    rng = stream(seed, "catamaran")
    length = float(rng.uniform(1.4, 6.0))
    scale = length / LENGTH
    mass = about(rng, MASS + rng.uniform(0.3, 1.0) * PAYLOAD, 0.1) * scale**3
    breadth = BREADTH * scale
    inertia = mass * (rng.uniform(0.24, 0.3) * length) ** 2 + mass * (0.4 * breadth) ** 2
    gravity = rng.uniform(0.0, 0.06) * length
    draught = mass / (2.0 * WATER * 0.5 * HULL_BREADTH * scale * length)
    yaw_mass = inertia * (1.0 + ADDED["j_z"])
    body = Body(
        mass=mass, gravity=gravity, inertia=inertia + mass * gravity**2,
        m_x=about(rng, ADDED["m_x"]) * mass, m_y=about(rng, ADDED["m_y"]) * mass, m_yr=0.0,
        j_z=about(rng, ADDED["j_z"]) * inertia, added=1.0, munk=rng.uniform(0.0, 0.05),
        length=length, breadth=breadth, draught=draught,
    )  # fmt: skip
    top, pull = FULL_SPEED * math.sqrt(scale), PULL * scale**3
    yaw = about(rng, 1.0) * yaw_mass / (YAW_TIME * math.sqrt(scale))
    linear = rng.uniform(0.4, 0.8)
    power = rng.uniform(1.7, 2.0)
    full = float(rng.uniform(14.0, 18.0) / math.sqrt(scale))
    harbour = 0.4 * top
    c = Coefficients(
        length=length, draught=draught, surge=linear * pull / top,
        surge_quadratic=(1.0 - linear) * pull / top**power, surge_power=power,
        sway=rng.uniform(0.4, 0.9) * pull / top, yaw=yaw,
        yaw_quadratic=about(rng, QUADRATIC_YAW) * yaw * math.sqrt(scale) * 0.3,
        drag=rng.uniform(0.5, 1.0), drag_power=rng.uniform(1.7, 2.0), ends=rng.uniform(0.0, 0.4),
        scale=harbour, pull=0.6 * pull, power=rng.uniform(1.7, 2.1), reverse=about(rng, REVERSE),
        advance=0.1 * pull / top, at=-0.4 * length, apart=0.366 * breadth, full=full,
    )  # fmt: skip
    actuators = tuple(
        Actuator(
            f"thruster_{side}", "thruster", -full, full,
            (round(c.at, 2), round(sign * c.apart, 3)), rng.uniform(0.1, 0.3), 2.0 * full, drive=i,
        )
        for i, (side, sign) in enumerate((("port", -1.0), ("starboard", 1.0)))
    )  # fmt: skip

    def mixer(surge: float, turn: float, side: float) -> np.ndarray:
        twist = 0.42 * turn
        shares = np.clip((0.4 * surge + twist, 0.4 * surge - twist), -1.0, 1.0)
        return full * np.sign(shares) * np.sqrt(np.abs(shares))

    return Ship(
        family="catamaran", name="Catamaran USV", body=body, speed=harbour, radius=14.0 * length,
        step=0.05, actuators=actuators, mixer=mixer, noise=draw_noise(rng, length, harbour),
        sensors=draw_sensors(rng, length), forces=forces, c=c, spins=True, cross_flow=True,
    )  # fmt: skip
