"""The KVLCC2 of the public package shipmmg (T. Mitsuyuki, PyPI), as it is.

Nothing of its equations is changed: MMG standard method, Yasukawa & Yoshimura (2015). We hand it
other numbers in its own parameters, and add accelerations from outside to the rates that it
returns. It knows no screw turning astern, no wind, no bank and no shallow water: none is asked.

    pip install '.[experiments]'
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.integrate import OdeSolver

from pipelines.experiments.other_families.effects import Effects
from pipelines.experiments.other_families.gear import gear_of, held, remember, sent
from pipelines.experiments.other_families.lines import External, add_external, external
from pipelines.experiments.other_families.ship import (
    Actuator,
    Body,
    Ship,
    about,
    draw_noise,
    draw_sensors,
    stream,
)

DENSITY = 1000.0  # kg/m³, of a towing tank
LENGTH = 7.0  # m, of the model in the package's own example
BASIC = {  # that example; lengths in m, masses over ½ρL²d or ½ρL⁴d
    "B": 1.27, "d": 0.46, "x_G": 0.25, "D_p": 0.216, "volume": 3.27, "A_R": 0.0539,
    "height": 0.345, "m_x": 0.022, "m_y": 0.223, "J_z": 0.011,
}  # fmt: skip
PLAIN = {
    "f_α": 2.747, "ε": 1.09, "t_R": 0.387, "a_H": 0.312, "γ_R_minus": 0.395, "γ_R_plus": 0.640,
    "l_R": -0.710, "κ": 0.50, "t_P": 0.220, "w_P0": 0.40, "x_P": -0.650,
}  # fmt: skip
HULL = {
    "k_0": 0.2931, "k_1": -0.2753, "k_2": -0.1385, "R_0_dash": 0.022, "X_vv_dash": -0.040,
    "X_vr_dash": 0.002, "X_rr_dash": 0.011, "X_vvvv_dash": 0.771, "Y_v_dash": -0.315,
    "Y_r_dash": 0.083, "Y_vvv_dash": -1.607, "Y_vvr_dash": 0.379, "Y_vrr_dash": -0.391,
    "Y_rrr_dash": 0.008, "N_v_dash": -0.137, "N_r_dash": -0.049, "N_vvv_dash": -0.030,
    "N_vvr_dash": -0.294, "N_vrr_dash": 0.055, "N_rrr_dash": -0.013,
}  # fmt: skip
SPEED, REVOLUTIONS = 0.65, 9.0  # m/s and rev/s in a harbour, of the 7 m model
STEP = 0.5  # s, of its integration
REFRESH = 60.0  # s, between two sets of parameters where the thrust drifts


@dataclasses.dataclass(frozen=True, slots=True)
class Particulars:
    """Keywords of the package's two parameter classes."""

    basic: dict[str, float]
    hull: dict[str, float]


class _Found(Exception):
    """Carries the right-hand side out of the package's call."""


class _Capture(OdeSolver):
    """A solver for the package's public `method`; it asks for nothing but the function."""

    def __init__(self, fun, *_: Any, **__: Any) -> None:
        raise _Found(fun)


def package():
    """The module shipmmg.mmg_3dof. Raises ValueError where it is not installed."""
    try:
        from shipmmg import mmg_3dof  # pyright: ignore[reportMissingImports]  # an optional extra
    except ImportError as error:
        raise ValueError(
            "The family shipmmg needs the package of that name: pip install '.[experiments]'."
        ) from error
    return mmg_3dof


def right_hand_side(basic: dict[str, float], hull: dict[str, float]) -> Callable[..., list[float]]:
    """f(t, (u, v, r, x, y, ψ, δ, n)) of the package for these parameters."""
    module = package()
    still = [0.0, 0.0]
    solver: Any = _Capture  # the package says str, and hands on what scipy takes
    try:
        module.simulate_mmg_3dof(
            module.Mmg3DofBasicParams(**basic), module.Mmg3DofManeuveringParams(**hull),
            [0.0, 1.0], still, still, ρ=DENSITY, method=solver,
        )  # fmt: skip
    except _Found as found:
        return found.args[0]
    raise RuntimeError("shipmmg did not use the solver that it was given.")


