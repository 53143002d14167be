"""A supply vessel at low speed: linear damping in sway and yaw, surge nearly quadratic.

Masses and linear damping: Fossen, Sagatun & Sørensen (1996), in the bis system (Fossen 2011, sec.
7.2.5: lengths by L, time by √(L/g)). Surge damping: quadratic with an exponent of the ship, equal
to the published linear one at some 2 m/s. Two screws, with or without rudders, and a bow thruster.
"""

from __future__ import annotations

import math
from collections import namedtuple

import numpy as np
from numba import njit

from pipelines.experiments.other_families.ship import (
    NO_WINDAGE,
    Actuator,
    Body,
    Ship,
    Windage,
    about,
    draw_noise,
    draw_sensors,
    stream,
)

GRAVITY = 9.81  # m/s²
MASS_BIS = {"m11": 1.1274, "m22": 1.8902, "m23": -0.0744, "m33": 0.1278}
DAMPING_BIS = {"d11": 0.0358, "d22": 0.1183, "d23": -0.0124, "d32": -0.0041, "d33": 0.0308}
RIGID = {"m11": 1.0, "m33": 0.063}  # of the diagonal; the rest is added mass (k_zz = 0.25 L)

Coefficients = namedtuple(
    "Coefficients",
    "surge surge_linear surge_power d22 d23 d32 d33 screw power astern advance apart screw_at "
    "bow bow_at bow_fades rudder_lift rudder_drag rudder_at rudders full",
)


@njit
def forces(c, u, v, r, acting, gain, grow, cross, aside, out):
    """Screws: T = k |n|^p sign(n), less with advance (form of Fossen 2021, eq. 9.11). Bow tunnel:
    fades as exp(-(u/u_c)²) with headway (Brix 1993). Rudders: lift and drag from the thrust of
    their own screw, ahead only (Lindegaard & Fossen 2003)."""
    ahead = abs(u)
    x = -grow[0] * (c.surge_linear * u + c.surge * ahead ** (c.surge_power - 1.0) * u)
    y = -grow[1] * (c.d22 * v + c.d23 * r)
    n = -grow[2] * (c.d32 * v + c.d33 * r)
    bow = acting[0] / c.full
    tunnel = (
        c.bow * abs(bow) ** (c.power - 1.0) * bow * gain[0] * math.exp(-((u / c.bow_fades) ** 2))
    )
    y += tunnel
    n += tunnel * c.bow_at
    for i in range(2):
        side = -c.apart if i == 0 else c.apart
        turns = acting[1 + i] / c.full
        thrust = c.screw * abs(turns) ** (c.power - 1.0) * turns - c.advance * abs(turns) * u
        if turns < 0.0:
            thrust *= c.astern
        thrust *= gain[1 + i]
        lift = aside * thrust
        if c.rudders > 0.0 and thrust > 0.0:
            angle = acting[3 + i]
            lift -= c.rudder_lift * angle * thrust
            x -= c.rudder_drag * angle * angle * thrust
        x += thrust
        y += lift
        n += lift * c.rudder_at - thrust * side
    out[0], out[1], out[2] = x, y, n


