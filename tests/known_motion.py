"""Ships whose motion is written down, their instruments, and the table that ingest makes of them.

Nothing here is shared with the program: the angles, frames and units are worked out again.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
import polars as pl

from shiplog.ship_profile import file as profiles
from shiplog.ship_profile.profile import Profile

FINE = 20  # steps of the motion a row of 0.1 s
KNOT = 1852.0 / 3600.0
TO_SI = {
    "m/s": 1.0, "kn": KNOT, "km/h": 1 / 3.6, "mph": 0.44704, "cm/s": 0.01, "deg": math.pi / 180,
    "rad": 1.0, "deg/s": math.pi / 180, "rad/s": 1.0, "deg/min": math.pi / 10_800, "m": 1.0,
    "ft": 0.3048, "rps": 1.0, "rpm": 1 / 60, "1": 1.0,
}  # fmt: skip


@dataclass
class Sailed:
    """What is true at 10 Hz: SI, [n]; drives: actuator → [n] in SI."""

    time: np.ndarray
    heading: np.ndarray
    rate: np.ndarray
    surge: np.ndarray
    sway: np.ndarray
    north: np.ndarray
    east: np.ndarray
    drives: dict[str, np.ndarray] = field(default_factory=dict)


def sailed(seconds, rate, surge, sway=None, heading=0.7, current=(0.0, 0.0), drives=None) -> Sailed:
    """From functions of time: rate [rad/s], surge and sway through the water [m/s]."""
    dt = 0.1 / FINE
    t = np.arange(round(seconds / dt) + 1) * dt
    r, u = rate(t) + 0 * t, surge(t) + 0 * t
    v = (sway(t) if sway else 0.0) + 0 * t
    psi = heading + integral(r, dt)
    north = integral(u * np.cos(psi) - v * np.sin(psi) + current[0], dt)
    east = integral(u * np.sin(psi) + v * np.cos(psi) + current[1], dt)
    # what is measured in body axes is over ground
    u = u + current[0] * np.cos(psi) + current[1] * np.sin(psi)
    v = v - current[0] * np.sin(psi) + current[1] * np.cos(psi)
    driven = {name: one(t) + 0 * t for name, one in (drives or {}).items()}
    pick = slice(None, None, FINE)
    psi, r, u, v, north, east = (a[pick] for a in (psi, r, u, v, north, east))
    drives = {name: one[pick] for name, one in driven.items()}
    return Sailed(t[pick], psi, r, u, v, north, east, drives)


def integral(rate, dt):
    return np.concatenate(([0.0], np.cumsum(0.5 * dt * (rate[1:] + rate[:-1]))))


def swinging(seconds=900.0, speed=3.0, turn=3.0, length_s=10.0, **more) -> Sailed:
    """A ship that turns to both sides: δ = A sin ωt + B sin ω't, r by Nomoto of time constant T in
    closed form, and a propeller that is slowed and hastened, u by the same equation."""
    k, lag = 0.15 * 3.0 / length_s, length_s
    waves = ((math.radians(turn * 5.0), 0.061, 0.0), (math.radians(turn * 3.0), 0.023, 1.0))
    pace = ((0.35, 0.037, 0.0), (0.2, 0.0121, 2.0))

    def rudder(t):
        return sum(a * np.sin(w * t + p) for a, w, p in waves)

    def rate(t):
        return sum(
            k * a * np.sin(w * t + p - math.atan(w * lag)) / math.hypot(1.0, w * lag)
            for a, w, p in waves
        )

    def shaft(t):  # n²
        return 25.0 * (1.0 + sum(a * np.sin(w * t + p) for a, w, p in pace))

    def surge(t):
        return speed * (1.0 + sum(
            0.6 * a * np.sin(w * t + p - math.atan(w * lag)) / math.hypot(1.0, w * lag)
            for a, w, p in pace
        ))  # fmt: skip

    def sway(t):
        return -0.25 * length_s * rate(t)  # the bow points into the turn

    drives = {"rudder": rudder, "propeller": lambda t: np.sqrt(shaft(t))}
    return sailed(seconds, rate, surge, sway, drives=drives, **more)


POSITIONS = {"geodetic": ("latitude", "longitude"), "local": ("x0", "y0")}
VELOCITIES = {"sog_cog": ("sog", "cog"), "ned": ("north", "east"), "enu": ("east", "north"),
              "body": ("surge", "sway")}  # fmt: skip
LEVEL = (54.0, 10.0)  # deg: where x0 = y0 = 0
METRE = (111_320.0, 111_320.0 * math.cos(math.radians(54.0)))  # m a degree, near enough here


@dataclass
class Noise:
    """One standard deviation: m, m/s, deg, deg, deg/s."""

    position: float = 0.05
    speed: float = 0.02
    course: float = 0.5
    heading: float = 0.2
    rate: float = 0.05


def measured(ship: Sailed, velocity="sog_cog", position="geodetic", noise=None, seed=1):
    """Raw columns in the units of `profile`: deg, m/s, deg/s."""
    g, n, e = np.random.default_rng(seed), len(ship.time), noise or Noise()
    c, s = np.cos(ship.heading), np.sin(ship.heading)
    vn, ve = c * ship.surge - s * ship.sway, s * ship.surge + c * ship.sway
    x = ship.north + e.position * g.normal(size=n)
    y = ship.east + e.position * g.normal(size=n)
    if position == "geodetic":
        raw = {"p0": LEVEL[0] + x / METRE[0], "p1": LEVEL[1] + y / METRE[1]}
    else:
        raw = {"p0": x, "p1": y}
    speed = [e.speed * g.normal(size=n) for _ in range(2)]
    if velocity == "sog_cog":
        course = np.degrees(np.arctan2(ve, vn)) + e.course * g.normal(size=n)
        raw |= {"v0": np.hypot(vn, ve) + speed[0], "v1": course % 360.0}
    else:
        both = {"ned": (vn, ve), "enu": (ve, vn), "body": (ship.surge, ship.sway)}[velocity]
        raw |= {"v0": both[0] + speed[0], "v1": both[1] + speed[1]}
    raw["heading"] = (np.degrees(ship.heading) + e.heading * g.normal(size=n)) % 360.0
    raw["rate"] = np.degrees(ship.rate) + e.rate * g.normal(size=n)
    raw |= ship.drives
    return raw


def profile(velocity="sog_cog", position="geodetic", length=10.0, rate=True, actuators=None,
            units=("m/s", "deg"), heading="deg", rate_unit="deg/s") -> Profile:  # fmt: skip
    """What the user says that the columns are."""
    at = ', unit = "deg"' if position == "geodetic" else ', unit = "m"'
    of_velocity = f"units = {list(units)}" if velocity == "sog_cog" else f'unit = "{units[0]}"'
    gyro = f'yaw_rate = {{ topic = "/g", field = "rate", unit = "{rate_unit}" }}' if rate else ""
    driven = RUDDER_AND_PROPELLER if actuators is None else actuators
    return profiles.parse(f"""
        ship = {{ name = "known", length_m = {length} }}
        actuators = [{", ".join(driven)}]
        [sensors]
        position = {{ kind = "{position}", topic = "/p", fields = ["p0", "p1"]{at} }}
        velocity = {{ kind = "{velocity}", topic = "/v", fields = ["v0", "v1"], {of_velocity} }}
        heading = {{ topic = "/g", field = "heading", unit = "{heading}" }}
        {gyro}
        """.replace("'", '"'), "known.toml")  # fmt: skip


def actuator(name, kind, x=0.0, y=0.0, direction=0.0, unit="1", diameter=None):
    of = f", diameter_m = {diameter}" if diameter else ""
    return (
        f'{{ name = "{name}", kind = "{kind}", topic = "/{name}", field = "value", '
        f'unit = "{unit}", position_m = [{x}, {y}], direction_deg = {direction}{of} }}'
    )


RUDDER_AND_PROPELLER = (
    actuator("rudder", "rudder", -5.0, unit="rad"),
    actuator("propeller", "propeller", -4.8, unit="rps", diameter=0.6),
)


def table(raw: dict, p: Profile) -> pl.DataFrame:
    """What ingest makes of raw columns at 10 Hz: SI at midship (no lever arm here)."""
    kind = p.sensors.kind("velocity")
    n = len(raw["heading"])
    units = p.sensors.velocity.units or (p.sensors.velocity.unit,) * 2
    first, second = raw["v0"] * TO_SI[units[0]], raw["v1"] * TO_SI[units[1]]
    if kind == "sog_cog":
        vn, ve = first * np.cos(second), first * np.sin(second)
    else:
        vn, ve = (second, first) if kind == "enu" else (first, second)
    psi = raw["heading"] * TO_SI[p.sensors.heading.unit]
    psi = np.arctan2(np.sin(psi), np.cos(psi))
    c, s = np.cos(psi), np.sin(psi)
    u, v = (vn, ve) if kind == "body" else (c * vn + s * ve, c * ve - s * vn)
    if p.sensors.kind("position") == "geodetic":
        place = np.array([raw["p0"][0], raw["p1"][0]])
        x = (raw["p0"] - place[0]) * METRE[0]
        y = (raw["p1"] - place[1]) * METRE[0] * math.cos(math.radians(place[0]))
    else:
        x, y = raw["p0"], raw["p1"]
    if p.sensors.yaw_rate is not None:
        r = raw["rate"] * TO_SI[p.sensors.yaw_rate.unit]
    else:
        r = np.gradient(np.unwrap(psi), 0.1)
    columns = {"x0": x, "surge": u, "y0": y, "sway": v, "heading": psi, "yaw_rate": r}
    columns |= {name: raw[name] for name in p.actuator_names}
    return pl.DataFrame({"time": 0.1 * np.arange(n), **columns, "quality": np.zeros(n, np.int32)})


def steered(seconds, helm, shaft, length=20.0, speed=4.0, seed=1, waves=0.0, current=(0.0, 0.0),
            heading=0.7, wind=0.0) -> Sailed:  # fmt: skip
    """A ship that answers: T r' = K δ - r and u' = a n|n| - b u|u| with n = 5 for `speed`, waves as
    a yaw of `waves` [deg/s] and gusts as sway of `wind` [m/s]; helm and shaft are functions of
    (time, heading, rate, surge) so that an autopilot can be one of them. The rudder needs flow: it
    turns the stern the other way when the ship goes astern, unless the propeller blows on it."""
    dt, g = 0.05, np.random.default_rng(seed)
    count = round(seconds / dt) + 1
    lag, gain = length / speed, 0.9 * speed / length
    psi, r, u = heading, 0.0, 0.0 if shaft(0.0, heading, 0.0, 0.0) == 0 else speed
    rows = np.zeros((count, 5))
    swell, gust = 0.0, 0.0
    for i in range(count):
        t = i * dt
        delta, n = helm(t, psi, r, u), shaft(t, psi, r, u)
        rows[i] = psi, r + swell, u, delta, n
        flow = (u * abs(u) + 0.5 * max(n, 0.0) ** 2 * (speed / 5.0) ** 2) / (1.5 * speed**2)
        r += dt * (gain * delta * flow - r) / lag
        u += dt * (n * abs(n) / 25.0 * speed**2 - u * abs(u)) * 0.5 / length
        swell = math.radians(waves) * math.sin(math.tau * t / 7.0 + math.sin(0.13 * t))
        gust += dt * (-gust / 20.0) + math.sqrt(dt) * 0.2 * wind * g.normal()
        psi += dt * (r + swell)
        rows[i, 4] = n
    pick = rows[::2]
    t = 0.1 * np.arange(len(pick))
    psi, rate, u = pick[:, 0], pick[:, 1], pick[:, 2]
    v = -0.2 * length * rate + wind * np.sin(psi - 1.0)
    c, s = np.cos(psi), np.sin(psi)
    vn, ve = c * u - s * v + current[0], s * u + c * v + current[1]
    over = Sailed(t, psi, rate, c * vn + s * ve, c * ve - s * vn, integral(vn, 0.1),
                  integral(ve, 0.1), {"rudder": pick[:, 3], "propeller": pick[:, 4]})  # fmt: skip
    return over