def hidden(c: Particulars, e: Effects, drift: float) -> Callable[..., list[float]]:
    """The same with what is hidden in its parameters; `drift`: share of thrust added by now."""
    basic, hull = dict(c.basic), dict(c.hull)
    hull["R_0_dash"] *= 1.0 + e.fouling
    basic["f_α"] *= 1.0 + e.rudder_force
    for name in ("k_0", "k_1", "k_2"):
        hull[name] *= (1.0 - e.thrust_loss) * (1.0 + drift)
    if e.payload:
        mass = basic["m"] + e.payload
        centre = (basic["m"] * basic["x_G"] + e.payload * e.payload_ahead) / mass
        basic["I_zG"] += basic["m"] * (basic["x_G"] - centre) ** 2
        basic["I_zG"] += e.payload * (e.payload_ahead - centre) ** 2
        basic["m"], basic["x_G"] = mass, centre
    return right_hand_side(basic, hull)


def move(
    ship: Ship, e: Effects, start: np.ndarray, duration: float, steer: Callable[..., np.ndarray],
    push: np.ndarray, side: np.ndarray, campaign: tuple[float, float],
) -> np.ndarray:  # fmt: skip
    """[K, 8] at `STEP`: x₀ y₀ ψ u v r δ n. The controls act as in the middle of each step.

    push [K, 3]  accelerations, side [K] N of a thruster that nobody records; both at `STEP`
    """
    c: Particulars = ship.c
    count = len(push)
    track = np.zeros((count, 8))
    track[0, :6] = start
    mass = masses(c, e)
    slope = e.thrust_drift * (campaign[1] - campaign[0])
    function = hidden(c, e, e.thrust_drift * campaign[0])
    acting = track[0, 6]
    order = np.zeros(2)
    gear = _Geared(e)
    outside = external(e.line, e.slow_tow, e.contact, ship.bank_east)
    for i in range(count - 1):
        time, share = i * STEP, i * STEP / duration
        if e.thrust_drift and i and i % round(REFRESH / STEP) == 0:
            function = hidden(c, e, e.thrust_drift * campaign[0] + slope * share)
        if i % round(1.0 / STEP) == 0:
            order = np.asarray(steer(time, track[i]))
        for j, one in enumerate(ship.actuators):
            wanted = (order[j] - track[i, 6 + j]) / max(one.time, STEP)
            track[i + 1, 6 + j] = track[i, 6 + j] + STEP * min(max(wanted, -one.rate), one.rate)
        behind = _behind(track[: i + 2, 6], i + 0.5 - e.rudder_delay / STEP)
        behind = gear.ordered(0, behind)
        angle = behind
        if e.rudder_lag > 0.0:  # in the middle of the step, as all controls
            before = acting
            acting += (behind - acting) * (1.0 - math.exp(-STEP / e.rudder_lag))
            angle = 0.5 * (before + acting)
        angle += e.rudder_offset[1]
        if e.rudder_limit > 0.0:
            angle = min(max(angle, -e.rudder_limit), e.rudder_limit)
        tow = campaign[0] + (campaign[1] - campaign[0]) * share
        turns = gear.ordered(1, 0.5 * (track[i, 7] + track[i + 1, 7]))
        controls = (gear.does(0, angle, tow), gear.does(1, turns, tow))
        gear.remember(track[i + 1, 6:])
        track[i + 1, :6] = _step(
            function, e, track[i, :6], controls, push[i], side[i], tow, mass, ship, outside
        )
    return track


class _Geared:
    """What `gear` does to the two controls, at this package's step."""

    def __init__(self, e: Effects) -> None:
        self.gear, self.stood = gear_of(2, e.gear), np.zeros(2)

    def ordered(self, j: int, order: float) -> float:
        if not self.gear.wrong:
            return order
        most = STEP * self.gear.rate[j]
        away = sent(self.gear, j, order) - self.stood[j]
        self.stood[j] += min(max(away, -most), most)
        return float(self.stood[j])

    def does(self, j: int, value: float, campaign: float) -> float:
        return held(self.gear, j, value, False, campaign) if self.gear.wrong else value

    def remember(self, orders: np.ndarray) -> None:
        if self.gear.wrong:
            remember(self.gear, orders)


def _behind(values: np.ndarray, at: float) -> float:
    """The value at a step that may be a fraction; the first one before the record."""
    before = int(max(at, 0.0))
    part = max(at, 0.0) - before
    return float(values[before] * (1.0 - part) + values[min(before + 1, len(values) - 1)] * part)


