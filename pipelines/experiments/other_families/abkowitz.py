"""A merchant ship with a polynomial hull: the Mariner of Chislett & Strøm-Tejsen (1965).

Hull: Abkowitz's (1964) polynomial with the derivatives measured on the Mariner class, as tabulated
by Fossen (1994, appendix E.1); primes are divided by ½ρL²U² for forces and ½ρL³U² for moments.
They hold ahead, at moderate drift. Below that we go on in our own way: linear terms by |u|, cubic
ones fade as drift grows, and a cross-flow drag with a drawn exponent takes their place.
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
    Windage,
    about,
    draw_noise,
    draw_sensors,
    stream,
)

LENGTH, BREADTH, DRAUGHT = 160.93, 23.17, 7.45  # m, of the Mariner class
SERVICE = 7.7175  # m/s, the 15 kn of the derivatives
SHAFT = 1.45  # rev/s then, of a 6.7 m screw
PRIMES = {  # Chislett & Strøm-Tejsen (1965), times 1e-5. Y_r and N_r without the rigid body's part
    "x_u": -184.0, "x_vv": -899.0, "x_rr": 18.0,
    "y_v": -1160.0, "y_r": 798.0 - 499.0, "y_vvv": -8078.0, "y_vvr": 15356.0,
    "n_v": -264.0, "n_r": -166.0 - 798.0 * 0.023, "n_vvv": 1636.0, "n_vvr": -5483.0,
    "y_d": 278.0, "y_ddd": -90.0, "n_d": -139.0, "n_ddd": 45.0, "x_dd": -95.0,
}  # fmt: skip
MASSES = {"mass": 798.0, "inertia": 39.2, "m_x": 42.0, "m_y": 748.0, "m_yr": 9.354, "j_z": 43.8}
GRAVITY = -0.023  # L

Coefficients = namedtuple(
    "Coefficients",
    "length speed shaft screw_at x_u surge_power x_vv x_rr y_v y_r y_vvv y_vvr n_v n_r n_vvv n_vvr "
    "cross cross_power cross_ends y_d y_ddd n_d n_ddd x_dd race thrust advance astern walk",
)


@njit
def hull(c, u, v, r, grow, cross, out):
    """Divided by ½ρL² and ½ρL³. Fading weight of the cubic terms: (u²/(u² + v² + (0.35 Lr)²))²."""
    lr = c.length * r
    speed2 = u * u + v * v + (0.35 * lr) ** 2
    near = (u * u / speed2) ** 2 if u > 0.0 else 0.0
    speed = math.sqrt(speed2) + 1e-6
    ahead = abs(u)
    # resistance: half of X_u at the speed of the derivatives, with the ship's own exponent
    straight = 0.5 * c.x_u * (ahead / c.speed) ** (c.surge_power - 2.0) if ahead > 1e-6 else 0.0
    x = straight * u * ahead * grow[0] + near * (c.x_vv * v * v * grow[1] + c.x_rr * lr * lr)
    y = grow[1] * (c.y_v * ahead * v + near * (c.y_vvv * v * v + c.y_vvr * v * lr) * v / speed)
    y += c.y_r * u * lr
    n = c.n_v * u * v + grow[2] * c.n_r * ahead * lr
    n += near * (c.n_vvv * v * v * v + grow[2] * c.n_vvr * v * v * lr) / speed
    # cross flow at five stations of equal width, fuller ends (form after Norrbin 1970)
    drag = (1.0 - near) * c.cross * grow[3] * cross
    for i in range(5):
        xi = -0.4 + 0.2 * i
        across = v + xi * lr
        one = 0.2 * drag * (1.0 + c.cross_ends * 4.0 * xi * xi)
        one *= abs(across) ** (c.cross_power - 1.0) * c.speed ** (2.0 - c.cross_power) * across
        y -= one
        n -= one * xi
    out[0], out[1], out[2] = x, y, n


@njit
def forces(c, u, v, r, acting, gain, grow, cross, aside, out):
    """Screw: bilinear thrust T = T_nn n|n| - T_nu |n| u (Blanke 1981). Rudder: the derivatives of
    the Mariner times (c/U₀)², with the flow c past the rudder from own speed and race (Norrbin
    1970); a reversed screw has no race there, and walks to starboard with its stern to port."""
    q = 0.5 * WATER * c.length**2
    hull(c, u, v, r, grow, cross, out)
    delta, turns = acting[0], acting[1] / c.shaft
    thrust = c.thrust * turns * abs(turns) - c.advance * abs(turns) * u / c.speed
    if turns < 0.0:
        thrust *= c.astern
    thrust *= gain[0]
    flow = (1.0 - c.race) * u * abs(u)
    if turns > 0.0:
        flow += c.race * (c.speed * turns) ** 2 * gain[0]
    cubed = delta**3
    walk = -c.walk * thrust if turns < 0.0 else 0.0
    side = aside * thrust - walk
    # positive angles turn the bow to starboard here, to port in the source
    out[0] = q * (out[0] + c.x_dd * abs(flow) * delta * delta) + thrust
    out[1] = q * (out[1] - flow * (c.y_d * delta + c.y_ddd * cubed)) + side
    out[2] = q * c.length * (out[2] - flow * (c.n_d * delta + c.n_ddd * cubed)) + side * c.screw_at


def draw(seed: int) -> Ship:
    """A sister of 90 to 260 m; its derivatives within 15 % of the published ones."""
    rng = stream(seed, "abkowitz")
    length = float(rng.uniform(90.0, 260.0))
    scale = length / LENGTH
    speed0, shaft = SERVICE * math.sqrt(scale), SHAFT / math.sqrt(scale)  # Froude
    primes = {k: about(rng, v) * 1e-5 for k, v in PRIMES.items()}
    masses = {k: about(rng, v, 0.08) * 1e-5 for k, v in MASSES.items()}
    q = 0.5 * WATER * length**2
    bollard = -q * primes["x_u"] * speed0**2 / about(rng, 0.82, 0.05)  # twice the service thrust
    c = Coefficients(
        length=length, speed=speed0, shaft=shaft, screw_at=-0.47 * length,
        surge_power=rng.uniform(1.75, 2.05), cross_power=rng.uniform(1.7, 2.0),
        cross=rng.uniform(0.55, 0.95) * DRAUGHT / LENGTH, cross_ends=rng.uniform(0.1, 0.7),
        race=rng.uniform(0.35, 0.6), thrust=bollard, advance=about(rng, 0.5, 0.1) * bollard,
        astern=rng.uniform(0.6, 0.85), walk=rng.uniform(0.03, 0.09), **primes,
    )  # fmt: skip
    m = masses["mass"] * q * length
    body = Body(
        mass=m, gravity=GRAVITY * length, inertia=masses["inertia"] * q * length**3,
        m_x=masses["m_x"] * q * length, m_y=masses["m_y"] * q * length,
        m_yr=masses["m_yr"] * q * length**2, j_z=masses["j_z"] * q * length**3,
        added=0.0, munk=0.0, length=length, breadth=BREADTH * scale, draught=DRAUGHT * scale,
    )  # fmt: skip
    harbour = 0.42 * speed0
    lateral = rng.uniform(9.0, 14.0) * length * scale
    windage = Windage(
        rng.uniform(0.18, 0.28) * lateral, lateral, rng.uniform(0.5, 0.65),
        rng.uniform(0.8, 0.95), rng.uniform(0.4, 0.7), rng.uniform(-0.06, 0.06) * length, length,
    )  # fmt: skip
    most = math.radians(35.0)
    actuators = (
        Actuator(
            "rudder", "rudder", -most, most, (round(-0.5 * length, 1), 0.0), 2.0,
            math.radians(rng.uniform(2.3, 4.0)),
            particulars={
                "area_m2": round(0.018 * length * body.draught, 1),
                "span_m": round(0.75 * body.draught, 2),
            },
        ),
        Actuator(
            "propeller", "propeller", round(-0.75 * shaft, 2), round(0.75 * shaft, 2),
            (round(c.screw_at, 1), 0.0), rng.uniform(5.0, 12.0), 0.05 * shaft, drive=0,
            particulars={"diameter_m": round(6.7 * scale, 2)},
        ),
    )  # fmt: skip

    def mixer(surge: float, turn: float, side: float) -> np.ndarray:
        return np.array([turn * most, surge * 0.75 * shaft])

    return Ship(
        family="abkowitz", name="Cargo ship", body=body, speed=harbour, radius=14.0 * length,
        step=0.1, actuators=actuators, mixer=mixer, noise=draw_noise(rng, length, harbour),
        sensors=draw_sensors(rng, length), forces=forces, c=c, windage=windage, cross_flow=True,
    )  # fmt: skip