def draw(seed: int) -> Ship:
    """45 to 110 m, with rudders in half of the cases and wind in two of three."""
    rng = stream(seed, "linear_dp")
    length = float(rng.uniform(45.0, 110.0))
    breadth, draught = 0.247 * length, 0.082 * length  # as 18.8 m and 6.25 m on 76.2 m
    mass = about(rng, 6.4e6, 0.1) * (length / 76.2) ** 3
    bis = {k: about(rng, v, 0.1) for k, v in (MASS_BIS | DAMPING_BIS).items()}
    rate = math.sqrt(GRAVITY / length)
    gravity = -rng.uniform(0.005, 0.025) * length
    body = Body(
        mass=mass, gravity=gravity, inertia=RIGID["m33"] * mass * length**2,
        m_x=(bis["m11"] - RIGID["m11"]) * mass, m_y=(bis["m22"] - 1.0) * mass,
        m_yr=bis["m23"] * mass * length - mass * gravity,
        j_z=(bis["m33"] - RIGID["m33"]) * mass * length**2,
        added=1.0, munk=float(rng.uniform(0.0, 0.2)), length=length, breadth=breadth,
        draught=draught,
    )  # fmt: skip
    speed, power = 0.075 * math.sqrt(GRAVITY * length), rng.uniform(1.75, 2.0)
    d11 = bis["d11"] * mass * rate
    linear = rng.uniform(0.1, 0.3)
    surge = (1.0 - linear) * d11 * (1.4 * speed) ** (1.0 - power)
    full_thrust = 1.1 * d11 * 1.7 * speed  # both screws at full: some 1.7 times harbour speed
    rudders = bool(rng.random() < 0.5)
    full = float(rng.uniform(2.0, 3.5))
    screw_at, apart = -0.45 * length, 0.11 * length
    c = Coefficients(
        surge=surge, surge_linear=linear * d11, surge_power=power,
        d22=bis["d22"] * mass * rate, d23=bis["d23"] * mass * length * rate,
        d32=bis["d32"] * mass * length * rate, d33=bis["d33"] * mass * length**2 * rate,
        screw=0.8 * full_thrust, power=rng.uniform(1.7, 2.0), astern=rng.uniform(0.6, 0.85),
        advance=0.2 * full_thrust / (2.0 * speed), apart=apart, screw_at=screw_at,
        bow=rng.uniform(0.35, 0.6) * full_thrust, bow_at=0.38 * length,
        bow_fades=rng.uniform(1.5, 3.0) * speed, rudder_lift=rng.uniform(0.6, 0.9),
        rudder_drag=rng.uniform(0.4, 0.7), rudder_at=-0.48 * length, rudders=float(rudders),
        full=full,
    )  # fmt: skip
    windage = NO_WINDAGE
    if rng.random() < 0.67:
        lateral = rng.uniform(5.0, 8.0) * length * (length / 76.2)
        windage = Windage(
            rng.uniform(0.3, 0.45) * lateral, lateral, rng.uniform(0.5, 0.7),
            rng.uniform(0.85, 1.0), rng.uniform(0.5, 0.8), rng.uniform(0.0, 0.12) * length, length,
        )  # fmt: skip
    return Ship(
        family="linear_dp", name="Supply vessel", body=body, speed=speed, radius=12.0 * length,
        step=0.1, actuators=_actuators(c, length, rng), mixer=_mixer(full, rudders),
        noise=draw_noise(rng, length, speed), sensors=draw_sensors(rng, length), forces=forces,
        c=c, windage=windage, crabs=True, spins=True,
    )  # fmt: skip


def _actuators(c: Coefficients, length: float, rng: np.random.Generator) -> tuple[Actuator, ...]:
    most, slow = math.radians(40.0), rng.uniform(2.0, 5.0)
    blade = {"area_m2": round(0.0011 * length**2, 1), "span_m": round(0.042 * length, 2)}
    at, apart = round(c.screw_at, 1), round(c.apart, 1)
    found = [
        Actuator(
            "bow_thruster", "thruster", -c.full, c.full, (round(c.bow_at, 1), 0.0), slow,
            0.4 * c.full, drive=0, direction_deg=90.0,
        )
    ]  # fmt: skip
    sides = (("port", -apart, 1), ("starboard", apart, 2))
    for side, athwart, drive in sides:
        # a ship without rudders has its screws written down as thrusters, like the bow one
        kind, particulars = (
            ("propeller", {"diameter_m": round(0.04 * length, 2)})
            if c.rudders
            else ("thruster", {})
        )
        found.append(
            Actuator(
                f"screw_{side}",
                kind,
                -c.full,
                c.full,
                (at, athwart),
                slow,
                0.3 * c.full,
                drive,
                particulars=particulars,
            )
        )
    if c.rudders:
        for side, athwart, _ in sides:
            found.append(
                Actuator(
                    f"rudder_{side}", "rudder", -most, most, (round(c.rudder_at, 1), athwart), 1.5,
                    math.radians(4.0), particulars=blade,
                )
            )  # fmt: skip
    return tuple(found)


def _mixer(full: float, rudders: bool):
    def mixer(surge: float, turn: float, side: float) -> np.ndarray:
        def revolutions(share: float) -> float:
            return full * math.copysign(math.sqrt(min(abs(share), 1.0)), share)

        if rudders:
            twist, power = turn * 0.35 * (1.0 - 0.5 * abs(surge)), surge
        else:  # steered by the screws and the bow thruster: less power in a turn
            twist, power = 0.5 * turn, surge * (1.0 - 0.45 * abs(turn))
        order = [
            revolutions(0.8 * side + 0.6 * turn), revolutions(power + twist),
            revolutions(power - twist),
        ]  # fmt: skip
        if rudders:
            order += [turn * math.radians(35.0)] * 2
        return np.array(order)

    return mixer