def _step(
    function, e: Effects, s, controls, push, side, tow, mass, ship: Ship, beyond: External
) -> np.ndarray:
    """One Runge-Kutta step of [6]; controls are those of the middle of the step."""

    def rate(s: np.ndarray) -> np.ndarray:
        x, y, psi, u, v, r = s.tolist()
        cos, sin = math.cos(psi), math.sin(psi)
        uc = e.current_north * cos + e.current_east * sin
        vc = -e.current_north * sin + e.current_east * cos
        f = function(0.0, (u - uc, v - vc, r, x, y, psi, *controls))
        north, east = tow * e.tow_north, tow * e.tow_east
        if e.tether:
            away = complex(e.tether_north - x, e.tether_east - y)
            away *= e.tether / math.hypot(abs(away), 0.5 * ship.length)
            north, east = north + away.real, east + away.imag
        outside = (north * cos + east * sin, east * cos - north * sin + side, side * e.device_at)
        if beyond.any:
            added = np.array(outside)
            add_external(beyond, x, y, psi, ship.body.breadth, tow, added)
            outside = tuple(added)
        more = mass @ outside
        return np.array([
            u * cos - v * sin, u * sin + v * cos, r, f[0] + more[0] + push[0] + r * vc,
            f[1] + more[1] + push[1] - r * uc, f[2] + more[2] + push[2],
        ])  # fmt: skip

    k1 = rate(s)
    k2 = rate(s + 0.5 * STEP * k1)
    k3 = rate(s + 0.5 * STEP * k2)
    k4 = rate(s + STEP * k3)
    return s + STEP / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)


def masses(c: Particulars, e: Effects) -> np.ndarray:
    """[3, 3] inverse mass matrix about midship of the package's own parameters."""
    b = c.basic
    m, moment = b["m"] + e.payload, b["m"] * b["x_G"] + e.payload * e.payload_ahead
    inertia = b["I_zG"] + b["m"] * b["x_G"] ** 2 + b["J_z"] + e.payload * e.payload_ahead**2
    return np.linalg.inv(
        np.array([[m + b["m_x"], 0, 0], [0, m + b["m_y"], moment], [0, moment, inertia]])
    )


def draw(seed: int) -> Ship:
    """4 to 14 m, each number within 12 % of the package's example."""
    package()
    rng = stream(seed, "shipmmg")
    length = float(rng.uniform(4.0, 14.0))
    s = length / LENGTH
    breadth, draught, diameter = BASIC["B"] * s, BASIC["d"] * s, BASIC["D_p"] * s
    mass = about(rng, BASIC["volume"], 0.03) * DENSITY * s**3
    square = 0.5 * DENSITY * length**2 * draught
    basic = {k: about(rng, v, 0.12) for k, v in PLAIN.items()} | {
        "L_pp": length, "B": breadth, "d": draught, "x_G": BASIC["x_G"] * s, "D_p": diameter,
        "m": mass, "I_zG": mass * (0.25 * length) ** 2, "A_R": BASIC["A_R"] * s * s,
        "η": diameter / (BASIC["height"] * s), "m_x": about(rng, BASIC["m_x"]) * square,
        "m_y": about(rng, BASIC["m_y"]) * square,
        "J_z": about(rng, BASIC["J_z"]) * square * length**2, "x_R": -0.5 * length,
        "x_H": -0.464 * length,
    }  # fmt: skip
    hull = {k: about(rng, v, 0.12) for k, v in HULL.items()}
    body = Body(
        mass, basic["x_G"], basic["I_zG"] + mass * basic["x_G"] ** 2, basic["m_x"], basic["m_y"],
        0.0, basic["J_z"], 1.0, 0.0, length, breadth, draught,
    )  # fmt: skip
    root = math.sqrt(s)
    speed, turns, most = SPEED * root, REVOLUTIONS / root, math.radians(35.0)
    blade = {"area_m2": round(basic["A_R"], 4), "span_m": round(BASIC["height"] * s, 3)}
    actuators = (
        Actuator(
            "rudder", "rudder", -most, most, (round(-0.5 * length, 2), 0.0), 0.3,
            math.radians(15.8) / root, particulars=blade,
        ),
        Actuator(
            "propeller", "propeller", 0.0, 1.4 * turns, (round(-0.48 * length, 2), 0.0), 1.0,
            turns, drive=0, particulars={"diameter_m": round(diameter, 3)},
        ),
    )  # fmt: skip

    def mixer(surge: float, turn: float, side: float) -> np.ndarray:
        return np.array([turn * most, max(surge, 0.0) * 1.4 * turns])

    return Ship(
        family="shipmmg", name="KVLCC2 model", body=body, speed=speed, radius=14.0 * length,
        step=STEP, actuators=actuators, mixer=mixer, noise=draw_noise(rng, length, speed),
        sensors=draw_sensors(rng, length), c=Particulars(basic, hull), reverses=False,
        own_motion=move,
    )  # fmt: skip
