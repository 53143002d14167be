"""A container ship that heels as it turns: the S175 of Son & Nomoto (1981), in four degrees.

Hull, screw and rudder: their coefficients and equations, as Fossen's MSS (`container.m`) has them;
primes are divided by ½ρL²U² and ½ρL³U², U the ship's own speed. They hold ahead at moderate drift
(`roll.ahead_share`); beyond, linear terms by |u| and a cross-flow drag are ours, as is the screw
that turns astern: without a race, with a share of its thrust, and a walk of its stern to port.
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

LENGTH, BREADTH, DRAUGHT = 175.0, 25.40, 8.50  # m
VOLUME, METACENTRIC = 21222.0, 0.3  # m³, GM in m
DIAMETER, RUDDER_AREA, ASPECT = 6.533, 33.0376, 1.8219
GRAVITY = 9.81
MASSES = {
    "m": 0.00792, "m_x": 0.000238, "m_y": 0.007049, "i_x": 0.0000176, "j_x": 0.0000034,
    "i_z": 0.000456, "j_z": 0.000419,
}  # fmt: skip
ALPHA_Y, L_X, L_Y = 0.05, 0.0313, 0.0313  # L: where the added masses act
HULL = {
    "x_uu": -0.0004226, "x_vr": -0.00311, "x_rr": 0.00020, "x_ff": -0.00020, "x_vv": -0.00386,
    "k_v": 0.0003026, "k_r": -0.000063, "k_p": -0.0000075, "k_f": -0.000021, "k_vvv": 0.002843,
    "k_rrr": -0.0000462, "k_vvr": -0.000588, "k_vrr": 0.0010565, "k_vvf": -0.0012012,
    "k_vff": -0.0000793, "k_rrf": -0.000243, "k_rff": 0.00003569,
    "y_v": -0.0116, "y_r": 0.00242, "y_f": -0.000063, "y_vvv": -0.109, "y_rrr": 0.00177,
    "y_vvr": 0.0214, "y_vrr": -0.0405, "y_vvf": 0.04605, "y_vff": 0.00304, "y_rrf": 0.009325,
    "y_rff": -0.001368,
    "n_v": -0.0038545, "n_r": -0.00222, "n_p": 0.000213, "n_f": -0.0001424, "n_vvv": 0.001492,
    "n_rrr": -0.00229, "n_vvr": -0.0424, "n_vrr": 0.00156, "n_vvf": -0.019058,
    "n_vff": -0.0053766, "n_rrf": -0.0038592, "n_rff": 0.0024195,
}  # fmt: skip
SCREW = {"k_t0": 0.527, "k_t1": -0.455, "wake": 0.184, "tau": 1.09, "x_p": -0.526, "t": 0.175}
RUDDER = {
    "kappa": 0.631, "epsilon": 0.921, "x_r": -0.5, "gamma": 0.088, "c_r": -0.156,
    "c_rrr": -0.275, "c_rrv": 1.96, "c_x": 0.71, "a_h": 0.237, "z_r": 0.033, "x_h": -0.48,
}  # fmt: skip
HARBOUR = 4.0  # m/s, of the published ship; its service speed is some 11
REVOLUTIONS = 1.1  # rev/s at full ahead in a harbour
BILGE = 0.03  # of critical: damping of roll at no speed, which the source does not need

Coefficients = namedtuple(
    "Coefficients",
    ["length", "draught", "diameter", "area", "righting", "bilge", "drag", "astern", "walk",
     "m_x", "m_y", *HULL, *SCREW, *RUDDER],
)  # fmt: skip


@njit
def forces(c, u, v, r, phi, p, acting, gain, grow, cross, aside, out):
    """X, Y, N, K at midship into `out` [4]."""
    length, lr, lp = c.length, c.length * r, c.length * p
    q = 0.5 * WATER * length**2
    speed = math.sqrt(u * u + v * v)
    near = ahead_share(u, v, lr)
    along, signed = near * speed + (1.0 - near) * abs(u), near * speed + (1.0 - near) * u
    cubed = near / (speed + 1e-9)
    x = grow[0] * c.x_uu * u * abs(u) + c.m_y * v * lr
    x += near * (c.x_vr * v * lr + c.x_vv * v * v + c.x_rr * lr * lr + c.x_ff * (phi * speed) ** 2)
    y = grow[1] * c.y_v * along * v + c.y_r * signed * lr - c.m_x * u * lr
    y += near * c.y_f * phi * speed**2
    n = c.n_v * signed * v + grow[2] * c.n_r * along * lr + near * c.n_p * lp * speed
    n += near * c.n_f * phi * speed**2
    k = c.k_v * along * v + c.k_r * signed * lr + c.k_p * along * lp + c.m_x * L_X * u * lr
    k += near * c.k_f * phi * speed**2
    heel, twice = phi * speed, phi * phi * speed * speed
    y += cubed * (c.y_vvv * v**3 + c.y_rrr * lr**3 + c.y_vvr * v * v * lr + c.y_vrr * v * lr * lr)
    y += cubed * (c.y_vvf * v * v * heel + c.y_vff * v * twice)
    y += cubed * (c.y_rrf * lr * lr * heel + c.y_rff * lr * twice)
    n += cubed * (c.n_vvv * v**3 + c.n_rrr * lr**3 + c.n_vvr * v * v * lr + c.n_vrr * v * lr * lr)
    n += cubed * (c.n_vvf * v * v * heel + c.n_vff * v * twice)
    n += cubed * (c.n_rrf * lr * lr * heel + c.n_rff * lr * twice)
    k += cubed * (c.k_vvv * v**3 + c.k_rrr * lr**3 + c.k_vvr * v * v * lr + c.k_vrr * v * lr * lr)
    k += cubed * (c.k_vvf * v * v * heel + c.k_vff * v * twice)
    k += cubed * (c.k_rrf * lr * lr * heel + c.k_rff * lr * twice)
    drag_y, drag_n = cross_flow(length, c.draught, c.drag, v, r)
    beyond = (1.0 - near) * grow[3] * cross

    # screw: K_T = 0.527 - 0.455 J, whole in n and u; inflow of the source, ahead
    turns = acting[1]
    inflow = u * (1.0 - c.wake)
    if u > 0.0:
        inflow = u * (1.0 - c.wake + near * c.tau * ((v + c.x_p * lr) / (speed + 1e-9)) ** 2)
    thrust = c.k_t0 * turns * abs(turns) + c.k_t1 * abs(turns) * inflow / c.diameter
    thrust *= WATER * c.diameter**4 * gain[0]
    if turns < 0.0:
        thrust *= c.astern
    # rudder: FN = -½ρ A 6.13 Λ/(Λ + 2.25) U_R² sin α_R; the race adds 8 k K_T n² D²/π to u_P²
    race = 8.0 * c.kappa * max(thrust, 0.0) / (math.pi * WATER * c.diameter**2)
    square = inflow * abs(inflow) + race
    along_r = c.epsilon * math.copysign(math.sqrt(abs(square)), square)
    turning = lr / (speed + 1e-9)
    aside_r = c.gamma * v
    if near > 0.0:
        aside_r += (
            near
            * speed
            * (c.c_r * turning + c.c_rrr * turning**3 + c.c_rrv * turning**2 * v / (speed + 1e-9))
        )
    delta = acting[0]
    attack = delta + math.atan2(aside_r, abs(along_r) + 1e-9)
    push = 6.13 * ASPECT / (ASPECT + 2.25) * 0.5 * WATER * c.area
    push *= -(along_r * abs(along_r) + math.copysign(aside_r**2, along_r)) * math.sin(attack)
    side = (1.0 + c.a_h) * push * math.cos(delta)
    screw = aside * thrust + (c.walk * thrust if turns < 0.0 else 0.0)
    lever = c.x_r + c.a_h * c.x_h
    out[0] = q * x + (1.0 - c.t) * thrust + c.c_x * push * math.sin(delta)
    out[1] = q * y + beyond * drag_y + side + screw
    out[2] = q * length * n + beyond * drag_n + length * lever * push * math.cos(delta)
    out[2] += c.x_p * length * screw
    out[3] = q * length * k - c.z_r * length * side - c.righting * math.sin(phi) - c.bilge * p


def draw(seed: int) -> Ship:
    """A sister of 120 to 250 m; its coefficients within 10 % of the published ones."""
    rng = stream(seed, "container")
    return sister(rng, float(rng.uniform(120.0, 250.0)), 0.10)


def sister(rng: np.random.Generator, length: float, spread: float) -> Ship:
    """`spread` 0 and 175 m are the published ship, but for what the source does not have."""
    scale = length / LENGTH
    root = math.sqrt(scale)  # Froude
    hull, screw, rudder = (
        {name: about(rng, value, spread) for name, value in table.items()}
        for table in (HULL, SCREW, RUDDER)
    )
    rudder |= {"x_r": -0.5, "x_h": RUDDER["x_h"]}
    primes = {name: about(rng, value, 0.5 * spread) for name, value in MASSES.items()}
    q = 0.5 * WATER * length**2
    mass = primes["m"] * q * length
    weight = WATER * GRAVITY * VOLUME * scale**3
    righting = weight * METACENTRIC * scale * (1.0 + spread * rng.uniform(0.0, 15.0))
    inertia = (primes["i_x"] + primes["j_x"]) * q * length**3
    m_y = primes["m_y"]
    coupled = np.array([
        [primes["m"] + m_y, -m_y * L_Y, m_y * ALPHA_Y],
        [-m_y * L_Y, primes["i_x"] + primes["j_x"], 0.0],
        [m_y * ALPHA_Y, 0.0, primes["i_z"] + primes["j_z"]],
    ])  # fmt: skip
    units = np.array([1.0, length, length])
    matrix = coupled * q * length * np.outer(units, units)
    c = Coefficients(
        length=length, draught=DRAUGHT * scale, diameter=DIAMETER * scale,
        area=RUDDER_AREA * scale**2, righting=righting,
        bilge=2.0 * BILGE * math.sqrt(righting * inertia), drag=rng.uniform(0.6, 0.9),
        astern=rng.uniform(0.55, 0.8), walk=rng.uniform(0.03, 0.08), m_x=primes["m_x"], m_y=m_y,
        **hull, **screw, **rudder,
    )  # fmt: skip
    body = Body(
        mass=mass, gravity=0.0, inertia=primes["i_z"] * q * length**3,
        m_x=primes["m_x"] * q * length, m_y=m_y * q * length, m_yr=m_y * ALPHA_Y * q * length**2,
        j_z=primes["j_z"] * q * length**3, added=0.0, munk=0.0, length=length,
        breadth=BREADTH * scale, draught=DRAUGHT * scale,
    )  # fmt: skip
    harbour, full = HARBOUR * root, REVOLUTIONS / root
    lateral = rng.uniform(12.0, 17.0) * length * scale
    windage = Windage(
        rng.uniform(0.16, 0.24) * lateral, lateral, rng.uniform(0.5, 0.65),
        rng.uniform(0.85, 0.95), rng.uniform(0.4, 0.6), rng.uniform(-0.05, 0.05) * length, length,
    )  # fmt: skip
    most = math.radians(35.0)
    actuators = (
        Actuator(
            "rudder", "rudder", -most, most, (round(-0.5 * length, 1), 0.0), 2.0,
            math.radians(rng.uniform(2.3, 4.5)),
            particulars={
                "area_m2": round(c.area, 1), "span_m": round(math.sqrt(c.area * ASPECT), 2),
            },
        ),
        Actuator(
            "propeller", "propeller", round(-full, 2), round(full, 2),
            (round(c.x_p * length, 1), 0.0), rng.uniform(5.0, 10.0), 0.07 * full, drive=0,
            particulars={"diameter_m": round(c.diameter, 2)},
        ),
    )  # fmt: skip

    def mixer(surge: float, turn: float, side: float) -> np.ndarray:
        return np.array([turn * most, surge * full])

    return Ship(
        family="container", name="Container ship", body=body, speed=harbour, radius=14.0 * length,
        step=0.1, actuators=actuators, mixer=mixer, noise=draw_noise(rng, length, harbour),
        sensors=draw_sensors(rng, length), forces=forces, c=c, windage=windage, cross_flow=True,
        roll=Roll(matrix, 0.0, 0.8 * body.draught),
    )  # fmt: skip
